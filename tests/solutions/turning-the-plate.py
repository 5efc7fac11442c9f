from math import atan, cos, degrees, hypot, radians, sin

given = task.given  # noqa: F821 - runs in the lesson's notebook
alpha = radians(given.alpha)
into = given.v0 * cos(alpha) - given.vy * sin(alpha)
along = given.v0 * sin(alpha) + given.vy * cos(alpha)
answer_1 = into
answer_2 = hypot(along, given.e * into)
answer_3 = along * sin(alpha) - given.e * into * cos(alpha)
answer_4 = degrees(atan(given.v0**2 / (2 * 9.81 * (given.R + given.d))))
