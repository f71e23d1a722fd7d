# SPDX-License-Identifier: Apache-2.0
"""The built-in patient scanned with voxels of the paper's size: 316 x 164 x 895 of 1.95 mm, as many as Gagvani01's 290 x 169 x 940."""
import programs

CASE = programs.MADE / "unpose/standard_1.95mm"
MODEL = programs.MADE / "unpose/standard_1.95mm_default_spheres.hdf"  # bench/unpose finds it under this name


def case():
    if not CASE.exists():
        CASE.parent.mkdir(parents=True, exist_ok=True)
        programs.ecorche("phantom", "-o", CASE, "--size", "standard", "--voxel", 1.95)
    return CASE


def model():
    if not MODEL.exists():
        programs.ecorche("preprocess", case(), "-o", MODEL, "--max-tets", 300000, "--spheres", 0.48)
    return MODEL
