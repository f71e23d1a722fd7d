# SPDX-License-Identifier: Apache-2.0
"""Prepared bodies, and poses of them."""
import ctypes
import math
import os
from dataclasses import dataclass
from typing import TYPE_CHECKING, Mapping, Optional, Sequence, Union

import numpy as np
import numpy.typing as npt

from ._library import AngleInfo, GridInfo, InvalidArgument, NotFound, SegmentInfo, TissueInfo, VolumeInfo, ask, call, text

if TYPE_CHECKING:
    from .body import Body
    from .spheres import Spheres

SCALARS = (np.uint8, np.int8, np.uint16, np.int16, np.uint32, np.int32, np.float32, np.float64)
Angles = Mapping[str, float]


def view(pointer, shape, owner) -> np.ndarray:
    """The library's memory as it stands, read-only; `owner` is kept as long as the view is."""
    count = int(np.prod(shape))
    if count == 0:
        return np.empty(shape, np.ctypeslib.as_array((pointer._type_ * 1)()).dtype)
    block = ctypes.cast(pointer, ctypes.POINTER(pointer._type_ * count)).contents
    block.owner = owner
    out = np.frombuffer(block, dtype=np.dtype(pointer._type_)).reshape(shape)
    out.flags.writeable = False
    return out


def numbers(what: str, values: npt.ArrayLike, count: int) -> ctypes.Array:
    """Exactly so many, for the library: ctypes would fill up with zeros."""
    given = np.asarray(values, float)
    if given.shape != (count,):
        raise InvalidArgument(f"{what}: has the shape {given.shape} (give {count} numbers)")
    return (ctypes.c_double * count)(*given)


@dataclass(frozen=True)
class Tissue:
    """A surface: skin, bone, organ."""
    row: int
    name: str
    group: str  # skin, bone, muscle, organ, vessel, nerve, cartilage, ligament, fat or other
    triangles: npt.NDArray[np.uint32]  # (F, 3) rows of vertices, counter-clockwise seen from outside
    rest: npt.NDArray[np.float32]  # (V, 3) as scanned, LPS mm; NaN of a server's, which does not tell
    segment: Optional[str]  # that a bone moves with; None: it bends


@dataclass(frozen=True)
class Segment:
    """A part of the skeleton, and the joint about which it turns."""
    row: int
    name: str
    joint: str
    parent: Optional[str]
    centre: npt.NDArray[np.float64]  # (3,) of the joint as scanned, LPS mm
    axes: npt.NDArray[np.float64]  # (3, 3) of its frame as scanned: columns x, y and z
    confidence: float  # 0 to 1: how well the joint was found


@dataclass(frozen=True)
class Angle:
    """An anatomical angle of a joint, degrees."""
    row: int
    joint: str
    name: str
    rest: float
    min: float  # -inf where there is no limit
    max: float


@dataclass(frozen=True)
class Grid:
    """Where voxels lie: (i, j, k) is centred at origin + direction @ (spacing * (i, j, k)), LPS mm."""
    size: tuple[int, int, int]  # along i, j, k
    origin: npt.NDArray[np.float64]  # (3,)
    spacing: npt.NDArray[np.float64]  # (3,)
    direction: npt.NDArray[np.float64]  # (3, 3); columns are the axes

    @classmethod
    def _of(cls, info: GridInfo) -> "Grid":
        return cls(tuple(info.size), np.array(info.origin), np.array(info.spacing), np.array(info.direction).reshape(3, 3))

    def _info(self) -> GridInfo:
        return GridInfo((ctypes.c_int32 * 3)(*self.size), numbers("origin", self.origin, 3), numbers("spacing", self.spacing, 3),
                        numbers("direction", np.ravel(self.direction), 9))


@dataclass(frozen=True)
class Volume:
    """An image that follows the body."""
    row: int
    name: str
    labels: bool  # ids, posed by the nearest voxel only
    background: float  # what lies outside the body
    grid: Grid
    rest: np.ndarray  # (k, j, i) or (k, j, i, components), as scanned; of a server's, which does not tell, without voxels

    @property
    def components(self) -> int:
        """Numbers of a voxel."""
        return 1 if self.rest.ndim == 3 else self.rest.shape[3]


class Anatomy:
    """What a body consists of."""
    segments: list[Segment]
    tissues: list[Tissue]  # the skin first
    angles: list[Angle]
    volumes: list[Volume]

    def tissue(self, name: Union[str, int]) -> Tissue:
        """By name or row."""
        return _find(self.tissues, name, "tissue")

    def segment(self, name: Union[str, int]) -> Segment:
        """By the name of the segment or of its joint, or by row."""
        for segment in self.segments:
            if name in (segment.name, segment.joint, segment.row):
                return segment
        raise NotFound(f"{name}: the model has no such segment or joint (it has {', '.join(s.name for s in self.segments)})")

    def volume(self, name: Union[str, int]) -> Volume:
        """By name or row."""
        return _find(self.volumes, name, "volume")


class ModelHandle(ctypes.c_void_p):
    """The library's model. Views hold it rather than the Model that holds them: numpy tells the collector of no such circle, and nothing of it would ever go."""

    def __del__(self) -> None:
        if self:
            ask("model_close", self)


class Model(Anatomy):
    """A prepared body, as `ecorche preprocess` writes it. Never changes; any number of threads may use it."""

    def __init__(self, path: Union[str, "os.PathLike[str]"]) -> None:
        """Reads and checks the file: a moment. Raises NotFound, and InvalidArgument for what is no model."""
        self._handle = ModelHandle()
        call("model_open", text(path), ctypes.byref(self._handle))
        self.name: str = ask("model_name", self._handle).decode()
        self.identity: int = ask("model_identity", self._handle)
        self.segments = read_segments(self._rows("segment", SegmentInfo))
        self.tissues = read_tissues(self._rows("tissue", TissueInfo), self.segments, self._handle)
        self.angles = read_angles(self._rows("angle", AngleInfo))
        self.volumes = read_volumes(self._rows("volume", VolumeInfo), self._handle)

    def __repr__(self) -> str:
        return f"<ecorche.Model {self.name}: {len(self.tissues)} tissues, {len(self.segments)} segments>"

    def spheres(self, volume: Union[str, int] = 0) -> "Spheres":
        """The balls that pose a volume; raises NotPossible where the model was prepared without any."""
        from .spheres import Spheres
        return Spheres._made(self, "spheres_of_volume", self._handle, self.volume(volume).row)

    def thin(self, inside: npt.ArrayLike, grid: Grid, thinness: float = 0.48) -> "Spheres":
        """The balls of an object: `inside`, (k, j, i), is not 0 where it is. `thinness`, voxels: -2 keeps every voxel, 2 none."""
        from .spheres import Spheres
        mask = np.ascontiguousarray(np.asarray(inside) != 0, np.uint8)
        if mask.shape != voxel_shape(grid, 1):
            raise InvalidArgument(f"inside: has the shape {mask.shape} (give {voxel_shape(grid, 1)}, as the grid has it)")
        return Spheres._made(self, "spheres_thin", self._handle, ctypes.byref(grid._info()), mask.ctypes.data, thinness)

    def pose(self, name: Optional[str] = None, *, skinning: str = "cor", **joints: Angles) -> "Body":
        """A posed body: `name` is a pose file or one of the library (`lib:sitting`), over which go angles of joints, degrees:
        `model.pose(elbow_left={"flexion": 90})`."""
        from .body import Body
        pose = Pose(self)
        if name is not None:
            pose.load(name)
        for joint, angles in joints.items():
            pose.set(joint, **angles)
        body = Body(self)
        body.update(pose, skinning=skinning)
        return body

    def _rows(self, what: str, kind: type) -> list:
        return [self._info("model_" + what, row, kind()) for row in range(ask(f"model_{what}_count", self._handle))]

    def _info(self, function: str, row: int, info):
        call(function, self._handle, row, ctypes.byref(info))
        return info


class Pose:
    """How every joint is turned. What limits and couplings make of it decides Body.update."""

    def __init__(self, model: Model) -> None:
        """As scanned."""
        self.model = model
        self._handle = ctypes.c_void_p()
        call("pose_create", model._handle, ctypes.byref(self._handle))

    def __del__(self) -> None:
        if getattr(self, "_handle", None):
            ask("pose_destroy", self._handle)

    def reset(self) -> "Pose":
        """As scanned again."""
        call("pose_reset", self._handle)
        return self

    def load(self, name: Union[str, "os.PathLike[str]"]) -> "Pose":
        """A pose file, or `lib:` and anatomical, arms_up, lateral, lithotomy, prone, sitting, squatting or supine; all else is as scanned."""
        call("pose_load", self._handle, text(name))
        return self

    def set(self, joint: str, **degrees: float) -> "Pose":
        """Anatomical angles of a joint, absolute: `pose.set("elbow_left", flexion=90)`. Others of the joint stay."""
        for angle, value in degrees.items():
            call("pose_set_angle", self._handle, text(joint), text(angle), math.radians(value))
        return self

    def get(self, joint: str, angle: str) -> float:
        """Degrees."""
        for known in self.model.angles:
            if (known.joint, known.name) == (joint, angle):
                value = ctypes.c_double()
                call("pose_angle", self._handle, known.row, ctypes.byref(value))
                return math.degrees(value.value)
        raise NotFound(f"{joint}.{angle}: the model has no such angle (Model.angles lists them)")

    def set_rotation(self, segment: Union[str, int], xyzw: Sequence[float]) -> "Pose":
        """The turn of a segment from the scan, in its joint's axes: a unit quaternion x, y, z, w."""
        call("pose_set_rotation", self._handle, self.model.segment(segment).row, numbers("xyzw", xyzw, 4))
        return self

    def rotation(self, segment: Union[str, int]) -> npt.NDArray[np.float64]:
        """(4,) x, y, z, w."""
        out = (ctypes.c_double * 4)()
        call("pose_rotation", self._handle, self.model.segment(segment).row, out)
        return np.array(out)

    def set_root(self, translation: Sequence[float]) -> "Pose":
        """Where the whole body goes from the scan: LPS mm."""
        call("pose_set_root", self._handle, numbers("translation", translation, 3))
        return self


def read_segments(rows: Sequence[SegmentInfo]) -> list[Segment]:
    return [Segment(row, info.name.decode(), info.joint.decode(), rows[info.parent].name.decode() if info.parent >= 0 else None,
                    np.array(info.centre), np.array(info.axes).reshape(3, 3).T, info.confidence) for row, info in enumerate(rows)]


def read_tissues(rows: Sequence[TissueInfo], segments: list[Segment], owner: object = None) -> list[Tissue]:
    """`owner`: of the library's memory, that the arrays show; None: they are copies."""
    out = []
    for row, info in enumerate(rows):
        triangles = view(info.triangles, (info.triangle_count, 3), owner)
        rest = view(info.rest, (info.vertex_count, 3), owner) if info.rest else np.full((info.vertex_count, 3), np.nan, np.float32)
        out.append(Tissue(row, info.name.decode(), info.group.decode(), triangles if owner else triangles.copy(), rest,
                          segments[info.segment].name if info.segment >= 0 else None))
    return out


def read_angles(rows: Sequence[AngleInfo]) -> list[Angle]:
    return [Angle(row, info.joint.decode(), info.name.decode(), *(math.degrees(value) for value in (info.rest, info.min, info.max)))
            for row, info in enumerate(rows)]


def read_volumes(rows: Sequence[VolumeInfo], owner: object = None) -> list[Volume]:
    """`owner`: of the library's memory, that the arrays show; None: there are no voxels."""
    out = []
    for row, info in enumerate(rows):
        grid, scalar = Grid._of(info.grid), SCALARS[info.type]
        shape = voxel_shape(grid, info.components)
        rest = view(ctypes.cast(info.rest, ctypes.POINTER(np.ctypeslib.as_ctypes_type(scalar))), shape, owner) if info.rest else \
            np.empty((0, 0, 0, *shape[3:]), scalar)
        out.append(Volume(row, info.name.decode(), bool(info.labels), info.background, grid, rest))
    return out


def voxel_shape(grid: Grid, components: int) -> tuple[int, ...]:
    """Of an array, slowest first."""
    i, j, k = grid.size
    return (k, j, i) if components == 1 else (k, j, i, components)


def _find(rows, name, what):
    for row in rows:
        if name in (row.name, row.row):
            return row
    raise NotFound(f"{name}: the model has no such {what} (it has {', '.join(row.name for row in rows) or 'none'})")
