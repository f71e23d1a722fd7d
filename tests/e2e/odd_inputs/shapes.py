# SPDX-License-Identifier: Apache-2.0
"""Surfaces by script: triangles as arrays #F x 3 x 3 of LPS mm, outward; how they are spoilt; and what they enclose."""
import struct

import numpy as np


def capsule(low, high, radius, rings=24, sides=20, caps=True):
    """A closed round stick along z from `low` to `high`, its ends round; without `caps` they are open."""
    ends = np.linspace(0, np.pi / 2, 6)[1:-1]
    heights = [*(low - radius * np.cos(a) for a in ends), *np.linspace(low, high, rings), *(high + radius * np.sin(a) for a in ends)]
    radii = [*(radius * np.sin(a) for a in ends), *[radius] * rings, *(radius * np.cos(a) for a in ends)]
    if not caps:
        heights, radii = heights[4:-4], radii[4:-4]
    turn = np.linspace(0, 2 * np.pi, sides, endpoint=False)
    rows = [np.stack([r * np.cos(turn), r * np.sin(turn), np.full(sides, h)], 1) for h, r in zip(heights, radii)]
    out = []
    for a, b in zip(rows, rows[1:]):
        for i in range(sides):
            j = (i + 1) % sides
            out += [(a[i], a[j], b[j]), (a[i], b[j], b[i])]
    if caps:
        bottom, top = np.array([0, 0, low - radius]), np.array([0, 0, high + radius])
        for i in range(sides):
            j = (i + 1) % sides
            out += [(bottom, rows[0][j], rows[0][i]), (top, rows[-1][i], rows[-1][j])]
    return np.array(out)


def box(low, high):
    """Twelve triangles."""
    corner = lambda b: [high[k] if b >> k & 1 else low[k] for k in range(3)]  # noqa: E731
    faces = [(0, 2, 3, 1), (4, 5, 7, 6), (0, 1, 5, 4), (2, 6, 7, 3), (0, 4, 6, 2), (1, 3, 7, 5)]
    return np.array([[corner(f[a]) for a in three] for f in faces for three in ((0, 1, 2), (0, 2, 3))], float)


def moved(triangles, by=(0, 0, 0), scale=1.0):
    return np.asarray(triangles) * scale + np.asarray(by, float)


def joined(*all_of_them):
    return np.concatenate(all_of_them)


def turned_over(triangles):
    return triangles[:, ::-1]


def some_turned_over(triangles, share, seed=1):
    which = np.random.default_rng(seed).random(len(triangles)) < share
    out = triangles.copy()
    out[which] = out[which][:, ::-1]
    return out


def without(triangles, share, seed=1):
    return triangles[np.random.default_rng(seed).random(len(triangles)) >= share]


def apart(triangles, by):
    """A soup: each triangle shrunk about its middle."""
    middle = triangles.mean(1, keepdims=True)
    return middle + (triangles - middle) * (1 - by)


def jittered(triangles, mm, seed=1):
    """Vertices moved at random, the same where they are the same: the surface stays closed and cuts itself."""
    points, back = np.unique(triangles.reshape(-1, 3).round(6), axis=0, return_inverse=True)
    points = points + np.random.default_rng(seed).normal(0, mm, points.shape)
    return points[back.ravel()].reshape(-1, 3, 3)


def volume(triangles):
    return float(np.einsum("ij,ij->i", triangles[:, 0], np.cross(triangles[:, 1], triangles[:, 2])).sum() / 6)


def stl(triangles):
    out = np.zeros(len(triangles), np.dtype([("n", "<f4", 3), ("v", "<f4", (3, 3)), ("a", "<u2")]))
    out["v"] = triangles
    return b"by script".ljust(80, b" ") + struct.pack("<I", len(triangles)) + out.tobytes()


def read_stl(path):
    data = path.read_bytes()
    rows = np.frombuffer(data, np.dtype([("n", "<f4", 3), ("v", "<f4", (3, 3)), ("a", "<u2")]), int.from_bytes(data[80:84], "little"), 84)
    return rows["v"].astype(float)
