#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Man pages and completion say what the help says: all of it, in man, bash, zsh and fish themselves.

usage: manual_test.py MADE; the environment is that of the fixtures
"""
import gzip
import os
import pathlib
import pty
import re
import select
import shutil
import subprocess
import sys
import tempfile
import time
import unittest

ROOT = pathlib.Path(__file__).resolve().parents[3]
sys.path.insert(0, str(ROOT / "scripts"))

from documentation import program  # noqa: E402

MADE = pathlib.Path(sys.argv[1])
COMMANDS = list(program.subcommands())


def options_in_help(command):
    """Read from the help by another way than the pages are: whatever looks like an option at the left."""
    text = subprocess.run([os.environ["ECORCHE_BIN"], command, "--help"], capture_output=True, text=True, check=True).stdout
    heads = re.findall(r"^  (-\S+)", text, re.M)
    return {name.split("{")[0] for head in heads for name in head.split(",")}


def read(path):
    return gzip.decompress(path.read_bytes()).decode() if path.suffix == ".gz" else path.read_text()


def run(*words, **options):
    return subprocess.run([str(word) for word in words], capture_output=True, text=True, **options)


class Shell:
    """A real shell at a terminal, to which keys are sent."""

    def __init__(self, words, folder):
        self.pid, self.terminal = pty.fork()
        if self.pid == 0:
            os.chdir(folder)
            os.execvpe(words[0], words, {**os.environ, "HOME": folder, "TERM": "dumb", "PS1": "> "})

    def until(self, what, seconds=20):
        """What is shown up to the first match of a pattern, and the match."""
        text, end = "", time.monotonic() + seconds
        while not (found := re.search(what, text, re.S)):
            if time.monotonic() > end or not select.select([self.terminal], [], [], end - time.monotonic())[0]:
                raise AssertionError(f"no {what!r} in {text!r}")
            try:
                text += os.read(self.terminal, 4096).decode(errors="replace")
            except OSError:
                raise AssertionError(f"the shell ended: {text!r}")
        return found

    def type(self, keys):
        os.write(self.terminal, keys.encode())

    def close(self):
        os.close(self.terminal)
        os.kill(self.pid, 9)
        os.waitpid(self.pid, 0)


# What is typed, and the words that the command then gets.
TYPED = [("ecorche prep\t pat\t --mesh\t lattice_c\t", "preprocess patient.hdf --mesher lattice_cut"),
         ("ecorche pose patient.hdf --skinn\t dq\t", "pose patient.hdf --skinning dqs"),
         ("ecorche --js\t serve --max-hello-b\t 4096 --token-f\t sec\t", "--json serve --max-hello-bytes 4096 --token-file secret")]


class Manual(unittest.TestCase):
    def test_what_is_installed_is_what_is_made(self):
        with tempfile.TemporaryDirectory() as folder:
            made = run(ROOT / "scripts" / "manual", folder)
            self.assertEqual(made.returncode, 0, made.stderr)

            def texts(where):
                # The date is that of the last commit.
                return {str(path.relative_to(where)): re.sub(r"(?m)^(\.TH \S+ 1) \S+", r"\1", read(path))
                        for path in where.rglob("*") if path.is_file() and path.name != "made"}
            self.assertEqual(texts(MADE), texts(pathlib.Path(folder)))
            self.assertEqual(len(list(pathlib.Path(folder, "man1").iterdir())), len(COMMANDS) + 1)
        self.assertEqual(run(ROOT / "scripts" / "manual").returncode, 64)

    def test_every_option_has_its_paragraph(self):
        for command in COMMANDS:
            text = read(MADE / "man1" / f"ecorche-{command}.1.gz").replace("\\-", "-")
            heads = "\n".join(re.findall(r"(?m)^\.TP\n(.+)$", text))
            self.assertEqual(set(re.findall(r"\\fB(--?[a-z][^\\]*)\\fR", heads)), options_in_help(command), command)

    def test_man_finds_nothing_to_warn_of(self):
        for page in sorted((MADE / "man1").iterdir()):
            shown = run("man", "--warnings", "-E", "UTF-8", "-l", "-Tutf8", "-Z", page, env={**os.environ, "MANROFFSEQ": "", "MANWIDTH": "80"})
            self.assertEqual((shown.returncode, shown.stderr), (0, ""), page)
            lint = run("mandoc", "-T", "lint", input=read(page))
            self.assertEqual(lint.stdout + lint.stderr, "", page)

    def test_text_is_shown_as_it_stands(self):
        shown = run("mandoc", "-T", "ascii", MADE / "man1" / "ecorche-serve.1.gz").stdout
        plain = re.sub(".\b", "", shown)
        self.assertIn("ecorche-serve - serve models", plain)
        self.assertIn("show the viewer in this folder, as it is, in place of the program's own", re.sub(r"\s+", " ", plain).lower())
        self.assertIn("Default: 127.0.0.1:7070.", plain)

    def test_bash_offers_all_options_and_choices(self):
        script = ["compopt() { :; }", f"source {MADE / 'bash' / 'ecorche'}",
                  'ask() { COMP_WORDS=("$@"); COMP_CWORD=$(($# - 1)); COMPREPLY=(); _ecorche; echo "${COMPREPLY[@]}"; }', 'ask ecorche ""']
        for command in COMMANDS:
            script.append(f"ask ecorche {command} -")
        choices = [(command, option) for command in COMMANDS for group in program.page(command).groups for option in group.options if "|" in option.type]
        self.assertGreater(len(choices), 10)
        for command, option in choices:
            script.append(f"ask ecorche {command} x {option.names[-1]} ''")
        done = run("bash", "--norc", "-c", "\n".join(script))
        lines = done.stdout.splitlines()
        self.assertEqual((done.returncode, done.stderr, len(lines)), (0, "", 1 + len(COMMANDS) + len(choices)))
        self.assertEqual(lines[0].split(), COMMANDS)
        for command, line in zip(COMMANDS, lines[1:]):
            self.assertEqual(set(line.split()) - {"--json", "--threads", "--fail-on-warn"}, options_in_help(command) - {"--json"}, command)
        for (command, option), line in zip(choices, lines[1 + len(COMMANDS):]):
            self.assertEqual(line.split(), option.type.split("|"), (command, option.names))

    def typed(self, shell, lines, prepare):
        with tempfile.TemporaryDirectory() as folder:
            for name in ("patient.hdf", "secret"):
                pathlib.Path(folder, name).touch()
            # In a file: what a terminal echoes must not look like an answer.
            pathlib.Path(folder, ".prepare").write_text(prepare + "\necho READY\n")
            at = Shell(shell, folder)
            try:
                at.type("source ./.prepare\n")
                at.until("READY\r")
                for keys, words in lines:
                    # A tab, and then a moment: shells take what comes at once for pasted.
                    for part in re.findall(r"[^\t]+\t?", keys):
                        at.type(part)
                        time.sleep(0.3 if part.endswith("\t") else 0)
                    at.type("\n")
                    self.assertEqual(at.until("GOT<([^>]*)>")[1], words, keys)
            finally:
                at.close()

    def test_in_bash_itself(self):
        self.typed(["bash", "--norc", "--noprofile", "-i"], TYPED,
                   f"bind 'set bell-style none'\nsource {MADE / 'bash' / 'ecorche'}\necorche() {{ echo \"GOT<$*>\"; }}")

    @unittest.skipUnless(shutil.which("zsh"), "no zsh (scripts/setup --all)")
    def test_in_zsh_itself(self):
        self.typed(["zsh", "-f", "-i"], TYPED,
                   f"setopt no_beep\nautoload -Uz compinit\ncompinit -u -D\nsource {MADE / 'zsh' / '_ecorche'}\necorche() {{ print -r -- \"GOT<$*>\" }}")

    @unittest.skipUnless(shutil.which("fish"), "no fish (scripts/setup --all)")
    def test_in_fish_itself(self):
        asked = [("ecorche prep", {"preprocess"}), ("ecorche preprocess patient --mesh", {"--mesher"}),
                 ("ecorche preprocess patient --mesher lattice_c", {"lattice_cut"}), ("ecorche serve --max-hello-b", {"--max-hello-bytes"}),
                 ("ecorche serve --max-hello-bytes ", set())]
        lines = [line for line, _ in asked] + [f"ecorche {command} {dashes}" for command in COMMANDS for dashes in ("--", "-")]
        script = f"source {MADE / 'fish' / 'ecorche.fish'}\n" + "\n".join(f"complete -C '{line}'; echo ---" for line in lines)
        done = run("fish", "--no-config", "-c", script)
        self.assertEqual(done.stderr, "")
        answers = [{line.split("\t")[0] for line in part.split("\n") if line} for part in done.stdout.split("---\n")[:-1]]
        for (line, answer), said in zip(asked, answers):
            self.assertEqual(said, answer, line)
        answers = answers[len(asked):]
        for command, long, short in zip(COMMANDS, answers[::2], answers[1::2]):
            self.assertEqual(options_in_help(command) - long - short, set(), command)


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1])
