"""The page for readers of the papers: its presets, cases and figures are there, its commands are those of the figures and run."""

import json
import re
import subprocess
import sys
import unittest

import ordo
from support import ORDO, ROOT, InTemporaryDirectory
from test_docs import blocks_of

PAGE = (ROOT / "docs" / "papers.md").read_text(encoding="utf-8")
FIGURES = json.loads((ROOT / "docs" / "gallery" / "gallery.json").read_text(encoding="utf-8"))
PAPERS = ("Tran", "Gong", "Wobbes", "Sadeghirad")
COMMANDS = [line for language, lines, *_ in blocks_of(PAGE) if language == "shell" for line in lines if not line.startswith("#")]


def rows_below(head):
    """The cells of the tables that begin with a head, without head and line."""
    tables = re.findall(rf"^\| {head} .*\n\|[-|]+\n((?:\|.*\n)+)", PAGE, re.MULTILINE)
    return [[cell.strip() for cell in row.strip("|").split("|")] for table in tables for row in table.strip().split("\n")]


def words_in(text):
    return re.findall(r"`([^`]+)`", text)


class Papers(InTemporaryDirectory):
    def test_presets(self):
        presets = {one["name"] for one in ordo.methods()}
        named = {word for _, preset, _ in rows_below("in the (?:paper|thesis)") for word in words_in(preset)}
        self.assertGreater(len(named), 15)
        self.assertEqual(named - presets, set())
        in_commands = {word for command in COMMANDS for match in re.findall(r"--method (\S+)", command) for word in match.split(",")}
        self.assertEqual(in_commands - named, set(), "presets of commands that no table has")

    def test_figures(self):
        """Each figure of the gallery has its place and its case in the tables."""
        names = {figure["name"]: figure for figure in FIGURES if figure["paper"] in PAPERS}
        cases = {one["name"] for one in ordo.cases(ROOT / "cases")}
        drawn = {}
        for _, _, case, name in rows_below("figures"):
            self.assertLessEqual(set(words_in(case)), cases)
            drawn |= {word: words_in(case) for word in words_in(name) if not word.startswith("ordo ")}
        self.assertEqual(drawn.keys(), names.keys())
        for name, figure in names.items():
            for run in figure["runs"]:
                if run.startswith("ordo verify"):
                    self.assertIn(run.split()[2], drawn[name], name)
        gallery = [sys.executable, ROOT / "python" / "ordo_gallery.py", "gallery", "--list"]
        listed = subprocess.run(gallery, capture_output=True, text=True, check=True).stdout
        self.assertLessEqual(names.keys(), {line.split()[0] for line in listed.splitlines()})

    def test_commands_are_those_of_the_figures(self):
        runs = {run.replace(" --threads 1", "").replace(" --quiet", "") for figure in FIGURES if figure["paper"] in PAPERS for run in figure["runs"]}
        shown = [command.removeprefix("build/release/") for command in COMMANDS if command.startswith("build/release/ordo")]
        self.assertEqual(set(shown), runs)

    def test_commands_are_taken(self):
        """Each command, on its coarsest mesh and for no longer than a step."""
        for command in COMMANDS:
            words = command.split()[1:]
            with self.subTest(command):
                if words[0] == "verify":
                    words = [word for word in words if not word.startswith("end=")]
                    words = [word for k, word in enumerate(words) if word != "--set" or k + 1 < len(words) and "=" in words[k + 1]]
                    words = [word.split(",")[0] if words[k - 1] == "--cells" else word for k, word in enumerate(words)] + ["--set", "end=1e-9"]
                elif words[0] == "run":
                    words = ["check", str(ROOT / words[1]), *words[2:]]
                else:
                    self.assertTrue(command.startswith("python/ordo_gallery.py gallery "))
                    continue
                done = subprocess.run([ORDO, *words], capture_output=True, text=True, cwd=self.dir, timeout=600, check=False)
                self.assertEqual(done.returncode, 0, f"{words}\n{done.stdout}{done.stderr}")


if __name__ == "__main__":
    unittest.main()
