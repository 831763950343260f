"""The package against the program: PROGRAM SOURCES are the arguments."""

import contextlib
import gc
import importlib.util
import os
import shutil
import socket
import subprocess
import sys
import tempfile
import threading
import time
import unittest
import warnings
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

# It blinks as the station says, and shows how the variables of the caller arrive.
OBEYS = """
#include <kilolib.h>
volatile uint8_t gain = 7;
volatile int8_t table[2] = {1, -2};
volatile float weight = 0.5f;
volatile uint8_t seen_at_setup, heard, mixed;
static void rx(message_t* m, distance_measurement_t* d) { (void)d; heard = m->type; set_color(m->data[0]); }
static void setup(void) { seen_at_setup = gain; }
static void loop(void) { mixed = table[0] + table[1] + (uint8_t)weight + gain; }
int main(void) { kilo_init(); kilo_message_rx = rx; kilo_start(setup, loop); return 0; }
"""
OBEYING = """
duration_s: 6 seed: 4
arena { width_mm: 500 height_mm: 500 }
robots { count: 5 behaviour: "obeys.c" layout { grid { pitch_mm: 60 } } }
"""


HUB = """
name: "hub" duration_s: 3 arena { width_mm: 600 height_mm: 600 }
robots { count: 4 behaviour: "%s" layout { grid { pitch_mm: 100 } } }
station { environment { hub { } } } recording { event: STATION event: STATE }
""" % (SOURCES / "behaviours/ark_hub.c")

ENDS_THE_RUN = """
#include <kilotwin_station.hpp>
#include <cstdlib>
struct Bad : KilobotExperiment {
  void initialise(bool) override {}
  void run() override { abort(); }
};
extern "C" KilobotExperiment* createExpt() { return new Bad; }
"""


@contextlib.contextmanager
def own_domain():
    """A DDS domain that no test beside this one takes: its first discovery port stays bound, as by a participant."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as port:
        for domain in range(60, 100):
            # The name is that of a run that has claimed the domain and has no participant yet.
            with contextlib.suppress(OSError), socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM) as claim:
                claim.bind(f"\0kilotwin-domain-{domain}")
                port.bind(("127.0.0.1", 7400 + 250 * domain + 10))
                break
        else:
            raise AssertionError("no domain is free")
        yield domain


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

    def test_the_stations_packets_and_logs_come_through_pandas(self):
        (self.out / "e.txtpb").write_text(HUB)
        run = kilotwin.run(self.out / "e.txtpb", out=self.out / "run")
        packets = run.events(kinds="station")
        self.assertEqual(list(packets), ["time_s", "event", "text"])
        octets = [bytes.fromhex(text.removeprefix("0x")) for text in packets["text"]]
        self.assertEqual({len(packet) for packet in octets}, {10})
        # CSV makes no numbers of them, not even of those without a letter.
        subprocess.run([PROGRAM, "export", run.directory, "--events", self.out / "e.csv"], check=True, capture_output=True)
        read = pandas.read_csv(self.out / "e.csv")
        self.assertEqual(list(read[read.event == "station"].text), list(packets["text"]))
        self.assertTrue(any(text[2:].isdigit() for text in packets["text"]), "no packet of digits alone")
        # Of one kind, whole numbers are whole.
        subprocess.run([PROGRAM, "export", run.directory, "--events", self.out / "l.csv", "--kind", "state"], check=True, capture_output=True)
        states = pandas.read_csv(self.out / "l.csv")
        self.assertEqual(list(states.columns), ["time_s", "event", "robot", "group", "state"])
        self.assertEqual(states.robot.dtype, np.int64)
        self.assertEqual(list(states.state), list(run.events(["state"])["state"]))
        logs = run.environment()
        self.assertEqual(set(logs["name"]), {"hub"})
        self.assertEqual(sorted(set(logs["robot"])), [0, 1, 2, 3])
        with self.assertRaisesRegex(kilotwin.KilotwinError, "there are led, motion"):
            run.events("leds")

    def test_a_sweep(self):
        done = kilotwin.sweep(EXPERIMENT, out=self.out / "sweep", seeds="1..2", robots=9, duration_s=1,
                              set={"robots.layout.grid.pitch_mm": [40, 45]})
        table = done.table()
        self.assertEqual(len(table), 4)
        self.assertEqual(sorted(set(table["robots.layout.grid.pitch_mm"])), [40, 45])
        self.assertEqual(len(done.runs()), 4)
        self.assertEqual(len(done.table("sweep")), 2)

    def test_a_sweep_is_read_from_any_folder(self):
        words = ["sweep", str(EXPERIMENT), "--robots", "4", "--duration", "1", "--out", "sweep"]
        subprocess.run([PROGRAM, *words], cwd=self.out, check=True, capture_output=True)
        self.assertEqual([run.summary["robots"] for run in kilotwin.Sweep(self.out / "sweep").runs()], [4])

    def test_a_sweep_of_failures_is_an_exception_and_runs_once(self):
        (self.out / "obeys.c").write_text(OBEYS)
        (self.out / "bad.cpp").write_text(ENDS_THE_RUN)
        plugin = 'station { environment { plugin { source: "bad.cpp" on_failure: END_RUN } } }'
        (self.out / "e.txtpb").write_text(OBEYING + plugin)
        with self.assertRaisesRegex(kilotwin.KilotwinError, "no run came to its end: .*bad.cpp failed"):
            kilotwin.sweep(self.out / "e.txtpb", out=self.out / "sweep", seeds="1..2")
        self.assertEqual(len(kilotwin.Sweep(self.out / "sweep").table()), 2)

    def test_a_strict_sweep_leaves_out_runs_with_failed_robots(self):
        (self.out / "obeys.c").write_text(OBEYS.replace("seen_at_setup = gain", "if (kilo_uid == 2) *(volatile int*)8 = 1"))
        (self.out / "e.txtpb").write_text(OBEYING)
        words = {"set": {"robots.count": [2, 4]}, "plot": "spread", "colour_by": "robots.count", "duration_s": 1}
        lenient = kilotwin.sweep(self.out / "e.txtpb", out=self.out / "lenient", **words)
        self.assertEqual(list(lenient.table().robots_failed), [0, 1])
        self.assertEqual(len(lenient.runs()), 2)
        strict = kilotwin.sweep(self.out / "e.txtpb", out=self.out / "strict", strict=True, **words)
        self.assertEqual(list(strict.table().well), [1, 0])
        self.assertEqual([run.summary["robots"] for run in strict.runs()], [2])
        if (self.out / "strict/sweep.svg").exists():
            self.assertIn("spread", (self.out / "strict/sweep.svg").read_text())

    def test_a_sweep_asks_slurm(self):
        # Slurm's commands, which note how they were called.
        tools = self.out / "tools"
        tools.mkdir()
        for name, text in [("squeue", "exit 0"), ("scancel", "exit 0"), ("sbatch", f'echo "$@" > {self.out}/asked; echo no; exit 1')]:
            (tools / name).write_text(f"#!/bin/sh\n{text}\n")
            (tools / name).chmod(0o755)
        before = os.environ["PATH"]
        os.environ["PATH"] = f"{tools}:{before}"
        try:
            with self.assertRaisesRegex(kilotwin.KilotwinError, "sbatch refused"):
                kilotwin.sweep(EXPERIMENT, out=self.out / "sweep", robots=4, duration_s=1, slurm=["--time=0:10:00", "--mem=1G"],
                               slurm_program="apptainer run k.sif")
        finally:
            os.environ["PATH"] = before
        asked = (self.out / "asked").read_text()
        self.assertIn("--time=0:10:00 --mem=1G", asked)
        self.assertTrue((self.out / "sweep/commands").read_text().startswith("apptainer run k.sif run "))

    def test_a_run_without_a_directory_says_where_it_is(self):
        before = os.getcwd()
        os.chdir(self.out)
        try:
            first = kilotwin.run(EXPERIMENT, robots=4, duration_s=1)
            second = kilotwin.run(EXPERIMENT, robots=4, duration_s=1)
        finally:
            os.chdir(before)
        self.assertNotEqual(first.directory, second.directory)
        for run in (first, second):
            self.assertTrue((self.out / run.directory / "report.html").exists())

    def test_errors_are_exceptions(self):
        with self.assertRaisesRegex(kilotwin.KilotwinError, "cannot be read|no such|does not exist") as raised:
            kilotwin.run(self.out / "none.txtpb")
        self.assertEqual(raised.exception.status, 2)
        with self.assertRaises(FileNotFoundError):
            kilotwin.load(self.out)
        with self.assertRaisesRegex(KeyError, "no column"):
            kilotwin.run(EXPERIMENT, robots=4, duration_s=1, out=self.out / "r").trajectories()["z_mm"]

    def test_an_arena_has_the_results_of_a_run(self):
        options = {"robots": 16, "duration_s": 3}
        runs = [kilotwin.run(EXPERIMENT, seed=seed, out=self.out / f"run{seed}", **options) for seed in (5, 6, 7)]
        hashes = [int(run.summary["state_hash"], 16) for run in runs]
        with kilotwin.Arenas(EXPERIMENT, 3, seed=5, threads=2, **options) as arenas:
            self.assertEqual(arenas.x_mm.shape, (3, 16))
            begun = arenas.observe()
            while not arenas.ended.all():
                arenas.step(7)
            self.assertEqual(list(arenas.state_hash), hashes)
            self.assertEqual(list(arenas.tick), [arenas.last_tick] * 3)
            poses = runs[1].trajectories()
            last = poses["time_s"] == poses["time_s"].max()
            np.testing.assert_allclose(arenas.x_mm[1], poses["x_mm"][last], atol=1e-3)
            self.assertEqual(arenas.sent[2], runs[2].summary["messages"]["sent"])
            # Beyond the end nothing happens; what was observed stays as it was.
            arenas.step(seconds=2)
            self.assertEqual(list(arenas.state_hash), hashes)
            self.assertFalse(np.array_equal(begun["x_mm"], arenas.x_mm))
            arenas.reset()
            for name, array in begun.items():
                np.testing.assert_array_equal(array, arenas.observe()[name], name)
            # An arena of another seed is the other arena.
            arenas.reset(seeds=[6], arenas=[0])
            self.assertEqual(arenas.seeds, (6, 6, 7))
            arenas.step(10**6)
            self.assertEqual(list(arenas.state_hash), [hashes[1], hashes[1], hashes[2]])
        with self.assertRaisesRegex(kilotwin.KilotwinError, "closed"):
            arenas.step()

    def test_a_caller_sends_messages_and_sets_variables(self):
        (self.out / "obeys.c").write_text(OBEYS)
        (self.out / "e.txtpb").write_text(OBEYING)
        names = ["gain", "table", "weight", "seen_at_setup", "heard"]
        with kilotwin.Arena(self.out / "e.txtpb", variables=names) as arena:
            self.assertEqual(arena.variables, ("gain", "table[0]", "table[1]", "weight", "seen_at_setup", "heard"))
            self.assertEqual(arena.x_mm.shape, (5,))
            np.testing.assert_array_equal(arena.variable("gain"), 7)
            np.testing.assert_array_equal(arena.variable("table[1]"), -2)
            # Before the first step: what the program begins with.
            arena.set_variable("gain", [10, 11, 12, np.nan, 255])
            arena.step(seconds=4)
            np.testing.assert_array_equal(arena.variable("seen_at_setup"), [10, 11, 12, 7, 255])
            arena.set_variable("table[1]", -128)
            arena.set_variable("weight", np.linspace(0, 1, 5))
            np.testing.assert_array_equal(arena.variable("table[1]"), -128)
            np.testing.assert_allclose(arena.variable("weight"), np.linspace(0, 1, 5), rtol=1e-7)
            np.testing.assert_array_equal(arena.variable("table[0]"), 1)
            for name, value in [("gain", 256), ("gain", -1), ("gain", 0.5), ("table[0]", 128), ("gain", np.inf)]:
                with self.assertRaisesRegex(kilotwin.KilotwinError, "cannot hold"):
                    arena.set_variable(name, value)
            # A value that one robot refuses changes no robot.
            with self.assertRaisesRegex(kilotwin.KilotwinError, "robot 4: gain cannot hold 256"):
                arena.set_variable("gain", [1, 2, 3, 4, 256])
            arena.step(1)
            np.testing.assert_array_equal(arena.variable("gain"), [10, 11, 12, 7, 255])
            with self.assertRaisesRegex(KeyError, "there are: gain"):
                arena.variable("gains")
            # Robots that hear the station show it, from the next ticks on.
            arena.send(9, [0b11])
            arena.step(seconds=0.2)
            np.testing.assert_array_equal(arena.variable("heard"), 9)
            np.testing.assert_array_equal(arena.led, [[3, 0, 0]] * 5)
            self.assertEqual(arena.robots_failed, 0)
            self.assertEqual(arena.failures(), [])
            with self.assertRaisesRegex(kilotwin.KilotwinError, "no octet"):
                arena.send(256)

    def test_a_robot_that_crashes_costs_the_robot(self):
        (self.out / "obeys.c").write_text(OBEYS.replace("seen_at_setup = gain", "if (kilo_uid == 2) *(volatile int*)8 = 1"))
        (self.out / "e.txtpb").write_text(OBEYING)
        with kilotwin.Arena(self.out / "e.txtpb", variables=["gain"]) as arena:
            arena.step(10**6)
            self.assertEqual(arena.robots_failed, 1)
            self.assertEqual([failure["robot"] for failure in arena.failures()], [2])
            self.assertTrue(np.isnan(arena.variable("gain")[2]))
            with self.assertRaisesRegex(kilotwin.KilotwinError, "robot 2 has no variable"):
                arena.set_variable("gain", 1)

    def test_an_arena_and_a_run_with_the_same_requests_have_the_same_hash(self):
        domain = self.enterContext(own_domain())
        options = ["--robots", "12", "--duration", "600", "--seed", "3"]
        words = ["run", str(EXPERIMENT), *options, "--pace", "1", "--partitions", "2x1", "--quiet", "--domain", str(domain)]
        run = subprocess.Popen([PROGRAM, *words, "--out", str(self.out / "run")])
        try:
            with kilotwin.join(domain, patience_s=30) as live:
                self.assertEqual(live.robots, 12)
                paused_at = live.pause()["tick"]
                live.place(3, x_mm=-400, y_mm=390, heading_rad=7.0)
                with self.assertRaisesRegex(kilotwin.KilotwinError, "no whole number"):
                    live.place(-1, 0, 0)
                ended_at = live.step(60)["tick"]
                self.assertEqual(ended_at, paused_at + 60)
                self.assertEqual(live.state()["x_mm"].shape, (12,))
                # The state of a paused run is never older than the answer before it.
                for _ in range(5):
                    ended_at = live.step(3)["tick"]
                    self.assertEqual(live.state()["tick"], ended_at)
                self.assertGreaterEqual(live.checkpoint()["saved_tick"], ended_at)
                self.assertEqual(live.stop()["phase"], "ended")
            self.assertEqual(run.wait(30), 0)
        finally:
            run.kill()
            run.wait()
        summary = kilotwin.load(self.out / "run").summary
        with kilotwin.Arena(EXPERIMENT, robots=12, duration_s=600, seed=3) as arena:
            arena.step(paused_at)
            arena.place(3, x_mm=-400, y_mm=390, heading_rad=7.0)
            arena.step(1)
            self.assertAlmostEqual(arena.x_mm[3], -400, delta=1)
            arena.step(summary["ticks"] - paused_at - 1)
            self.assertEqual(f"{int(arena.state_hash):016x}", summary["state_hash"])
            with self.assertRaisesRegex(kilotwin.KilotwinError, "not within the arena"):
                arena.place(3, 1e6, 0)
        with kilotwin.Arena(EXPERIMENT, robots=12, duration_s=600, seed=3) as undisturbed:
            undisturbed.step(summary["ticks"])
            self.assertNotEqual(f"{int(undisturbed.state_hash):016x}", summary["state_hash"])
        with self.assertRaisesRegex(kilotwin.KilotwinError, "no run on domain"):
            kilotwin.join(domain, patience_s=0.5)

    def test_a_run_is_joined_from_another_thread(self):
        # The run ends when this thread stops it: so run() lets other threads go on meanwhile.
        domain = self.enterContext(own_domain())
        done = []
        options = {"robots": 4, "duration_s": 120, "mode": "federated", "domain": domain, "pace": 1}
        runner = threading.Thread(target=lambda: done.append(kilotwin.run(EXPERIMENT, out=self.out / "run", **options)))
        runner.start()
        try:
            with kilotwin.join(domain, patience_s=60) as live:
                self.assertEqual(live.robots, 4)
                self.assertEqual(done, [])
                stopped_at = live.stop()["tick"]
        finally:
            runner.join()
        self.assertEqual(done[0].summary["ticks"], stopped_at)
        with self.assertRaisesRegex(ValueError, "local run has no DDS domain"):
            kilotwin.run(EXPERIMENT, domain=domain)

    def test_a_step_keeps_no_other_thread_waiting(self):
        counted, counting, end = [0], threading.Event(), threading.Event()

        def count():
            while not end.is_set():
                counted[0] += 1
                counting.set()
                time.sleep(0)

        # So long, no thread is made to give way: the other one counts only while a call lets go of the interpreter.
        interval = sys.getswitchinterval()
        counter = threading.Thread(target=count)
        with kilotwin.Arena(EXPERIMENT, robots=4, duration_s=1e6) as arena:
            counter.start()
            counting.wait()
            sys.setswitchinterval(1000)
            try:
                before = counted[0]
                until = time.monotonic() + 60  # only a call that never lets go of the interpreter takes so long
                while counted[0] == before and not arena.ended and time.monotonic() < until:
                    arena.step(1000)
                after = counted[0]
            finally:
                sys.setswitchinterval(interval)
                end.set()
                counter.join()
            self.assertGreater(after, before)

    def test_batteries_are_recorded_as_voltages(self):
        # 3.6 mA of 0.1 mAh: 1 % of the charge each second. From 0.4 to 0.2, the open-circuit voltage falls from 3.78 to 3.70 V.
        (self.out / "obeys.c").write_text(OBEYS.replace("*(volatile int*)8 = 1", ""))
        text = """
            duration_s: 21 arena { width_mm: 600 height_mm: 600 }
            battery { capacity_mAh: 0.1 charge: 0.4 charge_sd: 0 idle_mA: 3.6 resistance_ohm: 10 }
            robots { count: 2 behaviour: "obeys.c" layout { grid { pitch_mm: 50 } } }
            recording { every_s: 1 variable { name: "battery_V" every_s: 1 } }
            observable { name: "volts" value: "mean(battery_V)" }
            """
        (self.out / "e.txtpb").write_text(text)
        local = kilotwin.run(self.out / "e.txtpb", out=self.out / "local")
        volts = local.variables()
        self.assertEqual(volts.units["battery_V"], "V")
        driven = (volts["time_s"] > 0) & (volts["time_s"] < 20)
        expected = 3.70 + 0.08 * (0.2 - 0.01 * volts["time_s"]) / 0.2 - 10 * 0.0036
        np.testing.assert_allclose(volts["battery_V"][driven], expected[driven], atol=2e-3)
        self.assertAlmostEqual(local.summary["observables"]["volts"], volts["battery_V"][-1], places=6)
        federated = kilotwin.run(self.out / "e.txtpb", mode="federated", out=self.out / "federated")
        np.testing.assert_array_equal(federated.variables()["battery_V"], volts["battery_V"])
        # States are recorded at the same ticks here.
        for run in [local, federated]:
            poses = run.trajectories()
            self.assertEqual(poses.units["battery_V"], "V")
            known = np.isfinite(poses["battery_V"])
            self.assertGreater(known.sum(), 30)
            pairs = [dict(zip(zip(table["time_s"], table["robot"]), table["battery_V"])) for table in (poses, volts)]
            for key, value in pairs[1].items():
                self.assertEqual(pairs[0].get(key, value), value)
        # A caller's arena shows them too, also those of robots that run firmware.
        for avr in ["", " avr: true"] if shutil.which("avr-gcc") else [""]:
            (self.out / "arena.txtpb").write_text(text.replace("count: 2", "count: 2" + avr))
            with kilotwin.Arena(self.out / "arena.txtpb", variables=["battery_V"]) as arena:
                arena.step(seconds=10)
                np.testing.assert_allclose(arena.variable("battery_V"), 3.70 + 0.08 * 0.1 / 0.2 - 0.036, atol=5e-3)
        (self.out / "wrong.txtpb").write_text(text.replace('"battery_V" every', '"battery" every'))
        with self.assertRaisesRegex(kilotwin.KilotwinError, "is battery_V"):
            kilotwin.run(self.out / "wrong.txtpb", out=self.out / "wrong")

    def test_trajectories_name_robots_that_failed(self):
        (self.out / "obeys.c").write_text(OBEYS.replace("seen_at_setup = gain", "if (kilo_uid == 2) *(volatile int*)8 = 1"))
        (self.out / "e.txtpb").write_text(OBEYING)
        table = kilotwin.run(self.out / "e.txtpb", out=self.out / "run").trajectories()
        late = table["time_s"] > 2
        np.testing.assert_array_equal(table["failed"][late], table["robot"][late] == 2)

    def test_sweeps_are_coloured_by_a_field_or_by_group(self):
        words = ["sweep", str(EXPERIMENT), "--duration", "2", "--set", "robots.count=log:2..18:3", "--set", "motion.noise=true,false"]
        for colour, names in [("motion.noise", ["true", "false"]), ("group", ["MSD"])]:
            out = self.out / colour
            subprocess.run([PROGRAM, *words, "--colour-by", colour, "--out", str(out)], check=True, capture_output=True)
            if not (out / "response.svg").exists():
                self.skipTest("gnuplot is not installed")
            for plot in ["sweep.svg", "response.svg"]:
                text = (out / plot).read_text()
                for name in names:
                    self.assertIn(name, text)
            # The numbers of a logarithmic axis over 2 to 18 are 10; those of a linear one are 5, 10, 15.
            self.assertNotIn(">15<", (out / "response.svg").read_text().replace(" ", ""))
        refused = subprocess.run([PROGRAM, *words, "--colour-by", "nothing", "--out", str(self.out / "no")], capture_output=True, text=True)
        self.assertEqual(refused.returncode, 2)
        self.assertIn("is not swept", refused.stderr)
        self.assertFalse((self.out / "no").exists())

    def test_it_installs_without_a_network(self):
        if importlib.util.find_spec("ensurepip") is None or any(importlib.util.find_spec(name) is None for name in ("setuptools", "wheel")):
            self.skipTest("python3-venv, python3-setuptools or python3-wheel is not installed")
        # A build leaves files beside its sources.
        shutil.copytree(SOURCES / "python", self.out / "python")
        subprocess.run([sys.executable, "-m", "venv", "--system-site-packages", self.out / "venv"], check=True)
        python = self.out / "venv/bin/python"
        words = ["-m", "pip", "install", "--quiet", "--no-index", "--no-build-isolation", self.out / "python"]
        subprocess.run([python, *words], check=True)
        seen = subprocess.check_output([python, "-c", "import kilotwin; print(kilotwin.__file__, kilotwin.program())"], text=True)
        self.assertEqual(seen.split()[1], PROGRAM)
        self.assertTrue(seen.startswith(str(self.out / "venv")), seen)

    def test_errors_of_arenas_are_exceptions(self):
        with self.assertRaisesRegex(kilotwin.KilotwinError, "none.txtpb") as raised:
            kilotwin.Arena(self.out / "none.txtpb")
        self.assertEqual(raised.exception.status, 2)
        with self.assertRaisesRegex(kilotwin.KilotwinError, "no program has a global or static variable"):
            kilotwin.Arena(EXPERIMENT, variables=["nothing"])
        with kilotwin.Arenas(EXPERIMENT, 2, robots=4) as arenas:
            with self.assertRaises(ValueError):
                arenas.reset(seeds=[1, 2, 3])
            with self.assertRaisesRegex(kilotwin.KilotwinError, "no arena 2"):
                arenas.reset(seeds=[1], arenas=[2])
            with self.assertRaises(ValueError):
                arenas.x_mm[0, 0] = 1


if __name__ == "__main__":
    # An arena that is left open is reported when it is collected, where no test can catch it.
    left_open = []
    sys.unraisablehook = left_open.append
    warnings.simplefilter("error", ResourceWarning)
    done = unittest.main(argv=sys.argv[:1], exit=False, warnings="")
    gc.collect()
    for report in left_open:
        print(f"left open: {report.exc_value} in {report.object!r}", file=sys.stderr)
    sys.exit(not done.result.wasSuccessful() or bool(left_open))
