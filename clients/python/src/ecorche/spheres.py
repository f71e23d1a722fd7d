# SPDX-License-Identifier: Apache-2.0
"""Objects as balls: volumetric skeletons."""
import ctypes

import numpy as np
import numpy.typing as npt

from ._library import InvalidArgument, SpheresInfo, ask, call
from .model import Grid, Model, view


class SpheresHandle(ctypes.c_void_p):
    """The library's spheres, which views of them keep."""

    def __del__(self) -> None:
        if self:
            ask("spheres_destroy", self)


class Spheres:
    """An object as the balls around a few of its voxels (its volumetric skeleton), each hung on a segment. Never changes. Model.spheres()
    and Model.thin() make them, Body.refill() poses volumes by them."""
    model: Model
    grid: Grid  # of the voxels that were thinned
    thinness: float  # that they were thinned at, voxels
    voxels: npt.NDArray[np.uint16]  # (N, 3) i, j, k of the centres
    radii: npt.NDArray[np.float32]  # (N,) mm: a ball holds what is nearer to its centre
    segments: npt.NDArray[np.int32]  # (N,) rows of model.segments

    @classmethod
    def _made(cls, model: Model, function: str, *arguments: object) -> "Spheres":
        out = cls()
        out.model, out._handle = model, SpheresHandle()
        call(function, *arguments, ctypes.byref(out._handle))
        info = SpheresInfo()
        call("spheres_describe", out._handle, ctypes.byref(info))
        out.grid, out.thinness = Grid._of(info.grid), info.thinness
        out.voxels = view(info.voxels, (info.count, 3), out._handle)
        out.radii = view(info.radii, (info.count,), out._handle)
        out.segments = view(info.segments, (info.count,), out._handle)
        return out

    _handle: SpheresHandle

    def __len__(self) -> int:
        return len(self.radii)

    def __repr__(self) -> str:
        return f"<ecorche.Spheres: {len(self)} balls of {self.model.name}>"

    def thinner(self, thinness: float) -> "Spheres":
        """What thinning at a higher thinness would have left."""
        return Spheres._made(self.model, "spheres_thinner", self._handle, thinness)

    def hung(self, segments: npt.ArrayLike) -> "Spheres":
        """The same balls on other segments: (N,) rows of model.segments."""
        rows = np.asarray(segments)
        if rows.shape != (len(self),) or not np.issubdtype(rows.dtype, np.integer):
            raise InvalidArgument(f"segments: have the shape {rows.shape} and are {rows.dtype} (give {len(self)} rows)")
        rows = np.ascontiguousarray(np.clip(rows, -1, 2**31 - 1), np.int32)
        return Spheres._made(self.model, "spheres_hang", self._handle, rows.ctypes.data, len(rows))
