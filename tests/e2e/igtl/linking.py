# SPDX-License-Identifier: Apache-2.0
"""`ecorche igtl` as a context, and a client of it by the project's own library."""
import json
import os
import pathlib
import signal
import subprocess
import sys
import tempfile
import time

import numpy as np

ECORCHE, MODEL = os.environ["ECORCHE_BIN"], os.environ["ECORCHE_MODEL"]
FLIP = np.diag([-1.0, -1.0, 1.0, 1.0])  # LPS to RAS, and back


class Link:
    """The server, on a free port, stopped by SIGTERM."""

    def __init__(self, *options, model=MODEL):
        self._folder = tempfile.TemporaryDirectory()
        port_file = pathlib.Path(self._folder.name) / "port"
        self.process = subprocess.Popen(
            [ECORCHE, "igtl", model, "--listen", "127.0.0.1:0", "--port-file", port_file, "--rest-seconds", "0.05", *map(str, options)],
            stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
        deadline = time.monotonic() + 60
        while not port_file.exists() or not port_file.read_text():
            if self.process.poll() is not None or time.monotonic() > deadline:
                self.process.kill()
                raise RuntimeError("ecorche igtl did not start: " + self.process.communicate()[1])
            time.sleep(0.01)
        self.port = int(port_file.read_text())

    def __enter__(self):
        return self

    def memory(self):
        """Bytes that it has in memory."""
        status = pathlib.Path(f"/proc/{self.process.pid}/status").read_text()
        return next(int(line.split()[1]) * 1024 for line in status.splitlines() if line.startswith("VmRSS"))

    def stop(self):
        """SIGTERM; returns the exit code and what was printed."""
        self.process.send_signal(signal.SIGTERM)
        out, err = self.process.communicate(timeout=30)
        return self.process.returncode, out, err

    def __exit__(self, *_):
        if self.process.poll() is None:
            self.stop()
        self.process.stdout.close()
        self.process.stderr.close()
        self._folder.cleanup()


class Library:
    """A client by the library, as igtl_peer.cpp describes it. Matrices are RAS, 4 by 4."""

    def __init__(self, link):
        self._folder = tempfile.TemporaryDirectory()
        self.process = subprocess.Popen([sys.argv[1], str(link.port), self._folder.name], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.process.stdin.close()
        self.process.stdout.close()
        self.process.wait(20)
        self._folder.cleanup()

    def tell(self, *words):
        self.process.stdin.write(" ".join(map(str, words)) + "\n")
        self.process.stdin.flush()

    def transform(self, name, matrix):
        self.tell("transform", name, *flat(matrix))

    def wait(self, *words):
        self.tell("wait", *words)
        return json.loads(self.process.stdout.readline())

    def matrix(self, name):
        """The next transform of the name."""
        return matrix(self.wait("TRANSFORM", name)["at"])

    def surface(self, name):
        """The next of the name: its points, normals (#V by 3) and triangles."""
        self.told = self.wait("POLYDATA", name)
        return self.numbers(name + ".points"), self.numbers(name + ".normals"), self.numbers(name + ".triangles", np.uint32)

    def numbers(self, file, kind=np.float32):
        return np.fromfile(pathlib.Path(self._folder.name) / file, kind).reshape(-1, 3)

    def image(self, name, kind):
        """The next of the name: its voxels by i, j, k, and where they are: 4 by 4, from indices to RAS."""
        told = self.told = self.wait("IMAGE", name)
        voxels = np.fromfile(pathlib.Path(self._folder.name) / (name + ".voxels"), kind).reshape(told["size"], order="F")
        axes = matrix(told["matrix"])
        axes[:3, :3] *= told["spacing"]
        # It stands where its middle does, as OpenIGTLink says.
        axes[:3, 3] -= axes[:3, :3] @ ((np.array(told["size"]) - 1) / 2)
        return voxels, axes


def matrix(columns):
    return np.vstack([np.array(columns).reshape(4, 3).T, [0, 0, 0, 1]])


def flat(at):
    return [repr(float(number)) for number in np.asarray(at)[:3].T.ravel()]
