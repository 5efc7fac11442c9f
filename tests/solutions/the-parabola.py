from math import atan2, degrees, hypot, sqrt

given = task.given  # noqa: F821 - runs in the lesson's notebook
answer_1 = sqrt(2 * given.h / 9.81)
answer_2 = given.v0 * answer_1
answer_3 = hypot(given.v0, 9.81 * answer_1)
answer_4 = degrees(atan2(9.81 * answer_1, given.v0))
