# SPDX-License-Identifier: Apache-2.0
"""libecorche.so and libecorche_client.so, found and declared (clients/c/include/ecorche)."""
import ctypes
import functools
import os
from ctypes import POINTER, Structure, c_char_p, c_double, c_float, c_int, c_int16, c_int32, c_size_t, c_ssize_t, c_uint, c_uint16, c_uint32, c_uint64, c_void_p
from typing import Any, Optional, Union

ABI_VERSION = 0


class Error(Exception):
    """What ecorche refuses: where, what, and how to mend it."""


class InvalidArgument(Error, ValueError):
    """An argument or a file that means nothing."""


class NotFound(Error, LookupError):
    """A file or a name that is not there."""


class NotPossible(Error):
    """What another state of things would allow: control that another has, what was not subscribed to."""


class Unavailable(Error, ConnectionError):
    """Nobody answers, or the connection is gone: connect again."""


_ERRORS = {3: InvalidArgument, 5: NotFound, 7: NotPossible, 9: NotPossible, 11: InvalidArgument, 14: Unavailable}


class Sized(Structure):
    """Begins with its own size, which tells the library how much of it there is."""

    def __init__(self, **values: Any) -> None:
        super().__init__(struct_size=ctypes.sizeof(type(self)), **values)


class TissueInfo(Sized):
    _fields_ = [("struct_size", c_size_t), ("name", c_char_p), ("group", c_char_p), ("vertex_count", c_uint32), ("triangle_count", c_uint32),
                ("triangles", POINTER(c_uint32)), ("rest", POINTER(c_float)), ("segment", c_int32)]


class SegmentInfo(Sized):
    _fields_ = [("struct_size", c_size_t), ("name", c_char_p), ("joint", c_char_p), ("parent", c_int32), ("centre", c_double * 3),
                ("axes", c_double * 9), ("confidence", c_double)]


class AngleInfo(Sized):
    _fields_ = [("struct_size", c_size_t), ("joint", c_char_p), ("name", c_char_p), ("segment", c_uint32), ("rest", c_double), ("min", c_double),
                ("max", c_double)]


class BodyOptions(Sized):
    _fields_ = [("struct_size", c_size_t), ("normals", c_int32), ("threads", c_uint32)]


class QualityInfo(Sized):
    _fields_ = [("struct_size", c_size_t), ("passes", c_int32), ("reason_count", c_uint32), ("inverted_tets", c_uint64),
                ("inverted_share", c_double), ("min_det_f", c_double), ("volume_change", c_double), ("bone_rigidity", c_double),
                ("bone_overlap", c_double)]


class ReasonInfo(Sized):
    _fields_ = [("struct_size", c_size_t), ("figure", c_char_p), ("name", c_char_p), ("value", c_double), ("threshold", c_double)]


class GridInfo(Structure):
    _fields_ = [("size", c_int32 * 3), ("origin", c_double * 3), ("spacing", c_double * 3), ("direction", c_double * 9)]


class VolumeInfo(Sized):
    _fields_ = [("struct_size", c_size_t), ("name", c_char_p), ("type", c_int), ("components", c_int32), ("labels", c_int32),
                ("background", c_double), ("grid", GridInfo), ("rest", c_void_p)]


class SpheresInfo(Sized):
    _fields_ = [("struct_size", c_size_t), ("count", c_uint32), ("thinness", c_double), ("grid", GridInfo), ("voxels", POINTER(c_uint16)),
                ("radii", POINTER(c_float)), ("segments", POINTER(c_int32))]


class ProbedInfo(Sized):
    _fields_ = [("struct_size", c_size_t), ("points", c_void_p), ("tets", c_void_p), ("tissues", c_void_p), ("gradients", c_void_p),
                ("values", c_void_p), ("volume", c_int32)]


_POSING_CODE = [  # what returns an ecorche_code
    ("model_open", c_char_p, POINTER(c_void_p)),
    ("model_tissue", c_void_p, c_uint32, POINTER(TissueInfo)),
    ("model_segment", c_void_p, c_uint32, POINTER(SegmentInfo)),
    ("model_angle", c_void_p, c_uint32, POINTER(AngleInfo)),
    ("model_volume", c_void_p, c_uint32, POINTER(VolumeInfo)),
    ("pose_create", c_void_p, POINTER(c_void_p)),
    ("pose_reset", c_void_p),
    ("pose_load", c_void_p, c_char_p),
    ("pose_set_angle", c_void_p, c_char_p, c_char_p, c_double),
    ("pose_set_rotation", c_void_p, c_uint32, POINTER(c_double)),
    ("pose_rotation", c_void_p, c_uint32, POINTER(c_double)),
    ("pose_angle", c_void_p, c_uint32, POINTER(c_double)),
    ("pose_set_root", c_void_p, POINTER(c_double)),
    ("body_create", c_void_p, POINTER(BodyOptions), POINTER(c_void_p)),
    ("body_update", c_void_p, c_void_p, c_int, c_void_p, c_size_t),
    ("body_copy", c_void_p, c_uint32, c_int, c_void_p, c_size_t, c_void_p, c_size_t, c_size_t),
    ("body_motion", c_void_p, c_uint32, POINTER(c_double)),
    ("body_clamped", c_void_p, c_uint32, POINTER(c_uint32), POINTER(c_double)),
    ("body_measure", c_void_p, c_int, POINTER(QualityInfo)),
    ("body_reason", c_void_p, c_uint32, POINTER(ReasonInfo)),
    ("body_volume_grid", c_void_p, c_uint32, POINTER(GridInfo)),
    ("body_volume", c_void_p, c_uint32, POINTER(GridInfo), c_int, c_void_p, c_size_t),
    ("spheres_of_volume", c_void_p, c_uint32, POINTER(c_void_p)),
    ("spheres_thin", c_void_p, POINTER(GridInfo), c_void_p, c_double, POINTER(c_void_p)),
    ("spheres_thinner", c_void_p, c_double, POINTER(c_void_p)),
    ("spheres_hang", c_void_p, c_void_p, c_size_t, POINTER(c_void_p)),
    ("spheres_describe", c_void_p, POINTER(SpheresInfo)),
    ("body_refill_grid", c_void_p, c_void_p, c_uint32, POINTER(c_double), POINTER(GridInfo)),
    ("body_refill", c_void_p, c_void_p, c_uint32, POINTER(GridInfo), c_int, c_void_p, c_size_t),
    ("body_posed_to_rest", c_void_p, c_void_p, c_size_t, POINTER(ProbedInfo)),
    ("body_rest_to_posed", c_void_p, c_void_p, c_size_t, POINTER(ProbedInfo)),
]
_POSING_OTHER = [
    (c_uint, "abi_version"),
    (c_char_p, "version"),
    (c_char_p, "error_message"),
    (None, "model_close", c_void_p),
    (c_char_p, "model_name", c_void_p),
    (c_uint64, "model_identity", c_void_p),
    (c_uint32, "model_tissue_count", c_void_p),
    (c_uint32, "model_segment_count", c_void_p),
    (c_uint32, "model_angle_count", c_void_p),
    (c_uint32, "model_volume_count", c_void_p),
    (None, "pose_destroy", c_void_p),
    (None, "body_destroy", c_void_p),
    (None, "spheres_destroy", c_void_p),
    (POINTER(c_float), "body_positions", c_void_p, c_uint32),
    (POINTER(c_int16), "body_normals", c_void_p, c_uint32),
    (c_uint32, "body_clamped_count", c_void_p),
]


class ClientOptions(Sized):
    _fields_ = [("struct_size", c_size_t), ("name", c_char_p), ("token", c_char_p), ("authorities", c_char_p),
                ("session", c_char_p)]


class StreamOptions(Sized):
    _fields_ = [("struct_size", c_size_t), ("encoding", c_int), ("normals", c_int32), ("max_rate", c_double), ("tissues", c_void_p),
                ("tissue_count", c_size_t), ("quality", c_int32)]


class EventInfo(Sized):
    _fields_ = [("struct_size", c_size_t), ("kind", c_int), ("code", c_int), ("sequence", c_uint64), ("vacant", c_int32),
                ("stream", c_uint32)]


class VolumeOptions(Sized):
    _fields_ = [("struct_size", c_size_t), ("deformer", c_int), ("nearest", c_int32), ("region", POINTER(c_double)), ("slices", POINTER(GridInfo)),
                ("slice_count", c_size_t), ("compressed", c_int32), ("max_rate", c_double)]


class VoxelsInfo(Sized):
    _fields_ = [("struct_size", c_size_t), ("sequence", c_uint64), ("grid", GridInfo), ("type", c_int), ("components", c_int32),
                ("voxels", c_void_p), ("bytes", c_size_t)]


_CLIENT_CODE = [
    ("connect", c_char_p, POINTER(ClientOptions), POINTER(c_void_p)),
    ("models", c_void_p, POINTER(c_uint32)),
    ("open", c_void_p, c_char_p, c_char_p),
    ("tissue", c_void_p, c_uint32, POINTER(TissueInfo)),
    ("segment", c_void_p, c_uint32, POINTER(SegmentInfo)),
    ("angle", c_void_p, c_uint32, POINTER(AngleInfo)),
    ("claim", c_void_p),
    ("release", c_void_p),
    ("reset_pose", c_void_p),
    ("set_angle", c_void_p, c_char_p, c_char_p, c_double),
    ("set_rotation", c_void_p, c_uint32, POINTER(c_double)),
    ("set_root", c_void_p, POINTER(c_double)),
    ("send_pose", c_void_p, c_int, POINTER(c_uint64)),
    ("subscribe", c_void_p, POINTER(StreamOptions)),
    ("volume", c_void_p, c_uint32, POINTER(VolumeInfo)),
    ("subscribe_volume", c_void_p, c_uint32, POINTER(VolumeOptions), POINTER(c_uint32)),
    ("unsubscribe_volume", c_void_p, c_uint32),
    ("voxels", c_void_p, c_uint32, c_uint32, POINTER(VoxelsInfo)),
    ("poll", c_void_p, c_double, POINTER(EventInfo)),
    ("copy", c_void_p, c_uint32, c_int, c_void_p, c_size_t, c_void_p, c_size_t, c_size_t),
    ("quality", c_void_p, POINTER(QualityInfo), POINTER(c_uint64)),
    ("posed_to_rest", c_void_p, c_void_p, c_size_t, POINTER(ProbedInfo)),
    ("rest_to_posed", c_void_p, c_void_p, c_size_t, POINTER(ProbedInfo)),
    ("resume", c_void_p),
    ("clips", c_void_p, POINTER(c_uint32)),
    ("play", c_void_p, c_char_p, c_double, c_int),
    ("record", c_void_p, c_char_p),
]
_CLIENT_OTHER = [
    (c_uint, "abi_version"),
    (c_char_p, "error_message"),
    (None, "close", c_void_p),
    (c_char_p, "server", c_void_p),
    (c_uint64, "bytes", c_void_p),
    (c_char_p, "model", c_void_p, c_uint32),
    (c_char_p, "session", c_void_p),
    (c_uint32, "tissue_count", c_void_p),
    (c_uint32, "segment_count", c_void_p),
    (c_uint32, "angle_count", c_void_p),
    (c_uint32, "volume_count", c_void_p),
    (c_int, "controls", c_void_p),
    (c_char_p, "clip", c_void_p, c_uint32, POINTER(c_double)),
    (POINTER(c_float), "positions", c_void_p, c_uint32),
    (POINTER(c_float), "normals", c_void_p, c_uint32),
    (c_ssize_t, "descriptor", c_void_p),
]


class Library:
    """One of both: its functions by their names without `prefix`."""

    def __init__(self, file: str, variable: str, prefix: str, code: list, other: list) -> None:
        named = os.environ.get(variable, file)
        try:
            self._library = ctypes.CDLL(named)
        except OSError as error:
            raise ImportError(f"{error} (install {file.partition('.')[0]}, or name the file in {variable})") from None
        self._prefix = prefix
        for result, name, *arguments in [*other, *((c_int, *row) for row in code)]:
            function = getattr(self._library, prefix + name)
            function.restype, function.argtypes = result, arguments
        if self.ask("abi_version") != ABI_VERSION:
            raise ImportError(f"{named} has ABI {self.ask('abi_version')}, and this package is for {ABI_VERSION} (install both from one release)")

    def call(self, name: str, *arguments: Any) -> None:
        """Of what returns a code; raises Error."""
        code = getattr(self._library, self._prefix + name)(*arguments)
        if code != 0:
            raise self.error(code)

    def error(self, code: int) -> Error:
        """What this thread's last call failed for."""
        return _ERRORS.get(code, Error)(self.ask("error_message").decode())

    def ask(self, name: str, *arguments: Any) -> Any:
        """Of what returns something else."""
        return getattr(self._library, self._prefix + name)(*arguments)


def text(value: Optional[Union[str, "os.PathLike[str]"]]) -> Optional[bytes]:
    """What the library is given; None stays."""
    if value is None:
        return None
    data = os.fsencode(value)
    if b"\0" in data:
        raise InvalidArgument(f"{value!r}: holds a NUL, where the library would take it to end (leave it out)")
    return data


_posing = Library("libecorche.so.0", "ECORCHE_LIBRARY", "ecorche_", _POSING_CODE, _POSING_OTHER)
call, ask = _posing.call, _posing.ask


@functools.cache
def client_library() -> Library:
    """Loaded by who connects first."""
    return Library("libecorche_client.so.0", "ECORCHE_CLIENT_LIBRARY", "ecorche_client_", _CLIENT_CODE, _CLIENT_OTHER)


def version() -> str:
    """Of the library."""
    return ask("version").decode()
