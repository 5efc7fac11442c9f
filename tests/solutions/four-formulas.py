from math import acos, cos, degrees, pi, sin

given = task.given  # noqa: F821 - runs in the lesson's notebook
depth = given.cm / 100
u = given.v0**2 / (9.81 * given.R)
middle = given.R + depth / 2
speed = given.v0 * middle / given.R
low, high = 0.0, depth
while high - low > 1e-12:  # halve until as much passes as on the belt
    thin = (low + high) / 2
    if (given.R + thin / 2) * thin / given.R < depth:
        low = thin
    else:
        high = thin
first, last = 0.0, pi / 2
while last - first > 1e-12:  # halve until sin α = µ (cos α - u)
    angle = (first + last) / 2
    if sin(angle) < given.mu * (cos(angle) - u):
        first = angle
    else:
        last = angle
answer_1 = degrees(acos(u))
answer_2 = degrees(acos(speed**2 / (9.81 * middle)))
answer_3 = 1000 * low
answer_4 = degrees(first)
