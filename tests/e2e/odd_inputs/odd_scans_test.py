#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Odd scans by the real command, row by row (scans.py): prepared with joints and a verdict that are true, or refused with one line that
says where, what, and how to mend it, and nothing left behind. With `quick` as a word some of the rows only.

Where the joints are is known from the phantom (truth.yaml): one that is found with confidence lies there."""
import concurrent.futures
import copy
import json
import pathlib
import shutil
import sys
import tempfile
import unittest

import numpy as np
import yaml

import outcome
import scans
import shapes
from outcome import Refused

SURE, MOST_MM = 0.5, 30  # a joint found with such confidence lies no farther from the truth
RIGID_MM, MOST_CHANGE = 0.01, 0.1
QUICK = {"plain_legs", "legs_without_body_and_ct", "left_handed", "oblique", "sheared", "one_bone_alone", "tibia_without_fibula", "cut_at_thigh_and_shank",
         "sheared_masks", "empty_labels", "wrong_names", "names_of_sides_exchanged", "labels_with_fractions", "labels_in_colours", "file_cut_short", "one_foot_with_side"}


def truths(folder):
    """Joint to its centre, LPS mm, by the phantom's own names."""
    segments = yaml.safe_load((folder / "truth.yaml").read_text())["segments"]
    return {one["joint"]["name"]: np.array(one["joint"]["center"], float) for one in segments.values()}


class Row:
    def __init__(self, folder, name, base, write):
        self.place = folder / name
        (self.place / "scan").mkdir(parents=True)
        self.out = self.place / "out"
        self.out.mkdir()
        self.scan = copy.deepcopy(base)
        given = write(self.place / "scan", self.scan)
        self.made = outcome.run("--json", "new", *given, "-o", self.out / "case")
        self.done = self.made
        if self.made.returncode == 0:
            self.done = outcome.run("preprocess", self.out / "case", "-o", self.out / "m.hdf", "--mesher", "lattice", "--max-tets", "40000")

    def told(self):
        """All that was said to the user."""
        said = json.loads(self.made.stdout) if self.made.returncode == 0 else {}
        fates = "".join(f"{label['name']}: {label['became']} ({label['how']})\n" for label in said.get("labels", ()))
        return "\n".join([*said.get("doubts", ()), *said.get("notes", ()), said.get("skin", {}).get("how", ""), fates, self.made.stderr, self.done.stderr])

    def rig(self):
        return json.loads(outcome.run("--json", "info", self.out / "m.hdf").stdout)["rig"]

    def false_joints(self, truth):
        """Those that are sure and far from where they are."""
        turn = np.diag([-1, -1, 1, 1]) @ self.scan.space @ np.diag([-1, -1, 1, 1])
        out = []
        for row in self.rig():
            name = row["joint"]
            if self.scan.exchanged:
                name = {"left": name[:-4] + "right", "right": name[:-5] + "left"}.get(name.rsplit("_", 1)[-1], name)
            if name not in truth or row["fit"]["confidence"] < SURE or row["fit"]["rule"] == "root":
                continue
            off = np.linalg.norm(np.array(row["center_mm"]) - (turn @ [*truth[name], 1])[:3])
            if off > MOST_MM:
                out.append(f"{row['joint']} is sure by {row['fit']['confidence']:.2f} and {off:.0f} mm off")
        return out

    def lies(self):
        """Posed by one of its joints: what its files show that its verdict does not."""
        bent = [row for row in self.rig() if row["angles"]]
        bent = [row for row in bent if row["joint"].startswith("knee")] or bent
        pose = {"ecorche_pose": 1, "skeleton": "human", "joints": {bent[0]["joint"]: {bent[0]["angles"][0]["name"] + "_deg": 30}} if bent else {}}
        (self.place / "pose.yaml").write_text(yaml.safe_dump(pose))
        (self.place / "rest.yaml").write_text("ecorche_pose: 1\nskeleton: human\n")
        for name in ("rest", "pose"):
            done = outcome.run("pose", self.out / "m.hdf", "-o", self.out / name, "--pose", self.place / f"{name}.yaml", "--tissues", "all")
            if done.returncode != 0:
                return [f"is not posed: {done.stderr[-300:]}"]
        verdict = json.loads((self.out / "pose/quality.json").read_text())["verdict"]
        case = yaml.safe_load((self.out / "case/case.yaml").read_text())
        out = []
        for name in ["skin", *(bone["name"] for bone in case["bones"])]:
            rest, posed = (shapes.read_stl(self.out / folder / f"{name}.stl") for folder in ("rest", "pose"))
            if name == "skin":
                change = shapes.volume(posed - rest.mean((0, 1))) / shapes.volume(rest - rest.mean((0, 1))) - 1
                if verdict == "pass" and abs(change) > MOST_CHANGE:
                    out.append(f"passes, but the skin's volume changes by {100 * change:.0f} %")
                continue
            sides = [np.linalg.norm(t - np.roll(t, 1, 1), axis=2) for t in (rest, posed)]
            if np.abs(sides[0] - sides[1]).max() > RIGID_MM:
                out.append(f"{name} is bent by {np.abs(sides[0] - sides[1]).max():.3f} mm")
        return out


def wrong(folder, name, base, truth, write, expected):
    """What of a row does not hold."""
    row = Row(folder, name, base, write)
    if isinstance(expected, Refused):
        return outcome.wrong_refusal(row.done, expected, row.out) if row.done is row.made else [f"is refused late or not: {row.done.stderr[-300:]}"]
    if row.done.returncode != 0:
        return [f"is refused: {row.done.stderr[-300:]}"]
    told = row.told()
    problems = [f"{part!r} is not said" for part in expected.said if part not in told]
    problems += row.false_joints(truth) + row.lies()
    shutil.rmtree(row.place)
    return problems


class OddScans(unittest.TestCase):
    rows = scans.ROWS

    def test_every_row(self):
        names = [row[0] for row in self.rows]
        self.assertEqual(len(names), len(set(names)), "each row has its own name")
        folder = pathlib.Path(tempfile.mkdtemp())
        self.addCleanup(shutil.rmtree, folder)
        done = outcome.run("phantom", "-o", folder / "phantom", "--size", "small", "--scan", "totalsegmentator_ml")
        self.assertEqual(done.returncode, 0, done.stderr)
        base, truth = scans.Scan(folder / "phantom"), truths(folder / "phantom")
        with concurrent.futures.ThreadPoolExecutor(2) as pool:
            found = pool.map(lambda row: wrong(folder, row[0], base, truth, *row[1:]), self.rows)
            problems = [f"{name}: {'; '.join(some)}" for name, some in zip(names, found) if some]
        self.assertEqual(problems, [], f"\n{len(problems)} of {len(names)} rows:\n" + "\n".join(problems))


if __name__ == "__main__":
    if "quick" in sys.argv[1:]:
        sys.argv.remove("quick")
        OddScans.rows = [row for row in scans.ROWS if row[0] in QUICK]
    unittest.main(verbosity=2)
