#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Scans as strangers give them to `ecorche new`: nothing of a scan is lost or taken for another without a word."""
import json
import os
import pathlib
import resource
import shutil
import signal
import subprocess
import tempfile
import unittest
import xml.etree.ElementTree as xml

import nibabel
import numpy as np
import yaml

from posed_files import ECORCHE, run


def read_labels(path):
    """A label map, and its names, as TotalSegmentator leaves them in the header."""
    image = nibabel.load(path)
    text = image.header.extensions[0].get_content().decode().rstrip("\0")
    return np.asarray(image.dataobj).astype("u1"), {label.text: int(label.get("Key")) for label in xml.fromstring(text).iter("Label")}


def write_labels(path, values, names, affine):
    image = nibabel.Nifti1Image(values, affine)
    labels = "".join(f'<Label Key="{label}"><![CDATA[{name}]]></Label>' for name, label in names.items())
    image.header.extensions.append(nibabel.nifti1.Nifti1Extension(0, f"<CaretExtension><LabelTable>{labels}</LabelTable></CaretExtension>".encode()))
    nibabel.save(image, path)


class GivenScans(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = pathlib.Path(tempfile.mkdtemp())
        cls.addClassCleanup(shutil.rmtree, cls.folder)
        cls.scan = cls.folder / "scan"
        result = run("phantom", "-o", cls.scan, "--size", "small", "--scan", "totalsegmentator_ml", "--voxel", "8")
        assert result.returncode == 0, result.stderr
        cls.affine = nibabel.load(cls.scan / "ct.nii.gz").affine
        cls.total, cls.names = read_labels(cls.scan / "total.nii.gz")

    def place(self):
        out = self.folder / self.id().rsplit(".", 1)[-1]
        out.mkdir()
        return out

    def new(self, *words):
        result = run("new", *words)
        self.assertEqual(result.returncode, 0, result.stderr)
        return result.stdout + result.stderr

    def test_names_that_are_numbers_or_nothing_in_yaml(self):
        """A structure called by a number is that structure, not the label of that number, and one called `null` is no hole in the case."""
        place = self.place()
        called = {"liver": str(self.names["femur_left"]), "spleen": "null", "stomach": "true", "aorta": "007", "colon": "1e3"}
        write_labels(place / "total.nii.gz", self.total, {called.get(name, name): label for name, label in self.names.items()}, self.affine)
        self.new(place / "total.nii.gz", self.scan / "body.nii.gz", "-o", place / "case")
        case = yaml.safe_load((place / "case/case.yaml").read_text())
        ids = {name: label for label, name in case["labels"]["table"].items()}
        tissues = {tissue["name"]: tissue["labels"] for tissue in case["tissues"]}
        for name in called.values():
            self.assertIn(tissues[name], ([name], [ids[name]]), tissues)
        result = run("--json", "check", place / "case", "--all")
        self.assertEqual(result.returncode, 0, result.stderr)
        volumes = {surface["name"]: surface["volume_mm3"] for surface in json.loads(result.stdout)["surfaces"]}
        for name, word in called.items():
            voxels = 8**3 * np.count_nonzero(self.total == self.names[name])
            self.assertLess(abs(volumes[word] - voxels), 0.2 * voxels, name)

    def test_a_study_with_its_segmentation_in_one_folder(self):
        """A folder of DICOM with a series and a DICOM SEG is both, and what is no DICOM in it is told."""
        place = self.place()
        words = [*sorted(self.scan.glob("*.nii.gz")), "-o", place / "posed", "--pose", "lib:anatomical", "--max-tets", "20000"]
        result = run("pose", "--scan", *words, "--volumes", "all", "--volume-format", "dicom", "--grid", "rest")
        self.assertEqual(result.returncode, 0, result.stderr)
        study = place / "study"
        shutil.copytree(place / "posed/ct.dicom", study / "ct")
        shutil.copytree(study / "ct", place / "series")
        shutil.copy(place / "posed/labels.dcm", study)
        shutil.copy(self.scan / "body.nii.gz", study)
        told = self.new(study, "-o", place / "one")
        self.assertIn("study: 1 image below it is not read, the first body.nii.gz", told)
        self.assertNotIn("not read", self.new(study, study / "body.nii.gz", "-o", place / "three"))
        self.new(place / "series", study / "labels.dcm", "-o", place / "two")
        for name in ("ct.nrrd", "labels.nrrd"):
            self.assertEqual((place / "one" / name).read_bytes(), (place / "two" / name).read_bytes(), name)

    def test_folders_below_are_told(self):
        """A folder that holds the CT, and the segmentation in folders below it, is not taken for a CT alone without a word."""
        place = self.place()
        (place / "scan/segmentations").mkdir(parents=True)
        shutil.copy(self.scan / "ct.nii.gz", place / "scan")
        for task in ("total", "body"):
            shutil.copy(self.scan / f"{task}.nii.gz", place / "scan/segmentations")
        told = self.new(place / "scan", "-o", place / "alone")
        self.assertIn("scan: 2 images below it are not read, the first segmentations/body.nii.gz: where they belong to this scan, give them", told)
        told = self.new(place / "scan", place / "scan/segmentations", "-o", place / "both")
        self.assertNotIn("not read", told)
        self.assertNotIn("by a template", told)

    def masks(self, change):
        """A folder of masks, one changed, beside the body: the words for `new`."""
        place = self.place()
        (place / "total").mkdir()
        for name in ("femur_left", "femur_right", "hip_left", "hip_right", "sacrum", "tibia_left"):
            mask = (self.total == self.names.get(name, 255)).astype("u1")
            nibabel.save(nibabel.Nifti1Image(change(mask) if name == "femur_left" else mask, self.affine), place / f"total/{name}.nii.gz")
        return [self.scan / "body.nii.gz", place / "total", "-o", place / "case"]

    def check_masks(self, change):
        words = self.masks(change)
        told = self.new(*words)
        self.assertIn("1 of 6 masks are empty", told)
        case = yaml.safe_load((words[-1] / "case.yaml").read_text())
        self.assertIn("femur_left", [bone["name"] for bone in case["bones"]])
        self.assertNotIn("volumes", case)

    def test_a_mask_of_shares(self):
        self.check_masks(lambda mask: mask.astype("f4") * np.float32(0.9))

    def test_a_mask_of_255_in_a_signed_byte(self):
        self.check_masks(lambda mask: (mask * 255).view("i1"))

    def refused_mask(self, change, count):
        words = self.masks(change)
        result = run("new", *words)
        self.assertEqual(result.returncode, 65, result.stderr)
        self.assertIn(f"femur_left.nii.gz: is named as a mask, but {count} of its {self.total.size} values are NaN, or between 0 and 1 (save 0 and 1", result.stderr)
        self.assertFalse(words[-1].exists())

    def test_a_mask_with_nan(self):
        def change(mask):
            out = mask.astype("f4")
            out[0, 0, 0] = np.nan
            return out
        self.refused_mask(change, 1)

    def test_a_mask_of_probabilities(self):
        def change(mask):
            out = mask.astype("f4")
            out[0, 0, :3] = 0.2, 0.5, 0.7
            return out
        self.refused_mask(change, 3)

    def test_an_image_beside_masks_stays_one(self):
        """Names such as T1 are those of images, too; of a vertebra's mask they say nothing."""
        words = self.masks(lambda mask: mask)
        image = np.random.default_rng(1).uniform(0, 900, self.total.shape).astype("f4")
        nibabel.save(nibabel.Nifti1Image(image, self.affine), words[1] / "T1.nii.gz")
        self.new(*words)
        case = yaml.safe_load((words[-1] / "case.yaml").read_text())
        self.assertEqual([volume["name"] for volume in case["volumes"]], ["t1"])

    def test_one_pair_of_bones_the_other_way_round(self):
        """Told wherever the patient lies, and of no scan whose names are right."""
        place = self.place()
        swap = {"femur_left": "femur_right", "femur_right": "femur_left"}
        said = "femur_left lies to the right of femur_right, against "
        others = ("body", "appendicular_bones")
        for turn in (np.eye(4), np.array([[0, -1, 0, 0], [1, 0, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]])):
            affine = turn @ self.affine
            for names in (self.names, {swap.get(name, name): label for name, label in self.names.items()}):
                shutil.rmtree(place / "case", ignore_errors=True)
                write_labels(place / "total.nii.gz", self.total, names, affine)
                for task in others:
                    write_labels(place / f"{task}.nii.gz", *read_labels(self.scan / f"{task}.nii.gz"), affine)
                told = self.new(place / "total.nii.gz", *(place / f"{task}.nii.gz" for task in others), "-o", place / "case")
                self.assertEqual(said in told, names is not self.names, told)
                self.assertEqual("are exchanged" in told, names is not self.names, told)
                if names is not self.names:
                    self.assertRegex(told, r"against 1\d other pairs of bones: left and right are exchanged in the names of one or the other")

    def test_a_report_that_cannot_be_written(self):
        """It is refused before a case stands in the way of the next try; one within the case can be."""
        place = self.place()
        words = [self.scan / "total.nii.gz", self.scan / "body.nii.gz", "-o", place / "case"]
        for report in (place / "none/page.html", place):
            result = run("new", *words, "--report", report)
            self.assertEqual(result.returncode, 73, result.stderr)
            self.assertEqual(list(place.iterdir()), [])
        self.new(*words, "--report", place / "case/page.html")
        self.assertEqual(sorted(path.name for path in (place / "case").iterdir()), ["case.yaml", "labels.nrrd", "page.html", "picture.png"])

    def test_a_case_that_cannot_be_written_whole(self):
        """Nothing of it stays, so that it can be tried again when there is room."""
        place = self.place()
        words = ["new", *sorted(self.scan.glob("*.nii.gz")), "-o", place / "case"]
        self.new(*words[1:])
        sizes = {name: (place / "case" / name).stat().st_size for name in ("labels.nrrd", "ct.nrrd")}
        shutil.rmtree(place / "case")
        self.assertLess(sizes["labels.nrrd"], sizes["ct.nrrd"])

        def small_files():
            signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
            resource.setrlimit(resource.RLIMIT_FSIZE, (sizes["ct.nrrd"] - 1, sizes["ct.nrrd"] - 1))

        for made in (False, True):
            if made:
                (place / "case").mkdir()
            result = subprocess.run([ECORCHE, *map(str, words)], capture_output=True, text=True, timeout=120, preexec_fn=small_files, restore_signals=False)
            self.assertEqual((result.returncode, "/case/ct.nrrd: " in result.stderr), (74, True), result.stderr)
            self.assertEqual(list(place.glob("**/*")), [place / "case"] if made else [])
        self.new(*words[1:])

    def test_the_commands_that_are_told_can_be_run(self):
        """Whatever the folder is called; and the case is text in UTF-8."""
        place = self.place()
        for name in ("a case/", "it's", ".", os.fsdecode(b"h\xfcfte")):
            here = place / str(len(list(place.iterdir())))
            here.mkdir()
            result = subprocess.run([ECORCHE, "new", self.scan / "total.nii.gz", self.scan / "body.nii.gz", "-o", name], capture_output=True, cwd=here, timeout=120)
            self.assertEqual(result.returncode, 0, result.stderr)
            line = next(line for line in result.stdout.splitlines() if line.startswith(b"Next: ecorche "))
            command = b"'" + os.fsencode(ECORCHE) + b"' " + line[14:] + b" --max-tets 20000"
            done = subprocess.run(["sh", "-c", command], capture_output=True, cwd=here, timeout=120)
            self.assertEqual(done.returncode, 0, done.stderr)
            (here / name / "case.yaml").read_bytes().decode()

    def test_files_that_are_cut(self):
        place = self.place()
        whole = (self.scan / "total.nii.gz").read_bytes()
        for data, line in ((b"", "is empty: it has no bytes (copy it again)"), (whole[:-5], "its gzip stream is cut off behind the voxels: its checksum is missing (copy it again)")):
            (place / "total.nii.gz").write_bytes(data)
            result = run("new", place / "total.nii.gz", self.scan / "body.nii.gz", "-o", place / "case")
            self.assertEqual((result.returncode, result.stderr.strip()), (65, f"error: {place / 'total.nii.gz'}: {line}"))

    def test_an_image_called_as_files_of_a_posed_body_are(self):
        """It goes by another name: else posing is refused for an option that nobody gave."""
        place = self.place()
        for name in ("mask", "displacement"):
            shutil.copy(self.scan / "ct.nii.gz", place / f"{name}.nii.gz")
            image = nibabel.load(self.scan / "ct.nii.gz")
            nibabel.save(nibabel.Nifti1Image(np.asarray(image.dataobj).astype("f4") + 1000.5, image.affine), place / f"{name}.nii.gz")
        self.new(self.scan / "total.nii.gz", self.scan / "body.nii.gz", place / "mask.nii.gz", place / "displacement.nii.gz", "-o", place / "case")
        case = yaml.safe_load((place / "case/case.yaml").read_text())
        self.assertEqual([volume["name"] for volume in case["volumes"]], ["image", "image_2"])

    def test_options_that_mean_nothing(self):
        """A NaN lies within no range, and a series is DICOM's."""
        place = self.place()
        scan = [self.scan / "total.nii.gz", self.scan / "body.nii.gz", "-o", place / "case"]
        for words, line in (
                (["new", *scan, "--skin-hu", "nan"], "ecorche new: --skin-hu: 'nan' is no number (see ecorche new --help)"),
                (["repair", "none", "-o", place / "case", "--weld", "-NaN"], "ecorche repair: --weld: '-NaN' is no number (see ecorche repair --help)"),
                (["new", *scan, "--series", "1.2"], "--series: nothing here is DICOM, which alone has series (leave it out)"),
        ):
            result = run(*words)
            self.assertEqual((result.returncode, result.stderr.strip()), (64, f"error: {line}"))
            self.assertFalse((place / "case").exists())

    def test_an_image_that_is_no_ct_is_told(self):
        """Where the skin is drawn from a CT, an image that was given and is none is named."""
        place = self.place()
        image = nibabel.load(self.scan / "ct.nii.gz")
        nibabel.save(nibabel.Nifti1Image((np.asarray(image.dataobj).astype("i4") + 1024).clip(0).astype("u2"), image.affine), place / "ct.nii.gz")
        result = run("new", place / "ct.nii.gz", self.scan / "appendicular_bones.nii.gz", self.scan / "craniofacial_structures.nii.gz", "-o", place / "case")
        self.assertEqual(result.returncode, 65, result.stderr)
        self.assertRegex(result.stderr, r"nothing says where the skin is: .* is bone; ct.nii.gz is no CT in HU \(its least value is 0\) \(give the CT too")


if __name__ == "__main__":
    unittest.main(verbosity=2)
