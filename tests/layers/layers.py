#!/usr/bin/env python3
"""Checks the includes of all sources against the tables of ARCHITECTURE.md, section "Layers".

Usage: tests/layers/layers.py [ROOT]      (default: the repository)

The first table has a row per layer: patterns of files, purpose, patterns of layers that these files may include. The second one
has rows of files and what these never include. Findings go to stdout, a line each, with exit status 1:
  FILE:LINE: a layer that includes what its row does not have
  ARCHITECTURE.md:LINE: an entry that nothing uses, a layer without files
  folders, headers, or in core also sources with their headers, that include each other in a circle, with its includes
"""
import fnmatch
import os
import re
import sys

HERE = os.path.dirname(os.path.abspath(__file__))
PAGE = "ARCHITECTURE.md"
FOLDERS = ("core", "services", "clients", "tests", "bench")
SOURCES = (".c", ".cpp", ".h", ".hpp")
# Programs of robots, and their runtime: they see what the compiler of behaviours gives them.
SKIPPED = ("tests/services/behaviours/corpus/", "bench/cycles/", "services/behaviours/runtime/")
# Folders in which a source with its header and another one may refer to each other, as a factory does to what it makes.
CIRCLES_ALLOWED = ("core/federation/", "services/", "clients/", "tests/", "bench/")
GENERATED = {"frames.h": "wire", "session.h": "wire", "public.h": "wire", "ros2.h": "wire"}
INCLUDE = re.compile(r'\s*#\s*include\s+(?:"([^"]+)"|(<[^>]+>))')


def lines_of(path):
    with open(path, encoding="utf-8", errors="replace") as file:
        return file.readlines()


def alternatives(pattern):
    """a/{b,c}.* is a/b.* and a/c.*"""
    match = re.match(r"(.*)\{([^}]*)\}(.*)", pattern)
    return [match[1] + one + match[3] for one in match[2].split(",")] if match else [pattern]


def matches(path, pattern):
    """Whether the file lies in the folder `pattern`, or its path matches it."""
    return path.startswith(pattern + "/") or fnmatch.fnmatchcase(path, pattern)


class Table:
    """layers: (line, pattern, allowed patterns); never: (line, pattern, refused pattern)."""

    def __init__(self, page):
        self.layers, self.never = [], []
        in_section = False
        for number, line in enumerate(lines_of(page), 1):
            if line.startswith("## "):
                in_section = line.strip() == "## Layers"
            cells = [re.findall(r"`([^`]+)`", cell) for cell in line.strip().strip("|").split("|")]
            if not in_section or not line.startswith("| `"):
                continue
            if len(cells) == 3:
                self.layers.append((number, cells[0][0], cells[2]))
            elif len(cells) == 2:
                self.never.append((number, cells[0][0], cells[1][0]))

    def layer_of(self, path):
        """The line with the longest pattern that matches; None: no line has the file."""
        best, length = None, -1
        for layer in self.layers:
            for pattern in alternatives(layer[1]):
                if matches(path, pattern) and len(pattern) > length:
                    best, length = layer, len(pattern)
        return best


def resolved(root, path, target):
    """The included file from the root, or "pb" or "wire" for generated ones; None: not one of ours."""
    beside = os.path.normpath(os.path.join(os.path.dirname(path), target))
    if os.path.exists(os.path.join(root, beside)):
        return beside
    if target.endswith(".pb.h"):
        return "pb"
    if "/" in target:
        return target
    return GENERATED.get(target)


def includes(root):
    """(file, line number, included text, resolved file) of every include."""
    for folder in FOLDERS:
        for place, _, names in sorted(os.walk(os.path.join(root, folder))):
            for name in sorted(names):
                path = os.path.relpath(os.path.join(place, name), root)
                if not name.endswith(SOURCES) or path.startswith(SKIPPED):
                    continue
                for number, line in enumerate(lines_of(os.path.join(root, path)), 1):
                    match = INCLUDE.match(line)
                    if match and match[1]:
                        yield path, number, match[1], resolved(root, path, match[1])
                    elif match:
                        yield path, number, match[2], match[2]


def cycle(edges):
    """A list of nodes each of which includes the next, the first one again at the end; empty: there is none."""
    done, path = set(), []

    def visit(node):
        if node in path:
            return path[path.index(node):] + [node]
        if node in done:
            return []
        path.append(node)
        for after in sorted(edges.get(node, {})):
            found = visit(after)
            if found:
                return found
        path.pop()
        done.add(node)
        return []

    for node in sorted(edges):
        found = visit(node)
        if found:
            return found
    return []


def check(root, table):
    findings, used, populated = [], set(), set()
    folders, headers, units = {}, {}, {}
    for path, number, text, target in includes(root):
        layer = table.layer_of(path)
        if layer is None:
            findings.append(f"{path}:{number}: {PAGE} has no row for this file")
            continue
        populated.add(layer[1])
        if target is None:
            continue
        for _, files, what in table.never:
            if fnmatch.fnmatchcase(target, what) and any(matches(path, one) for one in alternatives(files)):
                findings.append(f"{path}:{number}: {files} may never include {what}, here {text}")
        if target.startswith("<"):
            continue
        other = table.layer_of(target) if target not in ("pb", "wire") else (0, target, [])
        if other is None:
            findings.append(f"{path}:{number}: {text} belongs to no row of {PAGE}")
            continue
        if other is not layer:
            granted = [entry for entry in layer[2] if fnmatch.fnmatchcase(other[1], entry)]
            used.update((layer[1], entry) for entry in granted)
            if not granted:
                allowed = " ".join(layer[2]) or "nothing"
                findings.append(f"{path}:{number}: {layer[1]} may not include {text} of {other[1]}; it may include {allowed}")
        if target in ("pb", "wire"):
            continue
        where = f"{path}:{number}"
        if os.path.dirname(path) != os.path.dirname(target):
            folders.setdefault(os.path.dirname(path), {}).setdefault(os.path.dirname(target), where)
        headers.setdefault(path, {}).setdefault(target, where)
        unit, other_unit = os.path.splitext(path)[0], os.path.splitext(target)[0]
        if unit != other_unit and not unit.startswith(CIRCLES_ALLOWED):
            units.setdefault(unit, {}).setdefault(other_unit, where)
    for number, name, entries in table.layers:
        if name not in populated and any(os.path.isdir(os.path.join(root, folder)) for folder in alternatives(name)):
            continue  # a folder whose files include nothing
        if name not in populated:
            findings.append(f"{PAGE}:{number}: {name} has no files")
            continue
        findings += [f"{PAGE}:{number}: nothing of {name} includes {entry}; remove it"
                     for entry in entries if (name, entry) not in used]
    for what, edges in (("folders", folders), ("headers", headers), ("sources", units)):
        found = cycle(edges)
        if found:
            steps = ", ".join(f"{a} -> {b} ({edges[a][b]})" for a, b in zip(found, found[1:]))
            findings.append(f"{what} include each other in a circle: {steps}")
    return findings


def main(arguments):
    root = arguments[0] if arguments else os.path.dirname(os.path.dirname(HERE))
    findings = check(root, Table(os.path.join(root, PAGE)))
    print("\n".join(findings) if findings else "layers: all includes are allowed")
    return 1 if findings else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
