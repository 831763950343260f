"""Pages of docs/results: the one way in which a program of this folder writes them.

A page has parts. Each part is a section with a head of its own: command, date, commit, machine, load. So one part can be
measured anew without the others. The writer holds the whole page: its introduction, and the order of its sections. Measuring
programs print their tables as Markdown.
"""
import argparse
import pathlib
import re
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


def data_of(arguments: argparse.Namespace, name: str) -> pathlib.Path:
    """A set of measured data."""
    path = pathlib.Path(arguments.data or "") / name
    if not arguments.data or not path.exists():
        sys.exit(f"{path}: no measured data there; name their directory with --data")
    return path


def table(columns: list[str], rows: list[list[object]]) -> str:
    """A table in Markdown."""
    lines = ["| " + " | ".join(str(cell) for cell in line) + " |" for line in [columns, *rows]]
    return "\n".join([lines[0], "|" + "---|" * len(columns), *lines[1:]]) + "\n"


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


def section(text: str) -> tuple[str, str]:
    """Heading and text of a section, from a head as scripts/results-header prints it and what follows."""
    text = re.sub(r"\A#+ ", "## ", text).replace("Do not edit this page;", "Do not edit this section;", 1).strip("\n")
    return text.split("\n", 1)[0][3:], text


def put_section(page: pathlib.Path, text: str) -> None:
    """Replaces the section of the same heading, or adds it at the end."""
    sections = sections_of(page.read_text(encoding="utf-8"))
    heading, content = section(text)
    page.write_text("\n\n".join((sections | {heading: content}).values()) + "\n", encoding="utf-8")


def head(title: str, command: str, timed: bool = True) -> str:
    """The head of a page or section."""
    return output_of(ROOT / "scripts/results-header", title, command, *([] if timed else ["any-machine"]))


def parser_of(doc: str) -> argparse.ArgumentParser:
    """A parser with the options that all writers have."""
    parser = argparse.ArgumentParser(usage=doc.split("Usage: ")[1])
    parser.add_argument("-w", action="store_true")
    parser.add_argument("-b", default=str(ROOT / "build/release"))
    parser.add_argument("--data", metavar="DIR")
    return parser


def command_of(program: str, name: str, arguments: argparse.Namespace, parser: argparse.ArgumentParser) -> str:
    """The command that measures one part, with the options that were given. Measured data are named DATA."""
    words = [program, "-w", name]
    for option, value in vars(arguments).items():
        if option in ("w", "b", "part") or value == parser.get_default(option):
            continue
        words += [("-" if len(option) == 1 else "--") + option.replace("_", "-"), "DATA" if option == "data" else str(value)]
    return " ".join(words)


def write(page_name: str, title: str, introduction: str, parts: dict[str, Part], parser: argparse.ArgumentParser) -> None:
    """Measures the parts that the command line names, or all. With -w their sections of the page are written; others stay."""
    parser.add_argument("part", nargs="*")
    arguments = parser.parse_args()
    unknown = sorted(set(arguments.part) - set(parts))
    if unknown:
        parser.error(f"{unknown[0]}: parts are {', '.join(parts)}")
    program = f"bench/{pathlib.Path(sys.argv[0]).name}"
    page = ROOT / "docs/results" / page_name
    for name in arguments.part or parts:
        part = parts[name]
        # The head first: it holds the load and the commit of the beginning.
        text = head(part.heading, command_of(program, name, arguments, parser), part.timed) + "\n" + part.measure(arguments).strip("\n")
        print(text + "\n", flush=True)
        if not arguments.w:
            continue
        sections = sections_of(page.read_text(encoding="utf-8")) if page.exists() else {}
        sections.update([section(text)])
        start = f"# {title}\n\n{introduction.strip()} Each section is written by `{program}`."
        ordered = [start, *(sections[p.heading] for p in parts.values() if p.heading in sections)]
        page.write_text("\n\n".join(ordered) + "\n", encoding="utf-8")
