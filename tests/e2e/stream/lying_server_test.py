#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""`ecorche stream` and a server that breaks its own protocol: a relay before a good one changes what it says."""
import os
import pathlib
import socket
import struct
import subprocess
import threading
import unittest

from ecorche.v1 import envelope_pb2
from ecorche_frames import aligned, encode
from serving import ECORCHE, Server

MODEL = pathlib.Path(os.environ["ECORCHE_MODEL"])


def read(peer, size):
    out = b""
    while len(out) < size:
        more = peer.recv(size - len(out))
        if not more:
            raise ConnectionError
        out += more
    return out


class Relay:
    """One connection to `port`; `change` gets each message of the server and returns what goes on, or nothing."""
    def __init__(self, port, change):
        self.change = change
        self.listener = socket.create_server(("127.0.0.1", 0))
        self.address = "127.0.0.1:%d" % self.listener.getsockname()[1]
        self.server = socket.create_connection(("127.0.0.1", port))
        self.thread = threading.Thread(target=self.run)
        self.thread.start()

    def run(self):
        client, _ = self.listener.accept()
        there = threading.Thread(target=self.carry, args=(client,))
        there.start()
        try:
            while True:
                head = read(self.server, 8)
                body, payload = struct.unpack("<II", head)
                rest = read(self.server, aligned(8 + body) - 8 + payload)
                envelope = self.change(envelope_pb2.Envelope.FromString(rest[:body]))
                if envelope is not None:
                    client.sendall(encode(envelope, rest[len(rest) - payload:] if payload else b""))
        except OSError:
            pass
        client.close()
        there.join()

    def carry(self, client):
        try:
            while data := client.recv(65536):
                self.server.sendall(data)
        except OSError:
            pass
        self.hang_up()  # which wakes the other thread; closing would not

    def hang_up(self):
        try:
            self.server.shutdown(socket.SHUT_RDWR)
        except OSError:
            pass  # it has hung up itself

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.hang_up()
        self.thread.join(10)
        self.server.close()
        self.listener.close()


class LyingServer(unittest.TestCase):
    def told(self, change, part):
        with Server(MODEL) as server, Relay(server.port, change) as relay:
            done = subprocess.run([ECORCHE, "stream", relay.address, "--seconds", "0.5"], capture_output=True, text=True, timeout=60)
            self.assertEqual(done.returncode, 76, done.stderr)
            self.assertIn(part, done.stderr)
            self.assertRegex(done.stderr, r"(?m)^error: .+: .+ \(.+\)$")

    def test_a_skeleton_that_is_no_tree(self):
        def change(envelope):
            if envelope.WhichOneof("message") == "model_opened":
                envelope.model_opened.skeleton.segments[1].parent = 7
            return envelope
        self.told(change, "has parent 7 (parents come first) (use a client of the server's version)")

    def test_no_frame_at_all(self):
        self.told(lambda envelope: None if envelope.WhichOneof("message") == "mesh_frame" else envelope, "no frame came (see the server's log)")


if __name__ == "__main__":
    unittest.main(verbosity=2)
