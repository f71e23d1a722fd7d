#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""`ecorche probe`: points there and back, what is said of them, and what is refused."""
import csv
import json
import pathlib
import re
import shutil
import tempfile
import unittest

import numpy as np

from posed_files import CASE, MODEL, corners, run

AWAY = "ecorche_pose: 1\nskeleton: phantom\njoints:\n  knee_right: {flexion_deg: 50}\n  elbow_left: {flexion_deg: 60}\n"


class Probe(unittest.TestCase):
    def setUp(self):
        self.folder = pathlib.Path(tempfile.mkdtemp())
        self.addCleanup(shutil.rmtree, self.folder)
        (self.folder / "away.yaml").write_text(AWAY)

    def table(self, text, *words):
        (self.folder / "points.csv").write_text(text)
        out = self.folder / "out.csv"
        result = run("probe", MODEL, "--points", self.folder / "points.csv", "-o", out, *words)
        self.assertEqual(result.returncode, 0, result.stderr)
        with out.open() as file:
            return list(csv.DictReader(file))

    def assert_error(self, text, code, *parts, words=()):
        (self.folder / "bad.csv").write_text(text)
        result = run("probe", MODEL, "--points", self.folder / "bad.csv", *words)
        self.assertEqual(result.returncode, code, result.stderr)
        self.assertRegex(result.stderr, re.compile(r"^error: .+: .+ \(.+\)$", re.M))
        for part in parts:
            self.assertIn(part, result.stderr)

    def inside_of(self, path):
        """Some of a piece that is convex enough, well within it."""
        points = corners(CASE / path).reshape(-1, 3)
        middle = points.mean(axis=0)
        return (middle + 0.3 * (points - middle))[:: max(1, len(points) // 20)]

    def text_of(self, points):
        return "x,y,z\n" + "".join("%.9g,%.9g,%.9g\n" % tuple(p) for p in points)

    def at(self, rows, prefix=""):
        return np.array([[float(row[prefix + axis]) for axis in "xyz"] for row in rows])

    def test_points_there_and_back(self):
        points = self.inside_of("tissues/liver.stl")
        there = self.table(self.text_of(points), "--direction", "rest-to-posed", "--pose", self.folder / "away.yaml")
        self.assertEqual({row["tissue"] for row in there}, {"liver", "vena_cava"}, "the vein runs through the liver")
        self.assertEqual({row["part"] for row in there}, {"soft"})
        liver = [row["labels_name"] for row in there if row["tissue"] == "liver"]
        self.assertGreater(liver.count("liver"), 0.6 * len(liver), "voxels of 6 mm, and a vein of 12")
        self.assertTrue(all(20 < float(row["ct"]) < 200 for row in there), "soft tissue, HU")
        back = self.table(self.text_of(self.at(there, "to_")), "--pose", self.folder / "away.yaml")
        self.assertLess(np.abs(self.at(back, "to_") - points).max(), 1e-3)
        self.assertEqual([row["tet"] for row in there], [row["tet"] for row in back])

    def test_a_bone_goes_rigidly(self):
        points = self.inside_of("bones/tibia_right.stl")
        rows = self.table("# a comment\n" + self.text_of(points), "--direction", "rest-to-posed", "--gradient", "--volumes", "none",
                          "--pose", self.folder / "away.yaml")
        tibia = [row for row in rows if row["part"] == "tibia_right"]
        self.assertGreater(len(tibia), 5)
        self.assertNotIn("ct", rows[0])
        for row in tibia:
            F = np.array([float(row["f_" + a + b]) for a in "xyz" for b in "xyz"]).reshape(3, 3)
            self.assertLess(np.abs(F.T @ F - np.eye(3)).max(), 1e-2)
            self.assertGreater(np.abs(F - np.eye(3)).max(), 0.3, "the knee bends by 50 degrees")

    def test_a_body_far_away_is_probed_as_exactly(self):
        far = self.folder / "far.yaml"
        far.write_text(AWAY.replace("joints:", "root: {translation_mm: [90000, -90000, 90000], rotation: [0.5, -0.5, -0.5, -0.5]}\njoints:"))
        points = self.inside_of("tissues/liver.stl")
        words = ("--direction", "rest-to-posed", "--gradient", "--volumes", "none", "--pose")
        near, away = (self.table(self.text_of(points), *words, pose) for pose in (self.folder / "away.yaml", far))
        self.assertEqual([row["tet"] for row in near], [row["tet"] for row in away])
        for a, b in zip(near, away):
            dets = [np.linalg.det(np.array([float(row["f_" + i + j]) for i in "xyz" for j in "xyz"]).reshape(3, 3)) for row in (a, b)]
            self.assertAlmostEqual(dets[0], dets[1], delta=1e-5)
        back = self.table(self.text_of(self.at(away, "to_")), "--pose", far)
        self.assertLess(np.abs(self.at(back, "to_") - points).max(), 0.02, "float32 tells places 90 m away apart by 0.008 mm")

    def test_outside_says_so(self):
        (self.folder / "points.csv").write_text("5000,0,0\n")
        result = run("--json", "probe", MODEL, "--points", self.folder / "points.csv")
        out = json.loads(result.stdout)
        self.assertEqual((out["ok"], out["points"], out["inside"]), (True, 1, 0))
        row = dict(zip(out["columns"], out["rows"][0]))
        self.assertEqual((row["x"], row["to_x"], row["tet"], row["tissue"], row["ct"]), (5000, None, None, None, None))
        self.assertEqual(run("probe", MODEL, "--points", self.folder / "points.csv").stdout.splitlines()[1][:14], "5000.0,0.0,0.0")

    def test_columns_by_name(self):
        rows = self.table("name,z,y,x\na point,3,2,1\n")
        self.assertEqual(self.at(rows).tolist(), [[1, 2, 3]])

    def test_refusals(self):
        self.assert_error("x,y\n1,2\n", 65, "bad.csv:1", "no column is named 'z'", "begin with a line x,y,z")
        self.assert_error("x,y,z\n1,2\n", 65, "bad.csv:2", "'1,2' is no point", "give x, y and z")
        self.assert_error("1,2,3\n\n1,two,3\n", 65, "bad.csv:3", "'1,two,3' is no point")
        self.assert_error("1,2,3,4\n", 65, "'1,2,3,4' is no point")
        self.assert_error("1,2,nan\n", 65, "'1,2,nan' is no point")
        self.assert_error("# nothing\n", 65, "it holds no points", "give a line x,y,z for each point")
        self.assert_error("1,2,3\n", 64, "--volumes", "the model has no 'mri'", "ct", words=("--volumes", "mri"))
        self.assert_error("1,2,3\n", 64, "sideways", words=("--direction", "sideways"))
        self.assert_error("1,2,3\n", 66, "none.yaml", words=("--pose", self.folder / "none.yaml"))
        result = run("probe", MODEL, "--points", self.folder / "none.csv")
        self.assertEqual(result.returncode, 66, result.stderr)


if __name__ == "__main__":
    unittest.main()
