"""The everyday cases begin with every preset: their accounts close, momentum comes from somewhere, and what ends a run says what to do.

scripts/everyday.py runs them to their ends and measures errors, in the nightly.
"""

import sys
import unittest

from harness import ORDO, ROOT, InTemporaryDirectory, presets

sys.path.insert(0, str(ROOT / "scripts"))
import everyday  # noqa: E402

SCHEMES = ["cpdi1+scheme=usf", "cpdi1+scheme=musl", "cpls+scheme=musl", "cpls+strain_velocity=0.3", "cpls+filter=fmpm", "ugimp+filter=xpic+filter_every=3"]
BY_MASS = ("mpm", "ugimp", "xpic", "fmpm", "cpgimp", "cpdi1", "cpdi2", "cpdi2t", "bscpdi2", "bsmpm", "ddmpm")
RUN_ALL = ("cpdi1", "cpdi2", "cpdi2t", "icpdi1", "icpdi2", "cpls", "cpls-limited", "bscpls", "bscpdi2")
CHANGES_MOMENTUM = ("impm", "tls-", "cpls+filter")


class Everyday(InTemporaryDirectory):
    def begin(self, case, method, share):
        return everyday.Run(ORDO, case, method, self.dir / f"{case}-{method}", [f"time.end={everyday.input_of(case)['time']['end'] * share}"])

    def test_accounts_close(self):
        for case in everyday.CASES:
            for method in [*(p for p in presets() if not p.startswith("spline")), *SCHEMES]:
                with self.subTest(case, method=method):
                    run = self.begin(case, method, 0.02)
                    self.assertIn(run.code, (0,) if method in RUN_ALL else (0, 1, 2), run.message)
                    if run.code > 0:
                        self.assertRegex(run.message.strip().splitlines()[-1], r"\b(use|choose)\b|may help")
                    if run.code < 2:
                        figures = everyday.energies(run)
                        self.assertLess(figures["closure"], 1e-10)
                        if method in BY_MASS:
                            self.assertLess(figures["projection"], 1e-10)
                        turns_faces = case == "pressure" and method.endswith("usf")  # after their force was counted
                        if not method.startswith(CHANGES_MOMENTUM) and not turns_faces:
                            self.assertLess(figures["momentum"], 1e-10)

    def test_errors_are_distances(self):
        coarse, other = (self.begin("shear", method, 1.0) for method in ("ugimp", "cpdi1"))
        self.assertEqual(everyday.errors(coarse, coarse, "shear"), (0.0, 0.0))
        motion, stress = everyday.errors(coarse, other, "shear")
        self.assertTrue(1.0 < motion < 20.0 and 10.0 < stress < 200.0, (motion, stress))


if __name__ == "__main__":
    unittest.main()
