# SPDX-License-Identifier: Apache-2.0
"""Off-screen drawings of surfaces and tets."""
import colorsys
import hashlib

import numpy as np
from vtkmodules.util.numpy_support import numpy_to_vtk, vtk_to_numpy
import vtkmodules.vtkRenderingOpenGL2  # noqa: F401  (chooses the drawing back end)
from vtkmodules.vtkCommonDataModel import vtkPlane
from vtkmodules.vtkFiltersCore import vtkPolyDataNormals
from vtkmodules.vtkFiltersExtraction import vtkExtractGeometry
from vtkmodules.vtkFiltersGeometry import vtkGeometryFilter
from vtkmodules.vtkIOImage import vtkPNGWriter
from vtkmodules.vtkRenderingCore import (vtkActor, vtkColorTransferFunction, vtkLight, vtkPolyDataMapper, vtkRenderer,
                                         vtkRenderWindow, vtkTextActor, vtkWindowToImageFilter)

BACKGROUND = (0.97, 0.97, 0.96)
GROUP_COLOURS = {"skin": (0.93, 0.76, 0.65), "bone": (0.93, 0.89, 0.78), "muscle": (0.70, 0.25, 0.22), "organ": (0.62, 0.42, 0.55),
                 "vessel": (0.80, 0.12, 0.12), "nerve": (0.90, 0.85, 0.35), "cartilage": (0.70, 0.80, 0.85),
                 "ligament": (0.85, 0.82, 0.72), "fat": (0.95, 0.88, 0.55), "other": (0.60, 0.60, 0.65)}
# A word in a tissue's name, and the colour that anatomists' atlases give it.
NAME_COLOURS = [("lung", (0.88, 0.60, 0.60)), ("heart", (0.72, 0.14, 0.18)), ("liver", (0.50, 0.22, 0.16)),
                ("stomach", (0.86, 0.62, 0.48)), ("kidney", (0.55, 0.20, 0.18)), ("spleen", (0.48, 0.15, 0.26)),
                ("brain", (0.88, 0.72, 0.70)), ("bladder", (0.88, 0.80, 0.45)), ("intestin", (0.85, 0.60, 0.50)),
                ("bowel", (0.85, 0.60, 0.50)), ("vein", (0.20, 0.25, 0.60)), ("cava", (0.20, 0.25, 0.60)),
                ("pancreas", (0.88, 0.72, 0.42)), ("aorta", (0.80, 0.12, 0.12))]
VIEWS = {"front": ((0, -1, 0), (0, 0, 1)), "side": ((1, 0, 0), (0, 0, 1)), "oblique": ((0.6, -0.75, 0.25), (0, 0, 1))}


class Picture:
    """What a render window shows, ready to be saved."""

    def __init__(self, image):
        self.image = image

    def save(self, path):
        writer = vtkPNGWriter()
        writer.SetFileName(str(path))
        writer.SetInputData(self.image)
        writer.Write()


def colour_of(tissue):
    for word, colour in NAME_COLOURS:
        if word in tissue.name:
            return colour
    base = np.array(GROUP_COLOURS.get(tissue.group, GROUP_COLOURS["other"]))
    if tissue.group in ("skin", "bone"):
        return tuple(base)
    # Neighbours of one group differ a little, always by the same amount for the same name.
    shade = hashlib.sha1(tissue.name.encode()).digest()[0] / 255 - 0.5
    return tuple(np.clip(base * (1 + 0.35 * shade), 0, 1))


def surface_actor(surface, colour, opacity=1.0):
    normals = vtkPolyDataNormals()
    normals.SetInputData(surface)
    normals.SplittingOff()
    mapper = vtkPolyDataMapper()
    mapper.SetInputConnection(normals.GetOutputPort())
    mapper.ScalarVisibilityOff()
    actor = vtkActor()
    actor.SetMapper(mapper)
    look = actor.GetProperty()
    look.SetColor(colour)
    look.SetOpacity(opacity)
    look.SetInterpolationToPhong()
    look.SetSpecular(0.25 if opacity == 1 else 0.1)
    look.SetSpecularPower(25)
    look.SetAmbient(0.12)
    if opacity < 1:
        look.BackfaceCullingOn()
    return actor


def bounds_of(actors):
    boxes = np.array([actor.GetBounds() for actor in actors])
    low, high = boxes[:, 0::2].min(axis=0), boxes[:, 1::2].max(axis=0)
    return low, high


def shoot(actors, view, height, bounds=None, texts=()):
    """A picture of `actors` seen from `view`, fitted to their bounds, parallel projection."""
    direction, up = (np.array(v, float) for v in VIEWS[view])
    direction /= np.linalg.norm(direction)
    low, high = bounds if bounds is not None else bounds_of(actors)
    centre, extent = (low + high) / 2, high - low
    right = np.cross(up, direction)
    wide = float(np.abs(right) @ extent)
    true_up = np.cross(direction, right)
    tall = float(np.abs(true_up) @ extent)
    width = int(np.clip(height * (wide + 0.06 * tall) / (tall * 1.06), height / 4, 2.2 * height))
    scale = max(tall * 1.06, (wide + 0.06 * tall) * height / width) / 2

    renderer = vtkRenderer()
    renderer.SetBackground(BACKGROUND)
    for actor in actors:
        renderer.AddActor(actor)
    for text in texts:
        renderer.AddActor2D(text)
    camera = renderer.GetActiveCamera()
    camera.ParallelProjectionOn()
    camera.SetFocalPoint(*centre)
    camera.SetPosition(*(centre + direction * 4 * extent.max()))
    camera.SetViewUp(*up)
    camera.SetParallelScale(scale)
    renderer.ResetCameraClippingRange()
    for azimuth, strength in ((35, 0.75), (-50, 0.4)):
        light = vtkLight()
        light.SetLightTypeToCameraLight()
        light.SetPosition(np.sin(np.radians(azimuth)), 0.5, 1)
        light.SetIntensity(strength)
        renderer.AddLight(light)
    renderer.UseDepthPeelingOn()
    renderer.SetMaximumNumberOfPeels(12)
    renderer.SetOcclusionRatio(0.02)
    window = vtkRenderWindow()
    window.SetOffScreenRendering(1)
    window.SetAlphaBitPlanes(1)
    window.SetMultiSamples(0)
    window.SetSize(2 * width, 2 * height)  # halved below: smooth edges without multisampling, which peeling forbids
    window.AddRenderer(renderer)
    window.Render()
    grab = vtkWindowToImageFilter()
    grab.SetInput(window)
    grab.SetInputBufferTypeToRGB()
    grab.ReadFrontBufferOff()
    grab.Update()
    return Picture(halved(grab.GetOutput()))


def halved(image):
    from vtkmodules.vtkImagingCore import vtkImageResample
    resample = vtkImageResample()
    resample.SetInputData(image)
    resample.SetAxisMagnificationFactor(0, 0.5)
    resample.SetAxisMagnificationFactor(1, 0.5)
    resample.SetInterpolationModeToCubic()
    resample.Update()
    return resample.GetOutput()


def caption(text, x, y, size=22):
    actor = vtkTextActor()
    actor.SetInput(text)
    actor.GetTextProperty().SetFontSize(2 * size)
    actor.GetTextProperty().SetColor(0.15, 0.15, 0.18)
    actor.SetPosition(2 * x, 2 * y)
    return actor


def translucent(body, view, height):
    """Skin translucent over everything else."""
    actors = [surface_actor(t.surface, colour_of(t), 0.28 if t.group == "skin" else 1.0) for t in body.tissues]
    return shoot(actors, view, height)


def row_of_surfaces(surfaces, view, height):
    """Surfaces side by side as seen from `view`, first at the left."""
    direction, up = (np.array(v, float) for v in VIEWS[view])
    right = np.cross(up, direction) / np.linalg.norm(direction)
    actors, at = [], 0.0
    for surface in surfaces:
        points = vtk_to_numpy(surface.GetPoints().GetData())
        along = points @ right
        actor = surface_actor(surface, (0.80, 0.62, 0.50))
        actor.SetPosition(*(right * (at - along.min()) - up * points[:, 2].min()))
        at += np.ptp(along) + 0.15 * np.ptp(points, axis=0).max()
        actors.append(actor)
    return shoot(actors, view, height)


def distinct(index):
    """Colours that neighbours in a list do not share; 0 is soft tissue."""
    if index == 0:
        return (0.86, 0.80, 0.76)
    return colorsys.hsv_to_rgb((index * 0.618034) % 1.0, 0.55 + 0.25 * (index % 2), 0.65 + 0.3 * ((index // 2) % 2))


def cut_actor(grid, values, y, colours):
    """The half of the tets behind the plane, whole tets (so that their shape shows), coloured per tet."""
    array = numpy_to_vtk(np.ascontiguousarray(values, np.float64), deep=True)
    array.SetName("shown")
    grid.GetCellData().SetScalars(array)
    plane = vtkPlane()
    plane.SetOrigin(0, y, 0)
    plane.SetNormal(0, -1, 0)
    half = vtkExtractGeometry()
    half.SetInputData(grid)
    half.SetImplicitFunction(plane)
    skin = vtkGeometryFilter()
    skin.SetInputConnection(half.GetOutputPort())
    mapper = vtkPolyDataMapper()
    mapper.SetInputConnection(skin.GetOutputPort())
    mapper.SetScalarModeToUseCellData()
    mapper.SetLookupTable(colours)
    mapper.SetScalarRange(colours.GetRange())
    actor = vtkActor()
    actor.SetMapper(mapper)
    actor.GetProperty().SetInterpolationToFlat()
    actor.GetProperty().EdgeVisibilityOn()
    actor.GetProperty().SetEdgeColor(0.25, 0.25, 0.28)
    actor.GetProperty().SetLineWidth(0.4)
    actor.GetProperty().SetAmbient(0.25)
    return actor


def discrete(count):
    table = vtkColorTransferFunction()
    for index in range(count):
        for edge in (-0.499, 0.499):
            table.AddRGBPoint(index + edge, *distinct(index))
    return table


def ramp(low, high, stops):
    table = vtkColorTransferFunction()
    for at, colour in stops:
        table.AddRGBPoint(low + at * (high - low), *colour)
    return table


WEIGHT_STOPS = [(0, (0.23, 0.30, 0.75)), (0.25, (0.55, 0.69, 0.99)), (0.5, (0.87, 0.87, 0.87)), (0.75, (0.96, 0.60, 0.48)),
                (1, (0.71, 0.02, 0.15))]


def tet_cuts(body, y, segment, height):
    """(suffix, picture) per colouring that the tets carry."""
    bounds = np.array(body.tets.GetBounds())
    low, high = bounds[0::2], bounds[1::2]
    y = (low[1] + high[1]) / 2 if y is None else y
    cells = body.tets.GetCellData()
    arrays = {cells.GetArrayName(i): vtk_to_numpy(cells.GetArray(i)) for i in range(cells.GetNumberOfArrays())}
    for name in ("label", "owner"):
        if name in arrays:
            values = arrays[name]
            colours = discrete(int(values.max()) + 1)
            yield f"tets_{name}", shoot([cut_actor(body.tets, values, y, colours)], "front", height, (low, high))
    for name in ("det_f",):
        if name in arrays:
            colours = ramp(0, 2, WEIGHT_STOPS)
            yield f"tets_{name}", shoot([cut_actor(body.tets, arrays[name], y, colours)], "front", height, (low, high))
    if body.weights:
        name = segment or body.segments[min(2, len(body.segments) - 1)]
        if name not in body.weights:
            raise SystemExit(f"error: --segment: no segment '{name}' (one of {', '.join(body.segments)})")
        corners = vtk_to_numpy(body.tets.GetCells().GetConnectivityArray()).reshape(-1, 4)
        values = body.weights[name][corners].mean(axis=1)
        yield f"tets_weight_{name}", shoot([cut_actor(body.tets, values, y, ramp(0, 1, WEIGHT_STOPS))], "front", height, (low, high))
