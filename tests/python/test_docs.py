"""The blocks of README and tutorials run, and print what the pages say.

A page's blocks run in their order, in a folder that looks like the repository after scripts/quickstart.sh. What is done with a block, its form says:

- indented lines are commands of a shell; they must succeed, unless the output that the page shows is an error;
- ```python goes on in the page's one interpreter;
- ```toml, ```text and ```cpp are saved under the name that the text before or after them gives in backticks; then a .toml is checked by `ordo check`,
  and a .cpp compiled (-fsyntax-only);
- ```diff is applied to a copy of the sources;
- ``` without a language is output of the block before it: its lines, up to `...` where they have one, must occur there in this order. Times and
  numbers of threads may differ.

NOT_RUN has every line and block that does not run here, and why.
"""

import json
import os
import pathlib
import re
import shutil
import subprocess
import sys
import unittest

import ordo
from support import ORDO, ROOT, InTemporaryDirectory, has, program

PAGES = ["README.md", "python/README.md", "docs/python.md", "docs/report.md", "docs/cpp-api.md", *sorted(p.relative_to(ROOT).as_posix() for p in ROOT.glob("docs/tutorials/*.md"))]
if "libasan" in os.environ.get("LD_PRELOAD", ""):  # which all programs that a page calls would get, compilers and MPI too
    PAGES = ["docs/python.md"]
TUTORIALS = "docs/tutorials/"
GATE = "scripts/test.sh does it"
SYNTAX = "g++ -std=c++20 -fsyntax-only -Isrc"
MACHINE = "installs packages, as scripts/packages.sh does"

# (page, the start of a line or a block, why it does not run here, what runs in its place)
NOT_RUN = [
    ("README.md", r"\./scripts/quickstart\.sh", GATE, "build/release/ordo run cases/two-disks/case.toml"),
    ("README.md", r"\./scripts/test\.sh", "it runs this test", ""),
    ("README.md", r"ordo (run|check|list|verify|bench|drive) ", "forms of commands, see test_forms_of_commands", ""),
    ("README.md", r"python/ordo_figures\.py movie", "needs ffmpeg; regress.figures makes a GIF", ""),
    ("README.md", "```cmake", "package.find_package does it", ""),
    ("python/README.md", "apt-get", MACHINE, ""),
    ("python/README.md", r"python/ordo_figures\.py movie", "needs ffmpeg; regress.figures makes a GIF", ""),
    ("python/README.md", r"PYTHONPATH=\$PWD/build/release/python jupyter", "is a server; python.notebooks runs the notebooks", ""),
    ("docs/cpp-api.md", "```cmake", "package.find_package does it", ""),
    ("docs/python.md", "apt-get", MACHINE, ""),
    ("docs/python.md", "python3 -m venv", "compiles for minutes", ""),
    (TUTORIALS + "first-case.md", r"\./scripts/quickstart\.sh", GATE, ""),
    (TUTORIALS + "first-case.md", "apt-get", MACHINE, ""),
    (TUTORIALS + "gmsh-to-paraview.md", "apt-get", MACHINE, ""),
    (TUTORIALS + "restart-threads-ranks.md", "apt-get", MACHINE, ""),
    (TUTORIALS + "restart-threads-ranks.md", "cmake", GATE, ""),
    (TUTORIALS + "law-in-cpp.md", "cmake --build --preset release", "compiles for a minute", f"{SYNTAX} src/material/laws.cpp"),
    (TUTORIALS + "law-in-cpp.md", "```toml", "is a case for the program of the line before", ""),
    (TUTORIALS + "law-in-cpp.md", "build/release/ordo ", "needs the program of the line before; regress.own_law runs one with another law", ""),
    (TUTORIALS + "law-in-cpp.md", "cmake --preset checked", "compiles for minutes", ""),
    (TUTORIALS + "law-in-cpp.md", "ctest", "needs the tests of the line before, whose program the gate runs with all laws of the list", ""),
]
if not (pathlib.Path(ORDO).parent / "libordo_ranks.so").exists() or not shutil.which("mpiexec"):
    NOT_RUN += [(TUTORIALS + "restart-threads-ranks.md", line, "needs ranks and mpiexec", "")
                for line in ("mpiexec", "diff -r results/two results/ranks")]
# What pages need: programs, and libraries that ordo may have been built without.
NEEDS = {TUTORIALS + "gmsh-to-paraview.md": ("gmsh", "Gmsh"), "docs/python.md": ("HDF5",), TUTORIALS + "restart-threads-ranks.md": ("HDF5",)}


def lacks(page):
    return [one for one in NEEDS.get(page, ()) if not (shutil.which(one) if one.islower() else has(one))]


# Runs steps in one interpreter; tells how each ended and what it printed.
DRIVER = r"""
import contextlib as _contextlib, io as _io, json as _json, subprocess as _subprocess, traceback as _traceback

_told = []
for _kind, _code in _json.load(open("steps.json")):
    if _kind == "shell":
        _done = _subprocess.run(["bash", "-c", _code], stdin=_subprocess.DEVNULL, stdout=_subprocess.PIPE, stderr=_subprocess.STDOUT, text=True)
        _told.append((_done.returncode, _done.stdout))
        continue
    _text, _code_of_exit = _io.StringIO(), 0
    with _contextlib.redirect_stdout(_text):
        try:
            exec(compile(_code, "the block", "exec"))
        except Exception:
            _code_of_exit = 1
            _traceback.print_exc(file=_text)
    _told.append((_code_of_exit, _text.getvalue()))
_json.dump(_told, open("told.json", "w"))
"""


def blocks_of(text):
    """(language, content, text before it, text after it) of each block. The language of indented lines is shell, that of output is empty."""
    found, prose, lines = [], [""], text.split("\n")
    k = 0
    while k < len(lines):
        begin = k
        if lines[k].startswith("```"):
            k = next(i for i in range(k + 1, len(lines)) if lines[i] == "```") + 1
            found.append((lines[begin][3:], lines[begin + 1:k - 1]))
            prose.append("")
        elif lines[k].startswith("    ") and not lines[k - 1]:
            while k < len(lines) and (lines[k].startswith("    ") or not lines[k] and k + 1 < len(lines) and lines[k + 1].startswith("    ")):
                k += 1
            found.append(("shell", [line[4:] for line in lines[begin:k] if line]))
            prose.append("")
        else:
            prose[-1] += lines[k] + "\n"
            k += 1
    return [(language, content, prose[i], prose[i + 1]) for i, (language, content) in enumerate(found)]


def name_in(before, after, suffixes):
    """The file name in backticks that is nearest to a block, from the text before it if that has one."""
    names = [re.findall(rf"`([\w/-]+\.(?:{suffixes}))`", text) for text in (before, after)]
    return names[0][-1] if names[0] else names[1][0]


def plain(text):
    """Lines without what differs from machine to machine, and with single spaces."""
    text = re.sub(r"^(\s*\d+\s+\d+\s+\d+\s+)\d+\.\d\d(?=\s|$)", r"\1TIME", text, flags=re.MULTILINE)  # a row of `ordo verify`
    text = re.sub(r"\bin \d+\.\d\d s$", "in TIME", re.sub(r"\bon \d+ threads?\b", "on THREADS", text), flags=re.MULTILINE)
    return [" ".join(line.split()) for line in text.split("\n") if line.strip()]


def missing_in(shown, told):
    """The first line that a page shows and that is not in the output, or not in this order; None if all are there."""
    rest = iter(plain(told))
    for line in plain("\n".join(shown)):
        begin = line.removesuffix("...").rstrip()
        if not any(one.startswith(begin) if line.endswith("...") else one == line for one in rest):
            return line
    return None


class Docs(InTemporaryDirectory):
    def folder(self, page, is_changed):
        """The repository as a user has it; with its sources copied where the page changes them."""
        folder = self.dir / page.replace("/", "-")
        (folder / "build" / "release").mkdir(parents=True)
        (folder / "bin").mkdir()
        os.symlink(sys.executable, folder / "bin" / "python3")
        os.symlink(ORDO, folder / "build" / "release" / "ordo")
        os.symlink(pathlib.Path(ordo.__file__).parents[1], folder / "build" / "release" / "python")
        for name in ("cases", "docs", "python", "scripts", "src", "tests"):
            if is_changed and name in ("src", "tests"):
                shutil.copytree(ROOT / name, folder / name)
            else:
                os.symlink(ROOT / name, folder / name)
        return folder

    def commands_of(self, page, lines, used):
        """What a shell runs of lines, or of the first line of another block."""
        commands, rule = [], None
        for line in lines:
            if line.startswith(" "):  # goes on with the line above
                commands += [] if rule else [line]
                continue
            rule = next((rule for rule in NOT_RUN if rule[0] == page and re.match(rule[1], line)), None)
            if rule:
                used.add(rule)
            commands += [rule[3] if rule else line] if not rule or rule[3] else []
        return commands

    def steps_of(self, page, folder, blocks, used):
        """(kind, code) of what is to be done for each block, None where nothing is. Saves files."""
        for k, (language, content, before, after) in enumerate(blocks):
            text = "\n".join(content) + "\n"
            if language in ("toml", "text", "cpp"):
                name = name_in(before, after, {"toml": "toml", "text": "geo|csv|txt", "cpp": "cpp|hpp"}[language])
                (folder / name).write_text(text, encoding="utf-8")
                check = {".toml": f"build/release/ordo check {name}", ".cpp": f"{SYNTAX} {name}"}.get(pathlib.Path(name).suffix)
                yield ("shell", check) if check and self.commands_of(page, [f"```{language}"], used) else None
            elif language == "diff":
                (folder / f"{k}.diff").write_text(text, encoding="utf-8")
                yield "shell", f"git apply {k}.diff"
            elif language == "python":
                yield "python", text
            elif language == "shell":
                commands = self.commands_of(page, content, used)
                yield ("shell", "set -e\n" + "\n".join(commands)) if commands else None
            elif language:
                self.assertEqual(self.commands_of(page, [f"```{language}"], used), [], f"{page}: a block of {language} is neither run nor in NOT_RUN")
                yield None

    def run_page(self, page, used):
        blocks = blocks_of((ROOT / page).read_text(encoding="utf-8"))
        self.assertTrue(blocks, page)
        folder = self.folder(page, any(language == "diff" for language, *_ in blocks))
        steps, shown = [], {}
        step_of = list(self.steps_of(page, folder, [block for block in blocks if block[0]], used))
        k = -1
        for language, content, *_ in blocks:
            if language:
                k += 1
                steps += [step_of[k]] if step_of[k] else []
            elif step_of[k]:
                shown.setdefault(len(steps) - 1, []).append(content)
        (folder / "steps.json").write_text(json.dumps(steps), encoding="utf-8")
        (folder / "driver.py").write_text(DRIVER, encoding="utf-8")
        free = {"OMPI_ALLOW_RUN_AS_ROOT": "1", "OMPI_ALLOW_RUN_AS_ROOT_CONFIRM": "1", "OMPI_MCA_rmaps_base_oversubscribe": "1"}
        ran = subprocess.run([sys.executable, "driver.py"], cwd=folder, env={**os.environ, **free, "PATH": f"{folder / 'bin'}:{os.environ['PATH']}"}, capture_output=True, text=True, timeout=600,
                             check=False)
        self.assertEqual(ran.returncode, 0, f"{page}: {ran.stdout}{ran.stderr}")
        for k, (code, told) in enumerate(json.loads((folder / "told.json").read_text(encoding="utf-8"))):
            is_error = any("error:" in line for content in shown.get(k, []) for line in content)
            self.assertEqual(code != 0, is_error, f"{page}:\n{steps[k][1]}\nends with {code}:\n{told}")
            self.assertNotRegex(told, r"\bnan\b", f"{page}:\n{steps[k][1]}")
            for content in shown.get(k, []):
                line = missing_in(content, told)
                self.assertIsNone(line, f"{page}: the page shows\n{line}\nbut\n{steps[k][1]}\nprints\n{told}")

    def test_blocks_run(self):
        used = set()
        for page in PAGES:
            with self.subTest(page):
                if missing := lacks(page):
                    used |= {rule for rule in NOT_RUN if rule[0] == page}
                    self.skipTest(f"needs {', '.join(missing)}")
                self.run_page(page, used)
        self.assertEqual([rule[:2] for rule in NOT_RUN if rule not in used and rule[0] in PAGES], [], "NOT_RUN has what no page has")

    def test_forms_of_commands(self):
        """The commands of README are those of the program, with their options."""
        text = (ROOT / "README.md").read_text(encoding="utf-8")
        forms = re.findall(r"^    ordo (\w+) (.*(?:\n     .*)*)", text, re.MULTILINE)
        commands = re.findall(r"^  (\w+) +\w", program("--help", cwd=self.dir).stdout.split("Subcommands:")[1], re.MULTILINE)
        self.assertEqual(sorted(name for name, _ in forms), sorted(commands))
        for name, form in forms:
            told = program(name, "--help", cwd=self.dir).stdout
            for option in re.findall(r"--[\w-]+", form):
                self.assertIn(option, told, name)


class TheTestItself(unittest.TestCase):
    """What the other test promises."""

    def test_blocks(self):
        text = "a `x.toml`\n\n```toml\nb = 1\n```\n\nc\n\n    d\n    e\n\n    f\n\n```\ng\n```\n"
        self.assertEqual([block[:2] for block in blocks_of(text)], [("toml", ["b = 1"]), ("shell", ["d", "e", "f"]), ("", ["g"])])
        self.assertEqual(name_in("`old.toml` and `new.toml`", "`later.toml`", "toml"), "new.toml")
        self.assertEqual(name_in("nothing", "`later.toml`, `last.toml`", "toml"), "later.toml")

    def test_output(self):
        told = "run on 2 threads\n400 steps in 0.12 s\n    10         64       50     0.00     4.4140e-03\nend"
        self.assertIsNone(missing_in(["run on 16 threads", "400 steps in 9.99 s", "  10  64  50  0.07  4.41..."], told))
        self.assertEqual(missing_in(["run on 2 threads", "401 steps in 0.12 s"], told), "401 steps in TIME")
        self.assertEqual(missing_in(["end", "run on 2 threads"], told), "run on THREADS")
        self.assertEqual(missing_in(["10 64 50 0.00 4.4141e-03"], told), "10 64 50 TIME 4.4141e-03")


if __name__ == "__main__":
    unittest.main()
