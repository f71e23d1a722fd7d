#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""`ecorche serve` and `ecorche stream` as their users meet them."""
import json
import os
import pathlib
import shutil
import signal
import socket
import subprocess
import tempfile
import time
import unittest

import h5py
import xxhash_of_model
from ecorche_client import Client, ServerError
from serving import ECORCHE, Server

CASE = pathlib.Path(os.environ["ECORCHE_CASE"])
MODEL = pathlib.Path(os.environ["ECORCHE_MODEL"])
OTHER_MODEL = os.environ["ECORCHE_MODELS"].split(":")[-1]
PERMISSION_DENIED, UNAVAILABLE = 7, 14


def clip():
    return sorted(CASE.glob("**/walk.bvh"))[0]


def stream(address, *words, timeout=120):
    return subprocess.run([ECORCHE, "stream", address, *map(str, words)], capture_output=True, text=True, timeout=timeout)


class Stream(unittest.TestCase):
    def test_every_frame_of_the_walk_equals_offline_posing(self):
        with Server(MODEL) as server:
            for skinning in ("cor", "dqs", "lbs"):
                result = stream(server.address, "--motion", clip(), "--rate", 60, "--seconds", 1.5, "--skinning", skinning,
                                "--model", MODEL, "--json")
                self.assertEqual(result.returncode, 0, result.stderr)
                report = json.loads(result.stdout)
                print(skinning, report)
                self.assertEqual(report["mismatches"], 0)
                self.assertEqual(report["checked"], report["frames"])
                self.assertGreater(report["frames"], 5)
                # A pose that could not be sent in time is left out, so a busy machine may send fewer than 90.
                self.assertTrue(10 < report["poses"] <= 91, report)
                # Every pose is shown or told as skipped, and the rest pose came first.
                self.assertLessEqual(report["frames"], report["poses"] - report["skipped"] + 1)
                self.assertLessEqual(report["latency_ms"]["p50"], report["latency_ms"]["max"])

    def test_every_encoding_within_its_bound(self):
        sizes = {}
        with Server(MODEL) as server:
            for encoding in ("f32", "u16", "u16-delta"):
                result = stream(server.address, "--motion", clip(), "--rate", 60, "--seconds", 1, "--encoding", encoding, "--normals",
                                "--model", MODEL, "--json")
                self.assertEqual(result.returncode, 0, result.stderr)
                report = json.loads(result.stdout)
                print(encoding, report)
                self.assertEqual(report["mismatches"], 0)
                self.assertEqual(report["checked"], report["frames"])
                sizes[encoding] = report["bytes"] / report["frames"]
        self.assertLess(sizes["u16"], 0.6 * sizes["f32"])
        self.assertLess(sizes["u16-delta"], 0.8 * sizes["u16"])

    def test_a_rate_holds_frames_back(self):
        with Server(MODEL) as server:
            result = stream(server.address, "--motion", clip(), "--rate", 60, "--seconds", 1, "--max-rate", 10, "--model", MODEL, "--json")
            self.assertEqual(result.returncode, 0, result.stderr)
            report = json.loads(result.stdout)
            self.assertLessEqual(report["frames"], 10 * report["seconds"] + 3, report)
            self.assertEqual(report["mismatches"], 0)

    def test_volumes_and_quality(self):
        with h5py.File(MODEL) as file:
            volumes = list(file["ecorche/volumes"])
        with Server(MODEL) as server:
            for volume in volumes:
                result = stream(server.address, "--motion", clip(), "--rate", 20, "--seconds", 1, "--volume", volume, "--quality",
                                "--model", MODEL, "--tissues", "skin", "--json")
                self.assertEqual(result.returncode, 0, result.stderr)
                report = json.loads(result.stdout)
                print(volume, report)
                self.assertEqual(report["mismatches"], 0)
                self.assertGreater(report["volume_frames"], 0)
                self.assertIn("frames_with_warning", report)

    def test_the_report_for_people(self):
        with Server(MODEL) as server:
            result = stream(server.address, "--seconds", 0.3, "--model", MODEL)
            self.assertEqual(result.returncode, 0, result.stderr)
            for part in ("poses", "per second", "p50", "p99", "skipped", "0 mismatches"):
                self.assertIn(part, result.stdout)

    def test_another_model_is_a_mismatch(self):
        with Server(MODEL) as server:
            result = stream(server.address, "--motion", clip(), "--seconds", 0.5, "--model", OTHER_MODEL, "--json")
            self.assertEqual(result.returncode, 1, result.stderr)
            self.assertIn("mismatch", result.stderr)
            report = json.loads(result.stdout)
            self.assertGreater(report["mismatches"], 0)

    def test_one_wrong_float_is_a_mismatch(self):
        with tempfile.TemporaryDirectory() as folder:
            spoilt = pathlib.Path(folder) / "spoilt.hdf"
            shutil.copy(MODEL, spoilt)
            with h5py.File(spoilt, "r+") as file:
                points = file["ecorche/tissues/skin/barycentric"]
                row = points[7]
                row[0], row[1] = row[0] + 0.01, row[1] - 0.01
                points[7] = row
                xxhash_of_model.renew(file, "/ecorche/tissues/skin/barycentric")
            with Server(MODEL) as server:
                result = stream(server.address, "--motion", clip(), "--seconds", 0.5, "--model", spoilt, "--json")
            self.assertEqual(result.returncode, 1, result.stderr)
            self.assertIn("tissue 'skin'", result.stderr)
            self.assertGreater(json.loads(result.stdout)["mismatches"], 0)

    def test_a_flood_of_poses_is_skipped_and_told(self):
        with Server(MODEL, options=["--pose-rate", "10"]) as server:
            result = stream(server.address, "--motion", clip(), "--rate", 400, "--seconds", 1, "--model", MODEL, "--json")
            self.assertEqual(result.returncode, 0, result.stderr)
            report = json.loads(result.stdout)
            self.assertGreater(report["skipped"], report["poses"] // 2)
            self.assertEqual(report["mismatches"], 0)

    def test_nobody_there(self):
        with socket.socket() as free:
            free.bind(("127.0.0.1", 0))
            port = free.getsockname()[1]
        result = stream(f"127.0.0.1:{port}")
        self.assertEqual(result.returncode, 75, result.stderr)
        self.assertRegex(result.stderr, r"error: 127\.0\.0\.1:\d+: .+ \(.+\)")
        self.assertEqual(result.stdout, "")

    def test_somebody_else_there(self):
        with socket.create_server(("127.0.0.1", 0)) as other:
            process = subprocess.Popen([ECORCHE, "stream", f"127.0.0.1:{other.getsockname()[1]}"], stderr=subprocess.PIPE, text=True)
            peer = other.accept()[0]
            peer.sendall(b"HTTP/1.1 400 Bad Request\r\n\r\n")
            self.assertEqual(process.wait(60), 76)
            self.assertIn("ecorche serve", process.stderr.read())
            process.stderr.close()
            peer.close()

    def test_unknown_names(self):
        with Server(MODEL) as server:
            for words in (["--open", "nobody"], ["--tissues", "tail"], ["--volume", "mri"]):
                result = stream(server.address, "--seconds", "0.2", *words)
                self.assertEqual(result.returncode, 64, result.stderr)
        self.assertEqual(stream("nonsense").returncode, 64)


class Sessions(unittest.TestCase):
    def test_an_observer_is_denied_and_watches(self):
        with Server(MODEL) as server, Client("127.0.0.1", server.port) as poser, Client("127.0.0.1", server.port) as observer:
            body = poser.open(session="shared")
            observer.open(session="shared")
            observer.subscribe_mesh(["skin"])
            observer.send_pose(body.rest_pose())
            list(observer.frames(0.5))
            self.assertEqual([ack.status.code for ack in observer.acks], [PERMISSION_DENIED])
            sequence = poser.send_pose(body.rest_pose())
            self.assertIn(sequence, [frame.pose_sequence for frame in observer.frames(1)])
            result = stream(server.address, "--session", "shared", "--seconds", "0.2")
            self.assertEqual(result.returncode, 77, result.stderr)


class Serve(unittest.TestCase):
    def test_sigterm_while_streaming(self):
        with Server(MODEL) as server:
            client = subprocess.Popen([ECORCHE, "stream", server.address, "--seconds", "60"], stderr=subprocess.PIPE, text=True)
            time.sleep(0.7)
            start = time.monotonic()
            code, out, _ = server.stop()
            self.assertEqual(code, 0)
            self.assertLess(time.monotonic() - start, 10)
            self.assertRegex(out, rf"^listening on {server.address}, and http://127\.0\.0\.1:\d+/\n$")
            self.assertEqual(client.wait(30), 75)
            self.assertIn("error: ", client.stderr.read())
            client.stderr.close()

    def test_a_client_hears_goodbye(self):
        with Server(MODEL) as server, Client("127.0.0.1", server.port) as client:
            client.open()
            server.stop()
            with self.assertRaises(ServerError) as caught:
                list(client.frames(10))
            self.assertEqual(caught.exception.code, UNAVAILABLE)

    def test_interrupt_is_as_clean(self):
        with Server(MODEL) as server:
            server.process.send_signal(signal.SIGINT)
            self.assertEqual(server.process.wait(30), 0)

    def test_json(self):
        process = subprocess.Popen([ECORCHE, "serve", MODEL, "--listen", "127.0.0.1:0", "--json"], stdout=subprocess.PIPE,
                                   stderr=subprocess.DEVNULL, text=True)
        report = json.loads(process.stdout.readline())
        self.assertGreater(report["port"], 0)
        process.terminate()
        self.assertEqual(process.wait(30), 0)
        self.assertEqual(process.stdout.read(), "")
        process.stdout.close()

    def test_what_cannot_be_served(self):
        def serve(*words):
            return subprocess.run([ECORCHE, "serve", *map(str, words)], capture_output=True, text=True, timeout=60)

        with Server(MODEL) as server:
            taken = serve(MODEL, "--listen", server.address)
        self.assertEqual(taken.returncode, 75, taken.stderr)
        self.assertIn("in use", taken.stderr)
        self.assertEqual(taken.stdout, "")
        open_to_all = serve(MODEL, "--listen", "0.0.0.0:0")
        self.assertEqual(open_to_all.returncode, 77, open_to_all.stderr)
        self.assertIn("--insecure", open_to_all.stderr)
        self.assertEqual(serve(MODEL, MODEL, "--listen", "127.0.0.1:0").returncode, 78)
        self.assertEqual(serve("none.hdf").returncode, 66)
        self.assertEqual(serve().returncode, 64)
        self.assertEqual(serve(MODEL, "--frames-in-flight", "0").returncode, 64)


if __name__ == "__main__":
    unittest.main(verbosity=2)
