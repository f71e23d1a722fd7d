#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Killed, interrupted, without rights, on a full disk: whatever stands under a final name is whole."""
import os
import pathlib
import resource
import shutil
import signal
import subprocess
import tempfile
import time
import unittest

import body

ECORCHE = os.environ["ECORCHE_BIN"]
CASE = pathlib.Path(os.environ["ECORCHE_CASE"])
PREPARE = ["--mesher", "lattice", "--max-tets", "30000"]
NOBODY = 65534


def run(words, **options):
    return subprocess.run([ECORCHE, *map(str, words)], capture_output=True, text=True, timeout=60, **options)


def small_files_only():
    """A disk with 20 KB left: writing more fails, as it does on a full one."""
    signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
    resource.setrlimit(resource.RLIMIT_FSIZE, (20000, 20000))


def whole_files(folder):
    """None of those that are still hidden, nor what lies in a hidden folder."""
    files = {p.relative_to(folder): p for p in folder.rglob("*") if p.is_file()}
    return {str(below): p.read_bytes() for below, p in files.items() if not any(part.startswith(".") for part in below.parts)}


class Stops(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.home = pathlib.Path(tempfile.mkdtemp())
        cls.addClassCleanup(shutil.rmtree, cls.home, ignore_errors=True)
        cls.model = cls.home / "m.hdf"
        start = time.monotonic()
        made = run(["preprocess", CASE, "-o", cls.model, *PREPARE])
        assert made.returncode == 0, made.stderr
        cls.seconds = time.monotonic() - start

    def setUp(self):
        self.folder = pathlib.Path(tempfile.mkdtemp(dir=self.home))

    def stopped(self, words, folder, points, seconds, reference):
        """Runs and stops at each of `points` parts of its time, by turns politely and not."""
        for n in range(points):
            shutil.rmtree(folder, ignore_errors=True)
            folder.mkdir()
            how = signal.SIGKILL if n % 2 else signal.SIGINT
            child = subprocess.Popen([ECORCHE, *map(str, words)], stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True)
            time.sleep(seconds * (n + 0.5) / points)
            child.send_signal(how)
            start = time.monotonic()
            _, err = child.communicate(timeout=60)
            self.assertLess(time.monotonic() - start, 5, "slow to stop")
            self.assertIn(child.returncode, (0, 130, -how), err)
            if how == signal.SIGINT:
                self.assertEqual([p for p in folder.rglob(".*")], [], "an interrupted run leaves no temporary")
                if child.returncode == 130:
                    self.assertIn("interrupted (run it again)", err)
            for name, data in whole_files(folder).items():
                self.assertEqual(data, reference.get(name), f"{name} is not what an undisturbed run writes (stop {n})")

    def test_preparing_stopped_at_twelve_points(self):
        out = self.folder / "out"
        self.stopped(["preprocess", CASE, "-o", out / "m.hdf", *PREPARE], out, 12, self.seconds,
                     {"m.hdf": self.model.read_bytes()})

    def test_posing_stopped_at_eight_points(self):
        words = ["pose", self.model, "--motion", CASE / "motion" / "walk.bvh", "--frames", "5", "--format", "stl", "ply", "-o"]
        start = time.monotonic()
        self.assertEqual(run(words + [self.folder / "whole"]).returncode, 0)
        seconds = time.monotonic() - start
        self.stopped(words + [self.folder / "out"], self.folder / "out", 8, seconds, whole_files(self.folder / "whole"))

    def test_repairing_stopped_at_six_points(self):
        start = time.monotonic()
        self.assertEqual(run(["repair", CASE, "-o", self.folder / "whole"]).returncode, 0)
        seconds = time.monotonic() - start
        reference = whole_files(self.folder / "whole")
        out = self.folder / "out"
        self.stopped(["repair", CASE, "-o", out], out, 6, seconds, reference)
        if (out / "case.yaml").exists():  # it is written last
            self.assertEqual(whole_files(out).keys(), reference.keys())

    def test_a_full_disk(self):
        case = body.write(self.folder / "case")
        rows = [["preprocess", case, "-o", "OUT/m.hdf", "--mesher", "lattice", "--max-tets", "5000"],
                ["phantom", "--size", "small", "-o", "OUT/p"],
                ["repair", CASE, "-o", "OUT/r"]]
        rows += [["pose", self.model, "-o", "OUT", "--pose", self.rest(), *words] for words in (
            ["--tissues", "skin", "--format", "stl"], ["--tissues", "skin", "--format", "ply"],
            ["--tissues", "skin", "--format", "vtp"], ["--tissues", "skin", "--format", "glb"], ["--tets"], ["--field"],
            ["--volumes", "all", "--volume-format", "nrrd"], ["--volumes", "all", "--volume-format", "mha"],
            ["--volumes", "all", "--volume-format", "nii.gz"])]
        for n, row in enumerate(rows):
            out = self.folder / f"out{n}"
            out.mkdir()
            words = [str(word).replace("OUT", str(out)) for word in row]
            with self.subTest(" ".join(words)):
                result = run(words, preexec_fn=small_files_only, restore_signals=False)
                self.assertEqual(result.returncode, 74, result.stderr)
                self.assertRegex(result.stderr, r"(?m)^error: .+: .+ \(.+\)$")
                if n == 0:  # the model's file is given its room before it is written
                    self.assertRegex(result.stderr, r"no room for \d+ KiB")
                self.assertEqual([p for p in out.rglob(".*")], [], "a temporary is left")
                self.assertFalse((out / "p" / "case.yaml").exists() or (out / "r" / "case.yaml").exists())
                self.assertEqual([p for p in out.rglob("*") if p.is_file() and p.stat().st_size >= 20000], [])

    @unittest.skipUnless("ECORCHE_BAD_DISK" in os.environ, "this build cannot be preceded by another library")
    def test_a_disk_that_keeps_something_else(self):
        case = body.write(self.folder / "case")
        result = run(["preprocess", case, "-o", self.folder / "m.hdf", "--mesher", "lattice", "--max-tets", "5000"],
                     env=dict(os.environ, LD_PRELOAD=os.environ["ECORCHE_BAD_DISK"]))
        self.assertEqual(result.returncode, 74, result.stderr)
        self.assertRegex(result.stderr, r"m.hdf: \d+ datasets came back changed from the disk \(check the disk\)")
        self.assertIn(" datasets came back changed from the disk (check the disk)", result.stderr)

    def rest(self):
        pose = self.folder / "pose.yaml"
        name = next(line.split()[1] for line in (CASE / "skeleton.yaml").read_text().splitlines() if line.startswith("name:"))
        pose.write_text(f"ecorche_pose: 1\nskeleton: {name}\n")
        return pose

    def test_a_result_that_nobody_can_keep(self):
        with open("/dev/full", "w") as full:
            result = subprocess.run([ECORCHE, "info", str(self.model)], stdout=full, stderr=subprocess.PIPE, text=True, timeout=60)
        self.assertEqual(result.returncode, 74, result.stderr)
        self.assertIn("the result cannot be written", result.stderr)

    def as_nobody(self):
        """Options that take root's rights away from the child; a user has none to lose."""
        if os.geteuid() != 0:
            return {}
        for folder in (self.home, self.folder):
            folder.chmod(0o755)
        options = {"preexec_fn": lambda: (os.setgid(NOBODY), os.setuid(NOBODY))}
        try:
            if run(["--version"], **options).returncode == 0 and os.access(self.home.parent, os.X_OK):
                return options
        except (PermissionError, subprocess.SubprocessError):
            pass
        self.skipTest("runs as root, and nobody may not run the command")

    def test_files_without_rights(self):
        options = self.as_nobody()
        case = body.write(self.folder / "case")
        case.chmod(0o755)
        model = self.folder / "m.hdf"
        shutil.copy(self.model, model)
        locked = self.folder / "locked"
        locked.mkdir(mode=0o555)
        rows = [("skin.stl", ["check", case], 66), ("ct.nrrd", ["check", case], 66), ("labels.mha", ["check", case], 66),
                ("skeleton.yaml", ["check", case], 66), ("case.yaml", ["check", case], 66), (model, ["info", model], 66),
                (model, ["verify", model], 66), (model, ["serve", model, "--listen", "127.0.0.1:0"], 66),
                (None, ["preprocess", case, "-o", locked / "m.hdf"], 73), (None, ["repair", case, "-o", locked / "r"], 73),
                (None, ["phantom", "--size", "small", "-o", locked / "p"], 73)]
        for name, words, code in rows:
            with self.subTest(f"{name}: {words[0]}"):
                if name:
                    (case / name).chmod(0)
                result = run(words, **options)
                if name:
                    (case / name).chmod(0o644)
                self.assertEqual(result.returncode, code, result.stderr)
                self.assertRegex(result.stderr, r"(?m)^error: .+: .+ \(.+\)$")
        self.assertEqual(list(locked.iterdir()), [])


if __name__ == "__main__":
    unittest.main(verbosity=2)
