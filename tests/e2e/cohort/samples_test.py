#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""ecorche cohort --sample: poses drawn by seed within the limits of joints, landmarks that follow, and what was drawn already."""
import csv
import json
import pathlib
import shutil
import subprocess
import sys
import tempfile
import unittest

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent))
sys.dont_write_bytecode = True
import cohort_test  # noqa: E402
from cohort_test import CONFIG, ECORCHE, ROOT  # noqa: E402

sys.path.insert(0, str(ROOT / "workflow/scripts"))
import samples  # noqa: E402


class Samples(unittest.TestCase):
    def setUp(self):
        self.folder = pathlib.Path(tempfile.mkdtemp())
        self.addCleanup(shutil.rmtree, self.folder)

    def call(self, bids, out, *more, levels):
        words = [ECORCHE, "--threads", "2", "cohort", bids, out, *levels, *more]
        done = subprocess.run(list(map(str, words)), capture_output=True, text=True, timeout=300, cwd=self.folder)
        self.assertEqual(done.returncode, 0, done.stderr)

    def test_a_draw_depends_on_seed_participant_and_index_alone(self):
        angle = lambda name, low, high: {"name": name, "min_deg": low, "max_deg": high, "rest_deg": 5}  # noqa: E731
        rig = [{"joint": "root", "coupled": [], "angles": [angle("tilt", None, None)]}, {"joint": "knee", "coupled": [], "angles": [angle("flexion", -10, 90)]}]
        drawn = samples.draw(rig, 1, "sub-01", 0, 1)
        self.assertEqual(list(drawn), ["knee"])
        self.assertEqual(samples.draw(rig, 1, "sub-01", 0, 1), drawn)
        for other in ((2, "sub-01", 0), (1, "sub-02", 0), (1, "sub-01", 1)):
            self.assertNotEqual(samples.draw(rig, *other, 1), drawn)
        values = [samples.draw(rig, 1, "sub-01", index, 0.5)["knee"]["flexion"] for index in range(500)]
        self.assertGreaterEqual(min(values), -2.5)
        self.assertLessEqual(max(values), 47.5)
        self.assertLess(min(values), 0)
        self.assertGreater(max(values), 45)

    def test_samples_are_drawn_by_seed_and_go_on_where_they_were(self):
        out = self.folder / "out"
        folder = out / "sub-01/samples"
        words = ("--participant-label", "01", "--config", self.folder / "cohort.yaml", "--seed", "5", "--sample")
        cohort_test.phantom_cohort.make(ECORCHE, self.folder / "bids", 1, broken=())
        (self.folder / "cohort.yaml").write_text(CONFIG + "landmarks: 'marks/{participant}.csv'\n")
        (self.folder / "marks").mkdir()
        # Within the trunk, in the left femur, and in the air.
        marks = self.folder / "marks/sub-01.csv"
        marks.write_text("# by hand\nname,x,y,z\nnavel,0,0,1000\nknee left,88,0,600\noutside,900,0,0\n")
        self.call(self.folder / "bids", out, *words, "2", levels=("participant",))
        first = json.loads((folder / "manifest.json").read_text())
        self.assertEqual([row["sample"] for row in first["samples"]], ["00000", "00001"])
        rig = {joint["joint"]: {angle["name"]: angle for angle in joint["angles"]} for joint in
               json.loads(subprocess.run([ECORCHE, "--json", "info", out / "sub-01/model.hdf"], capture_output=True, check=True).stdout)["rig"]}
        angles = [(rig[joint][name], value) for row in first["samples"] for joint, of in row["angles_deg"].items() for name, value in of.items()]
        self.assertGreater(len(angles), 60)
        for limit, value in angles:
            self.assertTrue(min(limit["min_deg"], limit["rest_deg"]) - 0.01 <= value <= max(limit["max_deg"], limit["rest_deg"]) + 0.01, (limit, value))
        files = {file["file"] for file in first["samples"][0]["files"]}
        self.assertLessEqual({"ct.nii.gz", "labels.nii.gz", "displacement.nii.gz", "mask.nii.gz", "body.vtu", "joints.csv", "ap.png", "lateral_left.png",
                              "pose.yaml"}, files)
        posed = list(csv.DictReader((folder / "00000/joints.csv").read_text().splitlines()))
        self.assertEqual(len(posed), len(rig))
        first_marks = self.landmarks(folder / "00000")
        self.assertEqual(list(first_marks), ["navel", "knee left", "outside"])
        self.assertEqual([first_marks["navel"][axis] for axis in "xyz"], ["0.0", "0.0", "1000.0"])
        went = subprocess.run([ECORCHE, "probe", out / "sub-01/model.hdf", "--points", marks, "--pose", folder / "00000/pose.yaml", "--direction",
                               "rest-to-posed", "--volumes", "none"], capture_output=True, text=True, check=True).stdout
        asked = list(csv.DictReader(went.splitlines()))
        self.assertEqual([[row[f"to_{axis}"] for axis in "xyz"] for row in first_marks.values()], [[row[f"to_{axis}"] for axis in "xyz"] for row in asked])
        self.assertNotEqual(first_marks["knee left"]["to_z"], "")
        self.assertEqual(first_marks["outside"]["to_x"], "")
        # One is lost, one was cut short, a third is wanted: the others stay as they are.
        whole = {path.relative_to(folder): path.read_bytes() for path in folder.glob("0*/*")}
        shutil.rmtree(folder / "00001")
        kept_at = (folder / "00000").stat().st_mtime_ns
        self.call(self.folder / "bids", out, *words, "3", levels=("participant",))
        self.assertEqual((folder / "00000").stat().st_mtime_ns, kept_at)
        again = {path.relative_to(folder): path.read_bytes() for path in folder.glob("0*/*")}
        self.assertEqual([str(name) for name, data in whole.items() if again.get(name) != data], [])
        self.assertEqual(len(json.loads((folder / "manifest.json").read_text())["samples"]), 3)
        # Other points under the same name are other landmarks.
        marks.write_text("x,y,z\n0,0,900\n")
        self.call(self.folder / "bids", out, *words, "3", levels=("participant",))
        self.assertEqual((folder / "00000/landmarks.csv").read_text().splitlines()[0].split(",")[:3], ["x", "y", "z"])
        marks.unlink()
        refused = subprocess.run(list(map(str, [ECORCHE, "cohort", self.folder / "bids", out, "participant", *words, "3"])), capture_output=True, text=True,
                                 cwd=self.folder)
        self.assertEqual(refused.returncode, 66)
        self.assertRegex(refused.stderr, r"error: configuration: landmarks: no file .*marks/sub-01\.csv \(give its path")

    def landmarks(self, sample):
        return {row["name"]: row for row in csv.DictReader((sample / "landmarks.csv").read_text().splitlines())}

    def test_names_of_landmarks_are_read_as_their_points_are(self):
        table = self.folder / "points.csv"
        for text, names in (("x,y,z\n1,2,3\n", []), ("1,2,3\n", []), ("\n# a\n x , name,y,z\n1,b c,2,3\n\n#\n4, d ,5,6\n", ["b c", "d"])):
            table.write_text(text)
            self.assertEqual(samples.landmark_names(table), names)


if __name__ == "__main__":
    unittest.main(verbosity=2)
