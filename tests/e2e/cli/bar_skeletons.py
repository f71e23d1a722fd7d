# SPDX-License-Identifier: Apache-2.0
"""A bar of voxels thinned in three ways, an arm's rig through it, and what tests of them ask."""
import json
import os
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile
import unittest

import numpy as np

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[3] / "scripts/renderer"))
import bodies  # noqa: E402

ECORCHE = os.environ["ECORCHE_BIN"]
ERROR_LINE = re.compile(r"^error: .+: .+ \(.+\)$", re.M)

ARM = """ecorche_skeleton: 1
name: arm
segments:
  upper: {joint: {name: shoulder, kind: free, center: [6, 8, 7.5]}}
  lower: {parent: upper, joint: {name: elbow, kind: ball, center: [30, 8, 7.5], sequence: [{flexion: z}, {abduction: y}, {rotation: x}]}}
"""
BENT = "ecorche_pose: 1\nskeleton: arm\njoints:\n  elbow: {flexion_deg: 50}\n"


def run(*words):
    return subprocess.run([ECORCHE, *map(str, words)], capture_output=True, text=True, timeout=200)


def write_nrrd(path, voxels, spacing=1.0):
    kind = {"uint8": "uint8", "int16": "int16"}[voxels.dtype.name]
    head = (f"NRRD0004\ntype: {kind}\ndimension: 3\nspace: left-posterior-superior\nsizes: {' '.join(map(str, voxels.shape[::-1]))}\n"
            f"space directions: ({spacing},0,0) (0,{spacing},0) (0,0,{spacing})\nkinds: domain domain domain\nendian: little\nencoding: raw\n"
            f"space origin: (0,0,0)\n\n")
    path.write_bytes(head.encode() + voxels.tobytes())
    return path


class BarTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = pathlib.Path(tempfile.mkdtemp())
        cls.addClassCleanup(shutil.rmtree, cls.folder)
        labels = np.zeros((16, 17, 64), np.uint8)
        labels[2:14, 2:15, 2:62] = 3
        labels[6:9, 6:9, 4:60] = 7
        cls.bar = write_nrrd(cls.folder / "bar.nrrd", labels)
        cls.voxels = labels
        cls.rig = cls.folder / "arm.yaml"
        cls.rig.write_text(ARM)
        cls.pose = cls.folder / "bent.yaml"
        cls.pose.write_text(BENT)
        cls.all = cls.folder / "all.vtp"
        cls.few = cls.folder / "few.vtp"
        cls.loose = cls.folder / "loose.vtp"
        for out, words in ((cls.all, ("--tp", -2, "--tree", "--skeleton", cls.rig)), (cls.few, ("--tp", 0.3, "--tree", "--skeleton", cls.rig)), (cls.loose, ("--tp", 0.3))):
            done = run("thin", cls.bar, "-o", out, *words)
            assert done.returncode == 0, done.stderr

    def ok(self, *words):
        done = run("--json", *words)
        self.assertEqual(done.returncode, 0, done.stderr)
        return json.loads(done.stdout)

    def read(self, path):
        return bodies.read_placed_image(path)

    def assert_error(self, code, words, *parts):
        done = run(*words)
        self.assertEqual(done.returncode, code, done.stderr)
        self.assertRegex(done.stderr, ERROR_LINE)
        for part in parts:
            self.assertIn(part, done.stderr)
