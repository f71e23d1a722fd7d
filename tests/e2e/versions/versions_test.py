#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Versions (docs/reference/versions.md): each is the same wherever it stands, and what an older one wrote still works. Frames of the first day
are held by tests/unit/server/versions_test.cpp and tests/unit/proto.

usage: versions_test.py WRITE_TOY_MODEL; the environment is that of the fixtures
"""
import gzip
import json
import os
import pathlib
import re
import subprocess
import sys
import tempfile
import unittest

import h5py
import numpy

ROOT = pathlib.Path(__file__).resolve().parents[3]
WRITE_TOY_MODEL, ECORCHE = sys.argv[1], os.environ["ECORCHE_BIN"]
# The toy body, by the last programs that wrote 1.1, 1.2 and 1.3, the last one with a correction; never made again.
GOLDEN = ROOT / "tests" / "fixtures" / "golden"
# What more the models of some minors have.
CORRECTED = {"toy_1_3.hdf.gz": ["corrected_by_joints"], "toy_1_4.hdf.gz": ["corrected_by_joints"], "toy_1_5.hdf.gz": ["corrected"]}
POSE = """ecorche_pose: 1
skeleton: toy
joints:
  middle_joint: {flexion_deg: 70}
  tip_joint: {flexion_deg: -20, tilt_deg: 10}
"""


def found(path, pattern):
    """What the pattern's group holds, in the only place where it matches."""
    matches = re.findall(pattern, (ROOT / path).read_text(encoding="utf-8"), re.M)
    assert len(matches) == 1, f"{path}: {pattern} is found {len(matches)} times"
    return matches[0]


def stated(row):
    """What docs/reference/versions.md says is the version of this now."""
    return found("docs/reference/versions.md", rf"^\| {row} \| `([^`]+)` \|")


class Versions(unittest.TestCase):
    def test_the_tools_is_one(self):
        tool = found("CMakeLists.txt", r"^project\(ecorche VERSION (\S+)")
        self.assertRegex(tool, r"^\d+\.\d+\.\d+$")
        self.assertEqual(subprocess.run([ECORCHE, "--version"], capture_output=True, text=True, check=True).stdout.strip(), tool)
        self.assertEqual(found("clients/python/pyproject.toml", r'^version = "(.+)"$'), tool)
        self.assertEqual(found("CITATION.cff", r"^version: (.+)$"), tool)
        self.assertEqual(stated("tool"), tool)
        changes = re.findall(r"^## (.+)$", (ROOT / "CHANGELOG.md").read_text(encoding="utf-8"), re.M)
        self.assertEqual(changes[0], "Unreleased")
        self.assertEqual(changes[1].split()[0], tool)

    def test_the_abis_is_one(self):
        abi = found("clients/c/include/ecorche/ecorche.h", r"^#define ECORCHE_ABI_VERSION (\d+)$")
        self.assertEqual(found("clients/c/CMakeLists.txt", r"SOVERSION (\d+)"), abi)
        self.assertEqual(found("clients/python/src/ecorche/_library.py", r"^ABI_VERSION = (\d+)$"), abi)
        for name in ("ecorche", "ecorche_client"):
            self.assertEqual(found(f"clients/c/{name}.map", rf"^{name.upper()}_(\d+) \{{$"), abi)
            self.assertIn(f'"lib{name}.so.{abi}"', (ROOT / "clients/python/src/ecorche/_library.py").read_text())
        self.assertEqual(stated("ABI"), abi)

    def test_the_others_are_as_stated(self):
        self.assertEqual(stated("protocol"), found("runtime/server/handlers/hello.cpp", r"kProtocol = (\d+);"))
        header = "core/include/ecorche/model_file/model_file.hpp"
        major, minor = (found(header, rf"format_{part} = (\d+);") for part in ("major", "minor"))
        self.assertEqual(stated("model format"), f"{major}.{minor}")
        self.assertIn(f"`[{major}, {minor}]`", (ROOT / "docs/reference/model.md").read_text())
        # This test goes with the version: whoever raises the minor puts a model of the one before beside it.
        self.assertTrue((GOLDEN / f"toy_{major}_{int(minor) - 1}.hdf.gz").exists())

    def test_models_of_the_minors_before_are_posed_as_todays(self):
        for golden in sorted(GOLDEN.glob("*.hdf.gz")):
            with self.subTest(golden.name):
                self.pose_beside_todays(golden)

    def pose_beside_todays(self, golden):
        with tempfile.TemporaryDirectory() as name:
            folder = pathlib.Path(name)
            (folder / "before.hdf").write_bytes(gzip.decompress(golden.read_bytes()))
            words = CORRECTED.get(golden.name, [])
            subprocess.run([WRITE_TOY_MODEL, folder / "today.hdf", *words], check=True)
            (folder / "bent.yaml").write_text(POSE)
            surfaces = {}
            for model in ("before", "today"):
                said = {}
                for words in (["info"], ["pose"]):
                    more = ["-o", folder / model, "--pose", folder / "bent.yaml"] if words == ["pose"] else []
                    done = subprocess.run([ECORCHE, *words, folder / f"{model}.hdf", *more, "--json"], capture_output=True, text=True)
                    self.assertEqual(done.returncode, 0, done.stderr)
                    said[words[0]] = json.loads(done.stdout)
                self.assertEqual(said["info"]["bones"], 3)
                # What was not measured then is not told as if it had been.
                self.assertEqual(said["info"]["certificate"]["least_bone_share"] is None, model == "before" and golden.name == "toy_1_1.hdf.gz")
                surfaces[model] = {path.name: path.read_bytes() for path in sorted((folder / model).rglob("*.stl"))}
            self.assertGreaterEqual(len(surfaces["today"]), 5)
            self.assertEqual(surfaces["before"].keys(), surfaces["today"].keys())
            for surface, content in surfaces["today"].items():
                self.assertEqual(surfaces["before"][surface], content, surface)

    def test_a_model_has_the_lowest_minor_that_says_all_of_it(self):
        with tempfile.TemporaryDirectory() as name:
            for words, minor in (([], 3), (["corrected_by_joints"], 6), (["corrected"], 6)):
                model = pathlib.Path(name, "toy.hdf")
                subprocess.run([WRITE_TOY_MODEL, model, *words], check=True)
                with h5py.File(model, "r") as file:
                    self.assertEqual(list(file["ecorche"].attrs["format"]), [1, minor])
                    self.assertEqual("materials" in file["ecorche"], minor >= 4)
                    self.assertEqual("packed_pose_correction" in file["ecorche"], "corrected" in words)

    def test_another_major_is_refused(self):
        with tempfile.TemporaryDirectory() as name:
            model = pathlib.Path(name, "later.hdf")
            model.write_bytes(gzip.decompress((GOLDEN / "toy_1_2.hdf.gz").read_bytes()))
            with h5py.File(model, "r+") as file:
                file["ecorche"].attrs["format"] = numpy.array([2, 1], numpy.int32)
            done = subprocess.run([ECORCHE, "info", model], capture_output=True, text=True)
            self.assertEqual(done.returncode, 65, done.stderr)
            self.assertRegex(done.stderr, r"is version 2\.1, this program reads 1\.x")


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1])
