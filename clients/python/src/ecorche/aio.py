# SPDX-License-Identifier: Apache-2.0
"""Bodies that a server poses, for asyncio.

    import ecorche.aio

    async with ecorche.aio.connect("127.0.0.1:7070") as client:
        await client.set("elbow_left", flexion=90)
        await client.show(await client.send())
        skin = await client.positions("skin")                # (V, 3) float32, LPS mm
        async for frame in client.frames():                  # whoever poses the session
            ...

Frames are read and decoded by the C library on the event loop, as the connection's descriptor tells of them: no thread waits. What waits for
an answer of the server (connecting, claiming, probing, coming back) does so on a thread of the loop's executor. Any number of tasks may share a client: one
call goes after the other.
"""
import asyncio
import os
import time
from types import TracebackType
from typing import Any, AsyncIterator, Callable, Generator, Optional, Sequence, TypeVar, Union

import numpy as np
import numpy.typing as npt

from ._library import EventInfo, NotPossible
from .body import Quality
from .client import FRAME, NONE, Frame
from .client import Client as Waiting
from .model import Anatomy, Grid
from .volume_stream import VolumeStream as WaitingStream

T = TypeVar("T")


class Client(Anatomy):
    """One connection, and the body that it opened; of the event loop in which it was made. Methods do what those of ecorche.Client do, and
    raise the same."""

    def __init__(self, waiting: Waiting) -> None:
        """Of `connect`."""
        self._waiting = waiting
        self._loop = asyncio.get_running_loop()
        self._lock = asyncio.Lock()  # the C library's client is for one at a time
        self._arrival: Optional["asyncio.Future[None]"] = None
        self._watched, self._stirs = -1, 0
        self._closed = False
        self.segments, self.tissues, self.angles, self.volumes = waiting.segments, waiting.tissues, waiting.angles, waiting.volumes
        self.session: str = waiting.session
        self.server: str = waiting.server

    @property
    def model_changed(self) -> bool:
        """The server has read the model anew: this session stays as it is; connect again for the new one."""
        return self._waiting.model_changed

    async def close(self) -> None:
        """Says goodbye and hangs up, after what is under way; whoever waits for frames gets NotPossible."""
        async with self._lock:
            if self._closed:
                return
            self._closed = True
            self._stir()
            await asyncio.shield(self._loop.run_in_executor(None, self._waiting.close))

    async def __aenter__(self) -> "Client":
        return self

    async def __aexit__(self, kind: Optional[type], value: Optional[BaseException], trace: Optional[TracebackType]) -> None:
        await self.close()

    async def set(self, joint: str, **degrees: float) -> "Client":
        """Anatomical angles of a joint, absolute, of the pose that is sent next; others stay."""
        await self._now(self._waiting.set, joint, **degrees)
        return self

    async def set_rotation(self, segment: Union[str, int], xyzw: Sequence[float]) -> "Client":
        """The turn of a segment from the scan, in its joint's axes: a unit quaternion x, y, z, w."""
        await self._now(self._waiting.set_rotation, segment, xyzw)
        return self

    async def set_root(self, translation: Sequence[float]) -> "Client":
        """Where the whole body goes from the scan: LPS mm."""
        await self._now(self._waiting.set_root, translation)
        return self

    async def reset(self) -> "Client":
        """The pose that is sent next is the scanned one."""
        await self._now(self._waiting.reset)
        return self

    async def send(self, *, skinning: str = "cor") -> int:
        """Sends the pose; the number that the frame of it will have."""
        return await self._now(self._waiting.send, skinning=skinning)

    async def frames(self, seconds: Optional[float] = None) -> AsyncIterator[Frame]:
        """Those that came, and that come within `seconds` (None: until the client is closed). A task that is slow gets the newest. Raises what
        the server refuses a pose for, and Unavailable once the connection is gone."""
        until = None if seconds is None else time.monotonic() + seconds
        while True:
            stirs = self._stirs
            event = await self._next()
            if event.kind == FRAME:
                yield Frame(event.sequence)
            elif event.kind == NONE and not await self._arrives(until, stirs):
                return

    async def show(self, sequence: int, seconds: float = 10) -> Frame:
        """Waits until the frame of a pose that was sent, or of a later one, is here."""
        if not await self._until(lambda: self._waiting._shown >= sequence, seconds):
            raise NotPossible(f"pose {sequence}: was not shown within {seconds} s (is this client's control gone?)")
        return Frame(self._waiting._shown)

    async def subscribe_volume(self, volume: Union[str, int] = 0, *, spheres: bool = False, nearest: bool = False,
                               region: Optional[npt.ArrayLike] = None, slices: Sequence[Grid] = (), compressed: bool = False,
                               max_rate: float = 0) -> "VolumeStream":
        """Frames of a posed volume from now on, as ecorche.Client.subscribe_volume."""
        made = await self._aside(lambda: self._waiting.subscribe_volume(volume, spheres=spheres, nearest=nearest, region=region, slices=slices,
                                                                        compressed=compressed, max_rate=max_rate))
        return VolumeStream(self, made)

    async def positions(self, tissue: Union[str, int] = 0) -> npt.NDArray[np.float32]:
        """(V, 3) of the last frame, LPS mm."""
        return await self._now(self._waiting.positions, tissue)

    async def normals(self, tissue: Union[str, int] = 0) -> npt.NDArray[np.float32]:
        """(V, 3) unit vectors, as positions()."""
        return await self._now(self._waiting.normals, tissue)

    async def copy(self, tissue: Union[str, int] = 0, space: str = "lps") -> npt.NDArray[np.float32]:
        """As Body.copy."""
        return await self._now(self._waiting.copy, tissue, space)

    async def quality(self) -> tuple[Quality, int]:
        """The last that frames told, and the pose that it is of."""
        return await self._now(self._waiting.quality)

    async def controls(self) -> bool:
        """Whether this client poses the session; else it looks on."""
        return await self._now(lambda: self._waiting.controls)

    async def bytes_received(self) -> int:
        return await self._now(lambda: self._waiting.bytes_received)

    async def claim(self) -> None:
        """Takes control where it is free; raises NotPossible where another has it."""
        await self._aside(self._waiting.claim)

    async def release(self) -> None:
        """Gives it up."""
        await self._aside(self._waiting.release)

    async def models(self) -> list[str]:
        """Of the server."""
        return await self._aside(lambda: self._waiting.models)

    async def to_rest(self, points: npt.ArrayLike) -> tuple[npt.NDArray[np.float32], list[Optional[str]]]:
        """Points of the posed body, (P, 3): where they were in the scan (NaN outside the body), and the tissue there."""
        return await self._aside(self._waiting.to_rest, points)

    async def to_posed(self, points: npt.ArrayLike) -> tuple[npt.NDArray[np.float32], list[Optional[str]]]:
        """Points of the scan, (P, 3): where they went."""
        return await self._aside(self._waiting.to_posed, points)

    async def resume(self) -> None:
        """Comes back after Unavailable, to the session, control and frames; raises Unavailable where nobody answers yet."""
        await self._aside(self._waiting.resume)

    async def clips(self) -> dict[str, float]:
        """Motion that the server holds: how many seconds each takes."""
        return await self._aside(lambda: self._waiting.clips)

    async def play(self, clip: Optional[str], *, speed: float = 1, loop: bool = False) -> None:
        """The server poses by itself, until the clip ends, a pose is sent, or `clip` is None."""
        await self._aside(self._waiting.play, clip, speed=speed, loop=loop)

    async def record(self, name: Optional[str]) -> None:
        """The server records under this name, which becomes a clip; None: ends."""
        await self._aside(self._waiting.record, name)

    def _check_open(self) -> None:
        if self._closed:
            raise NotPossible("client: is closed (connect again)")

    async def _now(self, work: Callable[..., T], *arguments: Any, **named: Any) -> T:
        """Work that never waits for the server."""
        async with self._lock:
            self._check_open()
            return work(*arguments, **named)

    async def _aside(self, work: Callable[..., T], *arguments: Any, **named: Any) -> T:
        """Work that does. Where the task is cancelled meanwhile, the client is free again only when the work is done."""
        await self._lock.acquire()
        try:
            self._check_open()
            self._stir()  # the descriptor may be another one afterwards
            done = self._loop.run_in_executor(None, lambda: work(*arguments, **named))
        except BaseException:
            self._lock.release()
            raise

        def free(future: "asyncio.Future[T]") -> None:
            self._lock.release()
            if not future.cancelled():
                future.exception()  # else one that nobody awaits any more would be told on stderr
            self._stir()  # frames that came with the answer wait within the client

        done.add_done_callback(free)
        return await asyncio.shield(done)

    async def _next(self) -> EventInfo:
        """What came, without waiting."""
        event = await self._now(self._waiting._poll, 0.0)
        if event.kind != NONE:
            self._stir()  # other tasks may have waited for it
        return event

    async def _until(self, done: Callable[[], bool], seconds: float) -> bool:
        """Takes what comes until `done`; False where it is not within `seconds`."""
        until = time.monotonic() + seconds
        while not await self._now(done):
            stirs = self._stirs
            event = await self._next()
            if time.monotonic() > until or (event.kind == NONE and not await self._arrives(until, stirs)):
                return await self._now(done)
        return True

    async def _arrives(self, until: Optional[float], stirs: int) -> bool:
        """False where nothing came until then. `stirs`: how many there were before the last look."""
        left = None if until is None else until - time.monotonic()
        if left is not None and left <= 0:
            return False
        async with self._lock:
            self._check_open()
            if self._stirs != stirs:
                return True
            if self._arrival is None:
                self._watched = self._waiting._descriptor()
                self._arrival = self._loop.create_future()
                self._loop.add_reader(self._watched, self._stir)
            arrival = self._arrival
        await asyncio.wait({arrival}, timeout=left)
        return True

    def _stir(self) -> None:
        """Whoever waits for frames looks again."""
        self._stirs += 1
        if self._arrival is None:
            return
        self._loop.remove_reader(self._watched)
        self._arrival.set_result(None)
        self._arrival = None


class VolumeStream:
    """Frames of a posed volume: Client.subscribe_volume() makes it. They come while any task takes frames, or waits in show()."""

    def __init__(self, client: Client, waiting: WaitingStream) -> None:
        self.client, self.volume = client, waiting.volume
        self._waiting = waiting

    async def sequence(self) -> Optional[int]:
        """Of the pose that voxels() shows; None before the first frame."""
        return await self.client._now(lambda: self._waiting.sequence)

    async def show(self, sequence: int, seconds: float = 10) -> "VolumeStream":
        """Waits until the pose that was sent, or a later one, is here. Raises why the server could make no voxels of a pose."""
        if not await self.client._until(lambda: self._waiting.shows(sequence), seconds):
            raise self._waiting.late(sequence, seconds)
        return self

    async def voxels(self, slice: int = 0) -> tuple[np.ndarray, Grid]:
        """As ecorche.VolumeStream.voxels."""
        return await self.client._now(self._waiting.voxels, slice)

    async def close(self) -> None:
        """No more of them."""
        await self.client._aside(self._waiting.close)


class connect:
    """Connects, opens a model and subscribes to its frames, as ecorche.connect, whose arguments it takes: `async with connect(...) as client`, or `client =
    await connect(...)`, to be closed."""

    def __init__(self, address: str, model: Optional[str] = None, session: Optional[str] = None, *, encoding: str = "u16-delta",
                 normals: bool = False, quality: bool = False, max_rate: float = 0, tissues: Optional[Sequence[Union[str, int]]] = None,
                 token: Optional[str] = None, authorities: Optional[Union[str, "os.PathLike[str]"]] = None) -> None:
        self._make = lambda: Waiting(address, model, session, encoding=encoding, normals=normals, quality=quality, max_rate=max_rate,
                                     tissues=tissues, token=token, authorities=authorities)
        self._client: Optional[Client] = None

    async def _connect(self) -> Client:
        return Client(await asyncio.get_running_loop().run_in_executor(None, self._make))

    def __await__(self) -> Generator[Any, None, Client]:
        return self._connect().__await__()

    async def __aenter__(self) -> Client:
        self._client = await self._connect()
        return self._client

    async def __aexit__(self, kind: Optional[type], value: Optional[BaseException], trace: Optional[TracebackType]) -> None:
        assert self._client is not None
        await self._client.close()
