"""Tables of a run: a NumPy array per column."""

from __future__ import annotations

import json
import os
import zipfile
from typing import TYPE_CHECKING, Any, Iterator, Mapping

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    import pandas


class Table(Mapping[str, NDArray[Any]]):
    """Columns by name, each an array of shape (rows,). A column is read when it is first used.

    Whole numbers are int64, or float64 where a value is missing; other numbers are float64 with NaN for missing values; texts are
    Unicode arrays.
    """

    def __init__(self, file: str | os.PathLike[str]) -> None:
        self._arrays: Any = np.load(file)
        self._read: dict[str, NDArray[Any]] = {}
        with zipfile.ZipFile(file) as archive:
            about = json.loads(archive.comment)
            # With very many columns, only the arrays' own comments describe them.
            columns = about.pop("columns") or [json.loads(member.comment) for member in archive.infolist()]
        #: Unit of each column: "mm", "s", "rad"; empty for pure numbers and texts.
        self.units: dict[str, str] = {column["name"]: column["unit"] for column in columns}
        #: Where the table comes from: experiment, seed, run, state_hash, version, build, date.
        self.about: dict[str, str] = about

    def __getitem__(self, column: str) -> NDArray[Any]:
        if column not in self._read:
            if column not in self.units:
                raise KeyError(f"no column {column!r}; there are {', '.join(self.units)}")
            self._read[column] = self._arrays[column]
        return self._read[column]

    def __iter__(self) -> Iterator[str]:
        return iter(self.units)

    def __len__(self) -> int:
        return len(self.units)

    def frame(self) -> pandas.DataFrame:
        """The table as a data frame, with `about` and `units` in its attrs. Needs pandas."""
        import pandas as pd

        frame = pd.DataFrame({column: self[column] for column in self})
        frame.attrs = {**self.about, "units": self.units}
        return frame
