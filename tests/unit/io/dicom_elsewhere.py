#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""DICOM series as pydicom and GDCM's tools write them: what is read, what is said, what is refused."""
import json
import shutil
import subprocess
import unittest

import numpy
import pydicom
from pydicom.uid import ExplicitVRBigEndian, ImplicitVRLittleEndian

from described import IO_FILES, TYPES, Described
from dicom_made import ENHANCED_CT, item, new_file, segment, set_pixels, text, write_segmentation, write_series

AXIAL = numpy.array([[0.7, 0, 0, -10], [0, 0.8, 0, -20], [0, 0, 1.5, 30], [0, 0, 0, 1.0]])


def turned(affine):
    """About two axes: oblique to all."""
    (c, s), (d, t) = ((numpy.cos(a), numpy.sin(a)) for a in (0.3, -0.5))
    out = numpy.eye(4)
    out[:3, :3] = numpy.array([[c, 0, -s], [0, 1, 0], [s, 0, c]]) @ numpy.array([[1, 0, 0], [0, d, -t], [0, t, d]])
    return out @ affine


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
        self.refused(self.place, "is cut")
        one = sorted(self.place.glob("*"))[0]
        for file in self.place.glob("*"):
            file.unlink()
        nested = (b"\x08\x00\x40\x11SQ\0\0\xff\xff\xff\xff" + b"\xfe\xff\x00\xe0\xff\xff\xff\xff") * 200000
        meta = b"\x02\x00\x10\x00UI\x14\x00" + b"1.2.840.10008.1.2.1\0"
        one.write_bytes(b"\0" * 128 + b"DICM" + meta + nested)
        self.refused(self.place, "sequences lie 16 deep in each other at byte")


RIGHT = ("24028007", "Right")
FEMUR, TIBIA, LIVER = ("71341001", "Femur"), ("12611008", "Tibia"), ("10200004", "Liver")


class Segments(Described):
    def setUp(self):
        super().setUp()
        self.path = self.folder / "seg.dcm"
        shape = (9, 7, 12)  # 63 pixels a frame: bits run on from frame to frame
        self.masks = {n: (self.random.random(shape) < 0.3).astype("u1") for n in (1, 2, 5)}
        self.masks[2] *= 1 - self.masks[1]
        for mask in self.masks.values():
            mask[:, :, [0, 4, 5]] = 0
        self.masks[1][:, :, 11] = self.masks[2][:, :, 11] = self.masks[5][:, :, 11] = 0
        self.segments = [segment(1, "Femur", FEMUR, RIGHT), segment(2, "tibia_left", TIBIA), segment(5, "", LIVER)]

    def read(self, path=None, *words):
        raw = self.folder / "raw"
        done = subprocess.run([IO_FILES, "segments", str(path or self.path), str(raw), *words], capture_output=True, text=True)
        self.assertEqual(done.returncode, 0, done.stderr)
        told = json.loads(done.stdout)
        voxels = numpy.frombuffer(raw.read_bytes(), TYPES[told["type"]])
        return told, voxels.reshape([*told["size"], told["layers"]], order="F")

    def refused_segments(self, part, path=None):
        done = subprocess.run([IO_FILES, "segments", str(path or self.path), str(self.folder / "raw")], capture_output=True, text=True)
        self.assertEqual((done.returncode, len(done.stderr.splitlines())), (65, 1), done.stderr)
        self.assertIn(part, done.stderr)

    def assert_masks(self, voxels, planes=slice(1, 11)):
        for number, mask in self.masks.items():
            numpy.testing.assert_array_equal((voxels == number).any(axis=3), mask[:, :, planes] > 0)

    def test_binary_with_overlaps_and_empty_frames(self):
        for affine in (AXIAL, turned(AXIAL)):
            write_segmentation(self.path, self.masks, self.segments, affine)
            told, voxels = self.read()
            self.assertEqual(told["names"], {"1": "femur_right", "2": "tibia_left", "5": "liver"})
            self.assertEqual(told["codes"]["1"], ["Femur", ["SCT", "91723000", "Anatomical Structure"],
                                                  ["SCT", *FEMUR], ["SCT", *RIGHT]])
            self.assertEqual(told["codes"]["2"][3], ["", "", ""])
            self.assert_masks(voxels)
            self.assert_frame(told, affine @ numpy.array([[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 1], [0, 0, 0, 1.0]]), atol=1e-6)
            # 1 and 2 share nothing and a layer; 5 overlaps both and lies behind them.
            self.assertEqual(told["layers"], 2)
            self.assertEqual(set(numpy.unique(voxels[..., 0])), {0, 1, 2})
            shared = [int((self.masks[n] * self.masks[5]).sum()) for n in (1, 2)]
            self.assertEqual(told["overlaps"], [[1, 5, shared[0]], [2, 5, shared[1]]])
        # The same in a folder, beside the series that it is of.
        place = self.folder / "both"
        write_series(place, numpy.zeros((9, 7, 12), "i2"), AXIAL)
        shutil.copy(self.path, place)
        self.assertEqual(self.read(place)[0]["names"], told["names"])

    def test_fractional(self):
        for most in (255, 4, 1):
            soft = {n: numpy.round(mask * self.random.integers(0, most + 1, mask.shape)).astype("u1") for n, mask in self.masks.items()}
            for mask in soft.values():
                mask[0, 0, [1, 10]] = most
            write_segmentation(self.path, soft, self.segments, AXIAL, "FRACTIONAL", most=most)
            told, voxels = self.read()
            self.assertIn("is fractional", told["notes"][0])
            self.masks = {n: mask >= max(most / 2, 1) for n, mask in soft.items()}
            self.assert_masks(voxels)
        subprocess.run(["gdcmconv", "--rle", str(self.path), str(self.folder / "p.dcm")], check=True)
        self.assert_masks(self.read(self.folder / "p.dcm")[1])

    def test_refused(self):
        def written(**more):
            return write_segmentation(self.path, self.masks, more.pop("segments", self.segments), AXIAL, **more)
        written(segments=self.segments[:2])
        self.refused_segments("shows segment 5, which is not described")
        written(change=lambda data: data.SegmentSequence.clear())
        self.refused_segments("describes no segment")
        written(change=lambda data: data.PerFrameFunctionalGroupsSequence.pop())
        self.refused_segments(" frames (export it again)")

        def moved(data):
            data.PerFrameFunctionalGroupsSequence[3].PlanePositionSequence[0].ImagePositionPatient = [5, 5, 5]
        written(change=moved)
        self.refused_segments("frame 4 does not lie over frame 1")

        def far(data):
            data.PerFrameFunctionalGroupsSequence[3].PlanePositionSequence[0].ImagePositionPatient = text([-10, -20, 1.5e6])
        written(change=far)
        self.refused_segments("its Image Position is 1.5e+06")
        written(change=lambda data: setattr(data, "PixelData", data.PixelData[:20]))
        self.refused_segments("of its pixels")
        shutil.copy(written(), self.folder / "again.dcm")
        self.refused_segments("holds 2 segmentations: 1.2.3.4.8 'Bones'; 1.2.3.4.8 'Bones'", self.folder)
        place = self.folder / "alone"
        place.mkdir()
        shutil.move(self.path, place)
        self.refused(place, "holds a segmentation (seg.dcm), and no picture (name it under labels)")


class Written(Described):
    """What we write, by pydicom's eyes and dciodvfy's, and read back."""

    def write(self, image, name, *words, refused=None):
        done = subprocess.run([IO_FILES, "write_dicom", str(image), str(self.folder / name), *words], capture_output=True, text=True)
        if refused:
            self.assertIn(refused, done.stderr)
        self.assertEqual(done.returncode != 0, bool(refused), done.stderr)
        return done.stdout

    def verify(self, path, kind):
        """Against the standard's own tables."""
        done = subprocess.run(["dciodvfy", str(path)], capture_output=True, text=True)
        errors = [line for line in done.stderr.splitlines() if line.startswith("Error")]
        self.assertEqual(errors, [])
        self.assertIn(kind, done.stderr)

    def nrrd(self, volume, affine, name="in.nrrd"):
        names = {"i2": "short", "u2": "ushort", "i4": "int", "f4": "float", "u1": "uchar"}
        columns = " ".join("(" + ",".join(repr(float(x)) for x in affine[:3, c]) + ")" for c in range(3))
        head = (f"NRRD0004\ntype: {names[volume.dtype.str[1:]]}\ndimension: 3\nspace: left-posterior-superior\n"
                f"sizes: {volume.shape[0]} {volume.shape[1]} {volume.shape[2]}\nspace directions: {columns}\nkinds: domain domain domain\n"
                f"endian: little\nencoding: raw\nspace origin: ({','.join(repr(float(x)) for x in affine[:3, 3])})\n\n")
        path = self.folder / name
        path.write_bytes(head.encode() + volume.tobytes(order="F"))
        return path

    def test_a_series_comes_back_voxel_for_voxel(self):
        affine = turned(numpy.array([[0.123456789, 0, 0, -110.0625], [0, 1 / 3, 0, -20], [0, 0, 0.7, 1030.1], [0, 0, 0, 1.0]]))
        shape = (9, 7, 12)
        for number, (kind, low, high) in enumerate([("i2", -32768, 32767), ("u2", 0, 65535), ("i4", 90000, 150000), ("u1", 0, 255)]):
            volume = self.random.integers(low, high, shape, endpoint=True).astype(kind)
            name = f"{number}.dicom"
            self.assertEqual(self.write(self.nrrd(volume, affine), name), "")
            grid, voxels = self.describe(self.folder / name)
            self.assert_frame(grid, affine, atol=1e-6)
            numpy.testing.assert_array_equal(voxels[0], volume)
        volume = self.random.random(shape).astype("f4") * 1e5
        self.assertIn("its values need more than 16 bits: written in steps of 1.5", self.write(self.nrrd(volume, affine), "f.dicom"))
        numpy.testing.assert_allclose(self.describe(self.folder / "f.dicom")[1][0], volume, atol=1.6 / 2)
        # A left-handed grid has its slices the other way round.
        mirror = affine @ numpy.diag([1.0, 1, -1, 1])
        self.write(self.nrrd(volume.astype("i4").astype("i2"), mirror), "m.dicom")
        grid, voxels = self.describe(self.folder / "m.dicom")
        self.assert_frame(grid, mirror @ numpy.array([[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, -1, 11], [0, 0, 0, 1.0]]), atol=1e-6)
        numpy.testing.assert_array_equal(voxels[0], volume.astype("i4").astype("i2")[:, :, ::-1])
        self.write(self.folder / "in.nrrd", "m.dicom", refused="is there already, and holds files")

    def test_who_was_scanned_is_dropped_unless_kept(self):
        source = write_series(self.folder / "scan", self.random.integers(0, 100, (9, 7, 12)).astype("i2"), AXIAL)
        image = self.nrrd(self.random.integers(-9, 9, (9, 7, 12)).astype("i2"), AXIAL)
        self.write(image, "a.dicom", f"source={source}")
        self.write(image, "b.dicom", f"source={source}", "keep")
        self.write(image, "c.dicom", f"source={source}")
        dropped = [path.read_bytes() for path in sorted((self.folder / "a.dicom").iterdir())]
        self.assertEqual(dropped, [path.read_bytes() for path in sorted((self.folder / "c.dicom").iterdir())])
        for word in (b"Doe", b"4711", b"19700101", b"20200101", b"House", b"1.2.3.4", b"1.2.826"):
            self.assertFalse(any(word in one for one in dropped), word)
        slices = [pydicom.dcmread(path) for path in sorted((self.folder / "a.dicom").iterdir())]
        self.assertEqual(len(slices), 12)
        self.assertEqual(len({data.SOPInstanceUID for data in slices}), 12)
        for data in slices:
            self.assertEqual((data.KVP, data.PatientName, data.PatientIdentityRemoved), (120, "ECORCHE^MODEL", "YES"))
            self.assertEqual(data.ImageType, ["DERIVED", "SECONDARY", "AXIAL"])
            self.assertEqual((data.DerivationDescription, data.SeriesDescription), ("Posed", "ct, arms_up"))
        self.verify(self.folder / "a.dicom" / "IM0001.dcm", "CTImage")
        kept = pydicom.dcmread(self.folder / "b.dicom" / "IM0003.dcm")
        scanned = [pydicom.dcmread(path) for path in source.iterdir()]
        for key in ("PatientName", "PatientID", "PatientBirthDate", "PatientSex", "StudyInstanceUID", "StudyDate", "AccessionNumber"):
            self.assertEqual(kept[key].value, scanned[0][key].value)
        self.assertEqual({one.ReferencedSOPInstanceUID for one in kept.SourceImageSequence}, {one.SOPInstanceUID for one in scanned})
        self.assertNotIn(kept.SeriesInstanceUID, {one.SeriesInstanceUID for one in scanned})
        self.assertNotEqual(kept.FrameOfReferenceUID, scanned[0].FrameOfReferenceUID)
        self.assertNotIn("PatientIdentityRemoved", kept)
        self.verify(self.folder / "b.dicom" / "IM0003.dcm", "CTImage")

    def test_labels_come_back_with_names_codes_and_overlaps(self):
        shape = (9, 7, 12)
        masks = {n: (self.random.random(shape) < 0.3).astype("u1") for n in (1, 2, 300)}
        masks[300][:, :, 4:8] = 0
        segments = [segment(1, "Femur", FEMUR, RIGHT), segment(2, "own name", ("X1", "Thing")), segment(300, "liver", LIVER)]
        affine = turned(AXIAL)
        first = write_segmentation(self.folder / "first.dcm", masks, segments, affine)
        self.write(first, "again.dcm")
        for path in (first, self.folder / "again.dcm"):
            done = subprocess.run([IO_FILES, "segments", str(path), str(self.folder / "raw")], capture_output=True, text=True, check=True)
            told = json.loads(done.stdout)
            voxels = numpy.frombuffer((self.folder / "raw").read_bytes(), "u2").reshape([*shape, 3], order="F")
            for number, mask in masks.items():
                numpy.testing.assert_array_equal((voxels == number).any(axis=3), mask > 0)
            self.assertEqual(told["names"], {"1": "femur_right", "2": "own_name", "300": "liver"})
            self.assertEqual(told["codes"]["1"][1:], [["SCT", "91723000", "Anatomical Structure"], ["SCT", *FEMUR], ["SCT", *RIGHT]])
            self.assertEqual(len(told["overlaps"]), 3)
            self.assert_frame(told, affine, atol=1e-6)
        data = pydicom.dcmread(self.folder / "again.dcm")
        self.assertEqual(data.NumberOfFrames, 12 + 12 + 8)
        self.assertEqual([one.SegmentLabel for one in data.SegmentSequence], ["Femur", "own name", "liver"])
        frame = data.PerFrameFunctionalGroupsSequence[30]
        self.assertEqual(frame.SegmentIdentificationSequence[0].ReferencedSegmentNumber, 300)
        numpy.testing.assert_array_equal(data.pixel_array[30].T, masks[300][:, :, 10])
        self.verify(self.folder / "again.dcm", "Segmentation")
        # Without codes: of our own, with the side of the name.
        labels = numpy.zeros(shape, "u1")
        labels[2:4] = 7
        self.nrrd(labels, affine, "l.nrrd")
        self.write(self.folder / "l.nrrd", "l.dcm")
        data = pydicom.dcmread(self.folder / "l.dcm")
        self.assertEqual([one.SegmentNumber for one in data.SegmentSequence], [7])
        self.assertEqual(data.SegmentSequence[0].SegmentedPropertyTypeCodeSequence[0].CodingSchemeDesignator, "99ECORCHE")
        self.verify(self.folder / "l.dcm", "Segmentation")
        self.nrrd(numpy.zeros(shape, "u1"), affine, "l.nrrd")
        self.write(self.folder / "l.nrrd", "none.dcm", refused="no voxel is labelled")


if __name__ == "__main__":
    unittest.main()
