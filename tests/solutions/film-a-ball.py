from math import sqrt

given = task.given  # noqa: F821 - runs in the lesson's notebook
down, up = given.y0 - given.r, given.y1 - given.r
epsilon = sqrt(up / down)
answer_1 = epsilon
answer_2 = (given.c3 - given.c2) / (given.c2 - given.c1)
answer_3 = 2 * down / (given.n / given.f) ** 2
answer_4 = sqrt(2 * down / 9.81) * (1 + 2 * epsilon / (1 - epsilon))
