# SPDX-License-Identifier: Apache-2.0
"""Volumes rendered off-screen by ray casting on the processor, and pictures in a row as one animated PNG."""
import struct
import zlib

import numpy as np
from vtkmodules.util.numpy_support import numpy_to_vtk, vtk_to_numpy
from vtkmodules.vtkCommonDataModel import vtkImageData, vtkPiecewiseFunction
from vtkmodules.vtkRenderingCore import vtkColorTransferFunction, vtkLight, vtkRenderer, vtkRenderWindow, vtkVolume, vtkVolumeProperty, vtkWindowToImageFilter
import vtkmodules.vtkRenderingOpenGL2  # noqa: F401
from vtkmodules.vtkRenderingVolume import vtkFixedPointVolumeRayCastMapper
import vtkmodules.vtkRenderingVolumeOpenGL2  # noqa: F401

import bodies
from scene import BACKGROUND, VIEWS, distinct


def property_for(voxels, grey):
    """Labels (bytes, unless they are said to be grey): flesh thin, the rest solid in colours of their own. Grey values: a thin haze
    over everything that is not the least value, solid towards the largest."""
    look, colour, opacity = vtkVolumeProperty(), vtkColorTransferFunction(), vtkPiecewiseFunction()
    labels = voxels.dtype == np.uint8 and not grey
    low, high = float(voxels.min()), float(np.percentile(voxels, 99.9))
    if labels:
        for value in range(int(voxels.max()) + 1):
            colour.AddRGBPoint(value, *distinct(max(value - 1, 0)))
        opacity.AddPoint(0, 0)
        opacity.AddPoint(1, 0.02)
        opacity.AddPoint(2, 0.5)
        look.SetInterpolationTypeToNearest()
    else:
        for at, shade in ((0, (0.85, 0.55, 0.45)), (0.45, (0.80, 0.52, 0.42)), (0.7, (0.95, 0.88, 0.75)), (1, (1, 1, 0.97))):
            colour.AddRGBPoint(low + at * (high - low), *shade)
        for at, much in ((0, 0), (0.25, 0), (0.42, 0.02), (0.55, 0.03), (0.72, 0.35), (1, 0.8)):
            opacity.AddPoint(low + at * (high - low), much)
        look.SetInterpolationTypeToLinear()
        look.ShadeOn()
        # Within flesh of one grey there is no surface to be lit: by what is scattered alone it would be black (see `light`).
        look.SetAmbient(0.5)
        look.SetDiffuse(0.55)
    look.SetColor(colour)
    look.SetScalarOpacity(opacity)
    return look


def placed(voxels, spacing, origin):
    image = vtkImageData()
    image.SetDimensions(*voxels.shape[::-1])
    image.SetSpacing(*spacing)
    image.SetOrigin(*origin)
    image.GetPointData().SetScalars(numpy_to_vtk(np.ascontiguousarray(voxels).reshape(-1), deep=True))
    return image


def shot(image, look, bounds, view, height):
    """RGB rows, top first, of one volume fitted to `bounds`, parallel projection."""
    mapper, volume = vtkFixedPointVolumeRayCastMapper(), vtkVolume()
    mapper.SetInputData(image)
    mapper.AutoAdjustSampleDistancesOff()  # a slow machine shows the same
    mapper.SetSampleDistance(0.5 * min(image.GetSpacing()))
    volume.SetMapper(mapper)
    volume.SetProperty(look)
    direction, up = (np.array(v, float) for v in VIEWS[view])
    direction /= np.linalg.norm(direction)
    right = np.cross(up, direction)
    right /= np.linalg.norm(right)
    low, high = bounds
    middle, size = (low + high) / 2, high - low
    tall, wide = (1.04 * np.abs(axis) @ size for axis in (np.cross(direction, right), right))
    renderer, window = vtkRenderer(), vtkRenderWindow()
    renderer.SetBackground(*BACKGROUND)
    renderer.AddVolume(volume)
    light = vtkLight()
    light.SetLightTypeToHeadlight()
    light.SetAmbientColor(1, 1, 1)  # black, unless one says so
    renderer.AddLight(light)
    window.SetOffScreenRendering(1)
    window.SetSize(max(int(height * wide / tall), 16), height)
    window.AddRenderer(renderer)
    camera = renderer.GetActiveCamera()
    camera.ParallelProjectionOn()
    camera.SetParallelScale(tall / 2)
    camera.SetFocalPoint(*middle)
    camera.SetPosition(*(middle + 3 * np.linalg.norm(size) * direction))
    camera.SetViewUp(*up)
    renderer.ResetCameraClippingRange()
    window.Render()
    grab = vtkWindowToImageFilter()
    grab.SetInput(window)
    grab.ReadFrontBufferOff()
    grab.Update()
    out = grab.GetOutput()
    columns, rows, _ = out.GetDimensions()
    return vtk_to_numpy(out.GetPointData().GetScalars()).reshape(rows, columns, -1)[::-1, :, :3].copy()


def rendered(paths, view, height, grey=False):
    """A picture of each volume, all through one window on space."""
    read = [bodies.read_placed_image(path) for path in paths]
    if any(voxels is None for voxels, _, _ in read):
        raise SystemExit("error: render: a volume must have one value a voxel (name other images)")
    low = np.min([origin for _, _, origin in read], axis=0)
    high = np.max([origin + spacing * (np.array(voxels.shape[::-1]) - 1) for voxels, spacing, origin in read], axis=0)
    look = property_for(read[0][0], grey)
    return [shot(placed(*one), look, (low, high), view, height) for one in read]


def chunk(kind, data):
    return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))


def animated(frames, path, milliseconds=80):
    """An animated PNG (the APNG extension: acTL, fcTL, fdAT), which browsers play; every frame as large as the first."""
    rows, columns, _ = frames[0].shape
    packed = [zlib.compress(np.concatenate([np.zeros((rows, 1), np.uint8), frame.reshape(rows, -1)], axis=1).tobytes(), 6) for frame in frames]
    out = b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", struct.pack(">IIBBBBB", columns, rows, 8, 2, 0, 0, 0))
    out += chunk(b"acTL", struct.pack(">II", len(frames), 0))
    number = 0
    for index, data in enumerate(packed):
        out += chunk(b"fcTL", struct.pack(">IIIIIHHBB", number, columns, rows, 0, 0, milliseconds, 1000, 0, 0))
        number += 1
        if index == 0:
            out += chunk(b"IDAT", data)
        else:
            out += chunk(b"fdAT", struct.pack(">I", number) + data)
            number += 1
    path.write_bytes(out + chunk(b"IEND", b""))
    return path
