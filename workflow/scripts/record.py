# SPDX-License-Identifier: Apache-2.0
"""The records of steps, OUT/sub-XX/steps/STEP.json: written whole or not at all, and taken back where they no longer hold."""
import hashlib
import json
import os
import pathlib

# A file's time may be rounded where the record's is not.
GRAIN_NS = 2_000_000


def write_text(path, text):
    path = pathlib.Path(path)
    path.parent.mkdir(parents=True, exist_ok=True)
    part = path.parent / f".{os.getpid()}.part.{path.name}"
    part.write_text(text, encoding="utf-8")
    with open(part, "rb") as file:
        os.fsync(file.fileno())
    os.replace(part, path)


def write(folder, step, record):
    write_text(folder / "steps" / f"{step}.json", json.dumps(record, indent=1, sort_keys=True) + "\n")


def sha256(path):
    found = hashlib.sha256()
    with open(path, "rb") as file:
        while block := file.read(1 << 20):
            found.update(block)
    return found.hexdigest()


def digests(files, root):
    """By path from `root` where they lie under it."""
    name = lambda path: str(pathlib.Path(path).relative_to(root)) if pathlib.Path(path).is_relative_to(root) else str(path)  # noqa: E731
    return {name(path): sha256(path) for path in files if os.path.isfile(path)}


def files_of(path):
    return sorted(file for file in path.rglob("*") if file.is_file()) if path.is_dir() else [path]


MEASURED = ("report.html",)  # holds times: no run gives the same bytes


def products(folder, names):
    return [{"file": str(file.relative_to(folder)), "bytes": None if file.name in MEASURED else file.stat().st_size}
            for name in names for file in files_of(folder / name)]


def holds(path):
    """Whether what a record vouches for is there, as long as it was and not written since; and no machine is to be tried again."""
    try:
        found, written = json.loads(path.read_text()), path.stat().st_mtime_ns + GRAIN_NS
        if found["fault"] == "machine":
            return False
        for product in found["products"]:
            file = (path.parent.parent / product["file"]).stat()
            if product["bytes"] not in (None, file.st_size) or file.st_mtime_ns > written:
                return False
    except (OSError, ValueError, KeyError, TypeError):
        return False
    return True


CHAIN = ("new", "check", "repair", "preprocess", "verify")  # each reads what the one before has made; then poses, then the subject


def take_back(out, names):
    """Removes every record of these participants that does not hold, and those of all steps that follow: Snakemake asks only for what
    is wanted in the end, and would leave a gap in the middle."""
    for name in names:
        folder = pathlib.Path(out) / name / "steps"
        records = {path.stem: path for path in folder.glob("*.json")}
        good = {step: holds(path) for step, path in records.items()}
        gap = next((i for i, step in enumerate(CHAIN) if not good.get(step, step == "new")), len(CHAIN))
        lost = {step for step in records if not good[step] or (CHAIN.index(step) if step in CHAIN else len(CHAIN)) > gap}
        for step in lost | ({"subject"} & set(records) if lost else set()):
            records[step].unlink(missing_ok=True)
