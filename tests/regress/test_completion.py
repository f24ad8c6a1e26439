"""Completion in bash: words of a line are completed with what the program knows."""

import os
import pathlib
import subprocess
import tempfile
import unittest

ORDO = os.environ["ORDO"]
FILE = pathlib.Path(os.environ["ORDO_ROOT"]) / "packaging" / "ordo.bash"
SCRIPT = """
source "$1"; ordo=$2; shift 2
COMP_WORDS=(ordo "$@") COMP_CWORD=$#
_ordo "$ordo"
[ ${#COMPREPLY[@]} -eq 0 ] || printf '%s\\n' "${COMPREPLY[@]}"
"""
COMMANDS = {"run", "check", "list", "verify", "bench", "drive"}


class Completion(unittest.TestCase):
    def setUp(self):
        self.dir = tempfile.TemporaryDirectory()
        self.addCleanup(self.dir.cleanup)
        for name in ("disk.toml", "path.csv", "checkpoint_1.h5", "notes.txt"):
            pathlib.Path(self.dir.name, name).touch()
        pathlib.Path(self.dir.name, "deep").mkdir()

    def complete(self, *words, ordo=ORDO):
        done = subprocess.run(["bash", "-c", SCRIPT, "bash", FILE, ordo, *words], cwd=self.dir.name, capture_output=True, text=True, check=True)
        self.assertEqual(done.stderr, "")
        return set(done.stdout.splitlines())

    def test_commands_and_options(self):
        self.assertEqual(self.complete(""), COMMANDS)
        self.assertEqual(self.complete("ve"), {"verify"})
        self.assertEqual(self.complete("--"), {"--help", "--version"})
        self.assertEqual(self.complete("run", "disk.toml", "--o"), {"--output", "--overwrite"})
        self.assertEqual(self.complete("check", "--"), {"--help", "--set", "--output"})

    def test_names(self):
        self.assertEqual(self.complete("bench", "--method", "cpls"), {"cpls", "cpls-limited"})
        self.assertEqual(self.complete("verify", "ring", "--method", "mpm,spline"), {"mpm,spline3", "mpm,spline4", "mpm,spline5"})
        self.assertEqual(self.complete("verify", "vibration-1"), {"vibration-1d"})
        self.assertEqual(self.complete("bench", "--material", "johnson"), {"johnson-cook"})
        self.assertEqual(self.complete("drive", "mu"), {"mu-i"})
        self.assertEqual(self.complete("list", "m"), {"methods", "materials"})
        self.assertEqual(self.complete("run", "disk.toml", "--set", "grid.s"), {"grid.size=", "grid.spacing="})
        self.assertEqual(self.complete("run", "disk.toml", "--set", "material.0.you"), {"material.0.young="})

    def test_files(self):
        self.assertEqual(self.complete("run", ""), {"disk.toml", "deep"})
        self.assertEqual(self.complete("run", "--quiet", ""), {"disk.toml", "deep"})
        self.assertEqual(self.complete("run", "disk.toml", "--restart", ""), {"latest", "checkpoint_1.h5", "deep"})
        self.assertEqual(self.complete("run", "disk.toml", "--output", ""), {"deep"})
        self.assertEqual(self.complete("drive", "j2", "--path", ""),
                         {"uniaxial", "simple-shear", "triaxial", "oedometer", "undrained", "path.csv", "deep"})

    def test_nothing(self):
        self.assertEqual(self.complete("run", "disk.toml", "--threads", ""), set())
        self.assertEqual(self.complete("nonsense", ""), set())
        self.assertEqual(self.complete("", ordo="/none"), set())


if __name__ == "__main__":
    unittest.main()
