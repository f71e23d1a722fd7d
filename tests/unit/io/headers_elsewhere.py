#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""NRRD and MetaImage as others write them: detached, with skips, in any byte order and space. Headers are written here,
after the formats' own pages; VTK is the second opinion on MetaImage, ITK on NRRD (unit_io_image)."""
import gzip
import itertools
import unittest
import zlib

import numpy
from vtkmodules.util.numpy_support import vtk_to_numpy
from vtkmodules.vtkIOImage import vtkMetaImageReader

from described import Described

NRRD = {"u1": ("uchar", "unsigned char", "uint8_t"), "i1": ("signed char", "int8"), "u2": ("ushort", "uint16_t"),
        "i2": ("short", "signed short int", "int16"), "u4": ("unsigned int", "uint32"), "i4": ("int", "int32_t"), "f4": ("float",),
        "f8": ("double",)}
META = {"u1": "MET_UCHAR", "i1": "MET_CHAR", "u2": "MET_USHORT", "i2": "MET_SHORT", "u4": "MET_UINT", "i4": "MET_INT", "f4": "MET_FLOAT",
        "f8": "MET_DOUBLE"}
OBLIQUE = numpy.array([[0.8, 0.6, 0], [-1.2, 1.6, 0], [0, 0, -2.5]])  # a row an axis


class Headers(Described):
    def setUp(self):
        super().setUp()
        self.array = self.random.integers(0, 100, (4, 5, 3)).astype("i2")

    def bytes_of(self, array, order):
        return array.astype(array.dtype.newbyteorder(order)).tobytes(order="F")

    def nrrd(self, name, body, array=None, axes=numpy.eye(3), **fields):
        array = self.array if array is None else array
        head = {"type": NRRD[array.dtype.str[1:]][0], "dimension": 3, "space": "left-posterior-superior", "sizes": "4 5 3",
                "space directions": " ".join("(%.17g,%.17g,%.17g)" % tuple(axis) for axis in axes), "endian": "little", "encoding": "raw",
                "space origin": "(1,-2,3)", **{key.replace("_", " "): value for key, value in fields.items()}}
        lines = "".join(f"{key}: {value}\n" for key, value in head.items() if value is not None)
        (self.folder / name).write_bytes(b"NRRD0004\n" + lines.encode() + b"\n" + body)
        return self.folder / name

    def meta(self, name, body, array=None, **fields):
        array = self.array if array is None else array
        head = {"ObjectType": "Image", "NDims": 3, "BinaryData": "True", "BinaryDataByteOrderMSB": "False", "CompressedData": "False",
                "TransformMatrix": "1 0 0 0 1 0 0 0 1", "Offset": "1 -2 3", "ElementSpacing": "1 1 1", "DimSize": "4 5 3",
                "ElementType": META[array.dtype.str[1:]], "ElementDataFile": "LOCAL", **fields}
        text = "".join(f"{key} = {value}\n" for key, value in head.items() if value is not None and key != "ElementDataFile")
        (self.folder / name).write_bytes((text + f"ElementDataFile = {head['ElementDataFile']}\n").encode() + body)
        return self.folder / name

    def assert_read(self, path, array=None, axes=numpy.eye(3), origin=(1, -2, 3), form=()):
        array = self.array if array is None else array
        grid, voxels = self.describe(path, *form)
        numpy.testing.assert_array_equal(voxels, array if array.ndim == 4 else array[None])
        affine = numpy.eye(4)
        affine[:3, :3], affine[:3, 3] = axes.T, origin
        self.assert_frame(grid, affine)

    def assert_vtk(self, path, array):
        reader = vtkMetaImageReader()
        reader.SetFileName(str(path))
        reader.Update()
        seen = vtk_to_numpy(reader.GetOutput().GetPointData().GetScalars())
        numpy.testing.assert_array_equal(seen.reshape(array.shape, order="F"), array)

    def test_nrrd_of_every_type_name_and_byte_order(self):
        for code, names in NRRD.items():
            array = self.random.integers(0, 100, (4, 5, 3)).astype(code)
            for name, (order, endian) in zip(names, itertools.cycle(((">", "big"), ("<", "little")))):
                body = self.bytes_of(array, order)
                self.assert_read(self.nrrd("a.nrrd", body, array, type=name, endian=endian), array)
                self.assert_read(self.nrrd("a.nrrd", gzip.compress(body), array, type=name, endian=endian, encoding="gzip"), array)

    def test_nrrd_axes_of_every_order_and_sign(self):
        body = self.bytes_of(self.array, "<")
        for order in itertools.permutations(range(3)):
            for signs in itertools.product((1, -1), repeat=3):
                axes = numpy.zeros((3, 3))
                for axis in range(3):
                    axes[axis, order[axis]] = signs[axis] * (1.5, 2, 0.5)[axis]
                self.assert_read(self.nrrd("a.nrrd", body, axes=axes), axes=axes)

    def test_nrrd_spaces(self):
        body = self.bytes_of(self.array, "<")
        for name, turn in (("LPS", (1, 1, 1)), ("right-anterior-superior", (-1, -1, 1)), ("RAS", (-1, -1, 1)), ("LAS", (1, -1, 1)),
                           ("left-anterior-superior", (1, -1, 1))):
            turn = numpy.diag(turn)
            self.assert_read(self.nrrd("a.nrrd", body, axes=OBLIQUE, space=name), axes=OBLIQUE @ turn, origin=turn @ (1, -2, 3))
        for name in ("scanner-xyz", "3D-right-handed"):
            self.refused(self.nrrd("a.nrrd", body, space=name), f"its space is '{name}', which does not say where the patient lies "
                         "(write it as left-posterior-superior)")
        self.refused(self.nrrd("a.nrrd", body, space_origin="(1,2)"), "its origin is nan (it must be finite, mm)")
        self.refused(self.nrrd("a.nrrd", body, space=None, space_dimension=3), "a.nrrd: ReadImageInformation: ",
                     "(write the image again)")

    def test_nrrd_detached_and_with_skips(self):
        body = self.bytes_of(self.array, "<")
        rows = (({}, body), ({"line_skip": 2}, b"one\ntwo\n" + body), ({"byte_skip": 7}, b"x\n23456" + body),
                ({"line_skip": 1, "byte_skip": 3}, b"one\nabc" + body), ({"byte_skip": -1}, b"a header of some length" + body),
                ({"encoding": "gzip"}, gzip.compress(body)), ({"encoding": "gzip", "byte_skip": 4}, gzip.compress(b"1234" + body)),
                ({"encoding": "gzip", "line_skip": 1}, b"one\n" + gzip.compress(body)))
        for fields, data in rows:
            with self.subTest(str(fields)):
                (self.folder / "the voxels.raw").write_bytes(data)
                self.assert_read(self.nrrd("a.nhdr", b"", data_file="the voxels.raw", **fields))
                self.assert_read(self.nrrd("a.nrrd", data, **fields))
        (self.folder / "the voxels.raw").write_bytes(body)
        for fields, part in (({"byte_skip": 8}, "declares 120 bytes of voxels, but has 112"), ({"line_skip": 99}, "but has 0"),
                             ({"byte_skip": -2}, "byteskip is '-2'"), ({"line_skip": "x"}, "lineskip is 'x'"),
                             ({"data_file": "../b.raw"}, "its voxels are in '../b.raw'"), ({"data_file": "b%d.raw 0 9 1"}, "its voxels are in"),
                             ({"data_file": "LIST"}, "its voxels are in 'LIST'")):
            self.refused(self.nrrd("a.nhdr", b"", **{"data_file": "the voxels.raw", **fields}), part)

    def test_meta_of_every_type_and_byte_order_packed_or_not(self):
        for code in META:
            array = self.random.integers(1, 100, (4, 5, 3)).astype(code)
            for order, msb in (("<", "False"), (">", "True")):
                body = self.bytes_of(array, order)
                path = self.meta("a.mha", body, array, BinaryDataByteOrderMSB=msb)
                self.assert_read(path, array)
                self.assert_vtk(path, array)
                packed = zlib.compress(body)
                for size in (None, len(packed)):  # without their size MetaIO itself reads zeros
                    fields = {"BinaryDataByteOrderMSB": msb, "CompressedData": "True", "CompressedDataSize": size}
                    self.assert_read(self.meta("a.mha", packed, array, **fields), array)
                    (self.folder / "the voxels.zraw").write_bytes(packed)
                    self.assert_read(self.meta("a.mhd", b"", array, ElementDataFile="the voxels.zraw", **fields), array)

    def test_meta_by_its_other_names_and_with_a_header_before_the_voxels(self):
        body = self.bytes_of(self.array, "<")
        turned = numpy.array([[0, 1.0, 0], [0, 0, -1], [1, 0, 0]])
        for place, way in (("Offset", "TransformMatrix"), ("Position", "Rotation"), ("Origin", "Orientation")):
            fields = {"Offset": None, "TransformMatrix": None, place: "1 -2 3", way: "0 1 0 0 0 -1 1 0 0"}
            self.assert_read(self.meta("a.mha", body, **fields), axes=turned)
        self.assert_read(self.meta("a.mha", self.bytes_of(self.array, ">"), BinaryDataByteOrderMSB=None, ElementByteOrderMSB="True"))
        for size in (9, -1):
            (self.folder / "a.raw").write_bytes(b"a header:" + body)
            path = self.meta("a.mhd", b"", HeaderSize=size, ElementDataFile="a.raw")
            self.assert_read(path)
            self.assert_vtk(path, self.array)
        self.refused(self.meta("a.mha", body, HeaderSize=9), "its header asks to skip 9 bytes of its own file (write it without HeaderSize)")
        rgb = self.random.integers(0, 255, (3, 4, 5, 3)).astype("u1")
        self.assert_read(self.meta("a.mha", self.bytes_of(rgb, "<"), rgb, ElementNumberOfChannels=3), rgb)

    def test_one_volume_of_several_in_time(self):
        """The fourth axis last, and of a NRRD also first: of kind time, or the list that 3D Slicer writes."""
        array = self.random.integers(0, 100, (4, 5, 3, 6)).astype("i2")
        body, first = self.bytes_of(array, "<"), self.bytes_of(numpy.moveaxis(array, 3, 0), "<")
        way = " ".join("(%.17g,%.17g,%.17g)" % tuple(axis) for axis in OBLIQUE)
        last = {"dimension": 4, "sizes": "4 5 3 6", "space directions": way + " none"}
        before = {"dimension": 4, "sizes": "6 4 5 3", "space directions": "none " + way}
        unit = OBLIQUE / numpy.linalg.norm(OBLIQUE, axis=1)[:, None]
        matrix = numpy.eye(4)
        matrix[:3, :3] = unit
        meta = {"NDims": 4, "DimSize": "4 5 3 6", "TransformMatrix": " ".join("%.17g" % x for x in matrix.flat), "Offset": "1 -2 3 0",
                "ElementSpacing": "%.17g %.17g %.17g 7" % tuple(numpy.linalg.norm(OBLIQUE, axis=1))}
        packed = zlib.compress(body)
        paths = [self.nrrd("last.nrrd", body, **last), self.nrrd("packed.nrrd", gzip.compress(body), encoding="gzip", **last),
                 self.nrrd("first.nrrd", first, kinds="time domain domain domain", **before), self.meta("a.mha", body, **meta),
                 self.meta("b.mha", packed, CompressedData="True", CompressedDataSize=len(packed), **meta)]
        for path in paths:
            for phase in (1, 3, 6):
                self.assert_read(path, array[..., phase - 1], OBLIQUE, form=(f"phase={phase}",))
            self.refused(path, "holds 6 volumes, one after the other in time (take one by --phase, in a case by phase:, from 1 to 6)")
            self.refused(path, "has no phase 7 (it has 6)", form=("phase=7",))
        listed = self.nrrd("list.nrrd", first, kinds="list domain domain domain", **before)
        self.assert_read(listed, array[..., 3], OBLIQUE, form=("phase=4",))
        self.assert_read(listed, numpy.moveaxis(array, 3, 0), OBLIQUE)  # as layers of a segmentation
        self.assert_read(self.nrrd("back.nrrd", b"a header" + body, **last, **{"byte skip": -1}), array[..., 1], OBLIQUE, form=("phase=2",))

    def test_hostile_headers_of_images_in_time(self):
        body = bytes(2 * 4 * 5 * 3 * 6)
        way = "(1,0,0) (0,1,0) (0,0,1)"
        last = {"dimension": 4, "sizes": "4 5 3 6", "space directions": way + " none"}
        meta = {"NDims": 4, "DimSize": "4 5 3 6", "TransformMatrix": "1 0 0 0 0 1 0 0 0 0 1 0 0 0 0 1", "Offset": "1 -2 3 0",
                "ElementSpacing": "1 1 1 1"}
        rows = [(self.nrrd, last, {"sizes": "4 5 3 10001"}, "declares 10001 volumes in time (it may have 10000: save those that are needed)"),
                (self.nrrd, last, {"sizes": "4 5 3 9999"}, "declares 1199880 bytes of voxels, but has 720"),
                (self.nrrd, last, {"sizes": "4 5 3 5"}, "declares 600 bytes of voxels, but has 720"),
                (self.nrrd, last, {"sizes": "2000 2000 2000 10000"}, "images may hold 2^33 bytes"),
                (self.nrrd, last, {"space directions": "none " + way + " none"}, "has 4 axes, and neither the first nor the last"),
                (self.nrrd, last, {"space": None}, "holds volumes in time, but does not say in which space they lie"),
                (self.meta, meta, {"DimSize": "4 5 3 2147483647"}, "declares 2147483647 volumes in time"),
                (self.meta, meta, {"DimSize": "4 5 3 7"}, "declares 840 bytes of voxels, but has 720"),
                (self.meta, meta, {"DimSize": "4 5 3"}, "its DimSize is '4 5 3'"),
                (self.meta, meta, {"TransformMatrix": "1 0 0 0 0 1 0 0 0 0 1 0 0 0 1 1"}, "its TransformMatrix mixes space and time"),
                (self.meta, meta, {"TransformMatrix": "1 0 0 0 1 0 0 0 1"}, "its TransformMatrix is not 16 numbers"),
                (self.meta, meta, {"TransformMatrix": "1 1 0 0 0 1 0 0 0 0 1 0 0 0 0 1"}, "its axes are not orthonormal"),
                (self.meta, meta, {"Offset": "1 -2 nan 0"}, "its origin is"),
                (self.meta, meta, {"ElementSpacing": "1 -1 1 1"}, "its spacing is"),
                (self.meta, meta, {"ElementSpacing": "1 1 x 1"}, "its ElementSpacing is not 4 numbers")]
        for write, head, change, part in rows:
            for phase in (1, 5):
                name = "h.nrrd" if write == self.nrrd else "h.mha"
                self.refused(write(name, body, **{**head, **change}), part, form=(f"phase={phase}",))
        bomb = gzip.compress(bytes(1 << 20))
        self.refused(self.nrrd("bomb.nrrd", bomb, encoding="gzip", **last), "declares 720 bytes of voxels, but its compressed data hold more",
                     form=("phase=2",))
        few = self.nrrd("few.nrrd", gzip.compress(body[:600]), encoding="gzip", **last)
        for phase in (1, 6):
            self.refused(few, "declares 720 bytes of voxels, but its compressed data hold 600", form=(f"phase={phase}",))
        self.refused(self.nrrd("much.nrrd", gzip.compress(body), encoding="gzip", **{**last, "sizes": "40 50 30 9000"}),
                     "compressed bytes cannot hold them", form=("phase=1",))


if __name__ == "__main__":
    unittest.main(verbosity=2)
