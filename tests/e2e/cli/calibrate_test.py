#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""`ecorche calibrate` through the command: nearer to finite elements between samples, rest and bones as before, the same bytes when resumed."""
import json
import pathlib
import shutil
import tempfile
import unittest

from posed_files import CASE, run

HEAD = "ecorche_pose: 1\nskeleton: phantom\n"


class Calibrate(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = pathlib.Path(tempfile.mkdtemp())
        cls.addClassCleanup(shutil.rmtree, cls.folder)
        cls.model, cls.calibrated = cls.folder / "coarse.hdf", cls.folder / "calibrated.hdf"
        done = run("preprocess", CASE, "-o", cls.model, "--mesher", "lattice", "--max-tets", 40000)
        assert done.returncode == 0, done.stderr
        cls.cache = cls.folder / "samples"
        done = run("--json", "calibrate", cls.model, "-o", cls.calibrated, "--joints", "elbow_right", "--cache", cls.cache, "--step", 30)
        assert done.returncode == 0, done.stderr
        cls.made = json.loads(done.stdout)

    def pose(self, model, name, joints, *words):
        file, out = self.folder / f"{name}.yaml", self.folder / f"{model.stem}_{name}_{len(words)}"
        file.write_text(HEAD + joints)
        done = run(*(words or ("pose",)), model, "-o", out, "--pose", file, "--tissues", "skin,humerus_right,radius_right")
        self.assertEqual(done.returncode, 0, done.stderr)
        return out

    def quality(self, model, pose):
        done = run("pose", model, "-o", self.folder / "judged", "--pose", pose, "--tissues", "skin")
        self.assertEqual(done.returncode, 0, done.stderr)
        return json.loads((self.folder / "judged/quality.json").read_text())

    def test_a_pose_between_samples_is_nearer_to_finite_elements(self):
        joints = "joints: {elbow_right: {flexion_deg: 40}}\n"
        to_cor = [json.loads((self.pose(model, "forty", joints, "fem", "--one-start") / "fem.json").read_text())["to_cor"]
                  for model in (self.model, self.calibrated)]
        self.assertGreater(to_cor[0]["mean_mm"], 0.5)
        self.assertLess(to_cor[1]["mean_mm"], 0.3 * to_cor[0]["mean_mm"])

    def test_bones_and_rest_are_as_before(self):
        bent = [self.pose(model, "bent", "joints: {elbow_right: {flexion_deg: 50}}\n") for model in (self.model, self.calibrated)]
        for name, same in (("skin", False), ("humerus_right", True), ("radius_right", True)):
            self.assertEqual((bent[0] / f"{name}.stl").read_bytes() == (bent[1] / f"{name}.stl").read_bytes(), same, name)
        for name, joints in (("rest", "joints: {}\n"), ("other", "joints: {elbow_left: {flexion_deg: 50}}\n")):
            posed = [self.pose(model, name, joints) for model in (self.model, self.calibrated)]
            self.assertEqual((posed[0] / "skin.stl").read_bytes(), (posed[1] / "skin.stl").read_bytes(), name)

    def test_info_and_verify_know_it(self):
        info = json.loads(run("--json", "info", self.calibrated).stdout)
        (correction,) = info["corrections"]
        self.assertEqual(correction["joint"], "elbow_right")
        self.assertEqual(correction["nodes"], self.made["joints"][0]["nodes"])
        self.assertGreater(correction["largest_mm"], 1)
        self.assertEqual(info["safe_ranges"], self.made["safe_ranges"])
        flexion = next(row for row in info["safe_ranges"] if row["angle"] == "flexion" and row["way"] == 1)
        skinned, corrected = flexion["skinned_deg"]["inverted"], flexion["corrected_deg"]["inverted"]
        self.assertIsNotNone(skinned)
        self.assertTrue(corrected is None or corrected >= skinned, flexion)
        self.assertRegex(run("info", self.calibrated).stdout, r"elbow_right +flexion ")
        self.assertEqual(run("verify", self.calibrated).returncode, 0)
        self.assertEqual(json.loads(run("--json", "info", self.model).stdout)["corrections"], [])

    def test_flesh_that_meets_other_flesh_ends_a_range(self):
        out = self.folder / "knee.hdf"
        done = run("calibrate", self.model, "-o", out, "--from", self.calibrated)
        self.assertEqual(done.returncode, 0, done.stderr)
        ranges = {(row["joint"], row["angle"], row["way"]): row for row in json.loads(run("--json", "info", out).stdout)["safe_ranges"]}
        # A calf meets its thigh, a forearm its upper arm, well before their limits of 135 and 150, and both sides alike; straightened, nothing does.
        for joint, low, high in (("knee", 45, 100), ("elbow", 70, 130)):
            met = [ranges[f"{joint}_{side}", "flexion", 1]["skinned_deg"]["contact"] for side in ("left", "right")]
            self.assertTrue(all(low < angle < high for angle in met), met)
            self.assertLess(abs(met[0] - met[1]), 12)
            self.assertIsNone(ranges[f"{joint}_right", "flexion", -1]["skinned_deg"]["contact"])
        # No rest pose touches itself, nor one nearly at rest.
        for row in ranges.values():
            for ends in (row["skinned_deg"], row["corrected_deg"]):
                self.assertIn("contact", ends)

        # What is said is so: by finite elements, which see it as skinning left it where they find no balance.
        angle = ranges["knee_right", "flexion", 1]["skinned_deg"]["contact"]
        depth = [json.loads((self.pose(self.model, f"knee{turn:.0f}", f"joints: {{knee_right: {{flexion_deg: {turn}}}}}\n",
                                       "fem", "--one-start") / "fem.json").read_text())["contact_depth_mm"] for turn in (20, angle + 30)]
        self.assertEqual(depth[0], 0)
        self.assertGreater(depth[1], 1)

    def test_samples_are_kept_and_give_the_same_bytes(self):
        kept = sorted(self.cache.glob("sample-*.stage"))
        self.assertEqual(len(kept), self.made["joints"][0]["samples"])
        for lost in kept[::2]:
            lost.unlink()
        again = self.folder / "again.hdf"
        done = run("--threads", 1, "calibrate", self.model, "-o", again, "--joints", "elbow_right", "--cache", self.cache, "--step", 30)
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertEqual(again.read_bytes(), self.calibrated.read_bytes())

    def test_a_full_cache_solves_and_measures_nothing_again(self):
        again = self.folder / "cached.hdf"
        done = run("--json", "calibrate", self.model, "-o", again, "--joints", "elbow_right", "--cache", self.cache, "--step", 30)
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertEqual(again.read_bytes(), self.calibrated.read_bytes())
        seconds, was = json.loads(done.stdout)["seconds"], self.made["seconds"]
        self.assertLess(seconds["samples"], was["samples"] / 3)
        self.assertLess(seconds["ranges"], was["ranges"] / 3)

    def test_each_sample_says_what_became_of_it(self):
        (joint,) = self.made["joints"]
        self.assertEqual(len(joint["tried"]), joint["samples"])
        self.assertEqual(sum(sample["clean"] for sample in joint["tried"]), joint["clean"])
        for sample in joint["tried"]:
            self.assertGreater(sample["iterations"], 0)
            self.assertTrue(not sample["clean"] or 2 * sample["inverted"] <= sample["inverted_skinned"], sample)

    def test_a_shoulder_is_corrected_beyond_where_its_flesh_buckles(self):
        """Newton's method finds no balance there in its iterations: without a way through folds three of its samples stay unsolved."""
        done = run("--json", "calibrate", self.model, "-o", self.folder / "shoulder.hdf", "--joints", "shoulder_left", "--no-ranges")
        self.assertEqual(done.returncode, 0, done.stderr)
        (joint,) = json.loads(done.stdout)["joints"]
        self.assertEqual([sample for sample in joint["tried"] if not sample["clean"]], [])
        self.assertGreater(max(sample["iterations"] for sample in joint["tried"]), 60)  # it did not converge at once

    def test_whole_poses_pass_as_settled_without_settling(self):
        out, mine = self.folder / "poses.hdf", self.folder / "mine.yaml"
        mine.write_text(HEAD + "root: {translation_mm: [0, 0, 500]}\njoints: {knee_left: {flexion_deg: 65}, elbow_left: {flexion_deg: 60}}\n")
        words = ("--joints", "elbow_right", "--cache", self.cache, "--step", 30, "--no-ranges")
        done = run("--json", "calibrate", self.model, "-o", out, *words, "--poses", f"lib:sitting,{mine}")
        self.assertEqual(done.returncode, 0, done.stderr)
        rows = {row["pose"]: row for row in json.loads(done.stdout)["poses"]}
        self.assertEqual(sorted(rows), sorted(["lib:sitting", str(mine)]))
        self.assertEqual((rows[str(mine)]["passed"], rows[str(mine)]["passes"]), (False, True))
        for pose, row in rows.items():
            quality = [self.quality(model, pose) for model in (self.calibrated, out)]
            self.assertEqual([was["verdict"] for was in quality], ["pass" if passes else "warn" for passes in (row["passed"], row["passes"])], pose)
            self.assertLess(quality[1]["inverted_tets"], quality[0]["inverted_tets"] / 5, pose)
        again = self.folder / "poses_again.hdf"
        done = run("--json", "calibrate", self.model, "-o", again, *words, "--poses", f"lib:sitting,{mine}")
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertEqual(again.read_bytes(), out.read_bytes())
        self.assertEqual(sorted(file.name.split("-")[0] for file in self.cache.glob("pose-*")), ["pose", "pose"])
        # Near a pose its correction fades, and leaves no more inside out than without.
        for short in (8, 16):
            joints = f"joints: {{knee_left: {{flexion_deg: {65 - short}}}, elbow_left: {{flexion_deg: {60 - short}}}}}\n"
            (self.folder / "short.yaml").write_text(HEAD + joints)
            near = [self.quality(model, self.folder / "short.yaml")["inverted_tets"] for model in (self.calibrated, out)]
            self.assertLessEqual(near[1], near[0], short)
        # Where nothing about a place is as in a pose, all is as before.
        other = "joints: {knee_left: {flexion_deg: 30}, elbow_right: {flexion_deg: 20}}\n"
        posed = [self.pose(model, "elsewhere", other) for model in (out, self.calibrated)]
        self.assertEqual((posed[0] / "skin.stl").read_bytes(), (posed[1] / "skin.stl").read_bytes())

        info = json.loads(run("--json", "info", out).stdout)
        self.assertEqual({row["pose"] for row in info["pose_corrections"]}, set(rows))
        self.assertEqual(sum(row["nodes"] for row in info["pose_corrections"]), sum(row["nodes"] for row in rows.values()))
        knees = [row for row in info["pose_corrections"] if row["pose"] == str(mine) and "knee_left" in row["joints"]]
        self.assertTrue(knees and all(0 < row["reach_deg"] <= 30 for row in knees), info["pose_corrections"])
        self.assertRegex(run("info", out).stdout, r"lib:sitting +\d+ +\d+")

    def test_whole_poses_that_are_none_are_refused(self):
        for words, code, line in (
                (("--poses", "lib:siting"), 64, "has no pose 'siting' (it has anatomical, arms_up"),
                (("--poses", "absent.yaml"), 66, "absent.yaml: "),
                (("--poses", "lib:sitting", "--no-poses"), 64, "--poses excludes --no-poses")):
            done = run("calibrate", self.model, "-o", self.folder / "none.hdf", "--joints", "elbow_right", "--cache", self.cache, "--step", 30, *words)
            self.assertEqual(done.returncode, code, done.stderr)
            self.assertIn(line, done.stderr)
            self.assertFalse((self.folder / "none.hdf").exists())

    def test_a_finer_model_takes_it_over(self):
        fine, out = self.folder / "fine.hdf", self.folder / "fine_calibrated.hdf"
        self.assertEqual(run("preprocess", CASE, "-o", fine, "--mesher", "lattice", "--max-tets", 60000).returncode, 0)
        done = run("--json", "calibrate", fine, "-o", out, "--from", self.calibrated, "--no-ranges")
        self.assertEqual(done.returncode, 0, done.stderr)
        (joint,) = json.loads(done.stdout)["joints"]
        self.assertEqual((joint["joint"], joint["samples"]), ("elbow_right", self.made["joints"][0]["clean"]))
        self.assertGreater(joint["nodes"], self.made["joints"][0]["nodes"])
        self.assertEqual(run("verify", out).returncode, 0)
        joints = "joints: {elbow_right: {flexion_deg: 40}}\n"
        to_cor = [json.loads((self.pose(model, "forty", joints, "fem", "--one-start") / "fem.json").read_text())["to_cor"] for model in (fine, out)]
        # Half is left: finite elements of so few tets about an elbow are another body's.
        self.assertLess(to_cor[1]["mean_mm"], 0.6 * to_cor[0]["mean_mm"])

    def test_what_is_no_joint_is_refused(self):
        done = run("calibrate", self.model, "-o", self.folder / "none.hdf", "--joints", "elbow_rigth")
        self.assertEqual(done.returncode, 64)
        self.assertIn("error: --joints: 'elbow_rigth' is no joint that turns by itself (choose among those that ecorche info names)", done.stderr)
        self.assertFalse((self.folder / "none.hdf").exists())


if __name__ == "__main__":
    unittest.main()
