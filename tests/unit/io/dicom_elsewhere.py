#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""DICOM series as pydicom and GDCM's tools write them: what is read, what is said, what is refused."""
import shutil
import subprocess
import unittest

import numpy
import pydicom.encaps
from pydicom.uid import ExplicitVRBigEndian, ImplicitVRLittleEndian, JPEG2000Lossless

from described import Described
from dicom_made import AXIAL, ENHANCED_CT, item, new_file, set_pixels, text, turned, write_series

class Series(Described):
    def setUp(self):
        super().setUp()
        self.volume = self.random.integers(-1000, 2000, (9, 7, 12)).astype("i2")
        self.place = self.folder / "ct"

    def write(self, change=None, volume=None, affine=AXIAL, **more):
        return write_series(self.place, self.volume if volume is None else volume, affine, change=change, **more)

    def assert_read(self, affine=AXIAL, expected=None, kind="i16", form=(), notes=0):
        grid, voxels = self.describe(self.place, *form)
        self.assert_frame(grid, affine, atol=1e-6)
        self.assertEqual(grid["type"], kind)
        self.assertEqual(len(grid["notes"]), notes, grid["notes"])
        numpy.testing.assert_array_equal(voxels[0], self.volume if expected is None else expected)
        return grid

    def test_slices_are_sorted_by_place_and_way(self):
        back_to_front = AXIAL @ numpy.array([[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, -1, 11], [0, 0, 0, 1.0]])
        for affine in (AXIAL, turned(AXIAL)):
            self.write(affine=affine)
            self.assert_read(affine)
        self.write(affine=back_to_front, volume=self.volume[:, :, ::-1])
        self.assert_read(AXIAL)
        # Rows to the right: an image whose axes would be left-handed is turned by its slices' order.
        mirror = numpy.diag([-1.0, 1, 1, 1]) @ AXIAL
        self.write(affine=mirror)
        self.assert_read(mirror @ numpy.array([[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, -1, 11], [0, 0, 0, 1.0]]),
                         self.volume[:, :, ::-1])

    def test_folders_within_and_what_is_no_dicom(self):
        self.write()
        (self.place / "a").mkdir()
        for file in sorted(self.place.glob("IM*"))[:5]:
            file.rename(self.place / "a" / file.name)
        (self.place / "README.txt").write_text("CT of the thorax\n" * 40)
        (self.place / "DICOMDIR").write_bytes(b"\0" * 128 + b"DICM" + b"\0" * 50)
        self.assert_read()

    def test_every_raw_syntax_type_and_scale(self):
        for syntax in (ImplicitVRLittleEndian, ExplicitVRBigEndian):
            self.write(syntax=syntax)
            self.assert_read()

        def scale(slope, intercept):
            def change(data, _):
                data.RescaleSlope, data.RescaleIntercept = slope, intercept
            return change
        stored = self.random.integers(0, 4096, self.volume.shape).astype("u2")
        self.write(scale(1, -1024), stored)
        self.assert_read(expected=stored.astype("i4") - 1024)
        self.write(volume=stored)
        self.assert_read(expected=stored, kind="u16")
        self.write(scale(40, -1024), stored)
        self.assert_read(expected=stored.astype("i4") * 40 - 1024, kind="i32")
        self.write(scale(0.25, 0.5), stored)
        self.assert_read(expected=stored.astype("f4") * 0.25 + 0.5, kind="f32")
        # Another scale in each slice, as PET has.
        self.write(lambda data, k: scale(k + 1, k)(data, k), stored)
        self.assert_read(expected=stored.astype("i4") * numpy.arange(1, 13) + numpy.arange(12), kind="u16")

    def test_twelve_bits_and_what_stands_beside_them(self):
        def change(data, _):
            data.BitsStored, data.HighBit, data.PixelRepresentation = 12, 11, 1
            data.RescaleIntercept = -24
        stored = self.random.integers(0, 65536, self.volume.shape).astype("u2")
        low = (stored & 0xfff).astype("i4")
        self.write(change, stored)
        self.assert_read(expected=numpy.where(low >= 2048, low - 4096, low) - 24)

    def test_packed(self):
        for word, exact in (("--rle", True), ("--jpeg", True), ("--jpegls", True), ("--j2k", True)):
            with self.subTest(word):
                self.write()
                for file in sorted(self.place.glob("IM*")):
                    subprocess.run(["gdcmconv", word, str(file), str(file)], check=True)
                kind = pydicom.dcmread(sorted(self.place.glob("IM*"))[0]).file_meta.TransferSyntaxUID
                self.assertTrue(kind.is_compressed, kind)
                self.assert_read()

    def test_packed_12_bits_and_lossy(self):
        stored = (2000 + 900 * numpy.sin(numpy.arange(16 * 16 * 4).reshape(16, 16, 4) / 40)).astype("u2")

        def change(data, _):
            data.BitsStored, data.HighBit, data.RescaleIntercept = 12, 11, -1024
        for tool in (["dcmcjpeg", "+ee"], ["gdcmconv", "--j2k", "--lossy", "-q", "90"], ["dcmcjpeg", "+eb", "+Wm"]):
            with self.subTest(tool):
                shutil.rmtree(self.place, ignore_errors=True)
                self.write(change, stored)
                for file in sorted(self.place.glob("IM*")):
                    subprocess.run([*tool, str(file), str(file)], check=True, capture_output=True)
                if "+eb" in tool:  # of 8 bits, windowed
                    self.assertEqual(self.describe(self.place)[0]["size"], [16, 16, 4])
                    continue
                _, voxels = self.describe(self.place)
                numpy.testing.assert_allclose(voxels[0], stored.astype("i4") - 1024, atol=40)

    def test_one_of_several_series(self):
        self.write()
        other = self.volume[:, :, :5] + 1
        write_series(self.place, other, AXIAL, "1.2.3.4.77", names=[f"x{k}" for k in range(5)],
                     change=lambda data, _: setattr(data, "SeriesDescription", "Lung"))
        self.refused(self.place, "ct: holds 2 series: 1.2.3.4.5 'Thorax 1.0' CT 9 x 7 x 12; 1.2.3.4.77 'Lung' CT 9 x 7 x 5 "
                     "(take one by --series, in a case by series:, with its UID or description)")
        for which in ("1.2.3.4.77", "Lung", "77"):
            self.assert_read(expected=other, form=("series=" + which,))
        self.assert_read(form=("series=1.2.3.4.5",))
        self.refused(self.place, "has no series 'Head'", form=("series=Head",))

    def test_more_series_than_a_scan_has(self):
        self.write(volume=self.volume[:, :, :1])
        one = (self.place / "IM0000").read_bytes()
        self.assertEqual(one.count(b"1.2.3.4.5\0"), 1)
        for k in range(1001):
            (self.place / f"{k}").write_bytes(one.replace(b"1.2.3.4.5\0", b"1.2.3.%04d" % k))
        self.refused(self.place, "holds more than 1000 series (name a smaller folder)")

    def test_scouts_and_mixed_ways(self):
        self.write()
        sagittal = AXIAL[:, [1, 2, 0, 3]]

        def scout(data, _):
            data.ImageType = ["ORIGINAL", "PRIMARY", "LOCALIZER"]
        write_series(self.place, self.volume[:, :, :2], sagittal, names=["s0", "s1"], change=scout)
        self.assert_read()
        write_series(self.place, self.volume[:, :, :2], sagittal, names=["s0", "s1"])
        self.refused(self.place, "holds 2 series: 1.2.3.4.5 'Thorax 1.0' CT 9 x 7 x 12; 1.2.3.4.5/2 'Thorax 1.0' CT 9 x 7 x 2")
        self.assertEqual(self.describe(self.place, "series=1.2.3.4.5/2")[0]["size"], [9, 7, 2])

    def test_missing_and_doubled(self):
        self.write(lambda data, k: k != 5)
        self.refused(self.place, "lacks 1 slice, the first between IM0397 at (-10, -20, 36) and IM0091 at (-10, -20, 39)")
        shutil.rmtree(self.place)
        self.write()
        shutil.copy(self.place / "IM0091", self.place / "copy")
        self.assertIn("1 slices are there twice", self.assert_read(notes=1)["notes"][0])
        again = pydicom.dcmread(self.place / "copy")
        again.SOPInstanceUID = again.file_meta.MediaStorageSOPInstanceUID = "1.9.9"
        again.save_as(self.place / "copy")
        self.refused(self.place, "two slices at one place: IM0091 at (-10, -20, 39) and copy")

    def test_four_dimensions(self):
        for phase in (1, 2, 3):
            write_series(self.place, self.volume + phase, AXIAL, names=[f"{k}_{7 - phase}" for k in range(12)],
                         change=lambda data, _: setattr(data, "AcquisitionNumber", phase))
        self.refused(self.place, "holds 3 volumes, one after the other in time (take one by --phase")
        self.assert_read(expected=self.volume + 2, form=("phase=2",))
        self.refused(self.place, "has no phase 4", form=("phase=4",))

    def test_uneven_slices_are_interpolated(self):
        depth = numpy.array([0, 1, 2, 3.5, 5, 6, 7, 8, 9, 10.0, 11, 12])
        ramp = numpy.broadcast_to((100 * depth).astype("i2"), self.volume.shape)
        self.write(lambda data, k: setattr(data, "ImagePositionPatient", text(AXIAL[:3, 3] + [0, 0, 1.5 * depth[k]])), ramp)
        grid = self.assert_read(expected=numpy.broadcast_to((100 * numpy.arange(13)).astype("i2"), (9, 7, 13)), notes=1)
        self.assertIn("1.5 to 2.25 mm apart (the widest gap is between", grid["notes"][0])
        self.assertIn("resampled to every 1.5 mm", grid["notes"][0])
        self.refused(self.place, "labels cannot be interpolated", form=("labels",))
        self.write(lambda data, k: setattr(data, "ImagePositionPatient",
                                           text(AXIAL[:3, 3] + [0, 0, 1.5 * k + (20 if k > 6 else 0)])))
        self.refused(self.place, "has a gap of 21.5 mm, between IM0091 at (-10, -20, 39) and IM0947")

    def test_a_tilted_gantry_is_straightened(self):
        # A field that is linear in space is met exactly by whoever interpolates rightly.
        tilted = AXIAL.copy()
        tilted[:3, 2] = [0, 1.0, 1.5]
        i, j, k = numpy.indices(self.volume.shape)
        x, y, z = (tilted[:3] @ numpy.stack([i, j, k, numpy.ones_like(i)]).reshape(4, -1)).reshape(3, *i.shape)
        self.write(volume=numpy.round(20 * x + 10 * y + 30 * z).astype("i2"), affine=tilted)
        grid, voxels = self.describe(self.place)
        self.assertIn("its gantry was tilted by 33.7 degrees", grid["notes"][0])
        numpy.testing.assert_allclose(numpy.array(grid["k"]) - grid["origin"], [0, 0, 1.5], atol=1e-9)
        size = grid["size"]
        self.assertEqual([size[0], size[2]], [9, 12])
        i, j, k = numpy.indices(size)
        at = numpy.array(grid["origin"])[:, None, None, None] + numpy.stack([0.7 * i, 0.8 * j, 1.5 * k])
        expected = 20 * at[0] + 10 * at[1] + 30 * at[2]
        low = AXIAL[1, 3] + at[2] - AXIAL[2, 3] - (at[2] - AXIAL[2, 3]) / 3  # where each slice begins
        inside = (at[1] >= low - 1e-6) & (at[1] <= low + 0.8 * 6 + 1e-6)
        self.assertGreater(inside.sum(), 9 * 12 * 5)
        self.assertLessEqual(numpy.abs(voxels[0] - expected)[inside].max(), 1.01)
        self.assertTrue((voxels[0][~inside] == voxels[0].min()).all())

    def test_files_of_many_frames(self):
        data = new_file(self.folder / "e.dcm", ENHANCED_CT)
        data.Modality, data.SeriesInstanceUID = "CT", "1.2.3.4.6"
        set_pixels(data, numpy.ascontiguousarray(self.volume.transpose(2, 1, 0)), True)
        data.NumberOfFrames = 12
        affine = turned(AXIAL)
        ways = affine[:3, :3] / numpy.linalg.norm(affine[:3, :3], axis=0)
        data.SharedFunctionalGroupsSequence = [item(
            PixelMeasuresSequence=[item(PixelSpacing=["0.8", "0.7"], SliceThickness="1.5")],
            PlaneOrientationSequence=[item(ImageOrientationPatient=text([ways[:, 0], ways[:, 1]]))],
            PixelValueTransformationSequence=[item(RescaleIntercept="-4", RescaleSlope="1", RescaleType="HU")])]
        data.PerFrameFunctionalGroupsSequence = [
            item(PlanePositionSequence=[item(ImagePositionPatient=text((affine @ [0, 0, k, 1])[:3]))]) for k in range(12)]
        data.save_as(self.folder / "e.dcm", write_like_original=False)
        self.place = self.folder / "e.dcm"
        self.assert_read(affine, self.volume - 4)
        for word in ("--rle", "--j2k", "--jpegls"):
            subprocess.run(["gdcmconv", word, str(self.place), str(self.folder / "p.dcm")], check=True)
            grid, voxels = self.describe(self.folder / "p.dcm")
            numpy.testing.assert_array_equal(voxels[0], self.volume - 4)
        del data.PerFrameFunctionalGroupsSequence[3:]
        data.save_as(self.place)
        self.refused(self.place, "describes 3 of its 12 frames")

    def test_what_is_no_volume(self):
        self.write(lambda data, _: data.__delitem__("PixelSpacing"))
        self.refused(self.place, "does not say where it lies: it lacks Pixel Spacing")

        def colours(data, _):
            data.SamplesPerPixel, data.PhotometricInterpretation, data.PlanarConfiguration = 3, "RGB", 0
        self.write(colours)
        self.refused(self.place, "is a picture in colours (RGB)")
        self.write(lambda data, _: setattr(data, "PhotometricInterpretation", "MONOCHROME1"))
        self.assertIn("MONOCHROME1", self.assert_read(notes=1)["notes"][0])
        self.write(lambda data, _: setattr(data, "Rows", 70))
        self.refused(self.place, "of its pixels (copy it from the archive again)")
        self.write(lambda data, _: setattr(data, "RescaleSlope", 0))
        self.refused(self.place, "its Rescale Slope or Intercept is 0")
        for file in self.place.glob("*"):
            file.write_bytes(file.read_bytes()[:700])
        self.refused(self.place, "which is cut or damaged, at byte 700")
        one = sorted(self.place.glob("*"))[0]
        for file in self.place.glob("*"):
            file.unlink()
        nested = (b"\x08\x00\x40\x11SQ\0\0\xff\xff\xff\xff" + b"\xfe\xff\x00\xe0\xff\xff\xff\xff") * 200000
        meta = b"\x02\x00\x10\x00UI\x14\x00" + b"1.2.840.10008.1.2.1\0"
        one.write_bytes(b"\0" * 128 + b"DICM" + meta + nested)
        self.refused(self.place, "sequences lie 16 deep in each other at byte")

    def test_headers_that_lie(self):
        def put(**values):
            return lambda data, _: [setattr(data, key, value) for key, value in values.items()]
        for change, line in (
                (put(Rows=0), "has 9 x 0 pixels (export it again)"),
                (put(BitsStored=17), "stores 17 bits up to bit 15 of 16 (export it again)"),
                (put(NumberOfFrames=0), "says that it has 0 frames (export it again)"),
                (put(PixelSpacing=["0", "0.7"]), "its Pixel Spacing is 0 (export it again)"),
                (put(ModalityLUTSequence=[item(LUTDescriptor=[1, 0, 16])]), "its values lie behind a table (Modality LUT), or are single bits"),
                (lambda data, k: setattr(data, "ImagePositionPatient", text(AXIAL[:3, 3] + [900 * (k % 2), 0, 1.5 * k])),
                 "its slices do not lie over each other: they are 900 mm apart"),
        ):
            with self.subTest(line):
                self.write(change)
                self.refused(self.place, line)

    def test_packed_pixels_that_end_early(self):
        self.write()
        for file in sorted(self.place.glob("IM*")):
            subprocess.run(["gdcmconv", "--rle", str(file), str(file)], check=True)
            file.write_bytes(file.read_bytes()[:-8])  # what ends them
        self.refused(self.place, "ends within its pixels (copy it from the archive again)")
        data = new_file(self.folder / "e.dcm", ENHANCED_CT)
        data.Modality, data.SeriesInstanceUID = "CT", "1.2.3.4.6"
        set_pixels(data, numpy.ascontiguousarray(self.volume.transpose(2, 1, 0)), True)
        data.NumberOfFrames = 12
        data.SharedFunctionalGroupsSequence = [item(
            PixelMeasuresSequence=[item(PixelSpacing=["0.8", "0.7"], SliceThickness="1.5")],
            PlaneOrientationSequence=[item(ImageOrientationPatient=["1", "0", "0", "0", "1", "0"])])]
        data.PerFrameFunctionalGroupsSequence = [
            item(PlanePositionSequence=[item(ImagePositionPatient=["0", "0", str(1.5 * k)])]) for k in range(12)]
        data.PixelData = pydicom.encaps.encapsulate([bytes(64)] * 12, fragments_per_frame=2, has_bot=False)
        data["PixelData"].is_undefined_length = True
        data.file_meta.TransferSyntaxUID = JPEG2000Lossless
        data.save_as(self.folder / "e.dcm", write_like_original=False)
        self.refused(self.folder / "e.dcm", "does not tell which of its 24 fragments are of which of its 12 frames")


if __name__ == "__main__":
    unittest.main()
