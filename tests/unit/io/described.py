# SPDX-License-Identifier: Apache-2.0
"""What our reader makes of an image, as the little command `io_files` describes it."""
import json
import pathlib
import shutil
import subprocess
import sys
import tempfile
import unittest

import numpy

IO_FILES = sys.argv.pop(1)
TYPES = {"u8": "u1", "i8": "i1", "u16": "u2", "i16": "i2", "u32": "u4", "i32": "i4", "f32": "f4", "f64": "f8"}


class Described(unittest.TestCase):
    def setUp(self):
        self.folder = pathlib.Path(tempfile.mkdtemp())
        self.addCleanup(shutil.rmtree, self.folder)
        self.random = numpy.random.default_rng(5)

    def describe(self, path, *form):
        """The grid, and the voxels: components, then i, j, k."""
        raw = self.folder / "raw"
        done = subprocess.run([IO_FILES, "describe", str(path), str(raw), *form], capture_output=True, text=True)
        self.assertEqual(done.returncode, 0, done.stderr)
        grid = json.loads(done.stdout)
        shape = [grid["components"], *grid["size"]]
        return grid, numpy.frombuffer(raw.read_bytes(), TYPES[grid["type"]]).reshape(shape, order="F")

    def refused(self, path, *parts, form=()):
        done = subprocess.run([IO_FILES, "describe", str(path), str(self.folder / "raw"), *form], capture_output=True, text=True)
        self.assertEqual(done.returncode, 65, done.stdout + done.stderr)
        self.assertEqual(len(done.stderr.splitlines()), 1, done.stderr)
        for part in parts:
            self.assertIn(part, done.stderr)

    def assert_frame(self, grid, affine, atol=2e-5):
        """`affine` brings voxels to LPS."""
        for key, index in (("origin", [0, 0, 0]), ("i", [1, 0, 0]), ("j", [0, 1, 0]), ("k", [0, 0, 1])):
            numpy.testing.assert_allclose(grid[key], (affine @ [*index, 1])[:3], atol=atol)
