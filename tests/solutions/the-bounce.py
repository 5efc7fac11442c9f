from math import hypot, sqrt

given = task.given  # noqa: F821 - runs in the lesson's notebook
falling = 9.81 * (given.R + given.d - given.r) / given.v0
answer_1 = -given.e * given.v0
answer_2 = hypot(given.e * given.v0, falling)
answer_3 = given.e * given.v0 * (sqrt(falling**2 + 2 * 9.81 * given.d2) - falling) / 9.81
answer_4 = 0.5 * given.grams / 1000 * given.v0**2 * (1 - given.e**2)
