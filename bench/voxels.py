# SPDX-License-Identifier: Apache-2.0
"""Voxels of the benches: images as ecorche writes them, what lies off a boundary, and volumes of differences.

The one definition of a boundary in the benches: a voxel is of the boundary when one of its 26 neighbours (or 6, by option) has
another label than its own (or, by option, lies outside of the object: has label 0). 26 and labels are the default, since nearest
sampling there and back moves a value by one voxel along each axis at the most, so that a turn of the whole body there and back
changes no label off the boundary. Beyond the image all is background.
"""
import gzip
import re
import typing

import numpy as np

TYPES = {"unsigned char": "u1", "uint8": "u1", "signed char": "i1", "int8": "i1", "short": "i2", "int16": "i2", "unsigned short": "u2",
         "uint16": "u2", "int": "i4", "int32": "i4", "unsigned int": "u4", "uint32": "u4", "float": "f4", "double": "f8"}


def identifier(name):
    """A label's name as a tissue's: what docs/reference/case.md says of names out of files."""
    return re.sub("[^a-z0-9]+", "_", name.lower()).strip("_")[:48].strip("_") or "label"


class Volume(typing.NamedTuple):
    values: np.ndarray  # [k, j, i]
    origin: np.ndarray  # LPS mm
    spacing: np.ndarray  # mm along i, j, k; negative where an axis runs against the patient's


def read(path):
    """An NRRD of one component whose axes are the patient's."""
    data = path.read_bytes()
    end = data.index(b"\n\n") + 2
    fields = dict(line.split(": ", 1) for line in data[:end].decode().splitlines() if ": " in line and line[0] != "#")
    size = [int(n) for n in fields["sizes"].split()]
    body = data[end:] if fields["encoding"] == "raw" else gzip.decompress(data[end:])
    kind = np.dtype(TYPES[fields["type"]]).newbyteorder("<" if fields.get("endian", "little") == "little" else ">")
    numbers = lambda text: [float(x) for x in text.strip("()").split(",")]
    spacing = [numbers(row)[axis] for axis, row in enumerate(fields["space directions"].split())]
    return Volume(np.frombuffer(body, kind).reshape(size[::-1]), np.array(numbers(fields["space origin"])), np.array(spacing))


def write(path, values, like):
    """u8 values on the grid of `like`."""
    axes = " ".join("(" + ",".join(f"{s:.17g}" if a == b else "0" for b in range(3)) + ")" for a, s in enumerate(like.spacing))
    head = (f"NRRD0004\ntype: uint8\ndimension: 3\nspace: left-posterior-superior\nsizes: {' '.join(map(str, values.shape[::-1]))}\n"
            f"space directions: {axes}\nkinds: domain domain domain\nencoding: raw\n"
            f"space origin: ({','.join(f'{x:.17g}' for x in like.origin)})\n\n")
    path.write_bytes(head.encode() + values.astype(np.uint8).tobytes())


def same_on_grid_of(rest, other):
    """Where `other`, a piece of the same endless lattice, holds what `rest` holds; nowhere beyond its end."""
    shift = (other.origin - rest.origin) / rest.spacing
    at = np.rint(shift).astype(int)
    assert np.abs(shift - at).max() < 1e-4, "not the same lattice"
    out = np.zeros(rest.values.shape, bool)
    low, high = np.maximum(at, 0), np.minimum(at + np.array(other.values.shape[::-1]), rest.values.shape[::-1])
    inside = tuple(slice(a, b) for a, b in zip(low[::-1], high[::-1]))
    theirs = tuple(slice(a - s, b - s) for a, b, s in zip(low[::-1], high[::-1], at[::-1]))
    out[inside] = rest.values[inside] == other.values[theirs]
    return out


def off_boundary(labels, neighbours=26, of="labels"):
    """Voxels of the object (label not 0) that are not of its boundary; see above."""
    if of == "object":
        labels = labels != 0
    padded = np.pad(labels, 1)
    cut = lambda a, axis, k: a[tuple(slice(k, a.shape[b] - 2 + k) if b == axis else slice(None) for b in range(3))]
    if neighbours == 6:
        middle = lambda a, axes: middle(cut(a, axes[0], 1), axes[1:]) if axes else a
        out = labels != 0
        for axis in range(3):
            row = middle(padded, [b for b in range(3) if b != axis])
            out &= (cut(row, axis, 0) == labels) & (cut(row, axis, 2) == labels)
        return out
    low = high = padded
    for axis in range(3):
        low = np.minimum(np.minimum(cut(low, axis, 0), cut(low, axis, 1)), cut(low, axis, 2))
        high = np.maximum(np.maximum(cut(high, axis, 0), cut(high, axis, 1)), cut(high, axis, 2))
    return (low == high) & (labels != 0)


def differences(held, differs, deep):
    """u8: 0 not of the object, 1 the same, 2 differs on the boundary, 3 differs off it."""
    return (held * np.uint8(1) + (differs & held) + (differs & held & deep)).astype(np.uint8)


def add_boundary_options(parser):
    parser.add_argument("--neighbours", type=int, choices=(6, 26), default=26, help="by which a voxel is of the boundary (default: %(default)s)")
    parser.add_argument("--boundary", choices=("labels", "object"), default="labels", help="of every label, or of the object (default: %(default)s)")
