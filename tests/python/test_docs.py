"""The Python code of the documentation runs, block after block."""

import os
import re
import unittest

from support import ROOT, InTemporaryDirectory, python

PAGES = ("docs/python.md",)


class Docs(InTemporaryDirectory):
    def test_code_runs(self):
        for page in PAGES:
            blocks = re.findall(r"^```python\n(.*?)^```", (ROOT / page).read_text(encoding="utf-8"), re.MULTILINE | re.DOTALL)
            self.assertGreater(len(blocks), 5, page)
            os.symlink(ROOT / "cases", self.dir / "cases")
            done = python("\n".join(blocks), self.dir)
            self.assertEqual(done.returncode, 0, f"{page}: {done.stdout}{done.stderr}")
            self.assertNotIn("nan", done.stdout)


if __name__ == "__main__":
    unittest.main()
