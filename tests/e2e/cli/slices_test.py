#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""`--resample slices`: posed volumes on the slices of the scan, where they lay: uneven, leaning, or of a sheared NIfTI."""
import json
import pathlib
import shutil
import tempfile
import unittest

import nibabel
import numpy as np
import pydicom
import scipy.ndimage

from posed_files import MODEL, run

REST = "ecorche_pose: 1\nskeleton: {}\n"


def slices(folder):
    """Sorted by their height."""
    return sorted((pydicom.dcmread(path) for path in folder.iterdir()), key=lambda one: one.ImagePositionPatient[2])


def places(read):
    return np.array([one.ImagePositionPatient for one in read], float)


def values(read):
    return np.stack([one.pixel_array * float(one.RescaleSlope) + float(one.RescaleIntercept) for one in read])


class Slices(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = pathlib.Path(tempfile.mkdtemp())
        cls.addClassCleanup(shutil.rmtree, cls.folder)
        for skeleton in ("phantom", "human"):
            (cls.folder / f"{skeleton}.yaml").write_text(REST.format(skeleton))
        done = cls.pose("even", "--volume-format", "dicom", "--grid", "rest")
        assert done.returncode == 0, done.stderr
        cls.even = slices(cls.folder / "even/ct.dicom")
        done = cls.pose("voxels", "--volume-format", "nii.gz", "--grid", "rest")
        assert done.returncode == 0, done.stderr
        # What lies well within: elsewhere the even voxels beside it are background, and the scan's own are not.
        mask = np.asarray(nibabel.load(cls.folder / "voxels/ct-mask.nii.gz").dataobj).T
        cls.inner = scipy.ndimage.binary_erosion(mask == 1, iterations=2).astype(float)

    @classmethod
    def pose(cls, name, *words, start=(MODEL,)):
        words = ("--volumes", "ct,labels", *words) if "--volumes" not in words else words
        return run("--json", "pose", *start, "-o", cls.folder / name, "--pose", cls.folder / ("phantom.yaml" if start == (MODEL,) else "human.yaml"), *words)

    def scan(self, name, heights, lean=0.0):
        """A series whose slices lie at these heights, mm above the lowest; each shifted along its columns by `lean` of that."""
        folder = self.folder / name
        folder.mkdir()
        first = places(self.even)[0]
        for number, height in enumerate(heights):
            one = pydicom.dcmread(self.folder / "even/ct.dicom/IM0001.dcm")
            one.SOPInstanceUID = f"1.2.3.4.{number}"
            one.InstanceNumber = number
            one.ImagePositionPatient = [f"{x:.6f}" for x in first + np.array([0, lean * height, height])]
            one.save_as(folder / f"{number}.dcm")
        return folder

    def check(self, name, scan):
        """The slices are those of the scan, and at rest their values are those of the even voxels, linearly between."""
        read, wanted = slices(self.folder / name / "ct.dicom"), slices(scan)
        np.testing.assert_allclose(places(read), places(wanted), atol=1e-4)
        self.assertEqual((read[0].Rows, read[0].Columns), (wanted[0].Rows, wanted[0].Columns))
        np.testing.assert_allclose(read[0].PixelSpacing, wanted[0].PixelSpacing)
        even, got = values(self.even), values(read)
        origin, step = places(self.even)[0], places(self.even)[1][2] - places(self.even)[0][2]
        spacing = float(self.even[0].PixelSpacing[0])
        j, i = np.mgrid[:got.shape[1], :got.shape[2]]
        mask = pydicom.dcmread(self.folder / name / "ct-mask.dcm")
        shown = {tuple(np.round(np.array(frame.PlanePositionSequence[0].ImagePositionPatient, float), 3)): bits
                 for frame, bits in zip(mask.PerFrameFunctionalGroupsSequence, mask.pixel_array)}
        self.assertEqual(mask.SegmentSequence[0].SegmentLabel, "scanned")
        compared = 0
        for place, picture in zip(places(read), got):
            bits = shown.get(tuple(np.round(place, 3)))
            self.assertEqual(len(np.unique(picture if bits is None else picture[bits == 0])), 1, "background is one value")
            if bits is None:
                continue
            at = [np.full(i.shape, (place[2] - origin[2]) / step), j + (place[1] - origin[1]) / spacing, i + (place[0] - origin[0]) / spacing]
            truth = scipy.ndimage.map_coordinates(even, at, order=1, mode="nearest")
            inner = (bits == 1) & (scipy.ndimage.map_coordinates(self.inner, at, order=1) > 0.999)
            compared += np.count_nonzero(inner)
            np.testing.assert_allclose(picture[inner], truth[inner], atol=2)
        self.assertGreater(compared, 1000)

    def test_uneven_slices(self):
        top = places(self.even)[-1][2] - places(self.even)[0][2]
        heights = np.cumsum(np.tile([9.0, 9, 9, 12, 15], 99))
        scan = self.scan("uneven", heights[heights < top])
        done = self.pose("on_uneven", "--resample", "slices", "--volume-format", "dicom", "--dicom-source", scan)
        self.assertEqual(done.returncode, 0, done.stderr)
        self.check("on_uneven", scan)
        seg = pydicom.dcmread(self.folder / "on_uneven/labels.dcm")
        planes = {float(frame.PlanePositionSequence[0].ImagePositionPatient[2]) for frame in seg.PerFrameFunctionalGroupsSequence}
        self.assertLessEqual({round(z, 3) for z in planes}, {round(z, 3) for z in places(slices(scan))[:, 2]})
        self.assertNotIn("SpacingBetweenSlices", seg.SharedFunctionalGroupsSequence[0].PixelMeasuresSequence[0])
        told = {file["file"]: file["is"] for file in json.loads((self.folder / "on_uneven/posed.json").read_text())["files"]}
        self.assertEqual((told["ct-mask.dcm"], told["labels-mask.dcm"], told["labels.dcm"]), ("mask", "mask", "labels"))

    def test_a_tilted_gantry(self):
        top = places(self.even)[-1][2] - places(self.even)[0][2]
        scan = self.scan("tilted", np.arange(0, top, 10.0), lean=0.1)
        done = self.pose("on_tilted", "--resample", "slices", "--volume-format", "dicom", "--dicom-source", scan)
        self.assertEqual(done.returncode, 0, done.stderr)
        self.check("on_tilted", scan)

    def test_even_slices_in_any_format(self):
        """Thicker than the model's voxels: what `new` made of a scan, or a model of finer voxels, is brought back onto them."""
        scan = self.scan("thick", np.arange(0, 900, 18.0))
        done = self.pose("on_thick", "--resample", "slices", "--volume-format", "nii.gz", "--dicom-source", scan)
        self.assertEqual(done.returncode, 0, done.stderr)
        for name in ("ct", "ct-mask", "labels"):
            image = nibabel.load(self.folder / f"on_thick/{name}.nii.gz")
            self.assertEqual((image.shape[2], round(float(image.header["pixdim"][3]), 3)), (50, 18))

    def test_a_scan_that_leans(self):
        """A sheared NIfTI, posed at once: its own slices come back, which the model's right-angled voxels are not."""
        made = self.folder / "phantom"
        self.assertEqual(run("phantom", "-o", made, "--size", "small", "--scan", "totalsegmentator_ml").returncode, 0)
        for path in made.glob("*.nii.gz"):
            image = nibabel.load(path)
            affine = image.affine.copy()
            affine[:, 2] += 0.15 * affine[:, 0]
            sheared = nibabel.Nifti1Image(np.asarray(image.dataobj), affine)
            sheared.header.extensions = image.header.extensions
            nibabel.save(sheared, path)
        done = self.pose("on_sheared", "--max-tets", "20000", "--volumes", "ct", "--resample", "slices", "--volume-format", "dicom",
                         start=("--scan", *sorted(made.glob("*.nii.gz"))))
        self.assertEqual(done.returncode, 0, done.stderr)
        affine = np.diag([-1, -1, 1, 1]) @ affine
        read = slices(self.folder / "on_sheared/ct.dicom")
        np.testing.assert_allclose(places(read), [affine[:3, 3] + k * affine[:3, 2] for k in range(image.shape[2])], atol=2e-3)
        self.assertEqual((read[0].Columns, read[0].Rows), image.shape[:2])

    def refused(self, message, *words, start=(MODEL,), code=64):
        done = self.pose("refused", *words, start=start)
        self.assertEqual(done.returncode, code, done.stderr)
        self.assertIn(message, done.stderr)
        self.assertFalse((self.folder / "refused").exists())

    def test_refusals(self):
        scan = self.scan("for_refusals", np.cumsum([9.0, 9, 9, 9, 13, 9, 9]))
        self.refused("--resample: a model does not know the slices of its scan (name the scan: --dicom-source DIR)", "--resample", "slices")
        self.refused("--resample: the scan's slices are at uneven distances, or lean, which only DICOM can say (add --volume-format dicom)",
                     "--resample", "slices", "--dicom-source", scan)
        self.refused("--dicom-source: no DICOM is written (add --volume-format dicom)", "--dicom-source", scan)
        self.refused("no DICOM is written", "--resample", "slices", "--dicom-source", scan, "--keep-identity")
        self.refused("--resample: no volume is written (name some by --volumes)", "--volumes", "none", "--resample", "slices", "--volume-format", "dicom",
                     "--dicom-source", scan)
        self.refused("--resample: spheres fill the voxels of their own lattice", "--resample", "slices", "--deformer", "spheres", "--dicom-source", scan)
        self.refused("--resample: the images of a case have even voxels", "--volumes", "all", "--resample", "slices", "--as-case", "--dicom-source", scan)
        slanted = nibabel.Nifti1Image(np.zeros((4, 4, 4), "i2"), [[5, 1, 0, 0], [0, 5, 0, 0], [0, 0, 5, 0], [0, 0, 0, 1]])
        nibabel.save(slanted, self.folder / "slanted.nii.gz")
        self.refused("slanted.nii.gz: its rows and columns are not at right angles, which no slice can be (leave out --resample slices)",
                     "--resample", "slices", start=("--scan", self.folder / "slanted.nii.gz"), code=65)
        shutil.rmtree(scan)
        scan.mkdir()
        shutil.copy(self.folder / "even/labels.dcm", scan)
        self.refused("holds no slices of an image (name the folder of the series that was scanned)", "--resample", "slices", "--dicom-source", scan, code=65)


if __name__ == "__main__":
    unittest.main()
