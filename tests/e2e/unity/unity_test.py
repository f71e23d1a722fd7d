#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""The package for Unity without Unity: its client is compiled by Debian's mcs, run under Mono against a server, and held against the other clients.

usage: unity_test.py SOURCE LIBRARY_FOLDER; the environment is that of the fixtures
"""
import hashlib
import os
import pathlib
import shutil
import signal
import socket
import struct
import subprocess
import sys
import tempfile
import unittest

import numpy as np

SOURCE, LIBRARIES = (pathlib.Path(word) for word in sys.argv[1:3])
MODEL, OTHER_MODEL = os.environ["ECORCHE_MODEL"], os.environ["ECORCHE_MODELS"].split(":")[-1]
sys.path.insert(0, str(SOURCE / "tests" / "e2e" / "stream"))

import zstd_frames  # noqa: E402
from mono import compile_program, told_of_levels  # noqa: E402
from ecorche_client import Client  # noqa: E402
from ecorche_frames import aligned, array  # noqa: E402
from hostile import HostileServers  # noqa: E402
from relay import Relay  # noqa: E402
from serving import ECORCHE, Server  # noqa: E402
from ecorche.v1 import stream_pb2  # noqa: E402

TOKEN = "f00dfeed" * 4
PACKAGE = SOURCE / "clients" / "unity"
built = tempfile.TemporaryDirectory()
CHECK, SAMPLE = pathlib.Path(built.name) / "check.exe", pathlib.Path(built.name) / "five_steps.exe"


client_sources = sorted((PACKAGE / "Runtime" / "Client").rglob("*.cs"))
compile_program(CHECK, *sorted((SOURCE / "tests" / "e2e" / "unity").glob("*.cs")), *client_sources, *sorted((PACKAGE / "Runtime" / "Native").glob("*.cs")))
compile_program(SAMPLE, PACKAGE / "Samples~" / "WithoutUnity" / "FiveSteps.cs", *client_sources)


def command(*words):
    return ["mono", "--debug", CHECK, *map(str, words)]


def check(*words, fails=False):
    result = subprocess.run(command(*words), capture_output=True, text=True, timeout=120, env={**os.environ, "LD_LIBRARY_PATH": str(LIBRARIES)})
    if (result.returncode != 0) != fails:
        raise AssertionError(f"{words} ended with {result.returncode}:\n{result.stdout}{result.stderr}")
    return result.stdout


class Recorder(Client):
    """Keeps the bytes of every frame as it came."""

    def _read(self, until):
        self.raw = getattr(self, "raw", {})
        before = None
        if self._fill(8, until):
            envelope, payload = struct.unpack_from("<II", self._buffer)
            size = aligned(8 + envelope) + payload
            if self._fill(size, until):
                before = bytes(self._buffer[:size])
        message = super()._read(until)
        if message is not None:
            self.raw.setdefault(message[0].WhichOneof("message"), []).append((before, *message))
        return message


def expected(raw, frame, body, packed):
    """Lines that the program prints of a frame, by what the client in Python makes of it."""
    message, payload = raw[1].mesh_frame, raw[2]
    normals = {body.tissues[a.tissue]: array(a.array, payload) for a in message.arrays if a.kind == stream_pb2.MeshArray.KIND_NORMALS}
    for name, positions in frame.positions.items():
        shown = positions.astype("<f4").tobytes()
        if packed:
            low = np.array([message.box.low_x, message.box.low_y, message.box.low_z], np.float64)
            numbers = np.rint((positions - low) / np.float64(message.box.step)).astype(np.uint16)
            octahedral = normals[name].astype(np.int8).view(np.uint16) ^ 0x8080 if name in normals else np.zeros((len(numbers), 1), np.uint16)
            shown = np.hstack([numbers, octahedral]).astype("<u2").tobytes()
        yield f"{message.frame} {message.level} {name} {hashlib.sha256(shown).hexdigest()}"


class Unity(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.server = Server(MODEL)

    @classmethod
    def tearDownClass(cls):
        cls.server.stop()
        cls.server.__exit__()

    def replayed(self, folder, packed, encoding, tissues=(), level=0, region=None, normals=True):
        with Recorder("127.0.0.1", self.server.port) as client:
            body = client.open()
            client.subscribe_mesh(tissues, encoding=encoding, level=level, region=region, normals=normals)
            frames, elbow = [], body.joint("elbow_left")
            for i in range(6):
                pose = body.rest_pose()
                pose[elbow] = np.cos(0.1 * i), np.sin(0.1 * i), 0, 0
                sent = client.send_pose(pose)
                while not frames or frames[-1].pose_sequence < sent:
                    frames += list(client.frames(0.05))
        raw = client.raw["mesh_frame"]
        path = pathlib.Path(folder) / "frames"
        path.write_bytes(client.raw["model_opened"][0][0] + client.raw["subscribed"][0][0] + b"".join(one[0] for one in raw))
        box = "" if region is None else ",".join(str(float(x)) for corner in region for x in corner)
        out = check("replay", path, "packed" if packed else "float", ",".join(tissues), level, box, folder).splitlines()
        self.assertEqual(len(raw), len(frames))
        self.assertEqual(out, [line for one, frame in zip(raw, frames) for line in expected(one, frame, body, packed)])
        return frames

    def test_every_encoding_bit_for_bit(self):
        for encoding in ("f32", "u16", "u16-delta"):
            for packed in (False, True):
                with self.subTest(encoding=encoding, packed=packed), tempfile.TemporaryDirectory() as folder:
                    if encoding == "f32" and packed:
                        continue  # the cube is the client's own: test_floats_packed
                    frames = self.replayed(folder, packed, encoding)
                    if encoding == "u16-delta":
                        self.assertTrue(any(frame.message.keyframe != frame.message.frame for frame in frames), "some frame is against a keyframe")
                    if not packed:
                        for name, normals in frames[-1].normals.items():
                            got = np.fromfile(pathlib.Path(folder) / f"{name}.normals", np.int8).reshape(-1, 3) / 127
                            self.assertLess(np.abs(got - normals).max(initial=0), 0.005, name)

    def test_levels_and_regions(self):
        with tempfile.TemporaryDirectory() as folder:
            self.assertEqual(self.replayed(folder, True, "u16-delta", ["skin"], 2)[-1].level, 2)
            self.replayed(folder, False, "u16-delta", region=((-1000, -1000, 1000), (1000, 1000, 3000)), normals=False)

    def test_deltas_as_the_protocol_writes_them(self):
        self.assertEqual(check("deltas"), "400 blocks\n")

    def test_live_as_offline_posing(self):
        with Client("127.0.0.1", self.server.port) as client:
            body = client.open()
        triangles, skeleton = body.triangles["skin"], body.message.skeleton.name
        pose = "ecorche_pose: 1\nskeleton: %s\njoints:\n  shoulder_left: {adduction_deg: %.17g}\n  elbow_left: {flexion_deg: %.17g}\n" \
               "  hip_right: {adduction_deg: %.17g}\n" % (skeleton, *np.degrees([-0.6, 1.2, -0.3]))
        with tempfile.TemporaryDirectory() as name:
            folder = pathlib.Path(name)
            (folder / "bend.yaml").write_text(pose)
            subprocess.run([ECORCHE, "pose", MODEL, "--pose", folder / "bend.yaml", "-o", folder / "posed"], check=True, capture_output=True)
            record = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("unused", "<u2")])
            skin = np.frombuffer((folder / "posed" / "skin.stl").read_bytes(), record, offset=84)["corners"]
            for encoding, bound in (("F32", 1e-3), ("U16Delta", 0.06)):
                told = check("live", self.server.address, folder, encoding)
                self.assertIn("encoding " + encoding, told)
                got = np.fromfile(folder / "skin.f32", "<f4").reshape(-1, 3)
                worst = np.abs(got[triangles] - skin).max()
                print(f"{encoding}: at most {worst:.4f} mm from offline posing")
                self.assertLess(worst, bound)

    def test_spaces_and_sides(self):
        self.assertEqual(check("space", self.server.address), "six spaces\n")

    def test_another_skeleton_drives_the_body(self):
        self.assertEqual(check("drive", self.server.address), "three references\n")

    def test_what_hangs_on_a_spine_by_vertebra_is_driven(self):
        self.assertEqual(told_of_levels(check), "22 levels\n")

    def test_in_process_as_served(self):
        self.assertEqual(check("native", MODEL, self.server.address), "alike\n")

    def test_skinning_tables(self):
        self.assertIn("Cor within", check("skin", self.server.address))

    def test_nothing_is_allocated(self):
        out = check("allocate", self.server.address, 100)
        self.assertEqual(out.count(" 0 bytes in 100 frames, 0 collections"), 3, out)

    def test_volumes_with_changed_bricks(self):
        out = check("volume", self.server.address).splitlines()
        self.assertEqual(check("volume", self.server.address, "compressed").splitlines(), out)
        with Client("127.0.0.1", self.server.port) as client:
            body = client.open()
            client.subscribe_volume(body.message.volumes[0].name)
            segment = body.message.skeleton.segments[body.joint("elbow_left")].joint
            first, told = segment.sequence[0], []
            self.assertEqual(first.name, "flexion")
            for i in range(6):
                turn = (-1 if first.negative else 1) * (0.4 + 0.01 * i - first.rest) / 2
                pose = body.rest_pose()
                pose[body.joint("elbow_left")] = np.cos(turn), *(np.sin(turn) * np.eye(3)[first.axis])
                sent, frame = client.send_pose(pose), None
                while frame is None or frame.pose_sequence < sent:
                    frame = next(iter(client.frames(20)))
                k, j, i_size = frame.voxels.shape[:3]
                told.append(f"{i} {i_size} {j} {k} {hashlib.sha256(np.ascontiguousarray(frame.voxels).tobytes()).hexdigest()}")
        self.assertEqual([line.removesuffix(" by bricks") for line in out], told)
        self.assertIn(" by bricks", "".join(out))

    def test_slices_are_planes_of_the_volume(self):
        for words in ((), ("compressed",)):
            expected = ("0 differ, many are not background", "the stream has 2 slices", "give 1 to 4096 pixels", "no bricks of them", "at most 16 slices")
            for line, what in zip(check("slices", self.server.address, *words).splitlines(), expected, strict=True):
                self.assertIn(what, line)

    def unpacked(self, *pairs):
        """Lines of the program of (size, frame)."""
        with tempfile.TemporaryDirectory() as folder:
            zstd_frames.write(pathlib.Path(folder) / "frames", pairs)
            return check("zstd", pathlib.Path(folder) / "frames").splitlines()

    def test_zstd_as_its_library(self):
        names, contents, frames = zip(*zstd_frames.frames())
        told = self.unpacked(*((len(data), frame) for data, frame in zip(contents, frames)))
        for name, data, line in zip(names, contents, told, strict=True):
            self.assertEqual(line, hashlib.sha256(data).hexdigest(), name)

    def test_zstd_that_was_tampered_with(self):
        large = ("words at level 3", "ct at level 9", "wide at level 1")
        pairs = [(len(data), changed) for seed, (name, data, frame) in enumerate(zstd_frames.frames()) if 0 < len(data) < 20_000 or name in large
                 for changed in zstd_frames.tampered(frame, 60, seed)]
        expected = [zstd_frames.decompress(frame, size) for size, frame in pairs]
        refused = stricter = 0
        for (size, frame), bytes_, line in zip(pairs, expected, self.unpacked(*pairs), strict=True):
            if bytes_ is None:
                self.assertRegex(line, "^refused the server's message is damaged: ", frame[:200].hex())
                refused += 1
            elif line.endswith("a zstd frame with a block that is none"):
                stricter += 1  # RFC 8878, 4.2.2: streams of literals end with their last bit, which the library does not always look at
            else:
                self.assertEqual(line, hashlib.sha256(bytes_).hexdigest(), frame[:200].hex())
        print(f"{len(pairs)} frames, of which {refused} are none, and {stricter} the library reads, too")
        self.assertGreater(refused, len(pairs) / 2)
        self.assertLess(stricter, (len(pairs) - refused) / 5)

    def test_zstd_that_amplifies(self):
        told = self.unpacked((1 << 17, zstd_frames.bomb(1 << 17)), ((1 << 17) + 1, zstd_frames.bomb((1 << 17) + 1)), (2 ** 31 - 1, zstd_frames.bomb(2 ** 31 - 1)))
        self.assertEqual(told[0], hashlib.sha256(bytes([7]) * (1 << 17)).hexdigest())
        self.assertTrue(told[1].endswith("a zstd frame of 14 bytes cannot hold 131073"), told[1])
        self.assertTrue(told[2].endswith("a zstd frame of 14 bytes cannot hold 2147483647"), told[2])

    def test_envelopes_that_are_cut(self):
        self.assertEqual(check("cut"), "cut 73 times\n")

    def test_who_lies_is_refused(self):
        self.assertEqual(check("hostile", 120), "refused 120\n")

    def test_the_library_is_not_unloaded_from_under_its_threads(self):
        told = subprocess.run(["readelf", "-d", LIBRARIES / "libecorche.so"], capture_output=True, text=True, check=True).stdout
        self.assertIn("NODELETE", told)

    def test_who_goes_leaves_control_to_the_next(self):
        self.assertEqual(check("leave", self.server.address), "controlled by each\n")

    def test_what_is_no_point_costs_no_connection(self):
        self.assertEqual(check("probes", self.server.address), "refused 4\n")

    def test_the_line_is_cut_and_mended(self):
        self.comes_back_by_resume(self.server, lambda: None, "back resumed\n")

    def test_a_model_that_was_read_anew_meanwhile_is_opened_anew(self):
        self.comes_back_to_a_replaced_model(OTHER_MODEL, "resume", "back anew\n")

    def test_another_body_is_no_place_to_come_back_to(self):
        self.comes_back_to_a_replaced_model(os.environ["ECORCHE_BAR_MODEL"], "replaced", "refused 2\n")

    def comes_back_to_a_replaced_model(self, other_model, command_name, told):
        with tempfile.TemporaryDirectory() as name:
            served = pathlib.Path(name) / "body.hdf"
            shutil.copy(MODEL, served)
            with Server(served) as server:
                def replace():
                    with Client("127.0.0.1", server.port) as other:
                        other.open(session="mine")
                        shutil.copy(other_model, served.with_suffix(".new"))
                        served.with_suffix(".new").rename(served)
                        other.reload("body")
                self.comes_back_by_resume(server, replace, told, command_name)

    def test_a_server_that_stops_sends_its_clients_elsewhere(self):
        with Server(MODEL) as other, Server(MODEL, options=["--elsewhere", other.address]) as server, \
                subprocess.Popen(command("resume", server.address), stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True) as client:
            self.assertEqual(client.stdout.readline(), "shown 1\n")
            server.process.send_signal(signal.SIGTERM)
            client.stdin.write("\n")
            client.stdin.flush()
            self.assertRegex(client.stdout.readline(), "^lost .*stop")
            client.stdin.write("\n")
            client.stdin.flush()
            self.assertEqual(client.stdout.readline(), "back anew\n")
            client.stdin.close()
            self.assertEqual(client.wait(30), 0)

    def test_where_nobody_is_elsewhere_it_comes_back_to_the_first(self):
        with socket.create_server(("127.0.0.1", 0)) as taken:
            nobody = "127.0.0.1:%d" % taken.getsockname()[1]
        with Server(MODEL, options=["--elsewhere", nobody]) as server, \
                subprocess.Popen(command("resume", server.address), stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True) as client:
            self.assertEqual(client.stdout.readline(), "shown 1\n")
            server.stop()
            client.stdin.write("\n")
            client.stdin.flush()
            self.assertRegex(client.stdout.readline(), "^lost .*stop")
            with Server(MODEL, port=server.port):
                client.stdin.write("\n")
                client.stdin.flush()
                self.assertEqual(client.stdout.readline(), "back anew\n")
                client.stdin.close()
                self.assertEqual(client.wait(30), 0)

    def comes_back_by_resume(self, server, meanwhile, told, command_name="resume"):
        with Relay(server.port) as relay, subprocess.Popen(command(command_name, relay.address), stdin=subprocess.PIPE, stdout=subprocess.PIPE,
                                                           text=True) as client:
            self.assertRegex(client.stdout.readline(), "^shown ")
            relay.cut()
            meanwhile()
            client.stdin.write("\n")
            client.stdin.flush()
            self.assertIn("lost the connection was lost", client.stdout.readline())
            relay.mend()
            client.stdin.write("\n")
            client.stdin.flush()
            self.assertEqual(client.stdout.readline(), told)
            client.stdin.close()
            self.assertEqual(client.wait(30), 0)

    def test_the_thread_comes_back_and_sees_a_replaced_model(self):
        with tempfile.TemporaryDirectory() as name:
            served = pathlib.Path(name) / "body.hdf"
            shutil.copy(MODEL, served)
            with Server(served) as server, Relay(server.port) as relay:
                self.comes_back(served, server, relay)

    def comes_back(self, served, server, relay):
        with subprocess.Popen(command("thread", relay.address), stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True) as client:
            def said(what):
                self.assertEqual(client.stdout.readline(), what + "\n")

            def go_on():
                client.stdin.write("\n")
                client.stdin.flush()

            said("shown")
            relay.cut()
            go_on()
            said("lost")
            relay.mend()
            go_on()
            said("back 1")
            with Client("127.0.0.1", server.port) as other:
                other.open(session="mine")
                shutil.copy(OTHER_MODEL, served.with_suffix(".new"))
                served.with_suffix(".new").rename(served)
                other.reload("body")
            go_on()
            said("replaced body")
            client.stdin.close()
            self.assertEqual(client.wait(30), 0)

    def test_tls_and_tokens(self):
        with tempfile.TemporaryDirectory() as name:
            folder = pathlib.Path(name)
            for who in ("own", "foreign"):
                subprocess.run(["openssl", "req", "-x509", "-newkey", "rsa:2048", "-nodes", "-days", "2", "-subj", "/CN=" + who, "-addext",
                                "subjectAltName=IP:127.0.0.1,DNS:localhost", "-keyout", folder / (who + ".key"), "-out", folder / (who + ".pem")], check=True,
                               capture_output=True)
            (folder / "token").write_text(TOKEN + "\n")
            with Server(MODEL, options=["--tls-certificate", str(folder / "own.pem"), "--tls-key", str(folder / "own.key"), "--token-file",
                                        str(folder / "token")]) as server:
                where = f"localhost:{server.port}"
                self.assertIn("opened", check("refused", where, "--authorities", folder / "own.pem", "--token", TOKEN))
                denied = check("refused", where, "--authorities", folder / "own.pem", "--token", "guessed", fails=True)
                self.assertIn("error Unauthenticated", denied)
                foreign = check("refused", where, "--authorities", folder / "foreign.pem", "--token", TOKEN, fails=True)
                self.assertIn("error Unavailable localhost: its certificate is not trusted", foreign)
                self.assertIn("is not trusted", check("refused", where, "--tls", "yes", "--token", TOKEN, fails=True))
                plain = check("refused", where, "--token", TOKEN, "--timeout", 3, fails=True)
                self.assertIn("error", plain)

    def test_servers_that_are_none_of_ours(self):
        with HostileServers(self.server.port) as hostile, tempfile.TemporaryDirectory() as folder:
            self.assertEqual(check("refused", hostile.address("other_version"), fails=True),
                             "error FailedPrecondition the server speaks protocol 99, this client 1\n")
            for name, error in (("silent", "DeadlineExceeded"), ("hangs_up", "Unavailable"), ("noise", ""), ("huge", "")):
                with self.subTest(name):
                    self.assertRegex(check("refused", hostile.address(name), "--timeout", 2, fails=True), f"^error {error}")
            for name, error in (("half_a_frame", "Unavailable"), ("lying_frame", "")):
                with self.subTest(name):
                    self.assertRegex(check("live", hostile.address(name), folder, "U16Delta", fails=True), f"^error {error}")

    def test_five_steps(self):
        out = subprocess.run(["mono", SAMPLE, self.server.address], capture_output=True, text=True, check=True, timeout=60).stdout
        self.assertRegex(out, r"^\d+ vertices, the first at y = -?\d+\.\d+ m, (pass|warn)\nthere is \w+\n$")

    def test_nobody_there(self):
        self.assertIn("error Unavailable 127.0.0.1:1: Connection refused (is ecorche serve running there?)", check("refused", "127.0.0.1:1", fails=True))
        self.assertIn("error InvalidArgument address: 'nowhere' is no HOST:PORT", check("refused", "nowhere", fails=True))


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1] + sys.argv[3:])
