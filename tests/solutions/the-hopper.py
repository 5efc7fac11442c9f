from math import sqrt

given = task.given  # noqa: F821 - runs in the lesson's notebook
flow = (given.N2 - given.N1) / (given.t2 - given.t1)
edges = given.k * given.mm
answer_1 = flow
answer_2 = flow * ((given.W2 - edges) / (given.W - edges)) ** 1.5
answer_3 = given.N2 / flow * sqrt(9.81 / given.g2)
grown = given.q ** (2 / 3)
answer_4 = given.W2 * (1 - grown / 2) / (1 - grown)
