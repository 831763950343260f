"""A process that answers requests: one line of JSON each, in and out."""

from __future__ import annotations

import json
import subprocess
from typing import IO, Any

from kilotwin._program import KilotwinError


def ask(process: subprocess.Popen[str], request: dict[str, Any]) -> Any:
    """The answer; None where the process has ended. Raises KilotwinError where the answer is an error."""
    try:
        process.stdin.write(json.dumps(request) + "\n")  # type: ignore[union-attr]
        process.stdin.flush()  # type: ignore[union-attr]
        line = process.stdout.readline()  # type: ignore[union-attr]
    except BrokenPipeError:
        line = ""
    if not line:
        return None
    answer = json.loads(line)
    if "error" in answer:
        raise KilotwinError(answer["error"], answer["status"])
    return answer


def notes(said: IO[str]) -> list[str]:
    """What the process has said to people."""
    said.seek(0)
    return [line.rstrip() for line in said if line.strip()]


def end_of_process(process: subprocess.Popen[str]) -> None:
    """The process ends when nobody can ask it any more."""
    for stream in (process.stdin, process.stdout):
        try:
            stream.close()  # type: ignore[union-attr]
        except BrokenPipeError:
            pass
    process.wait()
