# SPDX-License-Identifier: Apache-2.0
"""Where a posed body comes from: a model in this process, or a server. Needs no Blender; LPS mm, as ecorche has it."""
from typing import Mapping, Optional, Sequence

import numpy as np

import ecorche

Turn = Sequence[float]  # of a joint from the scan, in its axes: a unit quaternion x, y, z, w


class Local:
    """A model that is posed here."""

    def __init__(self, path: str) -> None:
        self.anatomy = ecorche.Model(path)
        self._pose, self._body = ecorche.Pose(self.anatomy), ecorche.Body(self.anatomy, normals=False)
        self.leads = True
        self.clips: dict[str, float] = {}

    def set(self, turns: Mapping[str, Turn], root: Sequence[float]) -> None:
        """Poses the body; what limits and couplings make of it, turns() says."""
        for segment, turn in turns.items():
            self._pose.set_rotation(segment, turn)
        self._pose.set_root(root)
        self._body.update(self._pose)

    def load(self, name: str) -> None:
        """A pose file, or lib:NAME."""
        self._body.update(self._pose.load(name))

    def take(self) -> tuple[bool, bool]:
        """Whether something came by itself, and whether others posed it."""
        return False, False

    def positions(self, row: int) -> np.ndarray:
        """(V, 3) of a tissue."""
        return self._body.positions(row)

    def motions(self) -> dict[str, np.ndarray]:
        """(3, 4) of each segment from the scan."""
        return {segment.name: self._body.motion(segment.row) for segment in self.anatomy.segments}

    def probe(self, point: Sequence[float]) -> tuple[np.ndarray, Optional[str]]:
        """Where a posed point was in the scan (NaN outside the body), and the tissue there."""
        found = self._body.to_rest([point])
        return found.points[0], found.tissues[0]

    def close(self) -> None:
        pass


class Served:
    """A body that a server poses, alone or in a session with others."""

    def __init__(self, address: str, model: Optional[str] = None, session: Optional[str] = None, token: Optional[str] = None,
                 authorities: Optional[str] = None) -> None:
        self._client = self.anatomy = ecorche.connect(address, model, session, token=token, authorities=authorities)
        self._own: set[int] = set()  # poses of ours that no frame has shown yet
        self._seen = 0  # the newest pose that was shown
        self.clips = self._client.clips
        # The scanned body, which frames show like any other: motions() are from there. Who looks on cannot ask for it.
        self._rest: Optional[list[np.ndarray]] = None
        if self._client.controls:
            self._seen = self._client.show(self._client.reset().send()).sequence
            self._rest = [self._client.positions(tissue.row) for tissue in self.anatomy.tissues]
        else:
            next(self._client.frames(10), None)

    @property
    def leads(self) -> bool:
        """Whether this client poses the session."""
        return self._client.controls

    def set(self, turns: Mapping[str, Turn], root: Sequence[float], wait: bool = False) -> None:
        """Sends a pose; frames show it later, unless this waits for it."""
        for segment, turn in turns.items():
            self._client.set_rotation(segment, turn)
        sent = self._client.set_root(root).send()
        if wait:
            self._seen = self._client.show(sent).sequence
        else:
            self._own.add(sent)

    def take(self) -> tuple[bool, bool]:
        shown = [frame.sequence for frame in self._client.frames()]
        newest = max(shown, default=0)  # a pose may be shown again
        others = newest > self._seen and newest not in self._own
        self._seen = max(newest, self._seen)
        self._own = {sequence for sequence in self._own if sequence > self._seen}
        return bool(shown), others

    def play(self, clip: Optional[str]) -> None:
        """The server poses by itself; None: it ends."""
        self._client.play(clip)

    def positions(self, row: int) -> np.ndarray:
        return self._client.positions(row)

    def motions(self) -> dict[str, np.ndarray]:
        """Of the segments that have a bone, by its vertices; none where the scanned body was not seen."""
        if self._rest is None:
            return {}
        out: dict[str, np.ndarray] = {}
        for tissue, rest in zip(self.anatomy.tissues, self._rest):
            if tissue.segment is not None and tissue.segment not in out:
                out[tissue.segment] = rigid_motion(rest, self.positions(tissue.row))
        return out

    def probe(self, point: Sequence[float]) -> tuple[np.ndarray, Optional[str]]:
        points, tissues = self._client.to_rest([point])
        return points[0], tissues[0]

    def close(self) -> None:
        self._client.close()


def rigid_motion(rest: np.ndarray, posed: np.ndarray) -> np.ndarray:
    """(3, 4): the rotation and translation that take (V, 3) rest nearest to posed, by least squares (Kabsch)."""
    a, b = rest.mean(axis=0, dtype=float), posed.mean(axis=0, dtype=float)
    u, _, vt = np.linalg.svd((rest - a).T @ (posed - b))
    turn = vt.T @ np.diag([1, 1, np.linalg.det(vt.T @ u.T)]) @ u.T
    return np.column_stack([turn, b - turn @ a])
