"""A simulation in Python is that of the program, bit for bit; what numpy sees and changes; callbacks; saved states."""

import ast
import filecmp
import gc
import inspect
import json
import os
import pathlib
import unittest
import weakref

import numpy as np
import ordo
from support import BLOCK, ROOT, TWO_DISKS, InTemporaryDirectory, block, needs_hdf5, program, python


def by_id(sim, name):
    return getattr(sim.particles, name)[np.argsort(sim.particles.id)]


def state_of(sim):
    p = sim.particles
    return {name: getattr(p, name).copy() for name in ("x", "v", "F", "stress", "V", "id")}


class Bits(InTemporaryDirectory):
    def assert_same_state(self, a, b):
        for name, value in state_of(a).items():
            self.assertTrue(np.array_equal(value, state_of(b)[name]), name)

    @needs_hdf5
    def test_files_and_history_are_those_of_the_program(self):
        for preset in ("mpm", "cpdi1", "cpls", "cpdi2", "apic"):
            case = ordo.Case(TWO_DISKS, {"method.preset": preset, "time.end": 0.3, "output.grid": True, "checkpoint.steps": 20})
            theirs, ours = self.dir / f"program-{preset}", self.dir / f"python-{preset}"
            program("run", TWO_DISKS, "--quiet", "--output", theirs, "--set", f"method.preset={preset}", "--set", "time.end=0.3", "--set",
                    "output.grid=true", "--set", "checkpoint.steps=20", cwd=self.dir)
            sim = ordo.Simulation(case, threads=2)
            sim.run(output=ours)
            names = sorted(p.name for p in theirs.iterdir())
            self.assertEqual(names, sorted(p.name for p in ours.iterdir()))
            self.assertGreater(len(names), 10)
            self.assertEqual(filecmp.cmpfiles(theirs, ours, names, shallow=False), (names, [], []))
            written, kept = ordo.history(theirs), sim.history
            self.assertEqual(list(written), list(kept))
            for name, column in written.items():
                rows = np.isin(written["time"], kept["time"])  # the program adds rows at frames
                self.assertTrue(np.array_equal(column[rows], kept[name]), name)

    def test_steps_threads_and_idle_callbacks_change_nothing(self):
        case = ordo.Case.from_dict(block())
        whole, steps, watched = ordo.Simulation(case, threads=1), ordo.Simulation(case, threads=2), ordo.Simulation(case, threads=2)
        whole.run()
        while not steps.is_complete:
            steps.step()

        watched.on_step(lambda sim: sim.particles.x.sum() + sim.particles.stress.sum() + sim.grid.mass.sum() > -1)
        watched.on_nodes(lambda nodes: nodes.momentum.sum())
        watched.run()
        self.assertEqual((whole.n, steps.n, watched.n), (40, 40, 40))
        self.assert_same_state(whole, steps)
        self.assert_same_state(whole, watched)

    @needs_hdf5
    def test_saved_states_go_on(self):
        case = ordo.Case.from_dict(block(checkpoint={"steps": 20}))
        whole = ordo.Simulation(case)
        whole.run(until=0.01, output=self.dir / "parts")
        whole.save(self.dir / "state.h5")
        whole.run()
        for restored in (ordo.Simulation.restore(self.dir / "state.h5"), ordo.Simulation.restore(str(self.dir / "state.h5"), case, threads=1),
                         ordo.Simulation.restore(next((self.dir / "parts").glob("checkpoint_*.h5")))):
            self.assertEqual(restored.n, 20)
            restored.run()
            self.assert_same_state(whole, restored)
        (self.dir / "case.toml").write_text(str(case), encoding="utf-8")
        program("run", "case.toml", "--restart", "state.h5", "--output", "rest", "--quiet", cwd=self.dir)
        self.assertEqual(ordo.history(self.dir / "rest")["kinetic_energy"][-1], whole.history["kinetic_energy"][-1])

    def test_goes_past_the_end(self):
        sim = ordo.Simulation(ordo.Case.from_dict(block()))
        sim.run()
        sim.step()
        self.assertAlmostEqual(sim.t, 0.0205, 12)
        sim.step(dt=1e-4)
        self.assertEqual(sim.dt, 1e-4)
        sim.run(until=0.03)
        self.assertEqual(sim.t, 0.03)
        self.assertTrue(np.all(np.diff(sim.history["time"]) > 0))
        sim.run()  # its time is over
        self.assertEqual(sim.t, 0.03)


class Views(unittest.TestCase):
    def setUp(self):
        self.sim = ordo.Simulation(ordo.Case.from_dict(block(body=[*BLOCK["body"], {"material": "rubber", "shape": "ball", "center": [0.14, 0.14],
                                                                                  "radius": 0.1}])))

    def test_shapes_and_meaning(self):
        p, n = self.sim.particles, len(self.sim.particles)
        self.assertEqual([getattr(p, k).shape for k in ("x", "X", "v", "F", "stress")], [(n, 2)] * 3 + [(n, 2, 2)] * 2)
        self.assertEqual([getattr(p, k).shape for k in ("V", "mass", "body", "material", "id")], [(n,)] * 5)
        self.sim.step()
        self.assertTrue(np.allclose(np.linalg.det(p.F) * self.sim.field("mass") / 1000, p.V, rtol=1e-12))
        self.assertTrue(np.array_equal(np.sort(p.id), np.arange(n)))
        self.assertEqual(set(p.body.tolist()), {0, 1})
        full = self.sim.field("stress")
        self.assertEqual(full.shape, (n, 3, 3))
        self.assertTrue(np.array_equal(full[:, :2, :2], p.stress))
        self.assertTrue(np.array_equal(self.sim.field("displacement")[:, :2], p.x - p.X))
        grid = self.sim.grid
        self.assertAlmostEqual(grid.mass.sum(), p.mass.sum(), 9)
        self.assertTrue(np.allclose((grid.mass[:, None] * grid.place).sum(axis=0), (p.mass[:, None] * p.X).sum(axis=0)))

    def test_are_the_memory_of_the_simulation(self):
        p = self.sim.particles
        for name in ("x", "X", "v", "F", "V", "mass", "body", "id"):
            self.assertTrue(np.shares_memory(np.asarray(getattr(p, name)), np.asarray(getattr(p, name))), name)
            self.assertFalse(getattr(p, name).flags.owndata, name)

    def test_go_stale(self):
        uses = [lambda a: a[0], lambda a: a[...], lambda a: a + 1, lambda a: 1 - a, lambda a: a == a, len, list, repr, str, np.sum, np.linalg.norm,
                lambda a: a.sum(), lambda a: a.copy(), lambda a: a.T, lambda a: a.shape, lambda a: a.tolist(), lambda a: np.add(a, 1),
                lambda a: np.add(1, 1, out=a), lambda a: a.__setitem__(0, 0), lambda a: a @ np.eye(2), lambda a: np.concatenate([a, a]),
                lambda a: a.__iadd__(1), lambda a: a in [1], lambda a: bool(a), lambda a: np.einsum("ij->i", a), lambda a: a.view(np.ndarray)]
        sim, p = self.sim, self.sim.particles
        for go_on in (sim.step, lambda: sim.run(until=sim.t + 0.002), sim.close):
            view, part, own, plain = p.v, p.v[3:5], p.v[[1, 2]], np.asarray(p.v)
            kept, numbers = p.v.copy(), np.array(p.v)
            go_on()
            for number, use in enumerate(uses):
                for stale in (view, part):
                    with self.assertRaises(ordo.StaleView, msg=f"use {number}"):
                        use(stale)
            self.assertTrue(np.array_equal(plain, numbers))  # the memory stays, with the numbers of before
            self.assertTrue(np.array_equal(kept, numbers))
            self.assertEqual(own.shape, (2, 2))

    def test_memory_outlives_the_simulation(self):
        plain = {name: np.asarray(getattr(self.sim.particles, name)) for name in ("x", "v", "F", "stress", "V", "id")}
        before = {name: array.copy() for name, array in plain.items()}
        self.sim.step()
        del self.sim
        gc.collect()
        [np.ones(100000) for _ in range(20)]
        for name, array in plain.items():
            self.assertTrue(np.array_equal(array, before[name]), name)

    def test_read_only_fields(self):
        p = self.sim.particles
        for name in ("X", "F", "V", "mass", "body", "material", "id"):
            with self.assertRaises(ValueError, msg=name):
                getattr(p, name)[0] = 0
            with self.assertRaises(ValueError, msg=name):
                setattr(p, name, 0)
        with self.assertRaises(AttributeError):
            p.nothing = 1

    def test_velocities_change(self):
        sim, p = self.sim, self.sim.particles
        other = p.body == 1
        momentum = (p.mass[:, None] * p.v).sum(axis=0)
        p.v[other] += [0, -0.25]
        p.v += [0.125, 0]
        expected = momentum + [0.125 * p.mass.sum(), -0.25 * p.mass[other].sum()]
        sim.step()
        found = (p.mass[:, None] * p.v).sum(axis=0)
        self.assertTrue(np.allclose(found, expected, rtol=1e-12), (found, expected))

    def test_velocities_of_cells_change(self):
        for preset in ("cpdi2", "bscpdi2", "icpdi2", "apic", "polypic", "cpls"):
            if preset not in {one["name"] for one in ordo.methods()}:
                continue
            sim = ordo.Simulation(ordo.Case.from_dict(block(method__preset=preset, body__velocity=["0", "0"])))
            sim.step()
            sim.particles.v += [0.5, 0.25]
            sim.step()
            sim.step()
            v = sim.particles.v
            self.assertTrue(np.allclose(v, [0.5, 0.25], atol=1e-9), (preset, v.min(axis=0), v.max(axis=0)))

    def test_impulses_are_no_growth_of_energy(self):
        sim = ordo.Simulation(ordo.Case.from_dict(block(body__velocity=["0", "0"], watch={"fatal": ["energy"]})))
        for _ in range(12):
            sim.particles.v += [0.01, 0]
            sim.step()
        self.assertGreater(sim.history["kinetic_energy"][-1], 1)

    def test_places_change(self):
        sim, p = self.sim, self.sim.particles
        sim.step()
        p.x[p.body == 1] += [0.6, 0.01]
        sim.run(until=0.005)
        centre = p.x[p.body == 1].mean(axis=0)
        self.assertTrue(np.allclose(centre, [0.74, 0.15], atol=0.02), centre)
        before = p.x.copy()
        p.x[3] = [5, 5]
        with self.assertRaisesRegex(ordo.InputError, "x of particle .* is outside the grid"):
            sim.step()
        self.assertTrue(np.array_equal(p.x, before))
        p.v[0] = np.nan
        with self.assertRaisesRegex(ordo.InputError, "v of particle .* is not finite"):
            sim.step()
        sim.step()

    def test_nodes_after_a_change(self):
        sim, p = self.sim, self.sim.particles
        sim.run(until=0.005)
        view, fields = p.v, {name: getattr(p, name).copy() for name in ("id", "X", "V")}
        self.assertEqual(view.sum(), sim.particles.v.sum())
        sim.grid  # the nodes of the last step: nothing changes
        view.sum()
        p.x[:, 0] = 1 - p.x[:, 0]
        p.v[:] = [1, 0]
        kept = np.asarray(p.x)
        self.assertTrue(np.allclose(sim.grid.velocity, [1, 0]))
        with self.assertRaises(ordo.StaleView):
            view.sum()
        kept[:] = 0.9
        order = np.argsort(p.id)
        for name, before in fields.items():
            self.assertTrue(np.array_equal(getattr(p, name)[order], before[np.argsort(fields["id"])]), name)
        sim.step()

    def test_changes_are_taken_as_a_whole(self):
        """What cannot stay is put back, and nothing else of the change counts until all is good."""
        law = [{"name": "rubber", "model": "jaumann-elastic", "density": 1000.0, "young": 1e5, "poisson": 0.3}]
        sims = [ordo.Simulation(ordo.Case.from_dict(block(material=law))) for _ in range(2)]
        for sim in sims:
            sim.particles.stress[:, 0, 0] = -1e3
        sims[0].particles.v[0] = np.nan
        with self.assertRaises(ordo.InputError):
            sims[0].step()
        for sim in sims:
            for _ in range(4):
                sim.step()
        self.assertTrue(np.array_equal(sims[0].particles.stress, sims[1].particles.stress))
        for name in ("stress_update_energy", "strain_energy", "kinetic_energy"):
            self.assertEqual(sims[0].history[name][-1], sims[1].history[name][-1], name)

    def test_stresses_change(self):
        sim = ordo.Simulation(ordo.Case.from_dict(block(body__velocity=["0", "0"])))
        p = sim.particles
        p.stress[:, 0, 0] = -1e3
        self.assertEqual(sim.particles.stress[0, 0, 0], -1e3)
        self.assertEqual(sim.field("stress")[0, 0, 0], -1e3)
        sim.step()
        right = p.x[:, 0] > 0.7
        self.assertGreater(p.v[right, 0].min(), 0)
        p.stress[0] = [[0, 1], [0, 0]]
        before = np.asarray(p.stress)
        with self.assertRaisesRegex(ordo.InputError, "stress of particle .* is not symmetric"):
            sim.step()
        self.assertEqual(before[0, 0, 1], before[0, 1, 0])  # put back in the memory that numpy sees
        p.stress[0] = np.nan
        p.v[0] = np.nan
        p.x[0] = np.nan

        @sim.on_step
        def spoil(one):
            one.particles.v[0] = one.particles.x[0] = np.nan

        for _ in range(3):
            with self.assertRaises(ordo.InputError):
                sim.step()
        with self.assertRaises(ordo.InputError):
            sim.step()
        self.assertTrue(np.isfinite(sim.particles.v).all() and np.isfinite(sim.particles.x).all())


class Callbacks(InTemporaryDirectory):
    def test_body_force(self):
        case = ordo.Case.from_dict(block(body__velocity=["0", "0"]))
        sim, heavy = ordo.Simulation(case), ordo.Simulation(ordo.Case.from_dict(block(body__velocity=["0", "0"], gravity=[0, -2.0])))
        calls = []

        @sim.body_force
        def gravity(x, X, t):
            calls.append((x.shape, X.shape, t))
            return np.tile([0, -2.0], (len(x), 1))

        for one in (sim, heavy):
            one.run()
        self.assertTrue(np.allclose(sim.particles.v, heavy.particles.v, atol=1e-12))
        self.assertEqual(calls[0], ((len(sim.particles), 2), (len(sim.particles), 2), 0.0))
        work = sim.history["body_force_work"][-1]
        self.assertAlmostEqual(work, heavy.history["potential_energy"][-1] - heavy.history["potential_energy"][0], 9)
        sim.body_force(None)
        v = sim.particles.v.copy()
        sim.run(until=0.021)
        self.assertTrue(np.allclose(sim.particles.v.mean(axis=0), v.mean(axis=0), atol=1e-12))

    def test_body_force_adds_to_that_of_the_case(self):
        sim = ordo.Simulation(ordo.Case.from_dict(block(body__velocity=["0", "0"], body__body_force=["1", "0"])))
        sim.body_force(lambda x, X, t: np.full(x.shape, [0.0, 3.0]))
        sim.step()
        sim.step()
        self.assertTrue(np.allclose(sim.particles.v.mean(axis=0), np.array([1, 3]) * 1.5 * sim.dt, rtol=1e-9))

    def test_on_step_sees_and_ends(self):
        sim, seen = ordo.Simulation(ordo.Case.from_dict(block())), []

        @sim.on_step
        def look(one):
            self.assertIs(one, sim)
            seen.append((one.n, one.particles.x.copy(), len(one.history["time"])))
            self.held = one.particles.v
            with self.assertRaisesRegex(RuntimeError, "in use already"):
                one.step()
            one.write(self.dir / "frames" / f"frame-{one.n}")
            return one.n < 5

        sim.run()
        self.assertEqual([s[0] for s in seen], [1, 2, 3, 4, 5])
        self.assertEqual([s[2] for s in seen], [2, 3, 4, 5, 6])
        self.assertEqual(sim.n, 5)
        self.assertFalse(np.array_equal(seen[0][1], seen[1][1]))
        with self.assertRaises(ordo.StaleView):
            self.held.sum()
        self.assertEqual(len(list((self.dir / "frames").glob("*.vtu"))), 5)
        sim.on_step(None)
        sim.run()
        self.assertTrue(sim.is_complete)

    def test_errors_of_on_step_leave_a_good_state(self):
        sim = ordo.Simulation(ordo.Case.from_dict(block()))

        @sim.on_step
        def fail(one):
            raise KeyError("mine")

        with self.assertRaisesRegex(KeyError, "mine"):
            sim.run()
        self.assertEqual(sim.n, 1)
        sim.on_step(None)
        sim.run()
        whole = ordo.Simulation(ordo.Case.from_dict(block()))
        whole.run()
        self.assertTrue(np.array_equal(sim.particles.x, whole.particles.x))

    def test_on_nodes(self):
        """A wall by hand is the wall of the case, up to rounding."""
        moving = block(body__velocity=["-5", "0"], boundary=[], body__lower=[0.01, 0.25], body__upper=[0.51, 0.75])
        case = ordo.Case.from_dict({**moving, "boundary": [{"face": "x-min", "type": "symmetry"}]})
        sim, walled = ordo.Simulation(ordo.Case.from_dict(moving)), ordo.Simulation(case)

        @sim.on_nodes
        def wall(nodes):
            at = nodes.place[:, 0] < 1e-9
            self.assertGreater(nodes.dt, 0)
            nodes.momentum[at, 0] = 0
            nodes.force[at, 0] = 0

        for one in (sim, walled):
            one.run(until=0.01)
        self.assertTrue(np.allclose(sim.particles.v, walled.particles.v, atol=1e-9))
        self.assertGreater(np.abs(sim.particles.v - [-5, 0]).max(), 1)

    def test_functions_that_refer_to_their_simulation_are_freed(self):
        sim = ordo.Simulation(ordo.Case.from_dict(block()))
        gone = weakref.ref(sim)
        sim.on_step(lambda _: sim.t >= 0)
        sim.body_force(lambda x, X, t: 0 * sim.t * x)
        sim.on_nodes(lambda nodes: sim.t)
        sim.step()
        del sim
        gc.collect()
        self.assertIsNone(gone())

    def test_work_on_nodes_is_given_not_gained(self):
        """A push on the nodes is that of a body force, and the account has it as given."""
        push = 400.0
        sims = [ordo.Simulation(ordo.Case.from_dict(block())) for _ in range(2)]

        @sims[0].on_nodes
        def on_nodes(nodes):
            nodes.force[:, 0] += push * nodes.mass

        sims[1].body_force(lambda x, X, t: np.tile([push, 0.0], (len(x), 1)))
        for sim in sims:
            sim.run(until=0.005)
        self.assertTrue(np.allclose(sims[0].particles.v, sims[1].particles.v, rtol=1e-9))
        for name in ("stress_update_energy", "projection_energy"):
            ours, theirs = (sim.history[name][-1] for sim in sims)
            self.assertLess(abs(ours - theirs), 1e-3 * sims[0].history["kinetic_energy"][-1], name)

    def test_impulses_on_nodes_are_given(self):
        sim = ordo.Simulation(ordo.Case.from_dict(block(body__velocity=["0", "0"])))

        @sim.on_nodes
        def on_nodes(nodes):
            nodes.momentum[:, 1] += 0.5 * nodes.mass

        sim.run(until=0.01)
        h = sim.history
        self.assertTrue(np.all(np.abs(sim.particles.v - [0, 0]) < 1e-9))  # FLIP takes increments of the kick alone
        self.assertLess(abs(h["stress_update_energy"][-1]), 1.0)

    @needs_hdf5
    def test_on_step_changes_are_in_checkpoints(self):
        case = ordo.Case.from_dict(block(checkpoint={"steps": 10}, time__end=0.01))

        def damp(sim):
            sim.particles.v *= 0.9

        whole = ordo.Simulation(case)
        whole.on_step(damp)
        whole.run(output=self.dir / "damped")
        restored = ordo.Simulation.restore(self.dir / "damped" / "checkpoint_000000010.h5")
        restored.on_step(damp)
        restored.run()
        self.assertTrue(np.array_equal(whole.particles.x, restored.particles.x))
        self.assertEqual(ordo.history(self.dir / "damped")["kinetic_energy"][-1], whole.history["kinetic_energy"][-1])

    def test_errors_of_a_run_do_not_come_again(self):
        sim = ordo.Simulation(ordo.Case.from_dict(block()))

        @sim.on_step
        def fail(one):
            one.particles.v[0] = np.nan
            raise KeyError("mine")

        with self.assertRaisesRegex(KeyError, "mine"):
            sim.run(output=self.dir / "run")
        self.assertTrue(np.isfinite(sim.particles.v).all())
        self.assertTrue(np.isfinite(ordo.history(self.dir / "run")["kinetic_energy"]).all())
        sim.on_step(None)
        sim.run()

    def test_probes_follow_the_particles_of_the_start(self):
        case = ordo.Case.from_dict(block(body__velocity=["10", "0"], probe=[{"name": "a", "particle": [0.5, 0.5]}]))
        whole, late = ordo.Simulation(case), ordo.Simulation(case)
        whole.run(until=0.015, output=self.dir / "whole")
        late.run(until=0.01)
        late.run(until=0.015, output=self.dir / "late")
        ends = [ordo.history(self.dir / name / "probe_a.csv")["position_x"][-1] for name in ("whole", "late")]
        self.assertEqual(*ends)

    def test_long_steps_are_warned_of(self):
        sim = ordo.Simulation(ordo.Case.from_dict(block(time={"end": 0.02, "cfl": 0.4})))
        with self.assertWarnsRegex(ordo.InstabilityWarning, "is above the limit"):
            sim.step(dt=0.01)

    def test_failed_states_have_no_nodes(self):
        sim = ordo.Simulation(ordo.Case.from_dict(block(time={"end": 1.0, "cfl": 0.4})))
        sim.particles.v[0] = 1e9
        with self.assertRaises(ordo.NumericalError), self.assertWarns(ordo.InstabilityWarning):
            sim.step(dt=1.0)
        sim.particles.v *= 0.5
        with self.assertRaisesRegex(ordo.NumericalError, "grid: an earlier step failed"):
            sim.grid

    def test_bad_answers_name_callback_and_particle(self):
        def fresh():
            return ordo.Simulation(ordo.Case.from_dict(block()))

        answers = [(lambda x, X, t: x[:, 0], ordo.InputError, r"body_force: the acceleration must be .* shape \(64, 2\) \(got shape \(64,\)\)"),
                   (lambda x, X, t: None, ordo.InputError, "got NoneType"), (lambda x, X, t: x.astype(complex), ordo.InputError, "got dtype complex128"),
                   (lambda x, X, t: x.astype(str), ordo.InputError, "got dtype"), (lambda x, X, t: "no", ordo.InputError, "got"),
                   (lambda x, X, t: x * np.nan, ordo.NumericalError, r"body_force: the acceleration of particle \d+ of body 0 at .* is not finite"),
                   (lambda x, X: x, TypeError, "positional"), (lambda x, X, t: 1 / 0, ZeroDivisionError, "")]
        for f, error, text in answers:
            sim = fresh()
            sim.step()
            sim.body_force(f)
            with self.assertRaisesRegex(error, text):
                sim.run()
            with self.assertRaisesRegex(ordo.NumericalError, "an earlier step failed"):
                sim.step()
            with self.assertRaisesRegex(ordo.NumericalError, "an earlier step failed"):
                sim.save(self.dir / "bad.h5")
            self.assertFalse((self.dir / "bad.h5").exists())
        sim = fresh()

        def spoil(nodes):
            nodes.force[0, 0] = np.inf

        sim.on_nodes(spoil)
        with self.assertRaisesRegex(ordo.NumericalError, "on_nodes: force of the node at .* is not finite"):
            sim.step()

    def test_on_nodes_needs_nodes(self):
        case = ordo.Case.from_dict(block(method__preset="spline3", body__lower=[0, 0], body__upper=[1, 1], grid__spacing=[0.125, 0.125],
                                         boundary=[{"face": ["x-min", "x-max", "y-min", "y-max"], "type": "symmetry"}], time={"end": 1e-3, "cfl": 0.2}))
        sim = ordo.Simulation(case)
        with self.assertRaisesRegex(ordo.InputError, "no nodes"):
            sim.on_nodes(lambda nodes: None)
        sim.run()


class Processes(InTemporaryDirectory):
    LONG = "import ordo, sys, time, os, signal, threading\nimport numpy as np\nsys.path.insert(0, {tests!r})\nfrom support import block\n" \
           "case = ordo.Case.from_dict(block(grid__spacing=[0.03125, 0.03125], time={{'end': 100.0, 'dt': 1e-4}}))\n"

    def run_code(self, code, **how):
        done = python(self.LONG.format(tests=os.path.dirname(__file__)) + code, self.dir, **how)
        self.assertEqual(done.returncode, 0, done.stdout + done.stderr)
        return done.stdout

    def test_ctrl_c_ends_after_a_whole_step(self):
        for law in ("", "@ordo.material('mine', wave_speed=lambda par: 12.0)\ndef law(F, dF, dt, state, par):\n"
                        "    for _ in range(50): np.exp(F)\n    return 1e4 * (F - np.eye(3) + np.swapaxes(F, 1, 2) - np.eye(3))\n"
                        "case = ordo.Case.from_dict(block(material=[{'name': 'rubber', 'model': 'mine', 'density': 1000.0}], "
                        "time={'end': 100.0, 'dt': 1e-6}, watch={'fatal': []}))\n"):
            out = self.run_code(law + """
sim = ordo.Simulation(case)
threading.Timer(1.0, lambda: os.kill(os.getpid(), signal.SIGINT)).start()
begin = time.monotonic()
try:
    sim.run()
    print('never')
except KeyboardInterrupt:
    print('interrupted', time.monotonic() - begin < 60)
n = sim.n
assert signal.getsignal(signal.SIGINT) is signal.default_int_handler
other = ordo.Simulation(case)
for _ in range(n): other.step()
print(n > 0, np.array_equal(sim.particles.x, other.particles.x))
sim.step()
""")
            self.assertEqual(out, "interrupted True\nTrue True\n")

    def test_nested_simulations_keep_ctrl_c(self):
        out = self.run_code("""
a, b = ordo.Simulation(case), ordo.Simulation(case)
a.on_step(lambda sim: b.step())
a.run(until=0.001)
print(b.n == a.n, signal.getsignal(signal.SIGINT) is signal.default_int_handler)
threading.Timer(0.3, lambda: os.kill(os.getpid(), signal.SIGINT)).start()
try: a.run()
except KeyboardInterrupt: print('interrupted', a.n == b.n)
try: os.kill(os.getpid(), signal.SIGINT); time.sleep(1)
except KeyboardInterrupt: print('again')
""")
        self.assertEqual(out, "True True\ninterrupted True\nagain\n")

    def test_ctrl_c_is_not_lost_to_another_error(self):
        out = self.run_code("""
sim = ordo.Simulation(case)
def fail(one):
    os.kill(os.getpid(), signal.SIGINT)
    raise KeyError
sim.on_step(fail)
try:
    try: sim.run()
    except KeyError: time.sleep(1)
    print('lost')
except KeyboardInterrupt: print('interrupted')
""")
        self.assertEqual(out, "interrupted\n")

    def test_own_signal_handlers_run(self):
        out = self.run_code("""
class Enough(Exception): pass
def ring(*_): raise Enough
signal.signal(signal.SIGALRM, ring)
sim = ordo.Simulation(case)
signal.setitimer(signal.ITIMER_REAL, 0.5)
try: sim.run()
except Enough: print('rang')
sim.step()
""")
        self.assertEqual(out, "rang\n")

    def test_two_simulations_in_two_threads(self):
        out = self.run_code("""
sims = [ordo.Simulation(case, threads=1) for _ in range(2)]
begun = threading.Barrier(2)
ends = [0.1, 0.15]
inside, both = [0], [False]
lock = threading.Lock()
def go(sim, end):
    begun.wait()
    with lock: inside[0] += 1; both[0] = both[0] or inside[0] == 2
    sim.run(until=end)
    with lock: inside[0] -= 1
threads = [threading.Thread(target=go, args=one) for one in zip(sims, ends)]
for t in threads: t.start()
busy = 0
while any(t.is_alive() for t in threads):
    try: sims[0].particles
    except RuntimeError: pass
    try: sims[1].particles.x
    except RuntimeError as e: busy += 'in use, by another thread' in str(e)
    time.sleep(0.001)
for t in threads: t.join()
alone = [ordo.Simulation(case, threads=2) for _ in range(2)]
for sim, end in zip(alone, ends): sim.run(until=end)
print(both[0], busy > 0, [np.array_equal(a.particles.x, b.particles.x) for a, b in zip(sims, alone)])
""")
        self.assertEqual(out, "True True [True, True]\n")

    def test_forks(self):
        out = self.run_code("""
import multiprocessing
sim = ordo.Simulation(case, threads=2)
sim.run(until=0.002)
def use(_):
    try: sim.step(); return 'stepped'
    except RuntimeError as e: answer = str(e)[:41]
    own = ordo.Simulation(case, threads=2)
    own.particles.v += 0
    own.step()
    own.particles.v[0] += 1
    own.particles.v[0] -= 1
    own.run(until=0.002)
    return answer, np.asarray(own.particles.x).copy()
with multiprocessing.get_context('fork').Pool(2) as pool:
    answers = pool.map(use, range(3))
print({a[0] for a in answers}, all(np.array_equal(a[1], sim.particles.x) for a in answers))
sim.step()
""")
        self.assertEqual(out, "{'this simulation belongs to the process th'} True\n")

    @unittest.skipIf("asan" in os.environ.get("LD_PRELOAD", ""), "the address sanitizer keeps freed memory")
    def test_memory_stays_flat(self):
        out = self.run_code("""
import gc, resource
def resident():
    with open('/proc/self/statm') as file: return int(file.read().split()[1]) * resource.getpagesize() / 1e6
def use():
    sim = ordo.Simulation(case, threads=1)
    held = sim.particles.v
    sim.on_step(lambda one: one.particles.x.sum() > 0)
    sim.body_force(lambda x, X, t: 0 * x)
    sim.step(); sim.step()
    return sim.particles.stress
for k in range(200):
    use()
    if k == 40: gc.collect(); early = resident()
gc.collect()
print(resident() - early < 8, file=sys.stdout)
print(resident() - early, file=sys.stderr)
""")
        self.assertEqual(out, "True\n")


class Rest(InTemporaryDirectory):
    def test_cases(self):
        case = ordo.Case(TWO_DISKS, {"method.preset": "cpls", "time.dt": 0.005})
        self.assertEqual((case.dim, case.name), (2, "two-disks"))
        again = ordo.Case.from_dict(case.to_dict())
        self.assertEqual(str(again).replace(again.name, case.name), str(case))
        with self.assertRaisesRegex(ordo.InputError, r"^overrides: time.dt: must be positive"):
            ordo.Case(TWO_DISKS, {"time.dt": -1})
        with self.assertRaisesRegex(ordo.InputError, r'^case: body\[0\]\.shape: .*Did you mean "ball"'):
            ordo.Case.from_dict(block(body__shape="sphere"))
        numbers = block(grid__size=np.array([1.0, 1.0]), material__young=np.float32(1e5), output={"every": np.int64(2)})
        self.assertIn("every = 2", str(ordo.Case.from_dict(numbers)))

    def test_lists(self):
        self.assertIn("cpls", [one["name"] for one in ordo.methods()])
        self.assertIn("j2", [one["name"] for one in ordo.materials()])
        os.chdir(ROOT)
        kinds = {one["kind"]: one for one in ordo.cases()}
        self.assertEqual(set(kinds), {"verify", "run"})
        self.assertEqual(ordo.schema()["grid"]["keys"]["spacing"]["unit"], "m")

    def test_verify_is_that_of_the_program(self):
        found = ordo.verify("vibration-1d", methods=["cpdi1"], cells=[16, 32], amplitude=0.01)
        program("verify", "vibration-1d", "--method", "cpdi1", "--cells", "16,32", "--set", "amplitude=0.01", "--json", self.dir / "v.json", cwd=self.dir)
        def numbers(studies):
            return [[row["error"] for row in study["rows"]] for study in studies]

        self.assertEqual(numbers(found), numbers(json.loads((self.dir / "v.json").read_text())))
        self.assertEqual(found[0]["rows"][0]["cells"], 16)

    def test_one_and_three_dimensions(self):
        for dim in (1, 3):
            case = block(grid={"size": [1.0] * dim, "spacing": [0.25] * dim})
            case["body"][0].update(lower=[0.25] * dim, upper=[0.75] * dim, velocity=["sin(6*x)"] * dim)
            sim = ordo.Simulation(ordo.Case.from_dict(case))
            sim.run()
            n = len(sim.particles)
            self.assertEqual((sim.particles.F.shape, sim.particles.stress.shape), ((n, dim, dim),) * 2)
            self.assertTrue(np.allclose(sim.field("stress")[:, :dim, :dim], sim.particles.stress))

    def test_stages_end(self):
        sim = ordo.Simulation(ordo.Case.from_dict(block(stage=[{"name": "rest", "duration": 0.005}, {"name": "go", "duration": 0.005}],
                                                        time={"end": 0.01, "dt": 0.0005})))
        sim.run()
        self.assertTrue(sim.is_complete)
        with self.assertRaisesRegex(ordo.InputError, "the last stage of the case has ended"):
            sim.step()

    def test_stubs_are_the_signatures(self):
        tree = ast.parse(pathlib.Path(ordo.__file__).with_name("__init__.pyi").read_text(encoding="utf-8"))

        def parameters(node):
            a = node.args
            return [arg.arg for arg in [*a.posonlyargs, *a.args, *([a.vararg] if a.vararg else []), *a.kwonlyargs, *([a.kwarg] if a.kwarg else [])]]

        def compare(body, owner, where):
            for node in body:
                if isinstance(node, ast.ClassDef):
                    compare(node.body, getattr(owner, node.name), f"{where}.{node.name}")
                elif isinstance(node, ast.FunctionDef):
                    found = inspect.getattr_static(owner, node.name)
                    if not isinstance(found, property):
                        found = found.__func__ if isinstance(found, classmethod) else found
                        self.assertEqual(parameters(node), list(inspect.signature(found).parameters), f"{where}.{node.name}")

        compare(tree.body, ordo, "ordo")
        names = {node.name for node in tree.body if isinstance(node, (ast.ClassDef, ast.FunctionDef))}
        self.assertEqual(names, set(ordo.__all__))
        declared = {node.name for one in tree.body if isinstance(one, ast.ClassDef) and one.name == "Simulation" for node in one.body}
        self.assertEqual({name for name in vars(ordo.Simulation) if not name.startswith("_")}, {name for name in declared if not name.startswith("_")})

    def test_help_says_shapes_and_units(self):
        for thing in (ordo, ordo.Simulation, ordo.Case, ordo.material, ordo.verify, ordo.Particles, ordo.Nodes):
            self.assertGreater(len(thing.__doc__ or ""), 100, thing)
        for name in dir(ordo.Simulation):
            if not name.startswith("_"):
                self.assertTrue(getattr(ordo.Simulation, name).__doc__, name)


if __name__ == "__main__":
    unittest.main()
