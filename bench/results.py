#!/usr/bin/env python3
"""Pages of docs/results: the one way in which programs write them.

A page has parts. Each part is a section with a head of its own: command, date, commit, machine, load. So one part can be
measured anew without the others. A page of one part has no sections. The writer holds the whole page: its introduction, and the
order of its sections. Measuring programs print their tables as Markdown.

Usage by writers in other languages:
  bench/results.py head TITLE COMMAND     prints the head of a page; call it before measuring
  bench/results.py readable < TABLES      prints tables with readable figures
"""
import argparse
import datetime
import json
import math
import os
import pathlib
import re
import shlex
import statistics
import subprocess
import sys
from typing import Callable, NamedTuple

ROOT = pathlib.Path(__file__).resolve().parent.parent


class Part(NamedTuple):
    heading: str
    measure: Callable[[argparse.Namespace], str]
    """Measures, and returns Markdown without the heading."""
    timed: bool = False
    """Whether figures depend on the machine and on its load."""


def output_of(*command: object, cwd: pathlib.Path = ROOT, may_fail: bool = False) -> str:
    """What a program prints. If it fails, the writer ends without a page; with `may_fail`, status 1 means a figure that misses."""
    done = subprocess.run([str(word) for word in command], cwd=cwd, stdout=subprocess.PIPE, text=True, check=False)
    if done.returncode not in ((0, 1) if may_fail else (0,)):
        sys.exit(f"{command[0]}: ended with status {done.returncode}; no page is written")
    return done.stdout


def built(arguments: argparse.Namespace, program: str) -> pathlib.Path:
    """A program of the build directory."""
    path = pathlib.Path(arguments.b) / program
    if not path.exists():
        sys.exit(f"{path}: is not built. Configure with -DKILOTWIN_BENCH=ON, then: ninja -C {arguments.b} {path.name}")
    return path


def run(arguments: argparse.Namespace, experiment: pathlib.Path, out: pathlib.Path, *options: object) -> dict:
    """Runs an experiment quietly, and returns its summary."""
    output_of(built(arguments, "kilotwin"), "run", experiment, "--quiet", "--out", out, *options)
    return summary_of(out)


def summary_of(out: pathlib.Path) -> dict:
    return json.loads((out / "summary.json").read_text(encoding="utf-8"))


def mean_and_error(values: list[float]) -> str:
    """The mean and its standard error, both to the second digit of the error."""
    error = statistics.stdev(values) / math.sqrt(len(values)) if len(values) > 1 else 0
    if error == 0:
        return f"{number(statistics.fmean(values))} +- 0"
    places = 1 - math.floor(math.log10(error))
    return " +- ".join(f"{round(value, places):,.{max(places, 0)}f}" for value in (statistics.fmean(values), error))


def data_of(arguments: argparse.Namespace, name: str) -> pathlib.Path:
    """A set of measured data."""
    path = pathlib.Path(arguments.data or "") / name
    if not arguments.data or not path.exists():
        sys.exit(f"{path}: no measured data there; name their directory with --data")
    return path


def table(columns: list[str], rows: list[list[object]]) -> str:
    """A table in Markdown."""
    lines = ["|" + "".join(f" {cell} |" if str(cell) else " |" for cell in line) for line in [columns, *rows]]
    return "\n".join([lines[0], "|" + "---|" * len(columns), *lines[1:]]) + "\n"


def number(value: float, digits: int = 3) -> str:
    """A figure with so many significant digits: 0.0000123, 12.3, 73,500. Only below a millionth it has an exponent."""
    if not math.isfinite(value) or abs(value) < 1e-6:
        return f"{value:.{digits}g}"
    places = digits - 1 - math.floor(math.log10(abs(float(f"{value:.{digits - 1}e}"))))
    text = f"{round(value, places):,.{max(places, 0)}f}"
    return text.rstrip("0").rstrip(".") if "." in text else text


def readable(text: str) -> str:
    """Markdown whose figures people can read: no exponents, and in tables commas at thousands from 10,000. Code is left alone."""
    def plain(match: re.Match) -> str:
        return number(float(match[0]), len(match[0].split("e")[0].lstrip("-").replace(".", "").lstrip("0")) or 1)
    lines = []
    for line in text.split("\n"):
        parts = re.split(r"(`[^`]*`)", line)
        for i in range(0, len(parts), 2):
            parts[i] = re.sub(r"(?<![\w.])\d+(?:\.\d+)?e[+-]\d\d\b", plain, parts[i])
            if line.startswith("|"):
                parts[i] = re.sub(r"(?<![\w.,/-])\d{5,9}(?=(?:\.\d+)?(?:[ ,;)%|]|$))", lambda m: f"{int(m[0]):,}", parts[i])
        lines.append("".join(parts))
    return "\n".join(lines)


def figures(text: str, pattern: str) -> list[tuple[str, ...]]:
    """All matches of a pattern in what a program prints. Without a match, the program has changed and the writer ends."""
    found = [match if isinstance(match, tuple) else (match,) for match in re.findall(pattern, text)]
    if not found:
        sys.exit(f"no line matches {pattern!r}: the program prints other lines than this writer expects")
    return found


def sections_of(page: str) -> dict[str, str]:
    """The sections of a page by their headings; its introduction has the name ''."""
    parts = re.split(r"\n(?=## )", "\n" + page.strip("\n"))
    return {part.split("\n", 1)[0][3:] if part.startswith("## ") else "": part.strip("\n") for part in parts}


def head(title: str, command: str, timed: bool = True, level: int = 1) -> str:
    """The head of a page, or of a section of level 2: command, date, commit, machine, and whether the machine did other work."""
    rows = [["date", f"{datetime.datetime.now(datetime.timezone.utc):%Y-%m-%d %H:%M} UTC"], ["commit", commit()]]
    if timed:
        cores, load = os.cpu_count() or 1, os.getloadavg()[0]
        busy = f"yes: load {load:.2f} on {cores} cores when the measurement began. Times are not comparable; measure again"
        rows += [["machine", f"{processor()}, {cores} cores"], ["other work on the machine", busy if load > cores / 4 else "no"]]
    else:
        rows += [["machine", "any: the figures do not depend on it"]]
    kind = "page" if level == 1 else "section"
    return f"{'#' * level} {title}\n\nWritten by `{command}`. Do not edit this {kind}; measure again.\n\n" + table(["", ""], rows)


def commit() -> str:
    """The commit of the sources, and whether sources differ from it. Pages may differ."""
    def git(*words: str) -> str:
        return subprocess.run(["git", "-C", ROOT, *words], stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True, check=False).stdout.strip()
    changed = git("status", "--porcelain", "--untracked-files=no", "--", ".", ":!docs", ":!*.md")
    return (git("rev-parse", "--short", "HEAD") or "unknown") + (", with changes that are not committed" if changed else "")


def processor() -> str:
    names = re.findall(r"^model name\s*: (.*)", pathlib.Path("/proc/cpuinfo").read_text(encoding="utf-8"), re.M)
    return names[0] if names else "unknown processor"


def parser_of(doc: str) -> argparse.ArgumentParser:
    """A parser with the options that all writers have."""
    parser = argparse.ArgumentParser(usage=doc.split("Usage: ")[1])
    parser.add_argument("-w", action="store_true")
    parser.add_argument("-b", default=str(ROOT / "build/release"))
    parser.add_argument("--data", metavar="DIR")
    return parser


def command_of(program: str, name: str, arguments: argparse.Namespace, parser: argparse.ArgumentParser) -> str:
    """The command that measures one part, with the options that were given. Directories of measured data are named DATA."""
    words = [program, "-w", *([name] if name else [])]
    for option, value in vars(arguments).items():
        if option in ("w", "b", "part") or value == parser.get_default(option):
            continue
        flag = "--" + option.replace("_", "-")
        # Directories of one's own machine.
        place = {"data": "DATA", "found": "DIR"}.get(option)
        text = place or (f"{value:g}" if isinstance(value, float) else shlex.quote(str(value)))
        words.append(flag if value is True else f"{flag}={text}" if " " in text or text.startswith("-") else f"{flag} {text}")
    return " ".join(words)


def write(page_name: str, title: str, introduction: str, parts: dict[str, Part], parser: argparse.ArgumentParser) -> None:
    """Measures the parts that the command line names, or all. With -w their sections of the page are written; others stay.
    A page of one part has no sections: its heading is the title, and its name is empty."""
    page, program = ROOT / "docs/results" / page_name, f"bench/{pathlib.Path(sys.argv[0]).name}"
    if list(parts) == [""]:
        arguments = parser.parse_args()
        text = measured(parts[""]._replace(heading=title), "", program, arguments, parser, introduction, level=1)
        if arguments.w:
            page.write_text(text + "\n", encoding="utf-8")
        return
    parser.add_argument("part", nargs="*")
    arguments = parser.parse_args()
    unknown = sorted(set(arguments.part) - set(parts))
    if unknown:
        parser.error(f"{unknown[0]}: parts are {', '.join(parts)}")
    for name in arguments.part or parts:
        text = measured(parts[name], name, program, arguments, parser)
        if not arguments.w:
            continue
        sections = sections_of(page.read_text(encoding="utf-8")) if page.exists() else {}
        sections[parts[name].heading] = text
        start = f"# {title}\n\n{introduction.strip()} Each section is written by `{program}`."
        ordered = [start, *(sections[p.heading] for p in parts.values() if p.heading in sections)]
        page.write_text("\n\n".join(ordered) + "\n", encoding="utf-8")


def measured(part: Part, name: str, program: str, arguments: argparse.Namespace, parser: argparse.ArgumentParser, introduction: str = "",
             level: int = 2) -> str:
    """Measures and prints a part, with its head."""
    # The head first: it holds the load and the commit of the beginning.
    top = head(part.heading, command_of(program, name, arguments, parser), part.timed, level)
    texts = [top, introduction, readable(part.measure(arguments))]
    text = "\n\n".join(text.strip("\n") for text in texts if text.strip("\n"))
    print(text + "\n", flush=True)
    return text


def main() -> None:
    words = sys.argv[1:]
    if len(words) == 3 and words[0] == "head":
        print(head(words[1], words[2]), end="")
    elif words == ["readable"]:
        print(readable(sys.stdin.read()), end="")
    else:
        sys.exit((__doc__ or "").split("\n\n")[-1].strip())


if __name__ == "__main__":
    main()
