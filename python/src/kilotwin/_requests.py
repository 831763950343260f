"""A process that answers requests: one line of JSON each, in and out."""

from __future__ import annotations

import json
import subprocess
import tempfile
import weakref
from typing import IO, Any, Sequence

from kilotwin._program import KilotwinError


class Answering:
    """The process, what it says to people, and its end. It ends when it is closed, or when nobody can ask it any more."""

    def __init__(self, words: Sequence[str], otherwise: str) -> None:
        """`otherwise`: what to say of a process that ends without a word; {} is its status."""
        self._otherwise = otherwise
        self._said = tempfile.TemporaryFile("w+")
        # A session of its own: Ctrl-C is for Python, which ends the process when it ends.
        self._process = subprocess.Popen(
            words, stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=self._said, text=True, start_new_session=True
        )
        self._last_notes: list[str] = []
        self.close = weakref.finalize(self, _end, self._process, self._said, self._last_notes)

    def first(self) -> dict[str, Any]:
        """What it says first. Raises KilotwinError where it has ended."""
        return self._read()

    def ask(self, request: dict[str, Any]) -> dict[str, Any]:
        """The answer. Raises KilotwinError where it is an error, or where the process has ended."""
        assert self._process.stdin is not None
        try:
            self._process.stdin.write(json.dumps(request) + "\n")
            self._process.stdin.flush()
        except BrokenPipeError:
            raise self._ended() from None
        answer = self._read()
        if "error" in answer:
            raise KilotwinError(answer["error"], answer["status"])
        return answer

    def notes(self) -> list[str]:
        """What the process has said to people."""
        return _lines_of(self._said) if self.close.alive else self._last_notes

    def _read(self) -> dict[str, Any]:
        assert self._process.stdout is not None
        line = self._process.stdout.readline()
        if not line:
            raise self._ended()
        answer: dict[str, Any] = json.loads(line)
        return answer

    def _ended(self) -> KilotwinError:
        """Why the process has ended."""
        self.close()
        status = self._process.returncode
        return KilotwinError((self._last_notes or [self._otherwise.format(status)])[-1], status)


def _lines_of(said: IO[str]) -> list[str]:
    said.seek(0)
    return [line.rstrip() for line in said if line.strip()]


def _end(process: subprocess.Popen[str], said: IO[str], last_notes: list[str]) -> None:
    """Ends the process by the end of its input, and closes all that it had open."""
    for stream in (process.stdin, process.stdout):
        assert stream is not None
        try:
            stream.close()
        except BrokenPipeError:
            pass
    process.wait()
    last_notes += _lines_of(said)
    said.close()
