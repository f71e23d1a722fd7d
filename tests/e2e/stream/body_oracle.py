# SPDX-License-Identifier: Apache-2.0
"""Posing in plain double precision, straight from the papers and the model file: the oracle of streamed frames.

Shares no code with the server: h5py reads the file (docs/reference/model.md), numpy does the sums.
"""
import h5py
import numpy as np

BALL, HINGE, UNIVERSAL, FIXED, FREE = range(5)
FREE_TURNS = {BALL: 3, HINGE: 1, UNIVERSAL: 2, FIXED: 0, FREE: 3}
SMALLEST_WEIGHT = 1e-4  # lighter ones are dropped when a model is loaded


def multiply(a, b):
    """Quaternion product, (w, x, y, z) along the last axis."""
    aw, av, bw, bv = a[..., :1], a[..., 1:], b[..., :1], b[..., 1:]
    return np.concatenate([aw * bw - np.sum(av * bv, -1, keepdims=True), aw * bv + bw * av + np.cross(av, bv)], -1)


def conjugate(q):
    return q * np.array([1.0, -1, -1, -1])


def rotate(q, x):
    v = q[..., 1:]
    t = 2 * np.cross(v, x)
    return x + q[..., :1] * t + np.cross(v, t)


def turn(axis, angle):
    q = np.zeros(4)
    q[0], q[1 + axis] = np.cos(angle / 2), np.sin(angle / 2)
    return q


class Body:
    def __init__(self, path):
        with h5py.File(path) as f:
            self._read_skeleton(f["ecorche/skeleton"])
            self.nodes = f["VTKHDF/Points"][()].astype(float)
            self.tets = f["VTKHDF/Connectivity"][()].reshape(-1, 4)
            self.centre = f["ecorche/cor/centre"][()].astype(float)
            self.has_centre = f["ecorche/cor/has_centre"][()].astype(bool)
            self.weights = self._dense_weights(f["ecorche/weights"])
            self.tissues = {name: self._read_tissue(group) for name, group in f["ecorche/tissues"].items()}

    def _read_skeleton(self, group):
        self.parent = group["parent"][()]
        self.kind = group["kind"][()]
        self.center = group["center"][()]
        self.axes = group["axes"][()]
        angles = {key: group["angle_" + key][()] for key in ("joint", "axis", "sign", "rest", "min", "max")}
        self.angles = [[{key: column[row] for key, column in angles.items()} for row in np.flatnonzero(angles["joint"] == joint)]
                       for joint in range(len(self.parent))]
        joints = [name.decode() for name in group["joint"][()]]
        leaders = {joints.index(name.decode()) for name in group["coupling_leader"][()]} if "coupling_leader" in group else set()
        self.coupled = leaders | set(group["coupling_joint"][()] if "coupling_joint" in group else ())

    def _dense_weights(self, group):
        offsets, segment = group["offsets"][()].astype(np.int64), group["segment"][()]
        weight = group["weight"][()].astype(float)
        node = np.repeat(np.arange(len(offsets) - 1), np.diff(offsets))
        dense = np.zeros((len(offsets) - 1, len(self.parent)))
        keep = weight >= SMALLEST_WEIGHT
        dense[node[keep], segment[keep]] = weight[keep]
        return dense / dense.sum(1, keepdims=True)

    @staticmethod
    def _read_tissue(group):
        return {"segment": int(group["segment"][0]), "points": group["points"][()].astype(float), "tet": group["tet"][()],
                "barycentric": group["barycentric"][()].astype(float)}

    def swaying_pose(self, phase):
        """A pose that every joint can do: each free angle sways within its limits, coupled joints rest."""
        pose = np.zeros((len(self.parent), 4))
        pose[:, 0] = 1
        for joint, angles in enumerate(self.angles):
            if joint in self.coupled:
                continue
            rest, posed = np.array([1.0, 0, 0, 0]), np.array([1.0, 0, 0, 0])
            for k, a in enumerate(angles):
                value = a["rest"]
                if k < FREE_TURNS[self.kind[joint]]:
                    s = 0.95 * np.sin(phase + 0.7 * joint + 2.1 * k)
                    # Below a right angle, where the middle angle of a sequence would turn over.
                    room = min(0.6, max(0.0, (a["max"] if s > 0 else -a["min"]) - (value if s > 0 else -value)))
                    value = value + s * room
                rest = multiply(rest, turn(a["axis"], a["sign"] * a["rest"]))
                posed = multiply(posed, turn(a["axis"], a["sign"] * value))
            pose[joint] = multiply(conjugate(rest), posed)
        return pose

    def motions(self, pose, root_translation):
        """Rotation and translation of every segment; a child's quaternion lies beside its parent's."""
        q, t = np.zeros((len(pose), 4)), np.zeros((len(pose), 3))
        for s, parent in enumerate(self.parent):
            local = np.concatenate([pose[s, :1], self.axes[s] @ pose[s, 1:]])
            shift = self.center[s] - rotate(local, self.center[s])
            beside = np.array([1.0, 0, 0, 0]) if parent < 0 else q[parent]
            if parent < 0:
                q[s], t[s] = local, shift + root_translation
            else:
                q[s], t[s] = multiply(q[parent], local), rotate(q[parent], shift) + t[parent]
            if q[s] @ beside < 0:
                q[s] = -q[s]
        return q, t

    def lbs(self, q, t, points):
        matrices = np.stack([rotate(q, unit) for unit in np.eye(3)], -1)
        blended = (self.weights @ matrices.reshape(-1, 9)).reshape(-1, 3, 3)
        return np.einsum("nij,nj->ni", blended, points) + self.weights @ t

    def dqs(self, q, t):
        """Kavan08, algorithm 1."""
        dual = 0.5 * multiply(np.concatenate([np.zeros((len(t), 1)), t], 1), q)
        b, d = self.weights @ q, self.weights @ dual
        length = np.linalg.norm(b, axis=1, keepdims=True)
        b, d = b / length, d / length
        return rotate(b, self.nodes) + 2 * multiply(d, conjugate(b))[:, 1:]

    def cor(self, q, t):
        """LeHodgins16, algorithm 1; LBS where a node has no centre."""
        b = self.weights @ q
        b /= np.linalg.norm(b, axis=1, keepdims=True)
        about_centre = rotate(b, self.nodes - self.centre) + self.lbs(q, t, self.centre)
        return np.where(self.has_centre[:, None], about_centre, self.lbs(q, t, self.nodes))

    def pose(self, rotations, root_translation, method):
        """Vertices of every tissue, mm, by name."""
        q, t = self.motions(np.asarray(rotations), np.asarray(root_translation, float))
        nodes = {"lbs": lambda: self.lbs(q, t, self.nodes), "dqs": lambda: self.dqs(q, t), "cor": lambda: self.cor(q, t)}[method]()
        posed = {}
        for name, tissue in self.tissues.items():
            segment = tissue["segment"]
            if segment >= 0:
                posed[name] = rotate(q[segment], tissue["points"]) + t[segment]
            else:
                posed[name] = np.einsum("vk,vkc->vc", tissue["barycentric"], nodes[self.tets[tissue["tet"]]])
        return posed
