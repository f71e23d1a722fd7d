# SPDX-License-Identifier: Apache-2.0
"""RESULTS.md beside a bench: what it printed, under the machine, date, commit and command that it was made by.

Every bench ends with `sys.exit(results.run(main))`. With `--results` among its words what it and its children print is kept, and when
main() has returned (0, or 1 where something that was asked does not hold) the page is replaced whole. Where main() raises, or ends the
program, the old page stays. Paths outside of the tree are cut to their last part: a page tells what was measured, not where data lies.
"""
import contextlib
import datetime
import os
import pathlib
import platform
import re
import shlex
import subprocess
import sys
import tempfile
import threading

ROOT = pathlib.Path(__file__).resolve().parents[1]


def run(main):
    """main()'s exit code; with `--results` among the words the page is written as well."""
    sys.stdout.reconfigure(line_buffering=True)  # in turn with what children print
    if "--results" not in sys.argv[1:]:
        return main()
    sys.argv.remove("--results")
    given, start = list(sys.argv), datetime.datetime.now().astimezone()
    code, printed = kept(main)
    entry = pathlib.Path(given[0]).resolve()
    text = without_places(page(entry, given[1:], start, sys.modules["__main__"].__doc__, printed), given[1:])
    replace(entry.parent / "RESULTS.md", text)
    print(f"wrote {entry.parent / 'RESULTS.md'}", file=sys.stderr)
    return code


def kept(main):
    """What main() returns, and what came to standard output meanwhile, which is shown as it comes."""
    sys.stdout.flush()
    shown, (read, write) = os.dup(1), os.pipe()
    chunks = []

    def copy():
        with open(read, "rb", buffering=0) as source, open(shown, "wb", buffering=0, closefd=False) as target:
            while chunk := source.read(1 << 16):
                target.write(chunk)
                chunks.append(chunk)

    os.dup2(write, 1)
    os.close(write)
    thread = threading.Thread(target=copy)
    thread.start()
    try:
        code = main()
    finally:
        sys.stdout.flush()
        os.dup2(shown, 1)  # closes the pipe's last end
        thread.join()
        os.close(shown)
    return code, b"".join(chunks).decode(errors="replace")


def page(entry, words, start, about, printed):
    command = shlex.join([str(entry.relative_to(ROOT)) if entry.is_relative_to(ROOT) else entry.name, *words])
    took = datetime.datetime.now().astimezone() - start
    head = {"command": f"`{command}`", "date": f"{start:%Y-%m-%d %H:%M %Z}, {took.total_seconds() / 60:.1f} minutes", "commit": commit(), **machine()}
    rows = "".join(f"| {name} | {value} |\n" for name, value in head.items())
    bench = str(entry.parent.relative_to(ROOT / "bench")) if entry.name == "run" else entry.name
    return f"<!-- SPDX-License-Identifier: Apache-2.0 -->\n# Results of bench/{bench}\n\n{(about or '').strip()}\n\n| | |\n|---|---|\n{rows}\n{printed.strip()}\n"


def without_places(text, words):
    """`text` without the place of the tree, and of what lies outside of it only the last part."""
    text = text.replace(f"{ROOT}/", "")
    for word in sorted({str(pathlib.Path(word).resolve()) for word in words if "/" in word} | set(words), key=len, reverse=True):
        path = pathlib.Path(word)
        if path.is_absolute() and not path.is_relative_to(ROOT):
            text = text.replace(word, path.name)
    return text


def commit():
    git = lambda *words: subprocess.run(["git", "-C", ROOT, *words], stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True).stdout.strip()  # noqa: E731
    # Pages of other benches and parts, made one after another, change nothing that is measured.
    pages = ("bench/*/RESULTS.md", "bench/RESULTS.md", "docs/results.md", "docs/pictures/results", "bench/scans/real/thumbnails")
    changed = git("status", "--porcelain", "--", ".", *(f":(exclude){page}" for page in pages))
    return (git("rev-parse", "--short=12", "HEAD") or "not in a repository") + (", with changes that are not committed" if changed else "")


def machine():
    facts = {}
    for file, pattern in (("/proc/cpuinfo", r"(?m)^model name\s*: (.*)$"), ("/proc/meminfo", r"(?m)^MemTotal:\s*(\d+)"),
                          ("/etc/os-release", r'(?m)^PRETTY_NAME="?([^"\n]*)')):
        found = re.search(pattern, pathlib.Path(file).read_text()) if pathlib.Path(file).is_file() else None
        facts[file] = found.group(1) if found else None
    memory = facts["/proc/meminfo"]
    return {"processor": f"{facts['/proc/cpuinfo'] or platform.machine()}, {len(os.sched_getaffinity(0))} cores",
            "memory": f"{int(memory) / (1 << 20):.0f} GiB" if memory else "unknown",
            "system": f"{facts['/etc/os-release'] or platform.system()}, {platform.system()} {platform.release()}", "compiler": compiler()}


def compiler():
    """That of the release build."""
    for file in sorted(ROOT.glob("build/release/CMakeFiles/*/CMakeCXXCompiler.cmake")):
        found = dict(re.findall(r'set\(CMAKE_CXX_COMPILER_(ID|VERSION) "([^"]*)"\)', file.read_text()))
        return f"{found.get('ID', '')} {found.get('VERSION', '')}"
    return "no release build"


def replace(path, text):
    with contextlib.ExitStack() as undo:
        with tempfile.NamedTemporaryFile("w", dir=path.parent, prefix=".RESULTS.", delete=False) as file:
            undo.callback(pathlib.Path(file.name).unlink, missing_ok=True)
            file.write(text)
        os.chmod(file.name, 0o644)
        os.replace(file.name, path)
