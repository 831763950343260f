"""Many runs."""

from __future__ import annotations

import csv
import os
from pathlib import Path
from typing import TYPE_CHECKING, Any, Mapping, Sequence

from kilotwin._program import KilotwinError, common_words, ended, error_of, text_of
from kilotwin._run import Run

if TYPE_CHECKING:
    import pandas


class Sweep:
    """The results of a sweep."""

    def __init__(self, directory: str | os.PathLike[str]) -> None:
        #: The sweep's directory.
        self.directory = Path(directory)

    def runs(self) -> list[Run]:
        """The runs that came to their end, by point and seed; of a strict sweep, those without failed robots."""
        # The table names a run's directory as the command saw it, from the folder where it ran.
        return [Run(self.directory / Path(row["directory"]).name) for row in self._rows() if row["well"] == "1"]

    def _rows(self) -> list[dict[str, str]]:
        with open(self.directory / "runs.csv", newline="") as file:
            return list(csv.DictReader(file))

    def table(self, name: str = "runs") -> pandas.DataFrame:
        """`runs`: a row per run, failed ones included; `sweep`: a row per point, means and standard errors (_se) at the end;
        `curves`: the same over time; `designs`: with several models, a row per design. Needs pandas."""
        import pandas as pd

        return pd.read_csv(self.directory / f"{name}.csv")


def sweep(
    experiment: str | os.PathLike[str],
    *,
    out: str | os.PathLike[str],
    seeds: str | None = None,
    set: Mapping[str, Any] | None = None,
    latin: int | None = None,
    jobs: int | None = None,
    robots: int | None = None,
    behaviour: str | os.PathLike[str] | None = None,
    duration_s: float | None = None,
    model: str | os.PathLike[str] | None = None,
    models: Sequence[str | os.PathLike[str]] = (),
    goal: str | None = None,
    define: Mapping[str, Any] | None = None,
    plot: str | None = None,
    colour_by: str | None = None,
    strict: bool = False,
    slurm: bool | Sequence[str] = False,
    slurm_program: str | None = None,
    resume: bool = False,
    force: bool = False,
) -> Sweep:
    """Runs an experiment over seeds and values, on all cores.

    seeds: "1..20". set: per field a list of values, or a text such as "10..200:10" or "log:0.01..10:7". latin: so many points of a
    Latin hypercube over the ranges in place of all combinations. models: files, or directories of them; every point runs with each, and
    `table("designs")` ranks the points by their worst model, where the `goal` says which value is better: "largest" or "smallest".
    plot: the observable of the plots. colour_by: a swept field, or "group": a curve for each of its values. strict: a run in which robots
    failed counts as failed. slurm: runs as an array job of Slurm; options for sbatch in a list, such as ["--time=1:00:00"].
    slurm_program: what starts kilotwin on its nodes, such as "apptainer run /shared/kilotwin.sif"; absent: this program. resume: goes on with the sweep in `out`. Runs that fail are listed in the table; the others are there. Raises KilotwinError for wrong input, or if no run came to its end.
    """
    words = ["sweep", os.fspath(experiment)]
    if seeds is not None:
        words += ["--seeds", seeds]
    for field, values in (set or {}).items():
        text = values if isinstance(values, str) else ",".join(text_of(value) for value in values)
        words += ["--set", f"{field}={text}"]
    for option, value in [("--latin", latin), ("--jobs", jobs), ("--plot", plot), ("--colour-by", colour_by), ("--slurm-program", slurm_program)]:
        if value is not None:
            words += [option, str(value)]
    if strict:
        words.append("--strict")
    if isinstance(slurm, str):
        slurm = [slurm]
    if slurm or isinstance(slurm, Sequence):
        words.append("--slurm")
    if isinstance(slurm, Sequence):
        words += [f"--slurm-option={option}" for option in slurm]
    if models:
        words += ["--models", *(os.fspath(file) for file in models)]
    if goal is not None:
        words += ["--goal", goal]
    words += common_words(
        robots=robots, behaviour=behaviour, duration_s=duration_s, model=model, define=define, out=None if resume else out, force=force
    )
    if resume:
        words += ["--resume", os.fspath(out)]
    status, _, said = ended(words)
    done = Sweep(out)
    if status not in (0, 1) or not (done.directory / "runs.csv").exists():
        raise error_of(status, said)
    if not any(row["well"] == "1" for row in done._rows()):
        raise KilotwinError(f"no run came to its end: {done._rows()[0]['failure']}", status)
    return done
