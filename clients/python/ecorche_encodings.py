# SPDX-License-Identifier: Apache-2.0
"""The encodings of mesh frames (docs/protocol.md, "Encodings"), as numpy arrays. Needs no server."""
import numpy as np

BLOCK, LANES, HEADER, MOVED_ONLY = 512, 32, 34, 255
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
