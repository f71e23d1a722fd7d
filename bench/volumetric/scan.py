# SPDX-License-Identifier: Apache-2.0
"""The built-in patient scanned with voxels of the paper's size: 316 x 164 x 895 of 1.95 mm, as many as Gagvani01's 290 x 169 x 940."""
import pathlib

ROOT = pathlib.Path(__file__).resolve().parents[2]
CASE = ROOT / "build/bench/unpose/standard_1.95mm"
MODEL = ROOT / "build/bench/unpose/standard_1.95mm_default_spheres.hdf"  # bench/unpose finds it under this name


def case(run):
    """`run`: calls ecorche with words."""
    if not CASE.exists():
        CASE.parent.mkdir(parents=True, exist_ok=True)
        run("phantom", "-o", CASE, "--size", "standard", "--voxel", 1.95)
    return CASE


def model(run):
    if not MODEL.exists():
        run("preprocess", case(run), "-o", MODEL, "--max-tets", 300000, "--spheres", 0.48)
    return MODEL
