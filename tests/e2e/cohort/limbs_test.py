#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""ecorche cohort: a leg whose files lie in a folder of data; runs of different participants side by side in one folder."""
import fcntl
import json
import os
import pathlib
import shutil
import subprocess
import sys
import tempfile
import unittest

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent))
sys.dont_write_bytecode = True
from cohort_test import group  # noqa: E402

CASE = """name: leg
frame: LPS
unit: mm
skeleton: human
skin: {file: skin.stl, root: data}
bones:
  - {name: femur_right, file: bones/femur_right.stl, root: data, segment: thigh_right}
  - {name: tibia_right, file: bones/tibia_right.stl, root: data, segment: shank_right}
"""
CONFIG = """preprocess: {mesher: lattice, max-tets: 20000}
poses: {arms_up: {pose: "lib:arms_up"}, sitting: {pose: "lib:sitting"}}
pose: {tissues: skin, format: [stl]}
data: data
"""


class Limbs(unittest.TestCase):
    def setUp(self):
        self.folder = pathlib.Path(tempfile.mkdtemp())
        self.addCleanup(shutil.rmtree, self.folder)
        self.data = self.folder / "data"
        shutil.copytree(pathlib.Path(os.environ["ECORCHE_CASE"]) / "bones", self.data / "bones")
        shutil.copy(pathlib.Path(os.environ["ECORCHE_CASE"]) / "skin.stl", self.data)
        (self.folder / "leg").mkdir()
        (self.folder / "leg/case.yaml").write_text(CASE)
        (self.folder / "cohort.yaml").write_text(CONFIG)
        (self.folder / "participants.tsv").write_text("participant_id\tfiles\nsub-01\tleg\nsub-02\tleg\n")

    def call(self, *words, code=0):
        done = subprocess.run([os.environ["ECORCHE_BIN"], "cohort", "participants.tsv", "out", *words, "--config", "cohort.yaml"], capture_output=True,
                              text=True, timeout=120, cwd=self.folder)
        self.assertEqual(done.returncode, code, done.stderr)
        return done.stderr

    def test_files_of_the_data_folder_are_inputs_and_a_pose_without_joints_is_left_out(self):
        self.call("participant", "group", "--participant-label", "01")
        status = json.loads((self.folder / "out/sub-01/status.json").read_text())
        self.assertEqual((status["ok"], [row["pose"] for row in status["poses"]], [row["pose"] for row in status["left_out"]]), (True, ["sitting"], ["arms_up"]))
        row = group(self.folder / "out")["sub-01"]
        self.assertNotEqual(row["status"], "failed")
        self.assertNotIn("n/a", (row["tets"], row["sitting.inverted_ml"]))
        self.assertIn("arms_up <span class=soft>left out</span>", (self.folder / "out/group.html").read_text())
        self.assertIn("none of the joints of the pose &#39;arms_up&#39;", (self.folder / "out/sub-01/report.html").read_text())
        self.assertIn("data/bones/tibia_right.stl", json.loads((self.folder / "out/sub-01/provenance.json").read_text())["inputs"])
        again = ("participant", "--participant-label", "01", "--dry-run")
        self.assertNotIn("rule preprocess", self.call(*again))
        tibia = bytearray((self.data / "bones/tibia_right.stl").read_bytes())
        tibia[0:5] = b"other"
        (self.data / "bones/tibia_right.stl").write_bytes(tibia)
        self.assertIn("rule preprocess", self.call(*again))

    def test_runs_of_other_participants_go_side_by_side(self):
        locks = self.folder / "out/.cohort"
        locks.mkdir(parents=True)
        with open(locks / "lock", "w") as all_of_it, open(locks / "lock-sub-02", "w") as second:
            fcntl.flock(all_of_it, fcntl.LOCK_SH)  # as a run of sub-02 alone has them
            fcntl.flock(second, fcntl.LOCK_EX)
            self.call("participant", "--dry-run", "--participant-label", "01")
            self.assertIn("out/sub-02: another run", self.call("participant", "--dry-run", "--participant-label", "01", "02", code=75))
            for levels in (("participant",), ("group",), ("participant", "group", "--participant-label", "01")):
                self.assertIn("another run", self.call(*levels, "--dry-run", code=75))


if __name__ == "__main__":
    unittest.main(verbosity=2)
