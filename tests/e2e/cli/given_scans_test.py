#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Scans as strangers give them to `ecorche new`: nothing of a scan is lost or taken for another without a word."""
import json
import pathlib
import shutil
import tempfile
import unittest
import xml.etree.ElementTree as xml

import nibabel
import numpy as np
import yaml

from posed_files import run


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


if __name__ == "__main__":
    unittest.main(verbosity=2)
