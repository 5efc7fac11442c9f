from math import acos, degrees, sqrt

given = task.given  # noqa: F821 - runs in the lesson's notebook
ride = given.R + given.r
cosine = given.v0**2 / (9.81 * ride)
answer_1 = sqrt(9.81 * ride)
answer_2 = degrees(acos(cosine))
answer_3 = given.v0**2 / 9.81
answer_4 = -given.v0 * sqrt(1 - cosine**2)
