#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Motion files of every kind through the command: the way through, and each refusal with exit code and message."""
import contextlib
import importlib.machinery
import importlib.util
import io
import json
import os
import pathlib
import re
import shutil
import subprocess
import tempfile
import unittest

ECORCHE = os.environ["ECORCHE_BIN"]
CASE = pathlib.Path(os.environ["ECORCHE_CASE"])
MODEL = pathlib.Path(os.environ["ECORCHE_MODEL"])
WALK = CASE / "motion" / "walk.bvh"
ERROR_LINE = re.compile(r"^error: .+: .+ \(.+\)$", re.M)

MOT = "walk\nnRows=3\nnColumns=3\ninDegrees=yes\nendheader\ntime knee_angle_r pelvis_ty\n0 10 1\n0.1 20 1\n0.2 30 1.1\n"
ASF = """:version 1.10
:units
  length 0.45
  angle deg
:root
  order TX TY TZ RX RY RZ
  axis XYZ
  position 0 0 0
  orientation 0 0 0
:bonedata
  begin
    id 1
    name rhip
    direction -1 -0.2 0
    length 1.5
    axis 0 0 0 XYZ
  end
  begin
    id 2
    name rfemur
    direction 0 -1 0
    length 7.2
    axis 0 0 0 XYZ
    dof rx ry rz
  end
  begin
    id 3
    name rtibia
    direction 0 -1 0
    length 7.2
    axis 0 0 0 XYZ
    dof rx
  end
  begin
    id 4
    name rfoot
    direction 0 0 1
    length 2
    axis 0 0 0 XYZ
  end
:hierarchy
  begin
    root rhip
    rhip rfemur
    rfemur rtibia
    rtibia rfoot
  end
"""
AMC = ":DEGREES\n1\nroot 0 17 0 0 0 0\nrfemur 0 0 0\nrtibia 0\n2\nroot 0 17 0 0 0 0\nrfemur -30 0 0\nrtibia 40\n"


def run(*words):
    return subprocess.run([ECORCHE, *map(str, words)], capture_output=True, text=True, timeout=120)


class Motion(unittest.TestCase):
    def setUp(self):
        self.folder = pathlib.Path(tempfile.mkdtemp())
        self.addCleanup(shutil.rmtree, self.folder)

    def put(self, name, text):
        (self.folder / name).write_text(text)
        return self.folder / name

    def ok(self, *words):
        result = run(*words, "--json")
        self.assertEqual(result.returncode, 0, result.stderr)
        return json.loads(result.stdout)

    def refused(self, code, part, *words):
        result = run(*words)
        self.assertEqual(result.returncode, code, result.stderr)
        self.assertEqual(result.stdout, "")
        self.assertRegex(result.stderr, ERROR_LINE)
        self.assertIn(part, result.stderr)

    def motion(self, file, *more):
        return ("motion", file, "--model", MODEL, *more)

    def test_report(self):
        report = self.ok(*self.motion(WALK))
        self.assertEqual(report["frames"], 72)
        self.assertTrue(all(segment["moved"] for segment in report["match"]["segments"]))
        self.assertAlmostEqual(report["match"]["figure_to_patient"], 1, delta=0.05)
        self.assertEqual(len(report["foot_sliding"]), 4)
        # It walks in place, by curves that nobody walked: over the ground that goes by its feet slide by less than that goes.
        self.assertTrue(600 < report["ground_mm_per_s"][1] < 850 and abs(report["ground_mm_per_s"][0]) < 20, report["ground_mm_per_s"])
        self.assertLess(max(foot["mean_mm_per_s"] for foot in report["foot_sliding"]), 450)
        self.assertIn("walks in place: the ground goes by at 7", run(*self.motion(WALK)).stdout)
        self.assertIn("beyond limits", run(*self.motion(WALK)).stdout)

    def test_against(self):
        same = self.ok(*self.motion(WALK, "--against", WALK, "--most-deg", "1"))
        self.assertLess(max(joint["worst_deg"] for joint in same["differences"]), 1e-5)
        apart = run(*self.motion(WALK, "--against", CASE / "motion" / "bend.bvh", "--most-deg", "5"))
        self.assertEqual(apart.returncode, 1, apart.stderr)
        self.assertIn("mean without a constant turn", apart.stdout)
        self.assertEqual(same["begins_later_s"], 0)
        self.assertIn("the clip, most of all at frame", same["aligned_at"])
        # The same take, its first two frames cut off.
        lines = WALK.read_text().split("\n")
        first = next(i for i, text in enumerate(lines) if text.startswith("Frame Time")) + 1
        frames = next(i for i, text in enumerate(lines) if text.startswith("Frames:"))
        lines[frames] = "Frames: 70"
        cut = self.put("cut.bvh", "\n".join(lines[:first] + lines[first + 2:]))
        later = self.ok(*self.motion(WALK, "--motion-rest", "zero", "--against", cut, "--most-deg", "1"))
        self.assertAlmostEqual(later["begins_later_s"], -2 * later["frame_seconds"], delta=1e-9)
        self.assertLess(max(joint["mean_deg"] for joint in later["differences"]), 0.01)

    def test_every_format_poses(self):
        self.put("subject.asf", ASF)
        for file in (self.put("subject_1.amc", AMC), self.put("walk.mot", MOT)):
            out = self.folder / file.stem
            done = self.ok("pose", MODEL, "-o", out, "--motion", file, "--frames", "0:2", "--tissues", "skin")
            self.assertEqual([frame["name"] for frame in done["frames"]], ["frame_0000", "frame_0001"])
        # 40 degrees are asked of the knee; the zero pose of that skeleton is a straight leg.
        report = self.ok(*self.motion(self.folder / "subject_1.amc"))
        self.assertIn("shank_right", [s["segment"] for s in report["match"]["segments"] if s["moved"]])

    def test_library_and_sequence(self):
        done = self.ok("pose", MODEL, "-o", self.folder / "sit", "--pose", "lib:sitting", "--tissues", "skin")
        self.assertTrue((self.folder / "sit" / "quality.json").exists())
        self.assertEqual(len(done["frames"]), 1)
        name = self.ok("info", MODEL)["skeleton"]
        keys = f"ecorche_pose_sequence: 1\nskeleton: {name}\nframes_per_second: 4\nkeys:\n" \
               "  - {time_s: 0}\n  - {time_s: 1, pose: lib:arms_up}\n"
        file = self.put("up.yaml", keys)
        self.assertEqual(self.ok(*self.motion(file))["frames"], 5)
        self.ok("pose", MODEL, "-o", self.folder / "up", "--motion", file, "--frames", "4", "--tissues", "skin")
        self.refused(78, "keys[0].pose", *self.motion(self.put("bad.yaml", keys.replace("time_s: 0", "time_s: 0, pose: a.yaml, root: {}"))))

    def test_goals(self):
        info = self.ok("info", MODEL)
        center = {row["segment"]: row["center_mm"] for row in info["rig"]}
        goal = [center["hand_left"][0], center["hand_left"][1] - 250, center["hand_left"][2] + 150]
        text = f"ecorche_ik: 1\nskeleton: {info['skeleton']}\ntargets: [{{segment: hand_left, goal: {goal}}}]\n"
        file = self.put("ik.yaml", text)
        result = run("pose", MODEL, "-o", self.folder / "out", "--ik", file, "--tissues", "skin", "--json")
        self.assertEqual(result.returncode, 0, result.stderr)
        self.assertRegex(result.stderr, r"note: hand_left is 0\.[01] mm from its goal")
        far = self.put("far.yaml", text.replace(str(goal), "[0, -5000, 0]"))
        result = run("pose", MODEL, "-o", self.folder / "far", "--ik", far, "--tissues", "skin")
        self.assertEqual(result.returncode, 0)
        self.assertIn("mm from its goal: beyond reach", result.stdout)
        self.refused(64, "--ik stands beside", "pose", MODEL, "-o", self.folder / "x", "--ik", file, "--pose", "lib:sitting")
        self.refused(78, "unknown segment", "pose", MODEL, "-o", self.folder / "x", "--ik", self.put("bad.yaml", text.replace("hand_left", "wing")))

    # The joints of a walk as markers: what inverse kinematics makes of them is that walk.
    def test_markers(self):
        info = self.ok("info", MODEL)
        names = [row["joint"] for row in info["rig"]]
        center = [row["center_mm"] for row in info["rig"]]
        rows = []
        for frame in range(3):
            at = [f"{x / 10}\t{z / 10}\t{-(y - 50 * frame) / 10}" for x, y, z in center]
            rows.append(f"{frame + 1}\t{frame / 100}\t" + "\t".join(at))

        def trc(markers, unit):
            head = "PathFileType\t4\t(X/Y/Z)\ta.trc\nDataRate\tCameraRate\tNumFrames\tNumMarkers\tUnits\n" \
                   f"100\t100\t3\t{len(markers)}\t{unit}\nFrame#\tTime\t" + "\t\t\t".join(markers) + "\t\t\n\t\tX1\n"
            return self.put(f"{unit}_{markers[0]}.trc", head + "\n".join(rows) + "\n")

        file, metres = trc(names, "cm"), trc(names, "m")
        self.assertEqual(self.ok(*self.motion(file))["frames"], 3)
        for markers, unit in ((file, ()), (metres, ("--motion-unit", "body"))):
            out = self.folder / markers.stem
            self.ok("pose", MODEL, "-o", out, "--motion", markers, "--frames", "2", "--format", "obj", "--tissues", "skin", *unit)
            rest = self.folder / "rest"
            self.ok("pose", MODEL, "-o", rest, "--pose", self.put("rest.yaml", f"ecorche_pose: 1\nskeleton: {info['skeleton']}\n"),
                    "--format", "obj", "--tissues", "skin")
            moved, still = [[tuple(map(float, line.split()[1:])) for line in (folder / "skin.obj").read_text().splitlines() if line[:2] == "v "]
                            for folder in (out, rest)]
            self.assertLess(max(abs(a[1] + 100 - b[1]) for b, a in zip(still, moved)), 5)
        self.refused(65, "times as far apart as on the patient", *self.motion(metres))
        rows[0] = "\t".join(rows[0].split("\t")[:5]) + "\t\t\t" * (len(names) - 1)
        self.refused(65, "too few markers are seen in its first frame", *self.motion(trc(names, "mm")))
        self.refused(65, "markers have a place on the body", *self.motion(trc([f"m{i}" for i in range(len(names))], "cm")))

    # Clips that lie, one line each; unit_io_motion has every message of every format.
    def test_clips_that_lie(self):
        text = WALK.read_text()
        frames = next(line for line in text.splitlines() if line.startswith("Frames:"))
        root, joint = (re.search(word + r" (\S+)", text).group(1) for word in ("ROOT", "JOINT"))
        for name, spoilt, part in (
                ("many", text.replace(frames, "Frames: 71"), "expected the file's end after the last frame"),
                ("few", text.replace(frames, "Frames: 73"), "expected a number, the file ends"),
                ("huge", text.replace(frames, "Frames: 4000000000"), "more than the file can hold"),
                ("channels", text.replace("CHANNELS 3", "CHANNELS 2", 1), "expected JOINT, End Site or '}'"),
                ("twice", text.replace(f"JOINT {joint}", f"JOINT {root}", 1), "stands twice"),
                ("cut", text[:len(text) // 3], "the file ends"),
                ("hundred", re.sub(r"OFFSET (\S+) (\S+) (\S+)", lambda m: "OFFSET " + " ".join(str(100 * float(x)) for x in m.groups()), text),
                 "its unit is another"),
                ("time", re.sub(r"Frame Time: \S+", "Frame Time: 0", text), "frame time is not positive")):
            with self.subTest(name):
                self.refused(65, part, *self.motion(self.put(f"{name}.bvh", spoilt)))
        for name, asf, amc, part in (
                ("circle", ASF.replace("rtibia rfoot", "rtibia rfoot\n    rfoot rfemur"), AMC, "has two parents"),
                ("orphan", ASF.replace("root rhip", "rtibia rhip"), AMC, "has children before it has a parent"),
                ("roots", ASF.replace(":bonedata", ":root\n  order TX\n:bonedata"), AMC, "has two roots"),
                ("dof", ASF.replace("order TX TY", "order TQ TY"), AMC, "expected a degree of freedom such as rx"),
                ("section", ASF.replace(":bonedata", ":bones"), AMC, "expected a section such as :bonedata"),
                ("unit", ASF.replace("angle deg", "angle gon"), AMC, "expected deg or rad, found 'gon'"),
                ("name", ASF.replace("    name rfoot\n", ""), AMC, "a bone has no name"),
                ("bone", ASF, AMC.replace("rfemur 0 0 0", "rfemur 0 0 0\nrfemur 0 0 0"), "stands twice in one frame"),
                ("values", ASF, AMC.replace("rfemur 0 0 0", "rfemur 0 0"), "expected a number"),
                ("gap", ASF, AMC.replace("\n2\n", "\n3\n"), "frame 3 stands where 2")):
            with self.subTest(name):
                self.put(f"{name}.asf", asf)
                self.refused(65, part, *self.motion(self.put(f"{name}.amc", amc)))
        self.refused(65, "says 4 rows and has 3", *self.motion(self.put("rows.mot", MOT.replace("nRows=3", "nRows=4"))))
        gltf = {"asset": {"version": "2.0"}, "nodes": [{"name": "pelvis", "children": [1]}, {"name": "thigh_left", "children": [0]}],
                "skins": [{"joints": [0, 1]}], "animations": [{"channels": [], "samplers": []}]}
        self.refused(65, "circle.gltf", *self.motion(self.put("circle.gltf", json.dumps(gltf))))

    # The table of docs/reference/motion.md, on the phantom's own clip; its figure as other means read it moves as the body does.
    def test_table_of_clips(self):
        bench = pathlib.Path(__file__).resolve().parents[3] / "bench" / "clips" / "run"
        loader = importlib.machinery.SourceFileLoader("clips", str(bench))
        clips = importlib.util.module_from_spec(importlib.util.spec_from_loader("clips", loader))
        loader.exec_module(clips)
        clips.programs.ECORCHE = ECORCHE
        columns = clips.Table(*12 * [""])
        (self.folder / "cmu_31joint").mkdir()
        file = self.folder / "cmu_31joint" / WALK.name
        shutil.copy(WALK, file)
        said = io.StringIO()
        with contextlib.redirect_stdout(said):
            clips.played(file, MODEL, columns)
            self.assertTrue(clips.agree(file, file, MODEL, columns))
        self.assertRegex(said.getvalue(), r"walk.bvh +\| +72 \| \d+/\d+ .*\| +\d+ \|")
        self.assertRegex(said.getvalue(), r"most of all at frame \d+ \| \w+ 0\.0 .*\| \w+ 0\.0 \|")
        other = self.folder / "cmu_31joint" / "bend.bvh"
        shutil.copy(CASE / "motion" / "bend.bvh", other)
        with contextlib.redirect_stdout(said):
            self.assertFalse(clips.agree(file, other, MODEL, columns))

    # What a clip takes in memory does not grow with it: a hundred times as long, 9 MiB on the disk.
    def test_long_clips_stay_on_the_disk(self):
        head, rows = re.split(r"(?<=\n)(?=Frames:)", WALK.read_text())
        count, step, *frames = rows.strip().splitlines()

        def peak(times):
            file = self.folder / f"long_{times}.bvh"
            with file.open("w") as out:
                out.write(f"{head}Frames: {times * len(frames)}\n{step}\n")
                for _ in range(times):
                    out.write("\n".join(frames) + "\n")
            with open(os.devnull, "w") as null:
                child = subprocess.Popen([ECORCHE, "motion", file, "--model", MODEL, "--json"], stdout=null, stderr=null)
                _, status, usage = os.wait4(child.pid, 0)
            child.returncode = os.waitstatus_to_exitcode(status)
            self.assertEqual(child.returncode, 0)
            return file.stat().st_size / 2**20, usage.ru_maxrss / 1024

        (small, low), (large, high) = peak(2), peak(200)
        print(f"{small:.1f} MiB of clip: {low:.1f} MiB of memory; {large:.1f} MiB: {high:.1f} MiB")
        self.assertGreater(large - small, 8)
        self.assertLess(high - low, 3)

    # A clip in inches, read as a .bvh is.
    def test_a_figure_of_another_size_is_said_with_its_unit(self):
        scaled = re.sub(r"OFFSET (\S+) (\S+) (\S+)", lambda m: "OFFSET " + " ".join(str(float(x) / 2.54) for x in m.groups()), WALK.read_text())
        inches = self.put("inches.bvh", scaled)

        def warnings(*words):
            done = subprocess.run([ECORCHE, *map(str, self.motion(inches, *words))], capture_output=True, text=True)
            self.assertEqual(done.returncode, 0, done.stderr)
            return [line for line in done.stderr.splitlines() if "limbs of its figure" in line]

        said = r"^warning: .*inches\.bvh: the limbs of its figure are {} times as long as the patient's, read in {}: --motion-unit in would " \
               r"make that (1|1\.0\d|0\.9\d+): --motion-unit body would fit them to the patient$"
        for words, figure, unit in (((), r"0\.[34]\d+", "cm"), (("--motion-unit", "17"), r"0\.[67]\d+", "17")):
            lines = warnings(*words)
            self.assertEqual(len(lines), 1, lines)
            self.assertRegex(lines[0], said.format(figure, unit))
        self.assertEqual(warnings("--motion-unit", "in"), [])
        self.assertEqual(warnings("--motion-unit", "body"), [])

    def test_refusals(self):
        text = WALK.read_text()
        self.refused(66, "none.bvh", *self.motion(self.folder / "none.bvh"))
        self.refused(64, "is no ending of a motion file", *self.motion(self.put("a.fbx", "x")))
        lines = text.rstrip().splitlines(keepends=True)
        self.refused(65, "expected a number, the file ends", *self.motion(self.put("cut.bvh", "".join(lines[:-5]))))
        self.refused(65, "is not finite", *self.motion(self.put("nan.bvh", text.rstrip().rsplit(" ", 1)[0] + " nan\n")))
        self.refused(65, "times as long as the patient's: its unit is another", *self.motion(WALK, "--motion-unit", "m"))
        self.refused(65, "is no glTF", *self.motion(self.put("a.gltf", "hello")))
        self.refused(65, "no 'endheader'", *self.motion(self.put("a.mot", "hello\n")))
        self.refused(65, "none of its columns", *self.motion(self.put("b.mot", MOT.replace("knee_angle_r", "wing"))))
        self.refused(66, "its skeleton is not beside it", *self.motion(self.put("alone.amc", AMC)))
        asf = self.put("bad.asf", ASF.replace("rhip rfemur", "rhip rhip"))
        self.refused(65, "has two parents", *self.motion(self.put("bad.amc", AMC)))
        self.refused(65, "has two parents", *self.motion(WALK.parent.parent / "motion" / "walk.bvh", "--motion-rest", f"{self.folder}/bad.amc:0", "--asf", asf))
        self.refused(64, "is no unit", *self.motion(WALK, "--motion-unit", "ell"))
        self.refused(64, "names no axes", *self.motion(WALK, "--motion-frame", "XYZ"))
        self.refused(64, "is no reference", *self.motion(WALK, "--motion-rest", "first"))
        self.refused(64, "the clip has 72 frames (count from 0)", *self.motion(WALK, "--motion-rest", f"{WALK}:72"))
        self.refused(64, "the clip has frames 0 to 71", *self.motion(WALK, "--motion-rest", "72"))
        self.refused(78, "the clip has no joint 'Knee'",
                     *self.motion(WALK, "--map", self.put("map.yaml", "ecorche_motion_map: 1\njoints: {Knee: pelvis}\n")))
        self.refused(64, "has no pose 'siting'", "pose", MODEL, "-o", self.folder / "x", "--pose", "lib:siting")


if __name__ == "__main__":
    unittest.main()
