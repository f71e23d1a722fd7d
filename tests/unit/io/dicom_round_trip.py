#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""DICOM SEG as pydicom writes it, and what we write, by pydicom's eyes and dciodvfy's."""
import json
import shutil
import subprocess
import unittest

import numpy
import pydicom.encaps
from pydicom.uid import RLELossless

from described import IO_FILES, TYPES, Described
from dicom_made import AXIAL, item, segment, text, turned, write_segmentation, write_series

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
        written(segments=[segment(1, "Femur", FEMUR), segment(2, "tibia_left", TIBIA), item(SegmentLabel="liver")])
        self.refused_segments("has a segment without a number (export it again)")
        written(change=lambda data: data.__delitem__("PixelData"))
        self.refused_segments("has no pixels (export it again)")

        def packed(data):
            data.PixelData = pydicom.encaps.encapsulate([bytes(8)] * data.NumberOfFrames)
            data["PixelData"].is_undefined_length = True
            data.file_meta.TransferSyntaxUID = RLELossless
        written(change=packed)
        self.refused_segments("packs single bits (unpack it: gdcmconv --raw IN OUT)")

        def wide(data):
            data.BitsAllocated = data.BitsStored = 32
            data.HighBit, data.PixelData = 31, bytes(4 * 63 * data.NumberOfFrames)
        written(kind="FRACTIONAL", change=wide)
        self.refused_segments("has segments of 32 bits (export it as binary)")

        def uneven(data):
            del data.SharedFunctionalGroupsSequence[0].PixelMeasuresSequence[0].SpacingBetweenSlices
            for frame, z in zip(data.PerFrameFunctionalGroupsSequence, numpy.cumsum(1 + 0.37 * numpy.arange(99) ** 0.5)):
                frame.PlanePositionSequence[0].ImagePositionPatient = text([-10, -20, z])
        written(change=uneven)
        self.refused_segments("its planes are at uneven distances, the least 1.37 mm")

        def unknown(data):
            data.SegmentationType, data.PixelData = "LABELMAP", b"\x09" * len(data.PixelData)
        written(kind="LABELMAP", change=unknown)
        self.refused_segments("holds segment 9, which is not described (export it again)")
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
        colours = self.nrrd(volume.astype("u1"), affine, "colours.nrrd")
        head, voxels = colours.read_bytes().split(b"\n\n", 1)
        head = head.replace(b"dimension: 3", b"dimension: 4").replace(b"sizes: 9", b"sizes: 3 9").replace(
            b"directions: ", b"directions: none ").replace(b"kinds: ", b"kinds: RGB-color ")
        colours.write_bytes(head + b"\n\n" + voxels * 3)
        self.write(colours, "colours.dicom", refused="a CT has one value a voxel (use .nrrd, .mha or .nii.gz)")
        long = self.nrrd(numpy.ones((65536, 1, 1), "u1"), affine, "long.nrrd")
        self.write(long, "long.dicom", refused="a DICOM slice has 65535 rows and columns at most")
        self.write(long, "long.dcm", refused="a DICOM SEG has 65535 rows and columns at most")
        many = self.nrrd(numpy.arange(1, 65537, dtype="i4").reshape(256, 256, 1), affine, "many.nrrd")
        self.write(many, "many.dcm", refused="a DICOM SEG has 65535 segments at most")
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
        other = write_series(self.folder / "mr", self.random.integers(0, 9, (9, 7, 3)).astype("i2"), AXIAL,
                             change=lambda data, _: setattr(data, "Modality", "MR"))
        self.write(image, "mr.dicom", f"source={other}", refused="is a series of MR (posed volumes are written as CT: name a CT series)")
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
            voxels = numpy.frombuffer((self.folder / "raw").read_bytes(), TYPES[told["type"]]).reshape([*shape, 3], order="F")
            ids = {name: int(i) for i, name in told["names"].items()}
            self.assertEqual(ids, {"femur_right": 1, "own_name": 2, "liver": 300 if path == first else 3})
            for number, mask in zip(ids.values(), masks.values()):
                numpy.testing.assert_array_equal((voxels == number).any(axis=3), mask > 0)
            self.assertEqual(told["codes"]["1"][1:], [["SCT", "91723000", "Anatomical Structure"], ["SCT", *FEMUR], ["SCT", *RIGHT]])
            self.assertEqual(len(told["overlaps"]), 3)
            self.assert_frame(told, affine, atol=1e-6)
        data = pydicom.dcmread(self.folder / "again.dcm")
        self.assertEqual(data.NumberOfFrames, 12 + 12 + 8)
        self.assertEqual([one.SegmentLabel for one in data.SegmentSequence], ["Femur", "own name", "liver"])
        frame = data.PerFrameFunctionalGroupsSequence[30]
        self.assertEqual(frame.SegmentIdentificationSequence[0].ReferencedSegmentNumber, 3)
        numpy.testing.assert_array_equal(data.pixel_array[30].T, masks[300][:, :, 10])
        self.verify(self.folder / "again.dcm", "Segmentation")
        # Without codes: of our own, with the side of the name.
        labels = numpy.zeros(shape, "u1")
        labels[2:4] = 7
        self.nrrd(labels, affine, "l.nrrd")
        self.write(self.folder / "l.nrrd", "l.dcm")
        data = pydicom.dcmread(self.folder / "l.dcm")
        self.assertEqual([(one.SegmentNumber, one.SegmentLabel) for one in data.SegmentSequence], [(1, "label_7")])
        self.assertEqual(data.SegmentSequence[0].SegmentedPropertyTypeCodeSequence[0].CodingSchemeDesignator, "99ECORCHE")
        self.verify(self.folder / "l.dcm", "Segmentation")
        self.nrrd(numpy.zeros(shape, "u1"), affine, "l.nrrd")
        self.write(self.folder / "l.nrrd", "none.dcm", refused="no voxel is labelled")


if __name__ == "__main__":
    unittest.main()
