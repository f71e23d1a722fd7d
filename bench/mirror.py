# SPDX-License-Identifier: Apache-2.0
"""Left against right: the mid-plane of a body out of its bones, and a bone laid onto the mirror image of its fellow."""
import numpy as np

MOST_POINTS, ROUNDS, KEPT = 700, 40, 0.8


def thinned(points):
    return points[:: max(1, len(points) // MOST_POINTS)]


def nearest(points, to):
    """The row of `to` nearest to each of `points`, and how far it is."""
    rows, away = [], []
    for chunk in np.array_split(points, max(1, len(points) * len(to) // 2_000_000 + 1)):
        squares = ((chunk[:, None, :] - to[None, :, :]) ** 2).sum(axis=2)
        rows.append(squares.argmin(axis=1))
        away.append(np.sqrt(squares.min(axis=1)))
    return np.concatenate(rows), np.concatenate(away)


def reflected(points, plane):
    normal, at = plane
    return points - 2 * np.outer(points @ normal - at, normal) if np.ndim(points) == 2 else points - 2 * (points @ normal - at) * normal


def mid_plane(bones):
    """(unit normal, offset) of the plane that mirrors `bones` best: pairs of nearest points in turn with the best plane between them, from x = mean x."""
    bones = thinned(bones)
    plane = (np.array([1.0, 0, 0]), bones[:, 0].mean())
    for _ in range(ROUNDS):
        rows, away = nearest(reflected(bones, plane), bones)
        good = away <= np.quantile(away, KEPT)
        here, there = bones[good], bones[rows[good]]
        middle = (here.mean(axis=0) + there.mean(axis=0)) / 2
        product = (here - middle).T @ (there - middle)
        _, vectors = np.linalg.eigh(product + product.T)
        normal = vectors[:, 0] * np.sign(vectors[0, 0])
        plane = (normal, normal @ middle)
    return plane


def laid_onto(moving, fixed):
    """Rotation and translation of `moving` onto `fixed`: nearest points (Besl and McKay 1992), the farthest fifth left out."""
    fixed, points = thinned(fixed), thinned(moving)
    turn, shift = np.eye(3), fixed.mean(axis=0) - points.mean(axis=0)
    for _ in range(ROUNDS):
        here = points @ turn.T + shift
        rows, away = nearest(here, fixed)
        good = away <= np.quantile(away, KEPT)
        a, b = points[good], fixed[rows[good]]
        left, _, right = np.linalg.svd((a - a.mean(axis=0)).T @ (b - b.mean(axis=0)))
        turn = right.T @ np.diag([1, 1, np.sign(np.linalg.det(right.T @ left.T))]) @ left.T
        shift = b.mean(axis=0) - turn @ a.mean(axis=0)
    return turn, shift
