# SPDX-License-Identifier: Apache-2.0
"""The command, the bodies that it is tried on, and what it writes, as tests of posed files need them."""
import os
import pathlib
import subprocess

import numpy as np

ECORCHE = os.environ["ECORCHE_BIN"]
CASE = pathlib.Path(os.environ["ECORCHE_CASE"])
MODEL = pathlib.Path(os.environ["ECORCHE_MODEL"])


def run(*words):
    return subprocess.run([ECORCHE, *map(str, words)], capture_output=True, text=True, timeout=120)


def corners(path):
    """The triangles of a binary STL, in their order: #F x 3 x 3."""
    data = path.read_bytes()
    count = int.from_bytes(data[80:84], "little")
    rows = np.frombuffer(data, np.dtype([("n", "<f4", 3), ("v", "<f4", (3, 3)), ("a", "<u2")]), count, 84)
    return rows["v"].astype(float)
