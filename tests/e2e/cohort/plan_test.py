#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""What a cohort's workflow takes in and plans, without Snakemake: who takes part, the records of steps, the law of memory and time."""
import gzip
import json
import os
import pathlib
import shutil
import struct
import subprocess
import sys
import tempfile
import unittest

ROOT = pathlib.Path(__file__).resolve().parents[3]
sys.dont_write_bytecode = True
sys.path.insert(0, str(ROOT / "workflow/scripts"))
import law  # noqa: E402
import participants  # noqa: E402
import record  # noqa: E402


class InFolder(unittest.TestCase):
    def setUp(self):
        self.folder = pathlib.Path(tempfile.mkdtemp()).resolve()
        self.addCleanup(shutil.rmtree, self.folder)

    def put(self, *names, text="x"):
        for name in names:
            path = self.folder / name
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_text(text)


class Participants(InFolder):
    def read(self, *labels, bids=None):
        return {one.id: one for one in participants.read(bids or self.folder, lambda row: "", labels)}

    def names(self, paths):
        return [str(path.relative_to(self.folder)) for path in paths]

    def test_of_a_tree(self):
        self.put("sub-01/case.yaml", "sub-01/bones/a.stl", "sub-01/.hidden/b", "sub-02/case/case.yaml", "sub-02/note.txt", "sub-03/ct/sub-03_ct.nii.gz",
                 "derivatives/seg/sub-03/sub-03_dseg.nii.gz", "derivatives/seg/sub-03/sub-03_dseg.tsv", "sub-03/ct/sub-03_ct.json", "sub_04/case.yaml")
        found = self.read()
        self.assertEqual(list(found), ["sub-01", "sub-02", "sub-03"])
        self.assertEqual([one.is_case for one in found.values()], [True, True, False])
        self.assertEqual(self.names(found["sub-01"].files()), ["sub-01/bones/a.stl", "sub-01/case.yaml"])
        self.assertEqual(self.names(found["sub-02"].files()), ["sub-02/case/case.yaml"])
        self.assertEqual(self.names(found["sub-03"].sources), ["sub-03/ct/sub-03_ct.nii.gz", "derivatives/seg/sub-03/sub-03_dseg.nii.gz",
                                                               "derivatives/seg/sub-03/sub-03_dseg.tsv"])
        self.assertEqual(list(self.read("02", "sub-03")), ["sub-02", "sub-03"])

    def test_of_a_table_that_names_what_is_not_there(self):
        self.put("participants.tsv", text="participant_id\tfiles\toptions\nsub-2\ta/case.yaml\t--voxel=4 --mesher cgal\nsub-1\tct.nii.gz; seg\tn/a\n")
        found = self.read()
        self.assertEqual(list(found), ["sub-1", "sub-2"])
        self.assertTrue(found["sub-2"].is_case)
        self.assertFalse(found["sub-1"].is_case)
        self.assertEqual(found["sub-2"].options, ["--voxel", "4", "--mesher", "cgal"])
        self.assertEqual(self.names(found["sub-1"].sources), ["ct.nii.gz", "seg"])
        self.assertEqual(found["sub-1"].files(), [])

    def test_two_sessions_are_told_apart_by_the_table(self):
        self.put("sub-01/ses-1/ct.nii", "sub-01/ses-2/ct.nii")
        with self.assertRaisesRegex(participants.Refused, r"sub-01: holds 2 sessions \(ses-1, ses-2\) \(name the files of one"):
            self.read()


class Records(InFolder):
    def setUp(self):
        super().setUp()
        self.put("sub-01/model.hdf", "sub-01/check.json")
        for step in ("check", "repair", "preprocess", "verify", "pose-a", "subject"):
            self.write(step)

    def write(self, step, fault=None):
        made = {"check": ["check.json"], "preprocess": ["model.hdf"]}.get(step, [])
        record.write(self.folder / "sub-01", step, {"ok": not fault, "fault": fault, "products": record.products(self.folder / "sub-01", made)})

    def left(self):
        record.take_back(self.folder, ["sub-01", "sub-nobody"])
        return sorted(path.stem for path in (self.folder / "sub-01/steps").glob("*.json"))

    def test_that_hold_stay(self):
        self.assertEqual(self.left(), ["check", "pose-a", "preprocess", "repair", "subject", "verify"])

    def test_of_what_is_gone_are_taken_back_with_all_that_follow(self):
        (self.folder / "sub-01/model.hdf").unlink()
        self.assertEqual(self.left(), ["check", "repair"])

    def test_of_what_was_written_since(self):
        later = (self.folder / "sub-01/steps/preprocess.json").stat().st_mtime_ns + 10**9
        os.utime(self.folder / "sub-01/model.hdf", ns=(later, later))
        self.assertEqual(self.left(), ["check", "repair"])

    def test_a_gap_in_the_middle_ends_what_follows(self):
        (self.folder / "sub-01/steps/repair.json").unlink()
        self.assertEqual(self.left(), ["check"])

    def test_a_machine_s_fault_is_tried_again_but_not_that_of_data(self):
        self.write("pose-a", fault="machine")
        self.assertEqual(self.left(), ["check", "preprocess", "repair", "verify"])
        self.write("pose-a", fault="data")
        self.write("subject")
        self.assertEqual(self.left(), ["check", "pose-a", "preprocess", "repair", "subject", "verify"])

    def test_damaged_ones(self):
        for text in ("", "{", "[]", "3", '{"fault": null}', json.dumps({"fault": None, "products": [{"file": "model.hdf"}]})):
            self.write("verify")
            (self.folder / "sub-01/steps/verify.json").write_text(text)
            self.assertNotIn("verify", self.left(), text)


class Stop(InFolder):
    def test_a_step_that_is_stopped_between_two_commands_calls_no_other_and_writes_nothing_down(self):
        program = self.folder / "program"
        given = {"after": ["check"], "repair": True, "words": []}
        for which in ("INT", "TERM"):
            with self.subTest(which):
                record.write(self.folder / "sub-01", "check", {"ok": True, "fault": None, "facts": {"sound": False, "case": "case"}})
                program.write_text(f'#!/bin/sh\ncase "$*" in *" check "*) touch {self.folder}/called ;; *) trap "" TERM; kill -{which} $PPID; sleep 0.2 ;; esac\necho "{{}}"\n')
                program.chmod(0o755)
                done = subprocess.run([sys.executable, ROOT / "workflow/scripts/step.py", "repair", "sub-01", "--out", self.folder, "--ecorche", program,
                                       "--given", json.dumps(given)], capture_output=True, text=True)
                self.assertEqual((done.returncode, "stopped" in done.stderr), (143, True), done.stderr)
                self.assertFalse((self.folder / "called").exists())
                self.assertFalse((self.folder / "sub-01/steps/repair.json").exists())


class Law(InFolder):
    def size(self, *words):
        return law.size_of(words, tuple(str(path) for path in sorted(self.folder.rglob("*"))))

    def test_counts_voxels_by_their_headers(self):
        header = bytearray(352)
        struct.pack_into("<8h", header, 40, 4, 100, 50, 20, 3, 1, 1, 1)
        (self.folder / "a.nii.gz").write_bytes(gzip.compress(bytes(header) + bytes(1000)))
        self.put("b.nrrd", text="NRRD0004\ntype: short\ndimension: 3\nsizes: 10 20 30\n\n")
        self.put("c.mha", text="ObjectType = Image\nNDims = 3\nDimSize = 7 8 9\nElementType = MET_UCHAR\n")
        self.put("d.nii", text="no image")
        self.put("e.dcm", text="xxxx")
        self.assertAlmostEqual(self.size()[1] * 1e6, 100 * 50 * 20 + 6000 + 504 + 8 + 2)

    def test_counts_tets_as_preprocess_bounds_them(self):
        self.assertEqual(self.size("--max-tets", "20000")[0], 0.02)
        self.assertEqual(self.size()[0], 0.3)
        (self.folder / "a.stl").write_bytes(bytes(40_000_000))
        self.assertEqual(self.size("--voxel", "3")[0], 1.0)
        self.assertEqual(self.size("--max-tets", "0")[0], 1.0)
        os.truncate(self.folder / "a.stl", 400_000_000)
        self.assertEqual(self.size("--voxel", "2")[0], 3.5)

    def test_doubles_with_each_attempt(self):
        line = {"step": {"mib": 100, "mib_per_mtet": 50, "mib_per_mvoxel": 2, "s": 30, "s_per_mtet": 0, "s_per_mvoxel": 1}}
        self.assertEqual([law.mib(line, "step", (2, 10), attempt) for attempt in (1, 2, 3)], [220, 440, 880])
        self.assertEqual(law.mib(line, "step", (2, 10), 2, beside=30), 500)
        self.assertEqual(law.minutes(line, "step", (2, 30), 1), 4)


if __name__ == "__main__":
    unittest.main(verbosity=2)
