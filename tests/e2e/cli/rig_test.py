#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""`ecorche rig`: the phantom by its own skeleton, by the human template, by nothing at all; parts of it; a body that poses; mistakes."""
import json
import os
import pathlib
import re
import shutil
import subprocess
import tempfile
import unittest

import numpy as np
import yaml

ECORCHE = os.environ["ECORCHE_BIN"]
CASE = pathlib.Path(os.environ["ECORCHE_CASE"])
ERROR_LINE = re.compile(r"^error: .+: .+ \(.+\)$", re.M)


def run(*words):
    return subprocess.run([ECORCHE, *map(str, words)], capture_output=True, text=True, timeout=120)


class Rig(unittest.TestCase):
    def setUp(self):
        self.folder = pathlib.Path(tempfile.mkdtemp())
        self.addCleanup(shutil.rmtree, self.folder)

    def case(self, skeleton, keep=lambda bone: True, segments=True):
        """The phantom's bones and skin alone, with another skeleton."""
        case = yaml.safe_load((CASE / "case.yaml").read_text())
        bones = [dict(bone, file=str(CASE / bone["file"]), segment=bone["segment"]) for bone in case["bones"] if keep(bone)]
        if not segments:
            bones = [{key: value for key, value in bone.items() if key != "segment"} for bone in bones]
        text = {"name": "phantom", "frame": "LPS", "unit": "mm", "skeleton": skeleton, "skin": str(CASE / "skin.stl"), "bones": bones}
        folder = self.folder / f"case_{len(list(self.folder.iterdir()))}"
        folder.mkdir()
        (folder / "case.yaml").write_text(json.dumps(text))
        return folder

    def joints(self, *words):
        done = run("--json", "rig", *words)
        self.assertEqual(done.returncode, 0, done.stderr)
        rows = json.loads(done.stdout)["rig"]
        return {row["joint"]: row for row in rows}, done.stderr

    def refused(self, code, part, *words):
        done = run("rig", *words)
        self.assertEqual(done.returncode, code, done.stderr)
        self.assertEqual(len(ERROR_LINE.findall(done.stderr)), 1, done.stderr)
        self.assertIn(part, done.stderr)

    def test_the_human_template_lies_near_the_truth_and_writes_what_it_found(self):
        truth, _ = self.joints(CASE)
        found, said = self.joints(self.case("human"), "-o", self.folder / "fitted.yaml", "--bones", self.folder / "bones")
        self.assertEqual(len(found), 21)  # the phantom's mandible moves with its skull: no jaw
        for joint in ("hip_left", "hip_right", "shoulder_left", "shoulder_right"):
            away = np.linalg.norm(np.subtract(found[joint]["center_mm"], truth[joint]["center_mm"]))
            self.assertLess(away, 6, joint)  # a head of the small phantom has a dozen vertices
            self.assertEqual(found[joint]["fit"]["rule"], "sphere_fit")
        self.assertEqual(truth["hip_left"]["fit"]["rule"], "sphere_fit")
        for joint in ("knee_left", "elbow_right"):
            self.assertEqual(found[joint]["kind"], "hinge")
            self.assertLess(found[joint]["fit"]["confidence"], 1)
        self.assertEqual(found["knee_left"]["fit"]["rule"], "cylinder_fit")
        for joint, row in found.items():
            if row["fit"]["confidence"] < 0.5:  # the small phantom is coarse: never in silence
                self.assertRegex(said, rf"warning: joint {joint}: its (centre|axes|rule)")
        self.assertIn("AAOS", found["hip_left"]["limits_source"])
        self.assertEqual(found["sternoclavicular_left"]["coupled"][0], {"joint": "shoulder_left", "angle": "adduction", "drives": "depression", "ratio": 0.25})
        self.assertEqual(found["knee_right"]["coupled"], [{"joint": "knee_right", "angle": "flexion", "drives": "y_mm", "ratio": -2.5}])
        fitted = yaml.safe_load((self.folder / "fitted.yaml").read_text())
        np.testing.assert_allclose(fitted["segments"]["thigh_left"]["joint"]["center"], found["hip_left"]["center_mm"], atol=1e-9)
        self.assertTrue((self.folder / "bones" / "thigh_left.stl").stat().st_size > 84)
        again, _ = self.joints(self.case(str(self.write_fitted())))
        for joint, row in again.items():
            np.testing.assert_allclose(row["center_mm"], found[joint]["center_mm"], atol=1e-9)
            np.testing.assert_allclose([angle["rest_deg"] for angle in row["angles"]], [angle["rest_deg"] for angle in found[joint]["angles"]], atol=1e-6)
            self.assertEqual(row["fit"]["rule"], "given")

    def write_fitted(self):
        target = self.folder / "again.yaml"
        target.write_text((self.folder / "fitted.yaml").read_text())
        return target

    def test_one_side_only_stands_on_a_root_without_bones(self):
        found, said = self.joints(self.case("human", lambda bone: bone["name"].endswith("_right") and bone["segment"].startswith(("thigh", "shank", "foot"))))
        self.assertEqual(sorted(found), ["ankle_right", "hip_right", "knee_right", "pelvis"])
        self.assertIn("segment lumbar has no bone in this case: it is dropped into pelvis", said)

    def test_generic_needs_no_segments_and_joins_neighbours(self):
        found, _ = self.joints(self.case("generic", segments=False))
        self.assertEqual(len(found), len(yaml.safe_load((CASE / "case.yaml").read_text())["bones"]))
        parents = {joint: row["parent"] for joint, row in found.items()}
        self.assertEqual(sum(parent is None for parent in parents.values()), 1)
        for a, b in (("humerus_left", "scapula_left"), ("tibia_right", "femur_right"), ("foot_bones_left", "toe_bones_left")):
            self.assertTrue(parents[a] == b or parents[b] == a, (a, b, parents))

    def test_evidence_holds_the_vertices_and_the_shape_of_every_joint(self):
        found, _ = self.joints(self.case("human"), "--evidence", self.folder / "evidence.json")
        evidence = json.loads((self.folder / "evidence.json").read_text())
        self.assertEqual(sorted(evidence), sorted(found))
        for joint, row in found.items():
            self.assertEqual(evidence[joint]["rule"], row["fit"]["rule"])
            np.testing.assert_allclose(evidence[joint]["center_mm"], row["center_mm"])
        hip = evidence["hip_left"]
        away = np.linalg.norm(np.array(hip["vertices_mm"]) - hip["center_mm"], axis=1)
        self.assertLess(abs(np.median(away) - hip["radius_mm"]), 1.5)
        self.assertAlmostEqual(np.linalg.norm(evidence["knee_left"]["axis"]), 1)

    def test_fused_and_extra_bones_change_nothing(self):
        found, _ = self.joints(self.case("human"))
        # Two bones of a segment are as one: an extra bone far from every joint of its segment, and the same one again.
        folder = self.case("human")
        text = json.loads((folder / "case.yaml").read_text())
        skull = next(bone for bone in text["bones"] if bone["segment"] == "head")
        text["bones"].append(dict(skull, name="extra_bone"))
        (folder / "case.yaml").write_text(json.dumps(text))
        again, _ = self.joints(folder)
        for joint, row in found.items():
            np.testing.assert_allclose(again[joint]["center_mm"], row["center_mm"], atol=1e-9)

    def test_text_names_rule_confidence_and_rhythms(self):
        self.assertIn("sternoclavicular_left depression follows shoulder_left adduction x 0.25", run("rig", self.case("human")).stdout)
        done = run("rig", CASE)
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertRegex(done.stdout, r"hip_left +sphere_fit +.* \d\.\d\d")

    def test_json_tells_every_warning_and_centre_and_axes_apart(self):
        done = run("--json", "rig", self.case("human"))
        told, said = json.loads(done.stdout), [line for line in done.stderr.splitlines() if line.startswith("warning: ")]
        self.assertTrue(said)
        warned = [f"warning: {one['where']}{' ' if one['where'].startswith('segment ') else ': '}{one['what']} ({one['mend']})"
                  for one in told["findings"] if one["severity"] == "warning"]
        self.assertEqual(sorted(warned), sorted(said))
        self.assertTrue(all(re.match(r"(joint|segment) [a-z_]+$", one["where"]) for one in told["findings"]), told["findings"])
        for row in told["rig"]:
            fit = row["fit"]
            self.assertLessEqual(fit["confidence"], min(fit["center_confidence"], fit["axes_confidence"]) + 1e-12, row["joint"])
        apart = {row["joint"]: row["fit"] for row in told["rig"]}["wrist_left"]
        self.assertNotEqual(apart["center_confidence"], apart["axes_confidence"])

    def test_mistakes(self):
        self.refused(78, "no skeleton template is named 'horse'", self.case("horse"))
        folder = self.case("human")
        text = json.loads((folder / "case.yaml").read_text())
        text["regions"] = "regions.yaml"
        (folder / "case.yaml").write_text(json.dumps(text))
        (folder / "regions.yaml").write_text("ecorche_regions: 1\nregions:\n  a: {bone: femur, boxes: [{least: [0, 0, 0], most: [1, 1, 1]}]}\n")
        self.refused(78, "regions.yaml:3:regions.a.bone: unknown bone 'femur'", folder)
        skeleton = "ecorche_skeleton: 1\nname: a\nsegments:\n  pelvis: {joint: {name: root, center: [0, 0, 0]}}\n  thigh_left: {parent: pelvis, joint: {name: hip, %s}}\n"
        legs = lambda bone: bone["segment"] in ("pelvis", "thigh_left")  # noqa: E731
        for number, (joint, code, part) in enumerate((("center: {joint: hip}", 78, "joint hip: its rule leads back to the joint itself"),
                                                      ("center: [0, 0, 0], axes: {x: {from: [0, 0, 0], to: [0, 0, 1]}, z: [0, 0, 1]}", 65, "joint hip: its two axes come out collinear"),
                                                      ("center: {centroid: {region: head}}", 78, "unknown region 'head'"),
                                                      ("center: [0, 0, 0], limits_deg: {x: [3, 2]}", 78, "the least angle is above the most"))):
            file = self.folder / f"skeleton_{number}.yaml"
            file.write_text(skeleton % joint)
            self.refused(code, part, self.case(str(file), legs))
        # Skeletons that cannot be.
        head = "ecorche_skeleton: 1\nname: a\nsegments:\n"
        pelvis, thigh = "  pelvis: {%sjoint: {name: root, center: [0, 0, 0]%s}}\n", "  thigh_left: {%sjoint: {name: hip, center: [0, 0, 0]%s}}\n"
        below = "parent: pelvis, "
        for number, (body, code, part) in enumerate((
                (pelvis % ("parent: thigh_left, ", "") + thigh % (below, ""), 78, "every segment has a parent"),
                (pelvis % ("", "") + thigh % (below, "") + "  a: {parent: b, joint: {name: a, center: [0, 0, 0]}}\n  b: {parent: a, joint: {name: b, center: [0, 0, 0]}}\n", 78, "is among its own ancestors"),
                (pelvis % ("", "") + thigh % ("", ""), 78, "'thigh_left' has no parent, but 'pelvis' is the root already"),
                (pelvis % ("", "") + thigh % (below, ", limits_deg: {z: [10, -10]}"), 78, "the least angle is above the most"),
                (pelvis % ("", "") + thigh % (below, ", axes: {x: [1, 0, 0], z: [2, 0, 0.01]}"), 78, "the axes are collinear"),
                (pelvis % ("", "") + thigh % (below, ", axes: {x: [1, 0, 0], z: [0, .nan, 1]}"), 78, "axes.z"),
                (pelvis % ("", "") + (thigh % (below, "")).replace("name: hip", "name: root"), 78, "another joint is named 'root'"),
                (pelvis % ("", "") + thigh % (below, "") + "regions:\n  r: {segment: shank, boxes: [{least: [0, 0, 0], most: [1, 1, 1]}]}\n", 78, "unknown segment 'shank'"),
                (pelvis % ("", "") + thigh % (below, "") + "regions:\n  r: {segment: thigh_left, near: shank, boxes: [{least: [0, 0, 0], most: [1, 1, 1]}]}\n", 78, "regions.r.near: unknown segment 'shank'"))):
            file = self.folder / f"impossible_{number}.yaml"
            file.write_text(head + body)
            self.refused(code, part, self.case(str(file), legs))
        self.refused(66, "nowhere: cannot be opened", self.folder / "nowhere")
        self.refused(64, "CASE")


if __name__ == "__main__":
    unittest.main()
