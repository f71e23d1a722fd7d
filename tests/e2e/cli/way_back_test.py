#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""A posed folder is of one pose, whole or not there, and comes back to the scan by the way that it went."""
import json
import pathlib
import shutil
import signal
import subprocess
import tempfile
import time
import unittest

import numpy as np

from posed_files import CASE, ECORCHE, MODEL, corners, run

LIBRARY = ("anatomical", "arms_up", "lateral", "lithotomy", "prone", "sitting", "squatting", "supine")
MOST_BONE_MM, MOST_SOFT_MM = 0.01, 0.05  # of returned vertices, the worst and on average


def contents(folder):
    return {str(path.relative_to(folder)): path.read_bytes() for path in folder.rglob("*") if path.is_file()}


class Case(unittest.TestCase):
    def setUp(self):
        self.folder = pathlib.Path(tempfile.mkdtemp())
        self.addCleanup(shutil.rmtree, self.folder)

    def ok(self, *words):
        result = run(*words)
        self.assertEqual(result.returncode, 0, result.stderr)
        return result

    def pose(self, name, out="posed", *more):
        self.ok("pose", MODEL, "-o", self.folder / out, "--pose", name, *more)
        return self.folder / out

    def refused(self, code, where, what, *words):
        result = run(*words)
        self.assertEqual(result.returncode, code, result.stderr)
        self.assertRegex(result.stderr, r"(?m)^error: .+: .+ \(.+\)$")
        self.assertIn(where, result.stderr)
        self.assertIn(what, result.stderr)


class WayBack(Case):
    def held_against_the_scan(self, back):
        """Millimetres between returned corners and those of the case, by surface: an own measure, of files alone."""
        bones = {path.stem for path in (CASE / "bones").glob("*.stl")}
        away = {}
        for scan in (CASE / "skin.stl", *sorted((CASE / "bones").glob("*.stl")), *sorted((CASE / "tissues").glob("*.stl"))):
            away[scan.stem] = np.linalg.norm(corners(scan) - corners(back / scan.name), axis=2)
        return {name: away[name] for name in bones}, {name: far for name, far in away.items() if name not in bones}

    def test_every_library_pose(self):
        for name in LIBRARY:
            with self.subTest(name):
                posed, back = self.pose(f"lib:{name}", name, "--tissues", "all", "--tets"), self.folder / f"{name}_back"
                out = json.loads(self.ok("--json", "unpose", posed, "-o", back).stdout)
                trip = out["round_trip"]
                bones, soft = self.held_against_the_scan(back)
                self.assertLess(max(far.max() for far in bones.values()), MOST_BONE_MM)
                self.assertLess(max(far.mean() for far in soft.values()), MOST_SOFT_MM)
                # The report is of what was returned. The case's own files are rounded otherwise than the model's.
                self.assertAlmostEqual(trip["rigid"]["max_mm"], max(far.max() for far in bones.values()), delta=1e-3)
                self.assertAlmostEqual(trip["soft"]["max_mm"], max(far.max() for far in soft.values()), delta=1e-3)
                self.assertEqual(trip["rigid"]["surfaces"], len(bones))
                self.assertEqual(trip["soft"]["surfaces"], len(soft))
                # What lies in folds is counted by tissue, and marked.
                rows = (back / "folds.csv").read_text().splitlines()[1:] if trip["soft"]["folded"] else []
                self.assertEqual(len(rows), trip["soft"]["folded"])
                self.assertEqual(sum(row["folded"] for row in trip["folded"]), trip["soft"]["folded"])
                for row in trip["folded"]:
                    self.assertEqual(sum(line.startswith(f"{row['tissue']}.stl,") for line in rows), row["folded"])
                if name == "sitting":
                    self.assertGreater(trip["soft"]["folded"], 0, "it bends hips and knees by right angles")

    def test_folds_are_marked_in_vtp(self):
        posed = self.pose("lib:sitting", "posed", "--tissues", "skin", "--format", "vtp,ply,obj,off,glb,stl", "--tets")
        back = self.folder / "back"
        trip = json.loads(self.ok("--json", "unpose", posed, "-o", back).stdout)["round_trip"]
        self.assertEqual(trip["soft"]["surfaces"], 6, "every format comes back")
        self.assertLess(trip["soft"]["max_mm"], MOST_SOFT_MM)
        rows = (back / "folds.csv").read_text().splitlines()
        self.assertEqual(rows[0], "file,vertex,x_mm,y_mm,z_mm")
        self.assertIn(b'Name="folded"', (back / "skin.vtp").read_bytes())
        # A numbered vertex stands where the table says.
        vertices = [line.split()[1:] for line in (back / "skin.obj").read_text().splitlines() if line.startswith("v ")]
        _, vertex, *place = next(row for row in rows if row.startswith("skin.obj,")).split(",")
        self.assertLess(np.abs(np.array(vertices[int(vertex)], float) - np.array(place, float)).max(), 1e-3)

    def test_images_are_held_against_the_scan(self):
        posed, back = self.pose("lib:sitting", "posed", "--volumes", "all", "--tets"), self.folder / "back"
        out = json.loads(self.ok("--json", "unpose", posed, "-o", back, "--model", MODEL).stdout)
        images = {pathlib.Path(row["file"]).stem: row for row in out["round_trip"]["images"]}
        files = {row["file"]: row for row in json.loads((posed / "posed.json").read_text())["files"]}
        bones = files["body.vtu"]["labels"]
        self.assertEqual(bones["0"], "soft")
        self.assertEqual(set(bones.values()) - {"soft"}, {path.stem for path in (CASE / "bones").glob("*.stl")})
        self.assertLessEqual(set(bones.values()) - {"soft"}, set(files["labels.nrrd"]["labels"].values()))
        labels = images["labels"]
        self.assertLess(labels["elsewhere_share"], 0.05)
        self.assertGreater(labels["elsewhere"], 0)
        self.assertLess(labels["mean_voxels"], 1)
        self.assertTrue(pathlib.Path(labels["mask"]).is_file())
        scan = labels["against_scan"]
        self.assertLess(scan["differ_share"], 0.1)
        self.assertLess(scan["off_boundary_share"], 0.01)
        self.assertEqual(sum(row["differ"] for row in scan["groups"]), scan["differ"])
        self.assertIn("bone", [row["group"] for row in scan["groups"]])
        self.assertNotIn("off_boundary_share", images["ct"]["against_scan"])
        self.refused(65, "small", "is not the model that was posed", "unpose", self.other_model(posed), "-o", back, "--model", MODEL)

    def test_images_of_contested_bones_come_back_as_they_went(self):
        """In coarse tets many bones share some: 7e-4 of their voxels, off the boundary, when these come back by the soft tets."""
        model, posed, back = self.folder / "coarse.hdf", self.folder / "posed", self.folder / "back"
        self.ok("preprocess", CASE, "-o", model, "--mesher", "lattice", "--max-tets", "20000")
        self.ok("pose", model, "-o", posed, "--pose", "lib:sitting", "--volumes", "labels", "--tets")
        out = json.loads(self.ok("--json", "unpose", posed, "-o", back, "--model", model).stdout)
        bone = next(row for row in out["round_trip"]["images"][0]["against_scan"]["groups"] if row["group"] == "bone")
        self.assertLess(bone["off_boundary_share"], 4e-4)

    def other_model(self, posed):
        other = self.folder / "small"
        shutil.copytree(posed, other)
        manifest = json.loads((other / "posed.json").read_text())
        manifest["model"]["identity"] = "0" * 16
        (other / "posed.json").write_text(json.dumps(manifest))
        (self.folder / "small.hdf").symlink_to(MODEL)
        return other

    def test_what_does_not_belong_is_refused(self):
        skin, back = ("--tissues", "skin,femur_right", "--tets"), self.folder / "back"
        sitting, up = self.pose("lib:sitting", "sitting", *skin), self.pose("lib:arms_up", "up", *skin)
        words = ("unpose", sitting, "-o", back)
        kept = (sitting / "skin.stl").read_bytes()
        shutil.copy(up / "skin.stl", sitting)
        self.refused(65, "skin.stl", "was altered, or is of another pose", *words)
        (sitting / "skin.stl").unlink()
        self.refused(66, "skin.stl", "is missing from this posed body", *words)
        (sitting / "skin.stl").write_bytes(kept)
        shutil.copy(up / "skin.stl", sitting / "plan.stl")
        self.refused(65, "plan.stl", "is not of this posed body", *words)
        self.ok("unpose", sitting, sitting / "plan.stl", sitting / "femur_right.stl", "-o", back)
        self.assertLess(np.abs(corners(CASE / "bones/femur_right.stl") - corners(back / "femur_right.stl")).max(), MOST_BONE_MM)
        (sitting / "plan.stl").unlink()
        body = (sitting / "body.vtu").read_bytes()
        shutil.copy(up / "body.vtu", sitting)
        self.refused(65, "body.vtu", "pose again into a new folder", *words)
        (sitting / "body.vtu").write_bytes(body)
        self.refused(64, "--output", "would be written over", "unpose", sitting, "-o", sitting)
        manifest = (sitting / "posed.json").read_text()
        (sitting / "posed.json").unlink()
        self.refused(65, "posed.json", "so nothing says what its files are", *words)
        for text in ("{}", "[", manifest.replace('"skin"', '"gut"'), manifest.replace('"by": "tets"', '"by": 3'), manifest.replace('"0": "soft"', '"0x": "soft"')):
            (sitting / "posed.json").write_text(text if text != manifest else "null")
            self.refused(65, "posed.json", "is not a manifest that pose wrote", *words)
        (sitting / "posed.json").write_text(manifest)
        self.ok(*words)

    def test_a_scan_of_another_body_is_refused(self):
        posed = self.pose("lib:sitting", "posed", "--tissues", "skin,femur_right", "--tets")
        manifest = json.loads((posed / "posed.json").read_text())
        first, second = manifest["surfaces"]
        for change, what in (({"vertices": first["vertices"] + 1}, "has not the vertices and triangles"),
                             ({"carried_by": "tets"}, "hangs 'femur_right' on tet -1 of ")):
            wrong = json.loads(json.dumps(manifest))
            wrong["surfaces"][1 if "carried_by" in change else 0].update(change)
            (posed / "posed.json").write_text(json.dumps(wrong))
            self.refused(65, "scan-surfaces.vtp", what, "unpose", posed, "-o", self.folder / "back")
        wrong = json.loads(json.dumps(manifest))
        wrong["surfaces"][0]["vertices"] -= 1
        wrong["surfaces"][1]["vertices"] += 1
        (posed / "posed.json").write_text(json.dumps(wrong))
        self.refused(65, "scan-surfaces.vtp", "vertices of another tissue", "unpose", posed, "-o", self.folder / "back")
        wrong = json.loads(json.dumps(manifest).replace('"of": "skin"', '"of": "femur_right"'))
        (posed / "posed.json").write_text(json.dumps(wrong))
        self.refused(65, "skin.stl", "triangles, which are not those of", "unpose", posed, "-o", self.folder / "back")

    def test_what_went_by_spheres_is_not_brought_back_by_tets(self):
        posed = self.pose("lib:sitting", "posed", "--volumes", "labels", "--tets")
        text = (posed / "posed.json").read_text()
        (posed / "posed.json").write_text(text.replace('"deformer": "tets"', '"deformer": "spheres"'))
        self.refused(65, "labels.nrrd", "was filled by spheres", "unpose", posed, "-o", self.folder / "back")


class OnePoseAFolder(Case):
    def test_an_earlier_pose_gives_way_as_a_whole(self):
        posed = self.pose("lib:sitting", "posed", "--tissues", "skin,liver", "--format", "ply", "--tets")
        self.assertEqual(sorted(contents(posed)), ["body.vtu", "liver.ply", "pose.yaml", "posed.json", "quality.json", "scan-surfaces.vtp", "skin.ply"])
        self.pose("lib:arms_up", "posed", "--tissues", "skin")
        self.assertEqual(contents(posed), contents(self.pose("lib:arms_up", "new", "--tissues", "skin")))
        self.pose("lib:sitting", "posed", "--as-case")
        self.pose("lib:sitting", "posed", "--tissues", "skin")
        self.assertEqual(sorted(path.name for path in posed.iterdir()), ["pose.yaml", "posed.json", "quality.json", "skin.stl"])

    def test_what_pose_did_not_write_stays(self):
        posed = self.pose("lib:sitting", "posed", "--tissues", "skin")
        (posed / "notes.txt").write_text("mine")
        before = contents(posed)
        words = ("pose", MODEL, "-o", posed, "--pose", "lib:arms_up", "--tissues", "skin")
        self.refused(73, "posed", "holds notes.txt, which is of no posed body here", *words)
        self.assertEqual(contents(posed), before)
        (posed / "notes.txt").unlink()
        (posed / "posed.json").unlink()
        self.refused(73, "posed", "holds pose.yaml, which is of no posed body here", *words)

    def test_frames_are_folders_of_their_own(self):
        out, walk = self.folder / "walk", CASE / "motion" / "walk.bvh"
        words = ("pose", MODEL, "-o", out, "--motion", walk, "--tissues", "skin", "--frames")
        self.ok(*words, "0:2")
        self.ok(*words, "1:3")  # more of them come beside, those of the same number give way
        self.assertEqual(sorted(path.name for path in out.iterdir()), ["frame_0000", "frame_0001", "frame_0002"])
        self.refused(73, "walk", "holds frame_0000", *words, "5")
        self.refused(73, "frame_0000", "is the folder of one posed body, not of frames",
                     "pose", MODEL, "-o", out / "frame_0000", "--motion", walk, "--tissues", "skin", "--frames", "0:2")
        # The pose beside it is what was posed: it makes the same again, to the last byte.
        again = self.pose(out / "frame_0002" / "pose.yaml", "again", "--tissues", "skin")
        self.assertEqual(contents(again), contents(out / "frame_0002"))

    def test_stopped_at_eight_points(self):
        out = self.folder / "out"
        words = [ECORCHE, "pose", str(MODEL), "-o", str(out), "--motion", str(CASE / "motion" / "walk.bvh"), "--frames", "0:4",
                 "--tissues", "skin,femur_right,liver", "--volumes", "labels"]
        start = time.monotonic()
        subprocess.run(words, check=True, capture_output=True, timeout=120)
        seconds = time.monotonic() - start
        whole = {path.name: contents(path) for path in out.iterdir()}
        left = []  # by those that were killed: each is swept by the next run that comes to its frame
        for n in range(8):
            # By turns into a new folder, and over frames that are there.
            if n % 4 < 2:
                shutil.rmtree(out, ignore_errors=True)  # the last one may have left none
            how = signal.SIGKILL if n % 2 else signal.SIGINT
            child = subprocess.Popen(words, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
            time.sleep(seconds * (n + 0.5) / 8)
            child.send_signal(how)
            self.assertIn(child.wait(timeout=60), (0, 130, -how))
            for frame in out.iterdir() if out.exists() else ():
                if how == signal.SIGKILL and (frame.name.startswith(".") or list(frame.glob(".*"))):
                    left.append(frame.name)
                    continue
                if frame.name in left:
                    continue
                self.assertEqual(contents(frame), whole.get(frame.name), f"{frame.name}, stop {n}")


class Ik(Case):
    def goals(self, goal):
        info = json.loads(self.ok("--json", "info", MODEL).stdout)
        file = self.folder / "ik.yaml"
        file.write_text(f"ecorche_ik: 1\nskeleton: {info['skeleton']}\nmove_root: true\ntargets: [{{segment: hand_left, goal: {goal}}}]\n"
                        f"pinned: [{{segment: foot_left}}]\nlook_at: [{{segment: head, at: [0, -5000, 1000]}}]\n")
        return file

    def test_the_pose_that_was_found(self):
        rig = {row["segment"]: row for row in json.loads(self.ok("--json", "info", MODEL).stdout)["rig"]}
        hand = rig["hand_left"]["center_mm"]
        ik = self.goals([hand[0], hand[1] - 120, hand[2] + 80])
        out = json.loads(self.ok("--json", "pose", MODEL, "-o", self.folder / "ik", "--ik", ik, "--tissues", "all", "--tets").stdout)
        self.assertTrue(out["ok"])
        found = out["frames"][0]["ik"]
        self.assertEqual([row["name"] for row in found["targets"]], ["hand_left", "foot_left (pinned)"])
        for row in found["targets"]:
            self.assertLess(row["residual_mm"], found["tolerance_mm"])
            self.assertAlmostEqual(np.linalg.norm(np.subtract(row["at_mm"], row["goal_mm"])), row["residual_mm"], delta=1e-9)
        self.assertEqual(len(found["root"]["rotation"]), 4)
        self.assertIn("off_deg", found["looks"][0])
        self.assertIn(rig["hand_left"]["joint"], found["angles"])
        # Its pose file makes the same folder, to the last byte.
        self.assertEqual(contents(self.pose(self.folder / "ik" / "pose.yaml", "again", "--tissues", "all", "--tets")), contents(self.folder / "ik"))

    def test_a_goal_that_is_missed(self):
        ik = self.goals([0, -5000, 0])
        ik.write_text(ik.read_text().replace("move_root: true\n", ""))
        words = ("--json", "pose", MODEL, "-o", self.folder / "ik", "--ik", ik, "--tissues", "skin")
        result = self.ok(*words)
        out = json.loads(result.stdout)
        self.assertFalse(out["ok"])
        self.assertFalse(out["frames"][0]["ik"]["reached"])
        hand = out["frames"][0]["ik"]["targets"][0]
        self.assertGreater(hand["residual_mm"], 1000)
        quality = json.loads((self.folder / "ik" / "quality.json").read_text())
        self.assertEqual((quality["verdict"], quality["warnings"][0]["kind"]), ("warn", "missed_goal"))
        self.assertEqual(quality["warnings"][0]["value"], hand["residual_mm"])
        told = run(*words[1:], "--fail-on-warn")  # the same, as people read it
        self.assertEqual(told.returncode, 1, told.stderr)
        self.assertRegex(told.stdout, r"^\S+: warn, ")
        self.assertIn(f"  warning: hand_left is {hand['residual_mm']:.1f} mm from its goal: beyond reach, limits or the other goals "
                      f"(it came to [{', '.join(f'{x:.1f}' for x in hand['at_mm'])}]: set the goal there", told.stdout)
        near = json.loads(self.ok(*words, "--ik-tolerance", "9000").stdout)
        self.assertTrue(near["ok"], "as far as one may miss")
        self.assertEqual([w for w in near["frames"][0]["quality"]["warnings"] if w["kind"].startswith("missed")], [])


if __name__ == "__main__":
    unittest.main()
