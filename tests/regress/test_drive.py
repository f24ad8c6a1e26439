"""`ordo drive`: one material point along a path, from a file or by name."""

import csv
import io
import json
import math
import unittest

from harness import InTemporaryDirectory, ordo

J2 = ("drive", "j2", "--set", "young=1000", "--set", "poisson=0.3", "--set", "yield=10")
HEADER = "time,F11,F12,F13,F21,F22,F23,F31,F32,F33\n"
START = "0,1,0,0,0,1,0,0,0,1\n"
LAME, SHEAR = 1000 * 0.3 / (1.3 * 0.4), 1000 / 2.6

# (text of the path, line:column, what the message says, remedy)
PATH_FAULTS = [
    (HEADER.replace("F33", "F34") + START, "1:38", "F34", "the columns are"),
    (HEADER.replace(",F33", "") + START, "1:1", "the column F33 is missing", "the columns are"),
    (HEADER.replace("time,", "") + START, "1:1", "the column time is missing", "the columns are"),
    (HEADER.replace("F33", "F11") + START, "1:38", "another column", "remove one"),
    (HEADER.replace("F21", "S21") + START, "1:18", "symmetric", "give S12"),
    (HEADER + START + "1,1,0,0,0,1,0,0,0\n", "3:1", "has 9 values, the header 10", ""),
    (HEADER + START + "1,1,0,x,0,1,0,0,0,1\n", "3:7", "finite number", 'got "x"'),
    (HEADER + START + "1,-1,0,0,0,1,0,0,0,1\n", "3:1", "det F must be positive", "-1"),
    (HEADER + START + "1,1,0,0,0,1,0,0,0,1\n0.5,1,0,0,0,1,0,0,0,1\n", "4:1", "must not fall", "0.5 after 1"),
    (HEADER + "0,1,0,0,0,1,0,0,0,2\n1,1,0,0,0,1,0,0,0,2\n", "2:1", "first row is the start", "F = I"),
    (HEADER + START, None, "has 1 rows", "at least one step"),
]
# (options, what the message says)
FAULTS = [
    (("--path", "nowhere.csv"), "nowhere.csv: --path: cannot be opened; give a CSV file, or one of uniaxial"),
    (("--path", "."), "is a directory"),
    (("--path", "triaxial"), "needs --confine"),
    (("--path", "uniaxial", "--confine", "1"), "has no meaning for --path uniaxial"),
    (("--path", "simple-shear", "--dim", "1"), "does not exist in 1D"),
    (("--path", "uniaxial", "--strain", "nan"), "--strain: must be from -10 to 10"),
    (("--path", "uniaxial", "--strain", "1e9"), "--strain: must be from -10 to 10"),
    (("--path", "simple-shear", "--strain", "-inf"), "--strain: must be from -1000 to 1000"),
    (("--path", "uniaxial", "--rate", "nan"), "--rate"),
    (("--path", "uniaxial", "--rate", "inf"), "--rate"),
    (("--path", "uniaxial", "--rate", "-1"), "--rate"),
    (("--path", "triaxial", "--confine", "inf"), "--confine: must be at most 1e100 Pa"),
    (("--path", "triaxial", "--confine", "nan"), "--confine"),
    (("--path", "uniaxial", "--set", "yields=1"), 'Did you mean "yield"?'),
    (("--path", "uniaxial", "--set", "cohesion=1"), "cohesion"),
    (("--path", "uniaxial", "--set", "model=j2"), "is not a parameter of the law"),
    (("--path", "uniaxial", "--json", "no/such/place.json"), "no/such/place.json"),
]


class Drive(InTemporaryDirectory):
    def rows(self, *args):
        done = ordo(*J2, *args, cwd=self.dir)
        self.assertEqual(done.returncode, 0, done.stderr)
        return [{k: float(v) for k, v in row.items()} for row in csv.DictReader(io.StringIO(done.stdout))]

    def test_path_from_a_file(self):
        stretch = [1 + 0.01 * k for k in range(5)]
        self.write("path.csv", "# a comment\n" + HEADER + "".join(f"{k},{l},0,0,0,1,0,0,0,1\n" for k, l in enumerate(stretch)))
        done = ordo(*J2, "--path", "path.csv", "--json", "-", cwd=self.dir)
        result = json.loads(done.stdout)
        self.assertEqual(result["law"], "j2")
        self.assertEqual(result["parameters"], {"density": 1000.0, "young": 1000.0, "poisson": 0.3, "yield": 10.0, "hardening": 0.0, "saturation": 10.0, "saturation_rate": 0.0})
        self.assertEqual(len(result["rows"]), 5)
        for time, (l, row) in enumerate(zip(stretch, result["rows"])):
            e = math.log(l)
            alpha = max(0.0, (2 * SHEAR * e - 10) / (3 * SHEAR))
            bulk = LAME + 2 / 3 * SHEAR
            tau = bulk * e + 2 / 3 * min(10, 2 * SHEAR * e)
            self.assertEqual(row["time"], time)
            self.assertEqual(row["F"], [l, 0, 0, 0, 1, 0, 0, 0, 1])
            self.assertAlmostEqual(row["cauchy"][0], tau / l, delta=1e-11)
            self.assertAlmostEqual(row["cauchy"][8], (bulk * e - min(10, 2 * SHEAR * e) / 3) / l, delta=1e-11)
            self.assertAlmostEqual(row["history"]["plastic_strain"], alpha, delta=1e-14)
            self.assertAlmostEqual(row["dissipated"], 10 * alpha, delta=1e-12)
            self.assertEqual(row["dissipated"], row["history"]["dissipated"])

    def test_mixed_control_is_the_named_path(self):
        self.write("path.csv", HEADER.replace("F22", "S22").replace("F33", "S33") + "0,1,0,0,0,0,0,0,0,0\n0.1,1.1051709180756477,0,0,0,0,0,0,0,0\n")
        mixed, named = self.rows("--path", "path.csv")[-1], self.rows("--path", "uniaxial", "--steps", 1)[-1]
        self.assertAlmostEqual(mixed["cauchy_11"] * mixed["F11"] * mixed["F22"] * mixed["F33"], 10, delta=1e-9)
        for name, value in named.items():
            self.assertAlmostEqual(mixed[name], value, delta=1e-9)

    def test_named_paths(self):
        shear = self.rows("--path", "simple-shear", "--dim", 2)
        self.assertEqual(len(shear), 101)
        self.assertAlmostEqual(shear[-1]["cauchy_12"], 10 / math.sqrt(3) / math.cosh(10 / math.sqrt(3) / SHEAR), delta=0.03)
        triaxial = self.rows("--path", "triaxial", "--confine", 50)
        self.assertEqual(len(triaxial), 111)
        self.assertAlmostEqual(triaxial[10]["cauchy_11"], -50, delta=1e-8)
        self.assertAlmostEqual(triaxial[-1]["cauchy_22"], -50, delta=1e-8)
        J = triaxial[-1]["F11"] * triaxial[-1]["F22"] ** 2
        self.assertAlmostEqual((triaxial[-1]["cauchy_22"] - triaxial[-1]["cauchy_11"]) * J, 10, delta=1e-8)
        undrained = self.rows("--path", "undrained", "--confine", 50, "--strain", -0.2)
        volume = [row["F11"] * row["F22"] * row["F33"] for row in undrained]
        self.assertAlmostEqual(volume[-1], volume[10], delta=1e-12)
        self.assertAlmostEqual(undrained[-1]["F11"] / undrained[10]["F11"], math.exp(-0.2), delta=1e-12)
        oedometer = self.rows("--path", "oedometer", "--dim", 1, "--steps", 3)
        self.assertEqual([row["F22"] for row in oedometer], [1] * 4)
        self.assertAlmostEqual(oedometer[-1]["time"], 0.1, delta=1e-15)

    def test_elastic_laws(self):
        for law in ("neo-hookean", "st-venant-kirchhoff", "jaumann-elastic"):
            done = ordo("drive", law, "--set", "young=1000", "--set", "poisson=0.3", "--path", "oedometer", "--strain", "1e-6", "--steps", "1", cwd=self.dir)
            row = list(csv.DictReader(io.StringIO(done.stdout)))[-1]
            self.assertAlmostEqual(float(row["cauchy_11"]) * 1e6, LAME + 2 * SHEAR, delta=0.01)
            self.assertAlmostEqual(float(row["stored"]) * 1e12, (LAME + 2 * SHEAR) / 2, delta=0.1)

    def test_triaxial_of_each_law(self):
        pair = "young=1000 poisson=0.3 "
        angles = pair + "friction_angle=30 dilation_angle=10 cohesion="
        for law, settings in (
            ("mohr-coulomb", angles + "1"),
            ("drucker-prager", angles + "1"),
            ("drucker-prager", angles + "0"),
            ("mu-i", pair + "friction_static=0.38 friction_dynamic=0.64 inertial_number=0.3 grain_diameter=0.001 grain_density=2450"),
            ("j2", pair + "yield=10"),
            ("cam-clay", "shear=60 swelling_index=0.05 compression_index=0.2 critical_slope=1.1 reference_pressure=10 preconsolidation=14"),
            ("fluid", "sound_speed=1.2 viscosity=20"),
            ("ogden", "bulk=833 moduli=200 exponents=2.6"),
            ("neo-hookean", pair),
        ):
            for dim in ("2", "3"):
                with self.subTest(law, settings=settings, dim=dim):
                    sets = [word for setting in settings.split() for word in ("--set", setting)]
                    done = ordo("drive", law, *sets, "--path", "triaxial", "--confine", 10, "--dim", dim, cwd=self.dir)
                    self.assertEqual(done.returncode, 0, done.stderr)
                    end = {k: float(v) for k, v in list(csv.DictReader(io.StringIO(done.stdout)))[-1].items()}
                    self.assertAlmostEqual(end["cauchy_22"], -10, delta=1e-5)
                    if law == "mohr-coulomb" and dim == "3":  # s1 = s3 tan^2(45 + phi/2) + 2 c tan(45 + phi/2), in J sigma
                        J = end["F11"] * end["F22"] * end["F33"]
                        self.assertAlmostEqual(-end["cauchy_11"], 3 * 10 + 2 * math.sqrt(3) / J, delta=1e-5)

    def test_bad_paths(self):
        for text, place, says, remedy in PATH_FAULTS:
            with self.subTest(says):
                self.write("path.csv", text)
                done = ordo(*J2, "--path", "path.csv", cwd=self.dir)
                self.assertEqual(done.returncode, 2, done.stderr)
                self.assertEqual(done.stdout, "")
                for part in (f"path.csv:{place}: " if place else "path.csv: ", says, remedy):
                    self.assertIn(part, done.stderr)
        self.write("path.csv", HEADER + START + "1,1,0,0,0,1,0,0,0.5,1\n")
        done = ordo(*J2, "--path", "path.csv", "--dim", 2, cwd=self.dir)
        self.assertIn("path.csv:3:17: F32: must be 0 in 2D (got 0.5); use --dim 3", done.stderr)

    def test_bad_options(self):
        for options, says in FAULTS:
            with self.subTest(says):
                done = ordo(*J2, *options, cwd=self.dir)
                self.assertEqual(done.returncode, 2, done.stderr)
                self.assertIn(says, done.stderr)
        done = ordo("drive", "j3", "--path", "uniaxial", cwd=self.dir)
        self.assertEqual(done.returncode, 2)
        self.assertIn('Did you mean "j2"?', done.stderr)


if __name__ == "__main__":
    unittest.main()
