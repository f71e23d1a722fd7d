#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""ecorche.aio against servers that pose, lie, break off and are replaced.

usage: aio_test.py SOURCE LIBRARY CLIENT_LIBRARY; the environment is that of the fixtures
"""
import asyncio
import os
import pathlib
import shutil
import signal
import subprocess
import sys
import tempfile
import threading
import time
import unittest

SOURCE, LIBRARY, CLIENT = (pathlib.Path(word) for word in sys.argv[1:4])
MODEL, ECORCHE = os.environ["ECORCHE_MODEL"], os.environ["ECORCHE_BIN"]
os.environ["ECORCHE_LIBRARY"], os.environ["ECORCHE_CLIENT_LIBRARY"] = str(LIBRARY), str(CLIENT)
sys.path[:0] = [str(SOURCE / "clients" / "python" / "src"), str(SOURCE / "tests" / "e2e" / "stream")]

import ecorche  # noqa: E402
import ecorche.aio  # noqa: E402
import numpy as np  # noqa: E402
from ecorche_client import Client as Plain  # noqa: E402
from hostile import HostileServers  # noqa: E402
from relay import Relay  # noqa: E402
from serving import Server  # noqa: E402


class Aio(unittest.IsolatedAsyncioTestCase):
    @classmethod
    def setUpClass(cls):
        cls.model = ecorche.Model(MODEL)
        cls.server = Server(MODEL)
        cls.addClassCleanup(cls.server.__exit__)

    def setUp(self):
        self.threads = threading.active_count()

    async def test_a_name_is_not_cut_at_a_nul(self):
        for wrong in (lambda: ecorche.Model(f"{MODEL}\0.txt"), lambda: self.model.pose("lib:arms_up\0"), lambda: self.model.pose(knee_right={"flexion\0": 10}),
                      lambda: ecorche.connect(self.server.address, session="ward\0")):
            self.assertRaisesRegex(ecorche.InvalidArgument, "holds a NUL", wrong)
        with self.assertRaisesRegex(ecorche.InvalidArgument, "holds a NUL"):
            await ecorche.aio.connect(self.server.address, "model\0")

    async def test_five_steps(self):
        async with ecorche.aio.connect(self.server.address, encoding="f32", normals=True, quality=True) as client:  # connect, open
            self.assertTrue(await client.controls())
            await (await client.set("elbow_left", flexion=90)).set("knee_right", flexion=30)  # pose
            await client.show(await client.send())
            body = self.model.pose(elbow_left={"flexion": 90}, knee_right={"flexion": 30})
            np.testing.assert_array_equal(await client.positions("skin"), body.positions("skin"))  # draw
            self.assertEqual((await client.normals("skin")).shape, body.positions("skin").shape)
            np.testing.assert_allclose(await client.copy("skin", "ras"), body.copy("skin", "ras"), atol=1e-3)
            quality, sequence = await client.quality()
            self.assertEqual((quality.passes, sequence), (body.measure(sampled=True).passes, 1))
            points = [self.model.segment("forearm_left").centre + [0, 0, -60], [1e5, 0, 0]]
            there, tissues = await client.to_posed(points)  # probe
            mine = body.to_posed(points)
            np.testing.assert_allclose(there, mine.points, atol=1e-3)
            self.assertEqual(tissues, mine.tissues)
            self.assertEqual(len(await client.models()), 1)
            self.assertGreater(await client.bytes_received(), 10000)

    async def test_frames_come_to_who_looks_on_and_no_thread_waits(self):
        async with ecorche.aio.connect(self.server.address) as one, ecorche.aio.connect(self.server.address, session=one.session, tissues=["skin"]) as two:
            async def look():
                async for frame in two.frames():
                    if frame.sequence >= 5:
                        return frame.sequence

            looking = asyncio.create_task(look())
            await asyncio.sleep(0.2)
            before = threading.active_count()
            for degrees in range(5):
                await one.show(await (await one.set("elbow_left", flexion=10 * degrees)).send())
            self.assertEqual(await asyncio.wait_for(looking, 20), 5)
            self.assertEqual(threading.active_count(), before)
            with self.assertRaises(ecorche.NotPossible):
                await two.claim()
            await two.send()
            with self.assertRaisesRegex(ecorche.NotPossible, "control"):
                async for _ in two.frames(5):
                    pass
            await one.release()
            await two.claim()
            self.assertTrue(await two.controls())

    async def test_waiting_ends_in_time_and_leaves_the_loop_free(self):
        async with ecorche.aio.connect(self.server.address) as client:
            async for _ in client.frames(0.2):
                pass
            ticks = 0

            async def tick():
                nonlocal ticks
                while True:
                    await asyncio.sleep(0.01)
                    ticks += 1

            ticking = asyncio.create_task(tick())
            begun, spent = time.monotonic(), time.process_time()
            async for _ in client.frames(0.5):
                pass
            ticking.cancel()
            self.assertTrue(0.45 < time.monotonic() - begun < 5)
            self.assertGreater(ticks, 10)
            self.assertLess(time.process_time() - spent, 0.3)  # it sleeps
            with self.assertRaisesRegex(ecorche.NotPossible, "was not shown within 0.1 s"):
                await client.show(10, seconds=0.1)

    async def test_many_tasks_share_a_client(self):
        async with ecorche.aio.connect(self.server.address) as client:
            sent = await (await client.set("elbow_left", flexion=45)).send()
            await client.show(sent)
            points = self.model.segment("forearm_left").centre[None]

            async def pose():
                for degrees in range(20):
                    await (await client.set("elbow_left", flexion=degrees)).send()
                    await asyncio.sleep(0.005)
                return await client.send()

            results = await asyncio.gather(pose(), *(client.to_posed(points) for _ in range(10)), client.models())
            await client.show(results[0])

    async def test_frames_that_come_with_an_answer_are_not_waited_for(self):
        async with ecorche.aio.connect(self.server.address) as client:
            with ecorche.connect(self.server.address, session=client.session) as other:
                await client.release()
                other.claim()
                async for _ in client.frames(0.5):
                    pass
                poll, sent = client._waiting._poll, []

                def nothing_yet(seconds):
                    """Just after a look that found nothing a frame comes, and is read with the answer of who waits behind."""
                    event = poll(seconds)
                    if event.kind == 0 and not sent:
                        sent.append(other.send())
                        time.sleep(0.5)
                    return event

                client._waiting._poll = nothing_yet
                first, shown, last = (asyncio.create_task(work) for work in (client.models(), client.show(1, 20), client.models()))
                await asyncio.wait_for(shown, 5)
                await asyncio.gather(first, last)
                self.assertEqual(len(sent), 1)

    async def test_a_task_that_is_cancelled_leaves_the_client_whole(self):
        async with ecorche.aio.connect(self.server.address) as client:
            for _ in range(5):
                asking = asyncio.create_task(client.models())
                await asyncio.sleep(0)
                asking.cancel()
                with self.assertRaises(asyncio.CancelledError):
                    await asking
            looking = asyncio.create_task(client.show(99, 60))
            await asyncio.sleep(0.05)
            looking.cancel()
            with self.assertRaises(asyncio.CancelledError):
                await looking
            await client.show(await client.send())

    async def test_closing_ends_who_waits(self):
        client = await ecorche.aio.connect(self.server.address)
        looking = asyncio.create_task(client.show(99, 60))
        await asyncio.sleep(0.05)
        await client.close()
        await client.close()
        with self.assertRaisesRegex(ecorche.NotPossible, "client: is closed"):
            await asyncio.wait_for(looking, 5)
        with self.assertRaisesRegex(ecorche.NotPossible, "client: is closed"):
            await client.models()

    async def test_what_is_refused_costs_no_connection(self):
        async with ecorche.aio.connect(self.server.address) as client:
            with self.assertRaisesRegex(ecorche.InvalidArgument, r"translation: has the shape \(2,\)"):
                await client.set_root((1, 2))
            with self.assertRaisesRegex(ecorche.InvalidArgument, r"xyzw: has the shape \(3,\)"):
                await client.set_rotation("elbow_left", (0, 0, 1))
            with self.assertRaisesRegex(ecorche.InvalidArgument, "clip: is not UTF-8"):
                client._waiting._call("play", client._waiting._handle, b"\xff", 1.0, 0)
            await client.show(await client.send())
        with self.assertRaisesRegex(ecorche.InvalidArgument, "session: is not UTF-8"):
            await ecorche.aio.connect(self.server.address, session=b"\xff".decode(errors="surrogateescape"))

    async def test_a_server_that_goes_and_comes_back(self):
        with Relay(self.server.port) as relay:
            async with ecorche.aio.connect(relay.address) as client:
                await client.show(await (await client.set("elbow_left", flexion=70)).send())
                before = await client.positions("skin")
                relay.cut()
                with self.assertRaises(ecorche.Unavailable):
                    async for _ in client.frames(20):
                        pass
                with self.assertRaises(ecorche.Unavailable):
                    await client.resume()
                relay.mend()
                await client.resume()
                self.assertTrue(await client.controls())
                np.testing.assert_array_equal(await client.positions("skin"), before)
                await client.show(await client.send())
                np.testing.assert_array_equal(await client.positions("skin"), before)

    async def test_a_model_that_is_read_anew(self):
        with tempfile.TemporaryDirectory() as folder:
            path = pathlib.Path(folder) / "patient.hdf"
            shutil.copy(MODEL, path)
            with Server(path) as server:
                async with ecorche.aio.connect(server.address) as client:
                    await client.show(await client.send())
                    self.assertFalse(client.model_changed)
                    shutil.copy(os.environ["ECORCHE_MODELS"].split(":")[-1], path.with_suffix(".new"))
                    path.with_suffix(".new").rename(path)
                    with Plain("127.0.0.1", server.port) as other:
                        other.open(session="mine")
                        other.reload("patient")
                    async for _ in client.frames(1):
                        pass
                    self.assertTrue(client.model_changed)
                    await client.show(await client.send())  # the old one goes on

    async def test_a_model_that_is_replaced(self):
        with tempfile.TemporaryDirectory() as folder:
            case, path = pathlib.Path(folder) / "case", pathlib.Path(folder) / "patient.hdf"
            shutil.copy(MODEL, path)
            with Server(path) as first:
                client = await ecorche.aio.connect(first.address)
                port = first.port
                first.process.kill()
                first.process.wait()
            shutil.copytree(os.environ["ECORCHE_CASE"], case)
            lines = (case / "case.yaml").read_text().splitlines(keepends=True)
            (case / "case.yaml").write_text("".join(line for line in lines if "name: biceps_brachii_left" not in line))
            subprocess.run([ECORCHE, "preprocess", case, "-o", path, "--max-tets", "20000"], check=True, capture_output=True)
            with Server(path, port=port):
                with self.assertRaisesRegex(ecorche.NotPossible, "the server's model is another one by now"):
                    await client.resume()
            await client.close()

    async def test_it_follows_its_server_elsewhere_and_back(self):
        with Server(MODEL) as second, Server(MODEL, options=("--elsewhere", second.address)) as first:
            client = await ecorche.aio.connect(first.address, session="ward")
            await client.show(await (await client.set("elbow_left", flexion=70)).send())
            before = await client.positions("skin")
            first.process.send_signal(signal.SIGTERM)
            with self.assertRaisesRegex(ecorche.Unavailable, "stop"):
                async for _ in client.frames(20):
                    pass
            await client.resume()
            self.assertEqual((await client.controls(), client.session), (True, "ward"))
            with ecorche.connect(second.address, session="ward") as watcher:
                self.assertFalse(watcher.controls, "the session is on the other server")
                sent = await client.send()
                await client.show(sent)
                watcher.show(sent)
                np.testing.assert_array_equal(watcher.positions("skin"), before)
            np.testing.assert_array_equal(await client.positions("skin"), before)
            second.process.kill()
            second.process.wait()
            first.process.wait()
            with Server(MODEL, port=first.port):
                with self.assertRaises(ecorche.Unavailable):
                    await client.resume()
                await client.resume()
                await client.show(await client.send())
                await client.close()

    async def test_servers_that_are_none_of_ours(self):
        with HostileServers(self.server.port) as hostile:
            for name, kind, text in (
                    ("silent", ecorche.Unavailable, ""), ("hangs_up", ecorche.Unavailable, "hung up"), ("other_version", ecorche.Error, "version"),
                    ("noise", ecorche.Error, ""), ("huge", ecorche.Error, "")):
                with self.subTest(name), self.assertRaisesRegex(kind, text):
                    await ecorche.aio.connect(hostile.address(name))
            client = await ecorche.aio.connect(hostile.address("half_a_frame"))
            with self.assertRaises(ecorche.Unavailable):
                while True:
                    await client.show(await client.send(), 20)
            await client.close()

    async def test_token_and_certificate(self):
        with tempfile.TemporaryDirectory() as folder:
            token = pathlib.Path(folder) / "token"
            token.write_text("a-secret-of-the-clinic-1234")
            token.chmod(0o600)
            names = [make_certificate(pathlib.Path(folder), name) for name in ("ours", "foreign")]
            options = ("--token-file", token, "--tls-certificate", names[0][0], "--tls-key", names[0][1])
            with Server(MODEL, options=options) as server:
                good = {"token": "a-secret-of-the-clinic-1234", "authorities": names[0][0]}
                for wrong in ({"token": "guessed-by-a-stranger-1234"}, {"token": None}, {"authorities": names[1][0]}, {"authorities": None}):
                    with self.subTest(wrong), self.assertRaises(ecorche.Error):
                        await ecorche.aio.connect(server.address, **{**good, **wrong})
                async with ecorche.aio.connect(server.address, **good) as client:
                    for degrees in (10, 50, 90):  # records of TLS leave nothing behind
                        await client.show(await (await client.set("elbow_left", flexion=degrees)).send(), 5)


def make_certificate(folder, name):
    certificate, key = folder / f"{name}.pem", folder / f"{name}.key"
    subprocess.run(["openssl", "req", "-x509", "-newkey", "ec", "-pkeyopt", "ec_paramgen_curve:prime256v1", "-nodes", "-keyout", key, "-out",
                    certificate, "-days", "2", "-subj", "/CN=localhost", "-addext", "subjectAltName=IP:127.0.0.1"], check=True, capture_output=True)
    return certificate, key


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1], verbosity=2)
