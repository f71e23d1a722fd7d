# SPDX-License-Identifier: Apache-2.0
"""What tells a reader what a picture shows: a title, the body's sides, a legend or a colour bar. On plain RGB, without GL."""
import numpy as np
from vtkmodules.util.numpy_support import numpy_to_vtk, vtk_to_numpy
import vtkmodules.vtkRenderingFreeType  # noqa: F401  (draws the words)
from vtkmodules.vtkCommonDataModel import vtkImageData
from vtkmodules.vtkRenderingCore import vtkTextProperty, vtkTextRenderer

PAPER, INK = (247, 247, 245), np.array((38, 38, 46), float)
# What lies at the left and the right edge of a picture seen from a view: the patient's sides.
SIDES = {"front": ("R", "L"), "side": ("A", "P"), "oblique": ("R", "L"), "feet": ("R", "L")}


def pixels(image):
    """#rows by #columns by 3, the top row first."""
    columns, rows, _ = image.GetDimensions()
    return vtk_to_numpy(image.GetPointData().GetScalars()).reshape(rows, columns, -1)[::-1, :, :3].copy()


def image_of(rgb):
    image = vtkImageData()
    image.SetDimensions(rgb.shape[1], rgb.shape[0], 1)
    image.GetPointData().SetScalars(numpy_to_vtk(np.ascontiguousarray(rgb[::-1].reshape(-1, 3)), deep=True))
    return image


def word(text, size):
    """How much ink each pixel of `text` has, 0 to 1."""
    look = vtkTextProperty()
    look.SetFontSize(size)
    look.SetColor(1, 1, 1)
    image, extent = vtkImageData(), [0, 0]
    vtkTextRenderer.GetInstance().RenderString(look, text, image, extent, 72)
    columns, rows, _ = image.GetDimensions()
    rgba = vtk_to_numpy(image.GetPointData().GetScalars()).reshape(rows, columns, 4)
    return rgba[: extent[1], : extent[0], 3][::-1] / 255.0


def put(rgb, text, x, y, size, colour=INK):
    """Writes `text` with its upper left corner at (x, y), cut off at the picture's edge."""
    ink = word(text, size)[: max(rgb.shape[0] - y, 0), : max(rgb.shape[1] - x, 0), None]
    part = rgb[y: y + ink.shape[0], x: x + ink.shape[1]]
    part[:] = (part * (1 - ink) + np.asarray(colour, float) * ink).astype(np.uint8)


def strip(columns, rows):
    return np.full((rows, columns, 3), PAPER, np.uint8)


def legend_rows(entries, columns, size):
    """Squares of colour with their names, as many beside each other as fit."""
    step = int(1.7 * size)
    widths = [word(name, size).shape[1] + 2 * step for name, _ in entries]
    column = max(widths)
    beside = max(1, columns // column)
    out = strip(max(columns, column), step * -(-len(entries) // beside) + size // 2)
    for index, (name, colour) in enumerate(entries):
        x, y = (index % beside) * column + size // 2, (index // beside) * step + size // 4
        out[y: y + size, x: x + size] = (255 * np.asarray(colour)).astype(np.uint8)
        put(out, name, x + int(1.4 * size), y, size)
    return out


def bar_rows(label, low, high, colour_at, columns, size):
    """A colour bar; `colour_at(value)` gives RGB, 0 to 1."""
    out = strip(columns, int(3.6 * size))
    left, right = size, max(columns - size, size + 2)
    for x in range(left, right):
        value = low + (high - low) * (x - left) / (right - left)
        out[size // 2: int(1.4 * size), x] = (255 * np.asarray(colour_at(value))).astype(np.uint8)
    for value in np.linspace(low, high, 5):
        text = f"{value:g}"
        at = left + int((right - left) * (value - low) / (high - low)) - word(text, size).shape[1] // 2
        put(out, text, int(np.clip(at, 0, columns - word(text, size).shape[1])), int(1.5 * size), size)
    put(out, label, left, int(2.55 * size), size)
    return out


def folded(text, columns, size):
    """Lines of `text` that fit into `columns`, as far as its words allow."""
    lines = [""]
    for part in text.split():
        longer = f"{lines[-1]} {part}".strip()
        if lines[-1] and word(longer, size).shape[1] > columns:
            lines.append(part)
        else:
            lines[-1] = longer
    return lines


def centred(row, columns):
    """`row` in the middle of a strip of paper."""
    out = strip(columns, row.shape[0])
    left = (columns - row.shape[1]) // 2
    out[:, left: left + row.shape[1]] = row
    return out


def beside(pictures, titles, view):
    """Pictures of one height side by side, each below its title, with room for the letters of its sides."""
    wide = max(rgb.shape[1] for rgb in pictures) + pictures[0].shape[0] // 10
    done = [annotated(centred(rgb, wide), title, view) for rgb, title in zip(pictures, titles)]
    rows = max(one.shape[0] for one in done)
    return np.concatenate([np.concatenate([strip(one.shape[1], rows - one.shape[0]), one]) for one in done], axis=1)


def annotated(rgb, title, view=None, legend=(), bar=None, dark=False):
    """`rgb` below its title, with the sides of `view` at its edges and a legend [(name, colour)] or a bar (label, low, high, colour_at)
    below. `dark`: the picture is, so that letters on it are light."""
    size = int(np.clip(rgb.shape[0] / 50, 11, 26))
    rgb = rgb.copy()
    if view in SIDES:
        colour = (235, 235, 235) if dark else INK
        for side, text in zip((0, 1), SIDES[view]):
            big = int(1.4 * size)
            put(rgb, text, size // 2 if side == 0 else rgb.shape[1] - size // 2 - word(text, big).shape[1], rgb.shape[0] // 2, big, colour)
    columns = max(rgb.shape[1], 32 * size)  # a narrow picture stands in the middle of its words
    lines = folded(title, columns - size, size)
    rows = [strip(columns, int(1.5 * size) * len(lines) + size // 2)]
    for number, text in enumerate(lines):
        put(rows[0], text, (columns - word(text, size).shape[1]) // 2, int(1.5 * size) * number + size // 2, size)
    rows.append(rgb)
    if legend:
        rows.append(legend_rows(legend, columns, size))
    if bar:
        rows.append(bar_rows(*bar, columns, size))
    columns = max(row.shape[1] for row in rows)
    return np.concatenate([centred(row, columns) for row in rows])
