#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Clients of `ecorche igtl` that lie, break off, say nothing or do not read: they go, or are told, and others are served.

usage: igtl_attacks_test.py IGTL_PEER; the environment is that of the fixtures
"""
import random
import socket
import struct
import sys
import time
import unittest

import numpy as np

from linking import Library, Link

IDENTITY = struct.pack(">12f", 1, 0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0)


def crc64(data):
    """Bit by bit."""
    crc = 0
    for byte in data:
        crc ^= byte << 56
        for _ in range(8):
            crc = (crc << 1 ^ (0x42F0E1EBA9EA3693 if crc >> 63 else 0)) & 2**64 - 1
    return crc


def message(kind, device, body, version=1, size=None, crc=None):
    return struct.pack(">H12s20sQQQ", version, kind.encode(), device.encode(), 0, len(body) if size is None else size,
                       crc64(body) if crc is None else crc) + body


class Client:
    """Bytes as they are."""

    def __init__(self, link):
        self.socket = socket.create_connection(("127.0.0.1", link.port), timeout=20)
        self.file = self.socket.makefile("rb")

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.file.close()
        self.socket.close()

    def send(self, data):
        self.socket.sendall(data)

    def next(self, kind=None):
        """Type, device and body of the next message, of this type; nothing at the end. Its checksum must be right."""
        while True:
            head = self.file.read(58)
            if len(head) < 58:
                return None
            version, type_, device, _, size, crc = struct.unpack(">H12s20sQQQ", head)
            body = self.file.read(size)
            if len(body) < size:
                return None
            assert version == 1
            assert size > 10000 or crc64(body) == crc, type_
            type_ = type_.rstrip(b"\0").decode()
            if kind in (None, type_):
                return type_, device.rstrip(b"\0").decode(), body

    def status(self):
        _, _, body = self.next("STATUS")
        return struct.unpack(">H", body[:2])[0], body[30:].rstrip(b"\0").decode()

    def gone(self):
        try:
            while self.next():
                pass
        except ConnectionError:
            pass
        return True


class Attacks(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.link = Link("--tissues", "skin", "--volumes", "none", "--joint", "Marker=pelvis", "--rate", "1000", "--stall-seconds", "1")
        cls.addClassCleanup(cls.link.__exit__)

    def tearDown(self):
        """Whatever it was, somebody else is served, and moves the body."""
        with Library(self.link) as tracker:
            tracker.matrix("pelvis")
            at = np.eye(4)
            at[0, 3] = random.uniform(-50, 50)
            tracker.transform("Marker", at)
            self.assertLess(np.abs(tracker.matrix("pelvis") - at).max(), 1e-3)

    def test_a_wrong_checksum_is_told_and_the_next_message_counts(self):
        with Client(self.link) as client:
            client.send(message("TRANSFORM", "Marker", IDENTITY, crc=7))
            self.assertEqual(client.status(), (9, "TRANSFORM: the checksum is wrong"))
            client.send(message("GET_CAPABIL", "", b""))
            self.assertIsNotNone(client.next("CAPABILITY"))

    def test_sizes_that_a_message_cannot_have(self):
        before = self.link.memory()
        for size in (2**20 + 1, 2**31, 2**40, 2**63, 2**64 - 1):
            with Client(self.link) as client:
                client.send(message("TRANSFORM", "Marker", b"", size=size))
                self.assertTrue(client.gone())
        self.assertLess(self.link.memory() - before, 16 << 20)
        # As large as is allowed, but no transform.
        with Client(self.link) as client:
            client.send(message("TRANSFORM", "Marker", bytes(4096)))
            self.assertEqual(client.status(), (10, "Marker is no rigid transform"))

    def test_bodies_that_hold_something_else(self):
        nan, far = struct.pack(">f", float("nan")), struct.pack(">f", 2e6)
        mirrored = struct.pack(">12f", -1, 0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0)
        for body in (b"", IDENTITY[:-1], IDENTITY + b"\0", nan + IDENTITY[4:], IDENTITY[:-4] + nan, IDENTITY[:-4] + far, mirrored, bytes(48)):
            with Client(self.link) as client:
                client.send(message("TRANSFORM", "Marker", body))
                self.assertEqual(client.status(), (10, "Marker is no rigid transform"))
        for kind, device, body in (("TDATA", "t", bytes(69)), ("POINT", "posed_points", bytes(135)), ("STRING", "pose", b"\0\3\xff\xffx"),
                                   ("STT_TDATA", "joints", bytes(35))):
            with Client(self.link) as client:
                client.send(message(kind, device, body))
                self.assertEqual(client.status(), (10, f"{kind} is of another size than it says"))

    def test_headers_and_metadata_of_version_2_that_reach_beyond(self):
        def extended(before, head, data):
            return struct.pack(">HHII", before, head, data, 1)

        for body in (b"", bytes(11), extended(0, 0, 0) + IDENTITY, extended(61, 0, 0) + IDENTITY, extended(12, 49, 0) + IDENTITY,
                     extended(12, 0, 2**32 - 1) + IDENTITY, extended(65535, 65535, 2**32 - 1) + IDENTITY):
            with Client(self.link) as client:
                client.send(message("TRANSFORM", "Marker", body, version=2))
                self.assertEqual(client.status(), (10, "TRANSFORM: its extended header or metadata reach beyond it"))
        with Client(self.link) as client:
            client.next("POLYDATA")
            moved = IDENTITY[:-4] + struct.pack(">f", 99)
            client.send(message("TRANSFORM", "Marker", extended(12, 4, 3) + moved + b"\0\0\0\0abc", version=2))
            while True:
                _, device, body = client.next("TRANSFORM")
                if device == "pelvis" and struct.unpack(">12f", body) == struct.unpack(">12f", moved):
                    break

    def test_unknown_types_are_told_and_skipped(self):
        with Client(self.link) as client:
            for kind, body in (("VIDEO", bytes(1000)), ("GET_VIDEO", b""), ("\xff\xfe".encode("latin1").decode("latin1"), b"1"), ("", b"")):
                try:
                    client.send(message(kind, "", body))
                except UnicodeEncodeError:
                    continue
                self.assertEqual(client.status()[0], 12)
            client.send(message("GET_CAPABIL", "", b""))
            self.assertIsNotNone(client.next("CAPABILITY"))

    def test_what_is_no_openigtlink(self):
        for data in (b"GET / HTTP/1.1\r\nHost: x\r\n\r\n" + bytes(58), bytes(58), b"\xff" * 58, random.Random(1).randbytes(500)):
            with Client(self.link) as client:
                client.send(data)
                self.assertTrue(client.gone())

    def test_a_client_that_goes_within_a_message(self):
        whole = message("TRANSFORM", "Marker", IDENTITY)
        for length in (1, 2, 57, 58, 59, len(whole) - 1):
            with Client(self.link) as client:
                client.send(whole[:length])
        # One that resets the connection while it is sent a body.
        with Client(self.link) as client:
            client.socket.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, struct.pack("ii", 1, 0))
            client.send(message("GET_POLYDATA", "", b""))

    def test_a_client_that_stands_still_is_dropped(self):
        with Client(self.link) as client:
            client.send(message("TRANSFORM", "Marker", IDENTITY)[:70])
            begun = time.monotonic()
            self.assertTrue(client.gone())
            self.assertLess(time.monotonic() - begun, 10)
        # One between messages is not.
        with Client(self.link) as client:
            client.next("POLYDATA")
            time.sleep(1.5)
            client.send(message("GET_CAPABIL", "", b""))
            self.assertIsNotNone(client.next("CAPABILITY"))

    def test_a_client_that_does_not_read_costs_no_memory_and_is_dropped(self):
        with Link("--tissues", "all", "--volumes", "none", "--joint", "Marker=pelvis", "--rate", "1000", "--stall-seconds", "5") as link, \
                Library(link) as tracker, Client(link) as idle:
            idle.socket.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4096)
            tracker.matrix("pelvis")
            tracker.surface("skin")
            before = link.memory()
            for step in range(100):
                at = np.eye(4)
                at[0, 3] = step + 1
                tracker.transform("Marker", at)
                if step % 4 == 0:
                    tracker.matrix("pelvis")  # who reads is served
            self.assertLess(link.memory() - before, 64 << 20)
            time.sleep(6)
            self.assertIn("stood still within a message", link.stop()[2])

    def test_too_many_clients_are_turned_away(self):
        with Link("--tissues", "none", "--volumes", "none", "--max-connections", "2") as link, Client(link) as one, Client(link) as two:
            one.next()
            two.next()
            with Client(link) as third:
                self.assertTrue(third.gone())
            one.send(message("GET_CAPABIL", "", b""))
            self.assertIsNotNone(one.next("CAPABILITY"))

    def test_random_changes_of_messages(self):
        chance = random.Random(7)
        whole = [message(kind, device, body) for kind, device, body in (
            ("TRANSFORM", "Marker", IDENTITY), ("TDATA", "t", b"Marker".ljust(20, b"\0") + b"\2\0" + IDENTITY), ("STRING", "pose", b"\0\3\0\4rest"),
            ("POINT", "posed_points", bytes(136)), ("STT_TDATA", "joints", bytes(36)))]
        for _ in range(200):
            data = bytearray(chance.choice(whole))
            for _ in range(chance.randrange(1, 4)):
                data[chance.randrange(len(data))] = chance.randrange(256)
            if chance.random() < 0.5:  # the checksum right, so that what is within is read
                data[50:58] = struct.pack(">Q", crc64(bytes(data[58:])))
            with Client(self.link) as client:
                client.send(bytes(data))


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1] + sys.argv[2:])
