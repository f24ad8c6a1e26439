"""The documentation site builds without a warning, its links and anchors lead somewhere, and it loads nothing from the network.

Without the C++ reference, which scripts/site.sh adds. Needs mkdocs, its Material theme, KaTeX and nbconvert (ordo_site_packages of scripts/packages.sh)."""

import importlib.util
import pathlib
import re
import shutil
import subprocess
import sys
import unittest

import ordo
from support import ROOT, InTemporaryDirectory

MKDOCS = shutil.which("mkdocs")
IS_THERE = MKDOCS and importlib.util.find_spec("nbconvert") and pathlib.Path("/usr/share/mkdocs/themes/material").is_dir() and pathlib.Path("/usr/share/javascript/katex").is_dir()
CHECK = ROOT / "docs" / "site" / "check_links.py"


def build(repository, site):
    return subprocess.run([MKDOCS, "build", "--strict", "-f", repository / "mkdocs.yml", "-d", site], capture_output=True, text=True, check=False)


def check(site):
    return subprocess.run([sys.executable, CHECK, site], capture_output=True, text=True, check=False)


@unittest.skipUnless(IS_THERE, "the site needs mkdocs, mkdocs-material, libjs-katex, fonts-katex and python3-nbconvert")
class Site(InTemporaryDirectory):
    def test_builds(self):
        built = build(ROOT, self.dir / "site")
        self.assertEqual(built.returncode, 0, built.stdout + built.stderr)
        found = check(self.dir / "site")
        self.assertEqual((found.returncode, found.stdout), (0, ""))
        page = self.dir / "site" / "docs" / "energy.html"
        text = page.read_text(encoding="utf-8")
        self.assertIn('class="arithmatex"', (self.dir / "site/docs/tutorials/law-in-python.html").read_text(encoding="utf-8"))

        # The check finds what is wrong, in the page where it is.
        for change, told in (('<a href="../cases/none/index.html">', "../cases/none/index.html: there is no such file"),
                             ('<a href="contact.html#none">', "contact.html#none: the page has no such anchor"),
                             ('<a href="#none">', "#none: the page has no such anchor"),
                             ('<img src="none.png">', "none.png: there is no such file"),
                             ('<script src="https://example.org/a.js"></script>', "loads https://example.org/a.js from the network")):
            page.write_text(text.replace("</body>", change + "</body>"), encoding="utf-8")
            found = check(self.dir / "site")
            self.assertEqual((found.returncode, found.stdout), (1, f"docs/energy.html: {told}\n"))

    def test_refuses(self):
        """A page with a link to nowhere, and one that the navigation lacks, end the build."""
        copy = self.dir / "copy"
        for name in ("docs", "cases", "python"):
            shutil.copytree(ROOT / name, copy / name, ignore=shutil.ignore_patterns("node_modules", "*.msh"))
        for name in ("mkdocs.yml", "README.md", "CONTRIBUTING.md", "CHANGELOG.md", "CITATION.cff", "LICENSE"):
            shutil.copy(ROOT / name, copy / name)
        page = copy / "docs" / "energy.md"
        page.write_text(page.read_text(encoding="utf-8") + "\n[nowhere](nowhere.md)\n", encoding="utf-8")
        (copy / "docs" / "new.md").write_text("# New\n", encoding="utf-8")
        built = build(copy, self.dir / "site")
        told = built.stdout + built.stderr
        self.assertIn("Aborted with 2 warnings in strict mode", told)
        self.assertIn("'docs/energy.md' contains a link to 'docs/nowhere.md' which is not found", told)
        self.assertIn("docs/new.md is not in the navigation", told)


class PythonApi(unittest.TestCase):
    """The page of the Python API has every public name, with a signature and a text."""

    def test_page(self):
        spec = importlib.util.spec_from_file_location("python_api", ROOT / "docs" / "site" / "python_api.py")
        module = importlib.util.module_from_spec(spec)
        spec.loader.exec_module(module)
        page = module.page()
        heads = re.findall(r"^### (\w+)$", page, re.MULTILINE)
        self.assertEqual(sorted(heads), sorted(ordo.__all__))
        for name in ordo.__all__:
            self.assertTrue(re.search(rf"### {name}\n\n```python\n(class )?{name}\b.*\n(?:.*\n)*?```\n\n\S", page), name)
        self.assertTrue("#### Simulation.step\n\n```python\nstep(dt: float | None = None) -> None\n```\n\nOne step" in page)
        self.assertFalse(re.findall(r"\n-{4,}\n|::\n", page))  # of numpydoc and reStructuredText


if __name__ == "__main__":
    unittest.main()
