# SPDX-License-Identifier: Apache-2.0
"""The real bodies of the public data sets as what `ecorche new` is given: images and label maps as they are, surfaces as masks.

Where a set has no table of names, or names of its own, the table is written here: what a person would have to do is in `by_hand`.
"""
import csv
import pathlib
import re

import nibabel
import numpy as np
import vtk
from vtk.util.numpy_support import vtk_to_numpy

VOXEL = 2.0  # mm, of what is made of surfaces


class RealScan:
    """`given` and `words` go to `ecorche new`; `by_hand` says what a person had to make first."""

    def __init__(self, name, given, words=(), by_hand="", spared=""):
        self.name, self.given, self.words, self.by_hand, self.spared = name, given, words, by_hand, spared


def head_ct(data, folder):
    """The source states no spacing; the collection's header says half of this along x and y (examples/head_ct/skeleton.yaml)."""
    path = folder / "head.mha"
    stated = (data / "visible_human_head_ct/head_ct.mha").read_bytes()
    path.write_bytes(stated.replace(b"0.48828125 0.48828125 1", b"0.9765625 0.9765625 1", 1))
    return RealScan("visible_human_head_ct", [path], ("--bone-hu", "110", "--skin-hu", "25"), by_hand="its spacing")


def icrp(data, folder):
    """AF_organs.txt is no table that any program writes: its first columns become one."""
    table = folder / "AF_labels.tsv"
    rows = re.findall(r"(?m)^(\d+)\s+(\S.*?)\s{2,}", (data / "icrp110_female/AF_organs.txt").read_text(errors="replace"))
    table.write_text("index\tname\n" + "".join(f"{label}\t{name}\n" for label, name in rows))
    return RealScan("icrp110_female", [data / "icrp110_female/AF_labels.mha", table], by_hand="a table of names")


def knee(data, folder):
    return RealScan("knee_atlas", [data / "knee_atlas/knee_labels_copy.mha", data / "knee_atlas/knee.ctbl"],
                    ("--skin-from-labels", "--side", "left"))


def read_mha(path):
    reader = vtk.vtkMetaImageReader()
    reader.SetFileName(str(path))
    reader.Update()
    image = reader.GetOutput()
    return vtk_to_numpy(image.GetPointData().GetScalars()).reshape(image.GetDimensions()[::-1]).transpose(2, 1, 0), image


def arm(data, folder):
    """Its bone labels cover all bones; which voxel is whose, its armature's map says, whose numbers are bones of the arm."""
    labels, _ = read_mha(data / "arm_volume/man-arm-2mm.mha")
    bones, _ = read_mha(data / "arm_volume/man-arm-2mm-skinned.mha")
    names = {2: "humerus", 3: "radius", **{n: "metacarpal" for n in (4, 7, 11, 15, 19)}}
    out = np.where(labels > 0, 1, 0).astype("u1")
    table = {1: "body"}
    for number in np.unique(bones[bones > 1]):
        name = names.get(int(number), "fingers")
        if name not in table.values():
            table[len(table) + 1] = name
        key = next(k for k, v in table.items() if v == name)
        out[(bones == number) & np.isin(labels, (111, 209, 253))] = key
    head = (data / "arm_volume/man-arm-2mm.mha").read_bytes().split(b"ElementDataFile")[0].decode()
    lines = [line for line in head.splitlines() if not line.startswith(("Compressed", "ElementType"))]
    path = folder / "arm.mha"
    path.write_bytes(("\n".join([*lines, "CompressedData = False", "ElementType = MET_UCHAR", "ElementDataFile = LOCAL"]) + "\n").encode()
                     + out.tobytes("F"))
    (folder / "arm.tsv").write_text("index\tname\n" + "".join(f"{key}\t{name}\n" for key, name in table.items()))
    return RealScan("arm_volume", [path, folder / "arm.tsv"], ("--side", "right"), by_hand="bones cut apart, and a table of names")


def surface(path, to_lps):
    reader = vtk.vtkSTLReader()
    reader.SetFileName(str(path))
    turn = vtk.vtkMatrix4x4()
    for row in range(3):
        for column in range(3):
            turn.SetElement(row, column, to_lps[row][column])
    transform = vtk.vtkTransform()
    transform.SetMatrix(turn)
    turned = vtk.vtkTransformPolyDataFilter()
    turned.SetTransform(transform)
    turned.SetInputConnection(reader.GetOutputPort())
    turned.Update()
    return turned.GetOutput()


def mask(poly, low, size):
    """Voxels of the whole grid whose centres the surface encloses, filled in its own box."""
    box = poly.GetBounds()
    first = [max(0, int((box[2 * a] - low[a]) / VOXEL) - 1) for a in range(3)]
    last = [min(size[a] - 1, int((box[2 * a + 1] - low[a]) / VOXEL) + 2) for a in range(3)]
    stencil = vtk.vtkPolyDataToImageStencil()
    stencil.SetInputData(poly)
    stencil.SetOutputOrigin(low)
    stencil.SetOutputSpacing(VOXEL, VOXEL, VOXEL)
    stencil.SetOutputWholeExtent([n for pair in zip(first, last) for n in pair])
    image = vtk.vtkImageStencilToImage()
    image.SetInputConnection(stencil.GetOutputPort())
    image.SetInsideValue(1)
    image.SetOutputScalarTypeToUnsignedChar()
    image.Update()
    values = vtk_to_numpy(image.GetOutput().GetPointData().GetScalars())
    out = np.zeros(size, "u1")
    out[tuple(slice(a, b + 1) for a, b in zip(first, last))] = values.reshape([b - a + 1 for a, b in zip(first, last)][::-1]).transpose(2, 1, 0)
    return out


def masks(surfaces, skin, to_lps, folder):
    """A folder with one mask a surface, as TotalSegmentator has it, and the body's; `surfaces`: name to file."""
    folder.mkdir(parents=True, exist_ok=True)
    body = surface(skin, to_lps)
    bounds = np.array(body.GetBounds()).reshape(3, 2)
    low = bounds[:, 0] - 3 * VOXEL
    size = [int(n) for n in np.ceil((bounds[:, 1] - bounds[:, 0]) / VOXEL) + 6]
    affine = np.diag([-VOXEL, -VOXEL, VOXEL, 1.0])
    affine[:3, 3] = -low[0], -low[1], low[2]
    for name, file in {"body": skin, **surfaces}.items():
        nibabel.save(nibabel.Nifti1Image(mask(body if name == "body" else surface(file, to_lps), low, size), affine), folder / f"{name}.nii.gz")
    return folder


def parts(data, name):
    with open(data / name / ("bones.csv" if (data / name / "bones.csv").exists() else "parts.csv")) as file:
        return {re.sub(r"\W+", "_", row["name"].lower()).strip("_"): data / name / row["file"] for row in csv.DictReader(file) if row["segment"] != "skin"}


def visible_human(data, folder):
    """x to the left, y up, z to the front."""
    bones = {name: file for name, file in parts(data, "visible_human_male").items() if file.suffix == ".stl"}
    return RealScan("visible_human_male", [masks(bones, data / "visible_human_male/skin.stl", [[1, 0, 0], [0, 0, -1], [0, 1, 0]], folder / "visible_human")])


def bodyparts3d(data, folder):
    return RealScan("bodyparts3d", [masks(parts(data, "bodyparts3d"), data / "bodyparts3d/derived/body_envelope_DERIVED.stl", np.eye(3), folder / "bodyparts3d")])


SCANS = {"visible_human_head_ct": head_ct, "icrp110_female": icrp, "knee_atlas": knee, "arm_volume": arm, "visible_human_male": visible_human,
         "bodyparts3d": bodyparts3d}
