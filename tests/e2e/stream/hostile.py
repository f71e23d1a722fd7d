#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Servers that no client may trust, one for all clients' tests: each of KINDS at an address of its own, before a good server where it needs one.

usage: hostile.py PORT_OF_A_GOOD_SERVER: prints the addresses as one JSON object, and stays until its stdin ends
"""
import contextlib
import json
import random
import socket
import struct
import sys
import threading

from ecorche.v1 import envelope_pb2
from ecorche_frames import aligned, encode

# Each gets the client's socket, and the port of the good server; what it leaves open is closed.
KINDS = {}


def kind(function):
    KINDS[function.__name__] = function
    return function


def read(peer, size):
    out = b""
    while len(out) < size:
        more = peer.recv(size - len(out))
        if not more:
            raise ConnectionError
        out += more
    return out


def messages(peer):
    """Each message of a server: its envelope, and its payload."""
    while True:
        size, payload = struct.unpack("<II", read(peer, 8))
        rest = read(peer, aligned(8 + size) - 8 + payload)
        yield envelope_pb2.Envelope.FromString(rest[:size]), rest[len(rest) - payload:] if payload else b""


@contextlib.contextmanager
def good_server(client, port):
    """What the client says goes there."""
    with socket.create_connection(("127.0.0.1", port)) as server:
        def carry():
            with contextlib.suppress(OSError):
                while data := client.recv(1 << 16):
                    server.sendall(data)
            with contextlib.suppress(OSError):
                server.shutdown(socket.SHUT_RDWR)

        threading.Thread(target=carry, daemon=True).start()
        yield server


@kind
def silent(client, _):
    """Takes what it is told, and says nothing."""
    while client.recv(1 << 16):
        pass


@kind
def hangs_up(client, _):
    """Goes when it is greeted."""
    client.recv(1)


@kind
def noise(client, _):
    """Says what is no frame."""
    client.recv(1)
    client.sendall(random.Random(1).randbytes(1 << 16))


@kind
def huge(client, _):
    """Announces 4 GiB, and sends a little of it."""
    client.recv(1)
    client.sendall(struct.pack("<II", 64, 2**32 - 16) + bytes(4096))
    while client.recv(1 << 16):
        pass


@kind
def other_version(client, port):
    """Speaks a protocol of the future."""
    with good_server(client, port) as server:
        for envelope, payload in messages(server):
            if envelope.WhichOneof("message") == "server_hello":
                envelope.server_hello.protocol = 99
            client.sendall(encode(envelope, payload))


@kind
def half_a_frame(client, port):
    """Breaks off in the middle of its second frame."""
    with good_server(client, port) as server:
        frames = 0
        for envelope, payload in messages(server):
            data = encode(envelope, payload)
            frames += envelope.WhichOneof("message") == "mesh_frame"
            if frames == 2:
                client.sendall(data[:len(data) // 2])
                return
            client.sendall(data)


@kind
def lying_frame(client, port):
    """Sends frames whose arrays reach beyond them."""
    with good_server(client, port) as server:
        for envelope, payload in messages(server):
            client.sendall(encode(envelope, payload[:len(payload) // 32 * 16] if envelope.WhichOneof("message") == "mesh_frame" else payload))


def wrapped(frame, payload):
    """A grid of 2^64 voxels, of which 64 bits leave none."""
    frame.grid.size_i, frame.grid.size_j, frame.grid.size_k = 1 << 22, 1 << 21, 1 << 21
    frame.voxels.count = 0
    return payload


def other_type(frame, payload):
    """Half as many scalars of twice the size."""
    frame.voxels.type, frame.voxels.count = {4: 7, 7: 4}.get(frame.voxels.type, 7), frame.voxels.count * 2 // 8
    return payload


def one_less(frame, payload):
    """A layer less than the grid has."""
    frame.voxels.count -= frame.grid.size_i * frame.grid.size_j
    return payload


def keyframe_of_none(frame, payload):
    """Against a keyframe that nobody sent."""
    frame.keyframe = frame.frame + 1000
    frame.bricks.CopyFrom(frame.voxels)
    return payload


# What is done to frames of volumes: the envelope's, in place, and its payload.
VOLUME_LIES = {function.__name__: function for function in (wrapped, other_type, one_less, keyframe_of_none)}
VOLUME_LIES["cut"] = lambda _, payload: payload[:len(payload) // 32 * 16]


def volume_kind(lie):
    def lying_volume(client, port):
        with good_server(client, port) as server:
            for envelope, payload in messages(server):
                if envelope.WhichOneof("message") == "volume_frame":
                    payload = VOLUME_LIES[lie](envelope.volume_frame, payload)
                client.sendall(encode(envelope, payload))

    KINDS["volume_" + lie] = lying_volume


for name in VOLUME_LIES:
    volume_kind(name)


class HostileServers:
    """All of them, as a context."""

    def __init__(self, port):
        self._port, self._listeners = port, {name: socket.create_server(("127.0.0.1", 0)) for name in KINDS}
        for name, listener in self._listeners.items():
            threading.Thread(target=self._accept, args=(KINDS[name], listener), daemon=True).start()

    def address(self, name):
        return "127.0.0.1:%d" % self._listeners[name].getsockname()[1]

    def _accept(self, serve, listener):
        with contextlib.suppress(OSError):
            while True:
                threading.Thread(target=self._serve, args=(serve, listener.accept()[0]), daemon=True).start()

    def _serve(self, serve, client):
        with contextlib.suppress(OSError), client:
            serve(client, self._port)
            # Not a reset, which might overtake what was sent.
            client.shutdown(socket.SHUT_WR)

    def __enter__(self):
        return self

    def __exit__(self, *_):
        for listener in self._listeners.values():
            listener.close()


if __name__ == "__main__":
    with HostileServers(int(sys.argv[1])) as servers:
        print(json.dumps({name: servers.address(name) for name in KINDS}), flush=True)
        sys.stdin.read()
