from math import sqrt

given = task.given  # noqa: F821 - runs in the lesson's notebook
falling = 9.81 * (given.R + given.d - given.mm / 1000) / given.v0


def time(fall):
    return (sqrt(falling**2 + 2 * 9.81 * fall) - falling) / 9.81


answer_1 = given.rate * given.grams / 1000
answer_2 = given.v0 / given.rate
answer_3 = given.e * given.v0 * (time(given.d2 + given.bed) - time(given.d2))
answer_4 = answer_1 * given.vb * (given.vb + given.e * given.v0)
