# SPDX-License-Identifier: Apache-2.0
"""Every joint of a rig on one sheet: its bones, the vertices it was found on, the sphere or cylinder through them, its centre and axes."""
import math

import numpy as np
from vtkmodules.util.numpy_support import numpy_to_vtk
import vtkmodules.vtkRenderingFreeType  # noqa: F401  (draws the words)
from vtkmodules.vtkCommonCore import vtkPoints
from vtkmodules.vtkCommonDataModel import vtkBox, vtkPolyData
from vtkmodules.vtkFiltersCore import vtkImageAppend, vtkTubeFilter
from vtkmodules.vtkFiltersExtraction import vtkExtractPolyDataGeometry
from vtkmodules.vtkFiltersGeneral import vtkVertexGlyphFilter
from vtkmodules.vtkFiltersSources import vtkLineSource, vtkSphereSource
from vtkmodules.vtkRenderingCore import vtkActor, vtkPolyDataMapper

import scene

CHILD, PARENT, MARKS, SHAPE = (0.90, 0.85, 0.70), (0.72, 0.79, 0.90), (0.85, 0.10, 0.10), (0.15, 0.60, 0.35)
AXES = ((0.85, 0.1, 0.1), (0.1, 0.6, 0.1), (0.1, 0.2, 0.85))  # x, y, z
NEAR_MM = 60  # of the centre, at least: what is drawn


def ball(centre, radius, colour, opacity=1.0):
    source = vtkSphereSource()
    source.SetCenter(*centre)
    source.SetRadius(radius)
    source.SetThetaResolution(32)
    source.SetPhiResolution(24)
    source.Update()
    return scene.surface_actor(source.GetOutput(), colour, opacity)


def tube(start, end, radius, colour, opacity=1.0):
    line = vtkLineSource()
    line.SetPoint1(*start)
    line.SetPoint2(*end)
    thick = vtkTubeFilter()
    thick.SetInputConnection(line.GetOutputPort())
    thick.SetRadius(radius)
    thick.SetNumberOfSides(32)
    thick.Update()
    return scene.surface_actor(thick.GetOutput(), colour, opacity)


def marks(points, size):
    data = vtkPoints()
    data.SetData(numpy_to_vtk(points, deep=True))
    cloud = vtkPolyData()
    cloud.SetPoints(data)
    glyphs = vtkVertexGlyphFilter()
    glyphs.SetInputData(cloud)
    mapper = vtkPolyDataMapper()
    mapper.SetInputConnection(glyphs.GetOutputPort())
    actor = vtkActor()
    actor.SetMapper(mapper)
    actor.GetProperty().SetColor(MARKS)
    actor.GetProperty().SetPointSize(size)
    actor.GetProperty().LightingOff()
    return actor


def bones_near(surface, low, high, colour):
    box = vtkBox()
    box.SetBounds(*np.column_stack([low, high]).ravel())
    cut = vtkExtractPolyDataGeometry()
    cut.SetInputData(surface)
    cut.SetImplicitFunction(box)
    cut.Update()
    return [scene.surface_actor(cut.GetOutput(), colour, 0.4)] if cut.GetOutput().GetNumberOfCells() > 0 else []


def actors_of(row, evidence, bones):
    """The joint's actors and the box to show. `bones`: segment to surface."""
    centre, axes = np.array(row["center_mm"]), np.array(row["axes"])
    points = np.array(evidence["vertices_mm"], float).reshape(-1, 3)
    shown = points[np.linalg.norm(points - centre, axis=1) < 3 * NEAR_MM] if row["fit"]["rule"] != "given" else points
    reach = NEAR_MM if len(shown) == 0 else max(NEAR_MM, 1.15 * np.abs(shown - centre).max())
    low, high = centre - reach, centre + reach
    actors = []
    for segment, colour in ((row["parent"], PARENT), (row["segment"], CHILD)):
        if segment in bones:
            actors += bones_near(bones[segment], low, high, colour)
    if len(shown) > 0:
        actors.append(marks(shown[:: max(1, len(shown) // 3000)], 5))
    axis, radius = np.array(evidence["axis"]), evidence["radius_mm"]
    if evidence["rule"] == "sphere_fit":
        actors.append(ball(centre, radius, SHAPE, 0.35))
    elif evidence["rule"] == "cylinder_fit":
        half = np.percentile(np.abs((shown - centre) @ axis), 97)
        actors.append(tube(centre - half * axis, centre + half * axis, radius, SHAPE, 0.35))
    actors.append(ball(centre, 0.04 * reach, (0.1, 0.1, 0.1)))
    for direction, colour in zip(axes, AXES):
        actors.append(tube(centre - 0.35 * reach * direction, centre + 0.85 * reach * direction, 0.016 * reach, colour))
    return actors, (low, high)


def beside(images, along):
    append = vtkImageAppend()
    append.SetAppendAxis(along)
    for image in images:
        append.AddInputData(image)
    append.Update()
    return append.GetOutput()


def sheet(body, rows, evidence, bones, size, columns):
    """One tile a joint, seen from the front and from the left side."""
    tiles = []
    for row in rows:
        actors, bounds = actors_of(row, evidence[row["joint"]], bones)
        fit = row["fit"]
        words = (f"{row['joint']}: {fit['rule']} {fit['confidence']:.2f}", f"rms {fit['residual_mm']:.1f} mm, {100 * fit['inlier_share']:.0f} % of {fit['points']}")
        views = []
        for view, text in zip(("front", "side"), words):
            views.append(scene.shoot(actors, view, size, bounds=bounds, texts=[scene.caption(text, 4, 4, max(8, size // 20))]).image)
        tiles.append(beside(views, 0))
    blank = tiles[-1].NewInstance()
    blank.DeepCopy(tiles[-1])
    blank.GetPointData().GetScalars().Fill(250)
    tiles += [blank] * (-len(tiles) % columns)
    lines = [beside(tiles[k : k + columns], 0) for k in range(0, len(tiles), columns)]
    print(f"{body}: {len(rows)} joints on {math.ceil(len(rows) / columns)} rows")
    return scene.Picture(beside(lines[::-1], 1))  # images grow upwards
