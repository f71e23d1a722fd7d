#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Bones that a joint turns into each other: two boxes on a hinge, whose corners are followed by hand."""
import json
import pathlib
import shutil
import tempfile
import unittest

import numpy as np

from posed_files import run

UPPER = np.array([[-10, -14, 5], [10, 14, 90]])  # low and high corner, mm
LIMIT, TOUCHING = 5, 3  # mm: docs/reference/quality.md


def box(low, high):
    """Corners and triangles, seen from outside counter-clockwise."""
    corners = [(x, y, z) for z in (low[2], high[2]) for y in (low[1], high[1]) for x in (low[0], high[0])]
    return corners, [(0, 2, 1), (1, 2, 3), (4, 5, 6), (5, 7, 6), (0, 1, 4), (1, 5, 4), (2, 6, 3), (3, 6, 7), (0, 4, 2), (2, 4, 6), (1, 3, 5), (3, 7, 5)]


def depths(points, low, high):
    """Of points in a box; 0 outside."""
    return np.maximum(0, np.minimum(points - low, high - points).min(axis=1))


def overlap(lower, degrees):
    """How deep the lower box lies in the upper one, or the upper one in it, once it is turned about x, beyond what it does at rest."""
    c, s = np.cos(np.radians(degrees)), np.sin(np.radians(degrees))
    turn = np.array([[1, 0, 0], [0, c, -s], [0, s, c]])
    of_lower, of_upper = np.array(box(*lower)[0], float), np.array(box(*UPPER)[0], float)
    found = 0
    for points, there, within in ((of_lower, of_lower @ turn.T, UPPER), (of_upper, of_upper @ turn, lower)):
        rest = depths(points, *within)
        found = max(found, (depths(there, *within) - np.maximum(rest, min(TOUCHING, rest.max()))).max())
    return found


class BoneOverlap(unittest.TestCase):
    def setUp(self):
        self.folder = pathlib.Path(tempfile.mkdtemp())
        self.addCleanup(shutil.rmtree, self.folder)

    def body_of(self, lower):
        for name, (low, high) in {"skin": ([-30, -60, -110], [30, 60, 110]), "upper": UPPER, "lower": lower}.items():
            corners, faces = box(low, high)
            (self.folder / f"{name}.obj").write_text("".join("v %g %g %g\n" % tuple(p) for p in corners)
                                                     + "".join("f %d %d %d\n" % tuple(c + 1 for c in f) for f in faces))
        (self.folder / "skeleton.yaml").write_text(
            "ecorche_skeleton: 1\nname: two\nsegments:\n  above:\n    joint: {name: base, kind: free, center: [0, 0, 60]}\n"
            "  below:\n    parent: above\n    joint: {name: bend, kind: hinge, center: [0, 0, 0], sequence: [{flexion: x}], limits_deg: {flexion: [-120, 120]}}\n")
        (self.folder / "case.yaml").write_text(
            "name: boxes\nskeleton: skeleton.yaml\nskin: skin.obj\nbones:\n  - {name: upper_bone, file: upper.obj, segment: above}\n"
            "  - {name: lower_bone, file: lower.obj, segment: below}\n")
        model = self.folder / "boxes.hdf"
        done = run("preprocess", self.folder, "-o", model, "--voxel", "5")
        self.assertEqual(done.returncode, 0, done.stderr)
        return model

    def turned(self, model, degrees):
        (self.folder / "pose.yaml").write_text(f"ecorche_pose: 1\nskeleton: two\njoints: {{bend: {{flexion_deg: {degrees}}}}}\n")
        posed = self.folder / f"posed{degrees}"
        done = run("pose", model, "-o", posed, "--pose", self.folder / "pose.yaml", "--tissues", "none")
        self.assertEqual(done.returncode, 0, done.stderr)
        return done, json.loads((posed / "quality.json").read_text())

    def test_it_is_as_deep_as_the_corners_say(self):
        for lower in (np.array([[-4, -14, -90], [4, 14, -5]]),   # apart at rest
                      np.array([[-4, -12, -90], [4, 12, 7]]),    # 2 mm within each other at rest
                      np.array([[-4, -9, -90], [4, 9, 20]])):    # 5 mm, more than what touches
            model = self.body_of(lower)
            warned = set()
            for degrees in (0, 45, -70, 90):
                done, quality = self.turned(model, degrees)
                asked, found = overlap(lower, degrees), quality["bone_overlap"]
                self.assertAlmostEqual(found["mm"], asked, delta=1e-3, msg=f"{lower.tolist()} at {degrees}")
                told = [w for w in quality["warnings"] if w["kind"] == "bone_overlap"]
                self.assertEqual(len(told), 1 if asked > LIMIT else 0)
                warned.add(bool(told))
                if asked == 0:
                    self.assertEqual(found, {"mm": 0})
                    continue
                self.assertEqual({found["bone"], found["into"]}, {"upper_bone", "lower_bone"})
                of = lower if found["bone"] == "lower_bone" else UPPER
                self.assertTrue((np.abs(np.array(box(*of)[0]) - found["at_mm"]) < 1e-3).all(axis=1).any(), "a corner, in the scan")
                if told:
                    self.assertEqual(told[0]["joint"], "bend")
                    self.assertRegex(done.stdout, r"(?m)^  warning: lower_bone runs 6\.0 mm deeper into upper_bone than in the scan, more than 5 mm, at "
                                                  r".* by bend \(turn bend less, or look at its center and axes: ecorche rig CASE says how they were found\)")
            self.assertEqual(warned, {False, True} if lower[1, 2] < 0 else {False}, lower.tolist())


if __name__ == "__main__":
    unittest.main()
