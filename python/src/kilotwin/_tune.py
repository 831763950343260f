"""The best values for an observable."""

from __future__ import annotations

import json
import os
from pathlib import Path
from typing import TYPE_CHECKING, Any, Mapping, Sequence

from kilotwin._program import common_words, ended, error_of, text_of

if TYPE_CHECKING:
    import pandas


class Tuned:
    """What `kilotwin tune` found."""

    def __init__(self, directory: str | os.PathLike[str]) -> None:
        #: The directory of the results.
        self.directory = Path(directory)
        #: tune.json: the best values, the observable there, the gain over the present values.
        self.result: dict[str, Any] = json.loads((self.directory / "tune.json").read_text())

    @property
    def best(self) -> dict[str, float]:
        """The best value of each field and macro."""
        return dict(self.result["best"])

    @property
    def value(self) -> tuple[float, float]:
        """The observable there and its standard error, over runs with fresh seeds."""
        return self.result["value"]["mean"], self.result["value"]["standard_error"]

    @property
    def gain(self) -> tuple[float, float]:
        """How much better that is than the experiment as it stands, and the standard error."""
        return self.result["gain"]["mean"], self.result["gain"]["standard_error"]

    @property
    def report(self) -> Path:
        """The page with the result."""
        return self.directory / "report.html"

    def points(self) -> pandas.DataFrame:
        """The points of the search, in order. Needs pandas."""
        import pandas as pd

        return pd.read_csv(self.directory / "points.csv")


def tune(
    experiment: str | os.PathLike[str],
    *,
    out: str | os.PathLike[str],
    maximise: str | None = None,
    minimise: str | None = None,
    vary: Mapping[str, str] | None = None,
    vary_define: Mapping[str, str] | None = None,
    seeds: int | None = None,
    budget: int | None = None,
    seed: int | None = None,
    jobs: int | None = None,
    robots: int | None = None,
    behaviour: str | os.PathLike[str] | None = None,
    duration_s: float | None = None,
    model: str | os.PathLike[str] | None = None,
    models: Sequence[str | os.PathLike[str]] = (),
    worst: bool = False,
    set: Mapping[str, Any] | None = None,
    define: Mapping[str, Any] | None = None,
    strict: bool = False,
    force: bool = False,
) -> Tuned:
    """Searches the values of fields and macros that make an observable largest or smallest, by CMA-ES.

    vary, vary_define: per field or macro its range, such as "10..200" or "log:0.1..10". seeds: runs per point. budget: runs in all.
    models: files, or directories of them; each point runs with all, and the mean counts, or with `worst` the worst. strict: a run in
    which robots failed counts as failed. Raises KilotwinError for wrong input, or if no run of the first points succeeded.
    """
    if (maximise is None) == (minimise is None):
        raise ValueError("give maximise or minimise")
    words = ["tune", os.fspath(experiment), "--quiet"]
    words += ["--maximise", maximise] if maximise is not None else ["--minimise", str(minimise)]
    for option, ranges in [("--vary", vary), ("--vary-define", vary_define)]:
        for name, values in (ranges or {}).items():
            words += [option, f"{name}={values}"]
    for field, value in (set or {}).items():
        words += ["--set", f"{field}={text_of(value)}"]
    for option, number in [("--seeds", seeds), ("--budget", budget), ("--seed", seed), ("--jobs", jobs)]:
        if number is not None:
            words += [option, str(number)]
    if models:
        words += ["--models", *(os.fspath(file) for file in models)]
    if worst:
        words.append("--worst")
    words += common_words(robots=robots, behaviour=behaviour, duration_s=duration_s, model=model, define=define, out=out, force=force)
    if strict:
        words.append("--strict")
    status, _, said = ended(words)
    # With `strict` the status is 1 also where some runs failed, and the result is there.
    if status != 0 and not (strict and status == 1 and (Path(out) / "tune.json").exists()):
        raise error_of(status, said)
    return Tuned(out)
