# SPDX-License-Identifier: Apache-2.0
"""Slices of volumes as pictures, without GL."""
import numpy as np

import annotate
from scene import Picture, distinct


def grey(plane, low, high):
    shade = np.clip((plane.astype(np.float32) - low) / max(high - low, 1e-6), 0, 1)
    return (255 * shade[..., None].repeat(3, axis=2)).astype(np.uint8)


def coloured(plane):
    table = np.array([(0.08, 0.08, 0.10)] + [distinct(i) for i in range(1, max(int(plane.max()), 0) + 2)])
    return (255 * table[plane.astype(np.int64)]).astype(np.uint8)


def stretched(image, height, pixel_mm, mm):
    """Nearest resampling to `pixel_mm`, so that anisotropic voxels keep their proportions."""
    rows = np.minimum((np.arange(int(image.shape[0] * mm[0] / pixel_mm)) * pixel_mm / mm[0]).astype(int), image.shape[0] - 1)
    columns = np.minimum((np.arange(int(image.shape[1] * mm[1] / pixel_mm)) * pixel_mm / mm[1]).astype(int), image.shape[1] - 1)
    out = image[rows][:, columns]
    frame = annotate.strip(out.shape[1], height)
    frame[: min(height, out.shape[0])] = out[:height]
    return frame


def three_planes(volume, height, title):
    """Coronal, sagittal and axial slices through the middle of what is not background, cut to it, side by side; superior, then anterior
    at the top. Labels with a legend of those that are seen."""
    voxels, mm = volume.voxels, volume.spacing
    low, high = (np.percentile(voxels[::4, ::2, ::2], (1, 99.7)) if not volume.labels else (0, 1))
    body = voxels > (low + 1 if not volume.labels else 0)
    occupied = [np.flatnonzero(body.any(axis=tuple(a for a in range(3) if a != axis))) for axis in range(3)]
    box = [slice(axis.min(), axis.max() + 1) if len(axis) else slice(0, size) for axis, size in zip(occupied, voxels.shape)]
    voxels, body = voxels[tuple(box)], body[tuple(box)]
    # Where most of the body is met.
    middle = [int(np.argmax(body.sum(axis=tuple(a for a in range(3) if a != axis)))) for axis in range(3)]
    planes = [("coronal", ("R", "L"), voxels[::-1, middle[1], :], (mm[2], mm[0])), ("sagittal", ("A", "P"), voxels[::-1, :, middle[2]], (mm[2], mm[1])),
              ("axial", ("R", "L"), voxels[middle[0], :, :], (mm[1], mm[0]))]
    pixel = voxels.shape[0] * mm[2] / height
    size = int(np.clip(height / 50, 11, 26))
    drawn = []
    for name, sides, plane, edges in planes:
        rgb = stretched(coloured(plane) if volume.labels else grey(plane, low, high), height, pixel, edges)
        annotate.put(rgb, name, size // 2, size // 2, size, (235, 235, 235))
        for x, side in zip((size // 2, rgb.shape[1] - 2 * size), sides):
            annotate.put(rgb, side, x, min(height // 2, int(plane.shape[0] * edges[0] / pixel / 2)), size, (235, 235, 235))
        drawn += [rgb, annotate.strip(8, height)]
    seen = sorted({int(v) for _, _, plane, _ in planes for v in np.unique(plane)} - {0}) if volume.labels else []
    legend = [(str(volume.names.get(v, f"label {v}")), coloured(np.array([[v]]))[0, 0] / 255) for v in seen]
    bar = None if volume.labels else ("grey value", float(low), float(high), lambda v: [np.clip((v - low) / max(high - low, 1e-6), 0, 1)] * 3)
    return Picture(annotate.image_of(annotate.annotated(np.concatenate(drawn[:-1], axis=1), title, legend=legend, bar=bar)))


def picture(rgb):
    return Picture(annotate.image_of(rgb))
