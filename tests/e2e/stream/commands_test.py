#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Clips, recordings, models read again, and a server that is killed, as their users meet them."""
import json
import os
import pathlib
import shutil
import signal
import subprocess
import tempfile
import threading
import time
import unittest

import h5py
import numpy as np
from ecorche.v1 import envelope_pb2
from ecorche_client import Client, ServerError
from serving import ECORCHE, Server

CASE = pathlib.Path(os.environ["ECORCHE_CASE"])
MODEL = pathlib.Path(os.environ["ECORCHE_MODEL"])
OTHER_MODEL = os.environ["ECORCHE_MODELS"].split(":")[-1]


def run(*words):
    return subprocess.run([ECORCHE, *map(str, words)], capture_output=True, text=True, timeout=120)


class Commands(unittest.TestCase):
    def setUp(self):
        self.folder = tempfile.TemporaryDirectory()
        self.path = pathlib.Path(self.folder.name)
        (self.path / "clips").mkdir()
        shutil.copy(sorted(CASE.glob("**/walk.bvh"))[0], self.path / "clips" / "walk.bvh")

    def tearDown(self):
        self.folder.cleanup()

    def test_a_clip_is_played_recorded_and_replayed(self):
        options = ["--clips", str(self.path / "clips"), "--record-dir", str(self.path / "recordings")]
        with Server(MODEL, options=options) as server:
            with Client("127.0.0.1", server.port) as client:
                client.open()
                client.subscribe_mesh(["skin"])
                list(client.frames(0.3))
                self.assertEqual([clip.name for clip in client.clips()], ["walk"])
                client.record("walk_once")
                client.play("walk", speed=4)
                self.assertGreater(len(list(client.frames(1))), 3)
                client.play("")
                list(client.frames(0.3))
                client.record(None)
                self.assertEqual([clip.name for clip in client.clips()], ["walk", "walk_once"])
                with self.assertRaises(ServerError):
                    client.record("walk_once")
            recording = self.path / "recordings" / "walk_once.ecrec"
            result = run("stream", server.address, "--replay", recording, "--json")
            self.assertEqual(result.returncode, 0, result.stderr)
            report = json.loads(result.stdout)
            self.assertGreater(report["frames"], 3)
            self.assertEqual(report["mismatches"], 0)

            data = bytearray(recording.read_bytes())
            (self.path / "cut.ecrec").write_bytes(data[:-5])  # within its last words
            cut = run("stream", server.address, "--replay", self.path / "cut.ecrec", "--json")
            self.assertEqual(cut.returncode, 0, cut.stderr)
            self.assertEqual({**json.loads(cut.stdout), "cut": False}, report)
            self.assertTrue(json.loads(cut.stdout)["cut"])
            (self.path / "cut.ecrec").write_bytes(data[:20])
            cut = run("stream", server.address, "--replay", self.path / "cut.ecrec")
            self.assertEqual(cut.returncode, 65, cut.stderr)
            self.assertIn("give a file of ecorche serve --record-dir", cut.stderr)
        # Another body, another answer.
        other = self.path / MODEL.name
        shutil.copy(OTHER_MODEL, other)
        with Server(other) as server:
            result = run("stream", server.address, "--replay", recording, "--json")
            self.assertEqual(result.returncode, 1, result.stderr)
            self.assertIn("is not the one that was recorded", result.stderr)

    def test_a_killed_server_leaves_what_it_recorded(self):
        with Server(MODEL, options=["--record-dir", str(self.path / "recordings")]) as server:
            with Client("127.0.0.1", server.port) as client:
                pose = client.open().rest_pose()
                client.subscribe_mesh(["skin"])
                client.record("crash")
                sent = 0
                until = time.monotonic() + 2.5
                while time.monotonic() < until:
                    pose[1] = (np.cos(0.001 * sent), np.sin(0.001 * sent), 0, 0)
                    client.send_pose(pose)
                    sent += 1
                    list(client.frames(1 / 60))
                server.process.send_signal(signal.SIGKILL)
                server.process.wait(10)
        part = self.path / "recordings" / "crash.ecrec.part"
        with Server(MODEL) as server:
            result = run("stream", server.address, "--replay", part, "--json")
        self.assertEqual(result.returncode, 0, result.stderr)
        report = json.loads(result.stdout)
        self.assertTrue(report["cut"])
        self.assertEqual(report["mismatches"], 0)
        self.assertGreater(report["poses"], 0.5 * sent, "all but the last second of 2.5")

    def test_what_was_watched_is_replayed_however_often_it_changed(self):
        with Server(MODEL, options=["--record-dir", str(self.path / "recordings"), "--max-subscriptions", "4"]) as server:
            with Client("127.0.0.1", server.port) as client:
                pose = client.open().rest_pose()
                # The same at two rates, and more than a connection may have at a time.
                client.subscribe_mesh(["skin"])
                client.subscribe_mesh(["skin"], max_rate=1000)
                client.record("many")
                for turn in range(6):
                    other = client.subscribe_mesh(["skin"], region=((-300, -300, 50 * turn - 300), (300, 300, 300)))
                    pose[1] = (np.cos(0.02 * turn), np.sin(0.02 * turn), 0, 0)
                    sequence = client.send_pose(pose)
                    shown = {frame.subscription for frame in client.frames(0.4) if frame.pose_sequence == sequence}
                    self.assertIn(other, shown)
                    client.unsubscribe(other)
                client.record(None)
            result = run("stream", server.address, "--replay", self.path / "recordings" / "many.ecrec", "--json")
            self.assertEqual(result.returncode, 0, result.stderr)
            report = json.loads(result.stdout)
            self.assertGreaterEqual(report["frames"], 2 * 6 + 6)
            self.assertEqual(report["mismatches"], 0)

    def test_a_pose_that_is_refused_spoils_no_recording(self):
        """The farthest number of all, then what a server numbers itself, and another client's poses."""
        options = ["--clips", str(self.path / "clips"), "--record-dir", str(self.path / "recordings")]
        with Server(MODEL, options=options) as server:
            with Client("127.0.0.1", server.port) as bad, Client("127.0.0.1", server.port) as other:
                pose = bad.open(session="shared").rest_pose()
                other.open(session="shared")
                bad._sequence = 2**63 - 2
                bad.send_pose(pose)
                list(bad.frames(0.3))
                self.assertEqual([ack.status.code for ack in bad.acks], [11], "OUT_OF_RANGE")
                bad.play("walk", speed=4)
                time.sleep(0.3)
                bad.play("")
                release, claim = envelope_pb2.Envelope(), envelope_pb2.Envelope()
                release.release_control.SetInParent()
                claim.claim_control.SetInParent()
                bad._call(release)
                last = other._call(claim)[0].control_granted.last_sequence
                self.assertLess(last, 2**24)
                other.subscribe_mesh(["skin"])
                other.record("after")
                other._sequence = last
                for turn in range(1, 6):
                    pose[1] = (np.cos(0.02 * turn), np.sin(0.02 * turn), 0, 0)
                    sequence = other.send_pose(pose)
                    shown = [frame.pose_sequence for frame in other.frames(0.3)]
                    self.assertIn(sequence, shown)
                other.record(None)
                self.assertEqual({ack.status.code for ack in other.acks}, {0})
            result = run("stream", server.address, "--replay", self.path / "recordings" / "after.ecrec", "--json")
            self.assertEqual(result.returncode, 0, result.stderr)
            report = json.loads(result.stdout)
            self.assertEqual(report["poses"], 5)
            self.assertEqual(report["frames"], 5)
            self.assertEqual(report["mismatches"], 0)

    def test_a_session_is_free_as_soon_as_its_poser_has_gone(self):
        with Server(MODEL) as server:
            for _ in range(2):
                done = subprocess.run([ECORCHE, "stream", server.address, "--session", "ward", "--seconds", "0.2", "--rate", "20"], capture_output=True, text=True,
                                      timeout=60)
                self.assertEqual(done.returncode, 0, done.stderr)

    def test_points_go_both_ways(self):
        with Server(MODEL) as server, Client("127.0.0.1", server.port) as client:
            body = client.open()
            pose = body.rest_pose()
            pose[1] = (np.cos(0.1), np.sin(0.1), 0, 0)
            client.subscribe_mesh(["skin"])
            sequence = client.send_pose(pose)
            skin = [frame for frame in client.frames(1) if frame.pose_sequence == sequence][0].positions["skin"]
            middle = skin.mean(axis=0, keepdims=True) + [[0, 0, 0], [5, 0, 0], [1e4, 0, 0]]
            there = client.probe(middle, volumes=[volume.name for volume in body.message.volumes], gradient=True, tissue=True)
            inside = ~np.isnan(there["points"][:, 0])
            self.assertFalse(inside[2])
            self.assertEqual(there["gradient"].shape, (3, 9))
            self.assertEqual(there["values"].shape, (3, len(body.message.volumes)))
            self.assertEqual(there["tissue"][2], -1)
            back = client.probe(there["points"][inside], to_rest=False)
            np.testing.assert_allclose(back["points"], middle[inside], atol=1e-2)

    def test_a_probe_goes_where_the_mesh_goes(self):
        """What follows the tets is drawn where a probe of its rest place goes. A bone is drawn rigidly, and to the last vertex: where
        one of its surface lies in a soft tet beside it (a tet is what most of it is), the probe bends with that tet, near joints by
        millimetres; so it does where the bones of two segments contest a tet, which for what was soft stays soft."""
        with h5py.File(MODEL) as file:
            rest = {name: group["points"][()] for name, group in file["ecorche/tissues"].items()}
            bones = {name for name, group in file["ecorche/tissues"].items() if np.ravel(group["segment"][()])[0] >= 0}
        rig = [row["segment"] for row in json.loads(run("--json", "info", MODEL).stdout)["rig"]]
        with Server(MODEL) as server, Client("127.0.0.1", server.port) as client:
            pose = client.open().rest_pose()
            for segment in ("shank_right", "thigh_left", "forearm_left"):
                pose[rig.index(segment)] = (np.cos(0.35), np.sin(0.35), 0, 0)  # by 40 degrees
            client.subscribe_mesh()
            sequence = client.send_pose(pose)
            drawn = [frame for frame in client.frames(2) if frame.pose_sequence == sequence][0].positions
            self.assertEqual(drawn.keys(), rest.keys())
            apart, bent, vertices = [], [], 0
            for name, points in rest.items():
                probed = client.probe(points, to_rest=False, gradient=True)
                away = np.linalg.norm(probed["points"] - drawn[name], axis=1)
                outside = np.isnan(away)  # a probe knows the body alone, which is its tets; a mesh is carried along outside of them
                self.assertTrue(not outside.any() or name == "skin" or outside.sum() <= 1, f"{name}: {outside.sum()} outside")
                vertices += len(points)
                far = away > 0.1
                self.assertTrue(name in bones or not far.any(), f"{name} is no bone, and off by {np.nanmax(away):.2f} mm")
                if not far.any():
                    continue
                apart += list(away[far])
                F = probed["gradient"][far].reshape(-1, 3, 3)
                bent += list(np.abs(np.swapaxes(F, 1, 2) @ F - np.eye(3)).max(axis=(1, 2)))
        print(f"{len(apart)} of {vertices} vertices are drawn apart from their probes, by {max(apart):.2f} mm at worst")
        self.assertLess(len(apart), 0.01 * vertices)
        self.assertLess(max(apart), 16, "on the head of the femur, whose thigh turns by 40 degrees")
        self.assertGreater(np.mean(np.array(bent) > 1e-3), 0.9)

    def test_what_is_no_clip(self):
        for name, content, code, message in (("Run.bvh", "", 78, "clients could not ask for a clip of this name"),
                                             (None, None, 66, "is no folder of clips")):
            folder = self.path / str(name)
            if name:
                folder.mkdir()
                (folder / name).write_text(content)
            result = run("serve", MODEL, "--listen", "127.0.0.1:0", "--clips", folder)
            self.assertEqual(result.returncode, code, result.stderr)
            self.assertIn(message, result.stderr)
        (self.path / "clips" / "broken.bvh").write_text("HIERARCHY\n")
        head, _, motion = (self.path / "clips" / "walk.bvh").read_text().partition("Frames:")
        _, frame_time, *frames = motion.strip().splitlines()
        (self.path / "clips" / "long.bvh").write_text("\n".join([head + "Frames: 36001", frame_time] + [frames[0]] * 36001) + "\n")
        with Server(MODEL, options=["--clips", str(self.path / "clips")]) as server:
            with Client("127.0.0.1", server.port) as client:
                client.open()
                self.assertEqual([clip.name for clip in client.clips()], ["walk"])  # the others are left out, with a warning
            _, _, err = server.stop()
            self.assertIn("broken.bvh", err)
            self.assertIn("cut it into clips of at most 36000", err)

    def test_a_changed_file_is_read_again(self):
        model = self.path / "body.hdf"
        shutil.copy(MODEL, model)
        with Server(model) as server, Client("127.0.0.1", server.port) as client, Client("127.0.0.1", server.port) as other:
            before = client.open().message
            with self.assertRaises(ServerError):
                other.reload("body")  # who shows nothing asks for nothing
            other.open()
            client.subscribe_mesh(["skin"])
            list(client.frames(0.3))
            model.write_bytes(b"not a model")
            with self.assertRaises(ServerError):
                other.reload("body")
            changed = self.path / "changed.hdf"
            shutil.copy(OTHER_MODEL, changed)
            changed.rename(model)
            other.reload("body")
            sequence = client.send_pose(client.body.rest_pose())
            self.assertIn(sequence, [frame.pose_sequence for frame in client.frames(1)])  # the old one goes on
            self.assertTrue(client.model_changed)
            self.assertNotEqual(client.open().message.identity, before.identity)

    def test_hanging_up_reads_again_and_does_not_end(self):
        model = self.path / "body.hdf"
        shutil.copy(MODEL, model)
        with Server(model, options=["--clips", str(self.path / "clips")]) as server, Client("127.0.0.1", server.port) as client:
            client.open()

            def wait_for(holds):
                until = time.monotonic() + 30
                while not holds():
                    self.assertLess(time.monotonic(), until, "it was not read again")
                    list(client.frames(0.05))

            shutil.copy(self.path / "clips" / "walk.bvh", self.path / "clips" / "stroll.bvh")
            server.process.send_signal(signal.SIGHUP)
            wait_for(lambda: [clip.name for clip in client.clips()] == ["stroll", "walk"])
            self.assertFalse(client.model_changed)
            changed = self.path / "changed.hdf"
            shutil.copy(OTHER_MODEL, changed)
            changed.rename(model)
            server.process.send_signal(signal.SIGHUP)
            wait_for(lambda: client.model_changed)
            client.open()
            server.process.send_signal(signal.SIGTERM)
            with self.assertRaises(ServerError) as goodbye:
                list(client.frames(10))
            self.assertEqual(goodbye.exception.code, 14)
            _, err = server.process.communicate(timeout=30)  # another signal would end it at once
            self.assertEqual(server.process.returncode, 0, err)
            self.assertIn("model body: read again", err)

    def test_one_of_two_models_is_read_again_while_both_are_shown(self):
        model = self.path / "body.hdf"
        other = self.path / "other.hdf"
        shutil.copy(MODEL, model)
        shutil.copy(OTHER_MODEL, other)
        good = MODEL.read_bytes() if isinstance(MODEL, pathlib.Path) else pathlib.Path(MODEL).read_bytes()
        flipped = bytearray(good)
        for at in range(2048, len(flipped), 65537):
            flipped[at] ^= 0xff
        with Server(model, other) as server, Client("127.0.0.1", server.port) as body, Client("127.0.0.1", server.port) as beside, \
                Client("127.0.0.1", server.port) as asks:
            before = body.open("body").message
            beside.open("other")
            asks.open("other")
            for client in (body, beside):
                client.subscribe_mesh(["skin"])

            def both_move():
                for client in (body, beside):
                    sequence = client.send_pose(client.body.rest_pose())
                    until = time.monotonic() + 10
                    while not any(frame.pose_sequence == sequence for frame in client.frames(0.2)):
                        self.assertLess(time.monotonic(), until, "a frame did not come")

            both_move()
            broken = [good[:part * len(good) // 1000] for part in (0, 1, 250, 500, 999)] + [bytes(flipped), b"not a model", b"\x89HDF\r\n\x1a\n"]
            for content in broken:
                model.write_bytes(content)
                with self.assertRaises(ServerError, msg=len(content)):
                    asks.reload("body")
                both_move()
            model.unlink()
            with self.assertRaises(ServerError):
                asks.reload("body")
            model.mkdir()
            with self.assertRaises(ServerError):
                asks.reload("body")
            model.rmdir()
            both_move()
            self.assertFalse(body.model_changed)
            shutil.copy(OTHER_MODEL, model)
            asks.reload("body")
            both_move()
            self.assertTrue(body.model_changed)
            self.assertFalse(beside.model_changed)
            self.assertEqual(body.open("body").message.identity, beside.body.message.identity)
            self.assertNotEqual(beside.body.message.identity, before.identity)
            self.assertEqual(len(asks.models()), 2)

    def test_clients_of_a_killed_server_come_back(self):
        done = threading.Event()
        frames, resumed, problems = [0] * 4, [0] * 4, []

        def live(row, port):
            """A client that connects again and again, and takes its place up where it can."""
            token = b""
            while not done.is_set():
                try:
                    with Client("127.0.0.1", port, resume_token=token, timeout=5) as client:
                        token = client.server.resume_token
                        if client.server.HasField("resumed"):
                            resumed[row] += 1
                            client.resume()
                        else:
                            client.open(session=f"session_{row}")
                            client.subscribe_mesh(["skin"])
                        until = time.monotonic() + 0.4
                        while not done.is_set() and time.monotonic() < until:
                            client.send_pose(client.body.rest_pose())
                            frames[row] += len(list(client.frames(1 / 60)))
                except (OSError, ServerError, TimeoutError):
                    time.sleep(0.05)
                except Exception as problem:  # pylint: disable=broad-except
                    problems.append(problem)
                    return

        # The same port throughout, as a supervisor would start it again.
        with Server(MODEL) as first:
            port = first.port
            clients = [threading.Thread(target=live, args=(row, port)) for row in range(4)]
            for client in clients:
                client.start()
            time.sleep(1.5)
            first.process.send_signal(signal.SIGKILL)
            first.process.wait(10)
            self.assertTrue(all(frames), frames)
            self.assertTrue(all(resumed), resumed)
        before = list(frames)
        with Server(MODEL, port=port):
            time.sleep(2)
            done.set()
            for client in clients:
                client.join(30)
        self.assertEqual(problems, [])
        self.assertTrue(all(now > then for now, then in zip(frames, before)), (before, frames))


if __name__ == "__main__":
    unittest.main(verbosity=2)
