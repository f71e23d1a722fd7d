#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""What poses in process, on 64-bit ARM: its unit tests under qemu-user, and a body held against this machine's.

usage: aarch64_test.py SOURCE BUILD; the environment is that of the fixtures
"""
import os
import pathlib
import sys
import tempfile
import unittest

import numpy as np

from built import build, run, unit_tests

SOURCE, BUILD = (pathlib.Path(word) for word in sys.argv[1:3])
HERE = pathlib.Path(__file__).resolve().parent
# docs/how-to/other_systems.md
MOST_MM, MOST_NORMAL = 0.001, 8


def read(path, rows):
    """(positions, normals) of each row (skinning, tissue, vertices)."""
    data, at = path.read_bytes(), 0
    for row in rows:
        count = 3 * int(row.split()[2])
        yield np.frombuffer(data, "<f4", count, at), np.frombuffer(data, "<i2", count, at + 4 * count)
        at += 6 * count
    assert at == len(data)


class Aarch64(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.there = build(SOURCE, "sysroot", "aarch64")

    def test_unit_tests(self):
        print(unit_tests(self.there, 9), "executables of unit tests pass under qemu", file=sys.stderr)

    def test_a_body_is_the_same(self):
        with tempfile.TemporaryDirectory() as name:
            folder, said, files = pathlib.Path(name), [], []
            for machine, compiler, library, start in (("x86_64", "cc", BUILD, ()),
                                                      ("aarch64", "aarch64-linux-gnu-gcc", self.there,
                                                       ("qemu-aarch64", "-L", SOURCE / "build" / "sysroot-arm64"))):
                program, out = folder / machine, folder / f"{machine}.bin"
                place = library / "clients" / "c"
                # What the library needs itself is looked for when the program runs.
                run(compiler, "-std=c11", "-Wall", "-Wextra", "-Werror", f"-I{SOURCE / 'clients' / 'c' / 'include'}", HERE / "pose_all.c", "-o", program,
                    f"-L{place}", "-lecorche", f"-Wl,-rpath,{place}", "-Wl,--unresolved-symbols=ignore-in-shared-libs")
                said.append(run(*start, program, os.environ["ECORCHE_MODEL"], out, "knee_right", "flexion").splitlines())
                files.append(out)
            self.assertEqual(*said)
            self.assertGreater(len(said[0]), 30)
            farthest, turned = 0, 0
            for row, (here, there) in zip(said[0], zip(read(files[0], said[0]), read(files[1], said[0]))):
                self.assertTrue(np.isfinite(there[0]).all(), row)
                farthest = max(farthest, float(np.abs(here[0] - there[0]).max()))
                turned = max(turned, int(np.abs(here[1].astype(int) - there[1]).max()))
            print(f"farthest apart: {farthest:.6f} mm, normals {turned} of 32767", file=sys.stderr)
            self.assertLess(farthest, MOST_MM)
            self.assertLessEqual(turned, MOST_NORMAL)


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1])
