#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Two servers behind HAProxy: one is killed, or both are restarted one after the other, under clients that pose.

usage: failover_test.py SOURCE [CLIENTS]; the environment is that of the fixtures, and ECORCHE_POSERS
"""
import json
import os
import pathlib
import re
import signal
import socket
import subprocess
import sys
import tempfile
import threading
import time
import unittest
import urllib.error
import urllib.request

import h5py
from ecorche_client import Client, ServerError
from fleet import Balancer, Node, haproxy, make_certificate

SOURCE = pathlib.Path(sys.argv[1])
# Many, which a small machine poses as often as it can (the newest win), with the slow tests; else few, without those.
MANY = len(sys.argv) > 2
CLIENTS = int(sys.argv[2]) if MANY else 6
ECORCHE, MODEL, POSERS = os.environ["ECORCHE_BIN"], os.environ["ECORCHE_BAR_MODEL"], os.environ["ECORCHE_POSERS"]

slow = unittest.skipUnless(MANY, "slow")


def smallest_tissue(model):
    with h5py.File(model) as file:
        tissues = file["ecorche/tissues"]
        return min((name for name in tissues if tissues[name]["group"][0].strip(b"\0") != b"bone"), key=lambda name: tissues[name]["points"].shape[0])


class Posers:
    """tests/e2e/fleet/posers.cpp, once every client has a frame of its own pose."""

    def __init__(self, port, seconds, clients=CLIENTS):
        self.process = subprocess.Popen([POSERS, f"127.0.0.1:{port}", MODEL, smallest_tissue(MODEL), str(clients), str(seconds)],
                                        stdout=subprocess.PIPE, text=True)
        assert self.process.stdout.readline() == "ready\n"

    def report(self):
        out, _ = self.process.communicate(timeout=120)
        print(out, end="", file=sys.stderr)
        return json.loads(out)


class Fleet(unittest.TestCase):
    def start(self, *options, **balancer):
        self.nodes = [Node(name, MODEL, "--max-sessions", "256", *options) for name in "ab"]
        for node in self.nodes:
            self.addCleanup(node.close)
            node.start()
        self.balancer = Balancer(SOURCE, self.nodes, **balancer)
        self.addCleanup(self.balancer.close)
        time.sleep(0.6)  # until both are known to be up
        return self.nodes

    def expect_nothing_wrong(self, report):
        self.assertEqual(report["silent"], 0, report)
        self.assertEqual(report["lost"], 0, "a frame showed a pose older than one that was acknowledged")
        self.assertEqual(report["wrong"], 0, report)
        self.assertEqual(report["refused"], 0, report)
        self.assertGreater(report["checked"], report["clients"], report)

    def test_one_of_two_is_killed(self):
        a, b = self.start()
        posers = Posers(self.balancer.port, 8 if MANY else 4)
        before = [a.clients(), b.clients()]
        self.assertGreater(min(before), 0, f"each has some of the sessions: {before}")
        time.sleep(1)
        a.stop(signal.SIGKILL)
        report = posers.report()
        self.expect_nothing_wrong(report)
        self.assertEqual(report["breaks"], before[0], "who was on the other did not notice")
        self.assertLess(report["longest_back"], 2)

    @slow
    def test_both_are_restarted(self):
        nodes = self.start("--drain-seconds", "1")
        posers = Posers(self.balancer.port, 9)
        for node in nodes:
            stopping = threading.Thread(target=node.stop, args=(signal.SIGTERM,))
            stopping.start()
            time.sleep(0.3)
            self.assertEqual(node.ready(), 503)
            stopping.join()
            self.assertEqual(node.process.returncode, 0)
            node.start()
            time.sleep(0.8)  # until it is known to be up again
        report = posers.report()
        self.expect_nothing_wrong(report)
        self.assertGreaterEqual(report["goodbyes"], report["clients"], "each was sent away at least once")
        self.assertLess(report["longest_gap"], 1)

    @slow
    def test_a_session_is_on_one_server_also_where_it_moved(self):
        nodes = self.start()
        names = [f"ward_{i}" for i in range(8)]

        def place(name):
            """The row of the server that has the session, as two find it who name it."""
            with Client("127.0.0.1", self.balancer.port, session=name) as first, Client("127.0.0.1", self.balancer.port, session=name) as second:
                first.open(session=name)
                second.open(session=name)
                self.assertFalse(second.has_control, f"{name} is on two servers")
                there = [node.clients() for node in nodes]
            deadline = time.monotonic() + 5
            while any(node.clients() for node in nodes):
                self.assertLess(time.monotonic(), deadline)
                time.sleep(0.02)
            return there.index(2)

        places = {name: place(name) for name in names}
        self.assertEqual(set(places.values()), {0, 1}, places)
        self.assertEqual({name: place(name) for name in names}, places)
        nodes[0].stop(signal.SIGKILL)
        self.assertEqual({place(name) for name in names}, {1})
        nodes[0].start()
        time.sleep(0.8)
        self.assertEqual({place(name) for name in names}, {1}, "who is somewhere stays")
        self.assertIn(0, {place(f"new_{i}") for i in range(8)})

    def test_websockets_find_the_same_server(self):
        nodes = self.start()
        for name in [f"ward_{i}" for i in range(6)]:
            with Client("127.0.0.1", self.balancer.port, session=name), socket.create_connection(("127.0.0.1", self.balancer.http_port), 5) as web:
                web.sendall(f"GET /v1?session={name} HTTP/1.1\r\nHost: 127.0.0.1\r\nConnection: Upgrade\r\nUpgrade: websocket\r\nSec-WebSocket-Version: 13\r\n"
                            "Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\nSec-WebSocket-Protocol: ecorche.v1\r\n\r\n".encode())
                self.assertIn(b" 101 ", web.recv(4096))
                self.assertEqual(sorted(node.clients() for node in nodes), [0, 2], name)
            deadline = time.monotonic() + 5
            while any(node.clients() for node in nodes):
                self.assertLess(time.monotonic(), deadline)
                time.sleep(0.02)

    def test_who_only_watches_is_back_first_and_leaves_control(self):
        nodes = self.start()

        def connect(watch):
            client = Client("127.0.0.1", self.balancer.port, session="ward_3")
            self.addCleanup(client.close)
            return client, client.open(session="ward_3", watch=watch)

        poser, body = connect(False)
        watcher, _ = connect(True)
        poser.send_pose(body.rest_pose())
        lost = next(node for node in nodes if node.clients() == 2)
        lost.stop(signal.SIGKILL)
        watcher, _ = connect(True)
        poser, body = connect(False)
        self.assertFalse(watcher.has_control)
        self.assertTrue(poser.has_control)
        watcher.subscribe_mesh()
        pose = body.rest_pose()
        pose[1] = (0.9801, 0.1987, 0, 0)
        poser.send_pose(pose, root_translation=(10, 0, 0))
        self.assertTrue(any(frame.pose_sequence == 1 for frame in watcher.frames(10)))

    def stream(self, address, session, certificate):
        done = subprocess.run([ECORCHE, "--json", "stream", address, "--session", session, "--seconds", "0.5", "--model", MODEL, "--tls-ca", certificate],
                              capture_output=True, text=True, timeout=60)
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertEqual(json.loads(done.stdout)["mismatches"], 0)

    @slow
    def test_tls_ends_at_the_edge(self):
        with tempfile.TemporaryDirectory() as folder:
            certificate, _, both = make_certificate(folder)
            self.start(certificate=both)
            self.stream(f"127.0.0.1:{self.balancer.port}", "ward_3", certificate)

    @slow
    def test_tls_goes_through(self):
        with tempfile.TemporaryDirectory() as folder:
            certificate, key, _ = make_certificate(folder)
            nodes = self.start("--tls-certificate", str(certificate), "--tls-key", str(key), through=True)
            for session in ("ward_3", "ward_4"):  # of one name, so of one server
                self.stream(f"localhost:{self.balancer.port}", session, certificate)
            sent = [float(re.search(r"^ecorche_frames_sent_total (\d+)", node.ask("/metrics")[1], re.M)[1]) for node in nodes]
            self.assertEqual(min(sent), 0, sent)
            self.assertGreater(max(sent), 10, sent)

    def test_without_a_balancer_clients_are_told_where_to_go(self):
        b = Node("b", MODEL)
        a = Node("a", MODEL, "--elsewhere", f"127.0.0.1:{b.port}")
        for node in (a, b):
            self.addCleanup(node.close)
            node.start()
        with Client("127.0.0.1", a.port) as client:
            client.open(session="ward_3")
            a.process.send_signal(signal.SIGTERM)
            with self.assertRaises(ServerError):
                list(client.frames(10))
            host, port = client.elsewhere.split(":")
        with Client(host, int(port)) as client:
            client.open(session="ward_3")
            self.assertTrue(client.has_control)

    def test_pages(self):
        nodes = self.start()
        page = f"http://127.0.0.1:{self.balancer.http_port}"
        with urllib.request.urlopen(page + "/readyz") as answer:
            self.assertEqual(answer.status, 200)
        with self.assertRaises(urllib.error.HTTPError) as denied:
            urllib.request.urlopen(page + "/metrics")
        self.assertEqual(denied.exception.code, 403)
        denied.exception.close()
        nodes[0].stop(signal.SIGKILL)
        for _ in range(4):
            with urllib.request.urlopen(page + "/readyz") as answer:
                self.assertEqual(answer.status, 200)

        done = subprocess.run([haproxy(), "-c", "-f", self.balancer.path], capture_output=True, text=True)
        self.assertEqual((done.returncode, "warning" in (done.stdout + done.stderr).lower()), (0, False), done.stderr)


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1])
