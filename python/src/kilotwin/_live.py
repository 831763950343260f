"""A run that is going on, somewhere on the network."""

from __future__ import annotations

from typing import Any

import numpy as np

from kilotwin._program import KilotwinError, program
from kilotwin._requests import Answering


class Live:
    """A run that somebody has started: `kilotwin run ... --domain N` prints its domain.

        with kilotwin.join(7) as live:
            live.pause()
            live.place(3, x_mm=100, y_mm=-50, heading_rad=1.5)
            live.step(30)
            live.state()["x_mm"]            # array of shape (robots,)
            live.resume()

    The run goes on when the program that has joined it ends. What is placed and when it is paused enters the recording, and a
    replay does the same.
    """

    def __init__(self, domain: int = 0, *, patience_s: float = 10.0) -> None:
        """`domain`: DDS domain of the run. Every call raises KilotwinError where the run has not followed within `patience_s`."""
        self._requests = Answering(
            [program(), "control", "requests", "--domain", str(domain), "--patience", str(patience_s)],
            "kilotwin control has ended with status {}",
        )
        self._first: dict[str, Any] = self._requests.first()
        #: Name of the experiment.
        self.name: str = self._first["name"]
        #: Number of robots.
        self.robots: int = self._first["robots"]

    def status(self) -> dict[str, Any]:
        """run, name, phase (starting, running, paused, ended, broken), tick, last_tick, simulated_s, wall_s, robots, robots_failed,
        sent, received, note, saved_tick (of the last checkpoint; 0: none)."""
        return self._ask({"status": None})

    def state(self) -> dict[str, Any]:
        """The newest state that has come, some 10 a second; of a paused run, the state in which it stands: tick, time_s; per robot x_mm, y_mm, heading_rad, led (robots, 3), life_cycle;
        per movable body body_x_mm, body_y_mm, body_heading_rad. All but the first two are arrays."""
        state = self._ask({"state": None})
        return {name: np.asarray(value) if isinstance(value, list) else value for name, value in state.items()}

    def pause(self) -> dict[str, Any]:
        """Pauses the run, and returns its status then, like all that follow."""
        return self._ask({"pause": None})

    def resume(self) -> dict[str, Any]:
        """Lets a paused run continue."""
        return self._ask({"continue": None})

    def step(self, ticks: int) -> dict[str, Any]:
        """Goes on for a number of ticks, then pauses."""
        return self._ask({"step": int(ticks)})

    def checkpoint(self) -> dict[str, Any]:
        """Saves the state, so that `kilotwin run --resume` can go on from it. Returns when it has been saved."""
        return self._ask({"checkpoint": None})

    def stop(self) -> dict[str, Any]:
        """Ends the run early, with its recording and summary."""
        return self._ask({"stop": None})

    def place(self, robot: int, x_mm: float, y_mm: float, heading_rad: float = 0.0, *, movable: bool = False) -> dict[str, Any]:
        """Puts a robot, or with `movable` a movable body, elsewhere. x_mm, y_mm: its centre, from the arena's centre; heading_rad:
        anticlockwise from x. It returns when the run shows it there. A paused run shows it after its next step."""
        where: dict[str, Any] = {"movable" if movable else "robot": int(robot)}
        where.update(x_mm=float(x_mm), y_mm=float(y_mm), heading_rad=float(heading_rad))
        return self._ask({"place": where})

    def close(self) -> None:
        """Leaves the run, which goes on."""
        self._requests.close()

    def __enter__(self) -> Live:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def __repr__(self) -> str:
        return f"<kilotwin.Live: {self.name}, {self.robots} robots>"

    def _ask(self, request: dict[str, Any]) -> dict[str, Any]:
        if not self._requests.close.alive:
            raise KilotwinError("the run has been left", 1)
        return self._requests.ask(request)


def join(domain: int = 0, *, patience_s: float = 10.0) -> Live:
    """Joins the run on a DDS domain, to look at it and to steer it. Raises KilotwinError where there is none within `patience_s`."""
    return Live(domain, patience_s=patience_s)
