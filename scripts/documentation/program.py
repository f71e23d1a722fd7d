# SPDX-License-Identifier: Apache-2.0
"""The `ecorche` command as its help pages tell it: subcommands, their options, ranges, defaults and examples."""
import dataclasses
import functools
import os
import pathlib
import re
import subprocess

from documentation.pages import ROOT


COLUMN = 34  # of the words, as app/command_line.cpp sets it


def binary():
    """$ECORCHE_BIN, or the release build's."""
    return pathlib.Path(os.environ.get("ECORCHE_BIN", ROOT / "build" / "release" / "bin" / "ecorche")).resolve()


@functools.cache
def help_of(command=None):
    words = [str(binary()), *([command] if command else []), "--help"]
    done = subprocess.run(words, capture_output=True, text=True, timeout=60, check=True)
    return done.stdout


@dataclasses.dataclass
class Option:
    names: list          # ["-o", "--output"]; of a positional its name
    text: str
    type: str = ""       # TEXT, PATH, a|b|c, ...; empty for a flag
    range: str = ""      # "64 to 1048576"
    default: str = ""
    required: bool = False


@dataclasses.dataclass
class Group:
    title: str
    options: list


@dataclasses.dataclass
class Page:
    """A help page. The program's own (command None) has no example."""
    about: str
    usage: str
    positionals: list
    groups: list
    notes: list
    example: str


def option_of(head, text):
    names, _, value = head.partition(" ")
    required = value.endswith("(required)")
    value = value.removesuffix("(required)").strip()
    kind, _, default = value.partition("=")
    # TYPE:TYPE in [LOW - HIGH], or TYPE:what a check says of itself.
    kind, _, checked = kind.partition(":")
    bounds = re.search(r"\w+ in \[(.+?) - (.+?)\]", checked)
    return Option(re.sub(r"\{[^}]*\}", "", names).split(","), text, kind.strip(), " to ".join(bounds.groups()) if bounds else checked, default, required)


@functools.cache
def page(command):
    parts = re.split(r"\n\n+", help_of(command).strip())
    about, _, usage = parts[0].partition("\nUsage: ")
    out = Page(about.strip().rstrip("."), usage.strip(), [], [], [], "")
    for part in parts[1:]:
        lines = part.splitlines()
        title = re.fullmatch(r"([A-Z][\w -]*):", lines[0])
        if title and title[1] == "Subcommands":
            continue
        if title and len(lines) > 1 and lines[1].startswith("  "):
            options = [option_of(*row) for row in _rows(lines[1:])]
            if title[1] == "Positionals":
                out.positionals = options
            else:
                out.groups.append(Group(title[1], options))
        elif lines[0].startswith("Example: "):
            out.example = lines[0].removeprefix("Example: ")
        elif command:
            out.notes.append(" ".join(lines))
    return out


@functools.cache
def subcommands():
    """Name and one line of each, in the order of the help."""
    text = help_of()
    rows = _rows(text[text.index("Subcommands:"):].split("\n\n")[0].splitlines()[1:])
    return {head.split()[0]: words for head, words in rows}


@functools.cache
def options_of(command):
    """Every way to write an option of a subcommand, with those of the whole program."""
    return frozenset(name for page in (help_of(command), help_of()) for name in re.findall(r"(?<![\w-])(--?[a-zA-Z][\w-]*)", _heads(page)))


@functools.cache
def all_options():
    return frozenset().union(*(options_of(command) for command in subcommands()))


def _heads(page):
    return "\n".join(head for head, _ in _rows(page.splitlines()))


def _rows(lines):
    """(left, right) of the two columns of a help page. A left one that is too wide has its words on the next line."""
    rows = []
    for line, following in zip(lines, [*lines[1:], ""]):
        if not re.match(r"  \S", line):
            if line.startswith(" " * COLUMN) and rows:
                rows[-1][1] = (rows[-1][1] + " " + line.strip()).strip()
        elif following.startswith(" " * COLUMN) and "  " not in line.strip():
            rows.append([line.strip(), ""])
        else:
            rows.append([line[:COLUMN].strip(), line[COLUMN:].strip()])
    return [tuple(row) for row in rows]
