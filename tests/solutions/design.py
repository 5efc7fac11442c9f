from math import cos, hypot, radians, sin

given = task.given  # noqa: F821 - runs in the lesson's notebook


def forward(alpha, e):
    """Velocity forward after the plate: the part along its normal comes back, times ε."""
    normal = (-cos(radians(alpha)), -sin(radians(alpha)))
    into = given.v0 * normal[0] - given.vy * normal[1]
    return given.v0 - (1 + e) * into * normal[0]


def search(low, high, wanted, of):
    """Where a growing function has the value that is wanted."""
    for _ in range(60):
        middle = (low + high) / 2
        low, high = (middle, high) if of(middle) < wanted else (low, middle)
    return low


price = given.paid / 1000 / (given.grams / 1000 * given.vb)
by_angle = (forward(given.alpha + 0.01, given.e) - forward(given.alpha - 0.01, given.e)) / 0.02
by_e = (forward(given.alpha, given.e + 0.01) - forward(given.alpha, given.e - 0.01)) / 0.02
answer_1 = search(0, 60, 0, lambda alpha: forward(alpha, given.e))
answer_2 = search(-1, 0, 0, lambda minus: forward(given.alpha, -minus)) * -1
answer_3 = search(0, 80, given.vb - price, lambda alpha: forward(alpha, given.e))
answer_4 = hypot(by_angle * given.s_a, by_e * given.s_e)
