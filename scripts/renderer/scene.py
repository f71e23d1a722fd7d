# SPDX-License-Identifier: Apache-2.0
"""Off-screen drawings of surfaces and tets."""
import colorsys
import hashlib

import numpy as np
from vtkmodules.util.numpy_support import numpy_to_vtk, vtk_to_numpy
import vtkmodules.vtkRenderingOpenGL2  # noqa: F401  (chooses the drawing back end)
from vtkmodules.vtkCommonCore import vtkIdList
from vtkmodules.vtkFiltersCore import vtkPolyDataNormals
from vtkmodules.vtkFiltersExtraction import vtkExtractCells
from vtkmodules.vtkFiltersGeometry import vtkGeometryFilter
from vtkmodules.vtkIOImage import vtkPNGWriter
from vtkmodules.vtkRenderingCore import (vtkActor, vtkColorTransferFunction, vtkLight, vtkPolyDataMapper, vtkRenderer,
                                         vtkRenderWindow, vtkTextActor, vtkWindowToImageFilter)

import annotate

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
VIEWS = {"front": ((0, -1, 0), (0, 0, 1)), "side": ((1, 0, 0), (0, 0, 1)), "oblique": ((0.6, -0.75, 0.25), (0, 0, 1)),
         "feet": ((0, 0, -1), (0, -1, 0))}
SEEN = {"front": "from the front", "side": "from the left", "oblique": "from the front and left", "feet": "from the feet"}
# Of a cut: its axis, the view that it is seen from, the side that stays (+1: the larger coordinates).
PLANES = {"coronal": (1, "front", 1), "sagittal": (0, "side", -1), "axial": (2, "feet", 1)}


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


def seen_through(body):
    """Skin translucent over everything else."""
    return [surface_actor(t.surface, colour_of(t), 0.28 if t.group == "skin" else 1.0) for t in body.tissues]


def translucent(body, view, height):
    groups = [group for group in GROUP_COLOURS if any(t.group == group for t in body.tissues)]
    return Picture(annotate.image_of(annotate.annotated(annotate.pixels(shoot(seen_through(body), view, height).image), f"{body.name}, {SEEN[view]}", view,
                                                        legend=[(group, GROUP_COLOURS[group]) for group in groups])))


def around(body, view, height, centre, radius):
    """What lies about a place, without words: a picture that does not say how it was made."""
    return shoot(seen_through(body), view, height, (np.array(centre) - radius, np.array(centre) + radius))


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


def bone_sheet(centres, bone, cell_mm=20.0):
    """How far back (y, mm) the bones lie at each place of the front view: a sheet through all of them, smooth between. `centres`: of
    the tets in the scan, #T by 3; `bone`: which of them are of bone. Returns the sheet's y for every tet."""
    low = centres[:, [0, 2]].min(axis=0)
    at = ((centres[:, [0, 2]] - low) / cell_mm).astype(int)
    shape = at.max(axis=0) + 1
    total, count = np.zeros(shape), np.zeros(shape)
    np.add.at(total, tuple(at[bone].T), centres[bone, 1])
    np.add.at(count, tuple(at[bone].T), 1.0)
    for _ in range(200):  # fills what has no bone from its neighbours, a cell a round
        if (count > 0).all():
            break
        padded = [np.pad(a, 1) for a in (total, count)]
        spread = [sum(a[1 + i: a.shape[0] - 1 + i, 1 + k: a.shape[1] - 1 + k] for i in (-1, 0, 1) for k in (-1, 0, 1)) for a in padded]
        new = (count == 0) & (spread[1] > 0)
        total[new], count[new] = spread[0][new] / spread[1][new], 1.0
    y = total / np.maximum(count, 1e-9)
    for _ in range(2):
        padded = np.pad(y, 1, mode="edge")
        y = sum(padded[1 + i: padded.shape[0] - 1 + i, 1 + k: padded.shape[1] - 1 + k] for i in (-1, 0, 1) for k in (-1, 0, 1)) / 9
    return y[tuple(at.T)]


def cut_actor(grid, values, behind, colours):
    """The tets that lie `behind` the cut (so says a flag each), whole, so that their shape shows; coloured per tet."""
    array = numpy_to_vtk(np.ascontiguousarray(values, np.float64), deep=True)
    array.SetName("shown")
    grid.GetCellData().SetScalars(array)
    half = vtkExtractCells()
    half.SetInputData(grid)
    chosen = vtkIdList()
    rows = np.flatnonzero(behind)
    chosen.SetNumberOfIds(len(rows))
    for place, row in enumerate(rows):
        chosen.SetId(place, int(row))
    half.SetCellList(chosen)
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


def discrete(count, colours=None):
    """One colour a whole number."""
    table = vtkColorTransferFunction()
    for index in range(count):
        for edge in (-0.499, 0.499):
            table.AddRGBPoint(index + edge, *(colours[index] if colours else distinct(index)))
    return table


def paired(names):
    """A colour for each name, the same for both sides of one thing: `thigh_left`, `thigh_right`."""
    kinds = {}
    return [distinct(1 + kinds.setdefault(name.removesuffix("_left").removesuffix("_right"), len(kinds))) for name in names]


def ramp(low, high, stops):
    table = vtkColorTransferFunction()
    for at, colour in stops:
        table.AddRGBPoint(low + at * (high - low), *colour)
    return table


WEIGHT_STOPS = [(0, (0.23, 0.30, 0.75)), (0.25, (0.55, 0.69, 0.99)), (0.5, (0.87, 0.87, 0.87)), (0.75, (0.96, 0.60, 0.48)),
                (1, (0.71, 0.02, 0.15))]


def legend_of(names, colours, shown):
    """[(name, colour)] of what is shown; two sides as one."""
    entries = {}
    for index in sorted(shown):
        name = names[index].removesuffix("_left").removesuffix("_right")
        entries.setdefault(name if names[index] == name else name + " (both sides)", colours[index])
    return list(entries.items())


def tet_cuts(body, plane, at, segment, height):
    """(suffix, picture) per colouring that the tets carry. A coronal cut goes through the bones as they lie in the scan, so that it meets
    every joint in every pose; the others, and with `at` this one too, are planes of the scan: at that coordinate, or in the middle."""
    corners = vtk_to_numpy(body.tets.GetCells().GetConnectivityArray()).reshape(-1, 4)
    points = vtk_to_numpy(body.tets.GetPoints().GetData()).astype(float)
    moved = body.tets.GetPointData().GetArray("displacement")
    rest = points - vtk_to_numpy(moved) if moved else points
    centres = rest[corners].mean(axis=1)
    cells = body.tets.GetCellData()
    arrays = {cells.GetArrayName(i): vtk_to_numpy(cells.GetArray(i)) for i in range(cells.GetNumberOfArrays())}
    bone = arrays["label"] > 0 if "label" in arrays else np.zeros(len(corners), bool)
    axis, view, side = PLANES[plane]
    if plane == "coronal" and at is None and bone.any():
        behind, where = centres[:, 1] > bone_sheet(centres, bone), "cut through the bones"
    else:
        at = (centres[:, axis].min() + centres[:, axis].max()) / 2 if at is None else at
        behind, where = side * centres[:, axis] > side * at, f"cut at {'xyz'[axis]} = {at:.0f} mm"
    where += f", seen {SEEN[view]}"

    def shot(values, colours):
        return shoot([cut_actor(body.tets, values, behind, colours)], view, height)

    def picture(values, colours, title, **more):
        return Picture(annotate.image_of(annotate.annotated(annotate.pixels(shot(values, colours).image), f"{body.name}: {title}, {where}", view,
                                                            **more)))

    if "label" in arrays:
        values = arrays["label"]
        names = ["soft tissue"] + [(body.bones or [])[i] if i < len(body.bones or []) else f"bone {i + 1}" for i in range(int(values.max()))]
        colours = [distinct(0)] + paired(names[1:])
        yield "tets_label", picture(values, discrete(len(names), colours), "tets by bone",
                                    legend=legend_of(names, colours, set(np.unique(values[behind]).astype(int))))
    if "owner" in arrays and body.segments:
        values, colours = arrays["owner"], paired(body.segments)
        yield "tets_owner", picture(values, discrete(len(colours), colours), "tets by the segment of the largest weight",
                                    legend=legend_of(body.segments, colours, set(np.unique(values[behind]).astype(int))))
    if "det_f" in arrays:
        colours = ramp(0, 2, WEIGHT_STOPS)
        yield "tets_det_f", picture(arrays["det_f"], colours, "change of volume",
                                    bar=("det F: 1 unchanged, below 0 inverted (shown as 0)", 0, 2, colours.GetColor))
    if body.weights:
        name = segment or body.segments[min(2, len(body.segments) - 1)]
        if name not in body.weights:
            raise SystemExit(f"error: --segment: no segment '{name}' (one of {', '.join(body.segments)})")
        colours = ramp(0, 1, WEIGHT_STOPS)
        yield f"tets_weight_{name}", picture(body.weights[name][corners].mean(axis=1), colours, f"weight of {name}",
                                             bar=(f"skinning weight of {name}", 0, 1, colours.GetColor))
