# SPDX-License-Identifier: Apache-2.0
"""Posed bodies."""
import ctypes
import math
from dataclasses import dataclass
from typing import Optional, Sequence, Union

import numpy as np
import numpy.typing as npt

from ._library import BodyOptions, GridInfo, InvalidArgument, ProbedInfo, QualityInfo, ReasonInfo, ask, call
from .model import Grid, Model, Pose, Volume, numbers, view, voxel_shape
from .spheres import Spheres

SKINNING = {"lbs": 0, "dqs": 1, "cor": 2}
SPACES = {"lps": 0, "unity": 1, "unreal": 2, "gltf": 3, "ros": 4, "ras": 5}


@dataclass(frozen=True)
class Reason:
    """A figure beyond its threshold."""
    figure: str
    name: str  # of the tissue or the joint, or ""
    value: float
    threshold: float


@dataclass(frozen=True)
class Quality:
    """How far a pose can be believed."""
    passes: bool
    reasons: list[Reason]  # why it does not
    inverted_tets: int
    inverted_share: float  # of the volume
    min_det_f: float  # least posed over rest volume of a tet
    volume_change: float  # share
    bone_rigidity: float  # mm
    bone_overlap: float  # mm: how much deeper than in the scan a bone lies in another; NaN: a server that has just started has not looked yet


@dataclass(frozen=True)
class Probed:
    """What is at points, a row for each; outside of the body NaN, -1 and None."""
    points: npt.NDArray[np.float32]  # (P, 3) on the other side, LPS mm
    tets: npt.NDArray[np.int32]  # (P,)
    tissues: list[Optional[str]]  # the innermost closed tissue that holds the point
    gradients: npt.NDArray[np.float32]  # (P, 3, 3) d posed / d rest
    values: Optional[npt.NDArray[np.float64]]  # (P, components) of the volume that was asked for


class Body:
    """A posed body and its buffers; for one thread at a time. At first as scanned."""

    def __init__(self, model: Model, *, normals: bool = True, threads: int = 0) -> None:
        """`threads`: that pose it; 0: one a processor."""
        self.model = model
        self._handle = ctypes.c_void_p()
        options = BodyOptions(normals=int(normals), threads=threads)
        call("body_create", model._handle, ctypes.byref(options), ctypes.byref(self._handle))

    def __del__(self) -> None:
        if getattr(self, "_handle", None):
            ask("body_destroy", self._handle)

    def update(self, pose: Pose, *, skinning: str = "cor", tissues: Optional[Sequence[Union[str, int]]] = None) -> "Body":
        """Poses all tissues, or those named. `skinning`: lbs, dqs or cor. Limits and couplings of joints are kept."""
        if skinning not in SKINNING:
            raise InvalidArgument(f"skinning: {skinning} is none of {', '.join(SKINNING)}")
        rows = None if tissues is None else np.array(sorted({self.model.tissue(name).row for name in tissues}), np.uint32)
        call("body_update", self._handle, pose._handle, SKINNING[skinning], None if rows is None else rows.ctypes.data, 0 if rows is None else len(rows))
        return self

    def positions(self, tissue: Union[str, int] = 0) -> npt.NDArray[np.float32]:
        """(V, 3), LPS mm: the body's own memory, which the next update writes; read-only. Copy what is to stay."""
        found = self.model.tissue(tissue)
        pointer = ask("body_positions", self._handle, found.row)
        if not pointer:
            raise InvalidArgument(f"{found.name}: the last update did not pose it (name it there)")
        return view(pointer, found.rest.shape, self)

    def normals(self, tissue: Union[str, int] = 0) -> npt.NDArray[np.int16]:
        """(V, 3), unit vectors in 32767ths; as positions()."""
        found = self.model.tissue(tissue)
        pointer = ask("body_normals", self._handle, found.row)
        if not pointer:
            raise InvalidArgument(f"{found.name}: has no normals (the last update did not pose it, or Body was made without)")
        return view(pointer, found.rest.shape, self)

    def copy(self, tissue: Union[str, int] = 0, space: str = "lps") -> npt.NDArray[np.float32]:
        """(V, 3), in the axes and units of lps, ras (mm), unity, gltf, ros (m) or unreal (cm)."""
        if space not in SPACES:
            raise InvalidArgument(f"space: {space} is none of {', '.join(SPACES)}")
        found = self.model.tissue(tissue)
        out = np.empty(found.rest.shape, np.float32)
        call("body_copy", self._handle, found.row, SPACES[space], out.ctypes.data, 0, None, 0, len(out))
        return out

    def motion(self, segment: Union[str, int]) -> npt.NDArray[np.float64]:
        """(3, 4): the motion of a segment from the scan, LPS mm."""
        out = (ctypes.c_double * 12)()
        call("body_motion", self._handle, self.model.segment(segment).row, out)
        return np.array(out).reshape(3, 4)

    @property
    def clamped(self) -> dict[str, float]:
        """Joints whose limits took something away: degrees between what was asked and what was done."""
        out = {}
        for row in range(ask("body_clamped_count", self._handle)):
            segment, removed = ctypes.c_uint32(), ctypes.c_double()
            call("body_clamped", self._handle, row, ctypes.byref(segment), ctypes.byref(removed))
            out[self.model.segments[segment.value].joint] = math.degrees(removed.value)
        return out

    def measure(self, *, sampled: bool = False) -> Quality:
        """Of the last update; `sampled`: on some of the tets, in a fraction of a frame."""
        info = QualityInfo()
        call("body_measure", self._handle, int(sampled), ctypes.byref(info))
        reasons = []
        for row in range(info.reason_count):
            reason = ReasonInfo()
            call("body_reason", self._handle, row, ctypes.byref(reason))
            reasons.append(Reason(reason.figure.decode(), reason.name.decode(), reason.value, reason.threshold))
        return Quality(bool(info.passes), reasons, info.inverted_tets, info.inverted_share, info.min_det_f, info.volume_change, info.bone_rigidity,
                       info.bone_overlap)

    def volume(self, name: Union[str, int] = 0, grid: Optional[Grid] = None, *, nearest: bool = False) -> tuple[np.ndarray, Grid]:
        """The posed volume, (k, j, i) or (k, j, i, components), and its grid: `grid`, or the scan's own grown until it holds the body."""
        found = self.model.volume(name)
        if grid is None:
            info = GridInfo()
            call("body_volume_grid", self._handle, found.row, ctypes.byref(info))
            grid = Grid._of(info)
        out = _voxels(found, grid)
        call("body_volume", self._handle, found.row, ctypes.byref(grid._info()), int(nearest), out.ctypes.data, out.nbytes)
        return out, grid

    def refill(self, spheres: Spheres, volume: Union[str, int] = 0, grid: Optional[Grid] = None, *,
               region: Optional[npt.ArrayLike] = None, nearest: bool = False) -> tuple[np.ndarray, Grid]:
        """The posed volume by balls, beside volume(), which does it by tets: the whole, or what lies in `region` (the low and the high corner,
        6 numbers, LPS mm), or on `grid`, a part of that lattice or a slice (one voxel thick along k)."""
        found = self.model.volume(volume)
        if grid is None:
            info = GridInfo()
            call("body_refill_grid", self._handle, spheres._handle, found.row, None if region is None else numbers("region", region, 6),
                 ctypes.byref(info))
            grid = Grid._of(info)
        elif region is not None:
            raise InvalidArgument("region: there is a grid as well (give one of both)")
        out = _voxels(found, grid)
        call("body_refill", self._handle, spheres._handle, found.row, ctypes.byref(grid._info()), int(nearest), out.ctypes.data, out.nbytes)
        return out, grid

    def to_rest(self, points: npt.ArrayLike, volume: Optional[Union[str, int]] = None) -> Probed:
        """Points of the posed body, (P, 3): where they were in the scan, and what is there."""
        return self._probe("body_posed_to_rest", points, volume)

    def to_posed(self, points: npt.ArrayLike, volume: Optional[Union[str, int]] = None) -> Probed:
        """Points of the scan, (P, 3): where they went."""
        return self._probe("body_rest_to_posed", points, volume)

    def _probe(self, function: str, points: npt.ArrayLike, volume: Optional[Union[str, int]]) -> Probed:
        asked = np.ascontiguousarray(points, np.float32)
        if asked.ndim != 2 or asked.shape[1] != 3:
            raise InvalidArgument(f"points: have the shape {asked.shape} (give (P, 3), LPS mm)")
        count = len(asked)
        there, gradients = np.empty((count, 3), np.float32), np.empty((count, 3, 3), np.float32)
        tets, tissues = np.empty(count, np.int32), np.empty(count, np.int32)
        values, row = None, 0
        if volume is not None:
            found = self.model.volume(volume)
            row, values = found.row, np.empty((count, found.components), np.float64)
        out = ProbedInfo(points=there.ctypes.data, tets=tets.ctypes.data, tissues=tissues.ctypes.data, gradients=gradients.ctypes.data,
                         values=None if values is None else values.ctypes.data, volume=row)
        call(function, self._handle, asked.ctypes.data, count, ctypes.byref(out))
        return Probed(there, tets, [self.model.tissues[t].name if t >= 0 else None for t in tissues], gradients, values)


def _voxels(volume: Volume, grid: Grid) -> np.ndarray:
    """Room for those of a grid."""
    if min(grid.size) < 1 or np.prod([float(n) for n in grid.size]) > 2**31:
        raise InvalidArgument(f"grid: {grid.size} voxels are none, or more than 2^31 (ask for a part)")
    return np.empty(voxel_shape(grid, volume.components), volume.rest.dtype)
