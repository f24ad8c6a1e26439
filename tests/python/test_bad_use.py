"""A hundred bad uses of the module: an exception each, never a crash, and afterwards everything still works."""

import os
import unittest

import numpy as np
import ordo
from support import BLOCK, TWO_DISKS, InTemporaryDirectory, block

NAN, INF = float("nan"), float("inf")


def fresh(**changes):
    return ordo.Simulation(ordo.Case.from_dict(block(**changes)), threads=2)


def closed():
    sim = fresh()
    sim.close()
    return sim


def failed():
    sim = fresh()
    sim.body_force(lambda x, X, t: 1 / 0)
    try:
        sim.step()
    except ZeroDivisionError:
        pass
    return sim


def with_callback(kind, f):
    sim = fresh()
    getattr(sim, kind)(f)
    sim.run()


def set_in_step(use):
    """`use` within a callback of a step."""
    sim = fresh()

    def inside(x, X, t):
        use(sim)
        return 0 * x

    sim.body_force(inside)
    sim.step()


def stale(use):
    sim = fresh()
    view = sim.particles.v
    sim.step()
    use(view)


def law(answer, **state):
    ordo.material("bad", state=state, wave_speed=lambda par: 12.0)(answer)
    fresh(material=[{"name": "rubber", "model": "bad", "density": 1000.0}]).run()


def fork(use):
    """The exception of `use` in a forked process."""
    read, write = os.pipe()
    child = os.fork()
    if child == 0:
        answer = b"nothing raised"
        try:
            use()
        except Exception as e:
            answer = repr(e).encode()
        finally:
            os.write(write, answer[:200])
            os._exit(0)
    os.close(write)
    with os.fdopen(read) as pipe:
        answer = pipe.read()
    _, status = os.waitpid(child, 0)
    if os.waitstatus_to_exitcode(status) != 0:
        raise AssertionError(f"the forked process died: {status}")
    if answer == "nothing raised":
        return
    raise RuntimeError(answer)


def bad_uses(here):
    """(what, call) of each."""
    sim = fresh()
    sim.step()
    p = sim.particles
    case = BLOCK

    def assign(name, value, at=...):
        def do():
            getattr(sim.particles, name)[at] = value

        return do

    uses = {
        # cases
        "no file": lambda: ordo.Case("nothing.toml"), "a folder": lambda: ordo.Case(here), "a number as file": lambda: ordo.Case(3),
        "None as file": lambda: ordo.Case(None), "bytes": lambda: ordo.Case(b"x"), "a dict as file": lambda: ordo.Case(case),
        "no arguments": lambda: ordo.Case(), "overrides in a list": lambda: ordo.Case(TWO_DISKS, ["a=1"]),
        "overrides with numbers as keys": lambda: ordo.Case(TWO_DISKS, {1: 2}),
        "an unknown key": lambda: ordo.Case(TWO_DISKS, {"grid.foo": 1}),
        "an unknown preset": lambda: ordo.Case(TWO_DISKS, {"method.preset": "cplss"}),
        "a step below zero": lambda: ordo.Case(TWO_DISKS, {"time.dt": -1}),
        "NaN": lambda: ordo.Case(TWO_DISKS, {"time.dt": NAN}), "inf": lambda: ordo.Case(TWO_DISKS, {"time.end": INF}),
        "an object as value": lambda: ordo.Case(TWO_DISKS, {"time.dt": object()}),
        "None as value": lambda: ordo.Case(TWO_DISKS, {"time.dt": None}),
        "a complex value": lambda: ordo.Case(TWO_DISKS, {"time.dt": 1j}), "a key with =": lambda: ordo.Case(TWO_DISKS, {"time=dt": 1}),
        "a long key": lambda: ordo.Case(TWO_DISKS, {".".join("a" * 40): 1}), "an empty key": lambda: ordo.Case(TWO_DISKS, {"": 1}),
        "a list as dict": lambda: ordo.Case.from_dict([1]), "an empty dict": lambda: ordo.Case.from_dict({}),
        "None as dict": lambda: ordo.Case.from_dict(None), "numbers as keys": lambda: ordo.Case.from_dict({1: 2}),
        "numbers as inner keys": lambda: ordo.Case.from_dict({"grid": {1: 2}}),
        "a set": lambda: ordo.Case.from_dict(block(grid__size={1.0})),
        "a string as grid": lambda: ordo.Case.from_dict(block(grid="x")),
        "a table as list": lambda: ordo.Case.from_dict(block(material={"name": "a"})),
        "a body of no material": lambda: ordo.Case.from_dict(block(body__material="iron")),
        "a bad formula": lambda: fresh(body__velocity=["1+", "0"]),
        "a body outside": lambda: fresh(body__upper=[3.0, 0.75]), "no shape": lambda: fresh(body__shape="cat"),
        "a nul": lambda: ordo.Case.from_dict(block(title="a\0b", grid="\0")), "circular": lambda: ordo.Case.from_dict(_circle()),
        "too deep": lambda: ordo.Case.from_dict(_deep()), "huge grid": lambda: fresh(grid__spacing=[1e-9, 1e-9]),
        # simulations
        "no case": lambda: ordo.Simulation(None), "a dict as case": lambda: ordo.Simulation(case),
        "no threads": lambda: ordo.Simulation(TWO_DISKS, threads=0),
        "half a thread": lambda: ordo.Simulation(TWO_DISKS, threads=0.5),
        "threads in words": lambda: ordo.Simulation(TWO_DISKS, threads="two"),
        "a million threads": lambda: ordo.Simulation(TWO_DISKS, threads=10**6),
        "threads beyond C": lambda: ordo.Simulation(TWO_DISKS, threads=10**30),
        "True threads": lambda: ordo.Simulation(TWO_DISKS, threads=True), "the core of nothing": lambda: ordo._core.Simulation(None, 1),
        "step of zero": lambda: sim.step(0), "step below zero": lambda: sim.step(-1e-3), "step NaN": lambda: sim.step(NAN),
        "step inf": lambda: sim.step(INF),
        "step in words": lambda: sim.step("long"), "step of an array": lambda: sim.step(np.ones(3)),
        "until the past": lambda: sim.run(until=-1),
        "until NaN": lambda: sim.run(until=NAN), "until inf": lambda: sim.run(until=INF), "until in words": lambda: sim.run(until="noon"),
        "output to a file": lambda: sim.run(output=__file__), "output to a number": lambda: sim.run(output=3),
        "output nowhere": lambda: sim.run(output="/proc/x/y"),
        "output to nothing": lambda: sim.run(output=""),
        "output over results": lambda: (fresh().run(output=here / "r"), fresh().run(output=here / "r")),
        "set t": lambda: setattr(sim, "t", 3), "set particles": lambda: setattr(sim, "particles", 3),
        "an unknown field": lambda: sim.field("velosity"),
        "a field by number": lambda: sim.field(3), "save nowhere": lambda: sim.save("/proc/no/where.h5"),
        "save a number": lambda: sim.save(3),
        "save to a folder": lambda: sim.save(here), "write nowhere": lambda: sim.write("/proc/no/where"),
        "restore nothing": lambda: ordo.Simulation.restore(here / "no.h5"),
        "restore a folder": lambda: ordo.Simulation.restore(here), "restore another file": lambda: ordo.Simulation.restore(__file__),
        "restore another case": lambda: (sim.save(here / "s.h5"), ordo.Simulation.restore(here / "s.h5", TWO_DISKS)),
        "restore half": lambda: _restore_half(sim, here), "closed: step": lambda: closed().step(), "closed: run": lambda: closed().run(),
        "closed: particles": lambda: closed().particles, "closed: t": lambda: closed().t,
        "closed: save": lambda: closed().save(here / "c.h5"),
        "closed: on_step": lambda: closed().on_step(print), "failed: step": lambda: failed().step(), "failed: run": lambda: failed().run(),
        "failed: save": lambda: failed().save(here / "f.h5"),
        # views
        "wrong shape of v": assign("v", np.ones((3, 7))), "words in v": assign("v", "fast"), "an object in x": assign("x", object()),
        "complex v": assign("v", 1j), "beyond the last": assign("v", 0, 10**9), "a third axis": lambda: p.v[0, 0, 0],
        "F is read-only": assign("F", 0.0),
        "id is read-only": assign("id", 0), "mass is read-only": assign("mass", 0.0), "V by ufunc": lambda: np.add(p.V, 1, out=p.V),
        "no such field": lambda: p.colour, "set no such field": lambda: setattr(p, "colour", 1), "delete x": lambda: delattr(p, "x"),
        "resize": lambda: p.v.resize((1, 1), refcheck=False), "no such state": lambda: p.state["plastic_strain"],
        "make writable": lambda: p.mass.setflags(write=True),
        "NaN in v": lambda: (assign("v", NAN, 0)(), sim.step()), "NaN in x": lambda: (assign("x", NAN, 0)(), sim.step()),
        "x outside": lambda: (assign("x", 1e30, 0)(), sim.step()), "huge v": lambda: _run_with(assign="v", value=1e300),
        "stress without symmetry": lambda: _run_with(assign="stress", value=np.array([[0, 1.0], [0, 0]])),
        "NaN in stress": lambda: _run_with(assign="stress", value=NAN),
        "stale sum": lambda: stale(np.sum), "stale in place": lambda: stale(lambda a: a.__imul__(2)),
        "stale sort": lambda: stale(lambda a: a.sort()),
        "stale out": lambda: stale(lambda a: np.copyto(a, 0)), "stale buffer method": lambda: stale(lambda a: a.tobytes()),
        "stale fill": lambda: stale(lambda a: a.fill(0)),
        # callbacks
        "body force in words": lambda: sim.body_force("down"), "on_step a number": lambda: sim.on_step(3),
        "on_nodes a list": lambda: sim.on_nodes([]),
        "body force of nothing": lambda: with_callback("body_force", lambda x, X, t: None),
        "body force too short": lambda: with_callback("body_force", lambda x, X, t: x[:3]),
        "body force NaN": lambda: with_callback("body_force", lambda x, X, t: NAN * x),
        "body force of words": lambda: with_callback("body_force", lambda x, X, t: x.astype(str)),
        "body force with one argument": lambda: with_callback("body_force", lambda x: x),
        "body force raises": lambda: with_callback("body_force", lambda *a: 1 / 0),
        "body force exits": lambda: _exits(), "on_step raises": lambda: with_callback("on_step", lambda s: 1 / 0),
        "on_step steps": lambda: with_callback("on_step", lambda s: s.step()),
        "on_step runs": lambda: with_callback("on_step", lambda s: s.run()),
        "on_step moves out": lambda: with_callback("on_step", lambda s: s.particles.x.__iadd__(99)),
        "on_step closes": lambda: with_callback("on_step", _close_and_use),
        "on_nodes raises": lambda: with_callback("on_nodes", lambda n: 1 / 0),
        "on_nodes NaN": lambda: with_callback("on_nodes", lambda n: n.force.fill(NAN)),
        "on_nodes of another shape": lambda: with_callback("on_nodes", lambda n: setattr(n, "force", np.ones(3))),
        "on_nodes of words": lambda: with_callback("on_nodes", lambda n: setattr(n, "momentum", "x")),
        "on_nodes without force": lambda: with_callback("on_nodes", lambda n: delattr(n, "force")),
        "step in a step": lambda: set_in_step(lambda s: s.step()), "particles in a step": lambda: set_in_step(lambda s: s.particles.x),
        "save in a step": lambda: set_in_step(lambda s: s.save(here / "x.h5")),
        "callback in a step": lambda: set_in_step(lambda s: s.body_force(None)),
        "run in a step": lambda: set_in_step(lambda s: s.run()), "history in a step": lambda: set_in_step(lambda s: s.history),
        # laws
        "law of nothing": lambda: law(lambda *a: None), "law of one tensor": lambda: law(lambda F, *a: F[0]),
        "law with NaN": lambda: law(lambda F, *a: NAN * F),
        "law with words": lambda: law(lambda F, *a: F.astype(str)), "law that raises": lambda: law(lambda *a: 1 / 0),
        "law of one argument": lambda: law(lambda F: F),
        "law without symmetry": lambda: law(lambda F, *a: F + [[0, 1, 0], [0, 0, 0], [0, 0, 0]]),
        "law that drops state": lambda: law(lambda F, dF, dt, s, p: (s.clear(), 0 * F)[1], a=0.0),
        "law with long state": lambda: law(lambda F, dF, dt, s, p: (s.update(a=np.ones(3)), 0 * F)[1], a=0.0),
        "law with NaN in state": lambda: law(lambda F, dF, dt, s, p: (s["a"].fill(NAN), 0 * F)[1], a=0.0),
        "law with new state": lambda: law(lambda F, dF, dt, s, p: (s.update(b=1), 0 * F)[1], a=0.0),
        "law called j2": lambda: ordo.material("j2", wave_speed=abs)(abs),
        "law without a name": lambda: ordo.material("", wave_speed=abs), "law without speed": lambda: ordo.material("x"),
        "law that is no function": lambda: ordo.material("x", wave_speed=abs)(3),
        # verification and tables
        "verify nothing": lambda: ordo.verify("nothing"), "verify a number": lambda: ordo.verify(3),
        "verify with no method": lambda: ordo.verify("ring", methods=["x"]),
        "verify backwards": lambda: ordo.verify("ring", cells=[20, 10]), "verify half a cell": lambda: ordo.verify("ring", cells=[0.5]),
        "verify no cell": lambda: ordo.verify("ring", cells=[0]),
        "verify a parameter": lambda: ordo.verify("ring", cells=[10], colour=3),
        "verify methods in a string": lambda: ordo.verify("ring", methods="cpdi1"),
        "verify on no thread": lambda: ordo.verify("ring", cells=[10], threads=0),
        "history of nothing": lambda: ordo.history(here / "none"), "history of a text": lambda: ordo.history(__file__),
        # forks
        "fork: step": lambda: fork(sim.step), "fork: particles": lambda: fork(lambda: sim.particles.x),
        "fork: save": lambda: fork(lambda: sim.save(here / "k.h5")),
        "fork: on_step": lambda: fork(lambda: sim.on_step(None)),
    }
    return list(uses.items())


def _circle():
    a = []
    a.append(a)
    return {"grid": a}


def _deep():
    a = 1
    for _ in range(100_000):
        a = [a]
    return {"grid": a}


def _restore_half(sim, here):
    sim.save(here / "whole.h5")
    (here / "half.h5").write_bytes((here / "whole.h5").read_bytes()[:3000])
    ordo.Simulation.restore(here / "half.h5")


def _run_with(assign, value):
    sim = fresh()
    getattr(sim.particles, assign)[0] = value
    sim.run()


def _exits():
    def leave(*_):
        raise SystemExit(3)

    try:
        with_callback("body_force", leave)
    except SystemExit as e:
        raise RuntimeError(str(e)) from None


def _close_and_use(sim):
    sim.close()
    sim.particles.x


class BadUses(InTemporaryDirectory):
    def test_each_raises_and_nothing_breaks(self):
        uses = bad_uses(self.dir)
        self.assertGreater(len(uses), 100)
        for what, use in uses:
            with self.subTest(what), self.assertRaises(Exception) as caught:
                use()
            error = caught.exception
            self.assertNotIsInstance(error, (SystemError, AssertionError, MemoryError), f"{what}: {error!r}")
            self.assertGreater(len(str(error)), 0, f"{what}: {error!r}")
        sim = fresh()
        sim.run()
        other = fresh()
        other.run()
        self.assertTrue(np.array_equal(sim.particles.x, other.particles.x))


if __name__ == "__main__":
    unittest.main()
