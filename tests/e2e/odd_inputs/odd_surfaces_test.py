#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Odd surfaces by the real command, row by row (surfaces.py): prepared, verified and posed with a verdict that is true, or refused with
one line that says where, what, and how to mend it, and nothing left behind.

What a prepared leg's pose must do is known without the command: the thigh stays, the shank turns about the knee."""
import concurrent.futures
import json
import os
import pathlib
import re
import shutil
import tempfile
import unittest

import numpy as np

import outcome
import shapes
import surfaces
from outcome import Prepared, Refused

TURN = np.deg2rad(30)
BONE_MM, FLESH_MM, ALONG = 0.01, 2.0, 120  # how true bones and skin are, and how far from the knee the skin must be
MOST_CHANGE = 0.1  # of the skin's volume, as docs/reference/quality.md has it


def turned(points):
    """By the knee's flexion about x."""
    c, s = np.cos(TURN), np.sin(TURN)
    return points @ np.array([[1, 0, 0], [0, c, -s], [0, s, c]]).T


class Row:
    def __init__(self, folder, name, files):
        self.place = folder / name
        self.place.mkdir()
        self.case = self.place / "case"
        self.case.mkdir()
        for file, content in files.items():
            (self.case / file).write_bytes(content.encode() if isinstance(content, str) else content)
        self.out = self.place / "out"
        self.out.mkdir()

    def prepare(self, case=None):
        return outcome.run("preprocess", case or self.case, "-o", self.out / "m.hdf", "--mesher", "lattice", "--max-tets", "20000")

    def not_mended(self, said):
        """What is wrong after doing what the refusal says."""
        advice = re.search(r"ecorche repair ((?:--[a-z-]+(?: [\d.]+)?)+)", said)
        if not advice:
            return ["no ecorche repair is advised"]
        mended = self.place / "mended"
        done = outcome.run("repair", self.case, "-o", mended, *advice.group(1).split())
        if done.returncode == 0:
            done = self.prepare(mended)
        return [] if done.returncode == 0 else [f"{advice.group()} does not mend it: {done.stderr[-300:]}"]

    def posed(self):
        (self.place / "pose.yaml").write_text(surfaces.POSE)
        return outcome.run("pose", self.out / "m.hdf", "-o", self.out / "posed", "--pose", self.place / "pose.yaml", "--tissues", "all")


def lies(row, files, verdict):
    """What the posed files show that the verdict does not."""
    out, mm = [], 1000 if "unit: m\n" in files["case.yaml"] else 1
    for name in sorted(path.stem for path in (row.out / "posed").glob("*.stl")):
        rest, posed = shapes.read_stl(row.case / f"{name}.stl") * mm, shapes.read_stl(row.out / "posed" / f"{name}.stl")
        if name == "skin":
            if verdict != "pass":
                continue
            still, far = rest[..., 2] > ALONG, rest[..., 2] < -ALONG
            for what, where, truth in (("above", still, rest), ("below", far, turned(rest.reshape(-1, 3)).reshape(rest.shape))):
                off = np.abs(posed - truth).max(-1)[where]
                if len(off) and off.max() > FLESH_MM:
                    out.append(f"passes, but skin {what} the knee is {off.max():.1f} mm off")
            continue
        segment = next(line for line in files["case.yaml"].splitlines() if f"name: {name}," in line).split("segment: ")[1].strip("} ")
        truth = rest if segment == "thigh" else turned(rest.reshape(-1, 3)).reshape(rest.shape)
        off = np.abs(posed - truth).max()
        if off > BONE_MM:
            out.append(f"{name} is {off:.3f} mm from where the {segment} carries it")
    return out


def wrong(folder, name, files, expected):
    """What of a row does not hold."""
    row = Row(folder, name, files)
    done = row.prepare()
    if isinstance(expected, Refused):
        return outcome.wrong_refusal(done, expected, row.out) + (row.not_mended(done.stderr) if expected.mended else [])
    if done.returncode != 0:
        return [f"is refused: {done.stderr[-300:]}"]
    problems = [f"{part!r} is not said: {done.stderr[-300:]}" for part in expected.said if part not in done.stderr]
    verified = outcome.run("verify", row.out / "m.hdf")
    if verified.returncode != 0:
        problems.append(f"is not verified: {verified.stderr[-300:]}")
    if expected.pose is None:
        return problems
    done = row.posed()
    if done.returncode != 0:
        return [*problems, f"is not posed: {done.stderr[-300:]}"]
    quality = json.loads((row.out / "posed" / "quality.json").read_text())
    if expected.verdict not in (None, quality["verdict"]):
        problems.append(f"{quality['verdict']}: {[w['what'] for w in quality['warnings']][:2]}")
    return problems + lies(row, files, quality["verdict"])


class OddSurfaces(unittest.TestCase):
    def hold(self, rows):
        names = [row[0] for row in rows]
        self.assertEqual(len(names), len(set(names)), "each row has its own name")
        folder = pathlib.Path(tempfile.mkdtemp())
        self.addCleanup(shutil.rmtree, folder)
        with concurrent.futures.ThreadPoolExecutor(2) as pool:
            found = pool.map(lambda row: wrong(folder, *row), rows)
            problems = [f"{name}: {'; '.join(some)}" for name, some in zip(names, found) if some]
        self.assertEqual(problems, [], f"\n{len(problems)} of {len(names)} rows:\n" + "\n".join(problems))

    def test_by_script(self):
        self.hold(surfaces.ROWS)

    @unittest.skipUnless("ECORCHE_DATA" in os.environ, "ECORCHE_DATA names no data sets")
    def test_of_the_data_sets(self):
        self.hold(surfaces.shape_rows(pathlib.Path(os.environ["ECORCHE_DATA"])))


if __name__ == "__main__":
    unittest.main(verbosity=2)
