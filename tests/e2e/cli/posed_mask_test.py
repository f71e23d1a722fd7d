#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Beside every posed image lies its mask: 1 where a value is of the scan, 0 where it is background by rule."""
import json
import pathlib
import shutil
import tempfile
import unittest

import nibabel
import numpy as np

from posed_files import CASE, MODEL, run


def voxels(path):
    return np.asarray(nibabel.load(path).dataobj)


class Masks(unittest.TestCase):
    def setUp(self):
        self.folder = pathlib.Path(tempfile.mkdtemp())
        self.addCleanup(shutil.rmtree, self.folder)

    def pose(self, name, *words, model=MODEL):
        done = run("--json", "pose", model, "-o", self.folder / name, "--pose", "lib:sitting", *words)
        self.assertEqual(done.returncode, 0, done.stderr)
        self.told = json.loads(done.stdout)["frames"][0]["files"]
        return self.folder / name

    def test_by_itself_whatever_is_asked_for(self):
        posed = self.pose("one", "--volumes", "ct,labels", "--volume-format", "nii.gz")
        self.assertIn(str(posed / "ct-mask.nii.gz"), self.told)
        ct, mask, labels = (nibabel.load(posed / f"{name}.nii.gz") for name in ("ct", "ct-mask", "labels"))
        np.testing.assert_array_equal(mask.affine, ct.affine)
        np.testing.assert_array_equal(voxels(posed / "labels-mask.nii.gz"), mask.dataobj)
        shown = np.asarray(mask.dataobj)
        self.assertEqual(set(np.unique(shown)), {0, 1})
        self.assertEqual(len(np.unique(np.asarray(ct.dataobj)[shown == 0])), 1, "background is one value")
        self.assertEqual(np.count_nonzero(np.asarray(labels.dataobj)[shown == 0]), 0)
        self.assertGreater(np.mean(np.asarray(labels.dataobj)[shown == 1] != 0), 0.9)
        files = {file["file"]: file for file in json.loads((posed / "posed.json").read_text())["files"]}
        self.assertEqual((files["ct-mask.nii.gz"]["is"], files["ct-mask.nii.gz"]["of"]), ("mask", "ct"))

    def test_it_is_where_tets_are(self):
        """As the mask of the displacement field says, which is found by other code, where all was scanned."""
        posed = self.pose("field", "--volumes", "all", "--field", "--volume-format", "nii.gz")
        first = json.loads(run("--json", "info", MODEL).stdout)["volumes"][0]["name"]
        mine, field = voxels(posed / f"{first}-mask.nii.gz"), voxels(posed / "mask.nii.gz")
        self.assertLess(np.count_nonzero(mine != field), 1e-4 * np.count_nonzero(field))

    def test_beyond_what_was_scanned_it_is_background(self):
        """A CT of the legs alone, in a body that is whole: above, tets hold voxels, and nothing was scanned."""
        case = self.folder / "case"
        shutil.copytree(CASE, case)
        whole = self.pose("whole", "--volumes", "ct", "--volume-format", "nii.gz", "--grid", "rest")
        ct = nibabel.load(whole / "ct.nii.gz")
        cut = int(0.4 * ct.shape[2])
        image = nibabel.Nifti1Image(np.asarray(ct.dataobj)[:, :, :cut], ct.affine)
        nibabel.save(image, case / "volumes" / "ct.nii.gz")
        text = (case / "case.yaml").read_text()
        self.assertIn("volumes/ct.nrrd", text)
        (case / "case.yaml").write_text(text.replace("volumes/ct.nrrd", "volumes/ct.nii.gz"))
        model = self.folder / "cut.hdf"
        done = run("preprocess", case, "-o", model, "--mesher", "lattice", "--max-tets", "60000")
        self.assertEqual(done.returncode, 0, done.stderr)
        posed = self.pose("cut", "--volumes", "ct,labels", "--volume-format", "nii.gz", model=model)
        mask, ct, labels = (nibabel.load(posed / f"{name}.nii.gz") for name in ("ct-mask", "ct", "labels-mask"))
        background = np.asarray(ct.dataobj)[np.asarray(mask.dataobj) == 0]
        self.assertEqual(len(np.unique(background)), 1)
        volume = {name: np.count_nonzero(np.asarray(one.dataobj)) * abs(np.linalg.det(one.affine[:3, :3])) for name, one in (("ct", mask), ("labels", labels))}
        self.assertLess(volume["ct"], 0.6 * volume["labels"])
        self.assertGreater(volume["ct"], 0.1 * volume["labels"])

    def test_beside_dicom_and_in_a_case(self):
        posed = self.pose("dicom", "--volumes", "ct", "--volume-format", "dicom")
        self.assertTrue((posed / "ct-mask.nrrd").is_file())
        posed = self.pose("case", "--as-case")
        self.assertTrue((posed / "volumes/ct-mask.nrrd").is_file())
        self.assertTrue((posed / "volumes/labels-mask.nrrd").is_file())

    def test_it_comes_back_as_a_mask(self):
        """And without names it stays, as the field does."""
        posed = self.pose("back", "--volumes", "ct", "--tets")
        done = run("unpose", posed, "-o", self.folder / "scanned")
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertEqual(sorted(path.name for path in (self.folder / "scanned").glob("*.nrrd") if not path.name.startswith("folds")), ["ct.nrrd"])
        done = run("unpose", posed, posed / "ct-mask.nrrd", "-o", self.folder / "mask")
        self.assertEqual(done.returncode, 0, done.stderr)


if __name__ == "__main__":
    unittest.main()
