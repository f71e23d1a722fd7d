# SPDX-License-Identifier: Apache-2.0
"""Frames of zstd as its library makes them, of all kinds of bytes, and frames that somebody tampered with."""
import ctypes
import ctypes.util
import random
import struct

import numpy as np

LEVELS = (-7, 1, 3, 9, 19, 22)
LEVEL, CHECKSUM, WINDOW_LOG = 100, 201, 101  # ZSTD_cParameter

library = ctypes.CDLL(ctypes.util.find_library("zstd"))
library.ZSTD_createCCtx.restype = ctypes.c_void_p
library.ZSTD_CCtx_setParameter.argtypes = [ctypes.c_void_p, ctypes.c_int, ctypes.c_int]
for name, arguments in (("ZSTD_compressBound", [ctypes.c_size_t]), ("ZSTD_freeCCtx", [ctypes.c_void_p]),
                        ("ZSTD_compress2", [ctypes.c_void_p, ctypes.c_void_p, ctypes.c_size_t, ctypes.c_char_p, ctypes.c_size_t]),
                        ("ZSTD_decompress", [ctypes.c_void_p, ctypes.c_size_t, ctypes.c_char_p, ctypes.c_size_t])):
    getattr(library, name).restype, getattr(library, name).argtypes = ctypes.c_size_t, arguments
library.ZSTD_getFrameContentSize.restype, library.ZSTD_getFrameContentSize.argtypes = ctypes.c_ulonglong, [ctypes.c_char_p, ctypes.c_size_t]


def compress(data, level, **more):
    """`more`: numbers of ZSTD_cParameter by name."""
    room = ctypes.create_string_buffer(library.ZSTD_compressBound(len(data)))
    context = library.ZSTD_createCCtx()
    library.ZSTD_CCtx_setParameter(context, LEVEL, level)
    for key, value in more.items():
        library.ZSTD_CCtx_setParameter(context, {"checksum": CHECKSUM, "window_log": WINDOW_LOG}[key], value)
    size = library.ZSTD_compress2(context, room, len(room), data, len(data))
    library.ZSTD_freeCCtx(context)
    return room.raw[:size]


def decompress(packed, size):
    """None where the library refuses it, or where it tells of another number of bytes."""
    if library.ZSTD_getFrameContentSize(packed, len(packed)) != size:
        return None
    room = ctypes.create_string_buffer(max(1, size))
    return room.raw[:size] if library.ZSTD_decompress(room, size, packed, len(packed)) == size else None


def contents():
    """Name and bytes: what makes every kind of block, of literals, of tables and of distances."""
    rows = np.random.default_rng(5)
    words = [rows.integers(97, 123, length, dtype=np.uint8).tobytes() for length in rows.integers(2, 12, 400)]
    i, j, k = np.meshgrid(*3 * [np.arange(64)], indexing="ij")
    ball = np.hypot(np.hypot(i - 32, j - 30), k - 33) < 24
    yield from ((f"{size} bytes", rows.integers(0, 256, size, dtype=np.uint8).tobytes()) for size in (0, 1, 5, 300, 300_000))
    yield from ((f"{size} skewed", np.minimum(rows.geometric(0.2, size), 255).astype(np.uint8).tobytes()) for size in (40, 200, 1000, 200_000))
    yield "zeros", bytes(1_000_000)
    yield "runs", np.repeat(rows.integers(0, 3, 4000, dtype=np.uint8), rows.integers(1, 300, 4000)).tobytes()
    text = b" ".join(words[w] for w in np.minimum(rows.geometric(0.01, 60_000) - 1, 399))
    yield "words", text
    yield "few words", text[:4000]
    yield "ct", np.where(ball, 40 + 12 * rows.standard_normal(ball.shape), -1024).astype("<i2").tobytes()
    yield "labels", (ball * (1 + (i > 32) + 2 * (k > 30))).astype(np.uint8).tobytes()
    yield "periods", b"".join(rows.integers(0, 256, period, dtype=np.uint8).tobytes() * 50 for period in range(1, 40))
    far = rows.integers(0, 256, 400_000, dtype=np.uint8).tobytes()
    yield "far", far + bytes(far[5::-1]) + far[1000:] + b"".join(words) + far[:200_000]
    yield "wide", np.cumsum(rows.integers(-3, 4, 300_000)).astype("<i2").tobytes()


def frames():
    """Name, bytes and frame."""
    for name, data in contents():
        for level in LEVELS:
            yield f"{name} at level {level}", data, compress(data, level)
    yield "with a checksum", data, compress(data, 3, checksum=1)
    yield "with a small window", data, compress(data, 3, window_log=10)


def tampered(frame, rounds, seed):
    """The frame cut, and with some bits and bytes that are others."""
    chance = random.Random(seed)
    for _ in range(rounds):
        yield frame[:chance.randrange(len(frame))]
        changed = bytearray(frame)
        for _ in range(chance.choice((1, 1, 1, 2, 5))):
            # Heads and tables stand in front.
            at = chance.randrange(min(len(frame), chance.choice((16, 64, 1 << 20))))
            changed[at] = chance.choice((changed[at] ^ 1 << chance.randrange(8), chance.randrange(256)))
        yield bytes(changed)


def bomb(size):
    """A frame that says it holds `size` bytes, with one block of one byte repeated."""
    return struct.pack("<IBBI", 0xFD2FB528, 0b1000_0000, 0x58, size) + (1 << 17 << 3 | 1 << 1 | 1).to_bytes(3, "little") + b"\x07"


def write(path, frames_of):
    """`frames_of`: pairs of a size and a frame."""
    path.write_bytes(b"".join(struct.pack("<ii", size, len(frame)) + frame for size, frame in frames_of))
