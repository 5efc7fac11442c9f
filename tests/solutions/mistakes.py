"""Every known mistake of every question, made by hand: formulas of the student's numbers."""

from math import acos, asin, atan, cos, degrees, hypot, log10, pi, radians, sin, sqrt, tan

G = 9.81


def ride(g):
    return g.R + g.r


def u(g):
    return g.v0**2 / (G * ride(g))


def u_of_a_point(g):
    return g.v0**2 / (G * g.R)


def fall_speed(g):
    return sqrt(2 * G * g.h)


def turn(g):
    return acos(u(g))


def layer(g, share, speed):
    """Where a layer at a share of the bed's depth leaves, at a speed, in degrees."""
    return degrees(acos(speed**2 / (G * (g.R + share * g.cm / 100))))


# Lesson 0: heights of the fall and of the rebound, times of flight


def down(g):
    return g.y0 - g.r


def keeps(g):
    return sqrt((g.y1 - g.r) / down(g))


def first_fall(g):
    return sqrt(2 * down(g) / G)


def tap_ratio(g):
    return (g.c3 - g.c2) / (g.c2 - g.c1)


# Lessons 3 and 7: the plate stands upright, v2y on arrival, time for a fall that begins with it


def radius(g):
    return g.mm / 1000 if "mm" in list(g) else g.r


def v2y(g):
    return G * (g.R + g.d - radius(g)) / g.v0


def falling(g, way, first=None):
    first = v2y(g) if first is None else first
    return (sqrt(first**2 + 2 * G * way) - first) / G


def printed(g):
    """Components after the plate, back and down, as Eqs. (8) and (9) are printed."""
    into, along = g.v0, v2y(g)
    speed, angle = hypot(into, g.e * along), atan(g.e * into / along)
    return speed * sin(angle), speed * cos(angle)


def printed_x3(g, way):
    back, down = printed(g)
    return back * falling(g, way, down)


# Lesson 4


def into(g):
    return g.v0 * cos(radians(g.alpha)) - g.vy * sin(radians(g.alpha))


def along(g):
    return g.v0 * sin(radians(g.alpha)) + g.vy * cos(radians(g.alpha))


def matching(g):
    return g.v0**2 / (2 * G * (g.R + g.d))


# Lessons 5 and 7


def mass(g):
    return g.grams / 1000


def back(g):
    return g.e * g.v0


def work(g):
    return mass(g) * g.vb * (g.vb + back(g))


def gained(g):
    return 0.5 * mass(g) * (g.vb**2 - back(g) ** 2)


def heat(g):
    return 0.5 * mass(g) * (g.vb + back(g)) ** 2


def eq14(g):
    return 0.5 * mass(g) * (back(g) ** 2 + g.vb**2)


# Lesson 6


def leaves(g):
    """Angle where a body that slips leaves: u' = 2 sin φ - 2 µ (cos φ - u), in steps."""
    phi = radians(onset(g))
    speed, step = u(g), 1e-5
    while speed < cos(phi):
        middle = speed + step * (sin(phi) - g.mu * (cos(phi) - speed))
        half = phi + step / 2
        speed += 2 * step * (sin(half) - g.mu * (cos(half) - middle))
        phi += step
    return degrees(phi)


def onset(g, start=None, friction=None):
    start = u(g) if start is None else start
    friction = g.mu if friction is None else friction
    return degrees(atan(friction) - asin(friction * start / sqrt(1 + friction**2)))


# Lesson 8


def order(g):
    return log10(g.e1 / g.e2) / log10(g.dt1 / g.dt2)


def books(g):
    return g.start_mJ + g.work_mJ + g.bounce_mJ + g.heat_mJ + g.fall_mJ


def share(g, energy):
    return g.residual_uJ / 1000 / energy


# Lesson 9


def after(g, alpha, e, along=1.0):
    """Velocity forward after a plate that damps the part into it with e, that along it too."""
    c, s = cos(radians(alpha)), sin(radians(alpha))
    return along * (g.v0 * s + g.vy * c) * s - e * (g.v0 * c - g.vy * s) * c


def plate_for(g, vx, e, along=1.0):
    low, high = 0.0, 80.0
    for _ in range(60):
        middle = (low + high) / 2
        low, high = (middle, high) if after(g, middle, e, along) < vx else (low, middle)
    return low


def plate_at(g, vx):
    return plate_for(g, vx, g.e)


def per_kg(g):
    """What the second belt may pay, J/kg."""
    return g.paid / g.grams


def lining(g):
    a = radians(g.alpha)
    return (g.v0 * sin(a) + g.vy * cos(a)) * tan(a) / (g.v0 * cos(a) - g.vy * sin(a))


def by_e(g):
    return (after(g, g.alpha, g.e - g.s_e) - after(g, g.alpha, g.e + g.s_e)) / 2


def by_alpha(g):
    small = 1e-3
    return g.s_a * (after(g, g.alpha + small, g.e) - after(g, g.alpha - small, g.e)) / (2 * small)


# Lessons 10 and 11


def flow(g):
    return (g.N2 - g.N1) / (g.t2 - g.t1)


def wider(g):
    return (g.W2 - g.k * g.mm) / (g.W - g.k * g.mm)


def dead(g, power):
    """Width of no flow, if the flow goes with W - w to the power of 1 / power."""
    grown = g.q**power
    return (grown * g.W2 / 2 - g.W2) / (grown - 1)


def slope(g):
    return g.h / (g.b / 2)


def filled(g):
    """Number of disks whose areas add up to the heap's."""
    return 100 * g.h * g.b / 2 / (pi * g.mm**2)


def poured(g, left):
    """Heat, J, if the centre of mass ends `left` cm above the floor."""
    return mass(g) * G * (g.H - left) / 100


# Lesson 13


def struck(g, e=None, lever=None):
    """Speed of the particle after the blow, by the impulse J = (1 + e) v / (1/m + l²/I)."""
    e, lever = g.e if e is None else e, lever or g.l
    return g.v - 1000 / g.grams * (1 + e) * g.v / (1000 / g.grams + lever**2 / g.I)


def yields(g):
    """Speed of the struck point after it."""
    return (1 + g.e) * g.v / (1 + 1000 * g.I / g.l**2 / g.grams)


def lost(g):
    """What the particle has less than before, mJ."""
    return 0.5 * g.grams * (g.v**2 - struck(g) ** 2)


def half_a_swing(g, slower):
    return pi / sqrt(g.k / g.I - slower)


MISTAKES = {
    ("film-a-ball", 1): {
        "ratio of heights for ε": lambda g: (g.y1 - g.r) / (g.y0 - g.r),
        "radius forgotten": lambda g: sqrt(g.y1 / g.y0),
        "ratio of heights, radius forgotten": lambda g: g.y1 / g.y0,
        "upside down": lambda g: sqrt((g.y0 - g.r) / (g.y1 - g.r)),
        "squared instead of the root": lambda g: (g.y1 - g.r) ** 2 / (g.y0 - g.r) ** 2,
        "share lost for share kept": lambda g: 1 - keeps(g),
    },
    ("film-a-ball", 2): {
        "a root where there is none": lambda g: sqrt(tap_ratio(g)),
        "squared": lambda g: tap_ratio(g) ** 2,
        "upside down": lambda g: (g.c2 - g.c1) / (g.c3 - g.c2),
        "times on the clock for times of flight": lambda g: g.c2 / g.c3,
        "share lost for share kept": lambda g: 1 - tap_ratio(g),
    },
    ("film-a-ball", 3): {
        "radius forgotten": lambda g: 2 * g.y0 * (g.f / g.n) ** 2,
        "slow motion for real time": lambda g: 2 * down(g) * (30 / g.n) ** 2,
        "square forgotten": lambda g: 2 * down(g) * g.f / g.n,
        "frames for seconds": lambda g: 2 * down(g) / g.n**2,
        "a ½ too many": lambda g: down(g) * (g.f / g.n) ** 2,
        "a fall taken for up and down": lambda g: 2 * down(g) / (g.n / g.f / 2) ** 2,
    },
    ("film-a-ball", 4): {
        "up or down forgotten": lambda g: first_fall(g) * (1 + keeps(g) / (1 - keeps(g))),
        "a way up before the first fall": lambda g: 2 * first_fall(g) / (1 - keeps(g)),
        "the first fall forgotten": lambda g: 2 * first_fall(g) * keeps(g) / (1 - keeps(g)),
        "radius forgotten": lambda g: sqrt(2 * g.y0 / G) * (1 + 2 * keeps(g) / (1 - keeps(g))),
        "the first fall alone": first_fall,
    },
    ("the-parabola", 1): {
        "square root forgotten": lambda g: 2 * g.h / G,
        "a 2 forgotten": lambda g: sqrt(g.h / G),
        "belt speed for the speed of falling": lambda g: g.h / g.v0,
    },
    ("the-parabola", 2): {
        "height for distance": lambda g: g.h,
        "speed of falling for the belt speed": lambda g: 2 * g.h,
        "straight line for distance": lambda g: sqrt(2 * g.v0**2 * g.h / G + g.h**2),
        "a 2 forgotten": lambda g: g.v0 * sqrt(g.h / G),
    },
    ("the-parabola", 3): {
        "vertical part only": fall_speed,
        "horizontal part only": lambda g: g.v0,
        "components added up": lambda g: g.v0 + fall_speed(g),
        "a 2 forgotten": lambda g: sqrt(g.v0**2 + G * g.h),
        "square root forgotten": lambda g: g.v0**2 + 2 * G * g.h,
    },
    ("the-parabola", 4): {
        "angle to the vertical": lambda g: degrees(atan(g.v0 / fall_speed(g))),
        "direction to the landing point": lambda g: degrees(atan(fall_speed(g) / g.v0 / 2)),
        "the tangent, not the angle": lambda g: fall_speed(g) / g.v0,
        "tangent with the whole speed": lambda g: degrees(
            atan(fall_speed(g) / hypot(g.v0, fall_speed(g)))
        ),
    },
    ("letting-go", 1): {
        "radius forgotten": lambda g: sqrt(G * g.R),
        "square root forgotten": lambda g: G * ride(g),
        "a fall for a circle": lambda g: sqrt(2 * G * ride(g)),
        "divided by the radius": lambda g: sqrt(G / ride(g)),
    },
    ("letting-go", 2): {
        "radius forgotten": lambda g: degrees(acos(u_of_a_point(g))),
        "angle from the horizontal": lambda g: degrees(asin(u(g))),
        "square forgotten": lambda g: degrees(acos(g.v0 / sqrt(G * ride(g)))),
        "sliding for riding": lambda g: degrees(acos((2 + u(g)) / 3)),
        "the cosine, not the angle": u,
    },
    ("letting-go", 3): {
        "radius forgotten": lambda g: g.R * u(g),
        "sine for cosine": lambda g: ride(g) * sqrt(1 - u(g) ** 2),
        "distance fallen for height": lambda g: ride(g) - g.v0**2 / G,
        "degrees for radians": lambda g: ride(g) * cos(degrees(turn(g))),
    },
    ("letting-go", 4): {
        "sign or direction": lambda g: g.v0 * sin(turn(g)),
        "sine and cosine exchanged": lambda g: -g.v0 * u(g),
        "the other component": lambda g: g.v0 * u(g),
        "degrees for radians": lambda g: -g.v0 * sin(degrees(turn(g))),
        "sliding for riding": lambda g: (
            -sqrt(g.v0**2 + 2 * G * ride(g) * (1 - u(g))) * sin(turn(g))
        ),
    },
    ("the-bounce", 1): {
        "sign or direction": back,
        "a bounce without loss": lambda g: -g.v0,
        "the part lost for the part kept": lambda g: g.e * g.v0 - g.v0,
        "ε taken for a share of the energy": lambda g: -sqrt(g.e) * g.v0,
        "the equation as printed": lambda g: -printed(g)[0],
    },
    ("the-bounce", 2): {
        "the equation as printed": lambda g: hypot(g.v0, g.e * v2y(g)),
        "ε on both components": lambda g: g.e * hypot(g.v0, v2y(g)),
        "a bounce without loss": lambda g: hypot(g.v0, v2y(g)),
        "the fall forgotten": back,
        "radius forgotten": lambda g: hypot(g.e * g.v0, G * (g.R + g.d) / g.v0),
    },
    ("the-bounce", 3): {
        "the equation as printed": lambda g: printed_x3(g, g.d2),
        "a fall from rest": lambda g: back(g) * sqrt(2 * g.d2 / G),
        "ε forgotten": lambda g: g.v0 * falling(g, g.d2),
        "the whole fall for a part of it": lambda g: (
            back(g) * sqrt(2 * (g.d2 + v2y(g) ** 2 / 2 / G) / G)
        ),
    },
    ("the-bounce", 4): {
        "a missing ½": lambda g: mass(g) * g.v0**2 * (1 - g.e**2),
        "1 - ε for 1 - ε²": lambda g: 0.5 * mass(g) * g.v0**2 * (1 - g.e),
        "energy of the velocity lost": lambda g: 0.5 * mass(g) * (g.v0 - back(g)) ** 2,
        "ε on both components": lambda g: 0.5 * mass(g) * (g.v0**2 + v2y(g) ** 2) * (1 - g.e**2),
        "what is kept for what is lost": lambda g: 0.5 * mass(g) * back(g) ** 2,
        "the equation as printed": lambda g: 0.5 * mass(g) * v2y(g) ** 2 * (1 - g.e**2),
    },
    ("turning-the-plate", 1): {
        "both parts into the plate": lambda g: (
            g.v0 * cos(radians(g.alpha)) + g.vy * sin(radians(g.alpha))
        ),
        "component along the plate": along,
        "sine and cosine exchanged": lambda g: (
            g.v0 * sin(radians(g.alpha)) - g.vy * cos(radians(g.alpha))
        ),
        "the fall forgotten": lambda g: g.v0 * cos(radians(g.alpha)),
        "the plate not turned": lambda g: g.v0,
        "degrees for radians": lambda g: g.v0 * cos(g.alpha) - g.vy * sin(g.alpha),
    },
    ("turning-the-plate", 2): {
        "ε on both components": lambda g: g.e * hypot(g.v0, g.vy),
        "the equation as printed": lambda g: hypot(into(g), g.e * along(g)),
        "a bounce without loss": lambda g: hypot(g.v0, g.vy),
        "ε on the other component": lambda g: hypot(g.e * g.v0, g.vy),
        "component along the plate forgotten": lambda g: g.e * into(g),
    },
    ("turning-the-plate", 3): {
        "sign or direction": lambda g: (
            g.e * into(g) * cos(radians(g.alpha)) - along(g) * sin(radians(g.alpha))
        ),
        "the plate not turned": lambda g: -g.e * g.v0,
        "ε forgotten": lambda g: along(g) * sin(radians(g.alpha)) - into(g) * cos(radians(g.alpha)),
        "ε on the other component": lambda g: (
            g.e * along(g) * sin(radians(g.alpha)) - into(g) * cos(radians(g.alpha))
        ),
        "rebound into the plate": lambda g: (
            along(g) * sin(radians(g.alpha)) + g.e * into(g) * cos(radians(g.alpha))
        ),
        "sine and cosine exchanged": lambda g: (
            along(g) * cos(radians(g.alpha)) - g.e * into(g) * sin(radians(g.alpha))
        ),
    },
    ("turning-the-plate", 4): {
        "velocity at the pivot's distance": lambda g: degrees(atan(2 * matching(g))),
        "distance from another place": lambda g: degrees(atan(g.v0**2 / (2 * G * g.d))),
        "angle from the horizontal": lambda g: degrees(atan(1 / matching(g))),
        "the tangent, not the angle": matching,
    },
    ("landing", 1): {
        "direction lost": lambda g: mass(g) * g.vb * (g.vb - back(g)),
        "kinetic energy gained": gained,
        "the equation as printed": eq14,
        "heat for work": heat,
        "belt and particle speed exchanged": lambda g: mass(g) * back(g) * (g.vb + back(g)),
    },
    ("landing", 2): {
        "direction lost": lambda g: 0.5 * mass(g) * (g.vb - back(g)) ** 2,
        "difference of the squares": gained,
        "half of the work": lambda g: work(g) / 2,
        "the equation as printed": eq14,
    },
    ("landing", 3): {
        "direction lost": lambda g: (g.vb - back(g)) / (g.mu * G),
        "µ forgotten": lambda g: (g.vb + back(g)) / G,
        "a start from rest": lambda g: g.vb / (g.mu * G),
        "half of the way only": lambda g: back(g) / (g.mu * G),
    },
    ("landing", 4): {
        "direction lost": lambda g: g.rate * mass(g) * g.vb * (g.vb - back(g)),
        "the equation as printed": lambda g: g.rate * eq14(g),
        "energy of one particle": work,
        "heat for work": lambda g: g.rate * heat(g),
        "divided by the rate": lambda g: work(g) / g.rate,
    },
    ("grip-or-slip", 1): {
        "radius forgotten": lambda g: degrees(acos(u_of_a_point(g))),
        "angle from the horizontal": lambda g: degrees(asin(u(g))),
        "square forgotten": lambda g: degrees(acos(g.v0 / sqrt(G * ride(g)))),
        "friction's limit for the grip": leaves,
    },
    ("grip-or-slip", 2): {
        "an incline that stands still": lambda g: degrees(atan(g.mu)),
        "separation for slip": leaves,
        "pressed on by going round": lambda g: onset(g, start=-u(g)),
        "a disk that rolls": lambda g: onset(g, (3 * u(g) + 4) / 7, 7 * g.mu),
        "radius forgotten": lambda g: onset(g, start=u_of_a_point(g)),
    },
    ("grip-or-slip", 3): {
        "the textbook angle": lambda g: degrees(turn(g)),
        "sliding for rolling": lambda g: degrees(acos((2 + u(g)) / 3)),
        "a start from rest": lambda g: degrees(acos(4 / 7)),
        "a hoop for a disk": lambda g: degrees(acos((1 + u(g)) / 2)),
        "radius forgotten": lambda g: degrees(acos((3 * u_of_a_point(g) + 4) / 7)),
    },
    ("grip-or-slip", 4): {
        "µ where it does not matter": lambda g: sqrt(g.mu * G * ride(g)),
        "radius forgotten": lambda g: sqrt(G * g.R),
        "square root forgotten": lambda g: G * ride(g),
        "a fall for a circle": lambda g: sqrt(2 * G * ride(g)),
    },
    ("a-stream", 1): {
        "mass over rate": lambda g: mass(g) / g.rate,
        "rate over mass": lambda g: g.rate / mass(g),
        "tonnes per hour": lambda g: g.rate * mass(g) * 3600 / 1000,
        "per minute": lambda g: g.rate * mass(g) * 60,
    },
    ("a-stream", 2): {
        "upside down": lambda g: g.rate / g.v0,
        "multiplied": lambda g: g.rate * g.v0,
        "gap for distance": lambda g: g.v0 / g.rate - 2 * g.mm / 1000,
        "belt and particle speed exchanged": lambda g: g.vb / g.rate,
    },
    ("a-stream", 3): {
        "ε forgotten": lambda g: g.v0 * (falling(g, g.d2 + g.bed) - falling(g, g.d2)),
        "height of the bed for the spread": lambda g: g.bed,
        "a fall from rest": lambda g: back(g) * (sqrt(2 * (g.d2 + g.bed) / G) - sqrt(2 * g.d2 / G)),
        "the bed's fall alone": lambda g: back(g) * sqrt(2 * g.bed / G),
        "the equation as printed": lambda g: printed_x3(g, g.d2 + g.bed) - printed_x3(g, g.d2),
    },
    ("a-stream", 4): {
        "direction lost": lambda g: g.rate * mass(g) * g.vb * (g.vb - back(g)),
        "the equation as printed": lambda g: g.rate * eq14(g),
        "kinetic energy gained": lambda g: g.rate * gained(g),
        "heat for work": lambda g: g.rate * heat(g),
        "belt and particle speed exchanged": lambda g: g.rate * mass(g) * g.v0 * (g.v0 + back(g)),
    },
    ("trust", 1): {
        "upside down": lambda g: 1 / order(g),
        "logarithms forgotten": lambda g: g.e1 / g.e2,
        "ratio of the ratios": lambda g: (g.e1 / g.e2) / (g.dt1 / g.dt2),
        "the steps forgotten": lambda g: log10(g.e1 / g.e2),
    },
    ("trust", 2): {
        "as if the order were 1": lambda g: g.dt2 * g.wanted / g.e2,
        "power p for 1/p": lambda g: g.dt2 * (g.wanted / g.e2) ** order(g),
        "upside down": lambda g: g.dt2 * (g.e2 / g.wanted) ** (1 / order(g)),
        "step and error of different runs": lambda g: g.dt1 * (g.wanted / g.e2) ** (1 / order(g)),
    },
    ("trust", 3): {
        "share of the energy at the start": lambda g: share(g, g.start_mJ),
        "potential energy forgotten": lambda g: share(g, books(g) - g.fall_mJ),
        "gains minus losses": lambda g: share(g, books(g) - 2 * (g.bounce_mJ + g.heat_mJ)),
        "upside down": lambda g: books(g) / (g.residual_uJ / 1000),
    },
    ("trust", 4): {
        "thickness forgotten": lambda g: g.r_mm / 1000 / g.v,
        "radius forgotten": lambda g: g.thick_mm / 2000 / g.v,
        "the whole thickness": lambda g: (g.r_mm + g.thick_mm) / 1000 / g.v,
        "upside down": lambda g: g.v / ((g.r_mm + g.thick_mm / 2) / 1000),
    },
    ("design", 1): {
        "ε forgotten": lambda g: plate_for(g, 0.0, 1.0),
        "the fall forgotten": lambda g: degrees(atan(sqrt(g.e))),
        "ε on the other component": lambda g: plate_for(g, 0.0, 1.0, g.e),
        "angle from the horizontal": lambda g: 90 - plate_at(g, 0.0),
        "the tangent, not the angle": lambda g: tan(radians(plate_at(g, 0.0))),
    },
    ("design", 2): {
        "the fall forgotten": lambda g: tan(radians(g.alpha)) ** 2,
        "upside down": lambda g: 1 / lining(g),
        "both parts into the plate": lambda g: (
            (g.v0 * tan(radians(g.alpha)) + g.vy)
            * tan(radians(g.alpha))
            / (g.v0 + g.vy * tan(radians(g.alpha)))
        ),
        "a share of the energy": lambda g: lining(g) ** 2,
        "the part lost for the part kept": lambda g: 1 - lining(g),
    },
    ("design", 3): {
        "kinetic energy gained": lambda g: plate_at(g, sqrt(g.vb**2 - 2 * per_kg(g))),
        "heat for work": lambda g: plate_at(g, g.vb - sqrt(2 * per_kg(g))),
        "straight down": lambda g: plate_at(g, 0.0),
        "belt and particle speed exchanged": lambda g: plate_at(g, g.v0 - per_kg(g) / g.v0),
        "angle from the horizontal": lambda g: 90 - plate_at(g, g.vb - per_kg(g) / g.vb),
    },
    ("design", 4): {
        "deviations added up": lambda g: by_e(g) + by_alpha(g),
        "the angle forgotten": by_e,
        "ε forgotten": by_alpha,
        "degrees for radians": lambda g: hypot(by_e(g), degrees(by_alpha(g))),
        "the variance": lambda g: by_e(g) ** 2 + by_alpha(g) ** 2,
    },
    ("the-hopper", 1): {
        "total for difference": lambda g: g.N2 / g.t2,
        "first count alone": lambda g: g.N1 / g.t1,
        "clock not set back": lambda g: (g.N2 - g.N1) / g.t2,
        "upside down": lambda g: 1 / flow(g),
    },
    ("the-hopper", 2): {
        "in proportion to the width": lambda g: flow(g) * wider(g),
        "the edge forgotten": lambda g: flow(g) * sqrt(g.W2 / g.W) ** 3,
        "the edge forgotten, in proportion": lambda g: flow(g) * g.W2 / g.W,
        "the power of three dimensions": lambda g: flow(g) * sqrt(wider(g)) ** 5,
        "squared": lambda g: flow(g) * wider(g) ** 2,
        "upside down": lambda g: flow(g) * sqrt(wider(g)) ** -3,
    },
    ("the-hopper", 3): {
        "gravity without the root": lambda g: g.N2 / flow(g) * G / g.g2,
        "gravity forgotten": lambda g: g.N2 / flow(g),
        "gravity upside down": lambda g: g.N2 / flow(g) * sqrt(g.g2 / G),
        "a missing ½": lambda g: 2 * g.N2 / flow(g) * sqrt(G / g.g2),
        "flow for time": lambda g: flow(g) * sqrt(g.g2 / G),
    },
    ("the-hopper", 4): {
        "power for its inverse": lambda g: dead(g, 3 / 2),
        "in proportion to the width": lambda g: dead(g, 1),
        "squared": lambda g: dead(g, 1 / 2),
        "a ½ too many": lambda g: dead(g, 2 / 3) / 2,
        "what is left for what is lost": lambda g: g.W2 - dead(g, 2 / 3),
    },
    ("the-heap", 1): {
        "whole width for half": lambda g: degrees(atan(g.h / g.b)),
        "upside down": lambda g: 90 - degrees(atan(slope(g))),
        "sine for tangent": lambda g: degrees(asin(slope(g))),
        "the tangent, not the angle": slope,
        "angle at the top": lambda g: 2 * degrees(atan(1 / slope(g))),
    },
    ("the-heap", 2): {
        "sliding for rolling": lambda g: degrees(atan(g.mu)),
        "both added": lambda g: degrees(atan(g.mu + g.c)),
        "angle of repose of the heap": lambda g: degrees(atan(slope(g))),
    },
    ("the-heap", 3): {
        "gaps forgotten": filled,
        "share for its inverse": lambda g: filled(g) / 0.84,
        "a missing ½": lambda g: 0.84 * 2 * filled(g),
        "diameter for radius": lambda g: 0.84 * filled(g) / 4,
        "squares for disks": lambda g: 0.84 * 100 * g.h * g.b / 2 / (2 * g.mm) ** 2,
    },
    ("the-heap", 4): {
        "the heap's own energy forgotten": lambda g: poured(g, 0),
        "top for centre": lambda g: poured(g, g.h),
        "what is left for what is lost": lambda g: mass(g) * G * g.h / 300,
        "half the height for a third": lambda g: poured(g, g.h / 2),
    },
    ("four-formulas", 1): {
        "angle from the horizontal": lambda g: degrees(asin(u_of_a_point(g))),
        "square forgotten": lambda g: degrees(acos(g.v0 / sqrt(G * g.R))),
        "the top layer": lambda g: layer(g, 1.0, g.v0),
    },
    ("four-formulas", 2): {
        "the belt's speed for the middle's": lambda g: layer(g, 0.5, g.v0),
        "whole depth for half": lambda g: layer(g, 1.0, g.v0 * (1 + g.cm / 100 / g.R)),
        "two circles": lambda g: layer(g, 0.0, g.v0 * (1 + g.cm / 200 / g.R)),
        "the lowest layer": lambda g: layer(g, 0.0, g.v0),
    },
    ("four-formulas", 3): {
        "depth of the belt's bed": lambda g: 10 * g.cm,
        "half the depth in the root": lambda g: 1000 * (sqrt(g.R**2 + g.R * g.cm / 100) - g.R),
        "radius of the top": lambda g: 1000 * sqrt(g.R**2 + g.R * g.cm / 50),
        "top speed for all": lambda g: 500 * (sqrt(g.R**2 + g.R * g.cm / 25) - g.R),
    },
    ("four-formulas", 4): {
        "an incline that stands still": lambda g: degrees(atan(g.mu)),
        "separation for slip": lambda g: layer(g, 0.0, g.v0),
        "pressed on by going round": lambda g: onset(g, start=-u_of_a_point(g)),
    },
    ("the-damping-plate", 1): {
        "distance not squared": lambda g: 1000 * g.I / g.l,
        "times for divided by": lambda g: 1000 * g.I * g.l**2,
        "the mass of a bar": lambda g: 3000 * g.I / g.l**2,
    },
    ("the-damping-plate", 2): {
        "a fixed plate": lambda g: -g.e * g.v,
        "a blow without loss": lambda g: struck(g, e=1.0),
        "they go on together": lambda g: struck(g, e=0.0),
        "the plate's speed": lambda g: struck(g) + g.e * g.v,
        "inertia for mass": lambda g: struck(g, lever=1.0),
    },
    ("the-damping-plate", 3): {
        "the heat of the blow": lambda g: lost(g) - 500 * g.I * (yields(g) / g.l) ** 2,
        "all that the particle lost": lost,
        "ε forgotten": lambda g: 500 * g.I * (yields(g) / (1 + g.e) / g.l) ** 2,
        "the particle's mass": lambda g: 0.5 * g.grams * yields(g) ** 2,
    },
    ("the-damping-plate", 4): {
        "damper forgotten": lambda g: half_a_swing(g, 0.0),
        "the 2 in c / (2 I) forgotten": lambda g: half_a_swing(g, (g.c / g.I) ** 2),
        "decay added": lambda g: half_a_swing(g, -((g.c / g.I / 2) ** 2)),
        "a missing ½": lambda g: 2 * half_a_swing(g, (g.c / g.I / 2) ** 2),
        "a ½ too many": lambda g: half_a_swing(g, (g.c / g.I / 2) ** 2) / 2,
        "angular frequency for frequency": lambda g: (
            half_a_swing(g, (g.c / g.I / 2) ** 2) / (2 * pi)
        ),
    },
}
"""By lesson and question: what the mistake is called, and the number that it leads to."""

GENERAL = {
    "sign or direction": lambda right: -right,
    "a missing ½": lambda right: 2 * right,
    "a ½ too many": lambda right: right / 2,
    "power of ten": lambda right: 1000 * right,
}
"""What every question knows, made of the right answer."""
