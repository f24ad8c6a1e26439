"""`ordo verify` from outside: the form of its JSON and table, what it refuses, and that its numbers are right.

Every entry that a test reads is checked against the contract and against itself: orders from errors, verdicts from rows.
"""

import json
import math
import os
import re
import stat
import subprocess
import unittest.mock

import matplotlib.image
from harness import ORDO, PRESETS, InTemporaryDirectory, ordo

USAGE = "Run with --help for more information.\n"
BAR = ["vibration-1d", "--method", "cpdi1"]
ERRORS = ("displacement", "velocity", "stress", "density")
NAMED = ("error", "error_l2", "error_relative", "quantities")
NUMBER = (int, float)
ENTRY_KEYS = {"case": str, "method": str, "parameters": dict, "rows": list, "bars": list, "pass": (bool, type(None))}
ROW_KEYS = {"cells": int, "h": NUMBER, "particles": int, "steps": int, "dt": NUMBER, "seconds": NUMBER, "error": dict, "error_l2": dict,
            "error_relative": dict, "quantities": dict, "order": (dict, type(None)), "failed": (str, type(None))}
BAR_KEYS = {"what": str, "limit": str, "value": (*NUMBER, type(None)), "pass": (bool, type(None))}

# case, a coarse mesh, parameters
COARSE = [
    ("vibration-1d", 8, []),
    ("vibration-2d", 8, []),
    ("vibration-3d", 4, []),
    ("vibration-two-waves", 8, []),
    ("vibration-shifted", 16, []),
    ("ring", 10, []),
    ("ring", 10, ["dim=3"]),
    ("vortex", 8, []),
    ("vortex", 8, ["dim=3"]),
    ("shear-rotation", 8, []),
    ("shear-rotation", 6, ["dim=3"]),
    ("rotation", 8, []),
    ("rotation", 6, ["dim=3"]),
    ("simple-shear", 4, []),
    ("simple-shear", 4, ["dim=3"]),
    ("ring", 10, ["rims=loaded", "nu=0.3"]),
    ("bar-small-strain", 5, []),
    ("bar-traction", 8, []),
    ("bar-large-strain", 5, []),
    ("plate-impact", 50, []),
    ("plate-impact", 50, ["law=johnson-cook", "speed=500"]),
    ("couette", 8, []),
    ("poiseuille", 8, []),
    ("plastic-bar", 8, []),
    ("plastic-bar", 8, ["dim=2", "amplitude=-0.1"]),
    ("plastic-ring", 10, []),
    ("viscous-box", 8, []),
    ("viscous-box", 4, ["dim=3"]),
    ("thick-cylinder", 4, ["end=0.5"]),
    ("grains-on-plane", 40, ["end=0.2"]),
    ("two-disks", 20, []),
    ("wall-rebound", 20, []),
    ("reconstruction", 8, []),
    ("reconstruction", 8, ["dim=2", "points=stretched"]),
    ("dispersion", 16, ["steps=200"]),
    ("dispersion", 8, ["dim=2", "steps=0"]),
]
WITHOUT_SOLUTION = ("two-disks", "wall-rebound", "dispersion", "thick-cylinder", "grains-on-plane")
WITHOUT_STEPS = ("reconstruction", "dispersion")
WITH_REFERENCE = ("bar-large-strain",)
WITH_STEPS_OF_THE_LAW = ("plate-impact", "couette", "poiseuille", "viscous-box", "thick-cylinder", "grains-on-plane")  # their material is not among the parameters

# what follows `ordo verify`, what the message names, what else it says (the remedy)
FAULTS = [
    # the case
    ([], "case", "--all"),
    (["vibration-1d", "--all"], "case", "--all"),
    (["--all", "--cells", "8"], "--all", "--cells"),
    (["--all", "--ppc", "4"], "--all", "--ppc"),
    (["--all", "--set", "nu=0"], "--all", "--set"),
    (["--all", "--method", "cpdi"], "--method cpdi", 'Did you mean "cpdi1"?'),
    (["vibraton-1d"], "vibraton-1d", 'Did you mean "vibration-1d"?'),
    (["rings", "--cells", "8"], "rings", 'Did you mean "ring"?'),
    (["earthquake"], "earthquake", "vortex"),
    ([""], "case", "vortex"),
    (["vibration-1d", "vibration-2d"], "vibration-2d", "--help"),
    # methods
    (["vibration-1d", "--method", "cpdi"], "--method cpdi", 'Did you mean "cpdi1"?'),
    (["vibration-1d", "--method", "cpdi1,mpmm"], "--method mpmm", 'Did you mean "mpm"?'),
    (["vibration-1d", "--method", "lattice"], "--method lattice", "cpgimp"),
    (["vibration-1d", "--method", ""], "--method", "cpgimp"),
    # meshes
    ([*BAR, "--cells", "0"], "--cells", "1"),
    ([*BAR, "--cells", "-8"], "--cells", "1"),
    ([*BAR, "--cells", "8,0"], "--cells", "1"),
    ([*BAR, "--cells", "eight"], "--cells", "eight"),
    ([*BAR, "--cells", "8.5"], "--cells", "8.5"),
    ([*BAR, "--cells", "nan"], "--cells", "nan"),
    ([*BAR, "--cells", ""], "--cells", "1"),
    ([*BAR, "--cells", "8 16"], "--cells", "8 16"),
    ([*BAR, "--cells", "99999999999"], "--cells", "1"),
    ([*BAR, "--cells", "8,8"], "--cells", "8"),
    ([*BAR, "--cells", "16,8"], "--cells", "8"),
    ([*BAR, "--cells", "8,16,8"], "--cells", "8"),
    ([*BAR, "--cells", "8", "--cells", "8"], "--cells", "8"),
    # particles per cell
    ([*BAR, "--ppc", "0"], "--ppc", "1"),
    ([*BAR, "--ppc", "-4"], "--ppc", "1"),
    ([*BAR, "--ppc", "four"], "--ppc", "four"),
    ([*BAR, "--ppc", "4.5"], "--ppc", "4.5"),
    (["vibration-2d", "--method", "cpdi1", "--ppc", "3"], "--ppc 3", "2D"),
    (["vibration-2d", "--method", "cpdi1", "--ppc", "8"], "--ppc 8", "2D"),
    (["vibration-3d", "--method", "cpdi1", "--ppc", "4"], "--ppc 4", "3D"),
    (["ring", "--method", "cpdi1", "--set", "dim=3", "--ppc", "4"], "--ppc 4", "3D"),
    # parameters and axes
    ([*BAR, "--set", "amplitude"], "--set amplitude", "key=value"),
    ([*BAR, "--set", "amplitude 1"], "--set amplitude 1", "key=value"),
    ([*BAR, "--set", "=1"], "--set =1", "key=value"),
    ([*BAR, "--set", ""], "--set", "key=value"),
    ([*BAR, "--set"], "--set", "--help"),
    ([*BAR, "--set", "amplitde=1"], "--set amplitde", 'Did you mean "amplitude"?'),
    ([*BAR, "--set", "colour=1"], "--set colour", "amplitude"),
    ([*BAR, "--set", "scheme=musl"], "--set scheme", "method."),
    (["two-disks", "--method", "cpdi1", "--set", "amplitude=1"], "--set amplitude", "two-disks"),
    ([*BAR, "--set", "method.shceme=musl"], "--set method.shceme", 'Did you mean "scheme"?'),
    ([*BAR, "--set", "method.=musl"], "--set method.", "scheme"),
    ([*BAR, "--set", "method.preset=mpm"], "--set method.preset", "--method"),
    ([*BAR, "--set", "method.scheme=mulls"], "--set method.scheme=mulls", 'Did you mean "musl"?'),
    ([*BAR, "--set", "method.scheme="], "--set method.scheme=", "musl"),
    ([*BAR, "--set", "method.pic_fraction=2"], "--set method.pic_fraction=2", "from 0 to 1"),
    ([*BAR, "--set", "method.pic_fraction=nan"], "--set method.pic_fraction=nan", "number"),
    ([*BAR, "--set", "material=neohookean"], "--set material=neohookean", 'Did you mean "neo-hookean"?'),
    ([*BAR, "--set", "material=1"], "--set material=1", "st-venant-kirchhoff"),
    (["ring", "--method", "cpdi1", "--set", "dim=4"], "--set dim=4", "2"),
    ([*BAR, "--set", "amplitude="], "--set amplitude=", "must be a number"),
    ([*BAR, "--set", "amplitude=nan"], "--set amplitude=nan", "must be a number"),
    ([*BAR, "--set", "amplitude=inf"], "--set amplitude=inf", "must be a number"),
    ([*BAR, "--set", "amplitude=-inf"], "--set amplitude=-inf", "must be a number"),
    ([*BAR, "--set", "amplitude=1e999"], "--set amplitude=1e999", "must be a number"),
    ([*BAR, "--set", "amplitude=0.1m"], "--set amplitude=0.1m", "must be a number"),
    ([*BAR, "--set", "amplitude=0.1,0.2"], "--set amplitude=0.1,0.2", "must be a number"),
    ([*BAR, "--set", "amplitude=large"], "--set amplitude=large", "must be a number"),
    ([*BAR, "--set", "cfl=0"], "--set cfl=0", "larger than 0"),
    ([*BAR, "--set", "end=-1"], "--set end=-1", "larger than 0"),
    ([*BAR, "--set", "nu=0.5"], "--set nu=0.5", "between -1 and 0.5"),
    ([*BAR, "--set", "nu=0.3", "--set", "young=0"], "--set young=0", "larger than 0"),
    # output
    ([*BAR, "--json", "nowhere/errors.json"], "--json nowhere/errors.json", "cannot be"),
    ([*BAR, "--json", "file/errors.json"], "--json file/errors.json", "cannot be"),
    ([*BAR, "--json", "."], "--json .", ""),
    ([*BAR, "--json", ""], "--json", ""),
    ([*BAR, "--threads", "0"], "--threads", "1"),
    ([*BAR, "--nonsense"], "--nonsense", "--help"),
]


def refuse_constant(name):
    raise ValueError(f"{name} is not JSON")


def parse(text):
    """JSON as the standard has it, without nan and inf."""
    return json.loads(text, parse_constant=refuse_constant)


def value_of(row, name):
    """The number of a row that a bar names: an error, `l2 NAME`, `relative NAME`, a quantity, or whether the run fails."""
    if name == "run fails":
        return int(row["failed"] is not None)
    kind, _, key = name.rpartition(" ")
    return {"": {**row["quantities"], **row["error"]}, "l2": row["error_l2"], "relative": row["error_relative"]}[kind].get(key)


def order_between(coarse, fine, name):
    e1, e2 = value_of(coarse, name), value_of(fine, name)
    return math.log(e1 / e2) / math.log(coarse["h"] / fine["h"]) if e1 and e2 else None


def within(value, limit):
    """Whether a value keeps a limit of the forms `>= a`, `<= b`, `in [a, b]`."""
    low, high = -math.inf, math.inf
    if limit.startswith(">= "):
        low = float(limit[3:])
    elif limit.startswith("<= "):
        high = float(limit[3:])
    else:
        low, high = map(float, re.fullmatch(r"in \[(.*), (.*)\]", limit).groups())
    return value is not None and low <= value <= high


def named_meshes(what):
    """The meshes that a bar names at its end: `order 32-64`, `at 32`."""
    return [int(n) for n in re.search(r" (?:order|at) (\d+)(?:-(\d+))?$", what).groups() if n]


def without_times(value):
    """The JSON without its wall times."""
    if isinstance(value, dict):
        return {k: without_times(v) for k, v in value.items() if not k.startswith("seconds")}
    return [without_times(v) for v in value] if isinstance(value, list) else value


class Verify(InTemporaryDirectory):
    def verify(self, *args):
        """Runs `ordo verify` on one thread unless told otherwise."""
        return ordo("verify", *args, *(() if "--threads" in args else ("--threads", "1")), cwd=self.dir)

    def measure(self, *args):
        """The entries that a good call prints as JSON, each checked; the exit code is 1 if one of them does not pass."""
        done = self.verify(*args, "--json", "-")
        self.assertIn(done.returncode, (0, 1), done.stderr)
        entries = parse(done.stdout)
        for entry in entries:
            self.check_entry(entry)
        self.assertEqual(done.returncode, int(any(entry["pass"] is False for entry in entries)), done.stderr)
        return entries

    def measure_one(self, *args):
        (entry,) = self.measure(*args)
        return entry

    def check_types(self, item, wanted):
        self.assertLessEqual(set(wanted), set(item))
        for key, kind in wanted.items():
            self.assertIsInstance(item[key], kind, key)
            self.assertFalse(isinstance(item[key], bool) and kind in (int, NUMBER), key)

    def check_numbers(self, named):
        for name, value in named.items():
            self.assertIsInstance(value, (*NUMBER, type(None)), name)

    def check_entry(self, entry):
        self.check_types(entry, ENTRY_KEYS)
        for name, value in entry["parameters"].items():
            self.assertIsInstance(value, (*NUMBER, str), name)
        self.assertTrue(entry["rows"])
        for before, row in zip([None, *entry["rows"]], entry["rows"]):
            self.check_row(row, entry)
            self.check_order(before, row)
        for bar in entry["bars"]:
            self.check_bar(bar, entry["rows"])
        evaluated = [bar["pass"] for bar in entry["bars"] if bar["pass"] is not None]
        self.assertEqual(entry["pass"], all(evaluated) if evaluated else None)

    def check_row(self, row, entry):
        self.check_types(row, ROW_KEYS)
        for kind in NAMED:
            self.check_numbers(row[kind])
        self.assertGreater(row["particles"], 0)
        self.assertGreaterEqual(row["seconds"], 0)
        self.assertAlmostEqual(row["h"] * row["cells"], 1, places=12)
        if entry["case"] in WITHOUT_STEPS:
            self.assertEqual((row["steps"], row["dt"], row["failed"]), (0, 0, None))
            return
        parameters = entry["parameters"]
        if entry["case"] in WITH_STEPS_OF_THE_LAW:
            if row["failed"] is None:
                self.assertAlmostEqual(row["dt"] * row["steps"] / parameters["end"], 1, places=12, msg="steps are equal")
            else:
                self.check_failed(row)
            return
        limit = parameters["dt"] if "dt" in parameters else \
            parameters["cfl"] * row["h"] * math.sqrt(parameters["density"] / parameters["young"])
        steps = math.ceil(parameters["end"] / limit * (1 - 1e-9))
        self.assertAlmostEqual(row["dt"] * steps / parameters["end"], 1, places=12, msg="steps are equal, at most cfl h/c")
        if row["failed"] is None:
            self.assertEqual(row["steps"], steps)
        else:
            self.assertTrue(0 <= row["steps"] <= steps)
            self.check_failed(row)

    def check_failed(self, row):
        self.assertNotEqual(row["failed"], "")
        for kind in (*NAMED, "order"):
            self.assertEqual(set((row[kind] or {}).values()) - {None}, set(), f"a failed run has no {kind}")

    def check_order(self, before, row):
        if before is None:
            self.assertIsNone(row["order"])
            return
        order = row["order"] or {}
        for name in {*ERRORS, *order}:
            wanted = order_between(before, row, "l2 velocity_grid" if name == "velocity_grid" else name)
            if wanted is None:
                self.assertIsNone(order.get(name), name)
            else:
                self.assertAlmostEqual(order[name], wanted, places=9, msg=name)

    def check_bar(self, bar, rows):
        """A verdict follows from the rows if they have the meshes that it names; else there is none."""
        self.check_types(bar, BAR_KEYS)
        by_cells = {row["cells"]: row for row in rows}
        meshes = named_meshes(bar["what"])
        if not set(meshes) <= set(by_cells):
            self.assertEqual((bar["value"], bar["pass"]), (None, None), bar["what"])
            return
        self.assertIs(bar["pass"], within(bar["value"], bar["limit"]), bar)
        name, on = bar["what"].rsplit(" ", 2)[0], [by_cells[n] for n in meshes]
        wanted = order_between(*on, name) if len(on) == 2 else value_of(*on, name)
        self.assertEqual(wanted is None, bar["value"] is None, bar)
        if wanted is not None:
            self.assertTrue(math.isclose(bar["value"], wanted, rel_tol=1e-9), bar)


class Form(Verify):
    def test_contract(self):
        done = self.verify(*BAR, "--cells", "8,16,32", "--set", "amplitude=1e-4", "--json", "-")
        self.assertEqual(done.returncode, 0, done.stderr)
        (entry,) = parse(done.stdout)
        self.check_entry(entry)
        self.assertEqual((entry["case"], entry["method"]), ("vibration-1d", "cpdi1"))
        self.assertEqual([row["cells"] for row in entry["rows"]], [8, 16, 32])
        for row in entry["rows"]:
            self.assertEqual(set(row["error"]), set(ERRORS))
            self.assertEqual(set(row["error_l2"]), {*ERRORS, "velocity_grid"})
            self.assertEqual(row["error_relative"], {})
            self.assertEqual(row["particles"], 2 * row["cells"])
            self.assertEqual(row["steps"], 5 * row["cells"])  # end c/(cfl h) with end = 0.02 s, c = 100 m/s, cfl = 0.4
            self.assertIsNone(row["failed"])
            for name in ERRORS:  # the body fills a unit of volume
                self.assertAlmostEqual(row["error_l2"][name] / row["error"][name], 1, delta=1e-3)
        for row in entry["rows"][1:]:
            self.assertEqual(set(row["order"]), {*ERRORS, "velocity_grid"})
        self.check_table(done.stderr, entry)

    def check_table(self, table, entry):
        """A title, a header, and one line a mesh with its number of cells, errors and orders."""
        self.assertIn(entry["case"], table)
        self.assertIn(entry["method"], table)
        self.assertRegex(table, r"(?m)^ *cells +particles +steps .*displacement")
        for row in entry["rows"]:
            (line,) = re.findall(rf"(?m)^ *{row['cells']} +{row['particles']} +{row['steps']} .*$", table)
            self.assertIn(f"{row['error']['displacement']:.4e}", line)
            if row["order"]:
                self.assertIn(f" {row['order']['displacement']:.2f}", line)

    def test_the_table_is_on_stdout_without_json(self):
        done = self.verify(*BAR, "--cells", "8,16")
        self.assertEqual((done.returncode, done.stderr), (0, ""))
        self.check_table(done.stdout, self.measure_one(*BAR, "--cells", "8,16"))

    def test_json_in_a_file(self):
        self.write("errors.json", "of yesterday, and longer than that of today\n" * 1000)
        done = self.verify(*BAR, "--cells", "8,16", "--json", "errors.json")
        self.assertEqual((done.returncode, done.stderr), (0, ""))
        self.assertEqual([p.name for p in self.dir.iterdir()], ["errors.json"])
        entries = parse((self.dir / "errors.json").read_text())
        self.assertEqual(without_times(entries), without_times(self.measure(*BAR, "--cells", "8,16")))
        self.check_table(done.stdout, entries[0])

    def test_a_pipe_stays_a_pipe(self):
        pipe = self.dir / "pipe"
        os.mkfifo(pipe)
        reader = os.open(pipe, os.O_RDONLY | os.O_NONBLOCK)
        self.addCleanup(os.close, reader)
        self.verify(*BAR, "--cells", "8", "--json", "pipe")
        self.assertTrue(stat.S_ISFIFO(pipe.stat().st_mode), "a file took the place of what --json named; it could be /dev/null")

    def code(self, *options, **streams):
        return subprocess.run([ORDO, "verify", *BAR, "--cells", "8", "--threads", "1", *options], cwd=self.dir, **streams).returncode

    def test_lost_messages_are_no_failure(self):
        with open("/dev/full", "w") as full, open(self.dir / "errors.json", "w") as out:
            self.assertEqual(self.code("--json", "-", stdout=out, stderr=full), 0)
        self.check_entry(parse((self.dir / "errors.json").read_text())[0])

    def test_lost_data_are_a_failure(self):
        with open("/dev/full", "w") as full:
            for options in ([], ["--json", "-"]):
                with self.subTest(options):
                    self.assertEqual(self.code(*options, stdout=full, stderr=subprocess.DEVNULL), 1)

    def test_several_methods(self):
        for options in (["--method", "cpdi1,mpm,ugimp"], ["--method", "cpdi1", "--method", "mpm,ugimp"]):
            with self.subTest(options):
                entries = self.measure("vibration-1d", *options, "--cells", "8,16")
                self.assertEqual([entry["method"] for entry in entries], ["cpdi1", "mpm", "ugimp"])
                self.assertEqual(len({entry["rows"][1]["error"]["stress"] for entry in entries}), 3)

    def test_help(self):
        done = self.verify("--help")
        self.assertEqual(done.returncode, 0)
        for option in ("--all", "--method", "--cells", "--ppc", "--set", "--json", "--threads"):
            self.assertIn(option, done.stdout)

    def test_threads(self):
        """A body of several pieces of a reduction, in several tiles of cells."""
        self.enterContext(unittest.mock.patch.dict(os.environ, OMP_WAIT_POLICY="passive"))  # no spinning on a busy machine
        for case, cells in (("vibration-2d", "12,26"), ("vortex", "16"), ("vibration-3d", "8")):
            one = without_times(self.measure(case, "--method", "cpdi1", "--cells", cells, *self.short(case), "--threads", "1"))
            for threads in ("2", "3"):
                with self.subTest(case, threads=threads):
                    many = self.measure(case, "--method", "cpdi1", "--cells", cells, *self.short(case), "--threads", threads)
                    self.assertEqual(without_times(many), one)

    @staticmethod
    def short(case):
        return ["--set", "end=0.1" if case == "vortex" else "end=0.005"]


class Settings(Verify):
    def test_particles_per_cell(self):
        for case, cells, ppc, particles in [
            ("vibration-1d", 8, 3, 24),
            ("vibration-2d", 4, 1, 16),
            ("vibration-2d", 4, 4, 64),
            ("vibration-2d", 4, 9, 144),
            ("vibration-3d", 3, 1, 27),
            ("vibration-3d", 3, 27, 729),
            ("shear-rotation", 4, 16, 256),
        ]:
            with self.subTest(case, ppc=ppc):
                entry = self.measure_one(case, "--method", "cpdi1", "--cells", cells, "--ppc", ppc, "--set", "amplitude=0.01")
                self.assertEqual(entry["parameters"]["ppc"], ppc)
                self.assertEqual(entry["rows"][0]["particles"], particles)

    def test_defaults_are_echoed(self):
        parameters = self.measure_one(*BAR, "--cells", "8")["parameters"]
        wanted = {"amplitude": 0.1, "material": "neo-hookean", "young": 1e7, "nu": 0.3, "density": 1000, "cfl": 0.4, "end": 0.02, "ppc": 2}
        self.assertLessEqual(wanted.items(), parameters.items())

    def test_changes_are_echoed_and_matter(self):
        default = self.measure_one(*BAR, "--cells", "8")
        for text, value in [
            ("amplitude=5e-2", 0.05),
            ("end=0.01", 0.01),
            ("cfl=0.2", 0.2),
            ("nu=0", 0),
            ("young=2e7", 2e7),
            ("density=500", 500),
            ("material=st-venant-kirchhoff", "st-venant-kirchhoff"),
            ("method.scheme=musl", "musl"),
            ("method.domain=box", "box"),
            ("method.pic_fraction=0.1", 0.1),
        ]:
            with self.subTest(text):
                key = text.split("=")[0]
                entry = self.measure_one(*BAR, "--cells", "8", "--set", text)
                echoed = entry["parameters"][key]
                self.assertEqual(type(value)(echoed), value)
                self.assertEqual({**entry["parameters"], key: None}, {**default["parameters"], key: None})
                self.assertNotEqual(entry["rows"][0]["error"], default["rows"][0]["error"])

    def test_failures_name_the_limit_of_the_step(self):
        for method, mass, limit in (("cpdi1", "consistent", "less where domains are longer"), ("bsmpm", "consistent", "h/(c + |v|) of the method;"),
                                    ("fem", "lumped", "cells as they are now")):
            with self.subTest(method):
                entry = self.measure_one("vibration-1d", "--method", method, "--cells", "128", "--set", "amplitude=0.1", "--set", f"method.mass={mass}")
                self.assertIn("above the limit", entry["rows"][0]["failed"])
                self.assertIn(limit, entry["rows"][0]["failed"])

    def test_filters_lose_less_with_their_order(self):
        """Two disks collide: PIC loses most of the energy, FMPM of order 8 below 2 % (Nairn, arXiv:2604.07307)."""
        for name, least in (("xpic", [0.36, 0.88, 0.92, 0.94]), ("fmpm", [0.36, 0.90, 0.95, 0.98])):
            kept = []
            for order in (1, 2, 4, 8):
                entry = self.measure_one("two-disks", "--method", name, "--cells", "20", "--set", f"method.filter_order={order}")
                kept.append(entry["rows"][0]["quantities"]["total_energy"])
            with self.subTest(name, kept=kept):
                self.assertEqual(kept, sorted(kept))
                self.assertTrue(all(a > b for a, b in zip(kept, least)))
                self.assertLess(kept[0], 0.4)

    def test_a_preset_is_a_choice_of_axes(self):
        box = self.measure_one(*BAR, "--cells", "8", "--set", "method.domain=box")
        self.assertEqual(box["rows"][0]["error"], self.measure_one("vibration-1d", "--method", "ugimp", "--cells", "8")["rows"][0]["error"])

    def test_the_last_setting_wins(self):
        entry = self.measure_one(*BAR, "--cells", "8", "--set", "amplitude=0.2", "--set", "amplitude=0.01")
        self.assertEqual(entry["parameters"]["amplitude"], 0.01)

    def test_steps_divide_the_end(self):
        for settings, steps in ((["cfl=0.3"], 54), (["end=0.0201"], 41), (["end=1e-6"], 1)):
            with self.subTest(settings):
                entry = self.measure_one(*BAR, "--cells", "8", *(x for s in settings for x in ("--set", s)))
                self.assertEqual(entry["rows"][0]["steps"], steps)


class Refusals(Verify):
    def assert_refused(self, *args, says):
        """Exit code 2, one message on stderr that says all of it, nothing on stdout and nothing written."""
        before = sorted(self.dir.rglob("*"))
        done = ordo("verify", *args, cwd=self.dir)
        self.assertEqual(done.returncode, 2, done.stderr)
        self.assertEqual(done.stdout, "")
        for part in says:
            self.assertIn(part, done.stderr)
        message = done.stderr.removesuffix(USAGE)
        self.assertTrue(message.startswith("ordo: error: ") or message != done.stderr, done.stderr)
        self.assertEqual(message.count("\n"), 1, done.stderr)
        self.assertEqual(sorted(self.dir.rglob("*")), before, "something was written")

    def test_bad_usage(self):
        self.write("file", "a file\n")
        for args, names, remedy in FAULTS:
            with self.subTest(" ".join(args) or "nothing"):
                self.assert_refused(*args, says=[names, remedy])

    def test_more_steps_than_can_be_counted(self):
        for setting in ("cfl=1e-300", "end=1e300", "young=1e300"):
            with self.subTest(setting):
                self.assert_refused(*BAR, "--cells", "8", "--set", setting, says=["steps"])

    def test_a_mesh_without_particles(self):
        done = self.verify("wall-rebound", "--method", "cpdi1", "--cells", "1", "--json", "-")
        if done.returncode != 2:
            self.assertIsNotNone(parse(done.stdout)[0]["rows"][0]["failed"])


class Failures(Verify):
    """A run that ends early is a row with its reason, and no reason to stop."""

    def test_vortex_of_points(self):
        entries = self.measure("vortex", "--method", "mpm,cpdi1", "--cells", "8,10")
        for entry, fails in zip(entries, (True, False)):
            with self.subTest(entry["method"]):
                self.assertEqual([row["cells"] for row in entry["rows"]], [8, 10])
                for row in entry["rows"]:
                    self.assertEqual(row["failed"] is not None, fails)
        for row in entries[0]["rows"]:
            self.assertRegex(row["failed"], r"step \d+, t = .*particle \d+")
            self.assertLess(row["steps"] * row["dt"], entries[0]["parameters"]["end"])

    def test_a_finer_mesh_that_does_not_fail(self):
        vortex = ["vortex", "--method", "cpdi1", "--cells", "3,8,10"]
        rows = self.measure_one(*vortex)["rows"]
        self.assertEqual([row["failed"] is None for row in rows], [False, True, True])
        self.assertIn("failed: ", self.verify(*vortex).stdout)

    def test_its_table_has_all_columns(self):
        table = self.verify("vortex", "--method", "cpdi1", "--cells", "3,8,10").stdout
        self.assertRegex(table, r"(?m)^ *cells .*displacement")

    def test_disks_that_leave_the_box(self):
        row = self.measure_one("two-disks", "--method", "cpdi1", "--set", "end=5")["rows"][0]
        self.assertIn("left the grid", row["failed"])


class Cases(Verify):
    def test_every_case(self):
        for case, cells, settings in COARSE:
            with self.subTest(case, settings=settings):
                entry = self.measure_one(case, "--method", "cpdi1", "--cells", cells, *(x for s in settings for x in ("--set", s)))
                self.assertEqual((entry["case"], entry["method"]), (case, "cpdi1"))
                (row,) = entry["rows"]
                self.assertEqual((row["cells"], row["failed"]), (cells, None))
                errors = () if case in WITHOUT_SOLUTION else ("value", "value_inside") if case in WITHOUT_STEPS else ERRORS
                self.assertEqual(set(row["error"]), set(errors))
                self.assertEqual(set(row["error_relative"]), set(ERRORS) if case in WITH_REFERENCE else set())
                for kind in NAMED:
                    self.assertNotIn(None, row[kind].values())

    def test_the_list_names_cases_and_parameters(self):
        text = ordo("list", "cases", cwd=self.dir).stdout
        for case, cells in {case: cells for case, cells, _ in COARSE}.items():
            with self.subTest(case):
                self.assertRegex(text, rf"(?m)^ *{case}\b")
                for name in self.measure_one(case, "--method", "cpdi1", "--cells", cells)["parameters"]:
                    self.assertRegex(text, rf"\b{name}\b")


class Bars(Verify):
    """`measure` checks each verdict and the exit code; here the choice of meshes decides which bars are judged."""

    FINEST = {"vibration-1d": 128, "vibration-two-waves": 64, "vibration-shifted": 128, "bar-small-strain": 40, "vortex": 16,
              "two-disks": 20, "wall-rebound": 20}

    def test_a_case_alone_is_judged(self):
        for case in ("two-disks", "bar-small-strain"):
            with self.subTest(case):
                entries = self.measure(case)
                self.assertTrue(entries)
                self.assertNotIn(None, [entry["pass"] for entry in entries])

    def test_the_meshes_decide_which_bars_are_judged(self):
        for case, finest in self.FINEST.items():
            entries = self.measure(case, "--cells", "2")
            self.assertTrue(entries, "without --method the case chooses")
            for coarse in entries:
                with self.subTest(case, method=coarse["method"]):
                    self.check_meshes(coarse, finest)

    def check_meshes(self, coarse, finest):
        """The same study on all meshes of its bars has the same bars, judged."""
        bars = [(bar["what"], bar["limit"]) for bar in coarse["bars"]]
        wanted = [named_meshes(what) for what, _ in bars if max(named_meshes(what)) <= finest]
        if not wanted:
            return
        meshes = sorted({n for named in wanted for n in named})
        entry = self.measure_one(coarse["case"], "--method", coarse["method"], "--cells", ",".join(map(str, meshes)))
        self.assertEqual([(bar["what"], bar["limit"]) for bar in entry["bars"]], bars)
        self.assertEqual(sum(bar["pass"] is not None for bar in entry["bars"]), len(wanted))

    def test_bars_hold_for_their_own_parameters(self):
        default = self.measure_one(*BAR, "--cells", "2")
        for setting in ("amplitude=0.0123", "cfl=0.39", "method.scheme=musl"):
            with self.subTest(setting):
                self.assertEqual(self.measure_one(*BAR, "--cells", "2", "--set", setting)["bars"], [])
        self.assertEqual(self.measure_one(*BAR, "--cells", "2", "--set", "amplitude=0.1", "--ppc", "2")["bars"], default["bars"])


class Physics(Verify):
    def test_second_order(self):
        coarse, fine = self.measure_one("vibration-2d", "--method", "cpdi1", "--cells", "16,32")["rows"]
        self.assertGreater(math.log2(coarse["error"]["displacement"] / fine["error"]["displacement"]), 1.8)

    def test_the_projection_keeps_momentum(self):
        for preset in PRESETS:
            for case, cells in (("vibration-1d", 16), ("vibration-2d", 8), ("vibration-shifted", 16), ("shear-rotation", 16)):
                with self.subTest(case, preset=preset):
                    (row,) = self.measure_one(case, "--method", preset, "--cells", cells, "--set", "amplitude=0.01")["rows"]
                    self.assertIsNone(row["failed"])
                    quantities = row["quantities"]
                    self.assertLess(quantities["momentum_defect"], 1e-12)
                    self.assertAlmostEqual(quantities["momentum_grid_x"], quantities["momentum_x"], delta=1e-12 * 1000 * math.pi)

    def test_velocities_are_those_of_half_a_step_before(self):
        """v = A c pi sin(pi X) cos(c pi t); the sum of sin^2 over equal cells is exact."""
        (row,) = self.measure_one(*BAR, "--cells", "16", "--set", "amplitude=1e-4")["rows"]
        peak = 1e-4 * 100 * math.pi
        energy = 0.25 * 1000 * (peak * math.cos(100 * math.pi * (0.02 - row["dt"] / 2))) ** 2
        self.assertAlmostEqual(row["quantities"]["kinetic_energy_exact"] / energy, 1, places=9)
        self.assertAlmostEqual(row["quantities"]["kinetic_energy"] / energy, 1, delta=0.05)

    def test_rest_is_exact(self):
        for row in self.measure_one("vibration-2d", "--method", "cpdi1", "--cells", "4,8", "--set", "amplitude=0")["rows"]:
            self.assertEqual({*row["error"].values(), *row["error_l2"].values()}, {0})

    def test_two_disks(self):
        (row,) = self.measure_one("two-disks", "--method", "cpdi1")["rows"]
        self.assertTrue(0.945 <= row["quantities"]["total_energy"] <= 0.965, row["quantities"])
        self.assertLess(row["quantities"]["momentum_change"], 1e-12)


class Dispersion(Verify):
    """Limits of the time step from outside; `--ppc`, `--set` and `--method` mean what they do for other cases."""

    def quantities(self, *args):
        (row,) = self.measure_one("dispersion", *args)["rows"]
        return row["quantities"]

    def test_limits_of_mpm(self):
        for ppc, limit in ((1, 0.7071), (2, 0.7559), (3, 0.7661), (4, 0.7698)):
            with self.subTest(ppc=ppc):
                found = self.quantities("--method", "mpm", "--ppc", ppc)
                self.assertAlmostEqual(found["limit"], limit, delta=1e-4)
                self.assertAlmostEqual(found["limit_predicted"], limit, delta=1e-4)
                self.assertLess(found["amplification_below"], 10)
                self.assertGreater(found["amplification_above"], 100)
                self.assertLess(found["growth"], 1 + 1e-9)

    def test_a_shift_and_the_worst_of_shifts(self):
        own = self.quantities("--method", "impm", "--set", "shift=0.25", "--set", "steps=0")
        worst = self.quantities("--method", "impm", "--set", "shifts=3", "--set", "steps=0")
        self.assertGreater(own["growth_rate"], 0.01)
        self.assertGreaterEqual(worst["growth_rate"], own["growth_rate"])
        self.assertEqual(self.quantities("--method", "impm", "--set", "steps=0")["stable_from"], 0)

    def test_axes_and_cfl(self):
        musl = self.quantities("--method", "mpm", "--ppc", "1", "--set", "method.scheme=musl", "--set", "steps=0")
        self.assertGreater(musl["limit"], 0.99)
        self.assertGreater(self.quantities("--method", "mpm", "--set", "cfl=0.9", "--set", "steps=0")["growth"], 1.1)

    def test_curves(self):
        (row,) = self.measure_one("dispersion", "--method", "cpdi1", "--set", "steps=0")["rows"]
        curves = row["curves"]
        self.assertEqual({len(c) for c in curves.values()}, {64})
        self.assertAlmostEqual(curves["theta"][-1], math.pi)
        self.assertLess(max(curves["growth"]), 1 + 1e-9)
        self.assertAlmostEqual(curves["wave_speed"][0], 1, delta=1e-3)

    def test_what_cannot_be_solved_is_a_row(self):
        """One particle on each node leaves the consistent mass matrix of splines singular."""
        done = self.verify("dispersion", "--method", "bsmpm", "--ppc", "1", "--set", "shift=0.5", "--json", "-")
        self.assertIn("mass matrix", parse(done.stdout)[0]["rows"][0]["failed"])


class Figures(Verify):
    def test_a_spectrum_a_method(self):
        self.verify("dispersion", "--method", "mpm,cpdi1", "--set", "steps=0", "--figures", "plots")
        names = {f.name for f in (self.dir / "plots").iterdir()} - {"verify.json"}
        self.assertEqual(names, {"dispersion-mpm.png", "dispersion-cpdi1.png"})

    def test_one_a_set_of_parameters(self):
        self.verify("vibration-1d", "--method", "mpm,cpdi1", "--cells", "8,16", "--figures", "plots/new")
        names = {f.name for f in (self.dir / "plots" / "new").iterdir()}
        self.assertIn("verify.json", names)
        plots = {name for name in names if not name.endswith(".csv")} - {"verify.json"}
        self.assertTrue(plots and all(re.fullmatch(r"vibration-1d.*\.png", name) for name in plots), names)
        for name in plots:
            image = matplotlib.image.imread(self.dir / "plots" / "new" / name)[..., :3]
            coloured = (image.max(axis=2) - image.min(axis=2) > 0.2).sum()
            self.assertGreater(coloured, 500, "the second method has a coloured curve")

    def test_failed_meshes_are_drawn(self):
        self.verify("vortex", "--method", "mpm,cpdi1", "--cells", "8,16", "--figures", "plots")
        self.assertTrue([f for f in (self.dir / "plots").iterdir() if f.suffix == ".png"])

    def test_a_folder_that_cannot_be(self):
        (self.dir / "file").write_text("")
        done = ordo("verify", *BAR, "--cells", "8", "--figures", "file", cwd=self.dir)
        self.assertEqual(done.returncode, 2)
        self.assertIn("--figures", done.stderr)
