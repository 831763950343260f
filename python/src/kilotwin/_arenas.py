"""Arenas that the caller steps, for optimisers and learning."""

from __future__ import annotations

import math
import mmap
import os
import warnings
from typing import Any, Iterable, Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from kilotwin._program import KilotwinError, common_words, program, text_of
from kilotwin._requests import Answering


class Arenas:
    """A number of arenas of one experiment, with ascending seeds, which step together on all cores.

        with kilotwin.Arenas("experiments/disperse.txtpb", 8, variables=["hops"]) as arenas:
            arenas.step(seconds=1)
            arenas.x_mm                     # array of shape (8, robots)
            arenas.reset(seeds=range(8))

    The arrays are views of the arenas' memory: a step changes them, so copy what you keep. Their first axis is the arena,
    their second the robot. After the same number of ticks an arena has the state hash of `kilotwin run` with its seed.

    The arenas run in a process of their own. A program of a robot that crashes costs that robot, and a step keeps no other
    thread of Python waiting.
    """

    def __init__(
        self,
        experiment: str | os.PathLike[str],
        count: int = 1,
        *,
        seed: int | None = None,
        robots: int | None = None,
        behaviour: str | os.PathLike[str] | None = None,
        duration_s: float | None = None,
        model: str | os.PathLike[str] | None = None,
        set: Mapping[str, Any] | None = None,
        define: Mapping[str, Any] | None = None,
        variables: Iterable[str] = (),
        threads: int | None = None,
    ) -> None:
        """`seed`: of the first arena; each further one has the next. `variables`: of the robots' programs, to be read and set.
        All else is as for `kilotwin.run`. Raises KilotwinError where the experiment is wrong."""
        words = [program(), "arenas", os.fspath(experiment), "--count", str(count)]
        words += common_words(
            robots=robots, behaviour=behaviour, duration_s=duration_s, model=model, define=define, out=None, force=False
        )
        if seed is not None:
            words += ["--seed", str(seed)]
        for field, value in (set or {}).items():
            words += ["--set", f"{field}={text_of(value)}"]
        for name in variables:
            words += ["--variable", name]
        if threads is not None:
            words += ["--threads", str(threads)]
        self._requests = Answering(words, "the arenas have ended with status {}")
        about = self._requests.first()
        for note in self._requests.notes():
            warnings.warn(note, stacklevel=2)
        #: Number of arenas.
        self.count: int = about["arenas"]
        #: Number of robots in each arena.
        self.robots: int = about["robots"]
        #: Simulated time of a tick, s.
        self.tick_s: float = about["tick_s"]
        #: The tick at which the experiment ends.
        self.last_tick: int = about["last_tick"]
        #: Names of the variables, arrays and structs by their elements.
        self.variables: tuple[str, ...] = tuple(about["variables"])
        with open(about["memory"], "r+b") as file:
            memory = mmap.mmap(file.fileno(), about["octets"])
        self._arrays: dict[str, NDArray[Any]] = {}
        for name, array in about["arrays"].items():
            made: NDArray[Any] = np.ndarray(array["shape"], array["type"], memory, array["offset"])
            made.flags.writeable = name == "wanted"
            self._arrays[name] = made
        self._seeds: list[int] = about["seeds"]

    # State of the arenas.

    def _view(self, array: NDArray[Any]) -> NDArray[Any]:
        return array

    @property
    def tick(self) -> NDArray[Any]:
        """int64, (arenas,): ticks since the beginning."""
        return self._view(self._arrays["tick"])

    @property
    def time_s(self) -> NDArray[Any]:
        """float64, (arenas,): simulated time, s."""
        return self.tick * self.tick_s

    @property
    def ended(self) -> NDArray[Any]:
        """uint8, (arenas,): 1 where the experiment's duration is over; such an arena steps no more until it is reset."""
        return self._view(self._arrays["ended"])

    @property
    def state_hash(self) -> NDArray[Any]:
        """uint64, (arenas,): as in the summary of a run that ends here."""
        return self._view(self._arrays["state_hash"])

    @property
    def robots_failed(self) -> NDArray[Any]:
        """uint32, (arenas,): robots whose program has failed; failures() tells why."""
        return self._view(self._arrays["robots_failed"])

    @property
    def sent(self) -> NDArray[Any]:
        """uint64, (arenas,): messages that robots have sent."""
        return self._view(self._arrays["sent"])

    @property
    def received(self) -> NDArray[Any]:
        """uint64, (arenas,): messages that robots have received."""
        return self._view(self._arrays["received"])

    @property
    def x_mm(self) -> NDArray[Any]:
        """float64, (arenas, robots): place, mm from the arena's centre."""
        return self._view(self._arrays["x_mm"])

    @property
    def y_mm(self) -> NDArray[Any]:
        """float64, (arenas, robots): place, mm from the arena's centre."""
        return self._view(self._arrays["y_mm"])

    @property
    def heading_rad(self) -> NDArray[Any]:
        """float64, (arenas, robots): anticlockwise from x, in [-pi, pi)."""
        return self._view(self._arrays["heading_rad"])

    @property
    def led(self) -> NDArray[Any]:
        """uint8, (arenas, robots, 3): red, green, blue, each 0 to 3."""
        return self._view(self._arrays["led"])

    @property
    def motors(self) -> NDArray[Any]:
        """uint8, (arenas, robots, 2): left and right, 0 to 255."""
        return self._view(self._arrays["motors"])

    @property
    def life_cycle(self) -> NDArray[Any]:
        """uint8, (arenas, robots): 0 asleep, 1 idle, 2 running... as in idl/public.idl."""
        return self._view(self._arrays["life_cycle"])

    @property
    def body_x_mm(self) -> NDArray[Any]:
        """float64, (arenas, bodies): place of movable bodies, mm from the arena's centre."""
        return self._view(self._arrays["body_x_mm"])

    @property
    def body_y_mm(self) -> NDArray[Any]:
        """float64, (arenas, bodies): place of movable bodies, mm from the arena's centre."""
        return self._view(self._arrays["body_y_mm"])

    @property
    def body_heading_rad(self) -> NDArray[Any]:
        """float64, (arenas, bodies): anticlockwise from x."""
        return self._view(self._arrays["body_heading_rad"])

    def variable(self, name: str) -> NDArray[Any]:
        """float64, (arenas, robots): a variable of the programs; NaN where a robot's program has none of that name."""
        return self._view(self._arrays["variables"][self._index_of(name)])

    def observe(self) -> dict[str, NDArray[Any]]:
        """Copies of all arrays, by their names, those of variables included. They stay as they are."""
        names = [name for name in self._arrays if name not in ("variables", "wanted")]
        copies = {name: np.array(self._view(self._arrays[name])) for name in names}
        copies.update({name: np.array(self.variable(name)) for name in self.variables})
        return copies

    @property
    def seeds(self) -> tuple[int, ...]:
        """Seed of each arena."""
        return tuple(self._seeds)

    # Requests of the caller.

    def step(self, ticks: int | None = None, *, seconds: float | None = None) -> None:
        """Steps all arenas that have not ended: by a number of ticks, or until `seconds` more have passed; else by one tick."""
        if ticks is not None and seconds is not None:
            raise ValueError("give ticks or seconds")
        if seconds is not None:
            ticks = math.ceil(seconds / self.tick_s - 1e-9)
        self._ask({"step": 1 if ticks is None else int(ticks)})

    def reset(self, seeds: Iterable[int] | None = None, arenas: Sequence[int] | None = None) -> None:
        """Begins arenas anew: all, or those of `arenas`. `seeds`: one per arena that begins; None: those that they have."""
        chosen = list(range(self.count)) if arenas is None else [int(arena) for arena in arenas]
        new = [self._seeds[arena] for arena in chosen] if seeds is None else [int(seed) for seed in seeds]
        if len(new) != len(chosen):
            raise ValueError(f"{len(new)} seeds for {len(chosen)} arenas")
        self._ask({"reset": [list(pair) for pair in zip(chosen, new)]})
        for arena, seed in zip(chosen, new):
            self._seeds[arena] = seed

    def send(self, type: int, data: Iterable[int] = (), *, once: bool = False, arenas: Sequence[int] | None = None) -> None:
        """A message from the overhead controller to all robots, in the next tick. It is repeated until the next message, as the real
        controller does, unless `once`. `data`: at most 9 octets."""
        request: dict[str, Any] = {"type": int(type), "data": [int(octet) for octet in data], "once": once}
        if arenas is not None:
            request["arenas"] = [int(arena) for arena in arenas]
        self._ask({"send": request})

    def place(
        self,
        robot: int,
        x_mm: float,
        y_mm: float,
        heading_rad: float = 0.0,
        *,
        movable: bool = False,
        arenas: Sequence[int] | None = None,
    ) -> None:
        """Puts a robot, or with `movable` a movable body, elsewhere: it stands there after the next step. x_mm, y_mm: its centre, from
        the arena's centre; heading_rad: anticlockwise from x. Raises KilotwinError where it cannot stand there."""
        request: dict[str, Any] = {"movable" if movable else "robot": int(robot)}
        request.update(x_mm=float(x_mm), y_mm=float(y_mm), heading_rad=float(heading_rad))
        if arenas is not None:
            request["arenas"] = [int(arena) for arena in arenas]
        self._ask({"place": request})

    def set_variable(self, name: str, values: Any) -> None:
        """Sets a variable of the programs, between two ticks. `values`: one, or an array that fits (arenas, robots); NaN leaves a
        robot's variable as it is. Before the first step it changes what the programs begin with."""
        index = self._index_of(name)
        self._view(self._arrays["wanted"])[...] = values
        self._ask({"set": index})

    def failures(self) -> list[dict[str, Any]]:
        """Robots whose program has failed: arena, robot and why."""
        failures: list[dict[str, Any]] = self._ask({"failures": True})["failures"]
        return failures

    def close(self) -> None:
        """Ends the arenas. Arrays that were taken from them stay as they are."""
        self._requests.close()

    def __enter__(self) -> Arenas:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def __repr__(self) -> str:
        return f"<kilotwin.{type(self).__name__}: {self.count} of {self.robots} robots>"

    def _index_of(self, name: str) -> int:
        try:
            return self.variables.index(name)
        except ValueError:
            known = ", ".join(self.variables) or "none; name some as variables=[...]"
            raise KeyError(f"there is no variable {name}; there are: {known}") from None

    def _ask(self, request: dict[str, Any]) -> dict[str, Any]:
        if not self._requests.close.alive:
            raise KilotwinError("the arenas are closed", 1)
        return self._requests.ask(request)


class Arena(Arenas):
    """One arena. Its arrays have no axis for arenas: `arena.x_mm` has the shape (robots,), and `arena.tick` is a number."""

    def __init__(self, experiment: str | os.PathLike[str], **options: Any) -> None:
        """Options as for Arenas."""
        super().__init__(experiment, 1, **options)

    def _view(self, array: NDArray[Any]) -> NDArray[Any]:
        view: NDArray[Any] = array[0]
        return view
