# SPDX-License-Identifier: Apache-2.0
"""Bodies that a server poses."""
import ctypes
import math
import os
import time
from dataclasses import dataclass
from types import TracebackType
from typing import Iterator, Optional, Sequence, Union

import numpy as np
import numpy.typing as npt

from ._library import (AngleInfo, ClientOptions, EventInfo, GridInfo, InvalidArgument, NotPossible, ProbedInfo, QualityInfo, SegmentInfo, StreamOptions,
                       TissueInfo, VolumeInfo, VolumeOptions, client_library, text)
from .body import SKINNING, SPACES, Quality
from .model import Anatomy, Grid, numbers, read_angles, read_segments, read_tissues, read_volumes, view
from .volume_stream import VolumeStream

ENCODINGS = {"f32": 1, "u16": 2, "u16-delta": 3}
NONE, FRAME, POSE, CONTROL, MODEL_CHANGED, VOLUME = range(6)


@dataclass(frozen=True)
class Frame:
    """A posed body came: positions() has it."""
    sequence: int  # of the pose that it shows, as send() gave it; 0: as scanned


class Client(Anatomy):
    """One connection, and the body that it opened; for one thread at a time.

        with ecorche.connect("127.0.0.1:7070") as client:
            client.set("elbow_left", flexion=90)
            client.show(client.send())
            client.positions("skin")
    """

    def __init__(self, address: str, model: Optional[str] = None, session: Optional[str] = None, *, encoding: str = "u16-delta",
                 normals: bool = False, quality: bool = False, max_rate: float = 0, tissues: Optional[Sequence[Union[str, int]]] = None,
                 token: Optional[str] = None, authorities: Optional[Union[str, "os.PathLike[str]"]] = None) -> None:
        """`model`: None for the server's first. `session`: its name, for others to join; None for one of its own. `encoding`: f32, u16 or
        u16-delta. `quality`: every pose is measured before its frame leaves; else quality() is of some of them. `tissues`: that are shown; None: all. `token`: of the right to connect. `authorities`: a PEM file; None: no TLS."""
        if encoding not in ENCODINGS:
            raise InvalidArgument(f"encoding: {encoding} is none of {', '.join(ENCODINGS)}")
        self._library = client_library()
        self._handle = ctypes.c_void_p()
        self._shown = -1  # the pose of the last frame
        self.model_changed = False  # the server has read the model anew: this session stays as it is; connect again for the new one
        options = ClientOptions(name=b"python", token=text(token), authorities=text(authorities), session=text(session))
        self._call("connect", text(address), ctypes.byref(options), ctypes.byref(self._handle))
        try:
            self._call("open", self._handle, text(model), text(session))
            self.session: str = self._library.ask("session", self._handle).decode()
            self.segments = read_segments(self._rows("segment", SegmentInfo))
            self.tissues = read_tissues(self._rows("tissue", TissueInfo), self.segments)
            self.angles = read_angles(self._rows("angle", AngleInfo))
            self.volumes = read_volumes(self._rows("volume", VolumeInfo))
            rows = None if tissues is None else np.array(sorted({self.tissue(name).row for name in tissues}), np.uint32)
            stream = StreamOptions(encoding=ENCODINGS[encoding], normals=int(normals), quality=int(quality), max_rate=max_rate,
                                   tissues=None if rows is None else rows.ctypes.data, tissue_count=0 if rows is None else len(rows))
            self._call("subscribe", self._handle, ctypes.byref(stream))
        except BaseException:
            self.close()
            raise

    def close(self) -> None:
        """Says goodbye and hangs up: its control is free at once."""
        if self._handle:
            self._library.ask("close", self._handle)
            self._handle = ctypes.c_void_p()

    def __enter__(self) -> "Client":
        return self

    def __exit__(self, kind: Optional[type], value: Optional[BaseException], trace: Optional[TracebackType]) -> None:
        self.close()

    def __del__(self) -> None:
        if getattr(self, "_handle", None):
            self.close()

    @property
    def server(self) -> str:
        """Which ecorche answers."""
        return self._library.ask("server", self._handle).decode()

    @property
    def bytes_received(self) -> int:
        return self._library.ask("bytes", self._handle)

    @property
    def models(self) -> list[str]:
        """Of the server."""
        count = ctypes.c_uint32()
        self._call("models", self._handle, ctypes.byref(count))
        return [self._library.ask("model", self._handle, row).decode() for row in range(count.value)]

    @property
    def controls(self) -> bool:
        """Whether this client poses the session; else it looks on."""
        return bool(self._library.ask("controls", self._handle))

    def claim(self) -> None:
        """Takes control where it is free; raises NotPossible where another has it."""
        self._call("claim", self._handle)

    def release(self) -> None:
        """Gives it up."""
        self._call("release", self._handle)

    def reset(self) -> "Client":
        """The pose that is sent next is the scanned one."""
        self._call("reset_pose", self._handle)
        return self

    def set(self, joint: str, **degrees: float) -> "Client":
        """Anatomical angles of a joint, absolute, of the pose that is sent next; others stay."""
        for angle, value in degrees.items():
            self._call("set_angle", self._handle, text(joint), text(angle), math.radians(value))
        return self

    def set_rotation(self, segment: Union[str, int], xyzw: Sequence[float]) -> "Client":
        """The turn of a segment from the scan, in its joint's axes: a unit quaternion x, y, z, w."""
        self._call("set_rotation", self._handle, self.segment(segment).row, numbers("xyzw", xyzw, 4))
        return self

    def set_root(self, translation: Sequence[float]) -> "Client":
        """Where the whole body goes from the scan: LPS mm."""
        self._call("set_root", self._handle, numbers("translation", translation, 3))
        return self

    def send(self, *, skinning: str = "cor") -> int:
        """Sends the pose, without waiting; the number that the frame of it will have."""
        if skinning not in SKINNING:
            raise InvalidArgument(f"skinning: {skinning} is none of {', '.join(SKINNING)}")
        sequence = ctypes.c_uint64()
        self._call("send_pose", self._handle, SKINNING[skinning], ctypes.byref(sequence))
        return sequence.value

    def frames(self, seconds: float = 0) -> Iterator[Frame]:
        """Those that came, and that come within `seconds` (0: without waiting). Raises what the server refuses a pose for."""
        until = time.monotonic() + seconds
        while True:
            event = self._poll(max(0.0, until - time.monotonic()))
            if event.kind == NONE:
                return
            if event.kind == FRAME:
                yield Frame(event.sequence)

    def show(self, sequence: int, seconds: float = 10) -> Frame:
        """Waits until the frame of a pose that was sent, or of a later one, is here."""
        if self._shown >= sequence:
            return Frame(self._shown)
        for frame in self.frames(seconds):
            if frame.sequence >= sequence:
                return frame
        raise NotPossible(f"pose {sequence}: was not shown within {seconds} s (is this client's control gone?)")

    def subscribe_volume(self, volume: Union[str, int] = 0, *, spheres: bool = False, nearest: bool = False,
                         region: Optional[npt.ArrayLike] = None, slices: Sequence[Grid] = (), compressed: bool = False,
                         max_rate: float = 0) -> VolumeStream:
        """Frames of a posed volume from now on, besides those of tissues: the whole, or what lies in `region` (the low and the high corner, 6
        numbers, LPS mm), or at most 16 `slices`, one voxel thick along k. `spheres`: posed by balls, not by tets. `max_rate`: a second; 0: every pose."""
        found = self.volume(volume)
        options = VolumeOptions(deformer=2 if spheres else 1, nearest=int(nearest), compressed=int(compressed), max_rate=max_rate)
        if region is not None:
            options.region = numbers("region", region, 6)
        if slices:
            options.slices, options.slice_count = (GridInfo * len(slices))(*(grid._info() for grid in slices)), len(slices)
        number = ctypes.c_uint32()
        self._call("subscribe_volume", self._handle, found.row, ctypes.byref(options), ctypes.byref(number))
        return VolumeStream(self, found, number.value)

    def positions(self, tissue: Union[str, int] = 0) -> npt.NDArray[np.float32]:
        """(V, 3) of the last frame, LPS mm."""
        return self._vectors("positions", tissue)

    def normals(self, tissue: Union[str, int] = 0) -> npt.NDArray[np.float32]:
        """(V, 3) unit vectors, as positions()."""
        return self._vectors("normals", tissue)

    def copy(self, tissue: Union[str, int] = 0, space: str = "lps") -> npt.NDArray[np.float32]:
        """As Body.copy."""
        if space not in SPACES:
            raise InvalidArgument(f"space: {space} is none of {', '.join(SPACES)}")
        found = self.tissue(tissue)
        out = np.empty(found.rest.shape, np.float32)
        self._call("copy", self._handle, found.row, SPACES[space], out.ctypes.data, 0, None, 0, len(out))
        return out

    def quality(self) -> tuple[Quality, int]:
        """The last that frames told, measured as Body.measure(sampled=True) and without reasons, and the pose that it is of."""
        info, sequence = QualityInfo(), ctypes.c_uint64()
        self._call("quality", self._handle, ctypes.byref(info), ctypes.byref(sequence))
        return Quality(bool(info.passes), [], info.inverted_tets, info.inverted_share, info.min_det_f, info.volume_change,
                       info.bone_rigidity, info.bone_overlap), sequence.value

    def to_rest(self, points: npt.ArrayLike) -> tuple[npt.NDArray[np.float32], list[Optional[str]]]:
        """Points of the posed body, (P, 3): where they were in the scan (NaN outside the body), and the tissue there."""
        return self._probe("posed_to_rest", points)

    def to_posed(self, points: npt.ArrayLike) -> tuple[npt.NDArray[np.float32], list[Optional[str]]]:
        """Points of the scan, (P, 3): where they went."""
        return self._probe("rest_to_posed", points)

    def resume(self) -> None:
        """Comes back after Unavailable, to the session, control and frames; raises Unavailable where nobody answers yet. Who was
        sent to another server tries the two in turn."""
        self._call("resume", self._handle)

    @property
    def clips(self) -> dict[str, float]:
        """Motion that the server holds: how many seconds each takes."""
        count, seconds = ctypes.c_uint32(), ctypes.c_double()
        self._call("clips", self._handle, ctypes.byref(count))
        return {self._library.ask("clip", self._handle, row, ctypes.byref(seconds)).decode(): seconds.value for row in range(count.value)}

    def play(self, clip: Optional[str], *, speed: float = 1, loop: bool = False) -> None:
        """The server poses by itself, until the clip ends, a pose is sent, or `clip` is None."""
        self._call("play", self._handle, text(clip), speed, int(loop))

    def record(self, name: Optional[str]) -> None:
        """The server records under this name, which becomes a clip; None: ends."""
        self._call("record", self._handle, text(name))

    def _call(self, name: str, *arguments: object) -> None:
        self._library.call(name, *arguments)

    def _rows(self, what: str, kind: type) -> list:
        out = [kind() for _ in range(self._library.ask(what + "_count", self._handle))]
        for row, info in enumerate(out):
            self._call(what, self._handle, row, ctypes.byref(info))
        return out

    def _poll(self, seconds: float) -> EventInfo:
        event = EventInfo()
        self._call("poll", self._handle, seconds, ctypes.byref(event))
        if event.code != 0:
            raise self._library.error(event.code)
        self.model_changed |= event.kind == MODEL_CHANGED
        if event.kind == FRAME:
            self._shown = event.sequence
        return event

    def _descriptor(self) -> int:
        return self._library.ask("descriptor", self._handle)

    def _vectors(self, what: str, tissue: Union[str, int]) -> npt.NDArray[np.float32]:
        found = self.tissue(tissue)
        pointer = self._library.ask(what, self._handle, found.row)
        if not pointer:
            raise NotPossible(f"{found.name}: no frame has brought its {what} (ask for them, and take frames)")
        return view(pointer, found.rest.shape, None).copy()

    def _probe(self, function: str, points: npt.ArrayLike) -> tuple[npt.NDArray[np.float32], list[Optional[str]]]:
        asked = np.ascontiguousarray(points, np.float32)
        if asked.ndim != 2 or asked.shape[1] != 3:
            raise InvalidArgument(f"points: have the shape {asked.shape} (give (P, 3), LPS mm)")
        there, tissues = np.empty_like(asked), np.empty(len(asked), np.int32)
        out = ProbedInfo(points=there.ctypes.data, tissues=tissues.ctypes.data)
        self._call(function, self._handle, asked.ctypes.data, len(asked), ctypes.byref(out))
        return there, [self.tissues[t].name if t >= 0 else None for t in tissues]


connect = Client
