#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Holds docs/reference/model.md against a file: every dataset is described with its type, and nothing else is.

usage: check_page.py MODEL.hdf PAGE.md
"""
import re
import sys

import h5py

TYPES = {"|u1": "u8", "|i1": "i8", "<i2": "i16", "<u2": "u16", "<i4": "i32", "<u4": "u32", "<i8": "i64", "<u8": "u64", "<f4": "f32", "<f8": "f64"}
VOXELS = "the volume's"  # any type of voxels


def pattern(path):
    """The path as the page writes it: names of tissues, volumes and joints are <name>."""
    return re.sub(r"^/ecorche/(tissues|volumes|spheres|packed_correction|packed_pose_correction)/[^/]+/", r"/ecorche/\1/<name>/", path)


def stored(path):
    found = {}
    with h5py.File(path, "r") as file:
        def visit(name, item):
            if isinstance(item, h5py.Dataset):
                kind = "text" if item.dtype.kind == "S" else TYPES.get(item.dtype.str, item.dtype.str)
                found.setdefault(pattern("/" + name), (kind, item.ndim))
        file.visititems(visit)
    return found


def described(path):
    """Rows `| dataset | type | shape | meaning |` under a heading that names their group."""
    found, group = {}, ""
    for line in open(path, encoding="utf-8"):
        heading = re.match(r"#+ .*`(/[^`]*)`", line)
        if heading:
            group = heading.group(1).rstrip("/")
        row = re.match(r"\| (`[^|]+`) \| ([^|]+) \| ([^|]+) \| (.+) \|$", line)
        if row:
            for name in re.findall(r"`([^`]+)`", row.group(1)):
                found[f"{group}/{name}"] = (row.group(2).strip(), row.group(3).count(" x ") + 1)
    return found


def main():
    file, page = stored(sys.argv[1]), described(sys.argv[2])
    problems = [f"{path}: is not in the page" for path in sorted(file.keys() - page.keys())]
    problems += [f"{path}: is in the page, not in the file" for path in sorted(page.keys() - file.keys())]
    for path in sorted(file.keys() & page.keys()):
        if page[path] != file[path] and page[path][0] != VOXELS:
            problems.append(f"{path}: type and rank {page[path]} in the page, {file[path]} in the file")
    print("\n".join(problems))
    print(f"{len(file)} datasets, {len(problems)} problems")
    sys.exit(1 if problems else 0)


main()
