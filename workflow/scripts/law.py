# SPDX-License-Identifier: Apache-2.0
"""What a step is planned with: memory and time from the tets that its participant may have, and from the voxels of its images."""
import functools
import gzip
import math
import os
import re
import struct

LEAST, MOST = 300_000, 3_500_000  # of `ecorche preprocess --max-tets 0`
MESHES = (".stl", ".ply", ".obj", ".off", ".vtp", ".vtk")
IMAGES = (".nii", ".nii.gz", ".nrrd", ".mha")


@functools.lru_cache(maxsize=None)
def size_of(words, files):
    """(millions of tets, millions of voxels) of a participant whose model is made with these options of these files: upper bounds."""
    known = [(name, os.path.getsize(name)) for name in files if os.path.isfile(name)]
    images = [voxels(name) for name, _ in known if name.lower().endswith(IMAGES)]
    # A slice of a DICOM series has two bytes a voxel, or fewer where it is packed.
    images += [bytes / 2 for name, bytes in known if name.lower().endswith(".dcm")]
    given = [float(value) for word, value in zip(words, words[1:]) if word == "--max-tets"]
    # A triangle of a binary STL takes 50 bytes, two go on a vertex, and two and a half tets are made for each; a body fills half of its
    # image at most, and twelve tets are made for 27 voxels.
    vertices = sum(bytes for name, bytes in known if name.lower().endswith(MESHES)) / 100
    tets = given[-1] if given and given[-1] > 0 else min(MOST, max(LEAST, 2.5 * vertices, 12 / 27 / 2 * max(images, default=0)))
    return tets / 1e6, sum(images) / 1e6


def voxels(path):
    """By the header; where that cannot be read, as many as there are bytes."""
    try:
        with (gzip.open if path.endswith(".gz") else open)(path, "rb") as file:
            head = file.read(4096)
        if ".nii" in path.lower():
            dims = next(dims for dims in (struct.unpack_from(order + "8h", head, 40) for order in "<>") if 1 <= dims[0] <= 7)[1:4]
        else:
            dims = [int(word) for word in re.search(rb"(?m)^(?:sizes|DimSize) ?[:=] ?([\d ]+)", head)[1].split()][-3:]
        return math.prod(max(1, n) for n in dims)
    except (OSError, EOFError, StopIteration, TypeError, struct.error):
        return os.path.getsize(path)


def linear(line, unit, size):
    tets, images = size
    return line[unit] + line[f"{unit}_per_mtet"] * tets + line[f"{unit}_per_mvoxel"] * images


def mib(law, step, size, attempt, beside=0):
    """Doubled with every further attempt. `beside`: what else the job holds."""
    return math.ceil(linear(law[step], "mib", size) + beside) * 2 ** (attempt - 1)


def minutes(law, step, size, attempt, times=1):
    """Four times what it takes: a node may be slower than the one that was measured. `times`: of a step that does one thing often."""
    return max(1, math.ceil(4 * times * linear(law[step], "s", size) / 60)) * attempt
