#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""A client in JavaScript over a WebSocket gets what the Python client gets over TCP, in every encoding."""
import json
import os
import pathlib
import subprocess
import tempfile
import unittest

import numpy as np

from ecorche_client import Client
from ecorche_frames import ENCODINGS
from python_parts import bent, frames_of
from serving import Server

CLIENT = pathlib.Path(__file__).with_name("websocket_client.mjs")


class WebSocketTest(unittest.TestCase):
    def test_node_decodes_every_encoding(self):
        with Server(os.environ["ECORCHE_MODEL"], options=["--http", "127.0.0.1:0"]) as server, \
                tempfile.TemporaryDirectory() as folder, Client("127.0.0.1", server.port) as client:
            body = client.open()
            poses = [bent(body, 0.05 * (i + 1)) for i in range(4)]
            file = pathlib.Path(folder) / "poses.json"
            file.write_text(json.dumps([pose.ravel().tolist() for pose in poses]))
            whole = client.subscribe_mesh()
            expected = []
            for pose in poses:
                frame = frames_of(client, [whole], pose)[0]
                expected.append(np.concatenate([frame.positions[name].ravel() for name in body.tissues]))
            for name, encoding in ENCODINGS.items():
                out = pathlib.Path(folder) / name
                result = subprocess.run(["node", CLIENT, str(server.http_port), str(encoding), file, out],
                                        capture_output=True, text=True, timeout=120)
                self.assertEqual(result.returncode, 0, result.stderr)
                self.assertIn(f"encoding {encoding}", result.stdout)
                print(name, result.stdout.strip())
                for i, positions in enumerate(expected):
                    got = np.frombuffer(pathlib.Path(f"{out}.{i}").read_bytes(), "<f4")
                    self.assertEqual(got.shape, positions.shape)
                    worst = float(np.abs(got.astype(float) - positions).max())
                    self.assertLessEqual(worst, 0 if name == "f32" else 0.04, name)


if __name__ == "__main__":
    unittest.main()
