#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""`ecorche thin`: an image becomes a skeleton that VTK reads, thinner ones come out of it, joints hang on it, mistakes are told."""
import gzip
import json
import os
import pathlib
import re
import shutil
import subprocess
import tempfile
import unittest

import numpy as np
from vtkmodules.util.numpy_support import vtk_to_numpy
from vtkmodules.vtkIOXML import vtkXMLPolyDataReader, vtkXMLPolyDataWriter

ECORCHE = os.environ["ECORCHE_BIN"]
CASE = pathlib.Path(os.environ["ECORCHE_CASE"])
MODEL = pathlib.Path(os.environ["ECORCHE_MODEL"])
ERROR_LINE = re.compile(r"^error: .+: .+ \(.+\)$", re.M)
TYPES = {"uint8": "MET_UCHAR", "int16": "MET_SHORT", "float32": "MET_FLOAT"}

ARM = """ecorche_skeleton: 1
name: arm
segments:
  upper: {joint: {name: shoulder, kind: free, center: [6, 8, 7.5]}}
  lower: {parent: upper, joint: {name: elbow, kind: ball, center: [30, 8, 7.5]}}
  hand: {parent: lower, joint: {name: wrist, kind: ball, center: [50, %s, 7.5]}}
"""


def write_image(path, voxels, spacing=(1, 1, 1), components=1):
    """A raw .mha; `voxels` is k x j x i (x components)."""
    size = voxels.shape[2::-1]
    head = (f"ObjectType = Image\nNDims = 3\nBinaryData = True\nBinaryDataByteOrderMSB = False\nCompressedData = False\n"
            f"TransformMatrix = 1 0 0 0 1 0 0 0 1\nOffset = 0 0 0\nElementSpacing = {' '.join(map(str, spacing))}\n"
            f"DimSize = {' '.join(map(str, size))}\nElementNumberOfChannels = {components}\n"
            f"ElementType = {TYPES[voxels.dtype.name]}\nElementDataFile = LOCAL\n")
    path.write_bytes(head.encode() + voxels.tobytes())
    return path


def run(*words):
    return subprocess.run([ECORCHE, *map(str, words)], capture_output=True, text=True, timeout=120)


class Thin(unittest.TestCase):
    def setUp(self):
        self.folder = pathlib.Path(tempfile.mkdtemp())
        self.addCleanup(shutil.rmtree, self.folder)
        labels = np.zeros((16, 17, 64), np.uint8)
        labels[2:14, 2:15, 2:40] = 3
        labels[3:13, 3:14, 40:62] = 7
        self.bar = write_image(self.folder / "bar.mha", labels)

    def ok(self, *words):
        done = run("--json", *words)
        self.assertEqual(done.returncode, 0, done.stderr)
        return json.loads(done.stdout), done.stderr

    def refused(self, code, *parts, words):
        done = run(*words)
        self.assertEqual(done.returncode, code, done.stderr)
        self.assertEqual(done.stdout, "")
        self.assertRegex(done.stderr, ERROR_LINE)
        for part in parts:
            self.assertIn(part, done.stderr)

    def thin(self, *words, image=None, name="s.vtp"):
        return self.ok("thin", image or self.bar, "-o", self.folder / name, *words)

    def poly_data(self, name="s.vtp"):
        reader = vtkXMLPolyDataReader()
        reader.SetFileName(str(self.folder / name))
        reader.Update()
        return reader.GetOutput()

    def test_vtk_reads_what_was_thinned(self):
        report, _ = self.thin("--tree", "--connect", "--tp", "0.4")
        self.assertEqual(report["voxels"]["object"], 12 * 13 * 38 + 10 * 11 * 22)
        self.assertEqual(report["voxels"]["pieces"], 1)
        self.assertEqual(report["tree"]["components"], 1)
        self.assertEqual(set(report["seconds"]),
                         {"read", "resample", "segment", "pieces", "distance", "thinning", "tree", "write"})
        data = self.poly_data()
        self.assertEqual(data.GetNumberOfPoints(), report["skeletal"])
        self.assertEqual(data.GetNumberOfLines(), report["skeletal"] - 1)
        ijk = vtk_to_numpy(data.GetPointData().GetArray("ijk"))
        self.assertTrue(np.array_equal(vtk_to_numpy(data.GetPoints().GetData()), ijk.astype(np.float32)))
        self.assertGreater(vtk_to_numpy(data.GetPointData().GetArray("deficit")).min(), 0.4)
        self.assertEqual(vtk_to_numpy(data.GetPointData().GetArray("distance")).max(), 36)
        self.assertEqual(data.GetFieldData().GetAbstractArray("metric").GetValue(0), "euclidean")
        self.assertEqual(data.GetFieldData().GetAbstractArray("name").GetValue(0), "s")

    def test_a_thinner_one_out_of_a_thicker_one_is_a_fresh_one(self):
        for metric in "euclidean", "chamfer345":
            self.thin("--tp", "-0.5", "--metric", metric, name="thick.vtp")
            self.thin("--tp", "0.55", "--metric", metric)
            fresh = (self.folder / "s.vtp").read_bytes()
            (self.folder / "s.vtp").unlink()
            self.thin("--tp", "0.55", image=self.folder / "thick.vtp")
            self.assertEqual((self.folder / "s.vtp").read_bytes().replace(b"116 104 105 99 107 0", b"115 0"), fresh)
        self.refused(64, "can only become thinner", words=["thin", self.folder / "thick.vtp", "-o",
                                                            self.folder / "t.vtp", "--tp", "-1"])
        self.refused(64, "--labels", "no meaning", words=["thin", self.folder / "thick.vtp", "-o",
                                                           self.folder / "t.vtp", "--labels", "3"])

    def test_a_skeleton_that_vtk_saved_again_is_the_same(self):
        (self.folder / "arm.yaml").write_text(ARM % 8)
        self.thin("--tp", "0.2", "--tree", "--skeleton", self.folder / "arm.yaml")
        self.thin("--tp", "0.4", "--tree", image=self.folder / "s.vtp", name="thin.vtp")
        thin = (self.folder / "thin.vtp").read_bytes()
        for mode in "Ascii", "Binary", "Appended":
            writer = vtkXMLPolyDataWriter()
            writer.SetFileName(str(self.folder / "again.vtp"))
            writer.SetInputData(self.poly_data())
            getattr(writer, f"SetDataModeTo{mode}")()
            writer.Write()
            self.thin("--tp", "0.4", "--tree", image=self.folder / "again.vtp", name="thin.vtp")
            self.assertEqual((self.folder / "thin.vtp").read_bytes(), thin, mode)
            self.assertIn(b"Name=\"segment\"", thin)

    def test_the_same_bytes_for_any_number_of_threads(self):
        self.thin("--tree", "--tp", "0.2", "--threads", "1", name="a.vtp")
        one = (self.folder / "a.vtp").read_bytes()
        self.thin("--tree", "--tp", "0.2", "--threads", "2", name="a.vtp")
        self.assertEqual((self.folder / "a.vtp").read_bytes(), one)

    def test_which_voxels_are_the_object(self):
        self.assertEqual(self.thin("--labels", "7")[0]["voxels"]["object"], 10 * 11 * 22)
        self.assertEqual(self.thin("--labels", "3,7", "--tp", "-2")[0]["share_percent"], 100)
        rgb = np.zeros((12, 12, 12, 3), np.int16)
        rgb[3:9, 3:9, 3:9, 1] = 500
        image = write_image(self.folder / "rgb.mha", rgb, components=3)
        self.assertEqual(self.thin("--threshold", "400:", "--component", "1", image=image)[0]["voxels"]["object"], 216)
        self.refused(65, "no voxel is of the object", words=["thin", image, "-o", self.folder / "t.vtp",
                                                             "--threshold", "400:"])
        self.refused(64, "--component", words=["thin", image, "-o", self.folder / "t.vtp", "--component", "3"])
        whole = write_image(self.folder / "all.mha", np.ones((9, 9, 9), np.uint8))
        self.assertEqual(self.thin("--tp", "-2", image=whole)[0]["skeletal"], 729)  # background lies beyond
        sheet = np.zeros((9, 20, 20), np.uint8)
        sheet[4, 2:18, 2:18] = 1
        self.assertEqual(self.thin(image=write_image(self.folder / "sheet.mha", sheet))[0]["skeletal"], 256)

    def test_two_pieces(self):
        two = np.zeros((12, 12, 40), np.uint8)
        two[2:10, 2:10, 2:10] = two[3:9, 3:9, 20:30] = 1
        image = write_image(self.folder / "two.mha", two)
        report, said = self.thin("--tree", "--tp", "0.3", image=image)
        self.assertEqual(report["voxels"]["pieces"], 2)
        self.assertIn("--largest", said)
        self.assertGreaterEqual(report["tree"]["components"], 2)
        self.assertIn("--connect", said)
        report, _ = self.thin("--largest", "--tree", "--connect", image=image)
        self.assertEqual(report["voxels"]["object"], 512)
        corner = np.zeros((8, 8, 8), np.uint8)
        corner[1:4, 1:4, 1:4] = corner[4:7, 4:7, 4:7] = 1
        image = write_image(self.folder / "corner.mha", corner)
        self.assertEqual(self.thin("--tp", "0", image=image)[0]["voxels"]["pieces"], 1)
        self.assertEqual(self.thin("--tp", "0", "--boundary", "26", image=image)[0]["voxels"]["pieces"], 2)

    def test_cubes_by_resampling(self):
        grey = np.fromfunction(lambda k, j, i: 100 - np.hypot(np.hypot(2 * (k - 7.5), j - 15.5), i - 15.5),
                               (16, 32, 32)).astype(np.float32)
        image = write_image(self.folder / "grey.mha", grey, spacing=(1, 1, 2))
        words = ["thin", image, "-o", self.folder / "t.vtp", "--threshold", "90:"]
        self.refused(64, "not isotropic", "--isotropic 0", words=words)
        self.refused(64, "--isotropic", words=[*words, "--isotropic", "-1"])
        self.refused(64, "--isotropic", "longer edge", words=[*words, "--isotropic", "1e-5"])
        report, said = self.ok(*words, "--isotropic", "0", "--distance-map", self.folder / "mm.nrrd")
        head, _, packed = (self.folder / "mm.nrrd").read_bytes().partition(b"\n\n")
        self.assertIn(b"sizes: 32 32 16", head)  # the image's own voxels
        mm = np.frombuffer(gzip.decompress(packed), "<f4").reshape(16, 32, 32)
        self.assertTrue(((mm > 0) == (grey >= 90)).all())
        background = np.argwhere(grey < 90) * (2, 1, 1)
        for k, j, i in np.argwhere(grey >= 90)[::50]:
            nearest = ((background - (2 * k, j, i)) ** 2).sum(axis=1).min()
            self.assertEqual(mm[k, j, i], np.float32(np.sqrt(nearest)))
        self.refused(64, "mm.txt", words=[*words, "--isotropic", "0", "--distance-map", self.folder / "mm.txt"])
        self.assertIn("resampled trilinearly from 32 x 32 x 16 to 32 x 32 x 32 voxels of 1 mm", said)
        self.assertEqual(report["resampled"]["sampling"], "trilinear")
        self.assertAlmostEqual(report["voxels"]["object"], 4 / 3 * np.pi * 1000, delta=150)
        labels = write_image(self.folder / "labels.mha", (grey > 90).astype(np.uint8), spacing=(1, 1, 2))
        report, said = self.ok("thin", labels, "-o", self.folder / "t.vtp", "--isotropic", "0.5")
        self.assertIn("to the nearest", said)

    def test_joints(self):
        (self.folder / "arm.yaml").write_text(ARM % 8)
        report, _ = self.thin("--tp", "0.3", "--skeleton", self.folder / "arm.yaml")
        self.assertEqual(sum(report["segments"].values()), report["skeletal"])
        self.assertTrue(all(report["segments"].values()))
        data = self.poly_data()
        segment = vtk_to_numpy(data.GetPointData().GetArray("segment"))
        i = vtk_to_numpy(data.GetPointData().GetArray("ijk"))[:, 0]
        names = data.GetFieldData().GetAbstractArray("segments")
        self.assertEqual([names.GetValue(n) for n in range(3)], ["upper", "lower", "hand"])
        self.assertTrue((segment[i < 26] == 0).all() and (segment[i > 54] == 2).all())

        (self.folder / "wrong.yaml").write_text(ARM % 40)
        words = ["thin", self.bar, "-o", self.folder / "t.vtp", "--skeleton", self.folder / "wrong.yaml"]
        self.refused(78, "1 lie outside the object: wrist", "--snap", words=words)
        report, said = self.ok(*words, "--snap", "--snapped", self.folder / "right.yaml")
        self.assertGreater(report["snapped_mm"]["wrist"], 20)
        self.assertIn("joints moved", said)
        self.thin("--skeleton", self.folder / "right.yaml")

        by_hand = self.folder / "by_hand.yaml"
        by_hand.write_text("ecorche_attachment: 1\nsplits: [{joint: wrist, within_mm: 9}]\n"
                           "regions: [{segment: lower, from: upper, box: [[20, 0, 0], [30, 20, 20]]},\n"
                           "  {segment: hand, ball: {center: [6, 8, 7.5], radius_mm: 5}}]\n")
        report, _ = self.thin("--tp", "0.3", "--skeleton", self.folder / "arm.yaml", "--reassign", by_hand)
        self.assertGreater(report["attached"]["reassigned"], 0)
        for text, part in (("regions: [{segment: leg, box: [[0, 0, 0], [1, 1, 1]]}]", "leg"),
                           ("regions: [{segment: hand}]", "box and ball"),
                           ("regions: [{segment: hand, box: [[5, 0, 0], [1, 1, 1]]}]", "box: is empty (the lower corner comes first)"),
                           ("regions: [{segment: hand, box: [[5, 0, 0]]}]", "box: has not two corners (write [[x, y, z], [x, y, z]])"),
                           ("splits: [{joint: shoulder, within_mm: 5}]", "'shoulder' is the root's joint (split at a joint between two segments)"),
                           ("splits: [{joint: elbow, within_mm: -5}]", "positive"),
                           ("splits: [{joint: elbo, within_mm: 5}]", "elbow"),
                           ("surprise: 1", "surprise")):
            by_hand.write_text("ecorche_attachment: 1\n" + text + "\n")
            self.refused(78, "by_hand.yaml:2", part,
                         words=["thin", self.bar, "-o", self.folder / "t.vtp", "--skeleton", self.folder / "arm.yaml",
                                "--reassign", by_hand])
        (self.folder / "fit.yaml").write_text((ARM % 8).replace("[50, 8, 7.5]", "{sphere_fit: {bone: a, facing: b}}"))
        self.refused(78, "is found from bones, which a skeleton alone has not", words=["thin", self.bar, "-o", self.folder / "t.vtp", "--skeleton",
                                              self.folder / "fit.yaml"])

    def test_usage(self):
        out = self.folder / "t.vtp"
        for part, words in (("--tp", ["--tp", "2.5"]), ("--tp", ["--tp", "nan"]), ("--metric", ["--metric", "l1"]),
                            ("--boundary", ["--boundary", "18"]), ("--alpha", ["--alpha", "0.5"]),
                            ("--reach", ["--reach", "0"]), ("'5' is not LOW:HIGH (as 300:1500, 300: or :1500)", ["--threshold", "5"]),
                            ("--threshold", ["--threshold", "9:5"]), ("'a:5' is not LOW:HIGH (as 300:1500, 300: or :1500)", ["--threshold", "a:5"]),
                            ("--labels", ["--labels", "3", "--threshold", "5:"]), ("--snap", ["--snap"]),
                            ("--reassign", ["--reassign", "x.yaml"]), ("--snapped: joints are not moved (give --snap as well)", ["--snapped", "x.yaml"]),
                            ("--model", ["--skeleton", "x.yaml", "--model", "x.hdf"])):
            self.refused(64, part, words=["thin", self.bar, "-o", out, *words])
        self.refused(64, "t.vtk' does not end in .vtp (name it so)", words=["thin", self.bar, "-o", self.folder / "t.vtk"])
        real = write_image(self.folder / "real.mha", np.zeros((3, 4, 5), np.float32))
        self.refused(64, "--labels: the voxels are f32, no whole numbers (give a threshold)", words=["thin", real, "-o", out, "--labels", "3"])
        self.refused(64, "is needed for voxels of type f32 (say which values are the object, as LOW:HIGH)", words=["thin", real, "-o", out])
        ct = write_image(self.folder / "ct.mha", np.full((3, 4, 5), -1000, np.int16))
        self.refused(64, "--threshold: is needed for values below 0, as of a CT: 0 is not their background (say which values are the object, as LOW:HIGH, or --labels)",
                     words=["thin", ct, "-o", out])
        self.refused(65, "no voxel is left", words=["thin", self.bar, "-o", out, "--tp", "2"])
        self.refused(66, "none.mha", words=["thin", self.folder / "none.mha", "-o", out])
        self.refused(66, "none.yaml", words=["thin", self.bar, "-o", out, "--skeleton", self.folder / "none.yaml"])
        self.refused(73, "absent", words=["thin", self.bar, "-o", self.folder / "absent" / "t.vtp"])
        broken = self.folder / "broken.vtp"
        broken.write_text("<VTKFile/>")
        self.refused(65, "broken.vtp", words=["thin", broken, "-o", out])
        self.assertFalse(out.exists())

    def test_a_model_with_spheres(self):
        model = self.folder / "m.hdf"
        made, _ = self.ok("preprocess", CASE, "-o", model, "--mesher", "lattice", "--max-tets", "100000", "--spheres", "0.4")
        self.assertIn("spheres", [stage["name"] for stage in made["stages"]])
        info, _ = self.ok("info", model)
        self.assertEqual(info["spheres"][0]["name"], "body")
        self.assertGreater(info["spheres"][0]["voxels"], 100)
        self.assertEqual(info["provenance"]["option/spheres_tp"], "0.4")
        self.assertEqual(self.ok("info", MODEL)[0]["spheres"], [])
        self.refused(64, "--spheres", words=["preprocess", CASE, "-o", model, "--spheres", "3"])
        # The model's own rig, on the case's own scan.
        report, _ = self.thin("--threshold", "-500:", "--isotropic", "0", "--largest", "--model", model,
                              image=CASE / "volumes" / "ct.nrrd")
        self.assertGreater(len(report["segments"]), 10)


if __name__ == "__main__":
    unittest.main()
