#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""What the package holds in memory goes when nobody holds it.

usage: memory_test.py SOURCE LIBRARY CLIENT_LIBRARY; the environment is that of the fixtures
"""
import os
import pathlib
import sys
import unittest
import weakref

SOURCE, LIBRARY, CLIENT = (pathlib.Path(word) for word in sys.argv[1:4])
MODEL = os.environ["ECORCHE_MODEL"]
os.environ["ECORCHE_LIBRARY"], os.environ["ECORCHE_CLIENT_LIBRARY"] = str(LIBRARY), str(CLIENT)
sys.path[:0] = [str(SOURCE / "clients" / "python" / "src"), str(SOURCE / "tests" / "e2e" / "stream")]

import ecorche  # noqa: E402
import numpy as np  # noqa: E402
from serving import Server  # noqa: E402

WARMING, ROUNDS = 5, 20


def resident():
    """MiB."""
    lines = pathlib.Path("/proc/self/status").read_text().splitlines()
    return next(int(line.split()[1]) for line in lines if line.startswith("VmRSS:")) / 1024


class Memory(unittest.TestCase):
    def stays(self, once):
        for _ in range(WARMING):
            once()
        before = resident()
        for _ in range(ROUNDS):
            once()
        self.assertLess(resident() - before, ROUNDS * self.model_mib() / 10)

    def model_mib(self):
        return pathlib.Path(MODEL).stat().st_size / 2**20

    def test_a_model_goes_with_the_last_array_that_shows_it(self):
        model = ecorche.Model(MODEL)
        handle, rest = weakref.ref(model._handle), model.tissue("skin").rest
        del model
        self.assertTrue(np.isfinite(rest).all())
        self.assertIsNotNone(handle())
        del rest
        self.assertIsNone(handle())

    def test_bodies_one_after_the_other(self):
        def once():
            body = ecorche.Model(MODEL).pose(elbow_left={"flexion": 70})
            body.positions("skin"), body.normals("skin"), body.measure()
        self.stays(once)

    def test_clients_one_after_the_other(self):
        with Server(MODEL) as server:
            def once():
                with ecorche.connect(server.address, normals=True) as client:
                    client.show(client.set("elbow_left", flexion=70).send())
                    client.positions("skin"), client.normals("skin")
            self.stays(once)


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1], verbosity=2)
