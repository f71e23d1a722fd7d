# SPDX-License-Identifier: Apache-2.0
"""What a step is planned with: memory and time from the tets that its participant may have."""
import functools
import math
import os

LEAST, MOST = 300_000, 3_500_000  # of `ecorche preprocess --max-tets 0`
MESHES = (".stl", ".ply", ".obj", ".off", ".vtp", ".vtk")


def tets(words, files):
    """The most that `ecorche preprocess` would make: as --max-tets says, or by the vertices of the case; an upper bound, since all
    files of a case count. Images say nothing by their size."""
    words = [str(word) for word in words]
    given = [int(float(value)) for word, value in zip(words, words[1:]) if word == "--max-tets"]
    if given and given[-1] > 0:
        return given[-1]
    sizes = file_sizes(tuple(map(str, files)))
    if not sizes or any(not name.endswith(MESHES) and size > 1 << 20 and not name.endswith((".yaml", ".bvh")) for name, size in sizes) and \
            not any(name.endswith(MESHES) for name, size in sizes):
        return MOST
    # A triangle of a binary STL takes 50 bytes, and there are two for each vertex; two and a half tets a vertex.
    vertices = sum(size for name, size in sizes if name.endswith(MESHES)) / 100
    return int(min(MOST, max(LEAST, 2.5 * vertices)))


@functools.lru_cache(maxsize=None)
def file_sizes(files):
    return [(name.lower(), os.path.getsize(name)) for name in files if os.path.exists(name)]


def mib(law, step, count, attempt, beside=0):
    """Doubled with every further attempt. `beside`: what else the job holds."""
    line = law[step]
    return math.ceil(line["mib"] + line["mib_per_mtet"] * count / 1e6 + beside) * 2 ** (attempt - 1)


def minutes(law, step, count, attempt):
    """Four times what it takes: a node may be slower than the one that was measured."""
    line = law[step]
    return max(1, math.ceil(4 * (line["s"] + line["s_per_mtet"] * count / 1e6) / 60)) * attempt
