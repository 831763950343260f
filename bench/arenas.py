#!/usr/bin/env python3
"""What stepping arenas from Python costs, beside `kilotwin run`.

Usage: bench/arenas.py [-w] [-n ROUNDS] [-k BUILD]     default: 3 rounds, build/release
  -w  write the table to docs/results/arenas.md
Rounds alternate between the conditions that are compared; the table gives medians. Needs NumPy.
"""

import os
import statistics
import subprocess
import sys
import tempfile
import time
from pathlib import Path

root = Path(__file__).resolve().parent.parent
words = sys.argv[1:]
rounds = int(words[words.index("-n") + 1]) if "-n" in words else 3
build = root / (words[words.index("-k") + 1] if "-k" in words else "build/release")
sys.path.insert(0, str(root / "python/src"))
os.environ["KILOTWIN"] = str(build / "kilotwin")

import kilotwin  # noqa: E402

EXPERIMENT = root / "experiments/disperse.txtpb"
BATCH = 8
header = subprocess.check_output(
    [root / "scripts/results-header", "Arenas stepped from Python", " ".join(["bench/arenas.py", *words])], text=True
)


def run_us(robots: int, ticks: int) -> float:
    """us per tick of a local run that writes its recording."""
    with tempfile.TemporaryDirectory() as out:
        summary = kilotwin.run(EXPERIMENT, robots=robots, duration_s=ticks * 0.032768, out=Path(out) / "run").summary
    return 1e6 * summary["wall_s"] / summary["ticks"]


def stepped_us(arenas: kilotwin.Arenas, at_once: int) -> float:
    """us per tick and arena, with `at_once` ticks per request."""
    arenas.reset()
    began = time.perf_counter()
    while not arenas.ended.all():
        arenas.step(at_once)
    return 1e6 * (time.perf_counter() - began) / (arenas.last_tick * arenas.count)


def reset_ms(arenas: kilotwin.Arenas) -> float:
    """ms per arena that begins anew with another seed."""
    times = []
    for first in range(100, 105):
        began = time.perf_counter()
        arenas.reset(seeds=range(first, first + arenas.count))
        times.append(1e3 * (time.perf_counter() - began) / arenas.count)
    arenas.reset(seeds=range(1, arenas.count + 1))
    return statistics.median(times)


lines = [
    f"`experiments/disperse.txtpb`, other numbers of robots, threads as there are cores. Times per arena and tick; with {BATCH}",
    "arenas the cores share them, so a time is the wall time divided by their number.",
    "",
    f"| robots | `kilotwin run`, µs | an arena, a tick per request, µs | 30 ticks per request, µs | {BATCH} arenas, a tick per request, µs "
    f"| arena steps per second, {BATCH} arenas | reset with another seed, ms |",
    "|---|---|---|---|---|---|---|",
]
for robots in (20, 100, 1000):
    ticks = 60000 // max(robots, 30)
    duration_s = ticks * 0.032768
    columns: dict[str, list[float]] = {}
    with kilotwin.Arenas(EXPERIMENT, 1, robots=robots, duration_s=duration_s) as one, kilotwin.Arenas(
        EXPERIMENT, BATCH, robots=robots, duration_s=duration_s
    ) as many:
        for _ in range(rounds):
            for name, value in [
                ("run", run_us(robots, ticks)),
                ("one", stepped_us(one, 1)),
                ("thirty", stepped_us(one, 30)),
                ("many", stepped_us(many, 1)),
                ("reset", reset_ms(many)),
            ]:
                columns.setdefault(name, []).append(value)
    m = {name: statistics.median(values) for name, values in columns.items()}
    lines.append(
        f"| {robots} | {m['run']:.0f} | {m['one']:.0f} | {m['thirty']:.0f} | {m['many']:.0f} | {1e6 / m['many']:.0f} | {m['reset']:.1f} |"
    )
    print(lines[-1])
if "-w" in words:
    (root / "docs/results/arenas.md").write_text(header + "\n" + "\n".join(lines) + "\n")
