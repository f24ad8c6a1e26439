"""A run that is stopped or killed leaves only whole files behind.

The case could go on for ever: a disk that breathes about the middle of the grid.
"""

import random
import signal
import time

from harness import CASE, HANG, InTemporaryDirectory, contents, edit, frames, history, ordo, read_vtk, start

ENDLESS = edit(CASE, ("end = 0.01", "end = 1e6"), "velocity = '0.05*(x - 0.5)'\n[method]\npic_fraction = 0.01\n[output]\ngrid = true\n")
KILLS = 10


class Signals(InTemporaryDirectory):
    def start_run(self, interval):
        self.write("case.toml", ENDLESS)
        process = start("run", "case.toml", "--threads", 1, "--output", "out", "--overwrite", "--set", f"output.interval={interval}", cwd=self.dir)
        self.addCleanup(self.kill, process)
        return process

    def kill(self, process):
        process.kill()
        process.communicate(timeout=HANG)

    def wait_for(self, name):
        limit = time.monotonic() + HANG
        while not (self.dir / "out" / name).exists():
            self.assertLess(time.monotonic(), limit, f"{name} was never written")
            time.sleep(0.01)

    def assert_frames_whole(self):
        """Every frame that a PVD lists opens; history.csv ends with a whole line."""
        for kind in ("particles", "grid"):
            if (self.dir / "out" / f"{kind}.pvd").exists():
                for _, path in frames(self.dir / "out", kind):
                    read_vtk(path)
        rows = self.dir / "out" / "history.csv"
        if rows.exists():
            lines = rows.read_text().split("\n")
            self.assertEqual(lines[-1], "")
            self.assertEqual({line.count(",") for line in lines[:-1]}, {lines[0].count(",")})

    def assert_stops(self, name, code, interval):
        process = self.start_run(interval)
        self.wait_for("particles_000002.vtu")
        process.send_signal(name)
        _, err = process.communicate(timeout=HANG)
        self.assertEqual(process.returncode, code, err)
        self.assertIn(f"signal {int(name)}", err)
        self.assert_frames_whole()
        self.assertEqual(frames(self.dir / "out")[-1][0], history(self.dir / "out")["time"][-1])
        self.assertEqual(list(self.dir.glob("out/*.part")), [])

    def test_interrupt(self):
        self.assert_stops(signal.SIGINT, 130, interval=1.0)

    def test_terminate(self):
        self.assert_stops(signal.SIGTERM, 143, interval=1.0)

    def test_hangup(self):
        self.assert_stops(signal.SIGHUP, 129, interval=1.0)

    def test_hangup_under_nohup(self):
        before = signal.signal(signal.SIGHUP, signal.SIG_IGN)  # as nohup leaves it
        try:
            process = self.start_run(interval=1.0)
        finally:
            signal.signal(signal.SIGHUP, before)
        self.wait_for("particles_000002.vtu")
        process.send_signal(signal.SIGHUP)
        self.wait_for("particles_000004.vtu")
        process.terminate()
        process.communicate(timeout=HANG)
        self.assertEqual(process.returncode, 143)

    def test_stop_at_a_step_with_a_frame(self):
        self.assert_stops(signal.SIGTERM, 143, interval=0.001)
        times = [t for t, _ in frames(self.dir / "out")]
        self.assertEqual(times, sorted(set(times)), "a time stands twice")

    def test_kill(self):
        moments = random.Random(1)
        for k in range(KILLS):
            with self.subTest(kill=k):
                process = self.start_run(interval=0.002)
                time.sleep(moments.uniform(0.0, 0.3))
                self.kill(process)
                self.assert_frames_whole()

    def test_kill_while_the_earlier_run_is_removed(self):
        self.run_good(self.write("case.toml", CASE), "--output", "out")
        pvd = self.dir / "out" / "particles.pvd"
        text = pvd.read_text()
        entry = next(line for line in text.split("\n") if "000000.vtu" in line) + "\n"
        numbers = [f"{k:06}" for k in range(100, 5000)]
        pvd.write_text(text.replace(entry, entry + "".join(entry.replace("000000", n) for n in numbers)))
        names = [f"particles_{n}.vtu" for n in numbers]
        with (self.dir / "out" / "files.txt").open("a") as files:
            files.write("\n".join(names) + "\n")
        for name in names:
            self.write("out/" + name, "")
        process = self.start_run(interval=1.0)
        watched = [self.dir / "out" / name for name in names[::100]]
        while process.poll() is None and all(path.exists() for path in watched):
            pass
        self.assertFalse(all(path.exists() for path in watched))
        self.kill(process)
        missing = [path for _, path in frames(pvd.parent) if not path.exists()] if pvd.exists() else []
        self.assertEqual(len(missing), 0, "particles.pvd lists frames that are gone")

    def test_a_run_over_the_remains_of_a_killed_one(self):
        process = self.start_run(interval=0.002)
        self.wait_for("particles_000020.vtu")
        self.kill(process)
        (self.dir / "out" / "particles_000020.vtu.part").write_text("half a fr")
        for directory in ("out", "fresh"):
            done = ordo("run", "case.toml", "--set", "time.end=0.01", "--output", directory, "--overwrite", cwd=self.dir)
            self.assertEqual(done.returncode, 0, done.stderr)
        self.assertEqual(contents(self.dir / "out"), contents(self.dir / "fresh"))
