#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""`pose --scan`: from a scan to a posed body with no file between. The same bytes as by new, preprocess and pose; nothing else is left."""
import filecmp
import json
import pathlib
import resource
import shutil
import signal
import subprocess
import tempfile
import time
import unittest

import pydicom
from pydicom.uid import generate_uid

from posed_files import CASE, ECORCHE, MODEL, run

COARSE = ("--mesher", "lattice", "--max-tets", "30000")
TASKS = ("total", "appendicular_bones", "craniofacial_structures", "body")


def small_files_only():
    """A disk on which files stay below 20 KB."""
    signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
    resource.setrlimit(resource.RLIMIT_FSIZE, (20000, 20000))


class PoseScan(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.home = pathlib.Path(tempfile.mkdtemp())
        cls.addClassCleanup(shutil.rmtree, cls.home)
        scan = cls.home / "scan"
        result = run("phantom", "-o", scan, "--size", "small", "--scan", "totalsegmentator")
        assert result.returncode == 0, result.stderr
        cls.scan = [scan / "ct.nii.gz", *(scan / task for task in TASKS)]

    def setUp(self):
        self.folder = pathlib.Path(tempfile.mkdtemp(dir=self.home))

    def ok(self, *words):
        result = run("--json", *words)
        self.assertEqual(result.returncode, 0, result.stderr)
        return json.loads(result.stdout), result.stderr

    def same(self, one, other):
        files = {p.relative_to(one) for p in one.rglob("*") if p.is_file()}
        self.assertEqual(files, {p.relative_to(other) for p in other.rglob("*") if p.is_file()})
        self.assertGreater(len(files), 20)
        for file in files:
            self.assertTrue(filecmp.cmp(one / file, other / file, shallow=False), file)

    def by_both_ways(self, scan, choice, mesh, pose):
        said, stderr = self.ok("pose", "--scan", *scan, *choice, *mesh, *pose, "-o", self.folder / "at_once")
        self.assertEqual([p.name for p in self.folder.iterdir()], ["at_once"], "a file between is left")
        case = self.folder / "patient"
        new, _ = self.ok("new", *scan, *choice, "-o", case)
        spheres = ("--spheres", "0.48") if "spheres" in pose else ()
        self.ok("preprocess", case, "-o", self.folder / "patient.hdf", *mesh, *spheres)
        self.ok("pose", self.folder / "patient.hdf", *pose, "-o", self.folder / "step_by_step")
        self.same(self.folder / "at_once", self.folder / "step_by_step")
        del new["case"], new["ok"]
        self.assertEqual(said["scan"], new)
        self.assertNotIn("model", said)
        return said, stderr

    def test_a_folder_of_totalsegmentator(self):
        said, stderr = self.by_both_ways(self.scan, (), COARSE, ("--pose", "lib:arms_up"))
        self.assertIn("scan: 80 bones, 23 tissues, skin round the label of the body", stderr)
        self.assertIn("notes on the scan, and what became of each label: ecorche new, with --report", stderr)
        self.assertLess(sum(not line.startswith("warning: joint") for line in stderr.splitlines()), 8, stderr)
        self.assertEqual(len(said["scan"]["bones"]), 80)

    def test_dicom_with_two_series(self):
        (self.home / "zero.yaml").write_text("ecorche_pose: 1\nskeleton: phantom\n")
        made = self.home / "dicom"
        self.ok("pose", MODEL, "--pose", self.home / "zero.yaml", "--volumes", "all", "--volume-format", "dicom", "-o", made)
        other = generate_uid()
        for path in list((made / "ct.dicom").iterdir()):
            data = pydicom.dcmread(path)
            data.SeriesInstanceUID, data.SeriesDescription, data.SOPInstanceUID = other, "another", generate_uid()
            data.file_meta.MediaStorageSOPInstanceUID = data.SOPInstanceUID
            data.save_as(path.with_name("b" + path.name))
        scan = [made / "ct.dicom", made / "labels.dcm"]
        result = run("pose", "--scan", *scan, "--pose", "lib:sitting", "-o", self.folder / "x")
        self.assertEqual((result.returncode, "holds 2 series" in result.stderr), (65, True), result.stderr)
        said, stderr = self.by_both_ways(scan, ("--series", "ct, zero", "--skin-hu", "-250"), COARSE,
                                         ("--pose", "lib:sitting", "--volumes", "ct", "--tissues", "all", "--deformer", "spheres"))
        self.assertIn("denser than -250 HU in ct.dicom", stderr)
        self.assertIn("warning: the body's label leaves 100 % of the bones outside", stderr)
        self.assertEqual(len(said["scan"]["doubts"]), 1)

    def test_least_sure_is_named(self):
        """The toes without the bones beside them find their sides by the mid-plane alone."""
        scan = self.folder / "scan"
        scan.mkdir()
        shutil.copytree(self.scan[1], scan / "total")
        shutil.copytree(self.scan[2], scan / "appendicular_bones")
        for name in ("femur_left", "femur_right"):
            (scan / "total" / f"{name}.nii.gz").unlink()
        for name in ("tibia", "fibula", "patella"):
            (scan / "appendicular_bones" / f"{name}.nii.gz").unlink()
        _, stderr = self.ok("pose", "--scan", scan / "total", scan / "appendicular_bones", self.scan[4], "--pose", "lib:arms_up", *COARSE,
                            "-o", self.folder / "posed")
        self.assertRegex(stderr, r"(?m)^least sure: \w+ 0\.\d+ \(name; its side: .*\); \w+ 0\.\d+ \(.*\); \w+ 0.*; and \d+ more$")

    def test_refusals(self):
        """Each at once, or as the command says that it does the work of; none leaves a file."""
        out = self.folder / "out"
        foreign = self.folder / "foreign"
        foreign.mkdir()
        (foreign / "letter.txt").write_text("dear")
        pose = ("--pose", "lib:arms_up")
        before = {p.name for p in self.folder.iterdir()}
        for words, code, line in (
                (("-o", out, *pose), 64, "error: pose: no model is given (give a MODEL that preprocess made, or --scan SCAN...)"),
                ((MODEL, "--scan", self.scan[0], "-o", out, *pose), 64, "both MODEL and --scan are given"),
                ((MODEL, "--skin-hu", "0", "-o", out, *pose), 64, "--skin-hu requires --scan"),
                ((MODEL, "--max-tets", "9000", "-o", out, *pose), 64, "--max-tets requires --scan"),
                (("-o", out, "--scan", *self.scan), 64, "nothing to pose"),
                (("-o", out, "--pose", "lib:flying", "--scan", *self.scan), 64, "has no pose 'flying'"),
                (("-o", out, "--motion", CASE / "motion" / "walk.bvh", "--scan", *self.scan), 64, "no frames are named"),
                (("-o", out, "--pose", self.folder / "none.yaml", "--scan", *self.scan), 66, "none.yaml: cannot be opened"),
                (("-o", out, *pose, "--no-bridge", "--scan", *self.scan), 64, "--no-bridge: tets open no gaps"),
                (("-o", out, *pose, "--scan", self.folder / "none"), 66, "none: no such file or folder (mend the path)"),
                (("-o", out, *pose, "--bone-hu", "2900", "--scan", self.scan[0]), 65, "holds no bone: only 0 ml"),
                (("-o", foreign, *pose, "--scan", *self.scan), 73, "holds letter.txt, which is of no posed body here"),
        ):
            result = run("pose", *words)
            self.assertEqual(result.returncode, code, result.stderr)
            self.assertIn(line, result.stderr)
            self.assertEqual({p.name for p in self.folder.iterdir()}, before, words)
        self.assertEqual((foreign / "letter.txt").read_text(), "dear")

    def test_a_pose_that_does_not_fit_is_refused_before_the_long_stages(self):
        pose = self.folder / "pose.yaml"
        pose.write_text("ecorche_pose: 1\nskeleton: human\njoints:\n  knee_rigth: {flexion_deg: 50}\n")
        result = run("pose", "--scan", *self.scan, "--pose", pose, "-o", self.folder / "posed")
        self.assertEqual(result.returncode, 78, result.stderr)
        self.assertIn("did you mean 'knee_right'?", result.stderr)
        self.assertEqual(list(self.folder.iterdir()), [pose])

    def test_a_hinge_that_is_clamped_is_told_by_the_limit_that_it_has(self):
        pose = self.folder / "pose.yaml"
        pose.write_text("ecorche_pose: 1\nskeleton: human\njoints:\n  knee_left: {flexion_deg: -40}\n")
        said, _ = self.ok("pose", "--scan", *self.scan, "--pose", pose, *COARSE, "--tissues", "none", "-o", self.folder / "posed")
        clamped = [joint for joint in said["frames"][0]["quality"]["clamped"] if joint["joint"] == "knee_left"]
        self.assertEqual([limit["angle"] for limit in clamped[0]["limits"]], ["flexion"], clamped)

    def test_errors_name_the_case_as_new_would(self):
        words = [ECORCHE, "pose", "--scan", *self.scan, "--pose", "lib:arms_up", *COARSE, "-o", self.folder / "posed"]
        result = subprocess.run([str(word) for word in words], capture_output=True, text=True, timeout=120, preexec_fn=small_files_only,
                                restore_signals=False)
        self.assertEqual(result.returncode, 74, result.stderr)
        self.assertRegex(result.stderr, r"(?m)^error: patient/.*labels\.nrrd: .*; ecorche new SCAN... -o patient writes that case, to be looked at and mended\)$")
        self.assertEqual(list(self.folder.iterdir()), [])

    def test_stopped_at_six_points(self):
        words = [ECORCHE, "pose", "--scan", *self.scan, "--pose", "lib:arms_up", *COARSE, "--tissues", "skin", "-o", self.folder / "posed"]
        start = time.monotonic()
        self.ok(*words[1:])
        seconds = time.monotonic() - start
        shutil.rmtree(self.folder / "posed")
        for n in range(6):
            how = signal.SIGKILL if n == 3 else signal.SIGINT
            child = subprocess.Popen([str(word) for word in words], stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True)
            time.sleep(seconds * (n + 0.3) / 7)
            child.send_signal(how)
            _, err = child.communicate(timeout=60)
            left = [p for p in self.folder.iterdir() if p.name != "posed"]
            if how == signal.SIGKILL:  # the next run sweeps it
                self.assertEqual([oct(p.stat().st_mode & 0o777) for p in left], ["0o700"])
                self.assertTrue(left[0].name.startswith("."))
                continue
            self.assertEqual(left, [], f"stop {n} leaves something")
            if child.returncode == 130:
                self.assertIn("interrupted (run it again)", err)
                self.assertFalse((self.folder / "posed").exists())
            shutil.rmtree(self.folder / "posed", ignore_errors=True)


if __name__ == "__main__":
    unittest.main()
