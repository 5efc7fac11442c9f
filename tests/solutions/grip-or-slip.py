from math import acos, cos, degrees, pi, sin, sqrt

given = task.given  # noqa: F821 - runs in the lesson's notebook
ride = given.R + given.r
u0 = given.v0**2 / (9.81 * ride)
low, high = 0.0, pi / 2
while high - low > 1e-12:  # halve until sin φ = µ (cos φ - u0)
    middle = (low + high) / 2
    if sin(middle) < given.mu * (cos(middle) - u0):
        low = middle
    else:
        high = middle
answer_1 = degrees(acos(u0))
answer_2 = degrees(low)
answer_3 = degrees(acos((3 * u0 + 4) / 7))
answer_4 = sqrt(9.81 * ride)
