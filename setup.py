"""Builds the Python module with CMake, in build/pip."""

import re
import subprocess
import sys
from pathlib import Path

from setuptools import Extension, setup
from setuptools.command.build_ext import build_ext

ROOT = Path(__file__).resolve().parent


class Build(build_ext):
    """The whole package comes from `cmake --install`."""

    def run(self):
        folder, target = ROOT / "build" / "pip", Path(self.build_lib).resolve()
        cmake = ["cmake", "-G", "Ninja", "-S", ROOT, "-B", folder, "-DCMAKE_BUILD_TYPE=Release", "-DORDO_TESTS=OFF", "-DORDO_PYTHON=ON",
                 "-DORDO_PYTHON_DIR=.", f"-DPython3_EXECUTABLE={sys.executable}"]
        for command in (cmake, ["cmake", "--build", folder, "--target", "ordo_python"],
                        ["cmake", "--install", folder, "--component", "python", "--prefix", target]):
            subprocess.run([str(one) for one in command], check=True)


version = re.search(r"VERSION (\S+)", (ROOT / "CMakeLists.txt").read_text(encoding="utf-8").split("project(")[1])[1]
setup(version=version, packages=[], ext_modules=[Extension("ordo._core", [])], cmdclass={"build_ext": Build})
