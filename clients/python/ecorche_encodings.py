# SPDX-License-Identifier: Apache-2.0
"""The encodings of frames (docs/reference/protocol.md, "Encodings"), as numpy arrays. Needs no server."""
import ctypes
import ctypes.util

import numpy as np

BLOCK, LANES, HEADER, MOVED_ONLY = 512, 32, 34, 255
BRICK = 32           # voxels along each edge
LEFT_OUT = -128      # both numbers of the normal of a vertex of no triangle


def wrapped(numbers):
    """To 16 bits with a sign, whatever is beyond them dropped."""
    return np.asarray(numbers).astype(np.int16)


def unpack(words, rows, width):
    """The numbers of one plane: lane l of row r is vertex 32 r + l; `words` is #words x 32, u16."""
    bits = np.unpackbits(np.ascontiguousarray(words.T).view(np.uint8), axis=1, bitorder="little")
    bits = bits[:, :rows * width].reshape(LANES, rows, width)
    return (bits @ (1 << np.arange(width, dtype=np.int64))).T.ravel().astype(np.int64)


def decode_delta(data, key):
    """`data`: u8; `key`: #V x 3 u16, the keyframe's numbers. Returns #V x 3 u16; ValueError for what is no such array."""
    out = np.empty_like(key)
    at = 0
    for first in range(0, len(key), BLOCK):
        x = key[first:first + BLOCK].astype(np.int64)
        rows = -(-len(x) // LANES)
        head = data[at:at + HEADER].tobytes()
        if len(head) < HEADER:
            raise ValueError("the deltas end too early")
        at += HEADER
        digits, widths = head[0], head[1:4]
        if (digits > 9 and digits != MOVED_ONLY) or max(widths) > 16:
            raise ValueError("a block of deltas has no header")
        matrix = np.frombuffer(head, "<i2", 9, 4).reshape(3, 3).astype(np.int64)
        centre, base = np.frombuffer(head, "<u2", 3, 22).astype(np.int64), np.frombuffer(head, "<u2", 3, 28).astype(np.int64)
        x = wrapped(x - centre)
        if digits == MOVED_ONLY:
            moved = x.astype(np.int64)
        else:
            x = wrapped(x.astype(np.int64) << (digits + 2)).astype(np.int64)
            products = wrapped((x[:, None, :] * matrix[None, :, :] + (1 << 14)) >> 15).astype(np.int64)
            half = 1 << (digits - 1) if digits else 0
            moved = wrapped(products.sum(axis=2) + half).astype(np.int64) >> digits
        for axis, width in enumerate(widths):
            size = 2 * LANES * (-(-rows * width // 16))
            words = np.frombuffer(data[at:at + size].tobytes(), "<u2")
            if 2 * len(words) != size:
                raise ValueError("the deltas end too early")
            at += size
            left = unpack(words.reshape(-1, LANES), rows, width)[:len(x)] if width else 0
            out[first:first + BLOCK, axis] = (moved[:, axis] + base[axis] + left).astype(np.uint16)
    if at != len(data):
        raise ValueError("the deltas go on behind their last block")
    return out


def positions(numbers, box):
    """#V x 3 float32, mm, LPS, of u16 numbers in a v1.QuantiseBox."""
    return (np.array([box.low_x, box.low_y, box.low_z], np.float64) + np.float64(box.step) * numbers).astype(np.float32)


def normals(packed):
    """#V x 3 float32 unit vectors, or zeros, of #V x 2 i8."""
    uv = packed.astype(np.float32) / 127
    z = 1 - np.abs(uv).sum(axis=1)
    folded = (1 - np.abs(uv[:, ::-1])) * np.where(uv < 0, -1, 1)
    out = np.column_stack([np.where(z[:, None] < 0, folded, uv), z])
    out /= np.linalg.norm(out, axis=1, keepdims=True)
    out[(packed == LEFT_OUT).all(axis=1)] = 0
    return out.astype(np.float32)


def decompress(packed, size):
    """The `size` bytes of one zstd frame; ValueError for anything else. By the system's library: Python 3.11 has none."""
    path = ctypes.util.find_library("zstd")
    if path is None:
        raise OSError("the zstd library is not installed (subscribe without `compressed`)")
    library = ctypes.CDLL(path)
    library.ZSTD_decompress.restype = ctypes.c_size_t
    library.ZSTD_decompress.argtypes = [ctypes.c_void_p, ctypes.c_size_t, ctypes.c_char_p, ctypes.c_size_t]
    out = ctypes.create_string_buffer(max(size, 1))
    packed = np.ascontiguousarray(packed).tobytes()
    if library.ZSTD_decompress(out, size, packed, len(packed)) != size:
        raise ValueError("the compressed voxels are not what they should be")
    return out.raw[:size]


def with_bricks(key, bricks, rows):
    """`key` (size_k x size_j x size_i, perhaps x components) with these bricks of BRICK^3 voxels replaced by `rows`, i fastest."""
    out = key.copy()
    counts = [-(-size // BRICK) for size in key.shape[2::-1]]  # along i, j, k
    at = 0
    for brick in bricks.tolist():
        i, j, k = brick % counts[0], brick // counts[0] % counts[1], brick // (counts[0] * counts[1])
        place = out[k * BRICK:(k + 1) * BRICK, j * BRICK:(j + 1) * BRICK, i * BRICK:(i + 1) * BRICK]
        voxels = place.shape[0] * place.shape[1] * place.shape[2]
        if voxels == 0 or at + voxels > len(rows):
            raise ValueError("the bricks are not those of the grid")
        place[...] = rows[at:at + voxels].reshape(place.shape)
        at += voxels
    if at != len(rows):
        raise ValueError("the bricks go on behind their last one")
    return out
