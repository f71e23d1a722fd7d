# SPDX-License-Identifier: Apache-2.0
"""Volumetric skeletons: every skeletal voxel a small ball in the colour of what it hangs on (Gagvani01 figure 2)."""
import h5py
import numpy as np
from vtkmodules.util.numpy_support import numpy_to_vtk, numpy_to_vtkIdTypeArray, vtk_to_numpy
from vtkmodules.vtkCommonCore import vtkPoints
from vtkmodules.vtkCommonDataModel import vtkCellArray, vtkPolyData
from vtkmodules.vtkFiltersCore import vtkGlyph3D
from vtkmodules.vtkFiltersSources import vtkSphereSource
from vtkmodules.vtkRenderingCore import vtkActor, vtkPolyDataMapper

import scene

FIELD = "ecorche_volumetric_skeleton"


def is_skeleton(surface):
    return surface.GetFieldData().GetAbstractArray(FIELD) is not None


def of_model(path):
    """(name, skeleton) of every body of balls in a model."""
    with h5py.File(path, "r") as file:
        for name, group in sorted(file["ecorche"].get("spheres", {}).items(), key=lambda item: item[1]["index"][0]):
            direction = group["direction"][()]
            points = group["origin"][()] + (group["voxel"][()] * group["spacing"][()]) @ direction.T
            yield name, poly_data(points, group["parent"][()], group["segment"][()], group["spacing"][0])


def poly_data(points, parent, segment, edge):
    """As `ecorche thin` writes it, as far as it is drawn."""
    data = vtkPolyData()
    vtk_points = vtkPoints()
    vtk_points.SetData(numpy_to_vtk(np.ascontiguousarray(points, np.float32), deep=True))
    data.SetPoints(vtk_points)
    child = np.flatnonzero(parent >= 0)
    lines = vtkCellArray()
    ends = np.ascontiguousarray(np.stack([child, parent[child]], axis=1), np.int64).ravel()
    lines.SetData(numpy_to_vtkIdTypeArray(np.arange(0, len(ends) + 1, 2, dtype=np.int64), deep=True),
                  numpy_to_vtkIdTypeArray(ends, deep=True))
    data.SetLines(lines)
    for name, values in (("segment", np.ascontiguousarray(segment, np.int32)),):
        array = numpy_to_vtk(values, deep=True)
        array.SetName(name)
        data.GetPointData().AddArray(array)
    spacing = numpy_to_vtk(np.full(3, float(edge)), deep=True)
    spacing.SetName("spacing")
    data.GetFieldData().AddArray(spacing)
    return data


def ball_actor(data, edge):
    """Balls of 0.45 voxels, by segment where attached, else by distance to the background."""
    arrays = data.GetPointData()
    shown = arrays.GetArray("segment") or arrays.GetArray("distance")
    values = vtk_to_numpy(shown).astype(float)
    if arrays.GetArray("segment"):
        colours = scene.discrete(int(values.max()) + 2)
        values = values + 1  # none is 0, the colour of soft tissue
    else:
        values = np.sqrt(values)
        colours = scene.ramp(values.min(), max(values.max(), values.min() + 1), scene.WEIGHT_STOPS)
    array = numpy_to_vtk(values, deep=True)
    array.SetName("shown")
    arrays.SetScalars(array)
    ball = vtkSphereSource()
    ball.SetRadius(0.45 * edge)
    ball.SetThetaResolution(8)
    ball.SetPhiResolution(6)
    glyphs = vtkGlyph3D()
    glyphs.SetInputData(data)
    glyphs.SetSourceConnection(ball.GetOutputPort())
    glyphs.ScalingOff()
    glyphs.SetColorModeToColorByScalar()
    mapper = vtkPolyDataMapper()
    mapper.SetInputConnection(glyphs.GetOutputPort())
    mapper.SetLookupTable(colours)
    mapper.SetScalarRange(colours.GetRange())
    actor = vtkActor()
    actor.SetMapper(mapper)
    return actor


def tree_actor(data):
    tree = vtkPolyData()
    tree.SetPoints(data.GetPoints())
    tree.SetLines(data.GetLines())
    mapper = vtkPolyDataMapper()
    mapper.SetInputData(tree)
    mapper.ScalarVisibilityOff()
    actor = vtkActor()
    actor.SetMapper(mapper)
    actor.GetProperty().SetColor(0.45, 0.45, 0.48)
    actor.GetProperty().LightingOff()
    return actor


def draw(data, view, height, skins=()):
    """The balls and the tree, within `skins` where there are any."""
    edge = vtk_to_numpy(data.GetFieldData().GetArray("spacing")).ravel()[0]
    actors = [ball_actor(data, edge)] + ([tree_actor(data)] if data.GetNumberOfLines() else [])
    actors += [scene.surface_actor(skin, scene.GROUP_COLOURS["skin"], 0.16) for skin in skins]
    return scene.shoot(actors, view, height)
