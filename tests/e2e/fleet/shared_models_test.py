#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Servers of one machine with one copy of a model's pages between them, by PSS of data; and frames right whatever stands in their folder.

usage: shared_models_test.py SOURCE; the environment is that of the fixtures
"""
import json
import os
import pathlib
import re
import signal
import stat
import subprocess
import sys
import tempfile
import time
import unittest

from serving import Server

ECORCHE, MODEL = os.environ["ECORCHE_BIN"], os.environ["ECORCHE_MODEL"]
CLIP = sorted(pathlib.Path(os.environ["ECORCHE_CASE"]).glob("**/walk.bvh"))[0]


def pss(server):
    """MiB of a process' data, of what others have, too, its share. Its code is shared with whatever else of ecorche runs just then."""
    rollup = pathlib.Path(f"/proc/{server.process.pid}/smaps_rollup").read_text()
    return sum(int(kilobytes) for kilobytes in re.findall(r"^Pss_(?:Anon|Shmem): +(\d+) kB", rollup, re.M)) / 1024


def of_folder(server, folder):
    """MiB that stand on the folder's files: all, and this process' share."""
    rss = share = 0
    here = False
    for line in pathlib.Path(f"/proc/{server.process.pid}/smaps").read_text().splitlines():
        if re.match(r"[0-9a-f]+-[0-9a-f]+ ", line):
            here = f" {folder}/" in line
        elif here and line.startswith("Rss:"):
            rss += int(line.split()[1])
        elif here and line.startswith("Pss:"):
            share += int(line.split()[1])
    return rss / 1024, share / 1024


class SharedModels(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory(dir="/dev/shm")
        self.addCleanup(folder.cleanup)
        self.folder = pathlib.Path(folder.name)

    def serve(self, *options):
        server = self.enterContext(Server(MODEL, options=("--no-http", *options)))
        return server

    def share(self):
        """One that shares: what it opens with, and a while later its levels of detail where they are large."""
        server = self.serve("--shared-models", str(self.folder))
        self.wait_for(lambda: self.files() and of_folder(server, self.folder)[0] > 0)
        # Its levels stand there once no more comes.
        before = 0
        while before != (before := of_folder(server, self.folder)[0]):
            time.sleep(0.5)
        return server

    def files(self):
        return sorted(self.folder.iterdir())

    def wait_for(self, what):
        deadline = time.monotonic() + 60
        while not what():
            self.assertLess(time.monotonic(), deadline)
            time.sleep(0.02)

    def check_frames(self, server):
        """Meshes and volumes, held against offline posing of the model file."""
        done = subprocess.run([ECORCHE, "--json", "stream", server.address, "--motion", CLIP, "--rate", "10", "--seconds", "1", "--model", MODEL,
                               "--volume", "ct", "--normals"], capture_output=True, text=True, timeout=100)
        self.assertEqual(done.returncode, 0, done.stderr)
        told = json.loads(done.stdout)
        self.assertEqual(told["mismatches"], 0)
        self.assertGreater(told["checked"], 0)

    def test_one_copy_for_all(self):
        alone, other_alone = self.serve(), self.serve()
        for server in (alone, other_alone):
            self.check_frames(server)
        apart = pss(alone) + pss(other_alone)
        for server in (alone, other_alone):
            server.stop()
        one, other = self.share(), self.share()
        for server in (one, other):
            self.check_frames(server)
        together = pss(one) + pss(other)
        model = pathlib.Path(MODEL).stat().st_size / 2**20
        for server in (one, other):
            rss, share = of_folder(server, self.folder)
            # What is prepared is more than the file has; but for its small arrays and the ends of the large ones.
            self.assertGreater(rss, 0.9 * model)
            self.assertLess(share, 0.52 * rss)
        saved = of_folder(one, self.folder)[0]
        print(f"the model {model:.1f} MiB, shared {saved:.1f}; PSS of two servers {apart:.1f} apart, {together:.1f} together")
        self.assertLess(together, apart - 0.7 * saved)
        for path in self.files():
            self.assertEqual(stat.S_IMODE(path.stat().st_mode), 0o400)

        # One is killed: the other goes on, and a third finds what is there. The last takes it away.
        one.process.kill()
        one.process.wait()
        self.check_frames(other)
        third = self.share()
        self.check_frames(third)
        self.assertIn("are shared with another server", third.stop()[2])
        other.stop()
        self.assertEqual(self.files(), [])

    def test_what_was_tampered_with_is_not_taken(self):
        first = self.share()
        first.process.send_signal(signal.SIGKILL)
        first.process.wait()
        left = self.files()
        for number, path in enumerate(left):
            path.chmod(0o600)
            with path.open("r+b") as file:
                if number == 0:
                    file.truncate(path.stat().st_size // 2)
                file.seek(path.stat().st_size // 2)
                byte = file.read(1) or b"\0"
                file.seek(path.stat().st_size // 2)
                file.write(bytes([byte[0] ^ 1]))
            path.chmod(0o400)
        server = self.share()
        self.check_frames(server)
        _, _, said = server.stop()
        self.assertNotIn("are shared with another server", said)
        self.assertIn("can be shared", said)
        self.assertEqual(self.files(), [])

    def test_a_model_that_is_replaced_leaves_nothing(self):
        with tempfile.TemporaryDirectory() as place:
            served = pathlib.Path(place) / "body.hdf"
            served.write_bytes(pathlib.Path(MODEL).read_bytes())
            options = ("--no-http", "--shared-models", str(self.folder))
            with Server(served, options=options) as server:
                self.wait_for(lambda: len(self.files()) > 0)
                before = self.files()
                served.with_suffix(".new").write_bytes(pathlib.Path(os.environ["ECORCHE_BAR_MODEL"]).read_bytes())
                served.with_suffix(".new").replace(served)
                server.process.send_signal(signal.SIGHUP)
                self.wait_for(lambda: not set(before) & set(self.files()))

    def test_where_it_cannot_be(self):
        def refused(folder):
            done = subprocess.run([ECORCHE, "serve", MODEL, "--check-config", "--shared-models", folder], capture_output=True, text=True, timeout=60)
            return done.returncode, done.stderr.strip()

        open_folder = self.folder / "open"
        open_folder.mkdir()
        open_folder.chmod(0o777)
        self.assertEqual(refused(open_folder), (77, f"error: {open_folder}: is another user's, or others may write into it (name a folder of your "
                                                    "own, or chmod 700)"))
        with tempfile.TemporaryDirectory(dir=pathlib.Path(MODEL).parent) as disk:
            self.assertEqual(refused(disk), (77, f"error: {disk}: is on a disk (name a folder in memory (tmpfs), as /dev/shm/ecorche)"))
        code, said = refused(self.folder / "no" / "folder")
        self.assertEqual(code, 73, said)


if __name__ == "__main__":
    sys.argv.pop(1)
    unittest.main()
