"""One run."""

from __future__ import annotations

import json
import os
import re
import shutil
import tempfile
import weakref
from pathlib import Path
from typing import Any, Iterable, Mapping

from kilotwin._program import call, common_words, text_of
from kilotwin._table import Table


class Run:
    """A recorded run. Tables are made by the program when they are asked for, and kept while the object lives."""

    def __init__(self, directory: str | os.PathLike[str]) -> None:
        #: The run directory.
        self.directory = Path(directory)
        self._tables: dict[tuple[str, ...], Table] = {}
        # Tables are exported there. It goes with this object; tables that were read keep their files open.
        self._scratch = tempfile.mkdtemp(prefix="kilotwin-")
        weakref.finalize(self, shutil.rmtree, self._scratch, ignore_errors=True)

    @property
    def summary(self) -> dict[str, Any]:
        """summary.json: docs/reference/result-files.md names its fields."""
        summary: dict[str, Any] = json.loads((self.directory / "summary.json").read_text())
        return summary

    @property
    def observables(self) -> dict[str, float | None]:
        """The experiment's observables at the end of the run; None: no value."""
        return dict(self.summary.get("observables", {}))

    def _table(self, option: str, *more: str) -> Table:
        key = (option, *more)
        if key not in self._tables:
            file = Path(self._scratch) / f"{len(self._tables)}.npz"
            call(["export", str(self.directory), option, str(file), *more])
            self._tables[key] = Table(file)
        return self._tables[key]

    def trajectories(self, every_s: float = 1.0, measured: bool = False) -> Table:
        """time_s, robot, x_mm, y_mm, heading_rad, led_r, led_g, led_b (0..3), group, state, failed, and battery_V if it was
        recorded: rows by time, then by robot.

        every_s: seconds between a robot's rows, a multiple of the recorded interval. measured: poses as a tracker sees them.
        """
        return self._table("--trajectories", "--every", str(every_s), *(["--measured"] if measured else []))

    def bodies(self, every_s: float = 1.0) -> Table:
        """time_s, body, x_mm, y_mm, heading_rad of movable bodies."""
        return self._table("--bodies", "--every", str(every_s))

    def variables(self) -> Table:
        """time_s, robot, group, and a column per recorded variable of the programs."""
        return self._table("--variables")

    def events(self, kinds: str | Iterable[str] = ()) -> Table:
        """time_s, event, robot, group, led_r, led_g, led_b, motor_left, motor_right, state, sender, distance_mm, text.

        kinds: events of these kinds alone, with the columns that they have: "led", "motion", "state", "sent", "received",
        "station", "failure".
        """
        names = [kinds] if isinstance(kinds, str) else list(kinds)
        return self._table("--events", *(word for name in names for word in ("--kind", name)))

    def environment(self) -> Table:
        """environment, name, time_s, robot, colour, x, y, orientation_deg, value_1...: logs of the station's environments."""
        return self._table("--environment")

    def commands(self) -> Table:
        """run, robot, time_s, motion: changes of motion, as `kilotwin identify` reads them."""
        return self._table("--commands")

    def over_time(self) -> Table:
        """time_s, the experiment's observables, msd_mm2, displacement_mm, spread_mm, nearest_mm, polarisation, pushed_mm."""
        return self._table("--observables")

    def messages(self) -> Table:
        """receiver, sender, count, sent_if_receiver_is_sender. Needs recording { messages: true }."""
        return self._table("--messages")

    def radio(self) -> Table:
        """robot, attempted, sent, received, collided, backed_off."""
        return self._table("--radio")

    def export_model(self, file: str | os.PathLike[str]) -> Path:
        """Writes the model as it ran, with each robot's own parameters; others take it as `model=`. Replaces the file."""
        call(["export", str(self.directory), "--model", os.fspath(file)])
        return Path(file)

    def __repr__(self) -> str:
        return f"kilotwin.Run({str(self.directory)!r})"


def load(directory: str | os.PathLike[str]) -> Run:
    """A run that has been recorded before. Nothing is read until it is used."""
    path = Path(directory)
    if not (path / "recording.ktrec").exists():
        raise FileNotFoundError(f"{path}: no recording.ktrec; give the directory of a run")
    return Run(path)


def run(
    experiment: str | os.PathLike[str],
    *,
    seed: int | None = None,
    set: Mapping[str, Any] | None = None,
    robots: int | None = None,
    behaviour: str | os.PathLike[str] | None = None,
    duration_s: float | None = None,
    model: str | os.PathLike[str] | None = None,
    define: Mapping[str, Any] | None = None,
    threads: int = 1,
    mode: str = "local",
    domain: int | None = None,
    pace: float | None = None,
    strict: bool = False,
    out: str | os.PathLike[str] | None = None,
    force: bool = False,
) -> Run:
    """Runs an experiment to its end.

    set: fields of the experiment by path, such as {"robots[0].layout.grid.pitch_mm": 33}. define: macros of programs. threads: of a
    local run; results do not depend on them. mode: "local", or "federated" for a run over DDS, which `kilotwin.join(domain)` can look
    at and steer from another thread. domain: of a federated run; absent: a free one. pace: simulated time over wall time; absent: as
    fast as possible. strict: raises where a robot's program fails. out: run directory; absent:
    runs/NAME-SEED, with a number added if it exists. Raises KilotwinError.
    """
    if domain is not None and mode != "federated":
        raise ValueError("a local run has no DDS domain; give mode='federated'")
    words = ["run", os.fspath(experiment), "--mode", mode]
    for option, value in [("--domain", domain), ("--pace", pace)]:
        if value is not None:
            words += [option, str(value)]
    if mode == "local":
        words += ["--threads", str(threads)]
    if seed is not None:
        words += ["--seed", str(seed)]
    for field, setting in (set or {}).items():
        words += ["--set", f"{field}={text_of(setting)}"]
    words += common_words(robots=robots, behaviour=behaviour, duration_s=duration_s, model=model, define=define, out=out, force=force)
    if strict:
        words.append("--strict")
    if out is not None:
        words.append("--quiet")  # nobody reads what it would print, nor its page
    printed = call(words)
    if out is not None:
        return Run(out)
    place = re.search(r"^\s*results\s+(\S.*?)(?: \(.* holds an earlier result.*\))?: report\.html, summary\.json", printed, re.MULTILINE)
    if place is None:
        raise RuntimeError("kilotwin did not say where the results are")
    return Run(place.group(1))


def replay(run: Run | str | os.PathLike[str]) -> None:
    """Steps the run again and compares the state hash of every tick. Raises KilotwinError at the first difference."""
    directory = run.directory if isinstance(run, Run) else Path(run)
    call(["replay", str(directory), "--verify"])
