# SPDX-License-Identifier: Apache-2.0
"""What comes from a server and goes to it (docs/reference/protocol.md), as numpy arrays: the bytes of frames, bodies, posed surfaces and
volumes. Needs no connection."""
import struct

import numpy as np

import ecorche_encodings
from ecorche.v1 import common_pb2, stream_pb2

ALIGNMENT = 16
ENCODINGS = {"f32": common_pb2.ENCODING_F32, "u16": common_pb2.ENCODING_U16, "u16-delta": common_pb2.ENCODING_U16_DELTA}
SCALARS = {getattr(common_pb2, "SCALAR_TYPE_" + name): np.dtype(code) for name, code in (
    ("U8", "<u1"), ("I8", "<i1"), ("U16", "<u2"), ("I16", "<i2"), ("U32", "<u4"), ("I32", "<i4"), ("F32", "<f4"), ("F64", "<f8"))}


class ServerError(Exception):
    """A Status of the server that is not OK; `code` is a google.rpc number."""

    def __init__(self, status):
        super().__init__(f"status {status.code}: {status.message}")
        self.code = status.code


def aligned(size):
    return -(-size // ALIGNMENT) * ALIGNMENT


def encode(envelope, payload=b""):
    """The bytes of one frame; the payload must be a multiple of 16 long."""
    body = envelope.SerializeToString()
    head = struct.pack("<II", len(body), len(payload)) + body
    return head.ljust(aligned(len(head)), b"\0") + payload


def array(description, payload):
    """The rows that a v1.Array describes, count x components, without copying."""
    dtype = SCALARS[description.type]
    size = description.count * description.components
    if description.offset % ALIGNMENT or description.offset + size * dtype.itemsize > len(payload):
        raise ValueError("an array reaches beyond its payload")
    flat = np.frombuffer(payload, dtype, size, description.offset)
    return flat.reshape(description.count, description.components)


class Body:
    """What OpenModel told: `message` is the v1.ModelOpened; `triangles` has one #F x 3 array per tissue name."""

    def __init__(self, message, payload):
        self.message = message
        self.joints = [segment.joint.name for segment in message.skeleton.segments]
        self.tissues = [tissue.name for tissue in message.tissues]
        self.triangles = {tissue.name: array(tissue.triangles, payload)
                          for tissue in message.tissues if tissue.HasField("triangles")}

    def joint(self, name):
        """Row of a joint in poses."""
        return self.joints.index(name)

    def rest_pose(self):
        """The scanned rest pose: #joints x 4, (w, x, y, z)."""
        pose = np.zeros((len(self.joints), 4))
        pose[:, 0] = 1
        return pose


class Part:
    """What a level of detail or a region shows of a tissue: `vertices`, its rows of the whole one, and `triangles`, #F x 3 rows
    of `vertices`."""

    def __init__(self, message, payload):
        self.vertices = array(message.vertices, payload)[:, 0]
        self.triangles = array(message.triangles, payload)


class MeshFrame:
    """`positions`: #V x 3 float32, mm, LPS, by tissue name; `normals` likewise where they were asked for. `parts`: a Part by
    tissue name where it shows less than whole tissues, else None. `quality`: the newest v1.PoseQuality.

    `keyframes` is kept from frame to frame: the numbers of the last keyframe of every subscription and level."""

    def __init__(self, message, payload, body, keyframes, parts=None):
        self.message, self.parts, self.level, self.quality = message, parts, message.level, message.quality
        self.subscription, self.pose_sequence = message.subscription, message.pose_sequence
        self.positions, self.normals = {}, {}
        numbers = {}
        place = message.subscription, message.level
        if message.encoding == common_pb2.ENCODING_U16_DELTA and message.keyframe != message.frame:
            number, key = keyframes.get(place, (None, {}))
            if number != message.keyframe:
                raise ValueError(f"frame {message.frame} is against keyframe {message.keyframe}, which did not come")
        else:
            key = None
        for entry in message.arrays:
            name, rows = body.tissues[entry.tissue], array(entry.array, payload)
            if entry.kind == stream_pb2.MeshArray.KIND_NORMALS:
                self.normals[name] = ecorche_encodings.normals(rows)
            elif message.encoding == common_pb2.ENCODING_F32:
                self.positions[name] = rows
            else:
                numbers[name] = rows if key is None else ecorche_encodings.decode_delta(rows[:, 0], key[name])
                self.positions[name] = ecorche_encodings.positions(numbers[name], message.box)
        if message.encoding == common_pb2.ENCODING_U16_DELTA and key is None:
            keyframes[place] = message.frame, numbers


class VolumeFrame:
    """`voxels`: size_k x size_j x size_i (x components); where they lie is in `message.grid`. Of slices, which have no grid, all
    pixels in one row.

    `keyframes` is kept from frame to frame: the last keyframe of every subscription, for those of changed bricks."""

    def __init__(self, message, payload, keyframes):
        self.message = message
        self.subscription, self.pose_sequence = message.subscription, message.pose_sequence
        if message.status.code:
            raise ServerError(message.status)
        rows = array(message.voxels, payload)
        if message.HasField("content"):
            size = message.content.count * message.content.components * SCALARS[message.content.type].itemsize
            rows = array(message.content, ecorche_encodings.decompress(rows, size))
        if message.HasField("bricks"):
            number, key = keyframes.get(message.subscription, (None, None))
            if number != message.keyframe:
                raise ValueError(f"frame {message.frame} is against keyframe {message.keyframe}, which did not come")
            self.voxels = ecorche_encodings.with_bricks(key, array(message.bricks, payload)[:, 0], rows)
            return
        if message.HasField("grid"):
            rows = rows.reshape(message.grid.size_k, message.grid.size_j, message.grid.size_i, *rows.shape[1:])
        self.voxels = rows.squeeze(-1) if rows.shape[-1] == 1 else rows
        if message.keyframe == message.frame:
            keyframes[message.subscription] = message.frame, self.voxels
