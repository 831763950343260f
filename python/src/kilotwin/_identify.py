"""From measured tracks to a model."""

from __future__ import annotations

import json
import os
from pathlib import Path
from typing import TYPE_CHECKING, Any

from kilotwin._program import call

if TYPE_CHECKING:
    import pandas


class Identification:
    """What `kilotwin identify` found."""

    def __init__(self, directory: str | os.PathLike[str]) -> None:
        #: The directory of the results.
        self.directory = Path(directory)
        #: result.json: docs/reference/measured-data.md names its fields.
        self.result: dict[str, Any] = json.loads((self.directory / "result.json").read_text())

    @property
    def model(self) -> Path:
        """The model file; `kilotwin.run` and others take it as `model=`."""
        return self.directory / "model.txtpb"

    @property
    def draws(self) -> list[Path]:
        """Models from the posterior, for `models` of sweep() and tune()."""
        return sorted((self.directory / "draws").glob("*.txtpb"))

    @property
    def report(self) -> Path:
        """The page with the result."""
        return self.directory / "report.html"

    @property
    def before_mm(self) -> float:
        """Error of the base model at the horizon, root mean square, on held-out data."""
        return float(self.result["before"]["rmse_mm"])

    @property
    def after_mm(self) -> float:
        """The same of the model that was found."""
        return float(self.result["after"]["rmse_mm"])

    @property
    def effects(self) -> list[str]:
        """What the base model lacked, in words."""
        return [effect["in_words"] for effect in self.result["effects"]]

    def predictions(self) -> pandas.DataFrame:
        """run, robot, time_s, before_x_mm, before_y_mm, after_x_mm, after_y_mm: a row per prediction. Needs pandas."""
        import pandas as pd

        return pd.read_csv(self.directory / "predictions.csv")


def identify(
    train: str | os.PathLike[str],
    test: str | os.PathLike[str] | None = None,
    *,
    out: str | os.PathLike[str],
    horizon_s: float | None = None,
    draws: int | None = None,
    threads: int | None = None,
    force: bool = False,
) -> Identification:
    """Fits the model to the tracks in the directory `train`, and finds effects that it lacks.

    test: tracks to be predicted, never fitted to; None: a part of `train` is held out. horizon_s: how far ahead predictions look.
    draws: as many models from the posterior, in the directory `draws` of the result.
    Takes up to some minutes. Raises KilotwinError for wrong input.
    """
    words = ["identify", "--train", os.fspath(train), "--out", os.fspath(out), "--quiet"]
    if test is not None:
        words += ["--test", os.fspath(test)]
    for option, value in [("--horizon", horizon_s), ("--draws", draws), ("--threads", threads)]:
        if value is not None:
            words += [option, str(value)]
    if force:
        words.append("--force")
    call(words)
    return Identification(out)
