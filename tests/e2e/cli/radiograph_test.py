#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""`ecorche radiograph`: pictures against rays through the posed CT that numpy follows, how they are hung, files as others read them, and
what is refused."""
import json
import pathlib
import re
import shutil
import tempfile
import unittest

import nibabel
import numpy as np
import pydicom
import vtk
from vtk.util.numpy_support import vtk_to_numpy

from posed_files import MODEL, run

BENT = "ecorche_pose: 1\nskeleton: phantom\njoints:\n  elbow_left: {flexion_deg: 80}\n  knee_right: {flexion_deg: 40}\n"
ASIDE = BENT.replace("joints:", "root: {translation_mm: [9000, -400, 20], rotation: [0.9, 0.3, -0.2, 0.24494897427831783]}\njoints:")
WATER = 0.02059  # 1/mm at 60 keV


def attenuation(hu):
    """At 60 keV, as docs/reference/radiograph.md says it: the tables' rows at 60 keV, and at 70 keV between those of 60 and 80."""
    def between(a, b):
        return a * (b / a) ** (np.log(70 / 60) / np.log(80 / 60))
    water, bone = 0.2059, 0.3148 * 1.92
    bone_hu = 1000 * (between(0.3148, 0.2229) * 1.92 / between(0.2059, 0.1837) - 1)
    return np.where(hu <= -1000, 0, np.where(hu <= 0, water * (1 + hu / 1000), water + hu * (bone - water) / bone_hu)) / 10


class Radiograph(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = pathlib.Path(tempfile.mkdtemp())
        cls.addClassCleanup(shutil.rmtree, cls.folder)
        for name, text in (("bent", BENT), ("aside", ASIDE)):
            (cls.folder / f"{name}.yaml").write_text(text)

    def made(self, name, *words):
        out = self.folder / name
        result = run("--json", "radiograph", MODEL, "-o", out, *words)
        self.assertEqual(result.returncode, 0, result.stderr)
        return out, json.loads(result.stdout)

    def integrals(self, *words):
        """Rows by columns, and what the command says."""
        path, said = self.made("p.nii.gz", *words)
        return np.asarray(nibabel.load(path).dataobj)[..., 0].T, said

    def png(self, path):
        reader = vtk.vtkPNGReader()
        reader.SetFileName(str(path))
        reader.Update()
        image = reader.GetOutput()
        width, height, _ = image.GetDimensions()
        return np.flipud(vtk_to_numpy(image.GetPointData().GetScalars()).reshape(height, width))

    def refused(self, code, part, *words, out="no.png"):
        result = run("radiograph", MODEL, "-o", self.folder / out, *words)
        self.assertEqual(result.returncode, code, result.stderr)
        self.assertRegex(result.stderr, re.compile(r"^error: .+: .+ \(.+\)$", re.M))
        self.assertIn(part, result.stderr)
        self.assertFalse((self.folder / out).exists())

    def test_every_ray_is_that_through_the_posed_ct(self):
        pose = ("--pose", self.folder / "bent.yaml")
        p, said = self.integrals(*pose, "--view", "pa", "--target", "forearm_left", "--size", "300,200", "--pixels", "48,32")
        self.assertEqual(said["of"], "ct")
        self.assertEqual(p.shape, (32, 48))
        folder = self.folder / "posed"
        self.assertEqual(run("pose", MODEL, "-o", folder, *pose, "--volumes", "ct", "--volume-format", "nii.gz").returncode, 0)
        ct = nibabel.load(folder / "ct.nii.gz")
        # nibabel is RAS; the command, LPS.
        to_index = np.linalg.inv(np.diag([-1, -1, 1, 1]) @ ct.affine)
        mu = np.pad(attenuation(np.asarray(ct.dataobj, float)), 1)
        setup = said["setup"]
        source, detector = np.array(setup["source"]), {key: np.array(value) for key, value in setup["detector"].items()}
        checked = 0
        for row in range(0, 32, 5):
            for column in range(0, 48, 5):
                pixel = (detector["centre"] + detector["right"] * ((column + 0.5) / 48 - 0.5) * 300
                         + detector["down"] * ((row + 0.5) / 32 - 0.5) * 200)
                length = np.linalg.norm(pixel - source)
                t = (np.arange(4000) + 0.5) / 4000
                at = (to_index[:3, :3] @ (source[:, None] + (pixel - source)[:, None] * t)).T + to_index[:3, 3] + 1
                inside = np.all((at >= 0) & (at < np.array(mu.shape) - 1.001), axis=1)
                at = at[inside]
                low = np.floor(at).astype(int)
                part = at - low
                value = sum(np.prod(np.where([i, j, k], part, 1 - part), axis=1) * mu[low[:, 0] + i, low[:, 1] + j, low[:, 2] + k]
                            for i in (0, 1) for j in (0, 1) for k in (0, 1))
                known = value.sum() * length / 4000
                # Three samples a voxel of 6 mm there, one here.
                self.assertAlmostEqual(p[row, column], known, delta=0.03 * known + 0.03, msg=f"{row}, {column}")
                checked += known > 0.5
        self.assertGreater(checked, 20)

    def test_hung_as_radiologists_do(self):
        words = ("--pixels", "90,60", "--size", "900,600", "--target", "0,0,1150", "--sid", "3000", "--oid", "500")
        rest, bent = (self.integrals(*words, *more)[0] for more in ((), ("--pose", self.folder / "bent.yaml")))
        moved = np.abs(bent - rest) > 0.3
        self.assertGreater(moved[:, 45:].sum(), 50, "the left arm is on the picture's right")
        self.assertEqual(moved[:, :45].sum(), 0)
        back = self.integrals(*words, "--view", "pa")[0]
        self.assertGreater(np.corrcoef(rest.ravel(), back.ravel())[0, 1], 0.98)
        self.assertLess(rest[:, :5].max(), 0.1)
        # The arm that is bent goes to the front.
        for view, front in (("lateral_left", slice(0, 40)), ("lateral_right", slice(50, 90))):
            rest, bent = (self.integrals(*words, "--view", view, *more)[0] for more in ((), ("--pose", self.folder / "bent.yaml")))
            gained = np.nonzero(bent - rest > 0.3)
            self.assertGreater(len(gained[1]), 20)
            self.assertTrue(front.start <= np.median(gained[1]) < front.stop, view)
        # Feet are at the bottom: more of the whole body's width is up.
        whole = self.integrals("--pixels", "40,100", "--size", "800,2000", "--sid", "4000")[0]
        wide = (whole > 0.5).sum(axis=1)
        self.assertGreater(wide[10:50].sum(), wide[60:100].sum())

    def test_views_go_with_the_root(self):
        words = ("--pixels", "64,64", "--target", "hand_left", "--size", "200,200")
        here, there = (self.integrals(*words, "--pose", self.folder / f"{name}.yaml") for name in ("bent", "aside"))
        self.assertLess(np.abs(here[0] - there[0]).max(), 1e-3)
        self.assertGreater(there[1]["setup"]["source"][0], 8000)
        # The same by source and detector, where the body stands.
        setup = there[1]["setup"]
        numbers = [*setup["detector"]["centre"], *setup["detector"]["right"], *setup["detector"]["down"]]
        placed = self.integrals("--pixels", "64,64", "--size", "200,200", "--pose", self.folder / "aside.yaml", "--source",
                                ",".join(map(repr, setup["source"])), "--detector", ",".join(map(repr, numbers)))
        self.assertLess(np.abs(placed[0] - there[0]).max(), 1e-3)

    def test_detector_faces_the_source(self):
        p, said = self.integrals("--source", "-600,-700,1250", "--detector", "110,120,1250", "--pixels", "32,32")
        down, right = (np.array(said["setup"]["detector"][key]) for key in ("down", "right"))
        np.testing.assert_allclose(down, [0, 0, -1], atol=1e-12)
        beam = np.array([710, 820, 0]) / np.hypot(710, 820)
        np.testing.assert_allclose(np.cross(right, down), beam, atol=1e-12)
        self.assertGreater(p.max(), 3)

    def test_png_is_the_integrals_in_their_window(self):
        words = ("--target", "thorax", "--pixels", "100,80")
        p = self.integrals(*words)[0]
        path, said = self.made("chest.png", *words)
        grey = self.png(path)
        self.assertEqual((grey.dtype, grey.shape), (np.uint16, (80, 100)))
        low, high = said["exposure"]["window"]
        self.assertEqual((low, round(high, 3)), (0, round(float(p.max()), 3)))
        np.testing.assert_allclose(grey, 65535 * p / p.max(), atol=1)
        path, _ = self.made("chest.png", *words, "--window", "1,4")
        np.testing.assert_allclose(self.png(path), 65535 * np.clip((p - 1) / 3, 0, 1), atol=1)
        path, _ = self.made("chest.png", *words, "--scale", "linear", "--window", "0,4")
        np.testing.assert_allclose(self.png(path), 65535 * np.clip((1 - np.exp(-p)) / (1 - np.exp(-4)), 0, 1), atol=1)

    def test_dicom_is_what_others_read(self):
        words = ("--view", "lateral_left", "--target", "knee_left", "--pixels", "120,90", "--size", "240,180", "--oid", "250")
        picture, _ = self.made("knee.png", *words)
        path, said = self.made("knee.dcm", *words)
        data = pydicom.dcmread(path)
        self.assertEqual(data.SOPClassUID.name, "Digital X-Ray Image Storage - For Presentation")
        np.testing.assert_array_equal(data.pixel_array, self.png(picture))
        self.assertEqual((data.PhotometricInterpretation, data.BitsStored, data.PixelIntensityRelationshipSign), ("MONOCHROME2", 16, -1))
        self.assertEqual((data.ViewPosition, list(data.PatientOrientation)), ("LL", ["P", "F"]))
        self.assertEqual(list(data.ImageType), ["DERIVED", "PRIMARY"])
        self.assertEqual((data.DistanceSourceToDetector, data.DistanceSourceToPatient), (1000, 750))
        np.testing.assert_allclose(data.ImagerPixelSpacing, [2, 2])
        np.testing.assert_allclose(data.PixelSpacing, [1.5, 1.5])
        self.assertEqual(str(data.PatientName), "ECORCHE^MODEL")
        self.assertRegex(data.PatientID, r"^ECORCHE-[0-9a-f]{16}$")
        self.assertEqual((data.PatientBirthDate, data.StudyDate, data.PatientIdentityRemoved), ("", "", "YES"))
        self.assertIn("'ct' at 60 keV", data.DerivationDescription)
        uids = {data.StudyInstanceUID, data.SeriesInstanceUID, data.SOPInstanceUID}
        self.assertEqual(len(uids), 3)
        for uid in uids:
            self.assertRegex(uid, r"^2\.25\.[1-9][0-9]{20,38}$")
        before = path.read_bytes()
        self.made("knee.dcm", *words, "--threads", "1")
        self.assertEqual(path.read_bytes(), before, "the same picture is the same file")
        self.made("knee.dcm", *words, "--energy", "80")
        self.assertNotEqual(pydicom.dcmread(path).SOPInstanceUID, data.SOPInstanceUID)

    def test_surfaces_stand_in_for_a_scan(self):
        words = ("--target", "thorax", "--pixels", "96,96")
        ct, surfaces = self.integrals(*words)[0], self.integrals(*words, "--surfaces")
        self.assertEqual(surfaces[1]["of"], "surfaces")
        self.assertGreater(np.corrcoef(ct.ravel(), surfaces[0].ravel())[0, 1], 0.9)
        self.assertLess(np.median(np.abs(ct - surfaces[0])[ct > 1]), 0.6)

    def test_energy_is_the_tables(self):
        words = ("--target", "thigh_left", "--pixels", "40,40", "--size", "200,200")
        soft, hard = self.integrals(*words)[0], self.integrals(*words, "--energy", "100")[0]
        ratio = hard[soft > 1] / soft[soft > 1]
        # Water 0.829; bone, where the rays meet some, less.
        self.assertLess(ratio.max(), 0.1707 / 0.2059 + 1e-3)
        self.assertGreater(ratio.max(), 0.8)
        self.assertLess(ratio.min(), 0.8)

    def test_nothing_in_the_way_is_said(self):
        result = run("radiograph", MODEL, "-o", self.folder / "air.png", "--target", "900,0,900", "--oid", "20", "--size", "50,50")
        self.assertEqual(result.returncode, 0, result.stderr)
        self.assertRegex(result.stderr, r"warning: .*air.png: nothing stands between source and detector \(.+\)")

    def test_refusals(self):
        self.refused(64, "the model has no 'knee_lef' (did you mean 'knee_left'?)", "--target", "knee_lef")
        self.refused(64, "the model has no '1,2' (", "--target", "1,2")
        self.refused(64, "a point beyond 1e9 mm", "--target", "1e10,0,0")
        self.refused(64, "no picture is written as '.jpg' (use .png, .dcm,", out="no.jpg")
        self.refused(64, "--detector: where the source stands is not said (add --source)", "--detector", "1,2,3")
        self.refused(64, "--source: where the detector stands is not said (add --detector)", "--source", "1,2,3")
        self.refused(64, "--view: it does nothing beside --source", "--source", "0,-900,0", "--detector", "0,100,0", "--view", "ap")
        self.refused(64, "--source", "--source", "0,-900", "--detector", "0,100,0")
        self.refused(64, "--detector: 4 numbers (give three", "--source", "0,-900,0", "--detector", "0,100,0,1")
        self.refused(64, "not at right angles", "--source", "0,-900,0", "--detector", "0,100,0,1,0,0,1,0,1")
        self.refused(64, "it lies in the detector", "--source", "0,100,0", "--detector", "0,100,0")
        self.refused(64, "0 pixels along a side", "--pixels", "0,512")
        self.refused(64, "a side of no length", "--size", "430,-1")
        self.refused(64, "--sid: -5 mm (more than 0, at most 1e5)", "--sid", "-5")
        self.refused(64, "--oid: 1200 mm (from 0 to less than the distance of the source)", "--oid", "1200")
        self.refused(64, "would not stand before it (give a greater sid, or an oid)", "--view", "lateral_left", "--sid", "200")
        self.refused(64, "energy: 10 keV (from 20 to 150 keV; a tube's effective energy is about half of its peak voltage)", "--energy", "10")
        self.refused(64, "--window: no two ascending numbers", "--window", "4,2")
        self.refused(64, "line integrals have no --scale", "--window", "0,4", out="no.nrrd")
        self.refused(64, "'labels' holds labels, not Hounsfield units", "--volume", "labels")
        self.refused(64, "the model has no 'mr'", "--volume", "mr")
        self.refused(64, "it does nothing beside --volume", "--volume", "ct", "--surfaces")
        self.refused(64, "reaches beside or behind it (move the source away", "--surfaces", "--source", "0,0,1200", "--detector", "0,300,1200")
        self.refused(66, "none.yaml", "--pose", self.folder / "none.yaml")
        self.refused(73, "nowhere", out="nowhere/no.png")


if __name__ == "__main__":
    unittest.main()
