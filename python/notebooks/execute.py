#!/usr/bin/python3
"""Executes notebooks afresh, each in an empty directory of its own, and writes them with their outputs.

    PYTHONPATH=build/release/python /usr/bin/python3 python/notebooks/execute.py              all, in place
    PYTHONPATH=build/release/python /usr/bin/python3 python/notebooks/execute.py -o DIR NAME.ipynb

Needs python3-nbconvert and python3-ipykernel. What differs from run to run without meaning (versions, times) is left out.
"""

import argparse
import os
import pathlib
import tempfile

HERE = pathlib.Path(__file__).resolve().parent


def execute(notebook):
    """A copy of a notebook with fresh outputs. Raises nbclient's CellExecutionError where a cell fails."""
    import nbformat
    from nbconvert.preprocessors import ExecutePreprocessor

    with tempfile.TemporaryDirectory() as folder:
        path = [os.path.abspath(one) for one in os.environ.get("PYTHONPATH", "").split(os.pathsep) if one]  # the kernel works elsewhere
        os.environ.update(PYTHONPATH=os.pathsep.join(path), PYTHONDONTWRITEBYTECODE="1", PYDEVD_DISABLE_FILE_VALIDATION="1",
                          IPYTHONDIR=folder, JUPYTER_RUNTIME_DIR=folder, MPLBACKEND="module://matplotlib_inline.backend_inline")
        nb = nbformat.read(notebook, as_version=4)
        run = ExecutePreprocessor(timeout=1200, kernel_name="python3", record_timing=False)
        nb, _ = run.preprocess(nb, {"metadata": {"path": folder}})
    nb.metadata = {"kernelspec": {"display_name": "Python 3", "language": "python", "name": "python3"}, "language_info": {"name": "python"}}
    return nb


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("notebook", nargs="*", type=pathlib.Path, default=sorted(HERE.glob("*.ipynb")))
    parser.add_argument("-o", "--output", type=pathlib.Path, help="a directory; by default in place")
    options = parser.parse_args()
    import nbformat

    for notebook in options.notebook:
        nbformat.write(execute(notebook), options.output / notebook.name if options.output else notebook)
        print(notebook.name)


if __name__ == "__main__":
    main()
