#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""A body over 100 Mbit/s with 50 ms there and back and 1 % of packets lost both ways, by the kernel's own TCP between two network
namespaces."""
import math
import os
import pathlib
import subprocess
import time
import unittest

from ecorche_client import Client
from serving import Server
from slow_link import NEAR, SlowLink

MODEL = pathlib.Path(os.environ["ECORCHE_MODEL"])
WALK, SETTLING, RATE = 8.0, 3.0, 60.0
DELAY = float(os.environ.get("SLOW_LINK_DELAY", "0.025"))  # seconds, each way


def link():
    try:
        return SlowLink(delay=DELAY)
    except (OSError, subprocess.CalledProcessError) as error:
        raise unittest.SkipTest(f"no network namespaces with TUN devices here: {error}")


class Walk:
    """Poses at RATE, and when whose frame came."""

    def __init__(self, client):
        self.client, self.sent, self.took, self.levels = client, {}, [], {}
        self.rest = client.body.rest_pose()

    def pose(self, k):
        bent = self.rest.copy()
        angle = 0.25 * math.sin(0.1 * k)
        bent[1:, 0], bent[1:, 1] = math.cos(angle / 2), math.sin(angle / 2)
        return bent

    def run(self):
        start = due = time.monotonic()
        while time.monotonic() < start + WALK:
            if time.monotonic() >= due:
                self.sent[self.client.send_pose(self.pose(len(self.sent)))] = time.monotonic()
                due += 1 / RATE
            for frame in self.client.frames(max(0.0, due - time.monotonic())):
                self.see(frame, start)

    def see(self, frame, start):
        if frame.pose_sequence in self.sent and time.monotonic() > start + SETTLING:
            self.took.append(1000 * (time.monotonic() - self.sent[frame.pose_sequence]))
            self.levels[frame.level] = self.levels.get(frame.level, 0) + 1

    def until_whole(self):
        """Seconds from the last pose until it was there in full detail."""
        last = max(self.sent)
        for frame in self.client.frames(20):
            if frame.pose_sequence == last and frame.level == 0:
                return time.monotonic() - self.sent[last]
        return math.inf


class SlowNetwork(unittest.TestCase):
    def walk(self, encoding):
        with link() as line, line.at(line.near), \
                Server(MODEL, host=NEAR, options=["--insecure"]) as server, line.at(line.far), \
                Client(NEAR, server.port) as client:
            client.open()
            client.subscribe_mesh(encoding=encoding, adaptive=True)
            list(client.frames(2))  # the body itself
            walk, before = Walk(client), client.bytes_received
            walk.run()
            kilobytes = (client.bytes_received - before) / 1e3 / WALK
            whole = walk.until_whole()
        took = sorted(walk.took)
        p95 = took[len(took) * 95 // 100]
        print(f"{encoding}: {len(took) / (WALK - SETTLING):.1f} frames and {kilobytes:.0f} kB a second, p50 {took[len(took) // 2]:.0f}, p95 {p95:.0f}, "
              f"most {took[-1]:.0f} ms; levels {dict(sorted(walk.levels.items()))}; full detail after {whole:.2f} s", flush=True)
        return p95, took[-1], whole

    def test_the_stream_keeps_up_and_comes_back(self):
        """Both namespaces meet losses as TCP did first (reno): that the server asks for another way is what lets it keep up."""
        allowed = pathlib.Path("/proc/sys/net/ipv4/tcp_available_congestion_control").read_text().split()
        if "bbr" not in allowed:
            self.skipTest("this kernel has no BBR (modprobe tcp_bbr)")
        for encoding in ("f32", "u16-delta"):
            with self.subTest(encoding=encoding):
                p95, most, whole = self.walk(encoding)
                self.assertLessEqual(p95, 250)
                self.assertLessEqual(most, 1000)
                self.assertLessEqual(whole, 1)


if __name__ == "__main__":
    unittest.main(verbosity=2)
