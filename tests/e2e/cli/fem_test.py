#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""A pose by finite elements, through the command: what it writes, what it says, what it refuses."""
import json
import pathlib
import re
import shutil
import tempfile
import unittest

import numpy as np

from posed_files import CASE, corners, run

HEAD = "ecorche_pose: 1\nskeleton: phantom\n"


class Fem(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = pathlib.Path(tempfile.mkdtemp())
        cls.addClassCleanup(shutil.rmtree, cls.folder)
        cls.model = cls.folder / "coarse.hdf"
        done = run("preprocess", CASE, "-o", cls.model, "--mesher", "lattice", "--max-tets", 40000)
        assert done.returncode == 0, done.stderr

    def solve(self, name, pose, *words, command=("fem",), code=0, model=None):
        file = self.folder / f"{name}.yaml"
        file.write_text(HEAD + pose)
        out = self.folder / name
        done = run(*command, model or self.model, "-o", out, "--pose", file, "--tissues", "skin,humerus_right,femur_right", *words)
        self.assertEqual(done.returncode, code, done.stderr)
        return out, done

    def test_an_elbow_is_solved_and_reported(self):
        out, done = self.solve("elbow", "root: {translation_mm: [300, 20, -10], rotation: [0.9, 0.1, 0.3, 0.3]}\njoints: {elbow_right: {flexion_deg: 45}}\n")
        fem = json.loads((out / "fem.json").read_text())
        quality = json.loads((out / "quality.json").read_text())
        self.assertEqual(quality["fem"], fem)
        self.assertEqual((fem["verdict"], fem["warnings"]), ("pass", []))
        self.assertTrue(fem["converged"])
        self.assertEqual(fem["inverted_tets"], 0)
        self.assertLess(fem["two_starts"]["distance_mm"], 0.1)
        self.assertLess(fem["residual"], 1e-3)
        self.assertLess(abs(fem["volume_change"]), 0.01)
        left_out = fem["left_out"]
        self.assertEqual(fem["tets"] + left_out["on_bones"] + left_out["between_bones"] + left_out["floating"], left_out["of_soft_tets"])
        self.assertGreater(left_out["between_bones"], 0)
        self.assertGreater(fem["to_cor"]["max_mm"], fem["to_cor"]["p95_mm"])
        self.assertRegex(done.stdout, r"  finite elements: pass, p1 at 0\.45, \d+ tets, \d+ iterations, ")
        # The surfaces are those of the solution: as far from skinning's as it says, and bones where they were.
        skinned, _ = self.solve("skinned", (self.folder / "elbow.yaml").read_text()[len(HEAD):], command=("pose",))
        apart = {name: np.linalg.norm(corners(out / f"{name}.stl") - corners(skinned / f"{name}.stl"), axis=-1).max()
                 for name in ("skin", "humerus_right", "femur_right")}
        self.assertGreater(apart["skin"], 1)
        self.assertLess(apart["skin"], 1.5 * fem["to_cor"]["max_mm"])
        self.assertEqual((apart["humerus_right"], apart["femur_right"]), (0, 0))

    def test_pose_by_fem_is_the_same_body(self):
        pose = "joints: {elbow_right: {flexion_deg: 30}}\n"
        fem, _ = self.solve("by_fem", pose)
        pose_fem, _ = self.solve("by_pose", pose, "--skinning", "fem", command=("pose",))
        self.assertEqual((fem / "skin.stl").read_bytes(), (pose_fem / "skin.stl").read_bytes())
        self.assertIn('"skinning": "fem"', (pose_fem / "posed.json").read_text())

    def test_a_knee_is_free_of_inversions(self):
        """Bones that pass one another turn tets between them inside out; flesh beside those is not dragged along."""
        out, _ = self.solve("knee", "joints: {knee_right: {flexion_deg: 60}}\n", "--one-start")
        fem = json.loads((out / "fem.json").read_text())
        self.assertTrue(fem["converged"])
        self.assertEqual(fem["inverted_tets"], 0)

    def test_a_settled_body_is_near_to_it_and_measured_as_such(self):
        pose = "root: {translation_mm: [300, 20, -10], rotation: [0.9, 0.1, 0.3, 0.3]}\njoints: {elbow_right: {flexion_deg: 45}, knee_right: {flexion_deg: 40}}\n"
        fem, _ = self.solve("settle_fem", pose, "--one-start")
        skinned, _ = self.solve("settle_cor", pose, command=("pose",))
        settled, done = self.solve("settled", pose, "--settle", "--tets", command=("pose",))
        self.assertRegex(done.stdout, r"  settled: \d+ steps, energy \d+ to \d+ mm\^3, nodes moved by up to \d+\.\d mm\n")
        apart = {name: np.linalg.norm(corners(folder / "skin.stl") - corners(fem / "skin.stl"), axis=-1)
                 for name, folder in (("skinned", skinned), ("settled", settled))}
        self.assertGreater(apart["skinned"].max(), 2)
        self.assertLess(np.sqrt((apart["settled"] ** 2).mean()), 0.1 * np.sqrt((apart["skinned"] ** 2).mean()))
        for bone in ("humerus_right", "femur_right"):
            self.assertEqual((settled / f"{bone}.stl").read_bytes(), (skinned / f"{bone}.stl").read_bytes())
        quality = json.loads((settled / "quality.json").read_text())
        self.assertLess(quality["settled"]["energy_after_mm3"], 0.8 * quality["settled"]["energy_before_mm3"])
        self.assertGreater(quality["settled"]["largest_move_mm"], 2)
        self.assertTrue(json.loads((settled / "posed.json").read_text())["settled"])
        # What was measured is what was written.
        skin = corners(settled / "skin.stl")
        volume = np.einsum("ij,ij->i", skin[:, 0] - skin[0, 0], np.cross(skin[:, 1] - skin[0, 0], skin[:, 2] - skin[0, 0])).sum() / 6
        row = next(tissue for tissue in quality["tissues"] if tissue["name"] == "skin")
        self.assertLess(abs(volume / row["posed_mm3"] - 1), 1e-4)
        self.assertEqual(quality["inverted_tets"], 0)
        self.assertNotIn("settled", json.loads((skinned / "quality.json").read_text()))

    def test_volumes_are_of_the_settled_body(self):
        file = self.folder / "bent.yaml"
        file.write_text(HEAD + "joints: {elbow_right: {flexion_deg: 60}}\n")
        made = {}
        for words in ((), ("--settle",)):
            out = self.folder / f"volumes{len(words)}"
            done = run("pose", self.model, "-o", out, "--pose", file, "--volumes", "labels", "--grid", "rest", *words)
            self.assertEqual(done.returncode, 0, done.stderr)
            made[len(words)] = (out / "labels.nrrd").read_bytes()
        self.assertNotEqual(made[0], made[1])

    def test_stiffer_muscles_bend_another_way(self):
        case = self.folder / "stiff"
        shutil.copytree(CASE, case)
        text = (case / "case.yaml").read_text()
        row = re.search(r".*name: biceps\w*_right,.*group: muscle\}", text)
        text = text.replace(row.group(), row.group()[:-1] + ", stiffness_kpa: 200}") + "stiffness_kpa: 5\n"
        (case / "case.yaml").write_text(text)
        model = self.folder / "stiff.hdf"
        done = run("preprocess", case, "-o", model, "--mesher", "lattice", "--max-tets", 40000)
        self.assertEqual(done.returncode, 0, done.stderr)
        info = json.loads(run("info", model, "--json").stdout)["materials"]
        muscle = re.search(r"name: (\w+)", row.group()).group(1)
        self.assertEqual([(row["tissue"], row["young_kpa"]) for row in info], [(None, 5), (muscle, 200)])
        self.assertGreater(info[1]["tets"], 20)
        self.assertRegex(run("info", model).stdout, rf"\nYoung's moduli: flesh 5 kPa \({info[0]['tets']} tets\), {muscle} 200 kPa \({info[1]['tets']}\)\n")
        self.assertEqual(run("verify", model).returncode, 0)
        # All else is the body of before, and skinned as before; by finite elements it is another.
        pose = "joints: {elbow_right: {flexion_deg: 40}}\n"
        surfaces = {}
        for name, of in (("even", self.model), ("uneven", model)):
            for command in ("fem", "pose"):
                out, done = self.solve(f"{name}_{command}", pose, *(("--one-start",) if command == "fem" else ()), command=(command,), model=of)
                surfaces[name, command] = corners(out / "skin.stl")
                if command == "fem":
                    fem = json.loads((out / "fem.json").read_text())
                    self.assertEqual([row["tissue"] for row in fem["materials"]], [None, muscle] if name == "uneven" else [])
                    self.assertEqual(sum(row["tets"] for row in fem["materials"]), fem["tets"] if name == "uneven" else 0)
                    self.assertEqual("  Young's moduli: flesh 5 kPa (" in done.stdout, name == "uneven")
        self.assertTrue((surfaces["even", "pose"] == surfaces["uneven", "pose"]).all())
        apart = np.linalg.norm(surfaces["even", "fem"] - surfaces["uneven", "fem"], axis=-1)
        self.assertGreater(apart.max(), 0.5)
        self.assertLess(apart.max(), 30)

    def test_beyond_its_range_it_warns(self):
        out, done = self.solve("deep", "joints: {knee_right: {flexion_deg: 80}}\n", "--one-start")
        fem = json.loads((out / "fem.json").read_text())
        self.assertEqual(fem["verdict"], "warn")
        self.assertEqual(json.loads((out / "quality.json").read_text())["verdict"], "warn")
        self.assertIn(fem["warnings"][0]["what"], done.stdout)
        # By then the calf is within the thigh: behind the knee.
        (contact,) = [warning for warning in fem["warnings"] if warning["kind"] == "fem_contact"]
        self.assertRegex(contact["what"], rf"^the flesh runs through itself at {fem['contact_nodes']} nodes, {fem['contact_depth_mm']:.1f} mm deep: ")
        self.assertGreater(fem["contact_depth_mm"], 5)
        knee = next(row for row in json.loads(run("info", self.model, "--json").stdout)["rig"] if row["joint"] == "knee_right")
        off = np.subtract(contact["at_mm"], knee["center_mm"])
        self.assertLess(np.linalg.norm(off), 200)
        self.assertGreater(off[1], 10)  # posterior
        self.assertIn("turn the joints less", fem["warnings"][-1]["mend"])

    def test_what_does_not_go_together_is_refused(self):
        _, done = self.solve("none", "", "--element", "p2p0", "--material", "corotational", code=64)
        self.assertIn("error: --material corotational: its volume term is none that p2p0 could take a mean of "
                      "(use --element p1 or p2, or --material stable_neo_hookean)", done.stderr)
        _, done = self.solve("none", "", "--skinning", "fem", "--unfold", command=("pose",), code=64)
        self.assertIn("error: --skinning fem: it refuses folds by itself (leave out --unfold)", done.stderr)
        _, done = self.solve("none", "", "--skinning", "fem", "--settle", command=("pose",), code=64)
        self.assertIn("error: --skinning fem: it is settled to the end (leave out --settle)", done.stderr)
        _, done = self.solve("none", "", "--settle", "--unfold", command=("pose",), code=64)
        self.assertIn("error: --settle: it presses folds out by itself (leave out --unfold)", done.stderr)
        _, done = self.solve("none", "", "--settle", "--deformer", "spheres", command=("pose",), code=64)
        self.assertIn("error: --settle: it moves tets (leave out --deformer)", done.stderr)
        _, done = self.solve("none", "", "--skinning", "fem", "--deformer", "spheres", command=("pose",), code=64)
        self.assertIn("error: --skinning fem: finite elements are tets (leave out --deformer)", done.stderr)


if __name__ == "__main__":
    unittest.main()
