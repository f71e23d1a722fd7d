# SPDX-License-Identifier: Apache-2.0
"""Subcommands and options that pages name exist: in code, tables and blocks of shell. And words that belong to measurements only."""
import functools
import re
import shlex
import subprocess

from documentation import program
from documentation.pages import ROOT

# Said of how a figure was measured, or of what came before it: the place of such words is bench/*/RESULTS.md.
MEASURED = [r"tried without", r"without gain", r"\bhours? (before|later|earlier)\b", r"\bjudg(e|es|ed|ing)\b", r"nothing (of ours )?beside",
            r"\b(loaded|quiet|busy) machine\b", r"\((wanted|asked):", r"in (two|three|four|several|other) (runs|hours)\b", r"\bbusy$"]
MAY_MEASURE = ("docs/explanation/limits", "CONTRIBUTING.md", "CHANGELOG.md")


def problems_of(page):
    for line, code in page.spans():
        yield from ((line, what) for what in in_code(code))
    for block in page.blocks:
        if block.language in ("sh", "text", ""):
            text = re.sub(r"\\\n\s*", " ", block.text)
            for offset, row in enumerate(text.splitlines()):
                for command in re.split(r"\|\|?|&&|;|\$\(", row):
                    if re.match(r"\s*(\w+=\S+ )*(\S*/)?ecorche\s", command):
                        yield from ((block.line + 1 + offset, what) for what in in_command(words_of(command)))


def words_of(command):
    try:
        return shlex.split(command, comments=True)
    except ValueError:  # a quote that ends on another line
        return command.split()


def in_code(code):
    """What is wrong with a `span` of code that may be a command line, or the names of options."""
    words = words_of(code)
    while words and re.fullmatch(r"\w+=\S*", words[0]):
        words = words[1:]
    if words and (words[0] == "ecorche" or words[0].endswith("/ecorche")) and len(words) > 1:
        yield from in_command(words)
    elif words and words[0] in program.subcommands() and len(words) > 1:
        yield from in_command(["ecorche", *words])
    else:
        for word in words:
            option = re.match(r"--[a-z][\w-]*", word)
            if option and len(words) > 0 and words[0].startswith("--") and not known_somewhere(option[0]):
                yield f"names {option[0]}, which neither ecorche nor a script has"


def in_command(words):
    """Words after `ecorche`: options of the program, the subcommand, its own options."""
    rest = words[1:]
    command = next((word for word in rest if not word.startswith("-")), None)
    if command is None or command.isupper() or command.startswith((".", "<", "...")):
        used, known, of = rest, program.all_options(), "ecorche"
    elif command not in program.subcommands():
        # `ecorche 1.2.3` and the like are no command lines.
        if re.fullmatch(r"[a-z]+", command):
            yield f"names the subcommand '{command}', which ecorche does not have"
        return
    else:
        used, known, of = rest, program.options_of(command), f"ecorche {command}"
    for word in used:
        option = re.match(r"--?[a-zA-Z][\w-]*", word)
        if option and option[0] not in known:
            yield f"names {option[0]}, which {of} does not have"


@functools.cache
def known_somewhere(option):
    """An option of any subcommand, or of anything else in the repository that is run."""
    if option in program.all_options():
        return True
    found = subprocess.run(["grep", "-rlFq", "--include=*", "-e", option, "scripts", "bench", "tests", "clients", "cmake"],
                           cwd=ROOT, capture_output=True)
    return found.returncode == 0


def measurement_words_of(page):
    if page.name.startswith(MAY_MEASURE):
        return
    for line, text in page.prose:
        for words in MEASURED:
            found = re.search(words, text, re.I)
            if found:
                yield line, f"says '{found[0]}': how something was measured belongs to bench/*/RESULTS.md"
