from math import exp, sin, sqrt

given = task.given  # noqa: F821 - runs in the lesson's notebook
m, v = given.grams / 1000, given.v
# Momentum about the hinge, m l v' + I w = m l v, and restitution, l w - v' = e v: Cramer's rule.
a, b, c, d = m * given.l, given.I, -1.0, given.l
right = m * given.l * v, given.e * v
after = (right[0] * d - b * right[1]) / (a * d - b * c)
turns = (a * right[1] - right[0] * c) / (a * d - b * c)
decay = given.c / (2 * given.I)
swift = sqrt(given.k / given.I - decay**2)
early, late = 1.5 / swift, 4.5 / swift
while late - early > 1e-12:  # halve until exp(-δ t) sin(ω t) = 0
    t = (early + late) / 2
    if exp(-decay * t) * sin(swift * t) > 0:
        early = t
    else:
        late = t
answer_1 = 1000 * given.I / given.l**2
answer_2 = after
answer_3 = 1000 * 0.5 * given.I * turns**2
answer_4 = early
