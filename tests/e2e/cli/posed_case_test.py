#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""`pose --as-case`: the posed patient is a patient. It is checked, prepared and posed back to how the first one lay."""
import json
import pathlib
import shutil
import tempfile
import unittest

import numpy as np

from posed_files import CASE, MODEL, corners, run

AWAY = "ecorche_pose: 1\nskeleton: phantom\njoints:\n" \
       "  knee_right: {flexion_deg: 80}\n  hip_right: {flexion_deg: 60}\n  elbow_left: {flexion_deg: 70}\n"
BACK = "ecorche_pose: 1\nskeleton: phantom\njoints:\n" \
       "  knee_right: {flexion_deg: 0}\n  hip_right: {flexion_deg: 0}\n  elbow_left: {flexion_deg: 17}\n"


class PosedCase(unittest.TestCase):
    def setUp(self):
        self.folder = pathlib.Path(tempfile.mkdtemp())
        self.addCleanup(shutil.rmtree, self.folder)

    def ok(self, *words):
        result = run(*words)
        self.assertEqual(result.returncode, 0, result.stderr)
        return result

    def test_goes_there_and_back(self):
        posed, back = self.folder / "posed", self.folder / "back"
        (self.folder / "away.yaml").write_text(AWAY)
        (self.folder / "back.yaml").write_text(BACK)
        self.ok("pose", MODEL, "-o", posed, "--pose", self.folder / "away.yaml", "--as-case")
        self.assertTrue((posed / "body.vtu").is_file())
        quality = json.loads((posed / "quality.json").read_text())
        near = quality["inverted_near"]
        self.assertEqual(sum(joint["tets"] for joint in near), quality["inverted_tets"])
        self.assertAlmostEqual(sum(joint["rest_mm3"] for joint in near), quality["inverted_rest_mm3"], delta=1)
        self.assertIn(near[0]["joint"], ("knee_right", "hip_right", "elbow_left"), "where the pose bends")
        self.assertLessEqual(quality["inverted_in_tissues"], quality["inverted_tets"])
        self.ok("check", posed)
        model = self.folder / "posed.hdf"
        self.ok("preprocess", posed, "-o", model, "--mesher", "lattice", "--max-tets", "200000")
        self.ok("verify", model)
        self.ok("pose", model, "-o", back, "--pose", self.folder / "back.yaml", "--tissues", "all")
        # Bones come back exactly: the skeleton's new rest pose and its angles are right.
        for bone in sorted((CASE / "bones").glob("*.stl")):
            first, again = corners(bone), corners(back / bone.name)
            self.assertLess(np.abs(first - again).max(), 5e-3, bone.name)
            if bone.name.startswith("tibia_right"):
                self.assertGreater(np.abs(first - corners(posed / "bones" / bone.name)).max(), 100)
        # Soft tissues nearly: between the two lies another mesh, with its own weights.
        for tissue in ("liver", "biceps_brachii_right"):
            first, again = corners(CASE / f"tissues/{tissue}.stl"), corners(back / f"{tissue}.stl")
            self.assertLess(np.abs(first - again).max(), 0.5, f"{tissue}: far from every joint that moved")
        # Those that cross a joint which moved went through another mesh, folded there, with its own weights.
        means = {path.stem: np.linalg.norm(corners(path) - corners(back / path.name), axis=2).mean()
                 for path in sorted((CASE / "tissues").glob("*.stl"))}
        worst = max(means, key=means.get)
        print(f"posed and back: median tissue {np.median(list(means.values())):.2f} mm, worst {worst} {means[worst]:.1f} mm")
        self.assertLess(np.median(list(means.values())), 1)
        self.assertLess(means[worst], 30)
        # The label map went along.
        self.assertIn("labels:", (posed / "case.yaml").read_text())

    def test_a_case_is_whole(self):
        (self.folder / "away.yaml").write_text(AWAY)
        for more in (("--tissues", "skin"), ("--format", "ply"), ("--volume-format", "mha")):
            result = run("pose", MODEL, "-o", self.folder / "x", "--pose", self.folder / "away.yaml", "--as-case", *more)
            self.assertEqual(result.returncode, 64, result.stderr)
            self.assertIn("--as-case", result.stderr)
            self.assertFalse((self.folder / "x").exists())


if __name__ == "__main__":
    unittest.main()
