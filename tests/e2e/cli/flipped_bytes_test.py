#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""One byte of a model changed: `ecorche verify` says so, or the posed body is the same to the bit.

usage: flipped_bytes_test.py [COUNT]     (200; the slow test takes 10 000)

Every dataset is taken as often as any other, whatever its size, and a sixth of the bytes is none of a dataset: headers, and the room
between. ends with the counts; a change that nobody sees and that matters is a failure.
"""
import collections
import pathlib
import random
import sys
import tempfile

import h5py

from posed_files import MODEL, run

SEED = 27
TURNED = "shoulder_left: {flexion_deg: 40}, knee_right: {flexion_deg: 50}"


class Places:
    """Where in the file which dataset lies."""

    def __init__(self, path):
        self.size = path.stat().st_size
        self.datasets = []  # name, offset, bytes
        with h5py.File(path, "r") as file:
            file.visititems(lambda name, thing: self.add(name, thing))
        self.datasets.sort()
        self.inside = sorted((offset, offset + size) for _, offset, size in self.datasets)

    def add(self, name, thing):
        if isinstance(thing, h5py.Dataset) and thing.id.get_storage_size() > 0:
            self.datasets.append((name, thing.id.get_offset(), thing.id.get_storage_size()))

    def outside(self):
        """Every byte of no dataset."""
        at = 0
        for begin, end in self.inside + [(self.size, self.size)]:
            yield from range(at, begin)
            at = max(at, end)

    def draw(self, count):
        """(name, offset) of `count` bytes."""
        dice = random.Random(SEED)
        outside = list(self.outside())
        for i in range(count):
            if i % 6 == 5:
                yield "(no dataset)", dice.choice(outside)
            else:
                name, offset, size = dice.choice(self.datasets)
                yield name, offset + dice.randrange(size)


def group_of(name):
    """The dataset's group, without the names of tissues and volumes: what is counted together."""
    parts = name.split("/")
    if parts[0] == "ecorche" and len(parts) > 3:
        parts[2] = "*"
    return "/".join(parts[:-1]) or name


class Flips:
    def __init__(self, folder):
        self.folder = folder
        self.bytes = MODEL.read_bytes()
        self.model = folder / "flipped.hdf"
        self.pose = folder / "pose.yaml"
        self.pose.write_text(f"ecorche_pose: 1\nskeleton: phantom\njoints: {{{TURNED}}}\n")
        self.good = self.posed(MODEL)
        self.text = run("verify", MODEL).stdout
        self.dice = random.Random(SEED + 1)
        self.model.write_bytes(self.bytes)

    def posed(self, model):
        """Every byte of the posed body, or None where it is not made."""
        out = self.folder / "posed"
        if run("pose", model, "-o", out, "--pose", self.pose, "--tets").returncode != 0:
            return None
        return {file.name: file.read_bytes() for file in out.iterdir() if file.suffix not in (".json",)}

    def try_one(self, offset):
        """`told`, `harmless`, or what is wrong."""
        with self.model.open("r+b", buffering=0) as file:
            file.seek(offset)
            file.write(bytes([self.bytes[offset] ^ self.dice.randrange(1, 256)]))
        done = run("verify", self.model)
        try:
            if done.returncode == 65:
                return "told" if "flipped.hdf" in done.stdout + done.stderr else f"told without the file's name: {done.stderr}"
            if done.returncode != 0:
                return f"verify ended with {done.returncode}: {done.stderr}"
            if done.stdout != self.text:
                return "verify says that all is good, and measures something else"
            return "harmless" if self.posed(self.model) == self.good else "SILENT: verify says nothing, and the body is another"
        finally:
            with self.model.open("r+b", buffering=0) as file:
                file.seek(offset)
                file.write(self.bytes[offset:offset + 1])


def main(count):
    counts, wrong = collections.defaultdict(collections.Counter), []
    with tempfile.TemporaryDirectory() as folder:
        flips = Flips(pathlib.Path(folder))
        for name, offset in Places(MODEL).draw(count):
            found = flips.try_one(offset)
            kind = found if found in ("told", "harmless") else "wrong"
            counts[group_of(name)][kind] += 1
            if kind == "wrong":
                wrong.append(f"{name}, byte {offset} of the file: {found}")
    print(f"{'group':45} {'told':>7} {'harmless':>9} {'wrong':>6}")
    for group, kinds in sorted(counts.items()):
        print(f"{group:45} {kinds['told']:7} {kinds['harmless']:9} {kinds['wrong']:6}")
    total = sum(counts.values(), collections.Counter())
    print(f"{'all':45} {total['told']:7} {total['harmless']:9} {total['wrong']:6}")
    print(*wrong, sep="\n")
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main(int(sys.argv[1]) if len(sys.argv) > 1 else 200))
