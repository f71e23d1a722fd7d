#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Two people and one body, through the Python client: who is there, control that is asked for and given, a clip that is steered."""
import os
import pathlib
import time
import unittest

from ecorche_client import Client, ServerError
from serving import Server

MODEL = pathlib.Path(os.environ["ECORCHE_MODEL"])
CASE = pathlib.Path(os.environ["ECORCHE_CASE"])


class Together(unittest.TestCase):
    def setUp(self):
        server = Server(MODEL, options=["--clips", str(CASE / "motion")])
        self.addCleanup(server.__exit__)
        self.server = server
        self.ada, self.bo = self.client("Ada"), self.client("Bo")

    def client(self, name):
        client = Client("127.0.0.1", self.server.port, name)
        self.addCleanup(client.close)
        client.body = client.open(session="shared")
        return client

    def wait(self, client, done, what):
        until = time.monotonic() + 20
        while not done():
            self.assertLess(time.monotonic(), until, what)
            for _ in client.frames(0.05):
                pass

    @staticmethod
    def listed(client):
        return [(member.name, member.role, member.asks_control) for member in client.members.members] if client.members else []

    def test_control_is_asked_for_and_given(self):
        self.wait(self.ada, lambda: self.listed(self.ada) == [("Ada", 1, False), ("Bo", 2, False)], "both are listed")
        pose = self.ada.body.rest_pose()
        pose[1] = (0.99, 0.141067, 0, 0)
        shown = self.ada.send_pose(pose)
        self.wait(self.ada, lambda: self.ada.acks, "the pose is shown")
        self.assertFalse(self.bo.ask_control())
        self.wait(self.ada, lambda: ("Bo", 2, True) in self.listed(self.ada), "who holds control sees who asks")
        asker = next(member for member in self.ada.members.members if member.asks_control)
        self.ada.give_control(asker.connection)
        self.wait(self.bo, lambda: self.bo.has_control, "it is given")
        self.wait(self.ada, lambda: not self.ada.has_control, "and gone")
        self.bo.subscribe_mesh(["skin"], pose=True)
        frame = next(iter(self.bo.frames(10)))
        self.assertEqual((frame.pose_sequence, frame.message.pose.sequence), (shown, shown))
        self.assertEqual(list(frame.message.pose.rotation[4:8]), [0.99, 0.141067, 0, 0])
        sequence = self.bo.send_pose(self.bo.body.rest_pose())
        self.assertEqual(sequence, shown + 1, "it goes on from there")
        self.assertIn(sequence, [frame.pose_sequence for frame in self.bo.frames(1)])
        with self.assertRaisesRegex(ServerError, "does not control"):
            self.ada.give_control(asker.connection)

    def test_a_clip_is_steered(self):
        clip = self.ada.clips()[0]
        with self.assertRaisesRegex(ServerError, "none plays or is paused"):
            self.ada.steer(paused=True)
        self.ada.play(clip.name, position=clip.seconds / 2, paused=True)
        self.wait(self.bo, lambda: self.bo.clip and self.bo.clip.name == clip.name, "all are told of it")
        self.assertAlmostEqual(self.bo.clip.position, clip.seconds / 2)
        self.assertFalse(self.bo.clip.playing)
        self.ada.steer(step=1)
        self.wait(self.bo, lambda: self.bo.clip.position > clip.seconds / 2, "a pose on")
        at = self.bo.clip.position
        self.assertLess(at - clip.seconds / 2, 1.01 / clip.frames_per_second)
        self.ada.steer(paused=False, speed=2.0, loop=True)
        self.wait(self.bo, lambda: self.bo.clip.playing and self.bo.clip.speed == 2 and self.bo.clip.loop, "it plays")
        late = self.client("Cy")
        self.wait(late, lambda: late.clip and late.clip.playing, "who comes late sees it, too")
        self.ada.play("")
        self.wait(self.bo, lambda: not self.bo.clip.name, "it is stopped")


if __name__ == "__main__":
    unittest.main(verbosity=2)
