given = task.given  # noqa: F821 - runs in the lesson's notebook
mass = given.grams / 1000
slip = given.vb + given.e * given.v0
answer_1 = mass * given.vb * slip
answer_2 = 0.5 * mass * slip**2
answer_3 = slip / (given.mu * 9.81)
answer_4 = given.rate * answer_1
