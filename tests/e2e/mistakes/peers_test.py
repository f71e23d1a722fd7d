#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Models that are none, addresses that are taken or silent, and peers that speak something else."""
import os
import pathlib
import random
import shutil
import signal
import socket
import subprocess
import tempfile
import threading
import time
import unittest

import body

ECORCHE = os.environ["ECORCHE_BIN"]


def run(*words, timeout=60):
    return subprocess.run([ECORCHE, *map(str, words)], capture_output=True, text=True, timeout=timeout)


class Peers(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = pathlib.Path(tempfile.mkdtemp())
        cls.addClassCleanup(shutil.rmtree, cls.folder, ignore_errors=True)
        cls.case = body.write(cls.folder / "case")
        cls.model = cls.folder / "m.hdf"
        made = run("preprocess", cls.case, "-o", cls.model, "--mesher", "lattice", "--max-tets", "5000")
        assert made.returncode == 0, made.stderr

    def refused(self, code, part, *words):
        result = run(*words)
        self.assertEqual(result.returncode, code, result.stderr)
        self.assertRegex(result.stderr, r"(?m)^error: .+: .+ \(.+\)$")
        self.assertIn(part, result.stderr)

    def test_models_that_are_none(self):
        data = self.model.read_bytes()
        bad = self.folder / "bad.hdf"
        rows = [(b"", "is not an HDF5 file"), (b"name: a case\n" * 9, "is not an HDF5 file"),
                (b"\x89HDF\r\n\x1a\n", "cannot be read as HDF5"), (data[:100], "bad.hdf"), (data[: len(data) // 2], "bad.hdf"),
                (data[:-1], "bad.hdf"), (b"\x89HDF\r\n\x1a\n" + data[8:900] + bytes(len(data)), "bad.hdf")]
        for bytes_, part in rows:
            bad.write_bytes(bytes_)
            for words in (("info", bad), ("verify", bad), ("serve", bad, "--listen", "127.0.0.1:0"),
                          ("pose", bad, "-o", self.folder / "p", "--pose", self.case / "pose.yaml")):
                with self.subTest(f"{words[0]}, {len(bytes_)} bytes"):
                    self.refused(65, part, *words)
        self.assertFalse((self.folder / "p").exists())
        self.refused(66, "m.hdf", "info", self.folder / "no" / "m.hdf")
        self.refused(66, "is not a regular file", "info", self.folder)
        self.refused(66, "is not a regular file", "info", "/dev/zero")

    def test_flipped_bytes_are_seen(self):
        """Every byte that matters is under a digest: a flip fails, or hits padding and changes nothing."""
        data = self.model.read_bytes()
        bad = self.folder / "flipped.hdf"
        numbers = random.Random(7)
        refused = 0
        for _ in range(40):
            flipped = bytearray(data)
            flipped[numbers.randrange(len(data))] ^= 1 << numbers.randrange(8)
            bad.write_bytes(flipped)
            code = run("verify", bad).returncode
            self.assertIn(code, (0, 65))
            refused += code == 65
        self.assertGreater(refused, 20)

    def test_addresses(self):
        with socket.create_server(("127.0.0.1", 0)) as taken:
            port = taken.getsockname()[1]
            self.refused(75, "the address is in use", "serve", self.model, "--listen", f"127.0.0.1:{port}")
        self.refused(75, f"127.0.0.1:{port}", "stream", f"127.0.0.1:{port}", "--seconds", "0.1")  # nobody listens now
        self.refused(64, "is not HOST:PORT", "serve", self.model, "--listen", "somewhere")
        self.refused(64, "is not HOST:PORT", "stream", "127.0.0.1:99999")
        self.refused(64, "is no address", "serve", self.model, "--listen", "knee.example:0")
        self.refused(77, "--insecure", "serve", self.model, "--listen", "0.0.0.0:0")
        self.refused(64, "cannot listen", "serve", self.model, "--insecure", "--listen", "203.0.113.7:0")

    def test_models_of_a_server(self):
        other = self.folder / "other"
        other.mkdir(exist_ok=True)
        shutil.copy(self.model, other / "m.hdf")
        self.refused(78, "two models have this name", "serve", self.model, other / "m.hdf", "--listen", "127.0.0.1:0")
        shutil.copy(self.model, other / "n.hdf")
        self.refused(78, "2 are given", "serve", self.model, other / "n.hdf", "--max-models", "1", "--listen", "127.0.0.1:0")
        self.refused(64, "--pose-rate", "serve", self.model, "--pose-rate", "0")
        self.refused(64, "--log", "serve", self.model, "--log", "loud")

    def test_servers_that_speak_something_else(self):
        answers = {b"HTTP/1.1 400 Bad Request\r\n\r\n": (76,), b"\xff" * 64: (76,), b"": (75, 76), b"\x05\x00\x00\x00": (75, 76)}
        for answer, codes in answers.items():
            with socket.create_server(("127.0.0.1", 0)) as server, self.subTest(answer[:8]):
                def serve(listening=server, said=answer):
                    peer, _ = listening.accept()
                    with peer:
                        peer.recv(100)
                        peer.sendall(said)
                thread = threading.Thread(target=serve)
                thread.start()
                result = run("stream", f"127.0.0.1:{server.getsockname()[1]}", "--seconds", "0.2")
                thread.join()
                self.assertIn(result.returncode, codes, result.stderr)
                self.assertRegex(result.stderr, r"(?m)^error: .+: .+ \(.+\)$")

    def test_clients_that_speak_something_else(self):
        port_file = self.folder / "port"
        port_file.unlink(missing_ok=True)
        server = subprocess.Popen([ECORCHE, "serve", str(self.model), "--listen", "127.0.0.1:0", "--port-file", str(port_file),
                                   "--hello-seconds", "1"], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        try:
            until = time.monotonic() + 30
            while not port_file.exists():
                self.assertLess(time.monotonic(), until)
                time.sleep(0.02)
            port = int(port_file.read_text())
            numbers = random.Random(3)
            for said in (b"GET / HTTP/1.1\r\n\r\n", b"\xff" * 64, bytes(64), numbers.randbytes(500), b"\x00\x00\x00", b""):
                with socket.create_connection(("127.0.0.1", port), timeout=10) as client, self.subTest(said[:8]):
                    client.sendall(said)
                    while client.recv(4096):  # an answer, perhaps; then the end
                        pass
            address = f"127.0.0.1:{port}"
            good = run("stream", address, "--seconds", "0.3", "--rate", "20")
            self.assertEqual(good.returncode, 0, good.stderr)
            for words in (("--open", "horse"), ("--tissues", "antlers"), ("--volume", "mr")):
                result = run("stream", address, "--seconds", "0.3", *words)
                self.assertIn(result.returncode, (64, 65, 66, 76, 77, 78), result.stderr)
                self.assertRegex(result.stderr, r"(?m)^error: .+: status \d+: .+ \(.+\)$")
            self.refused(66, "none.bvh", "stream", address, "--motion", self.folder / "none.bvh")
        finally:
            server.send_signal(signal.SIGINT)
            code = server.wait(timeout=30)
        self.assertIn(code, (0, 130))


if __name__ == "__main__":
    unittest.main(verbosity=2)
