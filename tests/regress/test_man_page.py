"""The man page has the options of `--help`, all and no others, for each command."""

import os
import pathlib
import re
import subprocess
import unittest

ORDO = os.environ["ORDO"]
PAGE = pathlib.Path(os.environ["ORDO_ROOT"]) / "packaging" / "ordo.1.in"


def of_help(*command):
    """The commands and the options that the help lists."""
    text = subprocess.run([ORDO, *command, "--help"], capture_output=True, text=True, check=True).stdout
    return re.findall(r"^  ([a-z]+) ", text, re.M), sorted(re.findall(r"^  (?:-h,)?(--[a-z-]+)", text, re.M))


def of_page():
    """The options that each section describes: the names in bold in the line after .TP."""
    sections = {}
    for section in re.split(r"^\.SH ", PAGE.read_text(encoding="utf-8"), flags=re.M)[1:]:
        name, _, text = section.partition("\n")
        described = re.findall(r"^\.TP\n(.*)", text, re.M)
        sections[name] = sorted(option for line in described for option in re.findall(r"--[a-z-]+", line.replace("\\-", "-")))
    return sections


class ManPage(unittest.TestCase):
    def test_options_are_those_of_the_help(self):
        sections = of_page()
        commands, options = of_help()
        self.assertEqual(sections["OPTIONS"], options)
        self.assertEqual([name for name in sections if name.startswith("COMMAND ")], [f"COMMAND {name.upper()}" for name in commands])
        for command in commands:
            with self.subTest(command):
                _, options = of_help(command)
                self.assertEqual(sections[f"COMMAND {command.upper()}"], [name for name in options if name != "--help"])

    def test_man_has_no_warnings(self):
        done = subprocess.run(["man", "--warnings", "--local-file", str(PAGE)], capture_output=True, text=True, check=True,
                              env={**os.environ, "MANWIDTH": "100", "LC_ALL": "C.UTF-8"})
        self.assertEqual(done.stderr, "")
        self.assertIn("--restart FILE", done.stdout)


if __name__ == "__main__":
    unittest.main()
