"""Run Kilotwin's experiments, and load their results into NumPy and pandas.

    import kilotwin

    run = kilotwin.run("experiments/disperse.txtpb", seed=2, set={"recording.every_s": 0.5})
    run.summary["state_hash"]
    poses = run.trajectories(every_s=0.5)     # columns as NumPy arrays
    poses["x_mm"]
    run.variables().frame()                   # a pandas.DataFrame

The package starts the program `kilotwin`, which must be on the PATH, or named by the environment variable KILOTWIN. Units stand in the
names of columns: _s seconds, _mm millimetres, _rad radians.
"""

from kilotwin._arenas import Arena, Arenas
from kilotwin._identify import Identification, identify
from kilotwin._live import Live, join
from kilotwin._program import KilotwinError, program
from kilotwin._run import Run, load, replay, run
from kilotwin._sweep import Sweep, sweep
from kilotwin._table import Table
from kilotwin._tune import Tuned, tune

__all__ = [
    "Arena",
    "Arenas",
    "Identification",
    "KilotwinError",
    "Live",
    "Run",
    "Sweep",
    "Table",
    "Tuned",
    "identify",
    "join",
    "load",
    "program",
    "replay",
    "run",
    "sweep",
    "tune",
]
