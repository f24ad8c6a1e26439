"""Bad input of every kind is refused with exit code 2, one clear line and nothing written.

A row changes the minimal case. Where the fault stands in a file, the mark @ is put before what the message must point at.
"""

import itertools
import os

from harness import CASE, InTemporaryDirectory, edit, has_hdf5, ordo

MARK = "@"
USAGE = "Run with --help for more information.\n"
COMMANDS = ("check", "run")
BODY = 'material = "rubber"\nshape = "ball"\ncenter = 0.5\nradius = 0.25\n'
ELASTIC = "young = 1000.0\npoisson = 0.3\n"
DENSITY = "density = 1000.0"
DIM_1, DIM_3 = ("dim = 2", "dim = 1"), ("dim = 2", "dim = 3")
SECOND_BODY = '[[body]]\nmaterial = "rubber"\nshape = @"ball"\ncenter = 0.6\nradius = 0.2\n'
SECOND_MATERIAL = '[[material]]\nname = @"rubber"\ndensity = 1.0\nyoung = 1.0\npoisson = 0.0\n'


def body(text):
    return BODY, 'material = "rubber"\n' + text


def ring(text):
    return body('shape = "ring"\ncenter = 0.5\nradius = 0.4\n' + text)


def cylinder(text):
    return body('shape = "cylinder"\ncenter = 0.5\nradius = 0.4\nheight = 0.5\n' + text)


def boundary(text):
    return "[[boundary]]\n" + text


def traction(body, face="face = 'all'", value="value = 1"):
    return f"[[traction]]\n{body}\n{face}\n{value}\n"


def wall(face, kind):
    return f'[[boundary]]\nface = "{face}"\ntype = "{kind}"\n'


WHOLE = body("shape = 'box'\nlower = 0.0\nupper = 1.0\n")
HALF = body("shape = 'box'\nlower = 0.0\nupper = 0.5\n")
BOXES = body("shape = 'box'\nlower = 0.0\nupper = 0.5\n[[body]]\nmaterial = 'rubber'\nshape = 'box'\nlower = 0.75\nupper = 1.0\n")
WALLS = "[[boundary]]\nface = ['x-min', 'x-max', 'y-min', 'y-max']\ntype = 'fixed'\n"


def stages(*others, first="duration = 0.005"):
    """Two stages as long as the case, with more lines in the second."""
    return f"[[stage]]\nname = 'rest'\n{first}\n[[stage]]\nname = 'dig'\nduration = 0.005\n" + "".join(line + "\n" for line in others)


FALLING = ("[grid]", "gravity = [0, -1]\n[grid]")


def law(model, *lines):
    """The model and its parameters in the place of the elastic material."""
    return (ELASTIC, "model = '" + model + "'\n" + ELASTIC + "".join(line + "\n" for line in lines))


def fluid(*lines):
    return (ELASTIC, "model = 'fluid'\n" + "".join(line + "\n" for line in lines))


def mohr(*lines):
    """Angles of 30 and 10 degrees and cohesion 3, unless the lines say otherwise."""
    keys = {line.split(" ")[0] for line in lines}
    return law("mohr-coulomb", *lines, *(f"{key} = {value}" for key, value in (("friction_angle", 30), ("dilation_angle", 10), ("cohesion", 3)) if key not in keys))


def cook(*lines):
    """Numbers of copper, unless the lines say otherwise."""
    keys = {line.split(" ")[0] for line in lines}
    usual = dict(A=90e6, B=292e6, n=0.31, C=0.025, m=1.09, reference_rate=1, reference_temperature=298, melting_temperature=1356, specific_heat=383, taylor_quinney=0.9)
    return law("johnson-cook", *lines, *(f"{key} = {value}" for key, value in usual.items() if key not in keys))


def clay(*lines):
    """Numbers of a clay, unless the lines say otherwise."""
    keys = {line.split(" ")[0] for line in lines}
    usual = dict(shear=60, swelling_index=0.05, compression_index=0.2, critical_slope=1.1, reference_pressure=10, preconsolidation=14)
    rest = [f"{key} = {value}" for key, value in usual.items() if key not in keys]
    return (ELASTIC, "model = 'cam-clay'\n" + "".join(line + "\n" for line in (*lines, *rest)))


def grains(*lines):
    keys = {line.split(" ")[0] for line in lines}
    usual = dict(friction_static=0.38, friction_dynamic=0.64, inertial_number=0.3, grain_diameter=1e-3, grain_density=2450)
    return law("mu-i", *lines, *(f"{key} = {value}" for key, value in usual.items() if key not in keys))


def rubber(*lines, bulk="1"):
    return (ELASTIC, "model = 'ogden'\n" + "".join(line + "\n" for line in (*lines, "bulk = " + bulk)))


# name, changes of the case, key that the message names, what else it says (the remedy)
CASE_FAULTS = [
    # keys and tables
    ("unknown key", [(DENSITY, "@densty = 1000.0")], "material[0].densty", 'Did you mean "density"?'),
    ("unknown key of a single table", ["[output]\n@directroy = 'x'\n"], "output.directroy", 'Did you mean "directory"?'),
    ("unknown key at the top", [("[grid]", "@titel = 'disks'\n[grid]")], "titel", 'Did you mean "title"?'),
    ("unknown table", ["[@outptu]\ngrid = true\n"], "outptu", 'Did you mean "output"?'),
    ("unknown list of tables", ["[[@bdy]]\nradius = 1\n"], "bdy", 'Did you mean "body"?'),
    ("[material] for [[material]]", [("[[material]]", "@[material]")], "material", "[[material]]"),
    ("[[grid]] for [grid]", [("[grid]", "@[[grid]]")], "grid", "[grid]"),
    ("table is a number", [("[grid]\ndim = 2\nsize = 1.0\nspacing = 0.25\n", "grid = @3\n")], "grid", "[grid]"),
    ("bodies are numbers", [("[[body]]\n" + BODY, ""), ("[grid]", "body = [@1, 2]\n[grid]")], "body[0]", "must be a table"),
    ("missing [grid]", [("[grid]\ndim = 2\nsize = 1.0\nspacing = 0.25\n", "")], "grid", "needs a table [grid]"),
    ("missing [time]", [("[time]\nend = 0.01\ndt = 0.001\n", "")], "time", "needs a table [time]"),
    ("missing [[material]]", [("[[material]]\nname = \"rubber\"\ndensity = 1000.0\n" + ELASTIC, "")], "material", "[[material]]"),
    ("missing [[body]]", [("[[body]]\n" + BODY, "")], "body", "[[body]]"),
    ("missing key", [("[grid]", "@[grid]"), ("size = 1.0\n", "")], "grid.size", "is missing"),
    ("missing density", [("[[material]]", "@[[material]]"), (DENSITY + "\n", "")], "material[0].density", "is missing"),
    ("missing key of a shape", [("[[body]]", "@[[body]]"), ("radius = 0.25\n", "")], "body[0].radius", "needs center, radius"),
    ("empty file", [(CASE, "")], "grid", "needs a table [grid]"),
    # types
    ("string for a number", [(DENSITY, 'density = @"heavy"')], "material[0].density", 'must be a number (got the string "heavy")'),
    ("bool for a number", [(DENSITY, "density = @true")], "material[0].density", "must be a number (got true)"),
    ("list for a number", [(DENSITY, "density = @[1.0]")], "material[0].density", "must be a number (got a list)"),
    ("table for a number", [(DENSITY, "density = @{ value = 1 }")], "material[0].density", "must be a number (got a table)"),
    ("date for a number", [(DENSITY, "density = @2020-01-01")], "material[0].density", "must be a number (got a date"),
    ("number for a string", [('name = "rubber"', "name = @7")], "material[0].name", "must be a string (got the integer 7)"),
    ("float for an integer", [("dim = 2", "dim = @2.0")], "grid.dim", "must be an integer (got the number 2"),
    ("string for an integer", [("dim = 2", 'dim = @"2"')], "grid.dim", 'must be an integer (got the string "2")'),
    ("number for a bool", ["[output]\ngrid = @1\n"], "output.grid", "must be true or false (got the integer 1)"),
    ("string for a bool", ["[output]\ngrid = @'yes'\n"], "output.grid", 'must be true or false (got the string "yes")'),
    ("table for a list", [("size = 1.0", "size = @{ x = 1.0 }")], "grid.size", "must be a number (got a table)"),
    ("bool for an expression", ["velocity = [@true, 0]\n"], "body[0].velocity", "number or an expression"),
    ("number in a list of strings", ["[output]\nfields = ['density', @3]\n"], "output.fields", "must be a string"),
    ("string in a list of numbers", [("size = 1.0", "size = [1.0, @'1']")], "grid.size", "must be a number"),
    ("list in a list", [("size = 1.0", "size = [@[1.0, 1.0], 1.0]")], "grid.size", "must be a number (got a list)"),
    ("list too short", [("size = 1.0", "size = @[1.0]")], "grid.size", "must have 2 values, one per axis (got 1)"),
    ("list too long", [("size = 1.0", "size = @[1.0, 1.0, 1.0]")], "grid.size", "must have 2 values, one per axis (got 3)"),
    ("empty list", [("size = 1.0", "size = @[]")], "grid.size", "must have 2 values, one per axis (got 0)"),
    ("velocity too long", ["velocity = @[0, 0, 0]\n"], "body[0].velocity", "must have 2 values"),
    ("gravity too long", [("[grid]", "gravity = @[0, 0, -9.81]\n[grid]")], "gravity", "must have 2 values"),
    # ranges
    ("negative density", [(DENSITY, "density = @-1000.0")], "material[0].density", "must be positive (got -1000)"),
    ("zero density", [(DENSITY, "density = @0")], "material[0].density", "must be positive (got 0)"),
    ("nan", [(DENSITY, "density = @nan")], "material[0].density", "must be a finite number (got nan)"),
    ("inf", [("end = 0.01", "end = @inf")], "time.end", "must be a finite number (got inf)"),
    ("minus inf in a list", [("[grid]", "gravity = [0, @-inf]\n[grid]")], "gravity", "must be a finite number (got -inf)"),
    ("nan velocity", ["velocity = [@nan, 0]\n"], "body[0].velocity", "must be a finite number (got nan)"),
    ("dim = 4", [("dim = 2", "dim = @4")], "grid.dim", "must be at least 1 and at most 3 (got 4)"),
    ("dim = 0", [("dim = 2", "dim = @0")], "grid.dim", "must be at least 1 and at most 3 (got 0)"),
    ("integer beyond 32 bits", [ring("inner_radius = 0.1\ncells = 'polar'\nradial = @99999999999\n")], "body[0].radial", "too large"),
    ("zero end", [("end = 0.01", "end = @0.0")], "time.end", "must be positive"),
    ("negative dt", [("dt = 0.001", "dt = @-0.001")], "time.dt", "must be positive"),
    ("cfl above 1", [("dt = 0.001", "cfl = @1.5")], "time.cfl", "at most 1 (got 1.5)"),
    ("strain_velocity with usf", ["[method]\nscheme = @'usf'\nstrain_velocity = 0.3\n"], "method.scheme", "use scheme usl or musl"),
    ("pic_fraction above 1", ["[method]\npic_fraction = @2\n"], "method.pic_fraction", "at least 0 and at most 1"),
    ("zero radius", [("radius = 0.25", "radius = @0")], "body[0].radius", "must be positive"),
    ("zero interval", ["[output]\ninterval = @0\n"], "output.interval", "must be positive"),
    ("history_interval = 0", ["[output]\nhistory_interval = @0\n"], "output.history_interval", "at least 1"),
    ("particles_per_cell = 0", ["particles_per_cell = @0\n"], "body[0].particles_per_cell", "at least 1"),
    ("particles_per_cell = 5", ["particles_per_cell = @5\n"], "body[0].particles_per_cell", "nearest 4"),
    ("particles_per_cell = 2.5", ["particles_per_cell = @2.5\n"], "body[0].particles_per_cell", "must be an integer"),
    # elastic constants
    ("nu = 0.5", [("poisson = 0.3", "poisson = @0.5")], "material[0].poisson", "above -1 and below 0.5 (got 0.5)"),
    ("nu = -1", [("poisson = 0.3", "poisson = @-1")], "material[0].poisson", "above -1 and below 0.5 (got -1)"),
    ("negative young", [("young = 1000.0", "young = @-1")], "material[0].young", "must be positive"),
    ("no elastic constants", [("[[material]]", "@[[material]]"), (ELASTIC, "")], "material[0]", "young and poisson, lambda and mu, or bulk and shear (got none)"),
    ("one elastic constant", [("[[material]]", "@[[material]]"), ("poisson = 0.3\n", "")], "material[0]", "young and poisson"),
    ("three elastic constants", [("[[material]]", "@[[material]]"), (ELASTIC, ELASTIC + "mu = 1\n")], "material[0]", "exactly one pair"),
    ("mixed pair", [("[[material]]", "@[[material]]"), ("poisson = 0.3", "mu = 1")], "material[0]", "(got young, mu)"),
    ("negative bulk modulus", [(ELASTIC, "lambda = @-1\nmu = 1\n")], "material[0].lambda", "bulk modulus"),
    ("linear-rate-1d in 2D", [(ELASTIC, "model = @'linear-rate-1d'\nyoung = 1\n")], "material[0].model", "1D only"),
    # parameters of laws
    ("yield of an elastic law", [(ELASTIC, ELASTIC + "yield = @1\n")], "material[0].yield", "is not a parameter of neo-hookean; remove it"),
    ("no yield stress", [(ELASTIC, "model = @'j2'\n" + ELASTIC)], "material[0].model", "j2 needs yield (yield stress in tension, Pa)"),
    ("negative yield stress", [law("j2", "yield = @-1")], "material[0].yield", "positive"),
    ("yield stress that is no number", [law("j2", "yield = @'high'")], "material[0].yield", "must be a number"),
    ("softening without a solution", [law("j2", "yield = 1", "hardening = @-1200")], "material[0].hardening", "above -3 times the shear modulus"),
    ("negative rate of saturation", [law("j2", "yield = 1", "saturation_rate = @-1")], "material[0].saturation_rate", "zero or positive"),
    ("saturation that falls too fast", [law("j2", "yield = 1", "saturation = 0.5", "saturation_rate = @3000")], "material[0].saturation_rate", "take a smaller one"),
    ("saturation without a rate", [law("j2", "yield = 1", "saturation = @2")], "material[0].saturation", "give that too, or remove it"),
    ("rate without a saturation", [law("j2", "yield = 1", "saturation_rate = @3")], "material[0].saturation_rate", "give one other than yield, or remove it"),
    ("j2 without elastic constants", [(ELASTIC, "model = @'j2'\nyield = 1\n")], "material[0].model", "young and poisson, lambda and mu, or bulk and shear (got none)"),
    ("friction of 90 degrees", [law("drucker-prager", "cohesion = 1", "friction_angle = @90", "dilation_angle = 0")], "material[0].friction_angle", "at most 89"),
    ("cone without friction", [law("drucker-prager", "cohesion = 1", "friction_angle = @0", "dilation_angle = 0")], "material[0].friction_angle", "must be positive for drucker-prager"),
    ("dilation above friction", [law("drucker-prager", "cohesion = 1", "friction_angle = 20", "dilation_angle = @30")], "material[0].dilation_angle", "must not be above that of friction"),
    ("angles and slopes", [(ELASTIC, "model = @'drucker-prager'\ncohesion = 1\nfriction_angle = 20\ndilation_angle = 1\neta = 1\n" + ELASTIC)], "material[0].model", "either friction_angle and dilation_angle, or eta, eta_flow and xi"),
    ("slopes without all", [(ELASTIC, "model = @'drucker-prager'\ncohesion = 1\neta_flow = 1\neta = 1\n" + ELASTIC)], "material[0].model", "or eta, eta_flow and xi"),
    ("flow steeper than the cone", [law("drucker-prager", "cohesion = 1", "eta = 0.1", "eta_flow = @0.2", "xi = 1")], "material[0].eta_flow", "must not be above that of friction"),
    ("unknown fit", [law("drucker-prager", "cohesion = 1", "friction_angle = 20", "dilation_angle = 1", "fit = @'outside'")], "material[0].fit", "must be one of outer, inner, plane-strain"),
    ("fit of slopes", [law("drucker-prager", "cohesion = 1", "eta = 0.2", "eta_flow = 0.1", "xi = 1", "fit = @'outer'")], "material[0].fit", "remove it, or give friction_angle and dilation_angle"),
    ("fit that is no word", [law("drucker-prager", "cohesion = 1", "friction_angle = 20", "dilation_angle = 1", "fit = @1")], "material[0].fit", "must be a string"),
    ("negative cohesion", [law("drucker-prager", "cohesion = @-1", "friction_angle = 20", "dilation_angle = 1")], "material[0].cohesion", "zero or positive"),
    ("softening of the cone without a solution", [law("drucker-prager", "cohesion = 1", "friction_angle = 20", "dilation_angle = 0", "hardening = @-500")], "material[0].hardening", "falls too fast"),
    ("volume correction with cohesion", [law("drucker-prager", "cohesion = 1", "friction_angle = 20", "dilation_angle = 0", "volume_correction = @true")], "material[0].volume_correction", "set cohesion and hardening to 0"),
    ("volume correction that is no flag", [law("drucker-prager", "cohesion = 0", "friction_angle = 20", "dilation_angle = 0", "volume_correction = @1")], "material[0].volume_correction", "must be true or false"),
    ("fluid with elastic constants", [(ELASTIC, "model = @'fluid'\nsound_speed = 10\n" + ELASTIC)], "material[0].model", "fluid takes no elastic constants but its own (got young, poisson)"),
    ("fluid without its speed of sound", [(ELASTIC, "model = @'fluid'\n")], "material[0].model", "fluid needs sound_speed"),
    ("fluid with sound at rest", [fluid("sound_speed = @0")], "material[0].sound_speed", "must be positive"),
    ("Tait's exponent of one", [fluid("sound_speed = 10", "gamma = @1")], "material[0].gamma", "must be above 1"),
    ("negative viscosity", [fluid("sound_speed = 10", "viscosity = @-1")], "material[0].viscosity", "zero or positive"),
    ("negative yield stress of a fluid", [fluid("sound_speed = 10", "yield = @-1")], "material[0].yield", "zero or positive"),
    ("no yield stress in j2", [law("j2", "yield = @0")], "material[0].yield", "must be positive for j2"),
    ("Bingham without a rate", [fluid("sound_speed = 10", "yield = 1", "critical_rate = @0")], "material[0].critical_rate", "must be positive"),
    ("rate without Bingham", [fluid("sound_speed = 10", "critical_rate = @0.01")], "material[0].critical_rate", "give the yield stress, or remove it"),
    ("tension that is no flag", [fluid("sound_speed = 10", "tension = @'no'")], "material[0].tension", "must be true or false"),
    ("no angle of friction", [(ELASTIC, "model = @'mohr-coulomb'\ncohesion = 1\ndilation_angle = 0\n" + ELASTIC)], "material[0].model", "mohr-coulomb needs friction_angle"),
    ("friction beyond 89 degrees", [mohr("friction_angle = @91")], "material[0].friction_angle", "at most 89"),
    ("negative friction", [mohr("friction_angle = @-3")], "material[0].friction_angle", "at least 0"),
    ("dilation above friction of planes", [mohr("friction_angle = 10", "dilation_angle = @11")], "material[0].dilation_angle", "must not be above friction_angle"),
    ("residual dilation above friction", [mohr("residual_dilation_angle = @25", "residual_friction_angle = 20", "softening_strain = 1")], "material[0].residual_dilation_angle", "must not be above residual_friction_angle"),
    ("softening without a strain", [("[[material]]", "@[[material]]"), mohr("residual_cohesion = 1")], "material[0].softening_strain", "residual values differ"),
    ("no way to the apex", [("[[material]]", "@[[material]]"), mohr("dilation_angle = 0")], "material[0].tension_cutoff", "no flow leads to the apex"),
    ("softening in no strain", [mohr("residual_cohesion = 1", "softening_strain = @0")], "material[0].softening_strain", "must be positive"),
    ("softening to nothing else", [mohr("softening_strain = @0.1")], "material[0].softening_strain", "give a residual value"),
    ("cut-off beyond the apex", [mohr("tension_cutoff = @6")], "material[0].tension_cutoff", "at most cohesion/tan(friction_angle)"),
    ("negative cut-off", [mohr("tension_cutoff = @-1")], "material[0].tension_cutoff", "zero or positive"),
    ("no yield stress of Johnson and Cook", [(ELASTIC, "model = @'johnson-cook'\nB = 1\n" + ELASTIC)], "material[0].model", "johnson-cook needs A"),
    ("A = 0", [cook("A = @0")], "material[0].A", "must be positive"),
    ("negative B", [cook("B = @-1")], "material[0].B", "zero or positive"),
    ("n = 0", [cook("n = @0")], "material[0].n", "must be positive"),
    ("negative C", [cook("C = @-0.1")], "material[0].C", "zero or positive"),
    ("m = 0", [cook("m = @0")], "material[0].m", "must be positive"),
    ("no reference rate", [cook("reference_rate = @0")], "material[0].reference_rate", "must be positive"),
    ("melting below the reference", [cook("melting_temperature = @200")], "material[0].melting_temperature", "must be above reference_temperature"),
    ("molten at the start", [cook("temperature = @2000")], "material[0].temperature", "must be below melting_temperature"),
    ("no specific heat", [cook("specific_heat = @0")], "material[0].specific_heat", "must be positive"),
    ("more heat than work", [cook("taylor_quinney = @1.1")], "material[0].taylor_quinney", "at most 1"),
    ("half a Hugoniot", [(ELASTIC, cook("sound_speed = 4000")[1].replace("'johnson-cook'", "@'johnson-cook'"))], "material[0].model", "all of sound_speed, shock_slope and gruneisen"),
    ("clay with a pair", [(ELASTIC, clay()[1].replace("'cam-clay'", "@'cam-clay'") + "bulk = 1\n")], "material[0].model", "cam-clay takes shear alone (got bulk, shear)"),
    ("clay without a slope", [(ELASTIC, clay()[1].replace("'cam-clay'", "@'cam-clay'").replace("critical_slope = 1.1\n", ""))], "material[0].model", "cam-clay needs critical_slope"),
    ("kappa = 0", [clay("swelling_index = @0")], "material[0].swelling_index", "must be positive"),
    ("lambda below kappa", [clay("compression_index = @0.04")], "material[0].compression_index", "must be above swelling_index"),
    ("M = 0", [clay("critical_slope = @0")], "material[0].critical_slope", "must be positive"),
    ("reference pressure of zero", [clay("reference_pressure = @0")], "material[0].reference_pressure", "must be positive"),
    ("start outside the yield surface", [clay("preconsolidation = @5")], "material[0].preconsolidation", "at least reference_pressure"),
    ("grains without friction", [grains("friction_static = @0")], "material[0].friction_static", "must be positive"),
    ("faster grains that slip more", [grains("friction_dynamic = @0.1")], "material[0].friction_dynamic", "at least friction_static"),
    ("inertial number of zero", [grains("inertial_number = @0")], "material[0].inertial_number", "must be positive"),
    ("grains without size", [grains("grain_diameter = @0")], "material[0].grain_diameter", "must be positive"),
    ("grains without mass", [grains("grain_density = @-2")], "material[0].grain_density", "must be positive"),
    ("rubber with a pair", [(ELASTIC, "model = @'ogden'\nmoduli = 1\nexponents = 2\n" + ELASTIC)], "material[0].model", "ogden takes bulk alone (got young, poisson)"),
    ("rubber without moduli", [(ELASTIC, "model = @'ogden'\nexponents = 2\nbulk = 1\n")], "material[0].model", "ogden needs moduli"),
    ("fewer exponents than moduli", [rubber("moduli = [1, 2]", "exponents = @2")], "material[0].exponents", "must be as many as moduli"),
    ("exponent of zero", [rubber("moduli = [1, 2]", "exponents = @[2, 0]")], "material[0].exponents", "must not be zero"),
    ("too many moduli", [rubber("moduli = @[1, 2, 3, 4, 5]", "exponents = 2")], "material[0].moduli", "must have 1 to 4 numbers (got 5)"),
    ("no moduli", [rubber("moduli = @[]", "exponents = 2")], "material[0].moduli", "must have 1 to 4 numbers (got 0)"),
    ("rubber without stiffness", [rubber("moduli = @[1, 2]", "exponents = [2, -1]")], "material[0].moduli", "positive sum"),
    ("exponent beyond its range", [rubber("moduli = 1", "exponents = [@30]")], "material[0].exponents", "at most 20"),
    ("modulus that is no number", [rubber("moduli = [@'soft']", "exponents = 2")], "material[0].moduli", "must be a number"),
    ("c10 = 0", [(ELASTIC, "model = 'mooney-rivlin'\nbulk = 1\nc10 = @0\nc01 = 1\n")], "material[0].c10", "must be positive"),
    ("negative c01", [(ELASTIC, "model = 'mooney-rivlin'\nbulk = 1\nc10 = 1\nc01 = @-1\n")], "material[0].c01", "zero or positive"),
    ("rubber without bulk modulus", [(ELASTIC, "model = @'mooney-rivlin'\nc10 = 1\nc01 = 1\n")], "material[0].model", "mooney-rivlin takes bulk alone (got none)"),
    ("negative bulk modulus of rubber", [rubber("moduli = 1", "exponents = 2", bulk="@-1")], "material[0].bulk", "must be positive"),
    ("field of another dimension", [law("j2", "yield = 1"), "[output]\nfields = @['elastic_b_yz']\n"], "output.fields", "no material of the case carries"),
    ("elastic-plastic splines", [law("j2", "yield = 1"), WHOLE, "[method]\npreset = @'spline4'\n", WALLS], "method.preset", "takes no material with history"),
    ("linear-rate-1d with poisson", [DIM_1, (ELASTIC, "model = @'linear-rate-1d'\n" + ELASTIC)], "material[0].model", "takes young alone"),
    # names and choices
    ("unknown preset", ["[method]\npreset = @'cpdi'\n"], "method.preset", 'Did you mean "cpdi1"?'),
    ("unknown choice of an axis", ["[method]\ndomain = @'boks'\n"], "method.domain", 'Did you mean "box"?'),
    ("unknown model", [(ELASTIC, ELASTIC + "model = @'neo-hokean'\n")], "material[0].model", 'Did you mean "neo-hookean"?'),
    ("unknown shape", [('shape = "ball"', 'shape = @"bal"')], "body[0].shape", 'Did you mean "ball"?'),
    ("name with a line break", [('shape = "ball"', 'shape = @"ba\\nll"')], "body[0].shape", "control characters"),
    ("unknown field", ["[output]\nfields = ['volume',\n@'densty']\n"], "output.fields", 'Did you mean "density"?'),
    ("unknown material", [('material = "rubber"', 'material = @"ruber"')], "body[0].material", 'Did you mean "rubber"?'),
    ("material without a name", [('name = "rubber"', 'name = @""'), ('material = "rubber"', 'material = ""')], "material[0].name", "must not be empty"),
    ("duplicate material names", [SECOND_MATERIAL], "material[1].name", "names must differ"),
    # bodies
    ("ring in 3D", [DIM_3, body("shape = @'ring'\ncenter = 0.5\nradius = 0.4\ninner_radius = 0.1\n")], "body[0].shape", "does not exist in 3D; there is ball, box, cylinder"),
    ("cylinder in 2D", [body("shape = @'cylinder'\ncenter = 0.5\nradius = 0.4\nheight = 1\n")], "body[0].shape", "does not exist in 2D; there is ball, box, ring"),
    ("key without meaning for a shape", ["height = @1.0\n"], "body[0].height", "remove it"),
    ("inner_radius above radius", [ring("inner_radius = @0.5\n")], "body[0].inner_radius", "must be smaller than radius 0.4"),
    ("inner_radius equals radius", [ring("inner_radius = @0.4\n")], "body[0].inner_radius", "must be smaller than radius 0.4"),
    ("polar cells of a part without a hole", [DIM_3, cylinder("cells = @'polar'\nangle = [0, 90]\n")], "body[0].cells", "inner_radius above zero"),
    ("polar cells around a core that is no square", [("radius = 0.25", "radius = 0.25\ncells = 'polar'\nangular = @10")], "body[0].angular", "multiple of 4"),
    ("polar cells in 1D", [("dim = 2", "dim = 1"), ("radius = 0.25", "radius = 0.25\ncells = @'polar'")], "body[0].cells", "two dimensions"),
    ("polar count of cartesian cells", [ring("inner_radius = 0.1\nradial = @3\n")], "body[0].radial", 'cells = "polar"'),
    ("angles that fall", [ring("inner_radius = 0.1\nangle = @[90, 0]\n")], "body[0].angle", "must grow"),
    ("angles far beyond a turn", [ring("inner_radius = 0.1\nangle = [@2e18, 2000000000000000256.0]\n")], "body[0].angle", "at most 720"),
    ("one angle", [ring("inner_radius = 0.1\nangle = @[90]\n")], "body[0].angle", "[first, last]"),
    ("upper below lower", [body("shape = 'box'\nlower = [0.2, 0.6]\nupper = @[0.8, 0.4]\n")], "body[0].upper", "must be larger than lower"),
    ("body outside the grid", [('shape = "ball"', 'shape = @"ball"'), ("center = 0.5", "center = [0.9, 0.5]")], "body[0].shape", "lies outside the grid"),
    ("body far outside the grid", [('shape = "ball"', 'shape = @"ball"'), ("center = 0.5", "center = 1e300")], "body[0].shape", "lies outside the grid"),
    ("more sub-cells than particles can be", [("[[body]]", "@[[body]]"), ("radius = 0.25", "radius = 1e9")], "body[0].particles_per_cell", "more than 2e+09"),
    ("more polar cells than particles can be", [("[[body]]", "@[[body]]"), ring("inner_radius = 0.1\ncells = 'polar'\nradial = 100000\nangular = 100000\n")], "body[0].particles_per_cell", "more than 2e+09"),
    ("a branch without times", [("[[material]]", "@[[material]]"), (DENSITY, DENSITY + "\nbranch_shear = [10.0]")], "material[0].model", "needs branch_time too"),
    ("more branches than times", [(DENSITY, DENSITY + "\nbranch_shear = [10.0, 5.0]\nbranch_time = @[0.1]")], "material[0].branch_time", "as many numbers as branch_shear"),
    ("no branch", [(DENSITY, DENSITY + "\nbranch_shear = @[]\nbranch_time = []")], "material[0].branch_shear", "must have 1 to 8 numbers"),
    ("a branch of no modulus", [(DENSITY, DENSITY + "\nbranch_shear = [@0.0]\nbranch_time = [1.0]")], "material[0].branch_shear", "positive"),
    ("a branch of negative time", [(DENSITY, DENSITY + "\nbranch_shear = [1.0]\nbranch_time = [@-1.0]")], "material[0].branch_time", "positive"),
    ("a branch beside a stress that is carried", [(DENSITY, DENSITY + "\nmodel = 'jaumann-elastic'\nbranch_shear = @[1.0]\nbranch_time = [1.0]")], "material[0].branch_shear", "carries its stress"),
    ("a branch of fitted splines", ["[method]\npreset = @'spline4'\n", WHOLE, WALLS, (DENSITY, DENSITY + "\nbranch_shear = [1.0]\nbranch_time = [1.0]")], "method.preset", "takes no material with history"),
    # methods whose choices do not go together
    ("ddmpm with boxes", ["[method]\nbasis = 'ddmpm'\ndomain = @'box'\n"], "method.domain", "use basis hat"),
    ("limiter of a projection by mass", ["[method]\npreset = 'cpdi1'\nlimiter = @'slope'\n"], "method.limiter", "set limiter to none"),
    ("limiter of quadratic fits", ["[method]\npreset = 'cpls'\nlimiter = 'slope'\ndegree = @2\n"], "method.degree", "set limiter to none"),
    ("points of the default", ["[method]\ndomain = @'point'\n"], "method.domain", "those of the default, preset cpls-limited"),
    ("weights of corners without cells", ["[method]\ncell_weights = @'mean'\n"], "method.cell_weights", "no cells"),
    ("stretch limit of points", ["[method]\npreset = 'mpm'\nstretch_limit = @2.0\n"], "method.stretch_limit", "only parallelepipeds can be scaled"),
    ("averages in 1D", [DIM_1, "[method]\naveraging = @'cell'\n"], "method.averaging", "has no use in 1D"),
    ("averages of cell quadrature", ["[method]\npreset = 'impm'\naveraging = @'cell'\n"], "method.averaging", "averages already"),
    ("averages of fitted splines", ["[method]\npreset = 'spline4'\naveraging = @'node'\n"], "method.averaging", "averages already"),
    ("artificial viscosity of Gauss points", ["[method]\npreset = 'tls-mpm'\nquadratic_viscosity = @1.5\n"], "method.quadratic_viscosity", "use quadrature particle"),
    ("negative artificial viscosity", ["[method]\nlinear_viscosity = @-0.1\n"], "method.linear_viscosity", "at most 10"),
    ("enrichment without cells", ["[method]\nenrichment = @'all'\n"], "method.enrichment", "no shared corners"),
    ("kept velocities without enrichment", ["[method]\npreset = 'cpdi2'\ncorner_velocity = @'kept'\n"], "method.corner_velocity", "only enriched corners"),
    ("layers of another enrichment", ["[method]\npreset = 'cpdi2e'\nlayers = @3\n"], "method.layers", "set enrichment to layers"),
    ("enrichment without an interface", ["[method]\npreset = @'cpdi2e'\n"], "method.preset", "no two bodies share a corner"),
    ("interface without one", ["[method]\npreset = 'cpdi2'\nenrichment = @'interface'\n"], "method.enrichment", "no two bodies share a corner"),
    ("point of the grid where nothing is on it", ["[method]\npreset = 'fem'\n", "[[probe]]\nname = 'p'\npoint = @0.5\n"], "probe[0].point", "particle"),
    ("splines and a plane inside the grid", ["[method]\npreset = 'bsmpm'\n", wall("x-min", "fixed") + "at = @0.1\n"], "boundary[0].at", "let the grid end there"),
    ("splines and three quarters of a ring", ["[method]\npreset = 'spline4'\n", ring("inner_radius = 0.2\nangle = @[0, 270]\n")], "body[0].angle", "leaves a notch"),
    ("splines and two boxes", [BOXES, "[method]\npreset = @'spline4'\n"], "method.preset", "put a [[boundary]]"),
    ("hats fitted to a free body", [HALF, "[method]\npreset = @'spline4'\nbasis = 'hat'\nstress_degree = 1\nremoved_stress_knots = 0\n"], "method.preset", "waves grow"),
    ("splines and a wall that moves", [WHOLE, "[method]\npreset = @'spline4'\n", WALLS, wall("y-max", "velocity") + "value = [1, 0]\n"], "method.preset", "walls at rest"),
    ("splines on too few cells", [WHOLE, "[method]\npreset = @'spline4'\nremoved_knots = 2\n", WALLS], "method.preset", "there must be 5"),
    ("part of the scheme of splines", ["[method]\npreset = 'cpdi1'\nscheme = @'rk4'\n"], "method.scheme", "use preset spline3"),
    ("degree of the stress without splines", ["[method]\npreset = 'cpdi1'\nstress_degree = @4\n"], "method.stress_degree", "parameters of projection spline-fit"),
    ("degree without polynomials", ["[method]\npreset = 'cpdi1'\ndegree = @2\n"], "method.degree", "set method.projection"),
    ("ddmpm's weight without ddmpm", ["[method]\npreset = 'cpdi1'\na0 = @0.3\n"], "method.a0", "leave it out"),
    ("lumped rows of a lumped mass", ["[method]\npreset = 'cpdi1'\nlump_below = @0.1\n"], "method.lump_below", "set method.mass to consistent"),
    ("gauss points with domains", ["seeding = @'gauss'\n"], "body[0].seeding", 'method.domain "point"'),
    ("gauss points of polar cells", [ring("inner_radius = 0.1\ncells = 'polar'\nseeding = @'gauss'\n")], "body[0].seeding", "cartesian"),
    # tractions
    ("traction without a body", [traction("body = @'bodi 0'")], "traction[0].body", 'Did you mean "body 0"?'),
    ("traction without a face", ["@[[traction]]\nbody = 'body 0'\nvalue = 1\n"], "traction[0].face", "is missing"),
    ("traction on a face of 3D", [traction("body = 'body 0'", "face = @'z-max'")], "traction[0].face", "does not exist in 2D"),
    ("unknown face of a body", [traction("body = 'body 0'", "face = @'left'")], "traction[0].face", "x-min"),
    ("traction with one component", [traction("body = 'body 0'", value="type = 'traction'\nvalue = @1")], "traction[0].value", "takes 2 values"),
    ("pressure with two components", [traction("body = 'body 0'", value="value = @[1, 2]")], "traction[0].value", "takes 1 value"),
    ("traction that is no number", [traction("body = 'body 0'", value="value = @'log(-1)'")], "traction[0].value", "must give a number"),
    ("inner face of a solid ball", [traction("body = 'body 0'", "face = @'inner'")], "traction[0].face", 'no face "inner"'),
    ("inner faces of a box", [body("shape = 'box'\nlower = 0.2\nupper = 0.4\n"), traction("body = 'body 0'", "face = @'inner'")], "traction[0].face", "x-min"),
    ("bodies of one name", ['[[body]]\nname = @"body 0"\nmaterial = "rubber"\nshape = "ball"\ncenter = 0.2\nradius = 0.1\n'], "body[1].name", "names must differ"),
    # meshes
    ("mesh without a file", [("[[body]]", "@[[body]]"), body("shape = 'mesh'\n")], "body[0].file", "is missing"),
    ("body beyond a plane", [('shape = "ball"', 'shape = @"ball"'), wall("x-min", "fixed") + "at = 0.5\n"], "body[0].shape", "lies beyond the boundary at x = 0.5"),
    ("a preset in capitals", ["[method]\npreset = @'MPM'\n"], "method.preset", 'Did you mean "mpm"?'),
    ("what others call a ball", [('shape = "ball"', 'shape = @"sphere"')], "body[0].shape", 'Did you mean "ball"?'),
    ("what others call hats", ["[method]\nbasis = @'linear'\n"], "method.basis", 'Did you mean "hat"?'),
    ("nearly incompressible", [("poisson = 0.3", "poisson = @0.4999995")], "material[0].poisson", "must be at most 0.499999"),
    ("probe outside", ["[[probe]]\nname = 'p'\nparticle = @[0.01, 0.99]\n"], "probe[0].particle", "lies outside every body"),
    ("long name", ["name = @'" + 201 * "x" + "'\n"], "body[0].name", "at most 200 letters"),
    ("overlapping bodies", [SECOND_BODY], "body[1].shape", "move them apart"),
    ("body that overlaps itself", [body("shape = @'box'\nlower = [-0.5, 0.25]\nupper = [1.5, 0.75]\n"), wall("x-min", "periodic")], "body[0].shape", "overlaps"),
    ("body without particles", [('shape = "ball"', 'shape = @"ball"'), ("radius = 0.25", "radius = 0.01")], "body[0].shape", "holds no particle"),
    # grid and time
    ("spacing that does not divide the size", [("spacing = 0.25", "spacing = @0.3")], "grid.spacing", "must divide the size 1 "),
    ("spacing above the size", [("spacing = 0.25", "spacing = @3.0")], "grid.spacing", "must divide the size 1 "),
    ("too many cells", [("spacing = 0.25", "spacing = @1e-9")], "grid.spacing", "at most 1e6"),
    ("dt above the limit", [("dt = 0.001", "dt = @0.5")], "time.dt", "is above the limit"),
    ("dt and cfl", [("dt = 0.001", "dt = 0.001\ncfl = @0.4")], "time.cfl", "excludes dt"),
    # expressions
    ("bad expression syntax", ["velocity = [@'2*(x', 0]\n"], "body[0].velocity", "cannot be read"),
    ("empty expression", ["velocity = [@'', 0]\n"], "body[0].velocity", "cannot be read"),
    ("two values in an expression", ["velocity = [@'0.1, 0.2', 0]\n"], "body[0].velocity", "cannot be read"),
    ("assignment in an expression", ["velocity = [@'x = 1', 0]\n"], "body[0].velocity", "cannot be read"),
    ("unknown variable", ["velocity = [0, @'x + q']\n"], "body[0].velocity", "It may use x, y, z, t"),
    ("unknown function", ["body_force = [@'sine(x)', 0]\n"], "body[0].body_force", "cannot be read"),
    ("nan velocity from an expression", ["velocity = [0, @'sqrt(-1 - x)']\n"], "body[0].velocity", "must give a number everywhere"),
    ("infinite velocity from an expression", ["velocity = [@'1/(x - x)', 0]\n"], "body[0].velocity", "must give a number everywhere"),
    ("nan body force at t = 0", ["body_force = [0, @'sqrt(-1 - x)']\n"], "body[0].body_force", "must give a number everywhere"),
    ("nan boundary velocity at t = 0", [boundary("face = 'x-min'\ntype = 'velocity'\nvalue = [@'sqrt(-1 - y)', 'free']\n")], "boundary[0].value", "must give a number"),
    # boundaries
    ("z-min in 2D", [boundary("face = @'z-min'\ntype = 'fixed'\n")], "boundary[0].face", "does not exist in 2D"),
    ("unknown face", [boundary("face = @'left'\ntype = 'fixed'\n")], "boundary[0].face", "must be one of x-min, x-max"),
    ("no face", [boundary("face = @[]\ntype = 'fixed'\n")], "boundary[0].face", "needs a face, a region or a body"),
    ("unknown boundary type", [boundary("face = 'x-min'\ntype = @'fixt'\n")], "boundary[0].type", 'Did you mean "fixed"?'),
    ("velocity without value", ["@" + boundary("face = 'x-min'\ntype = 'velocity'\n")], "boundary[0].value", "needs it per axis"),
    ("value without velocity", [boundary("face = 'x-min'\ntype = 'fixed'\nvalue = @[1, 0]\n")], "boundary[0].value", "remove it"),
    ("periodic and fixed on one axis", [wall("x-min", "periodic"), boundary("face = @'x-max'\ntype = 'fixed'\n")], "boundary[1].face", "remove one of the two"),
    ("plane outside the grid", [wall("x-min", "fixed") + "at = @-1.0\n"], "boundary[0].at", "lies outside the grid"),
    ("plane of a periodic axis", [wall("x-min", "periodic") + "at = @0.0\n"], "boundary[0].at", "remove it"),
    ("a boundary without a place", ["@" + boundary("type = 'fixed'\n")], "boundary[0].face", "needs a face, a region or a body"),
    ("face and region", [boundary("face = 'x-min'\nregion = @{shape = 'box', lower = 0, upper = 1}\ntype = 'fixed'\n")], "boundary[0].region", "one place"),
    ("region and body", [boundary("region = {shape = 'box', lower = 0, upper = 1}\nbody = @'body 0'\ntype = 'fixed'\n")], "boundary[0].body", "one place"),
    ("at with a region", [boundary("region = {shape = 'box', lower = 0, upper = 1}\nat = @0.5\ntype = 'fixed'\n")], "boundary[0].at", "it moves a face"),
    ("region that is no table", [boundary("region = @'box'\ntype = 'fixed'\n")], "boundary[0].region", "must be a table"),
    ("region of no shape", [boundary("region = @{lower = 0, upper = 1}\ntype = 'fixed'\n")], "boundary[0].region.shape", "is missing"),
    ("region of a mesh", [boundary("region = {shape = @'mesh'}\ntype = 'fixed'\n")], "boundary[0].region.shape", "must be one of box"),
    ("region with a wrong key", [boundary("region = {shape = 'box', lower = 0, upper = 1, radius = @1}\ntype = 'fixed'\n")], "boundary[0].region.radius", "has no meaning"),
    ("region upside down", [boundary("region = @{shape = 'box', lower = 1, upper = 0}\ntype = 'fixed'\n")], "boundary[0].region", "lower must be smaller"),
    ("region with symmetry", [boundary("region = {shape = 'box', lower = 0, upper = 1}\ntype = @'symmetry'\n")], "boundary[0].type", "with a region or a body"),
    ("boundary on no body", [boundary("body = @'bdy 0'\ntype = 'fixed'\n")], "boundary[0].body", 'Did you mean "body 0"?'),
    ("displacement without value", ["@" + boundary("face = 'x-min'\ntype = 'displacement'\n")], "boundary[0].value", "needs it per axis"),
    ("displacement of a place", [boundary("face = 'x-min'\ntype = 'displacement'\nvalue = [@'x*t', 0]\n")], "boundary[0].value", "of t alone"),
    ("displacement that starts late", [boundary("face = 'x-min'\ntype = 'displacement'\nvalue = [@0.1, 0]\n")], "boundary[0].value", "must be 0 there"),
    ("wall that moves by place", [boundary("face = 'x-min'\ntype = 'wall'\nvalue = [@'x', 0]\n")], "boundary[0].value", "a wall is rigid"),
    ("nothing held", [boundary("face = 'x-min'\ntype = 'velocity'\nvalue = @['free', 'free']\n")], "boundary[0].value", "it holds nothing"),
    ("name with a space", [boundary("name = @'my floor'\nface = 'x-min'\ntype = 'fixed'\n")], "boundary[0].name", "letters, digits and _"),
    ("name of a column", [boundary("name = @'boundary'\nface = 'x-min'\ntype = 'fixed'\n")], "boundary[0].name", "is taken"),
    ("two boundaries of a name", [boundary("name = 'a'\nface = 'x-min'\ntype = 'fixed'\n"), boundary("name = @'a'\nface = 'x-max'\ntype = 'fixed'\n")], "boundary[1].name", "names must differ"),
    ("negative growth", ["[watch]\nenergy_growth = @-1\n"], "watch.energy_growth", "must be zero or positive"),
    # damping
    ("unknown damping", ["[damping]\ntype = @'viscus'\n"], "damping.type", 'Did you mean "viscous"?'),
    ("local damping without a factor", ["[damping]\ntype = @'local'\n"], "damping.type", '"local" needs factor'),
    ("viscous damping without a rate", ["[damping]\ntype = @'viscous'\n"], "damping.type", '"viscous" needs rate'),
    ("factor of viscous damping", ["[damping]\ntype = 'viscous'\nrate = 1\nfactor = @0.7\n"], "damping.factor", 'is of damping "local", not "viscous"; remove it'),
    ("rate without damping", ["[damping]\nrate = @1\n"], "damping.rate", 'is of damping "viscous", not "none"; remove it'),
    ("factor above one", ["[damping]\ntype = 'local'\nfactor = @1.1\n"], "damping.factor", "at most 1"),
    ("no factor at all", ["[damping]\ntype = 'local'\nfactor = @0\n"], "damping.factor", "must be above 0"),
    # stress at the start
    ("k0 of a law of F", [FALLING, "k0 = @0.5\n"], "body[0].k0", "neo-hookean is a function of F: use one that"),
    ("k0 without gravity", [law("j2", "yield = 1"), "k0 = @0.5\n"], "body[0].k0", "needs gravity along one axis"),
    ("k0 under gravity along two axes", [("[grid]", "gravity = [1, -1]\n[grid]"), law("j2", "yield = 1"), "k0 = @0.5\n"], "body[0].k0", "needs gravity along one axis"),
    ("surface below the body", [FALLING, law("j2", "yield = 1e5"), "k0 = 0.5\nsurface = @0.5\n"], "body[0].surface", "lies below the particle at"),
    ("k0 beyond the yield stress", [FALLING, law("j2", "yield = 1"), "k0 = @0.5\n"], "body[0].k0", "outside the yield surface of j2"),
    ("tension of clay", [clay(), "initial_stress = @[1, 1, 1]\n"], "body[0].initial_stress", "which the elasticity of cam-clay cannot have"),
    ("clay beyond its preconsolidation", [clay(), "initial_stress = @[-15, -15, -15]\n"], "body[0].initial_stress", "outside the yield surface of cam-clay"),
    ("k0 and a stress", [FALLING, law("j2", "yield = 1"), "k0 = 0.5\ninitial_stress = @[1, 1, 1]\n"], "body[0].initial_stress", "excludes k0"),
    ("a stress of two numbers", [law("j2", "yield = 9"), "initial_stress = @[1, 1]\n"], "body[0].initial_stress", "must be three numbers"),
    ("surface without k0", ["surface = @1.0\n"], "body[0].surface", "needs k0"),
    ("negative overburden", [FALLING, law("j2", "yield = 1e5"), "k0 = 0.5\noverburden = @-1\n"], "body[0].overburden", "zero or positive"),
    # stages
    ("stage without a name", ["@[[stage]]\nduration = 0.01\n"], "stage[0].name", "is missing"),
    ("stage without a duration", ["@[[stage]]\nname = 'rest'\n"], "stage[0].duration", "is missing"),
    ("two stages of a name", [stages(), "[[stage]]\nname = @'dig'\nduration = 1\n"], "stage[2].name", "names must differ"),
    ("another end than that of the stages", [("end = 0.01", "end = @0.02"), stages()], "time.end", "the sum of the durations of the stages, 0.01"),
    ("no end and no stages", [("[time]", "@[time]"), ("end = 0.01\n", "")], "time.end", "is missing"),
    ("residual without gravity", [stages(first="duration = 0.005\nresidual = @1e-3")], "stage[0].residual", "give the duration alone"),
    ("residual of a load that grows", [("[grid]", "gravity = [0.0, -1.0]\n[grid]"), traction("body = 'body 0'", value="value = '1e3*t'"), stages(first="duration = 0.005\nresidual = @1e-3")], "stage[0].residual", "traction \"0\" changes with time"),
    ("residual of a boundary that moves", [("[grid]", "gravity = [0.0, -1.0]\n[grid]"), boundary("face = 'y-min'\nat = 0.3\ntype = 'displacement'\nvalue = [0.0, '1e-3*t']\nname = 'press'\n"), stages(first="duration = 0.005\nresidual = @1e-3")], "stage[0].residual", "boundary \"press\" changes with time"),
    ("residual of a boundary of constant velocity", [("[grid]", "gravity = [0.0, -1.0]\n[grid]"), boundary("face = 'y-min'\nat = 0.3\ntype = 'velocity'\nvalue = ['free', 0.01]\nname = 'press'\n"), stages(first="duration = 0.005\nresidual = @1e-3")], "stage[0].residual", "boundary \"press\" changes with time"),
    ("residual with an obstacle that moves", [("[grid]", "gravity = [0.0, -1.0]\n[grid]"), "[[obstacle]]\nname = 'press'\nshape = 'half-space'\npoint = [0, 0.1]\nnormal = [0, 1]\nvelocity = [0, -0.01]\n", stages(first="duration = 0.005\nresidual = @1e-3")], "stage[0].residual", "obstacle \"press\" changes with time"),
    ("residual with an obstacle that forces move", [("[grid]", "gravity = [0.0, -1.0]\n[grid]"), "[[obstacle]]\nname = 'stone'\nshape = 'ball'\ncenter = [0.5, 0.9]\nradius = 0.05\nmass = 1\n", stages(first="duration = 0.005\nresidual = @1e-3")], "stage[0].residual", "obstacle \"stone\" changes with time"),
    ("gravity along all axes", [("[grid]", "gravity = @-10.0\n[grid]")], "gravity", "is a vector and must have 2 values, one per axis"),
    ("residual of one", [stages(first="duration = 0.005\nresidual = @1")], "stage[0].residual", "below 1"),
    ("damping of a stage without its factor", [stages("damping = @'local'")], "stage[1].damping", '"local" needs factor'),
    ("factor of a stage without damping", [stages("factor = @0.7")], "stage[1].factor", 'is of damping "local", not "none"'),
    ("removal of no body", [stages("remove = @['bdy 0']")], "stage[1].remove", 'Did you mean "body 0"?'),
    ("removal of the last body", [stages("remove = @['body 0']")], "stage[1].remove", "one must stay"),
    ("removal at the start", [BOXES, stages(first="duration = 0.005\nremove = @['body 0']")], "stage[0].remove", "leave the body out of the case"),
    ("removal of a body that is gone", [BOXES, stages("remove = ['body 0']"), "[[stage]]\nname = 'more'\nduration = 0.01\nremove = @['body 0']\n", ("end = 0.01", "end = 0.02")], "stage[2].remove", "was taken out before"),
    ("removal from an enriched method", [("[[material]]", "[method]\npreset = 'fem'\n[[material]]"), BOXES, stages("remove = @['body 0']")], "stage[1].remove", "cannot be with enriched corners"),
    ("materials that are no table", [stages("materials = @'rubber'")], "stage[1].materials", "must be a table"),
    ("material of no body", [stages("materials = {bdy = @'rubber'}")], "stage[1].materials.bdy", 'no [[body]] called "bdy"'),
    ("unknown material of a stage", [stages("materials = {'body 0' = @'ruber'}")], "stage[1].materials.body 0", 'Did you mean "rubber"?'),
    ("material of another density", [SECOND_MATERIAL.replace('@"rubber"', "'light'"), stages("materials = @{'body 0' = 'light'}")], "stage[1].materials", "give both materials the same"),
    ("materials at the start", [stages(first="duration = 0.005\nmaterials = @{'body 0' = 'rubber'}")], "stage[0].materials", "give the bodies these materials"),
    ("boundary of no stage", [boundary("face = 'x-min'\ntype = 'fixed'\nstages = @['dug']\n"), stages()], "boundary[0].stages", 'Did you mean "dig"?'),
    ("boundary of an empty list of stages", [boundary("face = 'x-min'\ntype = 'fixed'\nstages = @[]\n"), stages()], "boundary[0].stages", "must name at least one"),
    ("boundary of a stage without stages", [boundary("face = 'x-min'\ntype = 'fixed'\nstages = @['dig']\n")], "boundary[0].stages", "The case has none"),
    ("periodic axis of a stage", [wall("x-min", "periodic") + "stages = @['dig']\n", stages()], "boundary[0].stages", "remove it"),
    ("traction of no stage", [traction("body = 'body 0'") + "stages = @['dug']\n", stages()], "traction[0].stages", 'Did you mean "dig"?'),
    # probes and output
    ("probe without a place", ["@[[probe]]\nname = 'tip'\n"], "probe[0].point", "either particle or point"),
    ("probe with two places", ["[[probe]]\nname = 'tip'\nparticle = 0.5\npoint = @0.5\n"], "probe[0].point", "either particle or point"),
    ("probe point outside the grid", ["[[probe]]\nname = 'tip'\npoint = @[2, 0]\n"], "probe[0].point", "lies outside the grid"),
    ("probe particle outside the grid", ["[[probe]]\nname = 'tip'\nparticle = @[2, 0]\n"], "probe[0].particle", "lies outside the grid"),
    ("bad probe name", ["[[probe]]\nname = @'../tip'\npoint = 0.5\n"], "probe[0].name", "letters, digits"),
    ("duplicate probe names", ["[[probe]]\nname = 'tip'\npoint = 0.5\n", "[[probe]]\nname = @'tip'\npoint = 0.4\n"], "probe[1].name", "names must differ"),
    ("directory below a file", ["[output]\ndirectory = @'case.toml/sub'\n"], "output.directory", "is not a directory"),
    # TOML itself
    ("unfinished string", [('name = "rubber"', 'name = "rubber@')], "", "not valid TOML"),
    ("no value", [(DENSITY, "density = @")], "", "not valid TOML"),
    ("no equals sign", [(DENSITY, "density @1000.0")], "", "not valid TOML"),
    ("unfinished list", [("size = 1.0\n", "size = [1.0\n"), ("spacing", "@spacing")], "", "not valid TOML"),
    ("unfinished table header", [("[time]", "[time@")], "", "not valid TOML"),
    ("duplicate key", [(DENSITY, DENSITY + "\ndensity = @1.0")], "", "not valid TOML"),
    ("duplicate table", ["@[grid]\n"], "", "not valid TOML"),
    ("bare word", [('shape = "ball"', "shape = @ball")], "", "not valid TOML"),
    ("key of many parts", ["@" + "a." * 100_000 + "a = 1\n"], "key", "has more than 16 parts"),
    ("quoted key of many parts", ["@[" + "'#='." * 100_000 + "a]\n"], "key", "has more than 16 parts"),
]

# name, particles.csv (None: there is no such file), key, remedy
CSV_FAULTS = [
    ("missing file", None, "body[0].file", "relative to the case file"),
    ("missing column", "@x,volume\n0.5,0.01\n", "header", 'the column "y" is missing'),
    ("unknown column", "x,y,@volme\n0.5,0.5,0.01\n", "header", 'Did you mean "volume"?'),
    ("column of another dimension", "x,y,@z,volume\n0.5,0.5,0.5,0.01\n", "header", "there is no column"),
    ("column twice", "x,y,@x,volume\n0.5,0.5,0.5,0.01\n", "header", "is there twice"),
    ("not a number", "x,y,volume\n0.5,@half,0.01\n", "y", 'must be a finite number (got "half")'),
    ("number with a tail", "x,y,volume\n0.5, @0.5m,0.01\n", "y", "must be a finite number"),
    ("nan", "x,y,volume\n# a comment\n@nan,0.5,0.01\n", "x", "must be a finite number"),
    ("no value", "x,y,volume\n0.5,@,0.01\n", "y", "must be a finite number"),
    ("negative volume", "x,y,volume\n0.5,0.5,@-0.01\n", "volume", "must be positive"),
    ("too few values", "x,y,volume\n@0.5,0.5\n", "particle", "has 2 values, the header 3"),
    ("too many values", "x,y,volume\n@0.5,0.5,0.01,1\n", "particle", "has 4 values, the header 3"),
    ("left-handed edges", "x,y,volume,r1x,r1y,r2x,r2y\n@0.5,0.5,0.01,0,0.05,0.05,0\n", "r1x", "right-handed"),
    ("some edges left out", "@x,y,volume,r1x,r1y\n0.5,0.5,0.01,0.05,0\n", "header", "r2x"),
    ("semicolons", "@x;y;volume\n0.5;0.5;0.01\n", "header", "separated by commas"),
    ("header alone", "x,y,volume\n", "body[0].file", "holds no particle"),
    ("empty", "", "body[0].file", "holds no particle"),
]

# what follows `ordo check case.toml` and `ordo run case.toml`, what the message names, the remedy
OPTION_FAULTS = [
    (["--set", "grid.spacing"], "grid.spacing", "key=value"),
    (["--set", "=3"], "=3", "key=value"),
    (["--set", "body.1.radius=0.1"], "body.1.radius", "from 0 to 0"),
    (["--set", "body.-1.radius=0.1"], "body.-1.radius", "from 0 to 0"),
    (["--set", "body.first.radius=0.1"], "body.first.radius", "from 0 to 0"),
    (["--set", "grid.spcing=0.1"], "grid.spcing", 'Did you mean "spacing"?'),
    (["--set", "gird.spacing=0.1"], "gird", 'Did you mean "grid"?'),
    (["--set", "grid.dim=two"], "grid.dim", "must be an integer"),
    (["--set", "grid.dim.x=2"], "grid.dim.x", "no table"),
    (["--set", "grid.size=[1,1,1]"], "grid.size", "must have 2 values"),
    (["--set", "body.0.radius="], "radius", "must be a number"),
    (["--set", "body.0.velocity=[0, 'q']"], "velocity", "cannot be read"),
    (["--set", "material.0.density=-1"], "density", "must be positive"),
    (["--set", "output.directory=case.toml/sub"], "output.directory", "is not a directory"),
    (["--set", "body=[]", "--set", "body.0.radius=1"], "body.0.radius", "the list is empty"),
    (["--set", "grid." + "a." * 1000 + "a=1"], "grid.a", "has a key of"),
    (["--set", "ti\ntle"], "ti\\x0atle", "key=value"),
    (["--set", os.fsdecode(b"title=\xff")], "title", "is neither TOML nor text"),
    (["--output", "case.toml"], "case.toml", "is not a directory"),
    (["--output", "case.toml/sub"], "case.toml/sub", "is not a directory"),
    (["--nonsense"], "--nonsense", "--help"),
    (["extra.toml"], "extra.toml", "--help"),
]

# a whole command line, what the message names, the remedy
COMMAND_FAULTS = [
    ([], "subcommand", "--help"),
    (["rum"], "rum", "--help"),
    (["run"], "case", "--help"),
    (["check"], "case", "--help"),
    (["run", "nowhere.toml"], "nowhere.toml", "give the path of a case file"),
    (["check", "nowhere.toml"], "nowhere.toml", "give the path of a case file"),
    (["run", "."], "is a directory", "case.toml"),
    (["check", "/dev/zero"], "/dev/zero", "larger than 16 MB"),
    (["run", "case.toml", "--restart", "."], "it is a directory", "--restart latest"),
    (["check", "."], "is a directory", "case.toml"),
    (["run", "case.toml", "--threads", "0"], "--threads", "1"),
    (["run", "case.toml", "--threads", "-2"], "--threads", "1"),
    (["run", "case.toml", "--threads", "two"], "--threads", "two"),
    (["run", "case.toml", "--set"], "--set", "--help"),
    (["list", "colours"], "colours", "methods"),
    (["bench", "--method", "cpdi"], "cpdi", 'Did you mean "cpdi1"?'),
    (["bench", "--dim", "4"], "--dim", "1"),
    (["bench", "--material", "j3"], "--material j3", 'Did you mean "j2"?'),
    (["bench", "--material", "linear-rate-1d"], "model", "exists in 1D only"),
    (["bench", "--particles", "0"], "--particles", "1"),
    (["bench", "--particles", "100", "--steps", "1", "--json", "case.toml/speed.json"], "case.toml/speed.json", "cannot be"),
    (["bench", "--steps", "0"], "--steps", "1"),
    (["bench", "--repeat", "0"], "--repeat", "1"),
    (["bench", "--set", "mas=lumped"], "mas", 'Did you mean "mass"?'),
    (["bench", "--set", "mass=lump"], "mass=lump", 'Did you mean "lumped"?'),
    (["bench", "--set", "method.mass=lump"], "method.mass=lump", 'Did you mean "lumped"?'),
    (["bench", "--set", "mass"], "--set mass", "key=value"),
    (["bench", "--set", "preset=mpm"], "preset", "--method"),
    (["bench", "--set", "degree=4"], "degree=4", "from 0 to 3"),
    (["bench", "--set", "degree=1.5"], "degree=1.5", "must be an integer"),
    (["bench", "--set", "enrichment=all"], "enrichment", "other domains have no shared corners"),
    (["bench", "--all", "--set", "mass=lump"], "mass=lump", 'Did you mean "lumped"?'),
    (["bench", "--all", "--method", "mpm"], "--all", "leave out --method"),
]


def split_mark(text):
    """The text without its mark, and the place "line:column" where it stood, or None."""
    before, mark, after = text.partition(MARK)
    place = f"{before.count(chr(10)) + 1}:{len(before) - before.rfind(chr(10))}"
    return before + after, place if mark else None


class BadInput(InTemporaryDirectory):
    def assert_refused(self, *args, says):
        """Exit code 2, one line on stderr that says all of it, and nothing written. Wrong usage also points at --help."""
        before = sorted(self.dir.rglob("*"))
        done = ordo(*args, cwd=self.dir)
        self.assertEqual(done.returncode, 2, done.stderr)
        self.assertEqual(done.stdout, "")
        for part in says:
            self.assertIn(part, done.stderr)
        if not done.stderr.endswith(USAGE):
            self.assertTrue(done.stderr.startswith("ordo: error: "), done.stderr)
            self.assertEqual(done.stderr.count("\n"), 1, done.stderr)
        self.assertEqual(sorted(self.dir.rglob("*")), before, "something was written")

    def test_case(self):
        for (name, changes, key, remedy), command in itertools.product(CASE_FAULTS, COMMANDS):
            text, place = split_mark(edit(CASE, *changes))
            self.write("case.toml", text)
            where = f"case.toml:{place}: {key}" if place else f"case.toml: {key}"
            with self.subTest(name, command=command):
                self.assert_refused(command, "case.toml", says=[where, remedy])

    def test_case_that_is_not_text(self):
        (self.dir / "case.toml").write_bytes(b"\x89HDF\r\n\x1a\n\x00\xff")
        for command in COMMANDS:
            with self.subTest(command=command):
                self.assert_refused(command, "case.toml", says=["case.toml:1:1", "not valid TOML"])

    def test_particle_file(self):
        case = edit(CASE, (BODY, BODY.split("shape")[0] + "shape = 'particles'\nfile = @'particles.csv'\n"))
        case, place = split_mark(case)
        self.write("case.toml", case)
        for (name, csv, key, remedy), command in itertools.product(CSV_FAULTS, COMMANDS):
            (self.dir / "particles.csv").unlink(missing_ok=True)
            text, csv_place = split_mark(csv or "")
            if csv is not None:
                self.write("particles.csv", text)
            where = f"particles.csv:{csv_place}: {key}" if csv_place else f"case.toml:{place}: {key}"
            with self.subTest(name, command=command):
                self.assert_refused(command, "case.toml", says=[where, remedy])

    def test_options_of_a_case(self):
        self.write("case.toml", CASE)
        for (options, key, remedy), command in itertools.product(OPTION_FAULTS, COMMANDS):
            with self.subTest(" ".join(options), command=command):
                self.assert_refused(command, "case.toml", *options, says=[key, remedy])

    def test_command_line(self):
        self.write("case.toml", CASE)
        can_restart = has_hdf5()
        for args, names, remedy in COMMAND_FAULTS:
            with self.subTest(" ".join(args) or "nothing"):
                needs = "--restart" in args and not can_restart
                self.assert_refused(*args, says=["--restart", "needs HDF5"] if needs else [names, remedy])

    def test_particles_far_from_a_periodic_grid(self):
        self.write("case.toml", edit(CASE, (BODY, 'material = "rubber"\nshape = "particles"\nfile = "particles.csv"\n'), wall("x-min", "periodic")))
        for text, says in (("x,y,volume\n1e300,0.5,0.01\n", "lies outside the grid"), ("x,y,volume\n0.1,0.5,0.01\n0.2,0.5,1e200\n0.3,0.5,0.01\n", "overlaps itself")):
            self.write("particles.csv", text)
            with self.subTest(says):
                self.assert_refused("check", "case.toml", says=["body[0].file", says])

    def test_the_echo_of_the_shortest_run_is_a_case(self):
        self.write("case.toml", edit(CASE, ("end = 0.01", "end = 5e-324")))
        self.write("again.toml", ordo("check", "case.toml", cwd=self.dir).stdout)
        self.assertEqual(ordo("check", "again.toml", cwd=self.dir).returncode, 0)

    def test_the_table_is_about_a_valid_case(self):
        self.write("case.toml", CASE)
        for dim in (1, 2, 3):
            self.assertEqual(ordo("check", "case.toml", "--set", f"grid.dim={dim}", cwd=self.dir).returncode, 0)

