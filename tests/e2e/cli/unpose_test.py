#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""`ecorche unpose`: posed files, and nothing else, come back to the scan."""
import argparse
import gzip
import importlib.machinery
import importlib.util
import json
import pathlib
import re
import shutil
import sys
import tempfile
import unittest

import numpy as np

from posed_files import CASE, ECORCHE, MODEL, corners, run

BENCH = pathlib.Path(__file__).resolve().parents[3] / "bench"
sys.path.insert(0, str(BENCH))
import stated_poses  # noqa: E402
import voxels  # noqa: E402

LOADER = importlib.machinery.SourceFileLoader("unpose", str(BENCH / "unpose" / "run"))
unpose = importlib.util.module_from_spec(importlib.util.spec_from_loader("unpose", LOADER))
LOADER.exec_module(unpose)
unpose.programs.ECORCHE = ECORCHE

AWAY = "ecorche_pose: 1\nskeleton: phantom\nroot: {translation_mm: [40, -3, 7], rotation: [0.9, 0.1, 0.3, 0.3]}\n" \
       "joints:\n  knee_right: {flexion_deg: 50}\n  hip_right: {flexion_deg: 30}\n  elbow_left: {flexion_deg: 60}\n"


def image(path):
    """Values [k, j, i] and origin of one of our NRRDs on cubic voxels, and the edge of a voxel."""
    head, body = path.read_bytes().split(b"\n\n", 1)
    field = dict(line.split(": ", 1) for line in head.decode().splitlines() if ": " in line and line[0] != "#")
    size = [int(n) for n in field["sizes"].split()]
    kind = {"unsigned char": "u1", "short": "<i2"}[field["type"]]
    origin = np.array([float(x) for x in field["space origin"].strip("()").split(",")])
    return np.frombuffer(gzip.decompress(body), kind).reshape(size[::-1]), origin, float(field["space directions"].split(",")[0][1:])


class Unpose(unittest.TestCase):
    def setUp(self):
        self.folder = pathlib.Path(tempfile.mkdtemp())
        self.addCleanup(shutil.rmtree, self.folder)
        (self.folder / "away.yaml").write_text(AWAY)

    def ok(self, *words):
        result = run(*words)
        self.assertEqual(result.returncode, 0, result.stderr)
        return result

    def assert_error(self, result, code, *parts):
        self.assertEqual(result.returncode, code, result.stderr)
        self.assertRegex(result.stderr, re.compile(r"^error: .+: .+ \(.+\)$", re.M))
        for part in parts:
            self.assertIn(part, result.stderr)

    def pose(self, *more):
        self.ok("pose", MODEL, "-o", self.folder / "posed", "--pose", self.folder / "away.yaml", *more)
        return self.folder / "posed"

    def labels_that_differ(self, back):
        rest, at, edge = image(CASE / "volumes/labels.nrrd")
        again, origin, _ = image(back)
        low = np.rint((origin - at) / edge).astype(int)[::-1]
        whole = np.zeros_like(rest)
        whole[tuple(slice(a, a + n) for a, n in zip(low, again.shape))] = again
        return ((whole != rest) & (rest != 0)).sum() / (rest != 0).sum()

    def test_a_posed_folder_comes_back(self):
        posed, back = self.pose("--tissues", "all", "--volumes", "all", "--field"), self.folder / "back"
        out = json.loads(self.ok("--json", "unpose", posed, "-o", back).stdout)
        self.assertTrue(out["ok"])
        self.assertLess(out["round_trip"]["soft"]["mean_mm"], 0.05)
        for row in out["round_trip"]["images"]:
            self.assertLess(row["elsewhere_share"], 0.05)  # most of them voxels of the skin, half outside
        self.assertFalse((back / "displacement.nrrd").exists(), "a field lies in no body")
        self.assertEqual(len(out["files"]), len(list(back.iterdir())))
        self.assertLess(np.abs(corners(CASE / "tissues/liver.stl") - corners(back / "liver.stl")).max(), 0.01)
        self.assertGreater(np.abs(corners(CASE / "tissues/liver.stl") - corners(posed / "liver.stl")).max(), 40)
        # 6 mm voxels, three quarters of them on a boundary, sampled twice.
        self.assertLess(self.labels_that_differ(back / "labels.nrrd"), 0.06)
        self.assertEqual(image(back / "ct.nrrd")[0].min(), -1024, "what lies outside the body stays outside")

    def test_a_posed_case_comes_back(self):
        back = self.folder / "back"
        self.ok("unpose", self.pose("--as-case"), "-o", back)
        for bone in ("femur_right", "tibia_right"):  # they went rigidly, and so they come back
            self.assertLess(np.abs(corners(CASE / f"bones/{bone}.stl") - corners(back / f"bones/{bone}.stl")).max(), 0.01)
        self.assertLess(self.labels_that_differ(back / "volumes/labels.nrrd"), 0.06)

    def test_unfolding_leaves_less_inverted_and_comes_back(self):
        (self.folder / "away.yaml").write_text("ecorche_pose: 1\nskeleton: phantom\njoints:\n  knee_right: {flexion_deg: 110}\n")
        found = {}
        for name, words in (("skinned", ()), ("unfolded", ("--unfold",))):
            quality = json.loads((self.pose("--tets", "--tissues", "skin", *words) / "quality.json").read_text())
            trip = json.loads(self.ok("--json", "unpose", self.folder / "posed", "-o", self.folder / name).stdout)["round_trip"]
            found[name] = quality, trip
        (before, there), (after, again) = found["skinned"], found["unfolded"]
        self.assertNotIn("unfolded", before)
        self.assertEqual(after["unfolded"]["inverted_tets_before"], before["inverted_tets"] + before["joint_gaps"]["inverted_tets"])
        self.assertGreater(before["inverted_tets"], 20)
        self.assertLess(after["inverted_rest_mm3"], 0.5 * before["inverted_rest_mm3"])
        # Of the skin's vertices fewer hang on tets that are inside out.
        self.assertLess(again["soft"]["folded"], there["soft"]["folded"])
        self.assertLess(again["soft"]["mean_mm"], 0.05)
        self.assertEqual(after["bone_rigidity_mm"], before["bone_rigidity_mm"])

    def test_what_is_drawn_on_the_posed_body_comes_back(self):
        posed = self.pose("--tissues", "liver", "--format", "ply", "--volumes", "ct", "--volume-format", "mha", "--tets")
        drawn = self.folder / "target.ply"
        shutil.copy(posed / "liver.ply", drawn)
        self.ok("unpose", posed / "body.vtu", drawn, posed / "ct.mha", "-o", self.folder / "back", "--labels", "ct")
        self.assertEqual(sorted(path.name for path in (self.folder / "back").iterdir()), ["ct.mha", "folds-mask.nrrd", "target.ply"])

    def test_refusals(self):
        posed, back = self.pose("--tissues", "liver", "--tets"), self.folder / "back"
        self.assert_error(run("unpose", self.folder, "-o", back), 66, "body.vtu", "is not there, and the way back is in it")
        self.assert_error(run("unpose", posed, posed / "quality.json", "-o", back), 64, "quality.json", "neither a surface nor an image")
        self.assert_error(run("unpose", posed, self.folder / "none.stl", "-o", back), 66, "none.stl")
        self.assert_error(run("unpose", posed, "-o", back, "--sampling", "cubic"), 64, "cubic")
        rest = self.folder / "rest.vtu"
        self.ok("export", MODEL, "-o", rest)
        self.assert_error(run("unpose", rest, "-o", back), 65, "carry no displacement", "give the body.vtu that ecorche pose wrote")
        # The displacement of other tets: as many nodes, other places.
        data = bytearray((posed / "body.vtu").read_bytes())
        offset = int(re.search(rb'Name="displacement"[^>]*offset="(\d+)"', bytes(data)).group(1))
        at = data.index(b"_", data.index(b"<AppendedData")) + 1 + offset + 8
        count = int.from_bytes(data[at - 8:at], "little") // 4
        data[at:at + 4 * count] = np.random.default_rng(1).normal(0, 50, count).astype("<f4").tobytes()
        (self.folder / "other.vtu").write_bytes(data)
        self.assert_error(run("unpose", self.folder / "other.vtu", "-o", back), 65, "have no volume at rest")
        self.assertFalse(back.exists() and list(back.iterdir()))


class Bench(unittest.TestCase):
    """A small piece of bench/unpose: one pose, one turn of the whole."""

    def test_what_does_not_come_back_is_counted(self):
        folder = pathlib.Path(tempfile.mkdtemp())
        self.addCleanup(shutil.rmtree, folder)
        stated_poses.write(MODEL, folder, 1)
        (folder / "rest.yaml").write_text("".join((folder / "rigid_01.yaml").read_text().splitlines(True)[:3]))
        volumes = [row for row in unpose.run("info", MODEL)["volumes"] if row["name"] in ("labels", "ct_noisy")]
        by = unpose.Tets(MODEL, folder / "work", volumes)
        options = argparse.Namespace(neighbours=26, boundary="labels", show="joint_01")
        rows, shown = unpose.measure(by, ["joint_01", "rigid_01"], folder, options)
        mean = unpose.means({"tets": (rows, len(by.columns))}, [row["name"] for row in volumes], ["joint_01"], ["rigid_01"])
        for what, most in (("tets", 1), ("tets floor", 6)):
            labels, noisy = mean[what]["labels"], mean[what]["ct_noisy"]
            self.assertGreater(labels[0], 0)
            self.assertLess(labels[0], most)  # of a shank and a foot that turn, and of the whole body
            self.assertLess(labels[1], 0.1)
            self.assertGreater(noisy[0], 2 * labels[0])
        codes = shown["labels"][0]
        self.assertAlmostEqual(100 * (codes > 1).sum() / (codes > 0).sum(), mean["tets"]["labels"][0])
        self.assertAlmostEqual(100 * (codes == 3).sum() / (codes > 0).sum(), mean["tets"]["labels"][1])


class Boundary(unittest.TestCase):
    """bench/voxels.py, by which the benches say what lies off a boundary."""

    def test_what_lies_off_a_boundary(self):
        coarse = np.random.default_rng(1).integers(0, 3, (5, 4, 4))
        labels = coarse.repeat(3, axis=0).repeat(3, axis=1).repeat(3, axis=2)
        for neighbours, most in ((6, 1), (26, 3)):
            for of, asked in (("labels", labels), ("object", (labels != 0).astype(int))):
                padded, deep = np.pad(asked, 1), labels != 0
                for step in np.ndindex(3, 3, 3):
                    if sum(abs(s - 1) for s in step) <= most:
                        deep = deep & (padded[tuple(slice(s, s + n) for s, n in zip(step, labels.shape))] == asked)
                self.assertGreater(deep.sum(), 0)
                self.assertTrue((voxels.off_boundary(labels, neighbours, of) == deep).all(), (neighbours, of))

    def test_pieces_of_one_lattice(self):
        values = np.arange(60).reshape(3, 4, 5)
        whole = voxels.Volume(values, np.array([2.0, 4, 6]), np.array([1.0, -2, 3]))
        piece = voxels.Volume(values[1:, :3, 2:].copy(), np.array([4.0, 4, 9]), whole.spacing)
        piece.values[0, 1, 1] = -1
        same = np.zeros(values.shape, bool)
        same[1:, :3, 2:] = True
        same[1, 1, 3] = False
        self.assertTrue((voxels.same_on_grid_of(whole, piece) == same).all())


if __name__ == "__main__":
    unittest.main()
