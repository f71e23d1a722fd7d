# SPDX-License-Identifier: Apache-2.0
"""Bodies of one surface a segment, damaged in one way at a time."""
import dataclasses
import re
import typing

import numpy as np
from vtkmodules.util.numpy_support import vtk_to_numpy
from vtkmodules.vtkCommonDataModel import vtkPlane, vtkPlaneCollection
from vtkmodules.vtkCommonTransforms import vtkTransform
from vtkmodules.vtkFiltersCore import vtkCleanPolyData, vtkFlyingEdges3D, vtkReverseSense, vtkWindowedSincPolyDataFilter
from vtkmodules.vtkFiltersGeneral import vtkClipClosedSurface, vtkTransformPolyDataFilter
from vtkmodules.vtkImagingStencil import vtkImageStencilToImage, vtkPolyDataToImageStencil
from vtkmodules.vtkIOGeometry import vtkSTLReader, vtkSTLWriter

LONG = ("thigh", "shank", "upper_arm", "forearm")
SHARES = (0.75, 0.5, 0.25, 0.1)
VOXELS = (1, 2, 4, 8)  # mm
MIRROR = np.diag([-1.0, 1, 1])


@dataclasses.dataclass(frozen=True)
class Damage:
    name: str
    kind: str
    touched: typing.Optional[frozenset]  # segments, None for all
    bones: typing.Callable[[], dict]  # what is put in place of whole ones; None for one that is taken away
    turn: np.ndarray = dataclasses.field(default_factory=lambda: np.eye(3))  # of the body

    @property
    def mirrors(self):
        return np.linalg.det(self.turn) < 0

    def touches(self, joint, segment, parent):
        """Whether the damage is on the joint's own bones or its parent's; the root lies amid the hips."""
        return (self.touched is None or segment in self.touched or parent in self.touched
                or (joint == "pelvis" and any("thigh" in t for t in self.touched)))


def read(path):
    reader = vtkSTLReader()
    reader.SetFileName(str(path))
    reader.Update()
    return reader.GetOutput()


def write(path, surface):
    writer = vtkSTLWriter()
    writer.SetFileName(str(path))
    writer.SetFileTypeToBinary()
    writer.SetInputData(surface)
    writer.Write()


def points(surface):
    return vtk_to_numpy(surface.GetPoints().GetData()).astype(float)


def clipped(surface, origin, normal):
    """What lies on the side of `normal`, its cut closed by a flat cap; nothing where nothing is left."""
    plane, planes = vtkPlane(), vtkPlaneCollection()
    plane.SetOrigin(*origin)
    plane.SetNormal(*normal)
    planes.AddItem(plane)
    clean = vtkCleanPolyData()
    clean.SetInputData(surface)
    clip = vtkClipClosedSurface()
    clip.SetInputConnection(clean.GetOutputPort())
    clip.SetClippingPlanes(planes)
    clip.Update()
    return clip.GetOutput() if clip.GetOutput().GetNumberOfPolys() > 50 else None


def turned(surface, matrix):
    transform = vtkTransform()
    transform.SetMatrix([*np.vstack([np.column_stack([matrix, np.zeros(3)]), [0, 0, 0, 1]]).ravel()])
    turn = vtkTransformPolyDataFilter()
    turn.SetInputData(surface)
    turn.SetTransform(transform)
    if np.linalg.det(matrix) > 0:
        turn.Update()
        return turn.GetOutput()
    outward = vtkReverseSense()
    outward.SetInputConnection(turn.GetOutputPort())
    outward.Update()
    return outward.GetOutput()


def smoothed(surface, rounds, band):
    smooth = vtkWindowedSincPolyDataFilter()
    smooth.SetInputData(surface)
    smooth.SetNumberOfIterations(rounds)
    smooth.SetPassBand(band)
    smooth.Update()
    return smooth.GetOutput()


def in_voxels(surface, mm):
    """What a label of such voxels shows: those whose middles lie inside, their surface smoothed as segmenters do; nothing where hardly one does."""
    bounds = surface.GetBounds()
    counts = [int((bounds[2 * a + 1] - bounds[2 * a]) / mm) + 5 for a in range(3)]
    stencil = vtkPolyDataToImageStencil()
    stencil.SetInputData(surface)
    # A grid of the scan, not of the bone.
    stencil.SetOutputOrigin(*(mm * (np.floor(bounds[2 * a] / mm) - 2) for a in range(3)))
    stencil.SetOutputSpacing(mm, mm, mm)
    stencil.SetOutputWholeExtent(0, counts[0], 0, counts[1], 0, counts[2])
    image = vtkImageStencilToImage()
    image.SetInputConnection(stencil.GetOutputPort())
    image.SetInsideValue(1)
    image.SetOutsideValue(0)
    image.SetOutputScalarTypeToUnsignedChar()
    edges = vtkFlyingEdges3D()
    edges.SetInputConnection(image.GetOutputPort())
    edges.SetValue(0, 0.5)
    edges.Update()
    return smoothed(edges.GetOutput(), 15, 0.1) if edges.GetOutput().GetNumberOfPolys() > 50 else None


def other_side(name):
    return re.sub("_(left|right)$", lambda m: "_right" if m[1] == "left" else "_left", name)


def rotation(axis, degrees):
    a, cross = np.radians(degrees), np.cross(np.eye(3), -np.asarray(axis, float))
    return np.eye(3) + np.sin(a) * cross + (1 - np.cos(a)) * cross @ cross


def shaft(surface):
    at = points(surface)
    _, vectors = np.linalg.eigh(np.cov(at.T))
    along = vectors[:, 2] * np.sign(vectors[2, 2])
    low, high = np.quantile((at - at.mean(axis=0)) @ along, (0.001, 0.999))
    return at.mean(axis=0), along, low, high


def of_a_long_bone(bones, segment):
    middle, along, low, high = shaft(bones[segment])

    def only(name, kind, surface, turn=None):
        if turn is None:
            return Damage(f"{segment}: {name}", kind, frozenset({segment}), lambda: {segment: surface()})
        return Damage(f"{segment}: {name}", kind, frozenset({segment}),
                      lambda: {s: turned(b, turn) for s, b in {**bones, segment: surface()}.items() if b}, turn)

    for share in SHARES:
        for end, sign in (("upper", 1), ("lower", -1)):
            at = middle + along * (high - share * (high - low) if sign > 0 else low + share * (high - low))
            yield only(f"{end} {share:.0%} left", f"{share:.0%} of a long bone left", lambda at=at, sign=sign: clipped(bones[segment], at, sign * along))
    across = np.cross(along, [0, 1, 0]) / np.linalg.norm(np.cross(along, [0, 1, 0]))
    yield only("inner or outer half", "a long bone halved along", lambda: clipped(bones[segment], middle, across))
    yield only("taken away", "a long bone missing", lambda: None)
    at = middle + along * (low + 0.12 * (high - low))
    for tilt in (0, 20):  # no condyles
        yield only("without its lower end" + (f", body tilted by {tilt}" if tilt else ""), "a long bone without its lower end",
                   lambda: clipped(bones[segment], at, along), rotation([0, 1, 0], tilt) if tilt else None)


def of_both_thighs(bones, share):
    cut = {s: None for s in bones if s.rsplit("_", 1)[0] in ("shank", "foot", "toes")}
    for segment in ("thigh_left", "thigh_right"):
        middle, along, low, high = shaft(bones[segment])
        cut[segment] = clipped(bones[segment], middle + along * (high - share * (high - low)), along)
    return cut


def damages(bones):
    for segment in bones:
        if segment.rsplit("_", 1)[0] in LONG:
            yield from of_a_long_bone(bones, segment)
    thighs = frozenset({"thigh_left", "thigh_right"})
    for share in SHARES if thighs <= set(bones) else ():
        yield Damage(f"both thighs: upper {share:.0%} left, nothing below", "cut by the field of view", thighs, lambda share=share: of_both_thighs(bones, share))
    if "pelvis" in bones:
        middle = points(bones["pelvis"]).mean(axis=0)
        for name, normal in (("left half", (1, 0, 0)), ("upper half", (0, 0, 1)), ("lower half", (0, 0, -1))):
            yield Damage(f"pelvis: {name}", "pelvis halved", frozenset({"pelvis"}), lambda normal=normal: {"pelvis": clipped(bones["pelvis"], middle, normal)})
    for axis, name in (((0, 1, 0), "sideways"), ((1, 0, 0), "forward")):
        for degrees in (10, 25):
            turn = rotation(axis, degrees)
            yield Damage(f"body tilted {name} by {degrees}", "tilted", None, lambda turn=turn: {s: turned(b, turn) for s, b in bones.items()}, turn)
    yield Damage("body mirrored", "mirrored", None, lambda: {other_side(s): turned(b, MIRROR) for s, b in bones.items()}, MIRROR)
    yield Damage("body smoothed", "smoothed", None, lambda: {s: smoothed(b, 30, 0.01) for s, b in bones.items()})
    for mm in VOXELS:
        yield Damage(f"body in voxels of {mm} mm", f"in voxels of {mm} mm", None, lambda mm=mm: {s: in_voxels(b, mm) for s, b in bones.items()})


def symmetric(bones, x):
    """Its right side is the mirror image of its left one about the plane at `x`."""
    both = dict(bones)
    for segment in bones:
        if segment.endswith("_left"):
            both[other_side(segment)] = turned(bones[segment], MIRROR)
            both[other_side(segment)].GetPoints().GetData().Modified()
            vtk_to_numpy(both[other_side(segment)].GetPoints().GetData())[:, 0] += 2 * x
    return both
