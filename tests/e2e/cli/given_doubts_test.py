#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Scans in which something is wrong, or only looks so: `ecorche new` says what is true of each, where, and how to mend it."""
import pathlib
import re
import shutil
import tempfile
import unittest

import nibabel
import numpy as np
import yaml

from given_scans_test import read_labels, write_labels
from posed_files import run

VOXEL = 8  # mm
PLACE = r"\[-?[\d.e+]+, -?[\d.e+]+, -?[\d.e+]+\]"
SPAN = f"from {PLACE} to {PLACE} mm"


class GivenDoubts(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = pathlib.Path(tempfile.mkdtemp())
        cls.addClassCleanup(shutil.rmtree, cls.folder)
        cls.scan = cls.folder / "scan"
        result = run("phantom", "-o", cls.scan, "--size", "small", "--scan", "totalsegmentator_ml", "--voxel", str(VOXEL))
        assert result.returncode == 0, result.stderr
        cls.affine = nibabel.load(cls.scan / "ct.nii.gz").affine
        cls.total, cls.names = read_labels(cls.scan / "total.nii.gz")
        cls.body = read_labels(cls.scan / "body.nii.gz")

    def setUp(self):
        self.place = self.folder / self.id().rsplit(".", 1)[-1]
        self.place.mkdir()
        self.count = 0

    def write(self, name, values, names, affine=None):
        write_labels(self.place / f"{name}.nii.gz", values, names, self.affine if affine is None else affine)
        return self.place / f"{name}.nii.gz"

    def new(self, *words):
        self.count += 1
        self.case = self.place / f"case_{self.count}"
        result = run("new", *words, "-o", self.case)
        self.assertEqual(result.returncode, 0, result.stderr)
        return result.stdout + result.stderr

    def refused(self, *words):
        result = run("new", *words, "-o", self.place / "refused")
        self.assertEqual(result.returncode, 65, result.stdout + result.stderr)
        self.assertFalse((self.place / "refused").exists())
        return result.stderr

    def confidence(self, bone):
        line = next(line for line in (self.case / "case.yaml").read_text().splitlines() if f"name: {bone}," in line)
        return float(re.search(r"# ([\d.]+):", line)[1])

    def warnings(self, told):
        return [line for line in told.splitlines() if line.startswith("warning: ")]

    # -- what does not lie where the bones are --

    def test_a_ct_and_a_body_of_another_scan(self):
        """Both were given, so that giving them is no advice: where each lies, and what of the bones it holds."""
        moved = self.affine.copy()
        moved[0, 3] += 3000
        total = self.write("total", self.total, self.names)
        ct = self.place / "ct.nii.gz"
        nibabel.save(nibabel.Nifti1Image(np.asarray(nibabel.load(self.scan / "ct.nii.gz").dataobj), moved), ct)
        body = self.write("body", *self.body, moved)
        told = self.refused(total, ct, body)
        self.assertRegex(told, f"the bones lie {SPAN}, but the body of body.nii.gz lies {SPAN}, which holds 0 % of them, and what is denser than -300 HU in "
                               f"ct.nii.gz lies {SPAN}, which holds 0 % of them .see that all files are of one scan")
        self.assertNotIn("give the CT too", told)
        self.assertIn("give the CT too", self.refused(total))

    def test_bones_under_one_name(self):
        """The CT alone tells which they are: that is the advice, and it works."""
        bone = np.isin(self.total, [label for name, label in self.names.items() if re.match("femur|hip|sacrum|vertebra|rib|skull|humerus|scapula", name)])
        told = self.refused(self.write("bone", bone.astype("u1"), {"bone": 1}), self.scan / "ct.nii.gz")
        self.assertIn("no label of a bone is known: 'bone' may be any (see the names that are known in docs/reference/structures.md, give ct.nii.gz without this file", told)
        self.new(self.scan / "ct.nii.gz")

    # -- two bodies --

    def with_another(self, values, step, gap=10):
        """The same body again beside the first one, of it every `step`th voxel."""
        second = values[::step, ::step, ::step]
        out = np.zeros((values.shape[0] + gap + second.shape[0], *values.shape[1:]), values.dtype)
        out[:values.shape[0]] = values
        out[values.shape[0] + gap:, :second.shape[1], :second.shape[2]] = second
        return np.pad(out, 1)

    def of_two(self, step):
        total = self.write("total", self.with_another(self.total, step), self.names)
        return self.new(total, self.write("body", self.with_another(self.body[0], step), self.body[1]))

    def test_two_bodies(self):
        for step in (1, 2):
            told = self.of_two(step)
            self.assertRegex(told, f"warning: there seem to be two bodies: .* and \\d+ more bones are there twice, the bones of one {SPAN}, of the other {SPAN}: they "
                                   "would become one: cut all files to one of them")
            low, high = (np.array(yaml.safe_load(text)) for text in re.findall(PLACE, re.search(f"of the other ({SPAN})", told)[1]))
            first = np.array(yaml.safe_load(re.findall(PLACE, re.search(f"bones of one ({SPAN})", told)[1])[1]))
            self.assertTrue((low < high).all())
            self.assertTrue(abs(low[0] - first[0]) > 5 * VOXEL, told)
            for bone in ("skull", "sacrum", "femur_left"):
                self.assertLessEqual(self.confidence(bone), 0.5, bone)

    def changed(self, change):
        total = self.total.copy()
        names = change(total) or self.names
        return self.new(self.write("total", total, names), self.scan / "body.nii.gz")

    def gap(self, total, bone, mm):
        """The bone's middle taken out."""
        where = np.argwhere(total == self.names[bone])
        middle = where[:, 2].mean()
        out = where[abs(where[:, 2] - middle) * VOXEL < mm / 2]
        total[tuple(out.T)] = 0

    def test_bones_in_pieces_are_no_second_body(self):
        def broken(total):
            self.gap(total, "femur_left", 24)
            self.gap(total, "humerus_right", 24)

        def nailed(total):
            self.gap(total, "femur_left", 100)
            self.gap(total, "femur_right", 100)

        def specks(total):
            for name in ("skull", "sacrum", "femur_left", "hip_left", "sternum", "scapula_left"):
                total[2:4, 2:4, 2 * self.names[name] % (total.shape[2] - 4)] = self.names[name]

        def both_sides(total):
            names = dict(self.names)
            for bone in ("femur", "hip", "humerus", "scapula"):
                total[total == names.pop(f"{bone}_right")] = names[f"{bone}_left"]
                names[bone] = names.pop(f"{bone}_left")
            return names

        for change in (lambda total: None, broken, nailed, specks, both_sides):
            told = self.changed(change)
            self.assertNotIn("two bodies", told)
            self.assertNotIn("in two large pieces", told)
            self.assertGreater(self.confidence("femur_left"), 0.5)

    def test_a_left_bone_called_a_right_one(self):
        """Two of one side and none of the other: no second body, but told, and not believed."""
        def change(total):
            for bone in ("femur", "humerus"):
                total[total == self.names[f"{bone}_right"]] = self.names[f"{bone}_left"]
        told = self.changed(change)
        self.assertRegex(told, f"warning: femur_left is in two large pieces, at {PLACE} and {PLACE}, \\d+ mm apart: one of them may be another bone; see picture.png")
        self.assertNotIn("two bodies", told)
        self.assertLessEqual(self.confidence("femur_left"), 0.5)

    # -- turned bodies, and mirrored ones --

    def of_sides(self, matrix, exchanged, without=()):
        swap = {"left": "right", "right": "left"}
        names = {"_".join(swap.get(word, word) if exchanged else word for word in name.split("_")): label for name, label in self.names.items()}
        total = np.where(np.isin(self.total, [self.names[name] for name in without]), 0, self.total).astype("u1")
        affine = np.diag([*matrix, 1.0]) @ self.affine
        return self.new(self.write("total", total, names, affine), self.write("body", *self.body, affine))

    def test_a_turned_body_is_no_exchange_of_names(self):
        """On its belly: left lies where right is in the image, and front where back is."""
        told = self.of_sides((-1, -1, 1), False)
        self.assertEqual(self.warnings(told), [])
        self.assertIn("front and back agree with the names: the body lies turned in the image, such as on its belly, and nothing is wrong", told)
        self.assertNotIn("turned in the image", self.of_sides((1, 1, 1), False))

    def test_names_exchanged_or_axes_mirrored(self):
        organs = ("liver", "spleen", "stomach")
        for matrix in ((1, 1, 1), (-1, -1, 1)):
            told = self.of_sides(matrix, True)
            self.assertIn("left and right are exchanged in the labels' names, as the organs tell, too: exchange them in the table of names", told)
            told = self.of_sides(matrix, True, organs)
            self.assertIn("left and right are exchanged in the labels' names, or the image's axes are mirrored: see which", told)
        for matrix in ((-1, 1, 1), (1, -1, 1)):
            told = self.of_sides(matrix, False)
            self.assertIn("organs lie on the sides that the names say: the image's axes show the body as in a mirror", told)
            self.assertNotIn("exchanged", "".join(self.warnings(told)))

    def test_nothing_tells_the_front(self):
        told = self.of_sides((-1, -1, 1), False, [name for name in self.names if not name.startswith("femur_")])
        self.assertIn("left and right are exchanged in the labels' names, or the image's axes are mirrored, or the body lies turned, such as on its belly: nothing here "
                      "tells its front", told)


if __name__ == "__main__":
    unittest.main(verbosity=2)
