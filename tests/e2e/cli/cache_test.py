#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""preprocess --cache: what is taken, what is made again, and that the model is the same either way."""
import contextlib
import json
import os
import pathlib
import resource
import shutil
import signal
import subprocess
import tempfile
import time
import unittest

ECORCHE = os.environ["ECORCHE_BIN"]
CASE = pathlib.Path(os.environ["ECORCHE_CASE"])
STAGES = ["rig", "voxelize", "mesh", "weights", "cor", "mapping"]


class Cache(unittest.TestCase):
    def setUp(self):
        self.folder = pathlib.Path(tempfile.mkdtemp())
        self.addCleanup(shutil.rmtree, self.folder)
        self.cache = self.folder / "cache"
        self.model = self.folder / "m.hdf"

    def words(self, *more, cache=None):
        voxel = () if "--voxel" in more else ("--voxel", "9")
        return [ECORCHE, "--json", "preprocess", CASE, "-o", self.model, "--mesher", "lattice", *voxel,
                "--cache", cache or self.cache, *map(str, more)]

    def run_ecorche(self, *more, **options):
        return subprocess.run(self.words(*more, **options), capture_output=True, text=True, timeout=120)

    def taken(self, *more):
        done = self.run_ecorche(*more)
        self.assertEqual(done.returncode, 0, done.stderr)
        return [stage["name"] for stage in json.loads(done.stdout)["stages"] if stage["kept"]]

    def test_a_second_run_takes_every_stage_and_writes_the_same_bytes(self):
        self.assertEqual(self.taken(), [])
        first = self.model.read_bytes()
        self.assertEqual(self.taken(), STAGES)
        self.assertEqual(self.model.read_bytes(), first)
        self.assertEqual(self.taken("--cor-sigma", 0.08), ["rig", "voxelize", "mesh", "weights", "mapping"])
        self.assertEqual(self.taken("--voxel", 10), ["rig"])
        shutil.rmtree(self.cache)
        self.assertEqual(self.taken(), [])
        self.assertEqual(self.model.read_bytes(), first)

    def test_a_killed_run_goes_on_where_it_was(self):
        process = subprocess.Popen(self.words(), stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        deadline = time.monotonic() + 60
        while not list(self.cache.glob("mesh-*.stage")) and time.monotonic() < deadline:
            time.sleep(0.002)
        process.send_signal(signal.SIGKILL)
        process.wait()
        self.assertIn("mesh", self.taken())

    def test_what_a_killed_writer_left_is_swept_by_the_next_run_of_that_output(self):
        half = []
        for _ in range(30):  # until it is killed while it writes
            process = subprocess.Popen(self.words(), stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
            def parts():
                return list(self.folder.glob(f".{process.pid}.*.part.m.hdf"))

            def begun(part):
                with contextlib.suppress(FileNotFoundError):  # an empty one only tries whether the folder can be written to
                    return part.stat().st_size > 0

            while process.poll() is None and not any(begun(part) for part in parts()):
                pass
            process.send_signal(signal.SIGKILL)
            process.wait()
            half += parts()
            if half:
                break
        self.assertTrue(half, "no writer was killed in time")
        stage = self.cache / f".{process.pid}.part.cor-0123.stage"
        stage.write_text("half")
        kept = [self.folder / f".{os.getpid()}.part.m.hdf",  # of a process that lives
                self.folder / f".{process.pid}.part.other.hdf", self.folder / ".x.part.m.hdf", self.folder / f".{process.pid}.m.hdf"]
        for path in kept:
            path.write_text("mine")
        self.taken()
        self.assertFalse(any(path.exists() for path in [*half, stage]))
        self.assertTrue(all(path.exists() for path in kept))

    def test_damaged_stages_are_made_again(self):
        self.taken()
        first = self.model.read_bytes()
        spoils = [lambda b: b[:-1], lambda b: b[: len(b) // 2] + bytes([b[len(b) // 2] ^ 1]) + b[len(b) // 2 + 1:],
                  lambda b: b"", lambda b: b[:15], lambda b: b"X" + b[1:]]
        for turn in range(2):
            for at, stage in enumerate(sorted(self.cache.glob("*.stage"))):
                stage.write_bytes(spoils[(at + turn) % len(spoils)](stage.read_bytes()))
            self.assertEqual(self.taken(), [])
            self.assertEqual(self.model.read_bytes(), first)

    def test_the_folder_keeps_to_its_limit_and_leaves_other_files_alone(self):
        self.cache.mkdir()
        other = self.cache / "mine.txt"
        other.write_text("x" * 20_000_000)
        self.taken()
        size = sum(path.stat().st_size for path in self.cache.glob("*.stage"))
        half_gib = size / 2 / 2**30
        self.assertGreater(half_gib, 0.001)
        self.taken("--voxel", 10, "--cache-gib", max(0.01, half_gib))
        self.assertLessEqual(sum(path.stat().st_size for path in self.cache.glob("*.stage")), max(0.01, half_gib) * 2**30)
        self.assertTrue(other.exists())

    def test_bad_words(self):
        (self.folder / "file").write_text("in the way")
        for code, words in ((73, self.words(cache=self.folder / "file" / "deeper")),
                            (64, [ECORCHE, "preprocess", CASE, "-o", self.model, "--cache-gib", "1"]),
                            (64, self.words("--cache-gib", "0"))):
            done = subprocess.run(words, capture_output=True, text=True, timeout=60)
            self.assertEqual(done.returncode, code, done.stderr)
            self.assertRegex(done.stderr, r"(?m)^error: .+: .+ \(.+\)$")
        self.assertFalse(self.model.exists())

    def test_a_full_disk_keeps_no_half_stage(self):
        def limit():
            signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
            resource.setrlimit(resource.RLIMIT_FSIZE, (200_000, 200_000))

        done = subprocess.run(self.words(), capture_output=True, text=True, timeout=60, preexec_fn=limit)
        self.assertRegex(done.stderr, r"warning: .*not kept: mesh-\w+: .*mesh-\w+\.stage: the stage was cut short while it was written")
        self.assertEqual(done.returncode, 74, "the model did not fit either")
        self.assertEqual([path.name for path in self.cache.iterdir() if path.stat().st_size > 200_000 or path.name[0] == "."], [])
        self.assertNotIn("mesh", self.taken())

    def test_a_folder_that_cannot_be_written_is_only_warned_of(self):
        if os.geteuid() == 0:
            self.skipTest("root writes everywhere")
        self.cache.mkdir(mode=0o500)
        done = self.run_ecorche()
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertIn("not kept: voxelize-", done.stderr)


if __name__ == "__main__":
    unittest.main(verbosity=2)
