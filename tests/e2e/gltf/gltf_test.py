#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""A rig and its motion out and back: the Khronos validator, three.js and ecorche itself read what `ecorche export` writes."""
import json
import os
import pathlib
import shutil
import subprocess
import tempfile
import unittest

ECORCHE = os.environ["ECORCHE_BIN"]
MODEL = pathlib.Path(os.environ["ECORCHE_MODEL"])
WALK = pathlib.Path(os.environ["ECORCHE_CASE"]) / "motion" / "walk.bvh"
CHECK = pathlib.Path(__file__).with_name("check_glb.mjs")
FRAME = 20


def run(*words):
    result = subprocess.run([ECORCHE, *map(str, words), "--json"], capture_output=True, text=True, timeout=120)
    if result.returncode != 0:
        raise AssertionError(result.stderr)
    return json.loads(result.stdout)


def vertices(path):
    return [tuple(map(float, line.split()[1:4])) for line in path.read_text().splitlines() if line.startswith("v ")]


def farthest(a, b):
    assert len(a) == len(b), (len(a), len(b))
    return max(sum((x - y) ** 2 for x, y in zip(p, q)) ** 0.5 for p, q in zip(a, b))


class Gltf(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = pathlib.Path(tempfile.mkdtemp())
        cls.addClassCleanup(shutil.rmtree, cls.folder)
        if not (CHECK.parent / "node_modules").exists():
            raise AssertionError("no node_modules beside check_glb.mjs: run scripts/setup --tests")
        cls.glb, cls.bvh = cls.folder / "walk.glb", cls.folder / "walk.bvh"
        cls.said = run("export", MODEL, "-o", cls.glb, cls.bvh, "--motion", WALK)["rigs"]

    def elsewhere(self, file, frame):
        seconds = str(frame / 30)
        result = subprocess.run(["node", CHECK, file, seconds], capture_output=True, text=True, timeout=120)
        self.assertEqual(result.returncode, 0, result.stderr)
        return json.loads(result.stdout)

    def test_validator_finds_nothing(self):
        for file in (self.glb, self.folder / "rest.glb"):
            if not file.exists():
                run("export", MODEL, "-o", file, "--tissues", "skin")
            issues = self.elsewhere(file, 0)["issues"]
            self.assertEqual([issues[kind] for kind in ("numErrors", "numWarnings", "numInfos", "numHints")], [0, 0, 0, 0],
                             issues["messages"])

    def test_three_puts_the_vertices_where_we_do(self):
        run("pose", MODEL, "-o", self.folder / "posed", "--motion", WALK, "--frames", FRAME, "--skinning", "lbs", "--format", "obj",
            "--tissues", "all")
        read = self.elsewhere(self.glb, FRAME)
        self.assertEqual(len(read["animations"]), 1)
        info = run("info", MODEL)
        names = [tissue["name"] for tissue in info["tissues"]]
        joints = {row["joint"] for row in info["rig"]}  # whose names no mesh takes
        shown = {name: f"{name}_bone" if name in joints else name for name in names}
        self.assertIn("pelvis_bone", shown.values())
        self.assertEqual(sorted(read["meshes"]), sorted(shown.values()))
        bones = {tissue["name"] for tissue in run("info", MODEL)["tissues"] if tissue["segment"]}
        cut = self.said[0]["truncation_mm"]
        for name in names:
            apart = farthest(read["meshes"][shown[name]], vertices(self.folder / "posed" / f"{name}.obj"))
            # Bones have one influence: nothing is cut there. Elsewhere the printed error is the bound (frame 20 is measured).
            self.assertLess(apart, 0.1 if name in bones else cut["worst"] + 0.1, name)
        print(f"four influences: {cut}")

    def test_a_posed_tissue_has_its_name_and_its_look(self):
        folder = self.folder / "still"
        run("pose", MODEL, "-o", folder, "--pose", "lib:anatomical", "--format", "glb,obj", "--tissues", "all")
        exported = self.elsewhere(self.glb, 0)["materials"]
        tissues = {tissue["name"]: tissue["group"] for tissue in run("info", MODEL)["tissues"]}
        one_of_each = {group: name for name, group in tissues.items()}
        self.assertGreaterEqual(set(one_of_each), {"skin", "bone", "muscle", "organ"})
        for group, name in one_of_each.items():
            read = self.elsewhere(folder / f"{name}.glb", 0)
            self.assertEqual([read["issues"][kind] for kind in ("numErrors", "numWarnings", "numInfos", "numHints")], [0, 0, 0, 0], name)
            self.assertEqual(read["nodes"], [name])
            self.assertLess(farthest(read["meshes"][name], vertices(folder / f"{name}.obj")), 1e-3, name)
            self.assertEqual(read["materials"][name], exported[name], "as export colours it")
            self.assertEqual(read["materials"][name]["transparent"], group == "skin", "skin hides nothing")
        self.assertEqual(len(list(folder.glob("*.glb"))), len(tissues))

    def test_the_motion_comes_back(self):
        for file in (self.glb, self.bvh):
            back = run("motion", file, "--model", MODEL, "--against", self.bvh)
            self.assertEqual(back["frames"], 72)
            self.assertLess(max(joint["worst_deg"] for joint in back["differences"]), 0.01, file)
            self.assertAlmostEqual(back["match"]["figure_to_patient"], 1, places=4)
            self.assertEqual(back["beyond_limits"], [])
        for file in (self.glb, self.bvh):
            run("pose", MODEL, "-o", self.folder / file.suffix[1:], "--motion", file, "--frames", FRAME, "--format", "obj", "--tissues", "skin")
        run("pose", MODEL, "-o", self.folder / "source", "--motion", WALK, "--frames", FRAME, "--format", "obj", "--tissues", "skin")
        source = vertices(self.folder / "source" / "skin.obj")
        for kind in ("glb", "bvh"):
            self.assertLess(farthest(vertices(self.folder / kind / "skin.obj"), source), 0.1, kind)

    def test_refusals(self):
        out = self.folder / "a.glb"
        result = subprocess.run([ECORCHE, "export", MODEL, "-o", out, "--tissues", "wing"], capture_output=True, text=True)
        self.assertEqual(result.returncode, 64, result.stderr)
        self.assertIn("the model has no 'wing'", result.stderr)
        self.assertFalse(out.exists())


if __name__ == "__main__":
    unittest.main()
