#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""The verdict of a pose as its reader meets it: what is wrong, where, what to do, the exit code, and a page that explains every key."""
import json
import pathlib
import re
import shutil
import tempfile
import unittest

import numpy as np

from posed_files import CASE, MODEL, run

DOCS = (pathlib.Path(__file__).parents[3] / "docs" / "reference" / "quality.md").read_text()
LUMBAR, THORAX = (re.search(rf"name: ({start}\w+)", (CASE / "skeleton.yaml").read_text())[1] for start in ("lumb", "thora"))
TRUNK = f"{LUMBAR}: {{flexion_deg: 15}}, {THORAX}: {{flexion_deg: 10}}"
ARM = "shoulder_left: {flexion_deg: 60}, elbow_left: {flexion_deg: 90}"


def keys_of(value, under=""):
    """`a`, `a.b`, `a[].c` of a JSON object."""
    if isinstance(value, list):
        return set().union(*(keys_of(item, under + "[]") for item in value)) if value else set()
    if not isinstance(value, dict):
        return set()
    out = set()
    for key, inner in value.items():
        name = f"{under}.{key}" if under else key
        out |= {name} | keys_of(inner, name)
    return out


class Quality(unittest.TestCase):
    def setUp(self):
        self.folder = pathlib.Path(tempfile.mkdtemp())
        self.addCleanup(shutil.rmtree, self.folder)

    def pose(self, joints, *words, root="", name="posed"):
        """The command, and the quality.json that it wrote."""
        path = self.folder / f"{name}.yaml"
        path.write_text(f"ecorche_pose: 1\nskeleton: phantom\n{root}joints: {{{joints}}}\n")
        if not {"--tissues", "--tets"} & set(words):
            words += ("--tissues", "none")
        done = run("pose", MODEL, "-o", self.folder / name, "--pose", path, *words)
        found = self.folder / name / "quality.json"
        return done, json.loads(found.read_text()) if found.is_file() else None

    def test_a_tissue_that_loses_its_volume_is_a_warning_with_its_name_and_place(self):
        for joints, tissue, joint in ((TRUNK, "colon", f"{LUMBAR}|{THORAX}"), (ARM, "triceps_brachii_left", "elbow_left|shoulder_left")):
            done, quality = self.pose(joints)
            self.assertEqual(done.returncode, 0, done.stderr)
            self.assertEqual(quality["verdict"], "warn")
            told = [w for w in quality["warnings"] if w.get("tissue") == tissue]
            self.assertEqual(len(told), 1, f"{tissue} is not among {[w['what'] for w in quality['warnings']]}")
            self.assertEqual(told[0]["kind"], "tissue_change")
            self.assertGreater(abs(told[0]["value"]), told[0]["threshold"])
            self.assertRegex(told[0]["joint"], joint)
            self.assertLess(abs(quality["volume_change"]), 0.1, "the whole body would not have told")
            self.assertLessEqual(abs(quality["volume_change"]), quality["unsigned_volume_change"])
            worst = quality["warnings"][0]
            self.assertRegex(done.stdout, rf"(?m)^  warning: {re.escape(worst['what'])}(; .*)?, at \[-?\d+, -?\d+, -?\d+\] mm of the scan by "
                                          rf"{worst['joint']} \({re.escape(worst['mend'])}\)$")

    def test_a_warning_fails_where_that_is_asked_after_all_is_written(self):
        done, quality = self.pose(ARM, "--fail-on-warn")
        self.assertEqual((done.returncode, quality["verdict"]), (1, "warn"))
        done, quality = self.pose("", "--fail-on-warn")
        self.assertEqual((done.returncode, quality["verdict"], quality["warnings"]), (0, "pass", []))

    def test_what_is_clamped_is_named_with_the_limit(self):
        done, quality = self.pose("knee_left: {flexion_deg: 160}")
        clamped = quality["clamped"]
        self.assertEqual([c["joint"] for c in clamped], ["knee_left"])
        self.assertEqual([limit["angle"] for limit in clamped[0]["limits"]], ["flexion"])
        self.assertIn(f"  clamped: knee_left by {clamped[0]['removed_deg']:.1f} degrees: flexion stops at 135\n", done.stdout)

    def test_arms_go_up(self):
        done = run("--json", "pose", MODEL, "-o", self.folder / "up", "--pose", "lib:arms_up", "--tissues", "none")
        self.assertEqual(done.returncode, 0, done.stderr)
        quality = json.loads((self.folder / "up" / "quality.json").read_text())
        self.assertEqual([c for c in quality["clamped"] if c["removed_deg"] > 0.1], [], "a library pose is within the phantom's limits")

    def test_who_hardly_turns_is_not_to_blame(self):
        """What a raised arm stretches may lie nearer to its elbow, which bends by 7 degrees: telling it to bend less helps nobody."""
        _, quality = self.pose("shoulder_left: {flexion_deg: 90}, elbow_left: {flexion_deg: 7}", "--skinning", "lbs")
        blamed = {warning["joint"] for warning in quality["warnings"] if "joint" in warning}
        self.assertTrue(blamed)
        self.assertNotIn("elbow_left", blamed)

    def test_where_the_body_stands_changes_no_figure(self):
        done, quality = self.pose("", "--tets", root="root: {translation_mm: [9000, 9000, 9000], rotation: [0.5, -0.5, -0.5, -0.5]}\n")
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertEqual(quality["verdict"], "pass")
        self.assertAlmostEqual(quality["min_det_f"], 1, delta=1e-5)
        self.assertLess(quality["unsigned_volume_change"], 1e-5)
        header = (self.folder / "posed" / "body.vtu").read_bytes()[:4000].decode(errors="replace")
        low, high = (float(re.search(rf'Name="det_f"[^>]*{end}="([^"]+)"', header)[1]) for end in ("RangeMin", "RangeMax"))
        np.testing.assert_allclose([low, high], 1, atol=1e-5)

    def test_unfolding_makes_no_tissue_worse(self):
        joints = "hip_left: {flexion_deg: 85}, knee_left: {flexion_deg: 90}"
        _, before = self.pose(joints)
        self.assertGreater(before["inverted_tets"], 0)
        _, after = self.pose(joints, "--unfold", name="unfolded")
        self.assertLess(after["inverted_tets"], before["inverted_tets"])
        self.assertLess(after["inverted_rest_mm3"], before["inverted_rest_mm3"])
        for was, now in zip(before["tissues"], after["tissues"]):
            if was["volume_change"] is not None:
                self.assertLessEqual(abs(now["volume_change"]), abs(was["volume_change"]) + 1e-3, now["name"])

    def test_the_advice_is_what_is_left_to_try_and_helps(self):
        joints = "hip_left: {flexion_deg: 85}, knee_left: {flexion_deg: 90}"
        left = {}
        for words, advice in (((), "use --settle, or calibrate the model, or "), (("--skinning", "dqs"), "use --settle, or (?!cal)"),
                              (("--settle",), "turn ")):
            _, quality = self.pose(joints, *words, name="posed" + "".join(words))
            for warning in quality["warnings"]:
                self.assertRegex(warning["mend"], f"^{advice}")
            left[words] = [warning["kind"] for warning in quality["warnings"]]
        self.assertGreater(left[()].count("tissue_change"), 0)
        self.assertEqual(left["--settle",].count("tissue_change"), 0)

    def test_the_page_explains_every_key_and_has_the_limits_of_the_code(self):
        _, quality = self.pose(ARM + ", knee_left: {flexion_deg: 160}", "--unfold")
        said = set()
        for cell in re.findall(r"(?m)^\| (`[^|]*`) \|", DOCS):
            said |= set(re.findall(r"`([^`]+)`", cell))
        limits = quality["thresholds"]["max_tissue_change"]
        keys = keys_of(quality) - {f"thresholds.max_tissue_change.{group}" for group in limits}
        self.assertGreater(len(keys), 50)
        parents = {"worst_places", "worst_places.inverted", "worst_places.changed"}
        self.assertEqual(keys - said - parents, set(), "docs/reference/quality.md does not explain these keys")
        table = dict(re.findall(r"(?m)^\| (\w+) \| ([\d.]+) \|", DOCS))
        self.assertEqual({group: float(limit) for group, limit in table.items()}, limits)
        for key, value in quality["thresholds"].items():
            if not isinstance(value, dict):
                self.assertRegex(DOCS, rf"`{key}` {value:g}\b", f"docs/reference/quality.md has another {key}")


if __name__ == "__main__":
    unittest.main(verbosity=2)
