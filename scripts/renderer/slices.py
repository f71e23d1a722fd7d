# SPDX-License-Identifier: Apache-2.0
"""Slices of volumes as pictures, without GL."""
import numpy as np
from vtkmodules.util.numpy_support import numpy_to_vtk
from vtkmodules.vtkCommonDataModel import vtkImageData

from scene import Picture, distinct


def grey(plane, low, high):
    shade = np.clip((plane.astype(np.float32) - low) / max(high - low, 1e-6), 0, 1)
    return (255 * shade[..., None].repeat(3, axis=2)).astype(np.uint8)


def coloured(plane):
    table = np.array([(0.08, 0.08, 0.10)] + [distinct(i) for i in range(1, int(plane.max()) + 2)])
    return (255 * table[plane.astype(np.int64)]).astype(np.uint8)


def stretched(image, height, pixel_mm, mm):
    """Nearest resampling to `pixel_mm`, so that anisotropic voxels keep their proportions."""
    rows = np.minimum((np.arange(int(image.shape[0] * mm[0] / pixel_mm)) * pixel_mm / mm[0]).astype(int), image.shape[0] - 1)
    columns = np.minimum((np.arange(int(image.shape[1] * mm[1] / pixel_mm)) * pixel_mm / mm[1]).astype(int), image.shape[1] - 1)
    out = image[rows][:, columns]
    frame = np.full((height, out.shape[1], 3), 20, np.uint8)
    frame[: min(height, out.shape[0])] = out[:height]
    return frame


def three_planes(volume, height):
    """Coronal and sagittal slices through the middle of what is not background, side by side; superior at the top."""
    voxels, mm = volume.voxels, volume.spacing
    low, high = (np.percentile(voxels[::4, ::2, ::2], (1, 99.7)) if not volume.labels else (0, 1))
    body = voxels > (low + 1 if not volume.labels else 0)
    occupied = [np.flatnonzero(body.any(axis=tuple(a for a in range(3) if a != axis))) for axis in range(3)]
    middle = [int(axis.mean()) if len(axis) else size // 2 for axis, size in zip(occupied, voxels.shape)]
    planes = [(voxels[::-1, middle[1], :], (mm[2], mm[0])), (voxels[::-1, :, middle[2]], (mm[2], mm[1]))]
    pixel = voxels.shape[0] * mm[2] / height
    drawn = [stretched(coloured(p) if volume.labels else grey(p, low, high), height, pixel, m) for p, m in planes]
    gap = np.full((height, 8, 3), 247, np.uint8)
    return picture(np.concatenate([drawn[0], gap, drawn[1]], axis=1))


def picture(rgb):
    image = vtkImageData()
    image.SetDimensions(rgb.shape[1], rgb.shape[0], 1)
    scalars = numpy_to_vtk(np.ascontiguousarray(rgb[::-1].reshape(-1, 3)), deep=True)
    image.GetPointData().SetScalars(scalars)
    return Picture(image)
