# SPDX-License-Identifier: Apache-2.0
"""What else clients ask of a server while it serves meshes: volumes, probes, radiographs, clips, a browser's WebSocket. Each answer is
held against the first one to the same question, or against another way to the same numbers."""
import hashlib
import json
import pathlib
import subprocess
import tempfile

import numpy as np
import programs
from beside import Beside
from ecorche_client import Client

BROWSER = programs.ROOT / "tests/e2e/stream/websocket_client.mjs"
F32 = 1  # of the protocol's encodings
BEND = 0.2  # radians


def bent(body):
    pose = body.rest_pose()
    pose[1:] = np.cos(BEND / 2), np.sin(BEND / 2), 0, 0
    return pose


class Visits(Beside):
    """One thing after the other, each by a client of its own. `told`: {what: (what is wanted, how often, what was wrong)}."""

    WANTED = {"volume": "the same voxels", "probe": "points come back", "radiograph": "the same picture", "clip": "poses come",
              "browser": "positions as over TCP"}

    def __init__(self, place, port, http_port):
        self.port, self.http_port, self.first = port, http_port, {}
        self.told = {name: (wanted, [0], []) for name, wanted in self.WANTED.items()}
        super().__init__(place, 1, self.told)

    def do(self, one):
        _, times, bad = self.told[one]
        times[0] += 1
        try:
            getattr(self, one)()
        except Exception as error:  # noqa: BLE001: whatever it is, it is told
            bad.append(f"{type(error).__name__}: {error}")

    def same(self, name, data):
        found = hashlib.sha256(bytes(data)).hexdigest()
        if self.first.setdefault(name, found) != found:
            raise RuntimeError(f"{name}: another answer than the first time")

    def posed(self, client, *subscriptions):
        """The frames of a bent pose, one of each subscription."""
        sequence, found = client.send_pose(bent(client.body)), {}
        for frame in client.frames(seconds=20):
            if frame.pose_sequence == sequence:
                found[frame.subscription] = frame
            if found.keys() >= set(subscriptions):
                return [found[one] for one in subscriptions]
        raise RuntimeError("frames are missing")

    def volume(self):
        with Client("127.0.0.1", self.port) as client:
            body = client.open()
            for name in [volume.name for volume in body.message.volumes]:
                [frame] = self.posed(client, client.subscribe_volume(name, region=((-60, -60, 850), (60, 60, 950)), compressed=True))
                self.same(name, np.ascontiguousarray(frame.voxels).tobytes())

    def probe(self):
        with Client("127.0.0.1", self.port) as client:
            client.open()
            [frame] = self.posed(client, client.subscribe_mesh([client.body.tissues[0]]))
            there = next(iter(frame.positions.values()))[::50]
            back = client.probe(there, to_rest=True)["points"]
            again = client.probe(back, to_rest=False)["points"]
            within = ~np.isnan(back).any(axis=1)  # a posed vertex may lie a rounding outside of every tet
            if within.mean() < 0.5:
                raise RuntimeError(f"only {within.mean():.0%} of the skin's points are in the body")
            off = np.nanmax(np.linalg.norm(again[within] - there[within], axis=1))
            if not off < 0.01:
                raise RuntimeError(f"a point comes back {off:.3f} mm from where it was")

    def radiograph(self):
        with Client("127.0.0.1", self.port) as client:
            client.open()
            self.posed(client, client.subscribe_mesh())
            self.same("radiograph", client.radiograph(surfaces=not client.body.message.volumes, pixels=(128, 128))[0].tobytes())

    def clip(self):
        with Client("127.0.0.1", self.port) as client:
            client.open()
            client.subscribe_mesh(max_rate=20)
            client.play(self.place.sequence.stem, loop=True)
            moving = {frame.pose_sequence for frame in client.frames(seconds=2)}
            if len(moving) < 3:
                raise RuntimeError(f"a clip that plays gives {len(moving)} poses in two seconds")
            client.play("")

    def browser(self):
        """The same positions over a WebSocket as over TCP."""
        with tempfile.TemporaryDirectory() as folder, Client("127.0.0.1", self.port) as client:
            body = client.open()
            [frame] = self.posed(client, client.subscribe_mesh())
            poses = pathlib.Path(folder) / "poses.json"
            poses.write_text(json.dumps([bent(body).ravel().tolist()]))
            words = ["node", BROWSER, self.http_port, F32, poses, f"{folder}/out"]
            done = subprocess.run([str(word) for word in words], capture_output=True, text=True, timeout=120)
            if done.returncode != 0:
                raise RuntimeError(done.stderr.strip()[-300:])
            expected = np.concatenate([frame.positions[name].ravel() for name in body.tissues]).astype("<f4")
            if (pathlib.Path(folder) / "out.0").read_bytes() != expected.tobytes():
                raise RuntimeError("positions over a WebSocket are others than over TCP")
