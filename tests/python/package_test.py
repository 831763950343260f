"""The package against the program: PROGRAM SOURCES are the arguments."""

import os
import sys
import tempfile
import unittest
from pathlib import Path

PROGRAM, SOURCES = sys.argv[1], Path(sys.argv[2])
sys.path.insert(0, str(SOURCES / "python/src"))
os.environ["KILOTWIN"] = PROGRAM

try:
    import numpy as np
    import pandas
except ImportError:
    print("numpy or pandas is not installed")
    sys.exit(77)

import kilotwin  # noqa: E402

EXPERIMENT = SOURCES / "experiments/disperse.txtpb"
RECORDED = """
duration_s: 4
arena { width_mm: 600 height_mm: 600 }
robots { count: 9 behaviour: "%s" layout { grid { pitch_mm: 50 } } }
recording { variable { name: "has_wave" every_s: 1 } event: LED event: MOTION }
observable { name: "reached" value: "share(has_wave == 1)" }
""" % (SOURCES / "behaviours/hop_count.c")


class Package(unittest.TestCase):
    def setUp(self):
        self.folder = tempfile.TemporaryDirectory()
        self.out = Path(self.folder.name)

    def tearDown(self):
        self.folder.cleanup()

    def test_a_run_and_its_tables(self):
        run = kilotwin.run(EXPERIMENT, seed=3, robots=16, duration_s=3, set={"motion.noise": False}, out=self.out / "run")
        self.assertEqual(run.summary["seed"], 3)
        poses = run.trajectories()
        self.assertEqual(poses["x_mm"].shape, (16 * 4,))
        self.assertEqual(poses.units["x_mm"], "mm")
        self.assertEqual(poses.about["state_hash"], run.summary["state_hash"])
        frame = poses.frame()
        self.assertEqual(list(frame.columns), list(poses))
        first = frame[frame.time_s == 0]
        self.assertEqual(len(first), 16)
        # The last row of the observables is what the poses give.
        last = frame[frame.time_s == frame.time_s.max()]
        over_time = run.over_time()
        at = np.argmin(np.abs(over_time["time_s"] - frame.time_s.max()))
        moved = (last.x_mm.values - first.x_mm.values) ** 2 + (last.y_mm.values - first.y_mm.values) ** 2
        self.assertAlmostEqual(over_time["msd_mm2"][at], moved.mean(), places=6)
        kilotwin.replay(run)
        self.assertEqual(kilotwin.load(self.out / "run").summary, run.summary)

    def test_variables_events_observables(self):
        (self.out / "e.txtpb").write_text(RECORDED)
        run = kilotwin.run(self.out / "e.txtpb", out=self.out / "run", strict=True)
        variables = run.variables().frame()
        reached = variables[variables.time_s == variables.time_s.max()].has_wave.mean()
        self.assertGreaterEqual(run.observables["reached"], reached)
        self.assertIn("led", set(run.events()["event"]))
        self.assertEqual(set(run.commands()["motion"]), {"stop"})

    def test_a_sweep(self):
        done = kilotwin.sweep(EXPERIMENT, out=self.out / "sweep", seeds="1..2", robots=9, duration_s=1,
                              set={"robots.layout.grid.pitch_mm": [40, 45]})
        table = done.table()
        self.assertEqual(len(table), 4)
        self.assertEqual(sorted(set(table["robots.layout.grid.pitch_mm"])), [40, 45])
        self.assertEqual(len(done.runs()), 4)
        self.assertEqual(len(done.table("sweep")), 2)

    def test_errors_are_exceptions(self):
        with self.assertRaisesRegex(kilotwin.KilotwinError, "cannot be read|no such|does not exist") as raised:
            kilotwin.run(self.out / "none.txtpb")
        self.assertEqual(raised.exception.status, 2)
        with self.assertRaises(FileNotFoundError):
            kilotwin.load(self.out)
        with self.assertRaisesRegex(KeyError, "no column"):
            kilotwin.run(EXPERIMENT, robots=4, duration_s=1, out=self.out / "r").trajectories()["z_mm"]


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1])
