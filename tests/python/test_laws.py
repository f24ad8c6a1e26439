"""Constitutive laws in numpy: those of built-in ones, with state that is kept, sorted, written and checkpointed."""

import unittest

import numpy as np
import ordo
from support import BLOCK, InTemporaryDirectory, block, needs_hdf5

EYE = np.eye(3)


@ordo.material("numpy-neo-hookean", wave_speed=lambda par: np.sqrt((par["lam"] + 2 * par["mu"]) / par["rho"]))
def neo_hookean(F, dF, dt, state, par):
    """sigma = [lam ln J I + mu (F F^T - I)]/J"""
    J = np.linalg.det(F)[:, None, None]
    return (par["lam"] * np.log(J) * EYE + par["mu"] * (F @ np.swapaxes(F, 1, 2) - EYE)) / J


@ordo.material("counter", state={"steps_taken": 0.0, "age": 1.0, "first_id": -1.0}, wave_speed=lambda par: par["c"])
def counter(F, dF, dt, state, par):
    """Steps and time of each particle."""
    state["steps_taken"] += 1
    state["age"] = state["age"] + dt
    return np.zeros_like(F)


def lame(young, poisson):
    return young * poisson / ((1 + poisson) * (1 - 2 * poisson)), young / (2 * (1 + poisson))


def numpy_law(density, young, poisson, name="rubber"):
    lam, mu = lame(young, poisson)
    return {"name": name, "model": "numpy-neo-hookean", "density": density, "parameters": {"lam": lam, "mu": mu}}


class Vibration:
    """The standing waves of `ordo verify vibration-2d`: x_a = X_a + A sin(k X_a) sin(w t) in the unit box between frictionless
    walls, with the body force that the neo-Hookean law needs for it."""

    young, poisson, density, amplitude, k = 1e7, 0.3, 1000.0, 0.1, np.pi
    omega = np.pi * np.sqrt(1e7 / 1000.0)

    def motion(self, X, t):
        return X + self.amplitude * np.sin(self.k * X) * np.sin(self.omega * t)

    def body_force(self, x, X, t):
        """x'' - (div P)/rho; each F_aa depends on X_a alone, so dP_aa/dX_a by a complex step is exact."""
        lam, mu = lame(self.young, self.poisson)
        sines = np.sin(self.omega * t)

        def stretch(Z):
            return 1 + self.amplitude * self.k * np.cos(self.k * Z) * sines

        other, h = np.log(stretch(X))[:, ::-1], 1e-30
        F = stretch(X + 1j * h)
        div = np.imag(lam * (np.log(F) + other) / F + mu * (F - 1 / F)) / h
        return -self.omega**2 * self.amplitude * np.sin(self.k * X) * sines - div / self.density

    def errors(self, cells, material, end=0.02):
        case = ordo.Case.from_dict({
            "grid": {"size": [1.0, 1.0], "spacing": [1 / cells, 1 / cells]},
            "method": {"preset": "cpls"},
            "time": {"end": end, "dt": end / (5 * cells)},
            "material": [material],
            "body": [{"material": "rubber", "shape": "box", "lower": [0, 0], "upper": [1, 1], "velocity": [f"{self.amplitude * self.omega}*sin({self.k}*{axis})" for axis in "xy"]}],
            "boundary": [{"face": ["x-min", "x-max", "y-min", "y-max"], "type": "symmetry"}],
            "watch": {"fatal": []},
        })
        sim = ordo.Simulation(case)
        sim.body_force(self.body_force)
        sim.run()
        p = sim.particles
        lam, mu = lame(self.young, self.poisson)
        F = 1 + self.amplitude * self.k * np.cos(self.k * p.X) * np.sin(self.omega * sim.t)
        J = F.prod(axis=1)[:, None]
        sigma = (lam * np.log(J) + mu * (F * F - 1)) / J
        stress = p.stress.copy()
        for a in range(2):
            stress[:, a, a] -= sigma[:, a]
        return {"displacement": np.sqrt(np.mean(np.sum((p.x - self.motion(p.X, sim.t)) ** 2, axis=1))),
                "stress": np.sqrt(np.mean(np.sum(stress**2, axis=(1, 2))))}


class Convergence(unittest.TestCase):
    def test_numpy_law_is_of_second_order_with_the_errors_of_the_built_in(self):
        problem, meshes = Vibration(), [16, 32]
        built_in = {"name": "rubber", "density": problem.density, "young": problem.young, "poisson": problem.poisson}
        rows = ordo.verify("vibration-2d", methods=["cpls"], cells=meshes)[0]["rows"]
        errors = {"displacement": [], "stress": []}
        for cells, row in zip(meshes, rows):
            own = problem.errors(cells, numpy_law(problem.density, problem.young, problem.poisson))
            reference = problem.errors(cells, built_in)
            for name, found in errors.items():
                found.append(own[name])
                self.assertLess(abs(own[name] / reference[name] - 1), 1e-9, (cells, name))
                self.assertLess(abs(own[name] / row["error"][name] - 1), 0.02, (cells, name, own[name], row["error"][name]))
        for name, found in errors.items():
            orders = np.log2(np.array(found[:-1]) / np.array(found[1:]))
            self.assertGreater(orders.min(), 1.95, (name, orders))
            self.assertLess(orders.max(), 2.15, (name, orders))


class Stress(InTemporaryDirectory):
    def pair(self, **changes):
        own = ordo.Simulation(ordo.Case.from_dict(block(material=[numpy_law(1000.0, 1e5, 0.3)], **changes)))
        reference = ordo.Simulation(ordo.Case.from_dict(block(**changes)))
        return own, reference

    def test_every_way_to_update_stress(self):
        """Schemes, averages of dilations and projections: the same motion as the built-in law."""
        changes = [{"method__preset": preset} for preset in ("mpm", "cpdi1", "cpdi2", "cpls", "cpls-limited", "apic", "bscpdi2")]
        changes += [{"method__scheme": "usf"}, {"method__scheme": "usl"}, {"method__scheme": "musl"}, {"method__quadrature": "particle"}]
        for change in changes:
            own, reference = self.pair(**change)
            own.run()
            reference.run()
            scale = np.abs(reference.particles.stress).max()
            self.assertGreater(scale, 100, change)
            self.assertTrue(np.allclose(own.particles.stress, reference.particles.stress, atol=1e-9 * scale), change)
            self.assertTrue(np.allclose(own.field("stress"), reference.field("stress"), atol=1e-9 * scale), change)

    def test_energies_of_the_run(self):
        """The work of the stresses is the stored energy of an elastic law, up to the error of the time step."""
        differences = []
        for dt in (0.0005, 0.00025):
            own, reference = self.pair(time__dt=dt)
            own.run()
            reference.run()
            ours, theirs = own.history["strain_energy"], reference.history["strain_energy"]
            differences.append(np.abs(ours - theirs).max() / theirs.max())
        self.assertLess(differences[0], 1e-3)
        self.assertLess(differences[1], 0.35 * differences[0])  # of second order

    def test_heat_is_not_stored(self):
        @ordo.material("viscous", state={"dissipated": 0.0}, wave_speed=lambda par: 10.0)
        def viscous(F, dF, dt, state, par):
            L = np.linalg.solve(dF, dF - EYE) / dt
            rate = 0.5 * (L + np.swapaxes(L, 1, 2))
            sigma = 2 * par["eta"] * rate
            state["dissipated"] += np.linalg.det(F) * dt * np.einsum("nij,nij->n", sigma, rate)
            return sigma

        sim = ordo.Simulation(ordo.Case.from_dict(block(material=[{"name": "rubber", "model": "viscous", "density": 1000.0,
                                                                 "parameters": {"eta": 5.0}}])))
        sim.run()
        h = sim.history
        self.assertGreater(h["dissipated_energy"][-1], 0.01 * h["kinetic_energy"][0])
        self.assertLess(np.abs(h["strain_energy"]).max(), 0.1 * h["dissipated_energy"][-1])

    def test_one_of_two_materials(self):
        bodies = [{"material": "rubber", "shape": "ball", "center": [0.3, 0.3], "radius": 0.2, "velocity": ["1", "0"]},
                  {"material": "steel", "shape": "ball", "center": [0.7, 0.7], "radius": 0.2, "velocity": ["-1", "-1"]}]
        steel = {"name": "steel", "density": 2000.0, "young": 3e5, "poisson": 0.2}
        own, reference = (ordo.Simulation(ordo.Case.from_dict(block(material=[one, steel], body=bodies)))
                          for one in (numpy_law(1000.0, 1e5, 0.3), BLOCK["material"][0]))
        for sim in (own, reference):
            sim.run()
        self.assertTrue(np.array_equal(own.particles.id, reference.particles.id))
        self.assertTrue(np.allclose(own.particles.x, reference.particles.x, atol=1e-12))

    def test_one_and_three_dimensions(self):
        for dim in (1, 3):
            changes = {"grid": {"size": [1.0] * dim, "spacing": [0.25] * dim}, "body__lower": [0.25] * dim, "body__upper": [0.75] * dim,
                       "body__velocity": ["sin(6*x)", "sin(4*x)", "cos(7*z)"][:dim]}
            own, reference = self.pair(**changes)
            own.run()
            reference.run()
            self.assertTrue(np.allclose(own.field("stress"), reference.field("stress"), atol=1e-7))

    def test_splines_refuse_it(self):
        with self.assertRaisesRegex(ordo.InputError, "spline-fit takes no material with history"):
            ordo.Simulation(ordo.Case.from_dict(block(method__preset="spline3", material=[numpy_law(1000.0, 1e5, 0.3)])))

    def test_stages_refuse_it(self):
        case = block(material=[BLOCK["material"][0], numpy_law(1000.0, 1e5, 0.3, "other")], time={"end": 0.02, "dt": 0.0005},
                     stage=[{"name": "a", "duration": 0.01}, {"name": "b", "duration": 0.01, "materials": {"body 0": "other"}}],
                     body__name="body 0")
        with self.assertRaisesRegex(ordo.InputError, "materials: cannot give a body the law numpy-neo-hookean"):
            ordo.Simulation(ordo.Case.from_dict(case))


class State(InTemporaryDirectory):
    case = block(material=[{"name": "rubber", "model": "counter", "density": 1000.0, "parameters": {"c": 12.0}}],
                 body__velocity=["20", "13"], boundary=[{"face": ["x-min", "y-min"], "type": "periodic"}],
                 output={"fields": ["age", "steps_taken", "velocity"], "interval": 0.005})

    def test_is_kept_and_sorted(self):
        @ordo.material("names", state={"own": 0.0}, wave_speed=lambda par: 12.0)
        def names(F, dF, dt, state, par):
            state["own"] += 1
            return np.zeros_like(F)

        sim = ordo.Simulation(ordo.Case.from_dict({**self.case, "output": {}, "material": [{**self.case["material"][0], "model": "names", "parameters": {}}]}))
        sim.particles.own[...] = 1000 * sim.particles.id
        order = sim.particles.id.copy()
        sim.run()
        self.assertFalse(np.array_equal(sim.particles.id, order))  # the body crossed the box
        self.assertTrue(np.array_equal(sim.particles.own, 1000 * sim.particles.id + sim.n))
        self.assertTrue(np.array_equal(sim.particles.state["own"], sim.particles.own))
        with self.assertRaises(ValueError):
            sim.particles.stress_work[0] = 1.0
        sim.particles.own[3] = np.nan
        with self.assertRaisesRegex(ordo.InputError, "own of particle .* is not finite"):
            sim.step()
        sim.step()

    @needs_hdf5
    def test_is_written_and_checkpointed(self):
        sim = ordo.Simulation(ordo.Case.from_dict(self.case))
        self.assertEqual(set(sim.particles.age.tolist()), {1.0})
        sim.run(until=0.01, output=self.dir / "run")
        self.assertIn(b'Name="steps_taken"', (self.dir / "run" / "particles_000001.vtu").read_bytes())
        sim.save(self.dir / "state.h5")
        restored = ordo.Simulation.restore(self.dir / "state.h5")
        self.assertTrue(np.array_equal(restored.particles.age, sim.particles.age))
        for one in (sim, restored):
            one.run()
        self.assertTrue(np.array_equal(restored.particles.age, sim.particles.age))
        self.assertEqual(set(sim.particles.steps_taken.tolist()), {float(sim.n)})
        self.assertAlmostEqual(sim.particles.age[0], 1 + sim.t, 9)
        self.assertTrue(np.array_equal(sim.field("age"), sim.particles.age))

    def test_cases_echo_parameters(self):
        text = str(ordo.Case.from_dict(self.case))
        self.assertIn('parameters = {"c" = 12.0}', text)
        again = ordo.Case.from_dict(ordo.Case.from_dict(self.case).to_dict())
        self.assertEqual(str(again), text)
        self.assertIn("counter", [one["name"] for one in ordo.materials()])
        self.assertIn("counter", ordo.schema()["material"]["keys"]["model"]["choices"])


class Errors(unittest.TestCase):
    @staticmethod
    def broken(answer):
        @ordo.material("broken", state={"a": 0.0}, wave_speed=lambda par: 12.0)
        def broken(F, dF, dt, state, par):
            return answer(F, state)

        return ordo.Simulation(ordo.Case.from_dict(block(material=[{"name": "rubber", "model": "broken", "density": 1000.0}])))

    def test_bad_answers_name_law_array_and_particle(self):
        def spoil(F, state):
            state["a"][5] = np.nan
            return 0 * F

        def drop(F, state):
            del state["a"]
            return 0 * F

        def widen(F, state):
            state["a"] = np.zeros(3)
            return 0 * F

        def add(F, state):
            state["b"] = state["a"]
            return 0 * F

        def stray(F, state):
            s = 0 * F
            s[7] = np.nan
            return s

        def skew(F, state):
            s = 0 * F
            s[7, 0, 1] = 1
            return s

        def across(F, state):
            s = 0 * F
            s[:, 0, 2] = s[:, 2, 0] = 1
            return s

        for answer, error, text in ((spoil, ordo.NumericalError, r'law broken: state "a" of particle \d+ of body 0 at \(.*\) is not finite'),
                                    (drop, ordo.InputError, 'law broken: took state "a" out'),
                                    (widen, ordo.InputError, r'law broken: state "a" must be an array of real numbers of shape \(64,\) \(got shape \(3,\)\)'),
                                    (add, ordo.InputError, "law broken: state 'b' was not declared"),
                                    (stray, ordo.NumericalError, r"law broken: cauchy of particle \d+ of body 0 at \(.*\) is not finite"),
                                    (skew, ordo.NumericalError, "law broken: cauchy of particle .* is not symmetric"),
                                    (across, ordo.NumericalError, "law broken: cauchy of particle .* has a shear that a problem in 2D cannot have"),
                                    (lambda F, s: F[0], ordo.InputError, r"law broken: cauchy must .* shape \(64, 3, 3\) \(got shape \(3, 3\)\)"),
                                    (lambda F, s: None, ordo.InputError, "law broken: cauchy .*NoneType"),
                                    (lambda F, s: F.astype(object), ordo.InputError, "law broken: cauchy .*dtype object"),
                                    (lambda F, s: F * 1j, ordo.InputError, "law broken: cauchy .*dtype complex128"),
                                    (lambda F, s: F.tolist()[0][0][0], ordo.InputError, "law broken: cauchy"),
                                    (lambda F, s: 1 / 0, ZeroDivisionError, "")):
            sim = self.broken(answer)
            with self.assertRaisesRegex(error, text):
                sim.run()
            with self.assertRaisesRegex(ordo.NumericalError, "an earlier step failed"):
                sim.step()

    def test_float32_is_taken(self):
        sim = self.broken(lambda F, s: (1e3 * (EYE - F)).astype(np.float32))
        sim.step()

    def test_bad_declarations(self):
        good = {"wave_speed": lambda par: 1.0}
        for args, how, text in ((("two words",), good, "name must be a word"), ((3,), good, "name must be a word"),
                                (("a", {"x y": 0}), good, "must be a name"), (("a", {"s": "zero"}), good, "must start with a number"),
                                (("a", {"s": np.inf}), good, "finite"), (("a", ["s"]), good, "must be a dict"),
                                (("a",), {"wave_speed": 3.0}, "wave_speed must be a function"), (("j2",), good, "is the name of a law of ordo"),
                                (("a", {"velocity": 0.0}), good, 'state "velocity" is the name of another field'),
                                (("a", {"V": 0.0}), good, "state 'V' is the name of another field"), (("a", {"state": 0.0}), good, "is the name of another field"),
                                (("a", {"stress_work": 0.0}), good, "is the name of another field"),
                                (("a", {f"s{k}": 0.0 for k in range(80)}), good, "more than 63")):
            with self.assertRaisesRegex(ordo.InputError, text):
                ordo.material(*args, **how)(lambda F, dF, dt, state, par: F)
        for speed, text in ((lambda par: par["E"], "E"), (lambda par: -1.0, "wave speed of -1"), (lambda par: np.nan, "wave speed of nan"),
                            (lambda par: "fast", "must return a number")):
            ordo.material("bad-speed", wave_speed=speed)(lambda F, dF, dt, state, par: F)
            with self.assertRaisesRegex((ordo.InputError, KeyError), text):
                ordo.Case.from_dict(block(material=[{"name": "rubber", "model": "bad-speed", "density": 1000.0}]))

    def test_bad_materials(self):
        good = {"name": "rubber", "model": "counter", "density": 1000.0, "parameters": {"c": 12.0}}
        for change, text in (({"young": 1e5}, "takes no elastic constants"), ({"parameters": {"c": "fast"}}, r"material\[0\].parameters.c: must be a number"),
                             ({"parameters": {"c": 1.0, "rho": 1.0}}, "rho: is the density"), ({"parameters": 3}, "must be a table"),
                             ({"model": "neo-hookean", "young": 1e5, "poisson": 0.3}, "parameters: are for laws that are added from outside"),
                             ({"model": "no-law"}, "no-law"), ({"branch_shear": [1.0], "branch_time": [1.0]}, "branches cannot be added")):
            with self.assertRaisesRegex(ordo.InputError, text):
                ordo.Case.from_dict(block(material=[{**good, **change}]))

    def test_an_unknown_law_may_be_one_of_python(self):
        with self.assertRaisesRegex(ordo.InputError, "model: must be one of .*; a law of Python must be made first, by ordo.material"):
            ordo.Case.from_dict(block(material=[{"name": "rubber", "model": "zener", "density": 1000.0}]))

    def test_a_later_law_takes_the_name(self):
        def make(pressure):
            @ordo.material("again", state={"a": 0.0} if pressure else {"b": 0.0, "c": 0.0}, wave_speed=lambda par: 12.0)
            def again(F, dF, dt, state, par):
                return np.broadcast_to(-pressure * EYE, F.shape)

            return ordo.Simulation(ordo.Case.from_dict(block(material=[{"name": "rubber", "model": "again", "density": 1000.0}])))

        first, second = make(1.0), make(0.0)
        for sim in (first, second):
            sim.step()
        self.assertEqual((first.particles.stress[0, 0, 0], second.particles.stress[0, 0, 0]), (-1.0, 0.0))
        self.assertEqual(list(second.particles.state), ["stress_work", "b", "c"])


if __name__ == "__main__":
    unittest.main()
