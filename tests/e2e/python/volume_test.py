#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Volumes of the Python package: by tets and by balls, in process and by a server, which have to agree.

usage: volume_test.py SOURCE LIBRARY CLIENT_LIBRARY; the environment is that of the fixtures
"""
import asyncio
import json
import os
import pathlib
import subprocess
import sys
import tempfile
import unittest

SOURCE, LIBRARY, CLIENT = (pathlib.Path(word) for word in sys.argv[1:4])
MODEL, ECORCHE, PHANTOM = os.environ["ECORCHE_MODEL"], os.environ["ECORCHE_BIN"], pathlib.Path(os.environ["ECORCHE_CASE"])
os.environ["ECORCHE_LIBRARY"], os.environ["ECORCHE_CLIENT_LIBRARY"] = str(LIBRARY), str(CLIENT)
sys.path[:0] = [str(SOURCE / "clients" / "python" / "src"), str(SOURCE / "clients" / "python"), str(SOURCE / "tests" / "e2e" / "stream")]

import ecorche  # noqa: E402
import ecorche.aio  # noqa: E402
import numpy as np  # noqa: E402
from hostile import VOLUME_LIES, HostileServers  # noqa: E402
from serving import Server  # noqa: E402

BENT = {"elbow_left": {"flexion": 60}, "knee_right": {"flexion": 40}}
UPRIGHT = np.array([[1.0, 0, 0], [0, 0, 1], [0, 1, 0]])  # columns: a frontal slice runs along x and z


class Spheres(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.model = ecorche.Model(MODEL)
        cls.labels = cls.model.volume("labels")

    def test_a_body_is_thinned_as_the_command_does_it(self):
        spheres = self.model.thin(self.labels.rest, self.labels.grid)
        with tempfile.TemporaryDirectory() as folder:
            report = json.loads(subprocess.run([ECORCHE, "--json", "thin", PHANTOM / "volumes" / "labels.nrrd", "-o", pathlib.Path(folder) / "body.vtp"],
                                               capture_output=True, text=True, check=True).stdout)
        self.assertEqual((len(spheres), spheres.thinness), (report["skeletal"], 0.48))
        self.assertIn(f"{len(spheres)} balls", repr(spheres))
        i, j, k = spheres.voxels.T
        self.assertTrue((self.labels.rest[k, j, i] != 0).all())
        self.assertGreaterEqual(spheres.radii.min(), self.labels.grid.spacing[0])
        held = {self.model.segments[row].name for row in np.unique(spheres.segments)}
        self.assertIn("forearm_left", held)
        fewer = spheres.thinner(0.8)
        self.assertLess(len(fewer), len(spheres))
        self.assertEqual({tuple(v) for v in fewer.voxels} - {tuple(v) for v in spheres.voxels}, set())
        del spheres  # the views keep what they show
        self.assertEqual(len(fewer.voxels), len(fewer))

    def test_all_balls_give_the_scan_again(self):
        spheres = self.model.thin(self.labels.rest, self.labels.grid, -2)
        body = ecorche.Body(self.model)
        inside = self.labels.rest != 0
        for name in ("labels", "ct"):
            voxels, grid = body.refill(spheres, name)
            at = np.rint((self.labels.grid.origin - grid.origin) / grid.spacing).astype(int)
            i, j, k = (slice(a, a + n) for a, n in zip(at, self.labels.grid.size))
            np.testing.assert_array_equal(voxels[k, j, i][inside], self.model.volume(name).rest[inside])
        body = self.model.pose(**BENT)
        posed, grid = body.refill(spheres, "labels")
        centre = self.model.segment("shank_right").centre
        region = [*(centre - 50), *(centre + 50)]
        part, where = body.refill(spheres, "labels", region=region)
        i, j, k = np.rint((where.origin - grid.origin) / grid.spacing).astype(int)
        np.testing.assert_array_equal(part, posed[k:k + part.shape[0], j:j + part.shape[1], i:i + part.shape[2]])
        self.assertGreater((part != 0).mean(), 0.1)
        again, _ = body.refill(spheres, "labels", where)
        np.testing.assert_array_equal(again, part)
        still = spheres.hung(np.zeros(len(spheres), int))  # all on the pelvis, which stays
        rest, grid = body.refill(still, "labels", self.labels.grid)
        np.testing.assert_array_equal(rest[inside], self.labels.rest[inside])

    def test_what_is_wrong_is_refused_in_words(self):
        with self.assertRaisesRegex(ecorche.NotPossible, "holds no spheres"):
            self.model.spheres("ct")
        with self.assertRaisesRegex(ecorche.InvalidArgument, r"inside: has the shape \(3, 3, 3\)"):
            self.model.thin(np.ones((3, 3, 3)), self.labels.grid)
        spheres = self.model.thin(self.labels.rest, self.labels.grid)
        for wrong in (np.zeros(3, int), np.zeros(len(spheres)), np.full(len(spheres), 1e9, int), np.full(len(spheres), 2**40)):
            with self.assertRaisesRegex(ecorche.InvalidArgument, "segments: "):
                spheres.hung(wrong)
        body = ecorche.Body(self.model)
        with self.assertRaisesRegex(ecorche.InvalidArgument, "give one of both"):
            body.refill(spheres, 0, self.labels.grid, region=[0] * 6)
        other = ecorche.Body(ecorche.Model(MODEL))
        with self.assertRaisesRegex(ecorche.InvalidArgument, "of another model"):
            other.refill(spheres)


class Streams(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.model = ecorche.Model(MODEL)
        cls.server = Server(MODEL)
        cls.addClassCleanup(cls.server.__exit__)

    def test_volumes_regions_and_slices_are_those_of_a_body_here(self):
        centre = self.model.segment("forearm_left").centre
        region = [*(centre - 60), *(centre + 60)]
        plane = ecorche.Grid((50, 70, 1), centre - [100, 0, 140], np.array([4.0, 4, 1]), UPRIGHT)
        body = self.model.pose(**BENT)
        whole, grid = body.volume("ct")
        with ecorche.connect(self.server.address) as client:
            self.assertEqual([(v.name, v.components, v.rest.dtype, v.rest.size) for v in client.volumes],
                             [(v.name, v.components, v.rest.dtype, 0) for v in self.model.volumes])
            ct, part = client.subscribe_volume("ct"), client.subscribe_volume("ct", region=region, compressed=True)
            flat = client.subscribe_volume("ct", slices=[plane, plane])
            self.assertIsNone(client.subscribe_volume("labels").sequence)
            for joint, angles in BENT.items():
                client.set(joint, **angles)
            sequence = client.send()
            np.testing.assert_array_equal(ct.show(sequence).voxels()[0], whole)
            np.testing.assert_array_equal(ct.voxels()[1].origin, grid.origin)
            voxels, where = part.show(sequence).voxels()
            i, j, k = np.rint((where.origin - grid.origin) / grid.spacing).astype(int)
            np.testing.assert_array_equal(voxels, whole[k:k + voxels.shape[0], j:j + voxels.shape[1], i:i + voxels.shape[2]])
            for row in (0, 1):
                shown, where = flat.show(sequence).voxels(row)
                np.testing.assert_array_equal(shown, body.volume("ct", plane)[0])
                self.assertEqual(where.size, plane.size)
            self.assertGreater((shown > -500).mean(), 0.05)
            # Frames that came meanwhile count for who waits for them afterwards, and the other way round.
            self.assertEqual(client.show(sequence, 5).sequence, sequence)
            client.show(sequence := client.set("knee_right", flexion=10).send())
            self.assertEqual(ct.show(sequence, 5).sequence, sequence)
            client.resume()
            sequence = client.set("knee_right", flexion=20).send()
            self.assertEqual(ct.show(sequence).sequence, sequence)
            ct.close()
            with self.assertRaisesRegex(ecorche.NotFound, "there is none"):
                ct.voxels()
            with self.assertRaisesRegex(ecorche.NotPossible, "spheres"):
                client.subscribe_volume("ct", spheres=True)
            with self.assertRaisesRegex(ecorche.InvalidArgument, "region: has the shape"):
                client.subscribe_volume("ct", region=[1, 2, 3])
            with self.assertRaisesRegex(ecorche.NotFound, "no such volume"):
                client.subscribe_volume("mri")
            with self.assertRaisesRegex(ecorche.NotPossible, "was not shown within 0.1 s"):
                part.show(sequence + 100, 0.1)

    def test_a_server_that_lies_of_volumes_is_found_out(self):
        with HostileServers(int(self.server.address.partition(":")[2])) as servers:
            for lie in VOLUME_LIES:
                with self.subTest(lie), ecorche.connect(servers.address("volume_" + lie)) as client:
                    stream = client.subscribe_volume("ct")
                    with self.assertRaisesRegex(ecorche.Error, r"^server: .* \(check that it is ecorche serve\)$"):
                        stream.show(0)
                    self.assertIsNone(stream.sequence)

    def test_for_asyncio_several_wait_at_once(self):
        body = self.model.pose(**BENT)

        async def run():
            async with ecorche.aio.connect(self.server.address) as client:
                streams = [await client.subscribe_volume("ct"), await client.subscribe_volume("labels")]
                self.assertEqual(client.volumes[0].name, "ct")
                for joint, angles in BENT.items():
                    await client.set(joint, **angles)
                for _ in range(5):
                    sequence = await client.send()
                    await asyncio.gather(client.show(sequence), *(stream.show(sequence) for stream in streams))
                    self.assertEqual(await streams[0].sequence(), sequence)
                np.testing.assert_array_equal((await streams[0].voxels())[0], body.volume("ct")[0])
                np.testing.assert_array_equal((await streams[1].voxels())[0], body.volume("labels")[0])
                with self.assertRaisesRegex(ecorche.NotPossible, "was not shown"):
                    await streams[0].show(sequence + 100, 0.1)
                await streams[1].close()
                with self.assertRaisesRegex(ecorche.NotFound, "there is none"):
                    await streams[1].voxels()

        asyncio.run(run())


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1])
