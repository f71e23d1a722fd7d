#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""`scripts/render` on frames of `ecorche refill`: pictures, and an animated one that holds them all."""
import pathlib
import subprocess
import unittest
import zlib

import numpy as np

from bar_skeletons import BarTest  # first: it says where the renderer is
import volumes


class RenderedClip(BarTest):
    def test_a_posed_clip_is_rendered(self):
        keys, clip, pictures = self.folder / "clip.yaml", self.folder / "clip.nrrd", self.folder / "pictures"
        keys.write_text("ecorche_pose_sequence: 1\nskeleton: arm\nframes_per_second: 10\nkeys:\n  - {time_s: 0}\n"
                        "  - {time_s: 1, joints: {elbow: {abduction_deg: 80}}}\n")
        frames = self.ok("refill", self.few, self.bar, "-o", clip, "--rig", self.rig, "--motion", keys, "--frames", "0:11:5", "--sampling", "nearest")["frames"]
        render = pathlib.Path(__file__).resolve().parents[3] / "scripts/render"
        done = subprocess.run([render, *(frame["file"] for frame in frames), "-o", pictures, "--name", "bend", "--height", "90"],
                              capture_output=True, text=True, timeout=200)
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertEqual([pathlib.Path(line).name for line in done.stdout.split()], ["bend_0000.png", "bend_0001.png", "bend_0002.png", "bend_clip.png"])
        data, at, drawn, size = (pictures / "bend_clip.png").read_bytes(), 8, [], None
        while at < len(data):
            length, kind = int.from_bytes(data[at:at + 4], "big"), data[at + 4:at + 8]
            body = data[at + 8:at + 8 + length]
            if kind == b"IHDR":
                size = (int.from_bytes(body[4:8], "big"), int.from_bytes(body[:4], "big"))
            if kind in (b"IDAT", b"fdAT"):
                rows = np.frombuffer(zlib.decompress(body[4 * (kind == b"fdAT"):]), np.uint8).reshape(size[0], 1 + 3 * size[1])
                drawn.append(rows[:, 1:].reshape(*size, 3).astype(int))
            at += 12 + length
        self.assertEqual((len(drawn), size[0]), (3, 90))
        shown = [np.abs(frame - frame[0, 0]).max(axis=2) > 30 for frame in drawn]
        for mask in shown:
            self.assertGreater(mask.mean(), 0.02)
        # The arm swings: what is shown moves on from frame to frame.
        for one, two in zip(shown, shown[1:]):
            self.assertGreater((one ^ two).mean(), 0.01)

    def test_an_animated_picture_holds_every_frame(self):
        frames = [np.full((5, 7, 3), 40 * i, np.uint8) for i in range(3)]
        data = volumes.animated(frames, self.folder / "clip.png").read_bytes()
        self.assertEqual((data.count(b"acTL"), data.count(b"fcTL"), data.count(b"fdAT")), (1, 3, 2))


if __name__ == "__main__":
    unittest.main()
