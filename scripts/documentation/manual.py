# SPDX-License-Identifier: Apache-2.0
"""Man pages, made from the program's help: {file name: text}. Section 1, in the macros of man(7)."""
import datetime
import os
import re
import subprocess
import textwrap

from documentation import facts, program
from documentation.pages import ROOT

ABOUT = "poses a patient's whole anatomy"


def pages():
    names = program.subcommands()
    return {"ecorche.1": own_page(names), **{f"ecorche-{name}.1": page_of(name) for name in names}}


def date():
    """Of the release: $SOURCE_DATE_EPOCH, else of the last commit, else of the program."""
    seconds = os.environ.get("SOURCE_DATE_EPOCH")
    if not seconds:
        said = subprocess.run(["git", "-C", str(ROOT), "log", "-1", "--format=%ct"], capture_output=True, text=True)
        seconds = said.stdout.strip() or program.binary().stat().st_mtime
    return datetime.datetime.fromtimestamp(int(seconds), datetime.timezone.utc).strftime("%Y-%m-%d")


def version():
    return subprocess.run([str(program.binary()), "--version"], capture_output=True, text=True, check=True).stdout.strip()


def escaped(text):
    """Text as it stands, in lines: no escape of roff, no line that begins with a request; a hyphen that is typed stays one."""
    return "\n".join(map(_line, textwrap.wrap(text, 72, break_long_words=False, break_on_hyphens=False)))


def _line(text):
    text = text.replace("\\", "\\e").replace("-", "\\-").replace("'", "\\(aq").replace("`", "\\(ga").replace("^", "\\(ha").replace("~", "\\(ti")
    text = re.sub(r"[^\x00-\x7f]", lambda letter: f"\\[u{ord(letter[0]):04X}]", text)
    return "\\&" + text if text.startswith(".") else text


def bold(text):
    return f"\\fB{escaped(text)}\\fR"


def italic(text):
    return f"\\fI{escaped(text)}\\fR"


def tagged(option, positional):
    value = ""
    if option.type and positional:
        value = f" ({escaped(option.type)})" if option.type != option.names[0] else ""
    elif option.type:
        value = " " + " | ".join(map(bold, option.type.split("|"))) if "|" in option.type else " " + italic(option.type)
    words = [escaped(f"{option.text[0].upper()}{option.text[1:]}.")] if option.text else []
    if option.range:
        words.append(escaped(f"Takes {option.range}."))
    if option.required:
        words.append("Required.")
    elif option.default:
        words.append(f"Default: {bold(option.default)}.")
    names = italic(option.names[0]) if positional else ", ".join(map(bold, option.names))
    return f".TP\n{names}{value}\n" + "\n".join(words or ["\\&"])


def heading(name):
    upper = name.upper().replace("-", "\\-")
    return f'.\\" SPDX-License-Identifier: Apache-2.0\n.\\" Made by scripts/manual from the program\'s help.\n.TH {upper} 1 {date()} "ecorche {version()}" "User Commands"'


def synopsis(usage):
    words = usage.split()
    name = [word for word in words[:2] if re.fullmatch(r"[a-z]+", word)]
    return " ".join([*map(bold, name), *(escaped(word) for word in words[len(name):])])


def exit_status():
    rows = [row.split(" | ") for row in facts.exit_codes().splitlines()[2:]]
    meanings = [("0", "done"), ("1", "with \\-\\-fail\\-on\\-warn: something was warned of"), *((row[0].strip("| "), escaped(row[2])) for row in rows)]
    return [".SH EXIT STATUS", *(f".TP\n{bold(code)}\n{meaning[0].upper()}{meaning[1:]}." for code, meaning in meanings)]


def options_of(page):
    out = []
    for group in page.groups:
        out += [f".SH {escaped(group.title.upper())}", *(tagged(option, False) for option in group.options)]
    return out


def page_of(name):
    page = program.page(name)
    out = [heading(f"ecorche-{name}"), ".SH NAME", f"ecorche\\-{name} \\-\n{escaped(page.about)}", ".SH SYNOPSIS", synopsis(page.usage)]
    if page.notes:
        out += [".SH DESCRIPTION", "\n.PP\n".join(map(escaped, page.notes))]
    if page.positionals:
        out += [".SH ARGUMENTS", *(tagged(option, True) for option in page.positionals)]
    out += options_of(page)
    out += [".SH EXAMPLES", ".nf", _line(page.example), ".fi", ".SH EXIT STATUS", f"{bold('0')} when all was done; others are listed in", ".BR ecorche (1).",
            ".SH SEE ALSO", ".BR ecorche (1),", "which has the options of every command."]
    return "\n".join(out) + "\n"


def own_page(names):
    page = program.page(None)
    out = [heading("ecorche"), ".SH NAME", f"ecorche \\- {escaped(ABOUT)}", ".SH SYNOPSIS", synopsis(page.usage), ".SH DESCRIPTION", escaped(page.about) + ".",
           "Results go to standard output, everything else to standard error.", ".SH COMMANDS"]
    out += [f".TP\n.BR ecorche\\-{name} (1)\n{escaped(words[0].upper() + words[1:])}." for name, words in names.items()]
    out += [*options_of(page), *exit_status(), ".SH SEE ALSO"]
    out += [f".BR ecorche\\-{name} (1){',' if name != list(names)[-1] else ''}" for name in names]
    return "\n".join(out) + "\n"
