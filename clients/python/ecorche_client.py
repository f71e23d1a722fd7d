# SPDX-License-Identifier: Apache-2.0
"""A small client of an ecorche server: framed Protobuf over TCP (docs/reference/protocol.md), plain sockets, no threads.

    from ecorche_client import Client

    with Client("127.0.0.1", 7070) as client:
        body = client.open()                          # skeleton, tissues, triangles
        client.subscribe_mesh(["skin"])
        knee = body.joint("knee_right")
        for i in range(100):
            pose = body.rest_pose()
            pose[knee] = (math.cos(i / 200), math.sin(i / 200), 0, 0)   # (w, x, y, z), from the scanned rest pose
            client.send_pose(pose)
            for frame in client.frames(seconds=1 / 90):
                print(frame.pose_sequence, frame.positions["skin"].shape)   # mm, LPS

Needs numpy, the zstd library for compressed volumes, and the messages generated from proto/ecorche/v1 (the build leaves them in BUILD/proto/python):

    protoc -I proto --python_out=SOMEWHERE proto/ecorche/v1/*.proto       and SOMEWHERE on PYTHONPATH
"""
import select
import socket
import ssl
import struct
import time

import numpy as np

from ecorche.v1 import common_pb2, envelope_pb2, hello_pb2, model_pb2
from ecorche_frames import ENCODINGS, Body, MeshFrame, Part, ServerError, VolumeFrame, aligned, array, encode


class Client:
    """One connection. Not for several threads. Frames are acknowledged as they are read, so read often."""

    def __init__(self, host, port, name="python", timeout=30.0, tls_ca=None, token=b"", resume_token=b"", session=""):
        """`tls_ca`: a PEM file whose certificates are trusted; None: no TLS. `token`: of the right to connect.
        `resume_token`: `server.resume_token` of an earlier connection. `session`: that open() will name, by which a balancer in
        front of several servers chooses one."""
        self.timeout = timeout
        self.body = None
        self.acks = []            # v1.PoseAck since the last look
        self.model_changed = False  # ModelChanged came: open() again for the new one
        self.members, self.clip = None, None  # the newest v1.Members and v1.ClipState
        self.has_control = False  # as the server last said
        self.elsewhere = ""       # HOST:PORT of another server, where this one sent its clients to when it said goodbye
        self.bytes_received = 0
        self._requests = 0
        self._sequence = 0
        self._waiting = []
        self._address, self._access = (host, port), {"tls_ca": tls_ca, "token": token}
        self.parts = {}           # of subscriptions and levels that show less than whole tissues: Parts by tissue name
        self._keyframes, self._volume_keyframes = {}, {}
        self._buffer = bytearray()
        self._socket = socket.create_connection((host, port), timeout)
        self._socket.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        try:
            self._greet(host, name, tls_ca, token, resume_token, session)
        except BaseException:
            self._socket.close()
            raise

    def _greet(self, host, name, tls_ca, token, resume_token, session):
        if tls_ca is not None:
            self._socket = ssl.create_default_context(cafile=tls_ca).wrap_socket(self._socket, server_hostname=host)
        hello = envelope_pb2.Envelope()
        hello.client_hello.protocol_min = hello.client_hello.protocol_max = 1
        hello.client_hello.client = name
        hello.client_hello.token = token
        hello.client_hello.resume_token = resume_token
        hello.client_hello.session = session
        hello.client_hello.encodings.extend(ENCODINGS.values())
        hello.client_hello.features.extend([hello_pb2.FEATURE_PRESENCE, hello_pb2.FEATURE_CLIP_STATE])
        self.server = self._call(hello)[0].server_hello
        if self.server.protocol != 1:
            raise ConnectionError(f"the server speaks protocol {self.server.protocol}, this client 1")

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.close()

    def close(self):
        self._socket.close()

    def models(self):
        """What the server holds: a list of v1.ModelSummary."""
        request = envelope_pb2.Envelope()
        request.list_models.SetInParent()
        return list(self._call(request)[0].model_list.models)

    def open(self, model="", session="", watch=False):
        """Opens a model; the server's first by default, in a session of one's own by default. `watch`: only to look; control that is
        free is left to others."""
        request = envelope_pb2.Envelope()
        request.open_model.model = model
        request.open_model.session = session
        request.open_model.watch = watch
        answer, payload = self._call(request)
        self.body = Body(answer.model_opened, payload)
        self.model_changed = False
        self.has_control = answer.model_opened.role == model_pb2.ROLE_CONTROLLER
        self._sequence = answer.model_opened.last_sequence
        return self.body

    def subscribe_mesh(self, tissues=(), quality=False, encoding="f32", normals=False, level=0, adaptive=False, region=None,
                       max_rate=0.0, pose=False):
        """Frames of these tissues, of all by default; returns the subscription's number. `encoding`: of ENCODINGS. `level`: of
        detail, 0 (all) to 3; `adaptive`: the server may choose coarser ones. `region`: (low, high), mm, LPS, in the scan. See
        `parts` for which vertices come. `pose`: each frame's `message.pose` is what it shows."""
        request = envelope_pb2.Envelope()
        mesh = request.subscribe.mesh
        mesh.tissues.extend(tissues)
        mesh.encoding = ENCODINGS[encoding]
        mesh.normals, mesh.quality, mesh.level, mesh.adaptive, mesh.pose = normals, quality, level, adaptive, pose
        request.subscribe.max_rate = max_rate
        self._set_box(mesh, region)
        answer, payload = self._call(request)
        subscribed = answer.subscribed
        for one in subscribed.levels:
            self.parts[subscribed.subscription, one.level] = {
                self.body.tissues[part.tissue]: Part(part, payload) for part in one.parts}
        return subscribed.subscription

    def subscribe_volume(self, name, nearest=False, compressed=False, changed_bricks=False, region=None, max_rate=0.0):
        """Frames of a posed volume; returns the subscription's number. `compressed`: by zstd on the way; `changed_bricks`: only
        those between keyframes; either way frames hold all voxels. `region`: (low, high), mm, LPS, of the posed space."""
        request = envelope_pb2.Envelope()
        volume = request.subscribe.volume
        volume.volume = name
        volume.nearest, volume.compressed, volume.changed_bricks = nearest, compressed, changed_bricks
        request.subscribe.max_rate = max_rate
        self._set_box(volume, region)
        return self._call(request)[0].subscribed.subscription

    def unsubscribe(self, subscription):
        """Gives a subscription up; frames that came before the answer are still yielded."""
        request = envelope_pb2.Envelope()
        request.unsubscribe.subscription = subscription
        self._call(request)

    @staticmethod
    def _set_box(selection, region):
        if region is None:
            return
        for corner, values in zip((selection.region.min, selection.region.max), region):
            corner.x, corner.y, corner.z = map(float, values)

    def resume(self):
        """Goes on where `resume_token` says, once `server` has `resumed`: subscriptions are there, poses go on. The skeleton is
        read from a connection of its own, since a connection opens one model."""
        resumed = self.server.resumed
        with Client(*self._address, **self._access) as other:
            self.body = other.open(resumed.model)
        self._sequence = resumed.last_sequence
        return resumed

    def probe(self, points, to_rest=True, volumes=(), gradient=False, tissue=False):
        """Points (#P x 3, mm, LPS) of the posed body back to the scan, or the other way; a dictionary of arrays with a row per
        point: points, and as asked gradient (9 numbers), tissue and values."""
        payload = np.ascontiguousarray(points, dtype="<f8")
        request = envelope_pb2.Envelope()
        probe = request.probe_points
        probe.direction = probe.DIRECTION_POSED_TO_REST if to_rest else probe.DIRECTION_REST_TO_POSED
        probe.points.type, probe.points.components, probe.points.count = common_pb2.SCALAR_TYPE_F64, 3, len(payload)
        probe.volumes.extend(volumes)
        probe.deformation_gradient, probe.tissue = gradient, tissue
        answer, found = self._call(request, payload.tobytes().ljust(aligned(payload.nbytes), b"\0"))
        probed = answer.probed
        parts = {"points": probed.points, "gradient": probed.deformation_gradient, "tissue": probed.tissue, "values": probed.values}
        return {name: array(part, found) for name, part in parts.items() if part.components}

    def radiograph(self, view="ap", target="", content="integrals", size=(430.0, 430.0), pixels=(512, 512), **more):
        """A picture of the present pose as an X-ray source and a detector would make it: (rows by columns, the v1.Radiograph).
        `content`: integrals, grey_16 or grey_8. `view`: ap, pa, lateral_left, lateral_right, or None where `source` and `detector`
        (its middle), mm, LPS, say where they are. `more`: other fields of RenderRadiograph, as energy=80, surfaces=True."""
        request = envelope_pb2.Envelope()
        render = request.render_radiograph
        for name in ("source", "detector"):
            if name in more:
                corner = getattr(render.placed, name)
                corner.x, corner.y, corner.z = map(float, more.pop(name))
        if not render.HasField("placed"):
            render.view = render.View.Value(f"VIEW_{(view or 'ap').upper()}")
        render.target, render.content = target, render.Content.Value(f"CONTENT_{content.upper()}")
        (render.width, render.height), (render.columns, render.rows) = size, pixels
        for name, value in more.items():
            setattr(render, name, value)
        answer, payload = self._call(request)
        made = answer.radiograph
        return array(made.picture, payload).reshape(made.rows, made.columns), made

    def field(self, segment=None, tissues=()):
        """A number for every vertex in the present pose: a dictionary of arrays by tissue. How much it follows `segment` (a row of the
        skeleton), or without one the determinant of the deformation gradient about it."""
        request = envelope_pb2.Envelope()
        sample = request.sample_field
        sample.kind = sample.KIND_DET_F if segment is None else sample.KIND_WEIGHT
        sample.segment = segment or 0
        sample.tissues.extend(tissues)
        answer, payload = self._call(request)
        return {self.body.tissues[part.tissue]: array(part.values, payload)[:, 0] for part in answer.field.parts}

    def clips(self):
        """Motion that the server can play on this body: a list of v1.ClipSummary."""
        request = envelope_pb2.Envelope()
        request.list_clips.SetInParent()
        return list(self._call(request)[0].clip_list.clips)

    def play(self, name, speed=1.0, loop=False, position=0.0, paused=False):
        """Lets the server play a clip from `position` (s) on; "" stops it. `clip` tells where it is."""
        request = envelope_pb2.Envelope()
        request.play_clip.name, request.play_clip.speed, request.play_clip.loop = name, speed, loop
        request.play_clip.position, request.play_clip.paused = position, paused
        self._call(request)

    def steer(self, **to):
        """Changes how the clip plays: any of paused, position (s), step (poses), speed and loop."""
        request = envelope_pb2.Envelope()
        request.steer_clip.SetInParent()
        for name, value in to.items():
            setattr(request.steer_clip, name, value)
        self._call(request)

    def ask_control(self, withdraw=False):
        """Asks for the session's control; True where it was free. `members` tells who asks, `has_control` once it was given."""
        request = envelope_pb2.Envelope()
        request.ask_control.withdraw = withdraw
        return self._call(request)[0].WhichOneof("message") == "control_granted"

    def give_control(self, connection):
        """Gives the session's control to another of its `members`."""
        request = envelope_pb2.Envelope()
        request.give_control.connection = connection
        self._call(request)

    def record(self, name):
        """Lets the server record what is shown, under this name; None ends it."""
        request = envelope_pb2.Envelope()
        request.record.on = name is not None
        request.record.name = name or ""
        self._call(request)

    def reload(self, model):
        """Lets the server read a model's file again."""
        request = envelope_pb2.Envelope()
        request.reload_model.model = model
        self._call(request)

    def send_pose(self, rotations, root_translation=(0, 0, 0), skinning=common_pb2.SKINNING_COR):
        """Sends a whole pose (#joints x 4, w x y z) and returns its sequence number. Does not wait: see frames() and acks."""
        self._sequence += 1
        envelope = envelope_pb2.Envelope()
        update = envelope.pose_update
        update.sequence = self._sequence
        update.rig_digest = self.body.message.rig_digest
        update.root_translation.x, update.root_translation.y, update.root_translation.z = root_translation
        update.rotation.extend(np.asarray(rotations, dtype=float).ravel())
        update.skinning = skinning
        self._socket.sendall(encode(envelope))
        return self._sequence

    def frames(self, seconds):
        """Yields the MeshFrames and VolumeFrames that arrive within `seconds`."""
        until = time.monotonic() + seconds
        while True:
            message = self._waiting.pop(0) if self._waiting else self._read(until)
            if message is None:
                return
            envelope, payload = message
            kind = envelope.WhichOneof("message")
            if kind == "mesh_frame":
                mesh = envelope.mesh_frame
                yield MeshFrame(mesh, payload, self.body, self._keyframes, self.parts.get((mesh.subscription, mesh.level)))
            elif kind == "volume_frame":
                yield VolumeFrame(envelope.volume_frame, payload, self._volume_keyframes)
            elif kind == "pose_ack":
                self.acks.append(envelope.pose_ack)

    def _call(self, request, payload=b""):
        self._requests += 1
        request.request_id = self._requests
        self._socket.sendall(encode(request, payload))
        until = time.monotonic() + self.timeout
        while True:
            message = self._read(until)
            if message is None:
                raise TimeoutError("the server does not answer")
            if message[0].request_id != request.request_id:
                self._waiting.append(message)
                continue
            if message[0].WhichOneof("message") == "status" and message[0].status.code:
                raise ServerError(message[0].status)
            return message

    def _fill(self, size, until):
        """Waits for `size` bytes of the present frame; False when they do not come in time (they are kept)."""
        while len(self._buffer) < size:
            buffered = self._socket.pending() if isinstance(self._socket, ssl.SSLSocket) else 0
            if not buffered and not select.select([self._socket], [], [], max(0.0, until - time.monotonic()))[0]:
                return False
            received = self._socket.recv(max(65536, size - len(self._buffer)))
            if not received:
                raise ConnectionError("the server hung up")
            self.bytes_received += len(received)
            self._buffer += received
        return True

    def _read(self, until):
        """The next message and its payload, or None."""
        if not self._fill(8, until):
            return None
        envelope_bytes, payload_bytes = struct.unpack_from("<II", self._buffer)
        start = aligned(8 + envelope_bytes)
        if not self._fill(start + payload_bytes, until):
            return None
        envelope = envelope_pb2.Envelope.FromString(bytes(self._buffer[8:8 + envelope_bytes]))
        payload = bytes(self._buffer[start:start + payload_bytes])
        del self._buffer[:start + payload_bytes]
        self._attend(envelope)
        return envelope, payload

    def _attend(self, envelope):
        """What the protocol asks of every client at once."""
        kind = envelope.WhichOneof("message")
        answer = envelope_pb2.Envelope()
        if kind in ("mesh_frame", "volume_frame"):
            frame = getattr(envelope, kind)
            answer.frame_ack.subscription = frame.subscription
            answer.frame_ack.frame = frame.frame
            self._socket.sendall(encode(answer))
        elif kind == "ping":
            answer.request_id = envelope.request_id
            answer.pong.data = envelope.ping.data
            self._socket.sendall(encode(answer))
        elif kind == "pose_ack":  # of poses that the server played, too: ours go on from there
            self._sequence = max(self._sequence, envelope.pose_ack.sequence)
        elif kind == "model_changed":
            self.model_changed = True
        elif kind == "members":
            self.members = envelope.members
        elif kind == "clip_state":
            self.clip = envelope.clip_state
        elif kind == "control_changed":
            self.has_control = envelope.control_changed.role == model_pb2.ROLE_CONTROLLER
        elif kind == "control_granted":
            self.has_control = True
            self._sequence = envelope.control_granted.last_sequence
        elif kind == "goodbye":
            self.elsewhere = envelope.goodbye.elsewhere
            raise ServerError(envelope.goodbye.status)
        elif kind == "status" and envelope.request_id == 0:
            raise ServerError(envelope.status)
