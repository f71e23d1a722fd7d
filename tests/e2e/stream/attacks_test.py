#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""What bad clients cannot do to others: floods of connections and of requests (more in tests/unit/server)."""
import os
import pathlib
import socket
import struct
import threading
import time
import unittest
import urllib.request

from ecorche.v1 import envelope_pb2
from ecorche_client import Client
from ecorche_frames import encode
from serving import Server

MODEL = pathlib.Path(os.environ["ECORCHE_MODEL"])


class Attacks(unittest.TestCase):
    def test_a_flood_of_bad_connections_writes_few_lines(self):
        with Server(MODEL, options=["--log", "info"]) as server:
            for _ in range(600):
                with socket.create_connection(("127.0.0.1", server.port), timeout=10) as bad:
                    bad.sendall(struct.pack("<II", 1 << 30, 0))  # a gigabyte is announced
                    bad.recv(1)
            with Client("127.0.0.1", server.port) as client:
                client.open()
            code, _, log = server.stop()
        self.assertEqual(code, 0, log)
        lines = [line for line in log.splitlines() if "127.0.0.1:" in line]
        self.assertGreaterEqual(len(lines), 20, log)
        self.assertLess(len(lines), 120, "2 a second after the first 20")

    def test_a_flood_of_text_that_is_none_writes_few_lines(self):
        """Not Protobuf either, which would tell of each."""
        hello = envelope_pb2.Envelope()
        hello.client_hello.client = "~"
        bad_hello = encode(hello).replace(b"~", b"\xff")
        with Server(MODEL, options=["--log", "info"]) as server:
            for _ in range(200):
                with socket.create_connection(("127.0.0.1", server.port), timeout=10) as bad:
                    bad.sendall(bad_hello)
                    bad.recv(1)
            code, _, log = server.stop()
        self.assertEqual(code, 0, log)
        self.assertIn("is no ecorche.v1.Envelope", log)
        self.assertLess(len(log.splitlines()), 120, log)

    def test_health_is_told_and_websockets_begin_beside_a_flood_of_requests(self):
        """What is turned away is the flood."""
        with Server(MODEL, options=["--http", "127.0.0.1:0"]) as server:
            done = threading.Event()
            turned_away = [0] * 4

            def flood(row):
                while not done.is_set():
                    with socket.create_connection(("127.0.0.1", server.http_port), timeout=10) as bad:
                        bad.sendall(b"GET / HTTP/1.1\r\nHost: flood\r\n\r\n")
                        turned_away[row] += b" 429 " in bad.recv(64)

            floods = [threading.Thread(target=flood, args=(row,)) for row in range(4)]
            for thread in floods:
                thread.start()
            time.sleep(0.5)
            for _ in range(10):
                with urllib.request.urlopen(f"http://127.0.0.1:{server.http_port}/healthz", timeout=10) as answer:
                    self.assertEqual(answer.status, 200)
                with socket.create_connection(("127.0.0.1", server.http_port), timeout=10) as web:
                    web.sendall(b"GET /v1 HTTP/1.1\r\nHost: localhost\r\nUpgrade: websocket\r\nConnection: Upgrade\r\n"
                                b"Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\nSec-WebSocket-Version: 13\r\n"
                                b"Sec-WebSocket-Protocol: ecorche.v1\r\n\r\n")
                    self.assertIn(b" 101 ", web.recv(64))
            done.set()
            for thread in floods:
                thread.join(20)
        self.assertGreater(sum(turned_away), 50)


if __name__ == "__main__":
    unittest.main(verbosity=2)
