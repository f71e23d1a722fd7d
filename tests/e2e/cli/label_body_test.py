#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""A body that is a label map alone: its surfaces against its voxels (bench/label_surfaces), and posed as a case it is a case again."""
import importlib.machinery
import importlib.util
import json
import pathlib
import shutil
import tempfile
import unittest

import numpy as np
import yaml

from posed_files import CASE, corners, run

BENCH = pathlib.Path(__file__).resolve().parents[3] / "bench" / "label_surfaces" / "run"
LOADER = importlib.machinery.SourceFileLoader("label_surfaces", str(BENCH))
label_surfaces = importlib.util.module_from_spec(importlib.util.spec_from_loader("label_surfaces", LOADER))
LOADER.exec_module(label_surfaces)
label_surfaces.MOST_POINTS = 2000

AWAY = {"knee_right": 80, "hip_right": 60}
POSE = "ecorche_pose: 1\nskeleton: phantom\n"


def label_case(folder):
    """The phantom's label map as a case: every bone one label, both femora one with sides, the rest tissues."""
    case = yaml.safe_load((CASE / "case.yaml").read_text())
    table = case["labels"]["table"]
    names = set(table.values())
    # A second name for both femora, so that a side parts them.
    for label, name in list(table.items()):
        if name in ("femur_left", "femur_right"):
            table[label] = "femora"
    for bone in case["bones"]:
        del bone["file"]
        side = bone["name"].removeprefix("femur_") if bone["name"].startswith("femur_") else None
        bone["labels"] = ["femora"] if side else [bone["name"]]
        if side:
            bone["side"] = side
    case["bones"] = [bone for bone in case["bones"] if bone["name"] in names]
    case["tissues"] = [{"labels": "rest", "group": "muscle"}]
    case["skin"] = {"labels": "all"}
    for unused in ("volumes", "regions"):
        case.pop(unused, None)
    folder.mkdir()
    shutil.copytree(CASE / "volumes", folder / "volumes")
    shutil.copy(CASE / "skeleton.yaml", folder)
    (folder / "case.yaml").write_text(yaml.safe_dump(case, sort_keys=False))
    return folder


class LabelBody(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = pathlib.Path(tempfile.mkdtemp())
        cls.addClassCleanup(shutil.rmtree, cls.folder)
        cls.case = label_case(cls.folder / "case")
        cls.model = cls.folder / "labels.hdf"
        result = run("preprocess", cls.case, "-o", cls.model, "--mesher", "lattice", "--max-tets", "100000", "--check")
        assert result.returncode == 0, result.stderr

    def ok(self, *words):
        result = run(*words)
        self.assertEqual(result.returncode, 0, result.stderr)
        return json.loads(result.stdout) if words[0] == "--json" else None

    def pose(self, name, angles):
        file = self.folder / f"{name}.yaml"
        file.write_text(POSE + ("joints:\n" if angles else "") + "".join(f"  {joint}: {{flexion_deg: {angle:.9g}}}\n" for joint, angle in angles.items()))
        return file

    def test_surfaces_keep_to_their_voxels(self):
        self.assertEqual(label_surfaces.measure(self.model, self.case, None, label_surfaces.head()), [])

    def test_what_leaves_its_voxels_is_seen(self):
        case = self.folder / "other"
        case.mkdir()
        text = (self.case / "case.yaml").read_text()
        self.assertIn("- femora\n  side: left", text)
        (case / "case.yaml").write_text(text.replace("- femora\n  side: left", "- tibia_left", 1))
        wrong = label_surfaces.measure(self.model, case, None, label_surfaces.head(), only=["femur_left", "tibia_right"])
        self.assertEqual([line.split(" lies")[0] for line in wrong], ["other: femur_left"] * 2)

    def test_open_edges_are_counted(self):
        tetrahedron = np.array([[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]])
        self.assertEqual(label_surfaces.open_edges(tetrahedron), 0)
        self.assertEqual(label_surfaces.open_edges(tetrahedron[1:]), 6)  # each of three, both ways
        self.assertGreater(label_surfaces.open_edges(np.vstack([tetrahedron[:3], tetrahedron[3:, ::-1]])), 0)

    def test_distances_of_one_voxel(self):
        mask = np.zeros((5, 5, 5), bool)
        mask[2, 2, 2] = True
        points = np.array([[2, 2, 2.5], [2, 2, 2], [2.9, 2.8, 2], [2, 2, 4.4]])
        self.assertTrue(np.allclose(label_surfaces.to_faces(points, mask), [0, 0.5, 0.5, 9]))
        self.assertEqual(len(label_surfaces.face_middles(mask)), 6)

    def test_posed_as_a_case_it_is_one(self):
        posed, back, rest = (self.folder / name for name in ("posed", "back", "rest"))
        self.ok("pose", self.model, "-o", posed, "--pose", self.pose("away", AWAY), "--as-case")
        self.assertTrue((posed / "body.vtu").is_file())
        again = self.folder / "again.hdf"
        self.ok("check", posed)
        self.ok("preprocess", posed, "-o", again, "--mesher", "lattice", "--max-tets", "100000", "--check")
        self.ok("verify", again)
        info, before = self.ok("--json", "info", again), self.ok("--json", "info", self.model)
        self.assertEqual([row["name"] for row in info["volumes"]], ["labels"])
        self.assertEqual(len(info["rig"]), len(before["rig"]))
        angles = {row["joint"]: angle["rest_deg"] for row in before["rig"] for angle in row["angles"] if row["joint"] in AWAY and angle["name"] == "flexion"}
        self.ok("pose", self.model, "-o", rest, "--pose", self.pose("rest", {}), "--tissues", "all")
        self.ok("pose", again, "-o", back, "--pose", self.pose("back", angles), "--tissues", "all")
        for bone in ("tibia_right", "femur_right", "femur_left", "skull"):
            self.assertLess(np.abs(corners(rest / f"{bone}.stl") - corners(back / f"{bone}.stl")).max(), 5e-3, bone)
        self.assertGreater(np.abs(corners(rest / "tibia_right.stl") - corners(posed / "bones/tibia_right.stl")).max(), 100)


if __name__ == "__main__":
    unittest.main()
