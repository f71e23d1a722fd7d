#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""NIfTI against nibabel, both ways: frames, types, scales, components, byte orders."""
import subprocess
import unittest

import nibabel
import numpy

from described import IO_FILES, TYPES, Described

LPS = numpy.diag([-1.0, -1, 1, 1])
# Oblique, with a reversed axis: what a scanner writes.
TURN = numpy.array([[0, -2.0, 0.0, 5], [1.5, 0, 0, 6], [0, 0, -3, 7], [0, 0, 0, 1]])


def oblique():
    c, s = numpy.cos(0.3), numpy.sin(0.3)
    return numpy.array([[c, 0, -s, 12], [0, 1, 0, -7], [s, 0, c, 30], [0, 0, 0, 1]]) @ TURN


class Nifti(Described):
    def assert_ras_frame(self, grid, affine):
        self.assert_frame(grid, LPS @ affine)

    def save(self, array, affine, name, change=None, version=nibabel.Nifti1Image):
        image = version(array, affine)
        image.set_qform(affine, 1)
        image.set_sform(affine, 1)
        if change:
            change(image)
        nibabel.save(image, self.folder / name)
        return self.folder / name

    def test_every_type_and_frame_is_read_as_nibabel_reads_it(self):
        for affine in (numpy.eye(4), TURN, oblique(), numpy.diag([-1.0, 1, 1, 1])):
            for name, code in TYPES.items():
                array = self.random.integers(0, 100, (4, 5, 3)).astype(code)
                for file in ("a.nii", "a.nii.gz"):  # side by side, niftilib mixes them up
                    array = self.random.integers(0, 100, (4, 5, 3)).astype(code)
                    grid, voxels = self.describe(self.save(array, affine, file))
                    self.assertEqual(grid["type"], name)
                    self.assert_ras_frame(grid, affine)
                    numpy.testing.assert_array_equal(voxels[0], array)

    def test_nifti_2(self):
        for change in (None, lambda i: i.set_sform(None, code=0), lambda i: i.set_qform(None, code=0),
                       lambda i: i.header.set_slope_inter(0.5, -3)):
            for name in ("two.nii", "two.nii.gz"):
                for affine in (TURN, oblique(), TURN @ numpy.diag([-1.0, 1, 1, 1])):
                    array = self.random.integers(0, 100, (4, 5, 3)).astype("i2")
                    path = self.save(array, affine, name, change, nibabel.Nifti2Image)
                    grid, voxels = self.describe(path)
                    self.assert_ras_frame(grid, affine)
                    numpy.testing.assert_allclose(voxels[0], nibabel.load(path).get_fdata(), atol=1e-4)

    def test_where_both_forms_stand_they_agree_or_one_is_chosen(self):
        array = self.random.integers(0, 100, (4, 5, 3)).astype("i2")
        aside = oblique()
        aside[:3, 3] += [0, 100, 0]
        for version in (nibabel.Nifti1Image, nibabel.Nifti2Image):
            path = self.save(array, oblique(), "a.nii", lambda image: image.set_sform(aside, code=2), version)
            self.refused(path, "its qform and its sform lie 100 mm apart (write the image with one of them, or say in the case "
                               "which counts: form: qform, or form: sform)")
            self.assert_ras_frame(self.describe(path, "qform")[0], oblique())
            self.assert_ras_frame(self.describe(path, "sform")[0], aside)
            near = oblique()
            near[:3, 3] += 1e-3
            path = self.save(array, oblique(), "a.nii", lambda image: image.set_sform(near, code=2), version)
            self.assert_ras_frame(self.describe(path)[0], oblique())
            path = self.save(array, oblique(), "a.nii", lambda image: image.set_sform(None, code=0), version)
            self.refused(path, "has no sform: its code is 0 (leave out form: sform)", form=("sform",))
        for name, fields in (("pixdim", ("pixdim",)), ("qform", ("quatern_b", "qoffset_y")), ("sform", ("srow_x", "srow_z"))):
            for field in fields:
                for value in (numpy.nan, -numpy.inf):
                    path = self.save(array, oblique(), "nan.nii", lambda image: (image.set_qform(oblique(), 1), image.set_sform(oblique(), 1)))
                    offset = {"pixdim": 84, "quatern_b": 256, "qoffset_y": 272, "srow_x": 284, "srow_z": 320}[field]
                    spoilt = bytearray(path.read_bytes())
                    spoilt[offset : offset + 4] = numpy.float32(value).tobytes()
                    path.write_bytes(spoilt)
                    for form in ((), ("qform",), ("sform",)):
                        self.refused(path, f"its {name} has a NaN or an infinite number (write its header anew)", form=form)
        self.refused(self.save(array, numpy.diag([2e6, 1, 1, 1]), "far.nii"), "its spacing is 2000000.000000 (it must be positive, mm)")
        self.save(array, TURN, "a.nii").rename(self.folder / "b.nii")
        (self.folder / "c.nii").write_bytes(self.save(array, TURN, "c.nii.gz").read_bytes())
        self.refused(self.folder / "c.nii", "is packed by gzip (name it .nii.gz)")
        packed = bytearray((self.folder / "c.nii.gz").read_bytes())
        packed[12:40] = bytes(28)
        (self.folder / "d.nii.gz").write_bytes(packed)
        self.refused(self.folder / "d.nii.gz", "its gzip stream is damaged")

    def test_qform_or_sform_alone(self):
        for which in ("qform", "sform"):
            def only(image):
                image.set_qform(oblique() if which == "qform" else None, code=1 if which == "qform" else 0)
                image.set_sform(oblique() if which == "sform" else None, code=2 if which == "sform" else 0)
            grid, _ = self.describe(self.save(numpy.zeros((4, 5, 3), "i2"), oblique(), "a.nii", only))
            self.assert_ras_frame(grid, oblique())
        self.refused(self.save(numpy.zeros((4, 5, 3), "i2"), TURN, "b.nii",
                               lambda image: (image.set_qform(None, code=0), image.set_sform(None, code=0))),
                     "does not say where it lies: qform_code and sform_code are 0")

    def test_scales_big_endian_and_rgb(self):
        array = self.random.integers(-500, 500, (4, 5, 3)).astype("i2")
        path = self.save(array, TURN, "scaled.nii", lambda image: image.header.set_slope_inter(0.5, -3))
        loaded = nibabel.load(path).get_fdata()
        grid, voxels = self.describe(path)
        self.assertIn(grid["type"], ("f32", "f64"))
        numpy.testing.assert_allclose(voxels[0], loaded, atol=1e-4)
        header = nibabel.Nifti1Header(endianness=">")
        header.set_data_dtype("i2")
        nibabel.save(nibabel.Nifti1Image(array, TURN, header), self.folder / "big.nii")
        numpy.testing.assert_array_equal(self.describe(self.folder / "big.nii")[1][0], array)
        rgb = numpy.zeros((4, 5, 3), [("R", "u1"), ("G", "u1"), ("B", "u1")])
        for channel in rgb.dtype.names:
            rgb[channel] = self.random.integers(0, 255, rgb.shape)
        grid, voxels = self.describe(self.save(rgb, TURN, "rgb.nii"))
        self.assertEqual((grid["type"], grid["components"]), ("u8", 3))
        for i, channel in enumerate(rgb.dtype.names):
            numpy.testing.assert_array_equal(voxels[i], rgb[channel])

    def test_vectors_are_the_fifth_axis(self):
        array = self.random.random((4, 5, 3, 1, 3)).astype("f4")
        path = self.save(array, TURN, "vector.nii.gz", lambda image: image.header.set_intent("vector"))
        grid, voxels = self.describe(path)
        self.assertEqual(grid["components"], 3)
        for i in range(3):
            numpy.testing.assert_array_equal(voxels[i], array[..., 0, i])
        self.refused(self.save(numpy.zeros((4, 5, 3, 1, 1, 2), "i2"), TURN, "six.nii"), "has 2 volumes on axis 6 (save one 3-D image;")

    def test_one_volume_of_several_in_time(self):
        """Voxels, scale, frame and type are nibabel's of that volume alone."""
        array = self.random.integers(-90, 100, (4, 5, 3, 6)).astype("i2")
        for change in (None, lambda i: i.header.set_slope_inter(0.5, -3)):
            for version in (nibabel.Nifti1Image, nibabel.Nifti2Image):
                for name in ("time.nii", "time.nii.gz"):
                    path = self.save(array, oblique(), name, change, version)
                    for phase in (1, 4, 6):
                        grid, voxels = self.describe(path, f"phase={phase}")
                        self.assert_ras_frame(grid, oblique())
                        self.assertEqual((grid["size"], grid["components"]), ([4, 5, 3], 1))
                        numpy.testing.assert_allclose(voxels[0], nibabel.load(path).dataobj[..., phase - 1], atol=1e-4)
                    self.refused(path, "holds 6 volumes, one after the other in time (take one by --phase, in a case by phase:, from 1 to 6)")
                    self.refused(path, "has no phase 7 (it has 6)", form=("phase=7",))
        single = self.save(array[..., 0], oblique(), "one.nii")
        self.assertEqual(self.describe(single, "phase=1")[1].shape, (1, 4, 5, 3))
        self.refused(single, "has no phase 2 (it has 1)", form=("phase=2",))
        both = self.save(numpy.zeros((4, 5, 3, 2, 3), "i2"), TURN, "both.nii")
        self.refused(both, "holds 2 volumes in time of 3 numbers a voxel (save one 3-D image)", form=("phase=1",))
        whole = self.save(array, oblique(), "cut.nii").read_bytes()
        for cut in (1, 120, 700):  # of the first volume nothing is missing
            (self.folder / "cut.nii").write_bytes(whole[:-cut])
            self.refused(self.folder / "cut.nii", "declares 720 bytes of voxels, but has", form=("phase=1",))

    def test_what_is_written_nibabel_reads(self):
        array = self.random.integers(0, 100, (4, 5, 3)).astype("i2")
        for name in ("a.nii", "a.nii.gz"):
            source = self.save(array, oblique(), "source.nii")
            for out in ("copy.nii.gz", "copy.nrrd", "copy.mha"):
                done = subprocess.run([IO_FILES, "copy", str(source), str(self.folder / out)], capture_output=True, text=True)
                self.assertEqual(done.returncode, 0, done.stderr)
                source = self.folder / out
            subprocess.run([IO_FILES, "copy", str(source), str(self.folder / name)], check=True)
            loaded = nibabel.load(self.folder / name)
            numpy.testing.assert_array_equal(numpy.asarray(loaded.dataobj), array)
            numpy.testing.assert_allclose(loaded.affine, oblique(), atol=2e-5)

    def test_wrong_headers_are_named(self):
        good = self.save(numpy.zeros((4, 5, 3), "i2"), TURN, "a.nii").read_bytes()

        def changed(at, value, name="b.nii"):
            (self.folder / name).write_bytes(good[:at] + value + good[at + len(value):])
            return self.folder / name
        self.refused(changed(344, b"ni1\0"), "its voxels are in another file")
        self.refused(changed(344, b"\0\0\0\0"), "lacks the magic 'n+1'")
        self.refused(changed(0, b"xxxx"), "is no NIfTI")
        (self.folder / "short.nii").write_bytes(good[:100])
        self.refused(self.folder / "short.nii", "is no NIfTI: it has 100 bytes of header")
        self.refused(changed(123, b"\1"), "its unit of length is NIfTI's 1 (write it in mm)")
        self.refused(changed(70, (1792).to_bytes(2, "little")), "voxels of NIfTI type 1792 cannot be read")
        self.refused(changed(42, (30000).to_bytes(2, "little")), "declares 900000 bytes of voxels, but has 120")
        self.refused(changed(42, b"\xff\xff"), "axis 1 has -1 voxels")
        self.refused(changed(108, b"\0\0\0\0"), "its voxels begin at byte 0")
        self.refused(changed(0, b"", "c.nii.gz"), "is not packed by gzip")
        two = self.save(numpy.zeros((4, 5, 3), "i2"), TURN, "two.nii", version=nibabel.Nifti2Image).read_bytes()
        for at, value, part in ((4, b"ni2\0", "its voxels are in another file"), (4, b"n+1\0", "or 'n+2' of a NIfTI-2"),
                                (168, (352).to_bytes(8, "little"), "its voxels begin at byte 352"),
                                (16, (2).to_bytes(8, "little"), "has 2 axes (save a 3-D image)"), (500, b"\1", "unit of length is NIfTI's 1")):
            (self.folder / "two.nii").write_bytes(two[:at] + value + two[at + len(value):])
            self.refused(self.folder / "two.nii", part)
        (self.folder / "two.nii").write_bytes(two[:400])
        self.refused(self.folder / "two.nii", "or 540 of a NIfTI-2, or ends before")
        for size in range(0, len(good), 7):
            (self.folder / "cut.nii").write_bytes(good[:size])
            self.refused(self.folder / "cut.nii", "error: ")
        packed = self.save(numpy.arange(60).reshape(4, 5, 3).astype("i2"), TURN, "a.nii.gz").read_bytes()
        for size in range(0, len(packed), 7):
            (self.folder / "cut.nii.gz").write_bytes(packed[:size])
            self.refused(self.folder / "cut.nii.gz", "error: ")

    def test_flipped_bytes_never_harm(self):
        for name in ("a.nii", "a.nii.gz"):
            good = self.save(self.random.integers(0, 9, (4, 5, 3)).astype("i2"), TURN, name).read_bytes()
            for _ in range(60):
                wrong = bytearray(good)
                for _ in range(1 + int(self.random.integers(3))):
                    wrong[int(self.random.integers(min(len(wrong), 380)))] = int(self.random.integers(256))
                (self.folder / ("b" + name)).write_bytes(wrong)
                done = subprocess.run([IO_FILES, "describe", str(self.folder / ("b" + name)), str(self.folder / "raw")],
                                      capture_output=True, text=True)
                self.assertIn(done.returncode, (0, 65), done.stderr)
                self.assertTrue(done.returncode == 0 or done.stderr.startswith("error: "), done.stderr)


if __name__ == "__main__":
    unittest.main(verbosity=2)
