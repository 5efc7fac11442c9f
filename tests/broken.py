"""Scenes as they should not be, each with the keys at fault and a word of what is allowed."""

IN = "[incoming]\nspeed = 2\npulley_radius = 0.1\n"
PLATE = "[plate]\ndistance = 0.5\n"
OUT = "[outgoing]\ndrop = 0.5\n"
FREE = "[stream]\nat = [0, 1]\nvelocity = [0, 0]\n"
HOOD = '[[surface]]\nname = "hood"\nfrom = [0, 0]\nto = [1, 0]\n'
BIG = "9" * 400


def expect(**keys):
    """A machine with one expectation, some of its keys changed or, with None, left out."""
    given = {"quantity": '"x2"', "value": "0.5", "tolerance": "0.1", "source": '"me"', **keys}
    lines = [f"{key} = {value}\n" for key, value in given.items() if value is not None]
    return IN + PLATE + OUT + "[[expect]]\n" + "".join(lines)


# Text of the file, the keys at fault, and a word of what is allowed.
BROKEN = {
    # wrong types
    "date for number": (IN + "[particle]\nradius = 2020-01-01", ["particle.radius"], "a number"),
    "number for table": ("plate = 3\n" + IN, ["plate"], "a table"),
    "list for table": ("run = []\n" + IN, ["run"], "a table"),
    "number for point": (FREE.replace("[0, 1]", "1"), ["stream.at"], "[x, y]"),
    # out of range
    "absurd count": (IN + f"[stream]\ncount = {BIG}", ["stream.count"], "to 10000000"),
    "overflow": (IN.replace("2", "1e999"), ["incoming.speed"], "a number"),
    "endless title": (f'title = "{BIG}"\n' + IN, ["title"], "at most 200 characters"),
    "a million copies": (FREE + HOOD + "repeat = [[1000, 0.1, 0], [1000, 0, 0.1]]",
     ["surface[0].repeat"], "at most 10000 pieces of surfaces, copies too, in all, not 1000000"),
    "plate on its side": (IN + PLATE + "angle_deg = 90", ["plate.angle_deg"], "< 90, in degrees"),
    "plate overturned": (IN + PLATE + "angle_deg = -90", ["plate.angle_deg"], "> -90"),
    # unknown words
    "unknown engine": (IN + '[run]\nengine = "box2d"', ["run.engine"],
     '"exact", "contact" or "pymunk"'),
    "unknown ending": (IN + '[run]\nuntil = "end"', ["run.until"], '"settled" or a number'),
    # next to nothing: 0, or as much as means something
    # 0.001 * 4/3 π (2e-9)³ kg
    "density without mass": (IN + "[particle]\ndensity = 0.001\nradius = 2e-9",
     ["particle.density", "particle.radius"], "at least 1e-27 kg, not 3.35e-29 kg"),
    "material without mass": (IN + '[particle]\nmaterial = "steel"\nradius = 0', ["particle.mass"],
     "particle.radius is 0"),
    "hardly any hood": (FREE + HOOD.replace("[1, 0]", "[1e-12, 0]"), ["surface[0].to"], "1e-09 m"),
    "hardly any arc": (
     FREE + '[[surface]]\nname = "a"\ncenter = [0, 0]\nradius = 0.1\nto_deg = 1e-9',
     ["surface[0].to_deg"], "1e-09 m long"),
    "a stream after the end": (IN + "[run]\nuntil = 2\n[stream]\nstart = 2",
     ["stream.start", "run.until"], "nothing would be released"),
    "unknown grip": (IN + 'friction = "glue"', ["incoming.friction"], '"adhesion" or a number'),
    "unknown drop_from": (IN + PLATE + OUT + 'drop_from = "here"', ["outgoing.drop_from"],
     '"impact" or "top"'),
    # unknown keys
    "misspelt table": (IN.replace("incoming", "incomming"), ["incomming"], "incoming?"),
    "key outside its table": ("restitution = 0\n" + IN, ["restitution"], "[incoming]"),
    "unheard-of key": (IN + "[run]\nqqq = 1", ["run.qqq"], "engine, until, max_time, dt"),
    "quoted key": (IN + '"a.b" = 1', ['incoming."a.b"'], "unknown key"),
    # missing
    "no speed": (IN.replace("speed = 2", ""), ["incoming.speed"], "is missing"),
    "no distance": (IN + "[plate]", ["plate.distance"], "is missing"),
    "no drop": (IN + PLATE + "[outgoing]", ["outgoing.drop"], "is missing"),
    "outgoing alone": (FREE + OUT + 'drop_from = "top"', ["incoming"],
     "[outgoing] needs the table [incoming]"),
    # surfaces
    "nameless": (FREE + HOOD.replace('name = "hood"', ""), ["surface[0].name"], "is missing"),
    "empty name": (FREE + HOOD.replace("hood", ""), ["surface[0].name"], "1 to 40"),
    "no extent": (FREE + HOOD.replace("[1, 0]", "[0, 0.0]"), ["surface[0].to"], "differ"),
    "ends and points": (FREE + HOOD + "points = [[0, 0], [1, 1]]",
     ["surface[0].from", "surface[0].to", "surface[0].points"], "not both"),
    # conflicts, naming both keys
    "pymunk and points": (IN + '[particle]\nradius = 0\n[run]\nengine = "pymunk"',
     ["run.engine", "particle.radius"], "pymunk needs disks"),
    "interact and points": (IN + "[particle]\nradius = 0\n[stream]\ninteract = true",
     ["stream.interact", "particle.radius"], "never meet"),
    "spread on adhesive belt": (IN + "[stream]\nspeed_spread = 0.1",
     ["stream.speed_spread", "incoming.friction"], "Coulomb"),
    "spin on adhesive belt": (IN + "[particle]\nspin = true\n[stream]\nomega = 3",
     ["stream.omega", "incoming.friction"], "omega = 0"),
    "velocity on adhesive belt": (IN + "[stream]\nvelocity = [1, 0]",
     ["stream.velocity", "incoming.friction"], "incoming.speed"),
    "point on adhesive belt": (IN + "[stream]\nat = [-0.5, 0.1063]\nvelocity = [2, 0.1]",
     ["stream.velocity", "incoming.friction"], "Coulomb"),
    "impact without plate": (IN + OUT, ["outgoing.drop_from"], 'outgoing.drop_from = "top"'),
    # expectations
    "number for expectations": ("expect = 3\n" + IN, ["expect"], "each headed by [[expect]]"),
    "table for expectations": (IN + "[expect]\nvalue = 1", ["expect"], "[[expect]]"),
    "no value expected": (expect(value=None), ["expect[0].value"], '"theory" or a number'),
    "misspelt quantity": (expect(quantity='"landing.xx"'), ["expect[0].quantity"],
     "did you mean landing.x?"),
    "unheard-of quantity": (expect(quantity='"speed"'), ["expect[0].quantity"],
     "ledger.belt_work and other keys"),
    "empty quantity": (expect(quantity='""'), ["expect[0].quantity"], "phi1_deg to slip_heat, "),
    "quantity in radians": (expect(quantity='"phi1"'), ["expect[0].quantity"],
     "did you mean phi1_deg?"),
    "quantity of an absent table": (
     IN + '[[expect]]\nquantity = "landing.x"\nvalue = 1\ntolerance = 0\nsource = "me"',
     ["expect[0].quantity"], "it needs [outgoing]"),
    "velocity after a separation": (expect(quantity='"separation.vx_after"'),
     ["expect[0].quantity"], "no such quantity"),
    "theory of a mean": (expect(quantity='"landing.x"', value='"theory"'), ["expect[0].value"],
     "only phi1_deg"),
    "unknown expected word": (expect(value='"thery"'), ["expect[0].value"], '"theory" or a num'),
    "tolerance of another unit": (expect(tolerance='"1 s"'), ["expect[0].tolerance"],
     '"0.5 mm"; x2 is in m'),
    "tolerance of no unit": (expect(tolerance='"1"'), ["expect[0].tolerance"], "x2 is in m"),
    "tolerance in words": (expect(tolerance='"little"'), ["expect[0].tolerance"], "0.5 mm"),
    "negative length": (expect(tolerance='"-1 mm"'), ["expect[0].tolerance"], "0.5 mm"),
    "tolerance for contact": (expect(tolerance_contact='"no"'), ["expect[0].tolerance_contact"],
     ""),
    "tolerance for pymunk": (expect(tolerance_pymunk='"no"'), ["expect[0].tolerance_pymunk"],
     'or "none"; x2 is in m'),
    "unit of a count": (expect(quantity='"landing.count"', tolerance='"1 m"'),
     ["expect[0].tolerance"], 'such as "3"; landing.count is a number of things'),
    # not TOML
    "no value": (IN + "length = ", ["line 4, column 10"], "Invalid value"),
    "unclosed": (IN + "length = [1,\n2", ["line 5, column 2"], "Unclosed array"),
    "key twice": (IN + "speed = 3\n", ["line 4, column 10"], "Cannot overwrite a value"),
    "unquoted size": (IN.replace("2", "2 m/s"), ["line 2, column 11"], "in quotation marks"),
    "unquoted text": (IN + "friction = rubber", ["line 4, column 12"], "in quotation marks"),
    "unit of another table": (IN.replace("2", '"120 m/min"'), ["incoming.speed"],
     "in m/s; units are nm/s, µm/s, um/s, mm/s, cm/s, m/s, km/s"),
    "radians": (IN + '[plate]\ndistance = 1\nangle_deg = "1 rad"', ["plate.angle_deg"],
     "in degrees; units are degrees, deg, °"),
    "prose": ("Dear students,\nthis is no scene", ["line 1, column 6"], "not TOML"),
    "empty": ("", ["stream.at", "stream.velocity"], "chutelab new"),
    "only a comment": ("# nothing\n", ["stream.at", "stream.velocity"], "chutelab new"),
}  # fmt: skip
