#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""`ecorche thin --picks`: a skeleton of picked points, out to animation files and back, and each mistake with its code and words."""
import unittest

import numpy as np

from bar_skeletons import BarTest, write_nrrd


class PickedPoints(BarTest):
    def test_a_skeleton_of_picked_points_goes_out_and_its_motion_comes_back(self):
        picks, rig, few = self.folder / "picks.csv", self.folder / "picked.yaml", self.folder / "picked.vtp"
        # A bare list, from the hand to the shoulder and the root first; beside the middle, and one outside the bar.
        picks.write_text("4,6,9\n58,9,7\n30,12,5\n45,20,7\n")
        made = self.ok("thin", self.bar, "-o", few, "--tp", 0.3, "--picks", picks, "--snapped", rig)
        self.assertEqual(made["parents"], {"joint_01": None, "joint_02": "joint_04", "joint_03": "joint_01", "joint_04": "joint_03"})
        self.assertEqual(sum(made["segments"].values()), made["skeletal"])
        self.assertGreater(made["snapped_mm"]["joint_04"], 5)
        # Bent, as keys of an animation say it.
        (self.folder / "keys.yaml").write_text(
            "ecorche_pose_sequence: 1\nskeleton: picked\nframes_per_second: 10\nkeys:\n  - {time_s: 0}\n"
            "  - {time_s: 1, joints: {joint_03: {z_deg: 50, x_deg: 20}, joint_04: {y_deg: -30}, joint_02: {x_deg: 15}}, root: {translation_mm: [5, 7, -3]}}\n")
        out = [self.folder / name for name in ("own.nrrd", "back.nrrd")]
        self.ok("refill", few, self.bar, "-o", out[0], "--rig", rig, "--motion", self.folder / "keys.yaml", "--frames", 10, "--sampling", "nearest")
        own, _, own_at = self.read(out[0])
        self.assertFalse(own.shape == self.voxels.shape and (own == self.voxels).all())
        names = [f"joint_0{n}" for n in (1, 2, 3, 4)]
        for kind in ("bvh", "glb"):
            still, file = self.folder / f"rest.{kind}", self.folder / f"move.{kind}"
            self.assertEqual(self.ok("export", rig, "-o", still)["rigs"][0]["joints"], 4)
            self.ok("export", rig, "-o", file, "--motion", self.folder / "keys.yaml")
            data = still.read_bytes()
            self.assertTrue(all(name.encode() in data for name in names), kind)
            self.ok("refill", few, self.bar, "-o", out[1], "--rig", rig, "--motion", file, "--frames", 10, "--sampling", "nearest")
            back, _, back_at = self.read(out[1])
            self.assertTrue(np.array_equal(own_at, back_at) and own.shape == back.shape, kind)
            self.assertLess((own != back).mean(), 1e-3, kind)
        # The rest pose is the scan.
        self.ok("refill", few, self.bar, "-o", out[1], "--rig", rig, "--motion", self.folder / "rest.bvh", "--frames", 0, "--sampling", "nearest")
        rest = self.ok("refill", few, self.bar, "-o", out[0], "--sampling", "nearest")["frames"][0]
        self.assertTrue((self.read(out[0])[0] == self.read(out[1])[0]).all(), rest)
        self.assert_error(64, ("export", rig, "-o", self.folder / "x.vtu"), "a skeleton has no tets")
        self.assert_error(65, ("export", picks, "-o", self.folder / "x.glb"), "picks.csv: is not an HDF5 file")

    def test_picks_that_are_none(self):
        picks, rig, out = self.folder / "bad.csv", self.folder / "bad.yaml", self.folder / "bad.vtp"
        words = ("thin", self.bar, "-o", out, "--tp", 0.3, "--picks", picks, "--snapped", rig)
        for code, text, parts in ((65, "name,x,y,z\nHip,4,8,8\n", ("bad.csv:2", "'Hip' is no name")),
                                  (65, "4,8\n", ("bad.csv:1", "is no point")),
                                  (65, "name,x,y\na,4,8\n", ("bad.csv:1", "no column is named 'z'")),
                                  (65, "# nothing\n", ("it holds no points",)),
                                  (78, "name,x,y,z\na,4,8,8\na,30,8,8\n", ("pick 'a'", "two have this name")),
                                  (78, "4,8,8\n4.1,8,8\n", ("pick 'joint_02'", "also that of 'joint_01'")),
                                  (78, "name,x,y,z,parent\na,4,8,8,b\nb,30,8,8,\n", ("the first is the root",)),
                                  (78, "name,x,y,z,parent\na,4,8,8,\nb,30,8,8,hip\n", ("its parent 'hip' is no pick",)),
                                  (78, "name,x,y,z,parent\na,4,8,8,\nb,30,8,8,c\nc,50,8,8,b\n", ("pick 'b'", "lead back to itself"))):
            picks.write_text(text)
            self.assert_error(code, words, *parts)
            self.assertFalse(out.exists() or rig.exists())
        picks.write_text("4,8,8\n")
        self.assert_error(64, words[:-2], "--picks", "--snapped")
        self.assert_error(64, (*words, "--skeleton", self.rig), "--picks", "stands beside")
        self.assert_error(64, ("thin", self.few, "-o", out, "--picks", picks, "--snapped", rig), "--picks")
        # Two bars: the tree joins no pick of the one to the other's.
        two = np.zeros((16, 17, 64), np.uint8)
        two[2:14, 2:15, 2:28] = two[2:14, 2:15, 40:62] = 1
        picks.write_text("4,8,8\n50,8,8\n")
        apart = (words[0], write_nrrd(self.folder / "two.nrrd", two), *words[2:])
        self.assert_error(78, apart, "pick 'joint_02'", "does not join it to 'joint_01'", "--connect")
        self.ok(*apart, "--connect")
        self.assertTrue(rig.exists())


if __name__ == "__main__":
    unittest.main()
