#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""The command as its users meet it: exit codes, messages, --json, interruption, and that nothing is left half written."""
import json
import os
import pathlib
import re
import shutil
import signal
import subprocess
import tempfile
import time
import unittest

import meshio

ECORCHE = os.environ["ECORCHE_BIN"]
CASE = pathlib.Path(os.environ["ECORCHE_CASE"])
MODEL = pathlib.Path(os.environ["ECORCHE_MODEL"])
ERROR_LINE = re.compile(r"^error: .+: .+ \(.+\)$", re.M)


def run(*words, **options):
    return subprocess.run([ECORCHE, *map(str, words)], capture_output=True, text=True, timeout=120, **options)


class Cli(unittest.TestCase):
    def setUp(self):
        self.folder = pathlib.Path(tempfile.mkdtemp())
        self.addCleanup(shutil.rmtree, self.folder)

    def assert_error(self, result, code, *parts):
        self.assertEqual(result.returncode, code, result.stderr)
        self.assertEqual(result.stdout, "", "a failed command prints no result")
        self.assertRegex(result.stderr, ERROR_LINE)
        for part in parts:
            self.assertIn(part, result.stderr)

    def test_a_refused_model_shows_its_worst_tets(self):
        def box(name, low, high):
            corners = [(x, y, z) for z in (low[2], high[2]) for y in (low[1], high[1]) for x in (low[0], high[0])]
            faces = [(0, 2, 1), (1, 2, 3), (4, 5, 6), (5, 7, 6), (0, 1, 4), (1, 5, 4), (2, 6, 3), (3, 6, 7), (0, 4, 2), (2, 4, 6),
                     (1, 3, 5), (3, 7, 5)]
            (self.folder / name).write_text("".join("v %g %g %g\n" % p for p in corners)
                                            + "".join("f %d %d %d\n" % tuple(c + 1 for c in f) for f in faces))

        box("skin.obj", (0, 0, 0), (60, 60, 120))
        box("plate.obj", (20, 20, 20), (40, 40, 20.01))  # a bone of a hundredth of a millimetre: its tets are slivers
        box("block.obj", (20, 20, 80), (40, 40, 100))
        (self.folder / "skeleton.yaml").write_text(
            "ecorche_skeleton: 1\nname: two\nsegments:\n  lower:\n    joint: {name: base, kind: ball, center: [30, 30, 20]}\n"
            "  upper:\n    parent: lower\n    joint: {name: mid, kind: ball, center: [30, 30, 60]}\n")
        (self.folder / "case.yaml").write_text(
            "name: thin\nskeleton: skeleton.yaml\nskin: skin.obj\nbones:\n  - {name: plate, file: plate.obj, segment: lower}\n"
            "  - {name: block, file: block.obj, segment: upper}\n")
        model, shown = self.folder / "m.hdf", self.folder / "m.refused.vtu"
        result = run("preprocess", self.folder, "-o", model, "--mesher", "tetgen", "--voxel", "4")
        if result.returncode == 64:
            self.skipTest("this build has no TetGen")
        self.assert_error(result, 65, "min_dihedral_deg is ", "the bound is >= 0.5", f"its 1000 worst tets are in {shown};")
        self.assertFalse(model.exists())
        header = shown.read_bytes()[:3000].decode(errors="replace")
        self.assertRegex(header, r'NumberOfCells="1000\s*"')
        for name in ("label", "tet", "least_dihedral_deg", "greatest_dihedral_deg", "volume_mm3"):
            self.assertIn(f'Name="{name}"', header)
        found = re.search(r'Name="least_dihedral_deg"[^>]*RangeMin="([^"]+)"', header)
        self.assertLess(float(found[1]), 0.5)

    def test_help_and_version(self):
        self.assertEqual(run("--version").returncode, 0)
        out = run("--help").stdout
        commands = ("phantom", "check", "repair", "preprocess", "info", "verify", "export", "pose", "motion", "unpose",
                    "thin", "serve", "stream")
        for word in (*commands, "not for planning surgery"):
            self.assertIn(word, out)
        for word in commands:
            self.assertEqual(run(word, "--help").returncode, 0)

    def test_usage_errors(self):
        self.assert_error(run(), 64, "subcommand")
        self.assert_error(run("dance"), 64)
        self.assert_error(run("preprocess"), 64)
        self.assert_error(run("preprocess", CASE, "-o", self.folder / "m.hdf", "--mesher", "magic"), 64, "magic")
        self.assert_error(run("preprocess", CASE, "-o", self.folder / "m.hdf", "--solver", "magic"), 64, "magic")
        self.assert_error(run("preprocess", CASE, "-o", self.folder / "m.hdf", "--cor-sigma", "0.2"), 64, "cor-sigma")
        self.assert_error(run("preprocess", CASE, "-o", self.folder / "m.vtk"), 64, ".hdf")
        self.assert_error(run("preprocess", CASE, "-o", self.folder / "m.hdf", "--max-tets", "-5"), 64, "max-tets")
        self.assert_error(run("phantom", "-o", self.folder / "p", "--size", "huge"), 64, "huge not in {small,standard,paper}")
        self.assert_error(run("phantom", "-o", self.folder / "p", "--voxel", "0.1"), 64, "--voxel")
        self.assert_error(run("phantom", "-o", self.folder / "p", "--voxel", "5", "--bar"), 64, "--voxel")
        self.assert_error(run("pose", MODEL, "-o", self.folder / "p", "--skinning", "flesh"), 64, "flesh")
        self.assert_error(run("pose", MODEL, "-o", self.folder / "p", "--tissues", "nonsense"), 64, "nonsense")
        self.assertEqual(list(self.folder.glob("**/*.hdf")), [])

    def test_missing_inputs(self):
        self.assert_error(run("preprocess", self.folder / "none", "-o", self.folder / "m.hdf"), 66, "none")
        self.assert_error(run("verify", self.folder / "none.hdf"), 66, "none.hdf")
        self.assert_error(run("info", self.folder / "none.hdf"), 66)
        self.assert_error(run("pose", self.folder / "none.hdf", "-o", self.folder / "p"), 66)
        self.assert_error(run("check", self.folder / "none"), 66)
        self.assert_error(run("serve", self.folder / "none.hdf"), 66)
        self.assert_error(run("pose", MODEL, "-o", self.folder / "p", "--pose", self.folder / "none.yaml"), 66)

    def test_a_file_that_is_no_model(self):
        wrong = self.folder / "wrong.hdf"
        wrong.write_bytes(b"this is no HDF5 file" * 100)
        for command in ("verify", "info"):
            self.assert_error(run(command, wrong), 65, "wrong.hdf")
        cut = self.folder / "cut.hdf"
        cut.write_bytes(MODEL.read_bytes()[: MODEL.stat().st_size // 2])
        self.assert_error(run("info", cut), 65, "cut.hdf")

    def test_outputs_that_cannot_be_made(self):
        blocker = self.folder / "file"
        blocker.write_text("in the way")
        self.assert_error(run("phantom", "-o", blocker / "deeper"), 73)
        self.assert_error(run("pose", MODEL, "-o", blocker / "deeper", "--motion", CASE / "motion" / "walk.bvh",
                              "--frames", "0:1"), 73)
        self.assert_error(run("preprocess", CASE, "-o", self.folder / "absent" / "m.hdf"), 73, "m.hdf")
        self.assertEqual(blocker.read_text(), "in the way")

    def test_names_longer_than_the_system_has(self):
        long = "n" * 300
        for words, ending in ((("phantom",), ""), (("preprocess", CASE), ".hdf"), (("pose", MODEL, "--pose", "lib:supine"), ""),
                              (("export", MODEL), ".glb"), (("fem", MODEL, "--pose", "lib:supine"), ""),
                              (("calibrate", MODEL), ".hdf")):
            self.assert_error(run(*words, "-o", self.folder / (long + ending)), 73, "File name too long")
        for words in (("info", f"{long}.hdf"), ("check", f"{long}.stl"), ("pose", MODEL, "-o", self.folder / "p", "--pose", f"{long}.yaml"),
                      ("pose", MODEL, "-o", self.folder / "p", "--motion", f"{long}.bvh", "--frames", "0:1"), ("new", f"{long}.nii.gz", "-o", self.folder / "c"),
                      ("unpose", long, "-o", self.folder / "u")):
            self.assert_error(run(*words), 66)
        self.assertEqual(list(self.folder.iterdir()), [])

    def test_a_wrong_case_names_file_line_and_key(self):
        case = self.folder / "case.yaml"
        text = (CASE / "case.yaml").read_text()
        case.write_text(text + "\nsurprise: 1\n")
        self.assert_error(run("preprocess", case, "-o", self.folder / "m.hdf"), 78, "case.yaml:", "surprise")

    def test_a_case_is_looked_at_first_where_asked(self):
        case = self.folder / "case"
        shutil.copytree(CASE, case)
        text = (case / "case.yaml").read_text()
        (case / "case.yaml").write_text(re.sub(r"(?m)^skin: .*$", "skin: {file: skin.stl, unit: um}", text))
        looked = run("check", case)
        self.assertEqual(looked.returncode, 65, looked.stdout)
        refused = run("preprocess", case, "-o", self.folder / "m.hdf", "--check")
        self.assertEqual(refused.returncode, 65, refused.stderr)
        self.assertIn(re.search(r"(?m)^error: ([^:]*: [^,(]*)", looked.stdout).group(1).strip(), refused.stderr)

    def test_warnings_fail_where_that_is_asked(self):
        good = [("check", CASE), ("rig", CASE), ("verify", MODEL)]
        coarse = self.folder / "coarse.hdf"  # arms grow together with the trunk
        warned = [("preprocess", CASE, "-o", coarse, "--max-tets", 15000), ("verify", coarse)]
        case = self.folder / "case"
        shutil.copytree(CASE, case)
        data = bytearray((case / "bones" / "tibia_right.stl").read_bytes())
        data[80:84] = (int.from_bytes(data[80:84], "little") - 3).to_bytes(4, "little")
        (case / "bones" / "tibia_right.stl").write_bytes(data[:-150])  # three triangles less: a hole
        warned.append(("check", case))
        for words in good:
            self.assertEqual(run("--fail-on-warn", *words).returncode, 0, words)
        for words in warned:
            asked = run("--fail-on-warn", *words)
            self.assertEqual(asked.returncode, 1, f"{words}: {asked.stderr}")
            self.assertNotEqual(asked.stdout, "", "all is written")
            self.assertEqual(run(*words).returncode, 0, words)

    def test_a_wrong_pose_is_refused(self):
        pose = self.folder / "pose.yaml"
        skeleton = re.search(r"^name: (\S+)", (CASE / "skeleton.yaml").read_text(), re.M).group(1)
        pose.write_text(f"ecorche_pose: 1\nskeleton: {skeleton}\njoints: {{third_elbow: {{flexion_deg: 3}}}}\n")
        self.assert_error(run("pose", MODEL, "-o", self.folder / "p", "--pose", pose), 78, "third_elbow")
        self.assertFalse((self.folder / "p").exists() and any((self.folder / "p").iterdir()), "nothing may be written")

    def test_the_certificate_is_read_beside_its_bounds_and_the_docs_say_the_same(self):
        done = run("--json", "info", "--certificate", MODEL)
        self.assertEqual(done.returncode, 0, done.stderr)
        rows = json.loads(done.stdout)["certificate"]
        self.assertEqual({row["figure"]: row["value"] for row in rows}, json.loads(run("--json", "info", MODEL).stdout)["certificate"])
        self.assertTrue(all(row["kept"] for row in rows))
        judged = [(row["figure"], row["bound"], row["reason"]) for row in rows if row["bound"]]
        docs = (pathlib.Path(__file__).parents[3] / "docs" / "reference" / "model.md").read_text()
        table = docs.split("| figure | bound | because |\n|---|---|---|\n")[1].split("\n\n")[0]
        said = [tuple(cell.strip().strip("`") for cell in line.strip("|").split("|")) for line in table.splitlines()]
        self.assertEqual(said, judged)
        text = run("info", "--certificate", MODEL).stdout
        for figure, bound, reason in judged:
            self.assertRegex(text, rf"(?m)^{figure} +[-0-9.e+]+  {re.escape(bound)} +{re.escape(reason)}$")
        self.assertIn("not for planning surgery", text)

    def test_tets_go_to_other_programs(self):
        files = [self.folder / name for name in ("a.vtu", "a.msh", "a.ele", "a.inp", "a.mcnp.inp")]
        done = run("--json", "export", MODEL, "-o", *files)
        self.assertEqual(done.returncode, 0, done.stderr)
        tets = json.loads(done.stdout)["tets"]
        self.assertIn(f"\n{tets} 4 1\n", files[2].read_text())
        self.assertTrue((self.folder / "a.node").is_file())
        self.assertIn("*Elset, elset=Set-material_tally_001", files[4].read_text())
        self.assertEqual(run("export", MODEL, "-o", files[0], "--weights").returncode, 0)
        weights = {name: values for name, values in meshio.read(files[0]).point_data.items() if name.startswith("weight_")}
        self.assertEqual(len(weights), len(json.loads(run("--json", "info", MODEL).stdout)["rig"]))
        self.assertLess(abs(sum(weights.values()) - 1).max(), 1e-5)
        self.assert_error(run("export", MODEL, "-o", self.folder / "a.txt"), 64, "cannot write tets as '.txt'")
        self.assert_error(run("export", self.folder / "none.hdf", "-o", self.folder / "b.msh"), 66)
        pose = self.folder / "pose.yaml"
        skeleton = re.search(r"^name: (\S+)", (CASE / "skeleton.yaml").read_text(), re.M).group(1)
        pose.write_text(f"ecorche_pose: 1\nskeleton: {skeleton}\n")
        out = self.folder / "posed"
        done = run("pose", MODEL, "-o", out, "--pose", pose, "--tets", "--tet-format", "msh,ele,mcnp",
                   "--tissues", "none", "--volumes", "none")
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertEqual(sorted(path.name for path in out.iterdir()),
                         ["body.ele", "body.mcnp.inp", "body.msh", "body.node", "pose.yaml", "posed.json", "quality.json"])

    def test_json_is_one_object(self):
        info = json.loads(run("--json", "info", MODEL).stdout)
        self.assertGreater(info["nodes"], 100)
        verify = run("--json", "verify", MODEL)
        self.assertEqual(verify.returncode, 0, verify.stderr)
        report = json.loads(verify.stdout)
        self.assertTrue(report["ok"])
        for key in ("nodes", "tets", "segments", "weights", "mesh", "tissues", "bones", "digests"):
            self.assertIn(key, report)
        self.assertEqual(report["digests"]["bad"], 0)

    def test_a_flipped_byte_fails_verify(self):
        bytes_ = bytearray(MODEL.read_bytes())
        bytes_[len(bytes_) // 2] ^= 0x40
        (self.folder / "flipped.hdf").write_bytes(bytes_)
        result = run("verify", self.folder / "flipped.hdf")
        self.assertEqual(result.returncode, 65, result.stderr)

    def test_interrupted_at_many_points_leaves_nothing(self):
        for wait in (0.05, 0.3, 0.8, 1.5, 2.5):
            child = subprocess.Popen([ECORCHE, "preprocess", str(CASE), "-o", str(self.folder / "m.hdf")],
                                     stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True)
            time.sleep(wait)
            child.send_signal(signal.SIGINT)
            start = time.monotonic()
            _, err = child.communicate(timeout=60)
            if child.returncode == 0:  # it was done before the signal
                (self.folder / "m.hdf").unlink()
                continue
            self.assertIn(child.returncode, (130, -signal.SIGINT), err)
            self.assertLess(time.monotonic() - start, 5, f"slow to stop after {wait} s (a busy machine is allowed for)")
            self.assertEqual(list(self.folder.iterdir()), [], f"something was left after {wait} s")

    def test_a_stop_that_comes_when_the_model_is_written_is_too_late(self):
        target = self.folder / "m.hdf"
        child = subprocess.Popen([ECORCHE, "preprocess", str(CASE), "-o", str(target)],
                                 stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True)
        while child.poll() is None and not target.exists():
            time.sleep(0.0005)
        child.send_signal(signal.SIGINT)
        _, err = child.communicate(timeout=60)
        self.assertEqual(child.returncode, 0, err)
        self.assertEqual(list(self.folder.iterdir()), [target])

    def test_killed_at_many_points_leaves_the_old_model_whole(self):
        target = self.folder / "m.hdf"
        shutil.copy(MODEL, target)
        before = target.read_bytes()
        for wait in (0.2, 0.9, 2.0):
            child = subprocess.Popen([ECORCHE, "preprocess", str(CASE), "-o", str(target)],
                                     stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
            time.sleep(wait)
            child.kill()
            child.wait()
            after = target.read_bytes()
            if after != before:
                self.assertEqual(run("verify", target).returncode, 0, "a new model that appeared must be whole")
                before = after


if __name__ == "__main__":
    unittest.main(verbosity=2)
