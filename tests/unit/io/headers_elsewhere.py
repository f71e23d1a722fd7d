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

    def assert_read(self, path, array=None, axes=numpy.eye(3), origin=(1, -2, 3)):
        array = self.array if array is None else array
        grid, voxels = self.describe(path)
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


if __name__ == "__main__":
    unittest.main(verbosity=2)
