#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""A body whose tets are cut at its surfaces, the whole way: prepared, certified, verified and posed."""
import json
import pathlib
import shutil
import tempfile
import unittest

import numpy as np

from posed_files import CASE, MODEL, corners, run

POSE = "ecorche_pose: 1\nskeleton: phantom\njoints:\n  knee_right: {flexion_deg: 60}\n  elbow_left: {flexion_deg: 40}\n"


class Cut(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = pathlib.Path(tempfile.mkdtemp())
        cls.addClassCleanup(shutil.rmtree, cls.folder)
        cls.model = cls.folder / "cut.hdf"
        cls.made = run("preprocess", CASE, "-o", cls.model, "--mesher", "lattice_cut", "--max-tets", 120000)

    def test_is_certified(self):
        self.assertEqual(self.made.returncode, 0, self.made.stderr)
        self.assertRegex(self.made.stderr + self.made.stdout, r"\d+ of \d+ points between materials moved to the surfaces")
        verify = run("verify", self.model)
        self.assertEqual(verify.returncode, 0, verify.stderr)
        info = json.loads(run("--json", "info", self.model).stdout)
        found = info["certificate"]
        self.assertLessEqual(info["tets"], 120000)
        self.assertEqual((found["inverted_tets"], found["degenerate_tets"]), (0, 0))
        self.assertGreater(found["min_dihedral_deg"], 8)
        self.assertGreater(found["positive_offdiagonal_share"], 0, "so that weights may leave their bounds ...")
        self.assertGreater(found["solved_min_weight"], -1e-3)
        self.assertGreater(found["repaired_rows"], 0, "... and small violations are repaired and counted")
        self.assertGreaterEqual(found["min_weight"], 0)
        self.assertLessEqual(found["max_weight"], 1)
        self.assertLess(found["bone_rigidity_mm"], 1e-3)

    def test_poses_as_the_uncut_one(self):
        pose = self.folder / "pose.yaml"
        pose.write_text(POSE)
        for name, model in (("cut", self.model), ("other", MODEL)):
            done = run("pose", model, "--pose", pose, "--tissues", "all", "--volumes", "none", "-o", self.folder / name)
            self.assertEqual(done.returncode, 0, done.stderr)
        rest = self.folder / "rest.yaml"
        rest.write_text("ecorche_pose: 1\nskeleton: phantom\n")
        run("pose", self.model, "--pose", rest, "--tissues", "all", "--volumes", "none", "-o", self.folder / "rest")
        files = sorted(path.relative_to(self.folder / "cut") for path in (self.folder / "cut").rglob("*.stl"))
        self.assertGreater(len(files), 80)
        apart, moved = [], []
        for file in files:
            cut = corners(self.folder / "cut" / file).reshape(-1, 3)
            apart.append(np.linalg.norm(cut - corners(self.folder / "other" / file).reshape(-1, 3), axis=1))
            moved.append(np.linalg.norm(cut - corners(self.folder / "rest" / file).reshape(-1, 3), axis=1))
        apart, moved = np.concatenate(apart), np.concatenate(moved)
        print(f"moved by at most {moved.max():.0f} mm, from the uncut body {apart.mean():.2f} in the mean, 99 %: {np.percentile(apart, 99):.1f}")
        self.assertGreater(moved.max(), 100)
        self.assertLess(apart.mean(), 1)
        self.assertLess(np.percentile(apart, 99), 10)


if __name__ == "__main__":
    unittest.main()
