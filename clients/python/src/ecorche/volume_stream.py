# SPDX-License-Identifier: Apache-2.0
"""Posed volumes that a server streams."""
import ctypes
import time
from typing import TYPE_CHECKING, Optional

import numpy as np

from ._library import NotPossible, VoxelsInfo
from .model import SCALARS, Grid, Volume, voxel_shape

if TYPE_CHECKING:
    from .client import Client


class VolumeStream:
    """Frames of a posed volume: Client.subscribe_volume() makes it. They come while the client takes frames, or waits in show()."""

    def __init__(self, client: "Client", volume: Volume, number: int) -> None:
        self.client, self.volume = client, volume
        self._number = number

    @property
    def sequence(self) -> Optional[int]:
        """Of the pose that voxels() shows; None before the first frame."""
        try:
            return self._read(0).sequence
        except NotPossible:
            return None

    def show(self, sequence: int, seconds: float = 10) -> "VolumeStream":
        """Waits until the pose that was sent, or a later one, is here. Raises why the server could make no voxels of a pose."""
        until = time.monotonic() + seconds
        while not self.shows(sequence):
            left = until - time.monotonic()
            if left <= 0:
                raise self.late(sequence, seconds)
            self.client._poll(left)
        return self

    def shows(self, sequence: int) -> bool:
        """The pose, or a later one, without waiting."""
        shown = self.sequence
        return shown is not None and shown >= sequence

    def late(self, sequence: int, seconds: float) -> NotPossible:
        """For who waited in vain."""
        return NotPossible(f"pose {sequence}: its {self.volume.name} was not shown within {seconds} s (is this client's control gone?)")

    def voxels(self, slice: int = 0) -> tuple[np.ndarray, Grid]:
        """Of the last frame, (k, j, i) or (k, j, i, components), and where they lie. `slice`: which of those that were asked for."""
        info = self._read(slice)
        grid = Grid._of(info.grid)
        raw = np.ctypeslib.as_array(ctypes.cast(info.voxels, ctypes.POINTER(ctypes.c_uint8)), (info.bytes,)) if info.bytes else np.empty(0, np.uint8)
        return raw.copy().view(SCALARS[info.type]).reshape(voxel_shape(grid, info.components)), grid

    def close(self) -> None:
        """No more of them."""
        self.client._call("unsubscribe_volume", self.client._handle, self._number)

    def _read(self, slice: int) -> VoxelsInfo:
        info = VoxelsInfo()
        self.client._call("voxels", self.client._handle, self._number, slice, ctypes.byref(info))
        return info
