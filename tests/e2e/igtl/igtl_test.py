#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""`ecorche igtl` and a client by OpenIGTLink's own library, both ways, held against `ecorche pose`.

usage: igtl_test.py IGTL_PEER; the environment is that of the fixtures
"""
import json
import pathlib
import subprocess
import sys
import tempfile
import unittest

import meshio
import nibabel
import numpy as np

from linking import ECORCHE, FLIP, MODEL, Library, Link, flat

# Left and right differ: the left arm is bent, and the body has turned and gone.
POSE = """ecorche_pose: 1
skeleton: phantom
root: {translation_mm: [30, -20, 10]}
joints:
  elbow_left: {flexion_deg: 80}
  cervicothoracic: {rotation_deg: 20}
"""
TISSUES, VOLUME, LONG = ("skin", "hand_bones_left"), "ct", "adductor_magnus_right"


def segments():
    told = subprocess.run([ECORCHE, "--json", "info", MODEL], check=True, capture_output=True, text=True).stdout
    return [one["segment"] for one in json.loads(told)["rig"]]


class Igtl(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = tempfile.TemporaryDirectory()
        cls.addClassCleanup(cls.folder.cleanup)
        cls.pose = pathlib.Path(cls.folder.name) / "bent.yaml"
        cls.pose.write_text(POSE)
        cls.offline = pathlib.Path(cls.folder.name) / "offline"
        subprocess.run([ECORCHE, "pose", MODEL, "-o", cls.offline, "--pose", cls.pose, "--tissues", ",".join(TISSUES), "--volumes", VOLUME,
                        "--format", "obj", "--volume-format", "nii.gz"], check=True, capture_output=True)

    def offline_surface(self, name):
        """As `ecorche pose` wrote it, in RAS."""
        mesh = meshio.read(self.offline / f"{name}.obj")
        return mesh.points @ FLIP[:3, :3], mesh.cells_dict["triangle"]

    def test_surfaces_are_those_of_pose_in_ras(self):
        with Link("--pose", self.pose, "--tissues", ",".join(TISSUES), "--volumes", "none") as link, Library(link) as slicer:
            for name in sorted(TISSUES):  # as they come
                points, normals, triangles = slicer.surface(name)
                expected, faces = self.offline_surface(name)
                self.assertLess(np.abs(points - expected).max(), 2e-3)
                np.testing.assert_array_equal(triangles, faces)
                # Outwards: along the triangles' own, which wind as they did.
                a, b, c = (points[triangles[:, corner]] for corner in range(3))
                across = np.cross(b - a, c - a)
                agree = np.einsum("ij,ij->i", across, normals[triangles[:, 0]]) > 0
                self.assertGreater(agree.mean(), 0.95)
                self.assertLess(np.abs(np.linalg.norm(normals, axis=1) - 1).max(), 1e-3)
                self.assertEqual((slicer.told["attribute"], slicer.told["kind"]), ("Normals", 2))
                # The patient's left is -x in RAS.
                if name == "hand_bones_left":
                    self.assertLess(points[:, 0].max(), 0)

    def test_images_are_those_of_pose_in_ras(self):
        with Link("--pose", self.pose, "--tissues", "none", "--volumes", VOLUME) as link, Library(link) as slicer:
            expected = nibabel.load(self.offline / f"{VOLUME}.nii.gz")
            voxels, axes = slicer.image(VOLUME, np.asanyarray(expected.dataobj).dtype)
            np.testing.assert_array_equal(voxels, np.asanyarray(expected.dataobj))
            self.assertLess(np.abs(axes - expected.affine).max(), 1e-3)
            self.assertEqual((slicer.told["endian"], slicer.told["coordinates"]), (2 if sys.byteorder == "little" else 1, 1))

    def test_motions_go_round_through_bound_tools(self):
        names = segments()
        bound = [word for name in names for word in ("--joint", f"to_{name}={name}")]
        with Link("--pose", self.pose, "--tissues", "skin", "--volumes", "none") as one, Library(one) as source:
            motions = {name: source.matrix(name) for name in sorted(names)}
            posed = source.surface("skin")[0]
        with Link("--tissues", "skin", "--volumes", "none", "--rate", "1000", *bound) as other, Library(other) as tracker:
            rest = tracker.surface("skin")[0]
            tracker.tell("tools", *(word for name in names for word in (f"to_{name}", *flat(motions[name]))))
            again = tracker.surface("skin")[0]
            self.assertGreater(np.abs(again - rest).max(), 50)
            self.assertLess(np.abs(again - posed).max(), 0.01)
            # By one transform alone: the root, and the body with it.
            turned = np.eye(4)
            turned[:3, 3] = [0, 0, 500]
            tracker.transform("to_" + names[0], turned @ motions[names[0]])
            lifted = tracker.surface("skin")[0]
            self.assertAlmostEqual(float(lifted[:, 2].mean() - posed[:, 2].mean()), 500, delta=120)

    def test_a_goal_pulls_a_hand_to_where_the_tool_is(self):
        with Link("--tissues", "none", "--volumes", "none", "--goal", "Stylus=hand_left") as link, Library(link) as slicer:
            slicer.tell("track", 0)
            self.assertEqual(slicer.wait("RTS_TDATA")["status"], 0)
            rest = slicer.wait("TDATA")["tools"]
            goal = np.array(rest["hand_left"][9:]) + [40, 60, 90]
            at = np.eye(4)
            at[:3, 3] = goal
            slicer.transform("Stylus", at)
            tools = slicer.wait("TDATA")["tools"]
            self.assertLess(np.linalg.norm(np.array(tools["hand_left"][9:]) - goal), 1)
            self.assertEqual(tools["pelvis"], rest["pelvis"])
            # The motion of a segment carries its joint from where it was.
            slicer.tell("get_transform", "hand_left")
            motion = slicer.matrix("hand_left")
            self.assertLess(np.abs((motion @ [*rest["hand_left"][9:], 1])[:3] - goal).max(), 1)

    def test_a_tool_fixed_anyhow_counts_from_where_it_was_first(self):
        tool = np.array([[0, -1, 0, 300], [1, 0, 0, -40], [0, 0, 1, 77], [0, 0, 0, 1.0]])
        lift = np.eye(4)
        lift[:3, 3] = [0, 25, 0]
        with Link("--tissues", "none", "--volumes", "none", "--joint", "Marker=pelvis", "--from-first") as link, Library(link) as tracker:
            tracker.matrix("pelvis")
            tracker.transform("Marker", tool)
            self.assertLess(np.abs(tracker.matrix("pelvis") - np.eye(4)).max(), 1e-5)
            tracker.transform("Marker", lift @ tool)
            self.assertLess(np.abs(tracker.matrix("pelvis") - lift).max(), 1e-3)

    def test_points_go_both_ways(self):
        with Link("--pose", self.pose, "--tissues", "hand_bones_left", "--volumes", "none") as link, Library(link) as slicer:
            points = slicer.surface("hand_bones_left")[0]
            middle = points.mean(axis=0)
            slicer.tell("point", "posed_points", *middle)
            scan = slicer.wait("POINT", "points_in_scan")["points"][0]
            slicer.tell("get_transform", "hand_left")
            motion = slicer.matrix("hand_left")
            self.assertLess(np.abs((motion @ [*scan["at"], 1])[:3] - middle).max(), 0.5)
            self.assertNotIn(scan["group"], ("", "outside"))
            slicer.tell("point", "scan_points", *scan["at"])
            back = slicer.wait("POINT", "points_in_pose")["points"][0]
            self.assertLess(np.abs(np.array(back["at"]) - middle).max(), 0.01)
            slicer.tell("point", "posed_points", 5000, 0, 0)
            self.assertEqual(slicer.wait("POINT")["points"], [{"at": [5000, 0, 0], "group": "outside", "name": "p"}])

    def test_a_pose_by_name_and_what_is_not_taken(self):
        with Link("--tissues", f"skin,{LONG}", "--volumes", "none") as link, Library(link) as slicer:
            # Names are cut in their middle: the side stays.
            slicer.surface("adductor_~gnus_right")
            rest = slicer.surface("skin")[0]
            slicer.tell("string", "pose", "lib:sitting")
            told = slicer.wait("STATUS")
            self.assertEqual((told["code"], told["text"]), (1, "posed as sitting"))
            self.assertGreater(np.abs(slicer.surface("skin")[0] - rest).max(), 100)
            slicer.tell("string", "pose", "rest")
            slicer.wait("STATUS")
            self.assertLess(np.abs(slicer.surface("skin")[0] - rest).max(), 1e-3)
            slicer.tell("string", "pose", "lib:flying")
            told = slicer.wait("STATUS")
            self.assertEqual(told["code"], 4)
            self.assertIn("flying", told["text"])
            slicer.transform("Nobody", np.eye(4))
            self.assertIn("Nobody moves nothing", slicer.wait("STATUS")["text"])
            slicer.tell("tools", "Nobody", *flat(np.eye(4)))
            self.assertIn("none of the tools moves anything", slicer.wait("STATUS")["text"])
            slicer.tell("get_transform", "nobody")
            self.assertEqual(slicer.wait("STATUS")["code"], 4)
            slicer.tell("capabilities")
            self.assertIn("POLYDATA", slicer.wait("CAPABILITY")["types"])

    def test_tracking_ends_when_it_is_told_to(self):
        with Link("--tissues", "none", "--volumes", "none", "--joint", "Marker=pelvis") as link, Library(link) as tracker:
            tracker.tell("track", 1)
            tracker.wait("TDATA")
            tracker.tell("untrack")
            tracker.wait("RTS_TDATA")
            moved = np.eye(4)
            moved[0, 3] = 5
            tracker.transform("Marker", moved)
            tracker.wait("TRANSFORM", "pelvis")
            tracker.tell("capabilities")
            self.assertEqual(link.stop()[0], 0)
            self.assertEqual(tracker.wait("TDATA"), {"gone": True})

    def test_mistakes_on_the_command_line(self):
        for words, kind, error in (
                (("--listen", "0.0.0.0:0"), 77, "error: 0.0.0.0: is reachable by others, and OpenIGTLink knows neither passwords nor encryption "
                 "(listen on 127.0.0.1 and tunnel, or add --insecure on a network that you trust)\n"),
                (("--joint", "Stylus"), 64, "error: --joint: 'Stylus' is not TOOL=SEGMENT (write it as Stylus=hand_right, with a tool's name of 1 to 20 "
                 "letters)\n"),
                (("--joint", "pelvis=pelvis"), 64, "error: --joint: 'pelvis' is what a segment's own transform is sent as (give the tool another name)\n"),
                (("--goal", "Stylus=hand_lef"), 64, "error: --goal: the model has no 'hand_lef' (did you mean 'hand_left'?)\n"),
                (("--tissues", "skim"), 64, "error: --tissues: the model has no 'skim' (did you mean 'skin'?)\n")):
            done = subprocess.run([ECORCHE, "igtl", MODEL, *words], capture_output=True, text=True, timeout=60)
            self.assertEqual((done.returncode, done.stderr), (kind, error))


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1] + sys.argv[2:])
