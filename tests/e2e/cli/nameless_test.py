#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Label maps that give numbers and no names, in any order: bones known by shape and place, against the names that were taken off them."""
import gzip
import json
import pathlib
import shutil
import tempfile
import unittest

import nibabel
import numpy as np
import yaml

from posed_files import run

TASKS = ("total", "appendicular_bones", "craniofacial_structures", "body")


def read_labels(path):
    """Numbers as i, j, k, and the affine to RAS."""
    head, body = path.read_bytes().split(b"\n\n", 1)
    field = dict(line.split(": ", 1) for line in head.decode().splitlines() if ": " in line and line[0] != "#")
    kind = {"unsigned char": "u1", "unsigned short": "<u2", "uint8": "u1", "int": "<i4"}[field["type"]]
    voxels = np.frombuffer(gzip.decompress(body), kind).reshape([int(n) for n in field["sizes"].split()][::-1]).transpose(2, 1, 0)
    affine = np.eye(4)
    affine[:3, :3] = np.array([[float(x) for x in row.strip("()").split(",")] for row in field["space directions"].split()]).T
    affine[:3, 3] = [float(x) for x in field["space origin"].strip("()").split(",")]
    return voxels, np.diag([-1, -1, 1, 1]) @ affine


class Case:
    def __init__(self, folder):
        self.voxels, self.affine = read_labels(folder / "labels.nrrd")
        text = yaml.safe_load((folder / "case.yaml").read_text())
        number = {name: key for key, name in text["labels"]["table"].items()}
        self.body = number.get("body")
        self.segment = {number[label]: bone["segment"] for bone in text["bones"] for label in bone["labels"]}
        self.bone = {number[label]: bone["name"] for bone in text["bones"] for label in bone["labels"]}

    def segments(self):
        """The name of each voxel's segment, where it is bone."""
        names = np.full(int(self.voxels.max()) + 1, "", "U24")
        for number, segment in self.segment.items():
            names[number] = segment
        return names[self.voxels]


class Nameless(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = pathlib.Path(tempfile.mkdtemp())
        cls.addClassCleanup(shutil.rmtree, cls.folder)
        cls.ok("phantom", "-o", cls.folder / "scan", "--size", "small", "--seed", "7", "--scan", "totalsegmentator")
        cls.ok("new", *(cls.folder / "scan" / task for task in TASKS), "-o", cls.folder / "truth")
        cls.truth = Case(cls.folder / "truth")
        cls.random = np.random.default_rng(7)

    @classmethod
    def ok(cls, *words):
        result = run("--json", *words)
        assert result.returncode == 0, result.stderr
        return json.loads(result.stdout)

    def numbered(self, name, voxels, affine=None):
        """Written with other numbers, in any order, and without names; the file."""
        order = np.concatenate([[0], 1 + self.random.permutation(int(voxels.max()))]).astype("u1")
        path = self.folder / f"{name}.nii.gz"
        nibabel.save(nibabel.Nifti1Image(order[voxels], self.truth.affine if affine is None else affine), path)
        return path

    def known(self, name, voxels, *words, truth=None, affine=None):
        """What `new` says, and the shares of the bone's voxels that it gives their segment, and that it calls bone at all."""
        made = self.ok("new", self.numbered(name, voxels, affine), "-o", self.folder / f"{name}_case", *words)
        found, theirs = Case(self.folder / f"{name}_case").segments(), self.truth.segments() if truth is None else truth
        bone = theirs != ""
        print(f"{name}: {(found == theirs)[bone].mean():.3f} of the bone right, {((found != '') & ~bone).sum() / bone.sum():.3f} of its volume too much; doubts {len(made['doubts'])}")
        for segment in np.unique(theirs[bone]):
            here = theirs == segment
            share = (found == theirs)[here].mean()
            if share < 0.9:
                print("   ", segment, round(share, 2), dict(zip(*np.unique(found[here], return_counts=True))))
        return made, (found == theirs)[bone].mean(), ((found != "") & ~bone).sum() / bone.sum()

    def only_bones(self, voxels):
        keep = np.zeros(int(voxels.max()) + 1, bool)
        keep[list(self.truth.segment)] = True
        keep[self.truth.body] = True
        return np.where(keep[voxels], voxels, self.truth.body * (voxels > 0)).astype("u1")

    def test_bones_in_a_body(self):
        made, right, more = self.known("bones", self.only_bones(self.truth.voxels))
        self.assertGreater(right, 0.97)
        self.assertLess(more, 0.01)
        self.assertTrue(any("has no names: " in note and "labels are bones by shape and place" in note for note in made["notes"]), made["notes"])
        self.assertIn("round the label of the body and all that is labelled within it", made["skin"]["how"])
        for bone in made["bones"]:
            self.assertLessEqual(bone["confidence"], 0.9)
        self.assertIn("by shape and place, ", (self.folder / "bones_case" / "case.yaml").read_text())

    def test_organs_and_muscles_among_them(self):
        made, right, more = self.known("mixed", self.truth.voxels)
        self.assertGreater(right, 0.9)
        self.assertLess(more, 0.1)
        joints = {row["joint"]: row["center_mm"] for row in self.ok("rig", self.folder / "mixed_case")["rig"]}
        theirs = {row["joint"]: row["center_mm"] for row in self.ok("rig", self.folder / "truth")["rig"]}
        for joint in ("hip_left", "hip_right", "knee_left", "knee_right"):
            self.assertLess(np.linalg.norm(np.subtract(joints[joint], theirs[joint])), 2, joint)

    def test_a_mirrored_body_has_its_sides_exchanged(self):
        voxels = self.truth.voxels[::-1]
        swap = {name: name.replace("_left", "_?").replace("_right", "_left").replace("_?", "_right") for name in set(self.truth.segment.values())}
        truth = self.truth.segments()[::-1]
        truth = np.vectorize(lambda name: swap.get(name, ""), otypes=["U24"])(truth)
        _, right, more = self.known("mirrored", self.only_bones(voxels), truth=truth)
        self.assertGreater(right, 0.97)
        self.assertLess(more, 0.01)

    def test_a_part_of_a_body(self):
        for name, low, high in (("trunk", 0.5, 0.85), ("hips", 0.3, 0.62), ("head", 0.8, 1)):
            n = self.truth.voxels.shape[2]
            first, last = int(low * n), int(high * n)
            affine = self.truth.affine.copy()
            affine[:3, 3] += affine[:3, 2] * first
            _, right, more = self.known(name, self.only_bones(self.truth.voxels)[:, :, first:last], truth=self.truth.segments()[:, :, first:last], affine=affine)
            self.assertGreater(right, 0.9, name)
            self.assertLess(more, 0.02, name)

    def test_all_bones_as_one_label(self):
        """Cut by the template."""
        voxels = np.where(np.isin(self.truth.voxels, list(self.truth.segment)), 1, 2 * (self.truth.voxels > 0)).astype("u1")
        made, right, more = self.known("one", voxels)
        self.assertGreater(right, 0.9)
        self.assertTrue(any("covers bones of several segments: they are parted by a template" in doubt for doubt in made["doubts"]), made["doubts"])

    def test_what_is_far_too_short_for_its_bone(self):
        """A piece as long as a vertebra is high, where the humerus would be, is none; it is told."""
        voxels = self.only_bones(self.truth.voxels)
        number = next(label for label, name in self.truth.bone.items() if name == "humerus_left")
        at = np.argwhere(voxels == number)
        far = at[abs(at[:, 2] - at[:, 2].mean()) * np.linalg.norm(self.truth.affine[:3, 2]) > 30]
        voxels[tuple(far.T)] = self.truth.body
        made, _, _ = self.known("short", voxels)
        names = [bone["name"] for bone in made["bones"]]
        self.assertNotIn("humerus_left", names)
        self.assertIn("humerus_right", names)
        self.assertTrue(any("may be a bone (humerus_left, " in doubt and "but it is far shorter than that): it is taken for a tissue" in doubt for doubt in made["doubts"]), made["doubts"])

    def test_what_looks_like_bone_is_asked_about(self):
        """A large label with a shell and marrow in the CT that no bone of the template lies at; of flesh nothing is asked."""
        voxels = self.only_bones(self.truth.voxels)
        image = nibabel.load(self.folder / "scan" / "ct.nii.gz")
        self.assertTrue(np.allclose(image.affine, self.truth.affine))
        ct = np.asarray(image.dataobj).astype("i2").copy()
        i, j = 4, 4  # in the air beside the head, far from all bones
        low, high = (int(share * voxels.shape[2]) for share in (0.8, 0.97))
        flesh = voxels.max() + 2
        for label, shift in ((flesh - 1, 0), (flesh, 5)):
            rod = (slice(i - 2, i + 3), slice(j - 2 + shift, j + 3 + shift), slice(low, high))
            self.assertFalse(voxels[rod].any())
            voxels[rod] = label
            ct[rod] = 40 if label == flesh else 900
            if label != flesh:
                ct[i - 1:i + 2, j - 1 + shift:j + 2 + shift, low:high] = 300
        nibabel.save(nibabel.Nifti1Image(ct, image.affine), self.folder / "asked_ct.nii.gz")
        made, _, _ = self.known("asked", voxels, self.folder / "asked_ct.nii.gz")
        said = [doubt for doubt in made["doubts"] if "like bone in asked_ct.nii.gz" in doubt]
        self.assertEqual(len(said), 1, made["doubts"])
        self.assertRegex(said[0], r"asked.nii.gz: label \d+ at \[.*\] looks like bone in asked_ct.nii.gz, but by shape and place it is none and is taken for tissues: name what is bone")

    def test_what_is_no_body_is_refused(self):
        voxels = np.zeros((60, 60, 60), "u1")
        at, random = np.stack(np.meshgrid(*map(np.arange, voxels.shape), indexing="ij"), -1), np.random.default_rng(0)
        for number in range(1, 9):
            voxels[np.linalg.norm(at - random.uniform(10, 50, 3), axis=-1) < 6] = number
        # Of six such heaps one looks like bones to the template, and is refused for its skin.
        result = run("new", self.numbered("balls", voxels, np.diag([-5, -5, 5, 1.0])), "-o", self.folder / "refused")
        self.assertEqual(result.returncode, 65, result.stderr)
        self.assertIn("does not say what its labels mean, and by shape and place they are no bones that are known (give a table", result.stderr)
        self.assertFalse((self.folder / "refused").exists())


if __name__ == "__main__":
    unittest.main()
