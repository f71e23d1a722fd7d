#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Posed bodies as DICOM: the same voxels as in NRRD, read again by every command that reads an image."""
import gzip
import json
import pathlib
import shutil
import tempfile
import unittest

import numpy as np
import pydicom

from posed_files import CASE, MODEL, run

POSE = "ecorche_pose: 1\nskeleton: phantom\njoints:\n  knee_right: {flexion_deg: 50}\n  elbow_left: {flexion_deg: 60}\n"


def image(path):
    """Values [k, j, i], origin and edge of one of our NRRDs on cubic voxels."""
    head, body = path.read_bytes().split(b"\n\n", 1)
    field = dict(line.split(": ", 1) for line in head.decode().splitlines() if ": " in line and line[0] != "#")
    kind = {"unsigned char": "u1", "short": "<i2", "unsigned short": "<u2"}[field["type"]]
    size = [int(n) for n in field["sizes"].split()]
    origin = np.array([float(x) for x in field["space origin"].strip("()").split(",")])
    edge = float(field["space directions"].split(",")[0][1:])
    return np.frombuffer(gzip.decompress(body), kind).reshape(size[::-1]), origin, edge


class Dicom(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = pathlib.Path(tempfile.mkdtemp())
        cls.addClassCleanup(shutil.rmtree, cls.folder)
        (cls.folder / "pose.yaml").write_text(POSE)
        for name, more in (("nrrd", ()), ("dicom", ("--volume-format", "dicom"))):
            done = run("--json", "pose", MODEL, "-o", cls.folder / name, "--pose", cls.folder / "pose.yaml", "--volumes", "ct,labels",
                       "--tets", *more)
            assert done.returncode == 0, done.stderr
        cls.files = json.loads(done.stdout)["frames"][0]["files"]

    def ok(self, *words):
        done = run(*words)
        self.assertEqual(done.returncode, 0, done.stderr)
        return done

    def test_slices_and_segments_are_what_nrrd_holds(self):
        posed = self.folder / "dicom"
        self.assertEqual([pathlib.Path(name).name for name in self.files][:3], ["body.vtu", "ct.dicom", "labels.dcm"])
        values, origin, edge = image(self.folder / "nrrd" / "ct.nrrd")
        slices = [pydicom.dcmread(path) for path in sorted((posed / "ct.dicom").iterdir())]
        self.assertEqual(len(slices), len(values))
        for k, data in enumerate(slices):
            np.testing.assert_allclose(data.ImagePositionPatient, origin + [0, 0, k * edge], atol=1e-6)
            np.testing.assert_allclose([*data.PixelSpacing, data.SliceThickness], [edge] * 3)
            np.testing.assert_array_equal(data.pixel_array * int(data.RescaleSlope) + int(data.RescaleIntercept), values[k])
        self.assertIn("pose", slices[0].SeriesDescription)
        labels, origin, edge = image(self.folder / "nrrd" / "labels.nrrd")
        seg = pydicom.dcmread(posed / "labels.dcm")
        self.assertEqual(seg.FrameOfReferenceUID, slices[0].FrameOfReferenceUID)
        told = json.loads((self.folder / "nrrd" / "posed.json").read_text())
        table = next(one for one in told["files"] if one["file"] == "labels.nrrd")["labels"]
        table = {name: int(i) for i, name in table.items() if int(i) in set(np.unique(labels))}
        self.assertEqual([one.SegmentLabel for one in seg.SegmentSequence], sorted(table, key=table.get))
        names = {one.SegmentNumber: one.SegmentLabel for one in seg.SegmentSequence}
        again = np.zeros_like(labels)
        for frame, bits in zip(seg.PerFrameFunctionalGroupsSequence, seg.pixel_array):
            at = np.array(frame.PlanePositionSequence[0].ImagePositionPatient, float)
            number = frame.SegmentIdentificationSequence[0].ReferencedSegmentNumber
            again[round((at[2] - origin[2]) / edge)][bits > 0] = table[names[number]]
        np.testing.assert_array_equal(again, labels)

    def test_the_way_back_is_that_of_nrrd(self):
        for name in ("nrrd", "dicom"):
            self.ok("unpose", self.folder / name, "-o", self.folder / f"back_{name}")
        a, b = (image(self.folder / f"back_{name}" / "ct.nrrd") for name in ("nrrd", "dicom"))
        self.assertGreater((a[0] == b[0]).mean(), 0.9999)
        self.assertTrue((self.folder / "back_dicom" / "labels.seg.nrrd").exists())

    def test_a_case_of_dicom(self):
        case = self.folder / "case"
        shutil.copytree(CASE, case, ignore=shutil.ignore_patterns("volumes", "motion"))
        text = (case / "case.yaml").read_text()
        text = text[:text.index("volumes:")]
        shutil.copytree(self.folder / "dicom" / "ct.dicom", case / "scan")
        shutil.copy(self.folder / "dicom" / "labels.dcm", case / "seg.dcm")
        text += "volumes:\n  - {name: ct, file: scan}\nlabels: {file: seg.dcm}\n"
        (case / "case.yaml").write_text(text)
        self.ok("check", case)
        (case / "case.yaml").write_text(text.replace("file: scan}", "file: scan, series: Head}"))
        done = run("check", case)
        self.assertEqual(done.returncode, 65, done.stderr)
        self.assertIn("has no series 'Head', but 2.25.", done.stderr)

    def test_refill_reads_and_writes_a_series(self):
        scan = self.folder / "dicom" / "ct.dicom"
        thin = self.folder / "thin.vtp"
        self.ok("thin", self.folder / "nrrd" / "labels.nrrd", "-o", thin)
        self.ok("refill", thin, scan, "-o", self.folder / "full.dicom", "--series", "ct, pose")
        self.ok("refill", thin, self.folder / "nrrd" / "ct.nrrd", "-o", self.folder / "full.nrrd")
        values = image(self.folder / "full.nrrd")[0]
        slices = sorted((self.folder / "full.dicom").iterdir())
        self.assertEqual(len(slices), len(values))
        np.testing.assert_array_equal(pydicom.dcmread(slices[40]).pixel_array, values[40])

    def test_mistakes(self):
        pose = ("pose", MODEL, "-o", self.folder / "x", "--pose", self.folder / "pose.yaml")
        for more, part in (
                (("--keep-identity",), "--keep-identity: no DICOM is written (add --volume-format dicom)"),
                (("--keep-identity", "--volume-format", "dicom"), "a model does not know who was scanned (name the scan: --dicom-source DIR)"),
                (("--dicom-series", "1", "--volume-format", "dicom"), "there is no --dicom-source")):
            done = run(*pose, *more)
            self.assertEqual(done.returncode, 64, done.stderr)
            self.assertIn(part, done.stderr)
        done = run(*pose, "--volume-format", "dicom", "--dicom-source", self.folder / "nrrd")
        self.assertEqual(done.returncode, 65, done.stderr)
        self.assertIn("holds no slices of an image", done.stderr)
        self.assertFalse((self.folder / "x").exists())
        done = run("thin", self.folder / "nrrd" / "labels.nrrd", "-o", self.folder / "t.vtp", "--series", "1")
        self.assertEqual(done.returncode, 65, done.stderr)
        self.assertIn("is no DICOM, which alone has series (leave out series)", done.stderr)


if __name__ == "__main__":
    unittest.main()
