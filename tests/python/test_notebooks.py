"""The notebooks of python/notebooks: they run afresh, what they assert holds, and what they show is what is committed."""

import base64
import io
import re
import sys
import unittest

from support import ROOT, InTemporaryDirectory

FOLDER = ROOT / "python" / "notebooks"
sys.path.insert(0, str(FOLDER))

try:
    import ipykernel  # noqa: F401
    import matplotlib.image
    import nbconvert  # noqa: F401
    import nbformat
    from execute import execute
    from nbclient.exceptions import CellExecutionError
except ImportError as e:
    missing = f"notebooks are not tested: {e}; apt-get install python3-nbconvert python3-ipykernel python3-matplotlib"
    print(missing, file=sys.stderr)
    raise unittest.SkipTest(missing) from None

NUMBER = re.compile(r"(?<![\w.])(-?\d+(?:\.(\d+))?(?:e([-+]?\d+))?)(?![\w.]*\w)")


def texts(notebook):
    """What the cells of a notebook print."""
    return "\n".join(out["text"] for cell in notebook.cells for out in cell.get("outputs", []) if out.output_type == "stream")


def figures(notebook):
    sources = [out["data"]["image/png"] for cell in notebook.cells for out in cell.get("outputs", []) if "image/png" in out.get("data", {})]
    return [matplotlib.image.imread(io.BytesIO(base64.b64decode(source))) for source in sources]


def differences(found, committed):
    """How two texts differ, other than by spaces and by 2 % or the last two digits of numbers."""
    words = [" ".join(NUMBER.sub("#", text).split()) for text in (found, committed)]
    if words[0] != words[1]:
        return [f"{words[0]!r} instead of {words[1]!r}"]
    pairs = zip(NUMBER.finditer(found), NUMBER.finditer(committed))
    return [f"{a[1]} instead of {b[1]}" for a, b in pairs
            if abs(float(a[1]) - float(b[1])) > max(0.02 * abs(float(b[1])), 2 * 10.0 ** (int(b[3] or 0) - len(b[2] or "")))]


class Notebooks(InTemporaryDirectory):
    def check(self, name):
        file = FOLDER / f"{name}.ipynb"
        self.assertLess(file.stat().st_size, 300_000)
        committed = nbformat.read(file, as_version=4)
        found = execute(file)
        for notebook in (committed, found):
            code = [cell for cell in notebook.cells if cell.cell_type == "code"]
            self.assertEqual([cell.execution_count for cell in code], list(range(1, len(code) + 1)), "not executed in one go")
            kinds = {(out.output_type, out.get("name")) for cell in code for out in cell.outputs}
            self.assertLessEqual(kinds, {("stream", "stdout"), ("display_data", None)}, "warnings, or values by the way")
            self.assertIsNone(re.search(r"(?<!\w)/\w+/", texts(notebook)), "a path of a machine")
        self.assertEqual(differences(texts(found), texts(committed)), [], "run python/notebooks/execute.py if this is right")
        self.assertGreater(len(figures(found)), 1)
        self.assertEqual(len(figures(found)), len(figures(committed)))
        for image in figures(found):
            self.assertGreater(image.std(), 0.05, "an empty figure")
        self.assertEqual(found.metadata, committed.metadata)

    def test_material_law(self):
        self.check("material_law")

    def test_convergence(self):
        self.check("convergence")

    def test_parameter_sweep(self):
        self.check("parameter_sweep")

    def test_all_are_tested(self):
        for file in FOLDER.glob("*.ipynb"):
            self.assertTrue(hasattr(self, f"test_{file.stem}"), file)


class Harness(InTemporaryDirectory):
    def test_a_failing_cell_is_an_error(self):
        cells = [nbformat.v4.new_code_cell(source) for source in ("import ordo", "assert ordo.cases() == []")]
        nbformat.write(nbformat.v4.new_notebook(cells=cells), self.dir / "wrong.ipynb")
        with self.assertRaisesRegex(CellExecutionError, "AssertionError"):
            execute(self.dir / "wrong.ipynb")

    def test_differences(self):
        text = "run-out 0.95 of 3 cells, -1.2e-08 J, 2.4%, floor"
        self.assertEqual(differences(text.replace("0.95", "0.96").replace("-1.2e-08", " -1.3e-08"), text), [])
        for old, new in (("0.95", "0.99"), ("3", "8"), ("-1.2", "1.2"), ("e-08", "e-07"), ("2.4", "2.7"), ("floor", "0.1"), ("cells", "grids")):
            self.assertEqual(len(differences(text.replace(old, new, 1), text)), 1, (old, new))


if __name__ == "__main__":
    unittest.main()
