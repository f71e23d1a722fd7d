#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Levels of detail, regions, compressed volumes and changed bricks through the Python client, each against the whole; and what
the client refuses."""
import os
import unittest

import numpy as np

import ecorche_encodings
from ecorche_client import Client
from serving import Server

MODEL = os.environ["ECORCHE_MODEL"]


def bent(body, angle):
    pose = body.rest_pose()
    for joint in range(1, len(pose)):
        pose[joint] = np.cos(angle / 2), np.sin(angle / 2), 0, 0
    return pose


def frames_of(client, subscriptions, pose):
    """One frame per subscription of the next pose."""
    sequence = client.send_pose(pose)
    found = {}
    for frame in client.frames(seconds=20):
        if frame.pose_sequence == sequence:
            found[frame.subscription] = frame
        if set(found) == set(subscriptions):
            return [found[one] for one in subscriptions]
    raise AssertionError("frames are missing")


class PartsTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.server = Server(MODEL)

    @classmethod
    def tearDownClass(cls):
        code, _, err = cls.server.stop()
        cls.server.__exit__()
        assert code == 0, err

    def setUp(self):
        self.client = Client("127.0.0.1", self.server.port)
        self.body = self.client.open()

    def tearDown(self):
        self.client.close()

    def test_levels_are_rows_of_the_whole(self):
        levels = range(4)
        numbers = [self.client.subscribe_mesh(["skin"], level=level, encoding=encoding)
                   for encoding in ("f32", "u16-delta") for level in levels]
        for angle in (0.1, 0.2):
            frames = frames_of(self.client, numbers, bent(self.body, angle))
            whole = frames[0].positions["skin"]
            sizes = []
            for frame, level in zip(frames, [*levels, *levels]):
                self.assertEqual(frame.level, level)
                part = frame.parts["skin"] if level else None
                expected = whole[part.vertices] if level else whole
                sizes.append(len(part.triangles) if level else len(self.body.triangles["skin"]))
                if level:
                    self.assertLess(part.triangles.max(), len(part.vertices))
                step = frame.message.box.step if frame.message.HasField("box") else 0
                np.testing.assert_allclose(frame.positions["skin"], expected, rtol=0, atol=0.51 * step)
            for finer, coarser in zip(sizes, sizes[1:4]):
                self.assertLess(coarser, 0.5 * finer)

    def test_a_region_is_what_lies_in_its_box(self):
        everything = self.client.subscribe_mesh(["skin"])
        rest = frames_of(self.client, [everything], self.body.rest_pose())[0].positions["skin"]
        low, high = rest.min(axis=0), rest.max(axis=0)
        high[2] = (low[2] + high[2]) / 2
        half = self.client.subscribe_mesh(["skin"], region=(low - 1, high))
        whole, part = frames_of(self.client, [everything, half], bent(self.body, 0.2))
        rows = part.parts["skin"].vertices
        np.testing.assert_array_equal(part.positions["skin"], whole.positions["skin"][rows])
        self.assertTrue(0 < len(rows) < len(rest))
        self.assertTrue((rest[rows][:, 2] <= high[2] + 0.01).all())

    def test_every_way_of_sending_volumes_gives_the_same(self):
        name = self.body.message.volumes[0].name
        ways = [{}, {"compressed": True}, {"changed_bricks": True}, {"compressed": True, "changed_bricks": True}]
        numbers = [self.client.subscribe_volume(name, **way) for way in ways]
        bricks = 0
        for angle in (0.0, 0.1, 0.12):  # of a foot: most of the body stays
            pose = self.body.rest_pose()
            pose[-1] = np.cos(angle / 2), np.sin(angle / 2), 0, 0
            plain, *others = frames_of(self.client, numbers, pose)
            self.assertGreater(plain.voxels.size, 1000)
            for other, way in zip(others, ways[1:]):
                self.assertEqual(other.message.HasField("content"), "compressed" in way)
                np.testing.assert_array_equal(other.voxels, plain.voxels, str(way))
                bricks += other.message.HasField("bricks")
        self.assertGreater(bricks, 0)

    def test_every_reply_tells_quality(self):
        self.client.subscribe_mesh(["skin"])
        told = 0
        for i in range(20):
            self.client.send_pose(bent(self.body, 0.01 * i))
            for frame in self.client.frames(seconds=0.02):
                self.assertEqual([change.tissue for change in frame.quality.tissues], [0])
                self.assertLessEqual(frame.quality.pose_sequence, frame.pose_sequence)
                self.assertLessEqual(frame.quality.min_det_f, 1)
                told += 1
        self.assertGreater(told, 5)


class EncodingsTest(unittest.TestCase):
    """Without a server, where every answer is known."""

    def test_bricks_cut_short_by_the_grid(self):
        key = np.zeros((33, 40, 70), np.int16)
        expected = key.copy()
        expected[32:, 32:, 64:] = 7
        expected[:32, :32, 32:64] = 9
        count = np.count_nonzero
        rows = np.concatenate([np.full((count(expected == 9), 1), 9), np.full((count(expected == 7), 1), 7)]).astype(np.int16)
        np.testing.assert_array_equal(ecorche_encodings.with_bricks(key, np.array([1, 11]), rows), expected)
        self.assertFalse(key.any())
        for bricks, some in (([1, 12], rows), ([1], rows), ([1, 11], rows[:-1])):
            with self.assertRaises(ValueError):
                ecorche_encodings.with_bricks(key, np.array(bricks), some)

    def test_what_is_not_compressed(self):
        frame = bytes.fromhex("28b52ffd2003190000616263")  # "abc", raw block
        self.assertEqual(ecorche_encodings.decompress(np.frombuffer(frame, np.uint8), 3), b"abc")
        for spoilt, size in ((frame[:-1], 3), (frame, 2), (frame, 4), (b"abc", 3)):
            with self.assertRaises(ValueError):
                ecorche_encodings.decompress(np.frombuffer(spoilt, np.uint8), size)


if __name__ == "__main__":
    unittest.main()
