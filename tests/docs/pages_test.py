#!/usr/bin/env python3
"""Runs what the documentation shows, so that a reader who types it gets what the page says.

Usage: pages_test.py run --kilotwin PROGRAM PAGE.md       what the page's fenced blocks say, in order
       pages_test.py links [PAGE.md]...                   all relative links lead somewhere
       pages_test.py options --kilotwin PROGRAM [PAGE.md]...   all --options that pages name exist

Fenced blocks, by the words after the three backticks:
  sh run [needs=MODULE]    is run; needs: only if python3 has that module
  LANGUAGE file=NAME       is written to NAME in the current directory
  txtpb file=NAME          besides, `kilotwin check` must pass it
  txtpb model file=NAME    besides, it must be a model: `kilotwin check --model`
  txtpb fragment           part of an experiment: `kilotwin check` must pass it, with a group of robots if it has none
  c file=NAME              besides, `kilotwin build` must compile it, unless the word `raw` says that it is no robot's program
A comment `<!-- run: COMMAND -->` is a command that readers do not see. All of a page runs in one shell, which starts in a copy of
the repository's folders behaviours/ and experiments/, with HOME in a directory of its own, and ends at the first failure.
A code span of a how-to page that looks like part of an experiment (`arena { ... }`) must hold known fields only.
"""
import pathlib
import re
import shlex
import subprocess
import sys
import tempfile

ROOT = pathlib.Path(__file__).resolve().parents[2]
EOF = "END_OF_A_FILE_OF_THE_PAGE"


def pages_of_repository():
    listed = subprocess.run(["git", "-C", ROOT, "ls-files", "--cached", "--others", "--exclude-standard", "*.md"],
                            capture_output=True, text=True, check=False)
    names = listed.stdout.splitlines() if listed.returncode == 0 else \
        [str(page.relative_to(ROOT)) for page in ROOT.rglob("*.md") if "build" not in page.relative_to(ROOT).parts]
    return [ROOT / name for name in sorted(names) if (ROOT / name).is_file()]


def name_of(page):
    return page.relative_to(ROOT) if page.is_relative_to(ROOT) else page


def fenced_blocks(text):
    """Yields (line number, [words after the fence], content) per fenced block and per comment `run:`."""
    lines = text.splitlines()
    at = 0
    while at < len(lines):
        hidden = re.fullmatch(r"\s*<!-- run: (.*) -->", lines[at])
        fence = re.match(r"^(\s*)(`{3,})(.*)$", lines[at])
        if hidden:
            yield at + 1, ["sh", "run"], hidden.group(1)
        elif fence:
            begin = at
            content = []
            at += 1
            while at < len(lines) and lines[at].strip() != fence.group(2):
                content.append(lines[at][min(len(fence.group(1)), len(lines[at]) - len(lines[at].lstrip())):])
                at += 1
            yield begin + 1, fence.group(3).split(), "\n".join(content)
        at += 1


def has_module(name):
    return subprocess.run(["python3", "-c", f"import {name}"], capture_output=True, check=False).returncode == 0


def script_of(page, text):
    """What a reader would type, as one shell script."""
    script = ["set -euo pipefail"]

    def step(line, commands):
        script.append(f"echo {shlex.quote(f'--- {page}:{line}')} >&2")
        script.append(commands)

    for line, words, content in fenced_blocks(text):
        unknown = [word for word in words[1:] if not re.fullmatch(r"run|model|raw|fragment|(file|needs)=\S+", word)]
        if unknown:
            step(line, f"echo {shlex.quote(f'unknown word {unknown[0]} after the backticks')} >&2; exit 2")
        options = dict(word.split("=", 1) for word in words if "=" in word)
        language = words[0] if words else ""
        if "file" in options:
            name = shlex.quote(options["file"])
            step(line, f"cat > {name} <<'{EOF}'\n{content}\n{EOF}")
            if language == "txtpb" and "model" in words:
                script.append(f'kilotwin check --model {name} "$REPOSITORY/experiments/disperse.txtpb"')
            elif language == "txtpb":
                script.append(f"kilotwin check {name}")
            elif language == "c" and "raw" not in words:
                script.append(f'kilotwin build {name} -o "$HOME/shown.so"')
            elif language == "python":
                script.append(f"python3 -m py_compile {name}")
        elif language == "txtpb" and "fragment" in words:
            group = "" if re.search(r"^\s*robots\b", content, re.M) else \
                'robots { count: 9 behaviour: "behaviours/blink.c" }'
            step(line, f"cat > fragment.txtpb <<'{EOF}'\n{content}\n{group}\n{EOF}\nkilotwin check fragment.txtpb")
        elif language == "sh" and "run" in words:
            missing = [m for m in options.get("needs", "").split(",") if m and not has_module(m)]
            if missing:
                print(f"{page}:{line}: left out, python3 has no module {missing[0]}", file=sys.stderr)
            else:
                step(line, content)
    return "\n".join(script) + "\n"


def shown_fields(text):
    """Code spans that are part of an experiment."""
    prose = re.sub(r"^\s*(`{3,}).*?^\s*\1\s*$", "", text, flags=re.S | re.M)
    return [span for span in re.findall(r"`([^`\n]+)`", prose) if re.match(r"[a-z_]+ \{ .*\}$", span) and "..." not in span]


def check_shown_fields(kilotwin, page, text, folder):
    """Complaints about spans that are no part of an experiment. Their programs and poses are p.c and poses.csv."""
    (folder / "p.c").write_text((ROOT / "behaviours" / "blink.c").read_text(encoding="utf-8"), encoding="utf-8")
    (folder / "poses.csv").write_text("x_mm,y_mm,heading_deg\n0,0,90\n", encoding="utf-8")
    complaints = []
    for span in shown_fields(text):
        robots = "" if span.startswith("robots ") else 'robots { count: 1 behaviour: "p.c" layout { y_mm: 200 } }'
        file = folder / "span.txtpb"
        file.write_text(f"{span}\n{robots}\n", encoding="utf-8")
        result = subprocess.run([kilotwin, "check", file], capture_output=True, text=True, cwd=folder, check=False)
        if result.returncode:
            complaints.append(f"{page}: `{span}`: {result.stderr.strip()}")
    return complaints


def run_page(kilotwin, page):
    text = page.read_text(encoding="utf-8")
    name = name_of(page)
    with tempfile.TemporaryDirectory(prefix="kilotwin-page-") as scratch:
        folder = pathlib.Path(scratch)
        (folder / "home").mkdir()
        copy = folder / "repository"
        copy.mkdir()
        subprocess.run(["cp", "-r", ROOT / "behaviours", ROOT / "experiments", ROOT / "idl", copy], check=True)
        complaints = check_shown_fields(kilotwin, name, text, copy)
        for complaint in complaints:
            print(complaint, file=sys.stderr)
        script = script_of(name, text)
        environment = {"PATH": f"{pathlib.Path(kilotwin).parent}:/usr/local/bin:/usr/bin:/bin:/usr/sbin:/sbin",
                       "HOME": str(folder / "home"), "REPOSITORY": str(copy), "LC_ALL": "C.UTF-8"}
        result = subprocess.run(["bash"], input=script, text=True, cwd=copy, env=environment, check=False)
        if result.returncode:
            print(f"{name}: the commands after the last `---` above ended with status {result.returncode}", file=sys.stderr)
        return 1 if result.returncode or complaints else 0


def anchors(text):
    """The anchors of a page's headings, as GitHub makes them."""
    text = re.sub(r"^\s*(`{3,}|~{3,}).*?^\s*\1\s*$", "", text, flags=re.S | re.M)
    found = set(re.findall(r'<a (?:id|name)="([^"]+)"', text))
    for heading in re.findall(r"^#{1,6}\s+(.*?)\s*$", text, re.M):
        heading = re.sub(r"\[([^\]]*)\]\([^)]*\)", r"\1", heading)
        slug = re.sub(r"[^\w\- ]", "", heading.lower()).replace(" ", "-")
        number, unique = 0, slug
        while unique in found:
            number += 1
            unique = f"{slug}-{number}"
        found.add(unique)
    return found


def links(pages):
    """Complaints about links to files or headings that are not there."""
    complaints = []
    for page in pages:
        text = page.read_text(encoding="utf-8")
        shown = re.sub(r"^\s*(`{3,}|~{3,}).*?^\s*\1\s*$", lambda block: "\n" * block.group().count("\n"), text,
                       flags=re.S | re.M)
        shown = re.sub(r"`[^`\n]*`", "", shown)
        for found in re.finditer(r"\]\(([^)\s]+)\)", shown):
            target = found.group(1)
            where = f"{name_of(page)}:{shown.count(chr(10), 0, found.start()) + 1}"
            if re.match(r"[a-z]+:", target):
                continue
            path, _, anchor = target.partition("#")
            file = (page.parent / path).resolve() if path else page
            if not file.exists():
                complaints.append(f"{where}: {target} is not there")
            elif anchor and file.suffix == ".md" and anchor not in anchors(file.read_text(encoding="utf-8")):
                complaints.append(f"{where}: {target}: no such heading")
    return complaints


def options_of(kilotwin, *command):
    text = subprocess.run([kilotwin, *command, "--help"], capture_output=True, text=True, check=False).stdout
    return set(re.findall(r"(?<![\w-])--?[a-zA-Z][\w-]*", text)), text


def commands_of(kilotwin):
    """{command: its options}."""
    _, text = options_of(kilotwin)
    names = re.findall(r"^  ([a-z][a-z0-9]*) ", text[text.lower().find("subcommands"):], re.M)
    return {name: options_of(kilotwin, name)[0] for name in names}


def options(kilotwin, pages):
    """Complaints about options that pages name and programs do not have."""
    commands = commands_of(kilotwin)
    if "run" not in commands:
        return [f"{kilotwin} --help lists no commands"]
    known = set().union(*commands.values())
    for script in (ROOT / "scripts").iterdir():
        if script.is_file():
            known |= set(re.findall(r"(?<![\w-])--[a-z][\w-]*", script.read_text(encoding="utf-8", errors="replace")))
    complaints = []
    for page in pages:
        name = name_of(page)
        for number, line in enumerate(page.read_text(encoding="utf-8").splitlines(), 1):
            for found in re.finditer(r"(?:^|[\s`(/])kilotwin ([a-z][a-z0-9]*)((?: +[^\s`|&;#)]+)*)", line):
                command, rest = found.groups()
                if command not in commands:
                    # "kilotwin" followed by a word of running text is no command, but in code it is.
                    if found.group().lstrip().startswith("`") or line.startswith("    "):
                        complaints.append(f"{name}:{number}: kilotwin has no command {command}")
                    continue
                for option in re.findall(r"(?<=\s)--?[a-zA-Z][\w-]*", rest):
                    if option not in commands[command]:
                        complaints.append(f"{name}:{number}: kilotwin {command} has no option {option}")
            for option in re.findall(r"`(--[a-z][\w-]*)[^`]*`", line):
                if option not in known:
                    complaints.append(f"{name}:{number}: no command has an option {option}")
    return complaints


def main(arguments):
    if not arguments or arguments[0] not in ("run", "links", "options"):
        print(__doc__, file=sys.stderr)
        return 2
    what, rest = arguments[0], arguments[1:]
    kilotwin = ""
    if "--kilotwin" in rest:
        at = rest.index("--kilotwin")
        kilotwin = rest[at + 1]
        del rest[at:at + 2]
    pages = [pathlib.Path(page).resolve() for page in rest] or pages_of_repository()
    if what == "run":
        return max(run_page(kilotwin, page) for page in pages)
    complaints = links(pages) if what == "links" else options(kilotwin, pages)
    for complaint in complaints:
        print(complaint, file=sys.stderr)
    print(f"{len(pages)} pages, {len(complaints)} complaints")
    return 1 if complaints else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
