from math import atan, degrees, pi

given = task.given  # noqa: F821 - runs in the lesson's notebook
answer_1 = degrees(atan(given.h / (given.b / 2)))
answer_2 = degrees(atan(min(given.mu, given.c)))
area = 10 * given.h * 10 * given.b / 2
answer_3 = 0.84 * area / (pi * given.mm**2)
answer_4 = given.grams / 1000 * 9.81 * (given.H / 100 - given.h / 300)
