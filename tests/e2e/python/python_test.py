#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""The package as its users have it: installed by pip, on the phantom, held against the command.

usage: python_test.py SOURCE LIBRARY CLIENT_LIBRARY; the environment is that of the fixtures
"""
import gc
import json
import os
import pathlib
import shutil
import subprocess
import sys
import tempfile
import time
import unittest

SOURCE, LIBRARY, CLIENT = (pathlib.Path(word) for word in sys.argv[1:4])
MODEL, ECORCHE = os.environ["ECORCHE_MODEL"], os.environ["ECORCHE_BIN"]

installed = tempfile.TemporaryDirectory()
# From a copy: building writes into its source.
copy = pathlib.Path(installed.name) / "source"
subprocess.run(["cp", "-r", SOURCE / "clients" / "python", copy], check=True)
subprocess.run([sys.executable, "-m", "pip", "install", "--quiet", "--no-index", "--no-build-isolation", "--no-deps", "--target",
                pathlib.Path(installed.name) / "site", copy], check=True)
sys.path.insert(0, str(pathlib.Path(installed.name) / "site"))
os.environ["ECORCHE_LIBRARY"], os.environ["ECORCHE_CLIENT_LIBRARY"] = str(LIBRARY), str(CLIENT)
sys.path.insert(0, str(SOURCE / "tests" / "e2e" / "stream"))

import ecorche  # noqa: E402
import numpy as np  # noqa: E402
from relay import Relay  # noqa: E402
from serving import Server  # noqa: E402


class Python(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.model = ecorche.Model(MODEL)

    def test_it_tells_what_the_model_holds(self):
        info = json.loads(subprocess.run([ECORCHE, "--json", "info", MODEL], capture_output=True, text=True, check=True).stdout)
        self.assertEqual([(t.name, t.group, len(t.rest), len(t.triangles)) for t in self.model.tissues],
                         [(t["name"], t["group"], t["vertices"], t["triangles"]) for t in info["tissues"]])
        self.assertEqual(len(self.model.segments), info["segments"])
        self.assertIn("Model " + self.model.name, repr(self.model))
        elbow = next(a for a in self.model.angles if (a.joint, a.name) == ("elbow_left", "flexion"))
        self.assertGreater(elbow.max, 100)
        self.assertEqual(self.model.segment("elbow_left").name, self.model.segment("forearm_left").name)
        self.assertIsNone(self.model.segments[0].parent)

    def test_a_pose_is_the_commands(self):
        with tempfile.TemporaryDirectory() as folder:
            out = pathlib.Path(folder) / "posed"
            report = json.loads(subprocess.run([ECORCHE, "--json", "pose", MODEL, "--pose", "lib:sitting", "-o", out], capture_output=True, text=True,
                                               check=True).stdout)
            record = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("unused", "<u2")])
            skin = np.frombuffer((out / "skin.stl").read_bytes(), record, offset=84)["corners"]
        body = self.model.pose("lib:sitting")
        np.testing.assert_allclose(body.positions("skin")[self.model.tissue("skin").triangles], skin, atol=1e-3)
        quality = body.measure()
        self.assertEqual("pass" if quality.passes else "warn", report["frames"][0]["quality"]["verdict"])
        self.assertEqual(quality.passes, not quality.reasons)
        self.assertEqual(body.measure(sampled=True).inverted_tets > 0, quality.inverted_tets > 0)

    def test_left_and_right_are_where_engines_have_them(self):
        body = self.model.pose(shoulder_left={"abduction": 80})
        hand = self.model.segment("hand_left")
        bones = [t.row for t in self.model.tissues if t.segment == hand.name]
        middle = {space: body.copy(bones[0], space).mean(axis=0) for space in ("lps", "unity", "unreal", "gltf", "ros", "ras")}
        # The left hand: at +x of LPS, glTF; -x of Unity, RAS; +y of ROS; -y of Unreal. Higher than the hips in each.
        self.assertGreater(middle["lps"][0], 300)
        np.testing.assert_allclose(middle["unity"], middle["lps"][[0, 2, 1]] * [-1e-3, 1e-3, -1e-3], atol=1e-5)
        np.testing.assert_allclose(middle["unreal"], middle["lps"][[1, 0, 2]] * [-0.1, -0.1, 0.1], atol=1e-3)
        np.testing.assert_allclose(middle["gltf"], middle["lps"][[0, 2, 1]] * [1e-3, 1e-3, -1e-3], atol=1e-5)
        np.testing.assert_allclose(middle["ros"], middle["lps"][[1, 0, 2]] * [-1e-3, 1e-3, 1e-3], atol=1e-5)
        np.testing.assert_allclose(middle["ras"], middle["lps"] * [-1, -1, 1], atol=1e-2)

    def test_views_are_the_librarys_memory(self):
        pose, body = ecorche.Pose(self.model), ecorche.Body(self.model)
        skin = body.positions("skin")
        rest = skin.copy()
        self.assertLess(np.abs(rest - self.model.tissue("skin").rest).max(), 1e-3)
        body.update(pose.set("knee_right", flexion=60))
        self.assertGreater(np.abs(skin - rest).max(), 100, "the same array, posed")
        self.assertEqual(body.positions("skin").ctypes.data, skin.ctypes.data)
        with self.assertRaises(ValueError):
            skin[0] = 0
        lengths = np.linalg.norm(body.normals("skin") / 32767.0, axis=1)
        self.assertLess(np.abs(lengths - 1).max(), 2e-3)
        moved = skin.copy()
        del body, pose
        gc.collect()
        np.testing.assert_array_equal(skin, moved)  # the view keeps its body

    def test_angles_and_turns(self):
        pose = ecorche.Pose(self.model).set("elbow_left", flexion=70)
        self.assertAlmostEqual(pose.get("elbow_left", "flexion"), 70)
        turn = pose.rotation("elbow_left")
        again = ecorche.Pose(self.model).set_rotation("elbow_left", turn)
        np.testing.assert_allclose(ecorche.Body(self.model).update(again).positions(), ecorche.Body(self.model).update(pose).positions(), atol=1e-4)
        self.assertEqual(list(pose.reset().rotation("elbow_left")), [0, 0, 0, 1])
        bent = self.model.pose(knee_left={"flexion": 175})
        self.assertGreater(bent.clamped["knee_left"], 10)
        moved = ecorche.Body(self.model).update(ecorche.Pose(self.model).set_root([0, 0, 500]))
        self.assertAlmostEqual(float((moved.positions() - self.model.tissue(0).rest).mean(axis=0)[2]), 500, places=1)
        np.testing.assert_allclose(moved.motion(0), np.hstack([np.eye(3), [[0], [0], [500]]]), atol=1e-9)

    def test_volumes_points_and_slices(self):
        body = self.model.pose("lib:arms_up")
        volume = self.model.volumes[0]
        posed, grid = body.volume(volume.name)
        self.assertEqual(posed.shape, tuple(reversed(grid.size)))
        i, j, k = (n // 2 for n in grid.size)
        at = grid.origin + grid.direction @ (grid.spacing * (0, 0, k))
        flat = ecorche.Grid((grid.size[0], grid.size[1], 1), at, grid.spacing, grid.direction)
        np.testing.assert_array_equal(body.volume(volume.row, flat)[0][0], posed[k])
        points = grid.origin + (grid.spacing * [(i, j, k), (i, j - 3, k)]) @ grid.direction.T
        scanned = body.to_rest(points, volume.name)
        self.assertTrue((scanned.tets >= 0).all())
        self.assertNotIn(None, scanned.tissues)
        there = body.to_posed(scanned.points)
        np.testing.assert_allclose(there.points, points, atol=1e-2)
        self.assertEqual(there.values, None)
        self.assertEqual(body.to_rest([[1e5, 0, 0]]).tissues, [None])

    def test_what_is_refused(self):
        with self.assertRaisesRegex(ecorche.NotFound, "/nowhere.hdf"):
            ecorche.Model("/nowhere.hdf")
        with self.assertRaisesRegex(ecorche.NotFound, r"nose\.flexion: the model has no such angle"):
            self.model.pose(nose={"flexion": 10})
        with self.assertRaisesRegex(ecorche.NotFound, "wings: the model has no such tissue"):
            self.model.pose().positions("wings")
        with self.assertRaisesRegex(ecorche.NotFound, "pet: the model has no such volume"):
            self.model.volume("pet")
        with self.assertRaisesRegex(ecorche.NotFound, "tail: the model has no such segment or joint"):
            self.model.segment("tail")
        with self.assertRaisesRegex(ecorche.NotFound, "elbow_left.yaw: the model has no such angle"):
            ecorche.Pose(self.model).get("elbow_left", "yaw")
        with self.assertRaisesRegex(ecorche.InvalidArgument, "arms_up"):
            self.model.pose("lib:flying")
        with self.assertRaisesRegex(ecorche.InvalidArgument, "skinning: best is none of lbs, dqs, cor"):
            self.model.pose(skinning="best")
        with self.assertRaisesRegex(ecorche.InvalidArgument, "space: mars is none of"):
            self.model.pose().copy(space="mars")
        with self.assertRaisesRegex(ecorche.InvalidArgument, r"points: have the shape \(3,\)"):
            self.model.pose().to_rest([1, 2, 3])
        for wrong in (lambda p: p.set_root((1, 2)), lambda p: p.set_rotation(0, (0, 0, 1)), lambda p: p.set_rotation(0, (0, 0, 0, 1, 0))):
            self.assertRaisesRegex(ecorche.InvalidArgument, r"\(give [34] numbers\)", wrong, ecorche.Pose(self.model))
        body = ecorche.Body(self.model, normals=False).update(ecorche.Pose(self.model), tissues=["skin"])
        with self.assertRaisesRegex(ecorche.InvalidArgument, "the last update did not pose it"):
            body.positions(1)
        with self.assertRaisesRegex(ecorche.InvalidArgument, "has no normals"):
            body.normals("skin")
        nowhere = ecorche.Grid((0, 1, 1), np.zeros(3), np.ones(3), np.eye(3))
        with self.assertRaisesRegex(ecorche.InvalidArgument, r"\(0, 1, 1\) voxels are none"):
            body.volume(0, nowhere)
        missing = subprocess.run([sys.executable, "-c", "import ecorche"], capture_output=True, text=True,
                                 env={**os.environ, "PYTHONPATH": str(pathlib.Path(installed.name) / "site"), "ECORCHE_LIBRARY": "/nowhere.so"})
        self.assertIn("ImportError: /nowhere.so", missing.stderr)
        self.assertIn("install libecorche, or name the file in ECORCHE_LIBRARY", missing.stderr)


class Clients(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.model = ecorche.Model(MODEL)
        cls.server = Server(MODEL)

    @classmethod
    def tearDownClass(cls):
        cls.server.__exit__()

    def test_what_the_server_poses_is_what_is_posed_here(self):
        here = ecorche.Body(self.model)
        pose = ecorche.Pose(self.model)
        for encoding, within in (("f32", 0), ("u16", 0.06), ("u16-delta", 0.06)):
            with ecorche.connect(self.server.address, encoding=encoding, normals=True) as client:
                self.assertTrue(client.controls)
                self.assertIn("ecorche", client.server)
                self.assertEqual([t.name for t in client.tissues], [t.name for t in self.model.tissues])
                for mine, theirs in zip(self.model.tissues, client.tissues):
                    np.testing.assert_array_equal(mine.triangles, theirs.triangles)
                self.assertEqual([(a.joint, a.name, a.min, a.max) for a in client.angles], [(a.joint, a.name, a.min, a.max) for a in self.model.angles])
                for degrees in (10, 40, 80):
                    frame = client.set("knee_right", flexion=degrees).show(client.send())
                    self.assertGreater(frame.sequence, 0)
                    here.update(pose.set("knee_right", flexion=degrees))
                    for tissue in ("skin", "femur_right", "tibia_right"):
                        self.assertLessEqual(np.abs(client.positions(tissue) - here.positions(tissue)).max(), within, f"{encoding}, {tissue}")
                turned = (client.normals("skin") * here.normals("skin")).sum(axis=1) / 32767
                self.assertGreater(turned.min(), np.cos(np.radians(2)))
                np.testing.assert_allclose(client.copy("skin", "gltf"), client.positions("skin")[:, [0, 2, 1]] * [1e-3, 1e-3, -1e-3], atol=1e-5)
                # Into a caller's own vertices, of which some bytes are not the library's.
                both = np.full((len(client.positions("skin")), 7), 9, np.float32)
                client._call("copy", client._handle, 0, ecorche.body.SPACES["gltf"], both.ctypes.data, 28, both.ctypes.data + 12, 28, len(both))
                np.testing.assert_array_equal(both[:, :3], client.copy("skin", "gltf"))
                np.testing.assert_array_equal(both[:, 3:], np.c_[client.normals("skin")[:, [0, 2]], -client.normals("skin")[:, 1], np.full(len(both), 9, "f4")])
                self.assertGreater(client.bytes_received, 10000)

    def test_quality_and_points(self):
        with ecorche.connect(self.server.address, quality=True) as client:
            client.show(client.set("elbow_left", flexion=90).send())
            body = self.model.pose(elbow_left={"flexion": 90})
            quality, sequence = client.quality()
            self.assertEqual((quality.passes, sequence), (body.measure(sampled=True).passes, 1))
            self.assertEqual(quality.inverted_tets, body.measure(sampled=True).inverted_tets)
            points = [self.model.segment("forearm_left").centre + [0, 0, -60], [1e5, 0, 0]]
            there, tissues = client.to_posed(points)
            mine = body.to_posed(points)
            np.testing.assert_allclose(there, mine.points, atol=1e-3)
            self.assertEqual(tissues, mine.tissues)
            back, _ = client.to_rest(there[:1])
            np.testing.assert_allclose(back, points[:1], atol=1e-2)

    def test_two_in_one_session(self):
        with ecorche.connect(self.server.address) as first, ecorche.connect(self.server.address, session=first.session, tissues=["skin"]) as second:
            self.assertEqual((first.controls, second.controls), (True, False))
            with self.assertRaises(ecorche.NotPossible):
                second.claim()
            sent = first.set("elbow_left", flexion=60).send()
            self.assertEqual(second.show(sent).sequence, sent)
            np.testing.assert_array_equal(second.positions("skin"), (first.show(sent), first.positions("skin"))[1])
            second.send()
            with self.assertRaisesRegex(ecorche.NotPossible, "control"):
                list(second.frames(5))
            first.release()
            second.claim()
            self.assertTrue(second.controls)
            self.assertGreater(second.show(second.set("elbow_left", flexion=20).send()).sequence, sent)
            list(first.frames(0.2))
            self.assertFalse(first.controls)
            with self.assertRaisesRegex(ecorche.NotPossible, "femur_left: no frame has brought its positions"):
                second.positions("femur_left")
            with self.assertRaisesRegex(ecorche.NotPossible, "no frame has brought its normals"):
                second.normals("skin")
        # Who comes later goes on from where the session is.
        with ecorche.connect(self.server.address) as first:
            first.show(first.set("elbow_left", flexion=60).send())
            with ecorche.connect(self.server.address, session=first.session) as second:
                shown = first.positions("skin")
                first.release()
                second.claim()
                second.show(second.send())
                np.testing.assert_allclose(second.positions("skin"), shown, atol=0.1)

    def test_who_closes_leaves_control_to_the_next(self):
        for degrees in (30, 60):  # a script that is run again, frames still on their way
            with ecorche.connect(self.server.address, session="again") as client:
                self.assertTrue(client.controls)
                client.set("elbow_left", flexion=degrees).send()

    def test_what_is_refused(self):
        with self.assertRaisesRegex(ecorche.Unavailable, "127.0.0.1:1: cannot be reached"):
            ecorche.connect("127.0.0.1:1")
        with self.assertRaisesRegex(ecorche.InvalidArgument, "is not HOST:PORT"):
            ecorche.connect("nowhere")
        with self.assertRaises(ecorche.NotFound):
            ecorche.connect(self.server.address, "nobody")
        with self.assertRaisesRegex(ecorche.InvalidArgument, "encoding: best is none of f32, u16, u16-delta"):
            ecorche.connect(self.server.address, encoding="best")
        with ecorche.connect(self.server.address) as client:
            self.assertEqual(len(client.models), 1)
            with self.assertRaisesRegex(ecorche.NotFound, "nose.flexion: the model has no such angle"):
                client.set("nose", flexion=1)
            with self.assertRaisesRegex(ecorche.InvalidArgument, "skinning: best is none of"):
                client.send(skinning="best")
            with self.assertRaisesRegex(ecorche.InvalidArgument, "not 1 to 10000 points"):
                client.to_rest(np.zeros((10001, 3)))
            with self.assertRaisesRegex(ecorche.NotPossible, "was not shown within 0.1 s"):
                client.show(10, seconds=0.1)

    def test_a_server_that_goes_is_told(self):
        with Server(MODEL) as server:
            with ecorche.connect(server.address) as client:
                client.show(client.send())
                server.process.kill()
                with self.assertRaises(ecorche.Unavailable):
                    for _ in range(100):
                        client.send()
                        list(client.frames(0.05))

    def test_it_comes_back_to_its_place(self):
        with Relay(self.server.port) as relay, ecorche.connect(relay.address) as client, \
                ecorche.connect(self.server.address, session=client.session) as watcher:
            shown = client.set("elbow_left", flexion=70).send()
            client.show(shown)
            before = client.positions("skin")
            relay.cut()
            with self.assertRaises(ecorche.Unavailable):
                for _ in range(100):
                    client.send()
                    list(client.frames(0.05))
            self.assertRaises(ecorche.NotPossible, watcher.claim)  # the place is kept
            relay.mend()
            client.resume()
            self.assertTrue(client.controls)
            list(client.frames(1))
            np.testing.assert_array_equal(client.positions("skin"), before)
            sent = client.set("elbow_left", flexion=20).send()
            client.show(sent)
            self.assertEqual(watcher.show(sent).sequence, sent)
            np.testing.assert_array_equal(client.positions("skin"), watcher.positions("skin"))

    def test_it_comes_back_after_the_server_was_gone(self):
        with Server(MODEL) as first:
            client = ecorche.connect(first.address, session="ward")
            self.addCleanup(client.close)
            client.show(client.set("elbow_left", flexion=70).send())
            before, port = client.positions("skin"), first.port
            first.process.kill()
            first.process.wait()
            with self.assertRaisesRegex(ecorche.Unavailable, "cannot be reached"):
                client.resume()
        with Server(MODEL, port=port):
            client.resume()
            self.assertEqual((client.controls, client.session), (True, "ward"))
            np.testing.assert_array_equal(client.positions("skin"), before)  # what was shown stays
            client.show(client.send())  # the pose that was set
            np.testing.assert_array_equal(client.positions("skin"), before)
        with tempfile.TemporaryDirectory() as folder:
            case, other = pathlib.Path(folder) / "case", pathlib.Path(folder) / "other.hdf"
            shutil.copytree(os.environ["ECORCHE_CASE"], case)
            lines = (case / "case.yaml").read_text().splitlines(keepends=True)
            (case / "case.yaml").write_text("".join(line for line in lines if "name: biceps_brachii_left" not in line))
            subprocess.run([ECORCHE, "preprocess", case, "-o", other, "--max-tets", "20000"], check=True, capture_output=True)
            with Server(other, port=port):
                with self.assertRaisesRegex(ecorche.Error, "no model of that name"):
                    client.resume()
            same_name = pathlib.Path(folder) / pathlib.Path(MODEL).name
            other.rename(same_name)
            with Server(same_name, port=port) as server:
                for _ in range(2):  # who tries again and again
                    with self.assertRaisesRegex(ecorche.NotPossible, "the server's model is another one by now"):
                        client.resume()
                with ecorche.connect(server.address, session="ward") as anew:
                    self.assertTrue(anew.controls)

    def test_clips_and_recordings(self):
        with tempfile.TemporaryDirectory() as folder:
            with Server(MODEL, options=("--record-dir", folder)) as server, ecorche.connect(server.address) as client:
                client.record("bend")
                for degrees in (20, 40, 60):
                    client.show(client.set("elbow_left", flexion=degrees).send())
                last = client.positions("skin")
                client.record(None)
                self.assertEqual(list(client.clips), ["bend"])
                self.assertGreater(client.clips["bend"], 0)
                client.show(client.reset().send())
                self.assertGreater(np.abs(client.positions("skin") - last).max(), 50)
                client.play("bend", speed=2)
                until = time.monotonic() + 20
                while np.abs(client.positions("skin") - last).max() > 0.1:
                    self.assertLess(time.monotonic(), until)
                    list(client.frames(0.1))
                client.play(None)
                client.show(client.set("elbow_left", flexion=5).send())
                with self.assertRaises(ecorche.NotFound):
                    client.play("running")
                with self.assertRaises(ecorche.InvalidArgument):
                    client.play("bend", speed=1000)
                with self.assertRaisesRegex(ecorche.Error, "bend"):
                    client.record("bend")
        with ecorche.connect(self.server.address) as client:
            with self.assertRaisesRegex(ecorche.NotPossible, "--record-dir"):
                client.record("bend")

    def test_the_token_opens(self):
        with tempfile.TemporaryDirectory() as folder:
            token = pathlib.Path(folder) / "token"
            token.write_text("a-secret-of-the-clinic-1234")
            token.chmod(0o600)
            with Server(MODEL, options=("--token-file", token)) as server:
                with self.assertRaises(ecorche.Error):
                    ecorche.connect(server.address)
                with ecorche.connect(server.address, token="a-secret-of-the-clinic-1234") as client:
                    self.assertTrue(client.controls)


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1], verbosity=2)
