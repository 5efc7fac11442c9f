from math import log

given = task.given  # noqa: F821 - runs in the lesson's notebook
books = given.start_mJ + given.work_mJ + given.bounce_mJ + given.heat_mJ + given.fall_mJ
answer_1 = log(given.e1 / given.e2) / log(given.dt1 / given.dt2)
answer_2 = given.dt2 * (given.wanted / given.e2) ** (1 / answer_1)
answer_3 = given.residual_uJ / 1000 / books
answer_4 = (given.r_mm + given.thick_mm / 2) / 1000 / given.v
