# SPDX-License-Identifier: Apache-2.0
"""Runs the ```sh blocks of a page, in order, by one shell, in a scratch folder of its own.

Directives (HTML comments, so that readers do not see them):

    <!-- docs-test: needs=phantom,model -->  of the page: what lies in the folder before the first block (WANTS below)
    <!-- docs-test: seconds=1200 -->         of the page: how long its commands may take together (default: 280)
    <!-- docs-test: background=7070 -->      the next block runs beside those that follow, which wait until its port answers
    <!-- docs-test: fails=1 -->              the next block ends with this exit code
    <!-- docs-test: skip=WHY -->             the next block is not run (its options are looked up all the same)
    <!-- docs-test: run                      commands that readers do not need, run where they stand
    printf 'x,y,z\\n0,0,900\\n' > points.csv
    -->

Where the kernel allows it, each page has a loopback of its own, so that pages that serve at the same port run side by side.
"""
import os
import pathlib
import re
import shutil
import signal
import subprocess
import tempfile
import time

from documentation import program
from documentation.pages import ROOT

SECONDS = 280  # a page's commands, all together; on an idle machine few need half a minute


def put_phantom(folder):
    """patient/: the small phantom as a case."""
    shutil.copytree(made("ECORCHE_CASE", lambda at: ["phantom", "-o", at, "--size", "small"]), folder / "patient")


def put_model(folder):
    """patient.hdf: its model."""
    case = made("ECORCHE_CASE", lambda at: ["phantom", "-o", at, "--size", "small"])
    shutil.copy(made("ECORCHE_MODEL", lambda at: ["preprocess", case, "-o", at, "--max-tets", "150000"]), folder / "patient.hdf")


def put_surfaces(folder):
    """my_patient/: skin and two bones as they come out of a segmentation, without case.yaml."""
    case = made("ECORCHE_CASE", lambda at: ["phantom", "-o", at, "--size", "small"])
    (folder / "my_patient").mkdir()
    for file in ("skin.stl", "bones/femur_right.stl", "bones/tibia_right.stl"):
        shutil.copy(pathlib.Path(case) / file, folder / "my_patient")


def put_repository(folder):
    """The folder stands for a clone: scripts/, clients/, examples/, ... are there."""
    for path in ROOT.iterdir():
        if path.name != ".git" and not (folder / path.name).exists():
            (folder / path.name).symlink_to(path)


def put_clone(folder):
    """The folder is a copy of the repository's sources, in which one may build."""
    shutil.copytree(ROOT, folder, dirs_exist_ok=True, symlinks=True, ignore=shutil.ignore_patterns(".git", "build", "node_modules", "__pycache__"))


WANTS = {"phantom": put_phantom, "model": put_model, "surfaces": put_surfaces, "repository": put_repository, "clone": put_clone}
_made = {}


def made(variable, command):
    """What tests/fixtures has made (by environment), or, by hand, what `command` makes once."""
    if variable in os.environ:
        return os.environ[variable]
    if variable not in _made:
        at = pathlib.Path(tempfile.mkdtemp(prefix="docs_")) / ("model.hdf" if variable.endswith("MODEL") else "case")
        subprocess.run([program.binary(), *command(at)], check=True, capture_output=True)
        _made[variable] = at
    return _made[variable]


def clean():
    for at in _made.values():
        shutil.rmtree(at.parent, ignore_errors=True)
    _made.clear()


def problems_of(page):
    """Of the directives, then the first block that does not do what it should."""
    wanted, problems, seconds = [], [], SECONDS
    for directive in page.directives:
        kind, _, value = directive.partition("=")
        if kind == "needs":
            wanted += value.split(",")
        elif kind == "seconds" and value.isdigit():
            seconds = int(value)
        elif not (kind in ("background", "fails") and value.isdigit() or kind == "skip" and value or directive.startswith("run\n")):
            problems.append((1, f"unknown directive 'docs-test: {directive.splitlines()[0]}'"))
    problems += [(1, f"needs '{name}' (known: {', '.join(WANTS)})") for name in wanted if name not in WANTS]
    problems += [(block.line, f"a block of {block.language}: write sh, so that it is run, or text")
                 for block in page.blocks if block.language in ("bash", "shell", "zsh", "console")]
    if problems or not any(block for block in page.commands()):
        return problems
    with tempfile.TemporaryDirectory() as scratch:
        folder = pathlib.Path(scratch)
        for name in wanted:
            WANTS[name](folder)
        return run_in(folder, script_of(page), seconds)


def script_of(page):
    """One script of all blocks. File descriptor 3 hears the line of the block that runs."""
    out = ["set -euo pipefail"]
    for block in page.blocks:
        code, beside, expected = block.text, None, None
        for directive in block.directives:
            kind, _, value = directive.partition("=")
            if directive.startswith("run\n"):
                out += [f"echo {block.line} >&3", directive[4:]]
            beside, expected = (value if kind == "background" else beside), (value if kind == "fails" else expected)
        if block.language != "sh" or any(directive.startswith("skip=") for directive in block.directives):
            continue
        out.append(f"echo {block.line} >&3")
        if beside:
            out += [f"{{ {code}}} &", f"waited=0; until (: <>/dev/tcp/127.0.0.1/{beside}) 2>/dev/null; do sleep 0.1; waited=$((waited + 1)); "
                    f"[ $waited -lt 300 ] || {{ echo 'nothing answers at port {beside}' >&2; exit 1; }}; done"]
        elif expected:
            out.append(f"code=0; ( set -e; {code}) || code=$?; [ $code = {expected} ] || {{ echo \"ended with $code\" >&2; exit 1; }}")
        else:
            out.append(code)
    return "\n".join(out) + "\n"


def own_loopback():
    """Words that run a command with a loopback of its own; none where the system does not let us."""
    words = ["unshare", "-rn"] if os.getuid() else ["unshare", "-n"]
    up = [*words, "sh", "-c", 'ip link set lo up && exec "$@"', "sh"]
    try:
        return up if subprocess.run([*up, "true"], capture_output=True).returncode == 0 else []
    except OSError:
        return []


def run_in(folder, script, seconds):
    # Pages that build find what the repository's own build left in the compiler's cache.
    environment = dict(os.environ, PATH=f"{program.binary().parent}:/usr/bin:{os.environ['PATH']}", HOME=str(folder), CCACHE_BASEDIR=str(folder),
                       CCACHE_NOHASHDIR="1", CCACHE_DIR=os.environ.get("CCACHE_DIR") or str(pathlib.Path.home() / ".cache/ccache"))
    heard, said = os.pipe()
    with tempfile.TemporaryFile("w+") as output:
        process = subprocess.Popen([*own_loopback(), "bash", "-c", f"exec 3>&{said}\n" + script], cwd=folder, env=environment, stdin=subprocess.DEVNULL,
                                   stdout=output, stderr=subprocess.STDOUT, pass_fds=[said], start_new_session=True)
        os.close(said)
        begun = time.monotonic()
        try:
            code = process.wait(seconds)
        except subprocess.TimeoutExpired:
            code = None
        finally:
            try:
                os.killpg(process.pid, signal.SIGKILL)  # what runs beside
            except ProcessLookupError:
                pass
            process.wait()
        lines = os.read(heard, 1 << 16).decode().split()
        os.close(heard)
        if code == 0:
            return []
        output.seek(0)
        tail = "\n".join("    " + line for line in re.sub(r".*\r", "", output.read()).splitlines()[-15:])
        what = f"still runs after {time.monotonic() - begun:.0f} s" if code is None else f"fails with {code}"
        return [(int(lines[-1]) if lines else 1, f"the block that begins here {what}:\n{tail}")]
