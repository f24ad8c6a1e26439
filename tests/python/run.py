"""Runs one file of tests. ORDO_PRELOAD: libraries that must come before all others, as the address sanitizer of an instrumented module."""

import os
import sys
import unittest

preload = os.environ.pop("ORDO_PRELOAD", None)
if preload:
    options = "detect_leaks=0:" + os.environ.get("ASAN_OPTIONS", "")
    os.execve(sys.executable, [sys.executable, *sys.argv], {**os.environ, "LD_PRELOAD": preload, "ASAN_OPTIONS": options})

suite = unittest.defaultTestLoader.discover(os.path.dirname(__file__), sys.argv[1])
sys.exit(not unittest.TextTestRunner().run(suite).wasSuccessful())
