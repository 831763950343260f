"""The program `kilotwin`."""

from __future__ import annotations

import os
import shutil
import subprocess
from typing import Any, Mapping, Sequence


class KilotwinError(Exception):
    """The program refused its input (status 2), or the run failed (status 1)."""

    def __init__(self, message: str, status: int) -> None:
        super().__init__(message)
        #: Exit status of the program.
        self.status = status


def program() -> str:
    """Path of the program: the environment variable KILOTWIN, else the first `kilotwin` on the PATH."""
    found = os.environ.get("KILOTWIN") or shutil.which("kilotwin")
    if not found:
        raise KilotwinError("there is no program kilotwin on the PATH; the variable KILOTWIN can name it", 127)
    return found


def ended(words: Sequence[str]) -> tuple[int, str, str]:
    """Runs the program to its end and returns its status, standard output and standard error."""
    done = subprocess.run([program(), *words], capture_output=True, text=True, check=False)
    return done.returncode, done.stdout, done.stderr


def error_of(status: int, said: str) -> KilotwinError:
    """The error of a program that ended with this status and said this on standard error: its last line."""
    lines = [line for line in said.splitlines() if line.strip()]
    return KilotwinError(lines[-1] if lines else f"kilotwin ended with status {status}", status)


def call(words: Sequence[str]) -> str:
    """Runs the program and returns its standard output. Raises KilotwinError unless its status is 0."""
    status, output, said = ended(words)
    if status != 0:
        raise error_of(status, said)
    return output


def text_of(value: Any) -> str:
    """A value as `--set` takes it: True is true."""
    return str(value).lower() if isinstance(value, bool) else str(value)


def common_words(
    *,
    robots: int | None,
    behaviour: str | os.PathLike[str] | None,
    duration_s: float | None,
    model: str | os.PathLike[str] | None,
    define: Mapping[str, Any] | None,
    out: str | os.PathLike[str] | None,
    force: bool,
) -> list[str]:
    """Options that `run` and `sweep` share."""
    words: list[str] = []
    for option, value in [("--robots", robots), ("--behaviour", behaviour), ("--duration", duration_s), ("--model", model)]:
        if value is not None:
            words += [option, os.fspath(value) if isinstance(value, os.PathLike) else str(value)]
    for name, value in (define or {}).items():
        words += ["--define", f"{name}={value}"]
    if out is not None:
        words += ["--out", os.fspath(out)]
    if force:
        words.append("--force")
    return words
