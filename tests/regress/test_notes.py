"""What a user may not expect of a case is said before the first step, and by ordo check."""

import unittest

from harness import CASE, HANG, InTemporaryDirectory, edit, ordo, start

BOX = 'shape = "box"\nlower = [{}, 0.25]\nupper = [{}, {}]\n'
BALL = 'shape = "ball"\ncenter = 0.5\nradius = 0.25\n'


def boxes(gap):
    """Two boxes beside each other, on cells of 0.125 m."""
    one, other = BOX.format(0.25, 0.5, 0.75), BOX.format(0.5 + gap, 0.75 + gap, 0.75)
    return edit(CASE, ("spacing = 0.25", "spacing = 0.125"), (BALL, one), f'[[body]]\nmaterial = "rubber"\n{other}')


class Notes(InTemporaryDirectory):
    def notes(self, case):
        """Of check and run, which must be the same."""
        path = self.write("case.toml", case)
        checked = [line[len("# note: "):] for line in ordo("check", path, cwd=self.dir).stdout.splitlines() if line.startswith("# note: ")]
        run = ordo("run", path, "--overwrite", cwd=self.dir)
        self.assertEqual(run.returncode, 0, run.stderr)
        said = [line[len("ordo: note: "):] for line in run.stderr.splitlines() if line.startswith("ordo: note: ")]
        self.assertEqual(said, checked)
        return said

    def test_bodies_closer_than_a_cell(self):
        for gap, sticks in ((0.0, True), (0.1, True), (0.25, False)):
            with self.subTest(gap):
                notes = self.notes(boxes(gap))
                self.assertEqual(len(notes), 1 if sticks else 0)
                if sticks:
                    self.assertIn('bodies "body 0" and "body 1" are closer than a cell: they stick together', notes[0])

    def test_materials_that_lock(self):
        j2 = ("poisson = 0.3\n", "poisson = 0.3\nmodel = 'j2'\nyield = 100.0\n")
        averaged = "[method]\naveraging = 'cell'\n"
        for changes, reason in (((), None), ((j2,), "j2, which flows at constant volume"), ((j2, averaged), None),
                                ((("poisson = 0.3", "poisson = 0.46"),), "Poisson's ratio 0.46"), ((("poisson = 0.3", "poisson = 0.45"),), None)):
            with self.subTest(changes):
                notes = self.notes(edit(CASE, *changes))
                self.assertEqual(len(notes), 1 if reason else 0)
                if reason:
                    self.assertIn(reason, notes[0])
                    self.assertIn('averaging = "cell"', notes[0])

    def test_conditions_that_hold_nothing(self):
        boundary = "[[boundary]]\nface = 'x-max'\ntype = '{}'\nat = {}\n"
        for type_, at, is_idle in (("fixed", 0.75, False), ("fixed", 0.99, False), ("symmetry", 1.0, False), ("wall", 1.0, False)):
            with self.subTest(type=type_, at=at):
                self.assertEqual(bool(self.notes(edit(CASE, boundary.format(type_, at)))), is_idle)
        small = edit(CASE, ("radius = 0.25", "radius = 0.2"), ("spacing = 0.25", "spacing = 0.125"), boundary.format("fixed", 1.0))
        self.assertIn("x = 1 (fixed) holds no body at the start: the nearest is 0.312 m away", self.notes(small)[0])

    def test_runs_of_hours(self):
        """The time is predicted before the first step."""
        self.write("case.toml", edit(CASE, ("end = 0.01", "end = 1e6")))
        for preset, says in (("cpdi1", "ugimp and mpm are faster"), ("bsmpm", 'method.mass = "lumped"'), ("cpls", "cpdi1 takes no fits")):
            with self.subTest(preset):
                process = start("run", "case.toml", "--overwrite", "--set", f"method.preset={preset}", cwd=self.dir)
                line = process.stderr.readline()
                process.kill()
                process.communicate(timeout=HANG)
                self.assertRegex(line, r"^ordo: note: this run may take about \S+ hours for 1e\+09 steps; ")
                self.assertIn(says, line)

    def test_thin_boxes(self):
        thin = edit(CASE, (BALL, BOX.format(0.25, 0.75, 0.35)))
        self.assertIn('body "body 0" is one particle thick along y', self.notes(thin)[0])
        self.assertEqual(self.notes(edit(CASE, (BALL, BOX.format(0.25, 0.75, 0.5)))), [])


if __name__ == "__main__":
    unittest.main()
