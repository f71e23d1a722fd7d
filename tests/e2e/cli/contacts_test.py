#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Arms that lie against the trunk in the scan: found, told, cut free, posed away and brought back; and all of that overruled."""
import json
import pathlib
import shutil
import tempfile
import unittest

import h5py
import numpy as np

from posed_files import CASE, MODEL, corners, run

AT_THE_SIDES = """ecorche_pose: 1
skeleton: phantom
joints:
  shoulder_left: {adduction_deg: 5}
  shoulder_right: {adduction_deg: 5}
"""
RAISED = """ecorche_pose: 1
skeleton: human
joints:
  shoulder_left: {adduction_deg: -60}
  shoulder_right: {adduction_deg: -60}
"""


def stretched_cm2(before, after, times):
    """The area at rest of triangles that are more than so many times as long in some direction."""
    def metric(corners_):
        a, b = corners_[:, 1] - corners_[:, 0], corners_[:, 2] - corners_[:, 0]
        return (a * a).sum(1), (a * b).sum(1), (b * b).sum(1), np.linalg.norm(np.cross(a, b), axis=1) / 2
    e, f, g, area = metric(before)
    E, F, G, _ = metric(after)
    det = np.maximum(e * g - f * f, 1e-12)
    half = (E * g - 2 * F * f + G * e) / det / 2
    largest = half + np.sqrt(np.maximum(half * half - (E * G - F * F) / det, 0))
    return area[np.sqrt(largest) > times].sum() / 100


class Contacts(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.home = pathlib.Path(tempfile.mkdtemp())
        cls.addClassCleanup(shutil.rmtree, cls.home)
        (cls.home / "sides.yaml").write_text(AT_THE_SIDES)
        (cls.home / "raised.yaml").write_text(RAISED)
        cls.ok("pose", MODEL, "--pose", cls.home / "sides.yaml", "--volumes", "labels", "--tissues", "none", "-o", cls.home / "scan")
        # The scan's names, for whoever has the label map alone.
        table = (CASE / "case.yaml").read_text().partition("  table:\n")[2].splitlines()
        rows = [line.strip().split(": ") for line in table if line.startswith("    ")]
        (cls.home / "names.txt").write_text("".join(f"{number} {name} 128 128 128 255\n" for number, name in rows))
        cls.ok("new", cls.home / "scan" / "labels.nrrd", cls.home / "names.txt", "-o", cls.home / "patient")
        shutil.copytree(cls.home / "patient", cls.home / "joined")
        with (cls.home / "joined" / "case.yaml").open("a") as file:
            file.write("contacts: joined\n")
        cls.made = {name: cls.ok("--threads", 2, "preprocess", cls.home / name, "-o", cls.home / f"{name}.hdf", "--max-tets", 60000,
                                 "--report", cls.home / f"{name}.html") for name in ("patient", "joined")}

    @classmethod
    def ok(cls, *words):
        result = run("--json", *words)
        assert result.returncode == 0, result.stderr
        return json.loads(result.stdout), result.stderr

    def pairs(self, contacts, other):
        return {(contact["limb"], contact[other]) for contact in contacts}

    def skin(self, name):
        with h5py.File(self.home / f"{name}.hdf") as file:
            skin = file["ecorche/tissues/skin"]
            return skin["points"][:].astype(float), skin["triangles"][:]

    def posed(self, name, *more):
        folder = pathlib.Path(tempfile.mkdtemp(dir=self.home)) / "posed"
        said, _ = self.ok("pose", self.home / f"{name}.hdf", "--pose", self.home / "raised.yaml", "--tissues", "skin", "-o", folder, *more)
        return said, folder

    def test_found_told_and_drawn(self):
        checked, _ = self.ok("check", self.home / "patient")
        notes = [f for f in checked["findings"] if f["severity"] == "note" and "preprocess cuts it free" in f["what"]]
        self.assertTrue({"upper_arm_left", "upper_arm_right"} <= {note["where"] for note in notes}, notes)
        info, _ = self.ok("info", self.home / "patient.hdf")
        arms = {("upper_arm_left", None), ("upper_arm_right", None)}
        self.assertTrue(arms <= self.pairs(info["cut_contacts"], "of"), info["cut_contacts"])
        self.assertFalse(arms & self.pairs(info["contacts"], "touches"), info["contacts"])
        for contact in info["cut_contacts"]:
            self.assertGreater(contact["area_cm2"], 0.4)
            self.assertGreater(contact["confidence"], 0.5)
            self.assertLess(contact["confidence"], 0.98)
            self.assertIn(contact["text"].split(":")[0], run("info", self.home / "patient.hdf").stdout)
        page = (self.home / "patient.html").read_text()
        self.assertIn("<h2>Limbs that touched</h2>", page)
        self.assertIn("<tr><td>upper_arm_left<td>the trunk<td>", page)

    def test_overruled(self):
        _, stderr = self.made["joined"]
        self.assertIn("upper_arm_left touches the trunk", stderr)
        info, _ = self.ok("info", self.home / "joined.hdf")
        self.assertEqual(info["cut_contacts"], [])
        self.assertIn(("upper_arm_left", None), self.pairs(info["contacts"], "touches"))
        self.assertNotIn("Limbs that touched", (self.home / "joined.html").read_text())

    def test_the_skin_is_closed_and_where_it_was(self):
        points, triangles = self.skin("patient")
        edges = np.concatenate([triangles[:, [0, 1]], triangles[:, [1, 2]], triangles[:, [2, 0]]])
        there, back = ({tuple(edge) for edge in ends} for ends in (edges, edges[:, ::-1]))
        self.assertEqual(len(there), len(edges), "an edge stands twice the same way")
        self.assertEqual(there, back)
        self.assertEqual(len(np.unique(triangles)), len(points))
        whole, _ = self.skin("joined")
        np.testing.assert_array_equal(points[: len(whole)], whole, "the scan's own vertices stay")

    def test_raised_arms_drag_nothing_along(self):
        found = {}
        for name in ("patient", "joined"):
            said, folder = self.posed(name)
            points, triangles = self.skin(name)
            quality = json.loads((folder / "quality.json").read_text())
            found[name] = stretched_cm2(points[triangles], corners(folder / "skin.stl"), 2), abs(quality["volume_change"])
        self.assertGreater(found["joined"][0], 500)
        self.assertLess(found["patient"][0], 0.25 * found["joined"][0], found)
        self.assertLess(found["patient"][1], 0.03, found)

    def test_the_way_back(self):
        _, folder = self.posed("patient", "--tets", "--volumes", "labels")
        said, _ = self.ok("unpose", folder, "-o", folder / "back")
        self.assertLess(said["round_trip"]["soft"]["mean_mm"], 0.01, said)

    def test_threads_make_no_difference(self):
        other = self.home / "one_thread.hdf"
        self.ok("--threads", 1, "preprocess", self.home / "patient", "-o", other, "--max-tets", 60000)
        self.assertEqual(other.read_bytes(), (self.home / "patient.hdf").read_bytes())


if __name__ == "__main__":
    unittest.main()
