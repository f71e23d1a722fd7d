# SPDX-License-Identifier: Apache-2.0
"""What goes wrong around a server while it serves, one thing after the other: clients that are cut, a disk that is full, a model that is
replaced, a clock that is stepped, a network that loses packets. After each a client's frames are held against offline posing."""
import contextlib
import dataclasses
import json
import os
import pathlib
import shutil
import socket
import struct
import subprocess
import sys
import threading
import time

import programs
from beside import Beside

sys.path[:0] = [str(programs.ROOT / "build/release/proto/python"), str(programs.ROOT / "clients/python"),
                str(programs.ROOT / "tests/e2e/stream")]
from ecorche_client import Client, ServerError  # noqa: E402
from slow_link import NEAR, SlowLink  # noqa: E402

CLOCK = programs.ROOT / "build/release/tests/support/libstepped_clock.so"
DISK_KIB = 256
LOSS = 0.05


@dataclasses.dataclass
class Fault:
    name: str
    wanted: str
    times: int = 0
    bad: list = dataclasses.field(default_factory=list)
    lacks: str = ""  # why it cannot be done here


class Place:
    """The folder of a soak: the model that is served, a small disk for recordings, and what steps the server's clock. `link`: where the
    system lets us, two network namespaces with a line between that loses packets; the server is at its near end."""

    def __init__(self, folder, model, others):
        self.folder = pathlib.Path(folder)
        self.model, self.good = self.folder / "served.hdf", model
        self.other, self.others = self.folder / "other.hdf", others  # two bodies that take turns under one name
        self.records, self.clock = self.folder / "records", self.folder / "clock"
        self.program = self.folder / "ecorche"
        self.clips = self.folder / "clips"
        self.sequence = self.clips / "sequence.yaml"
        self._cleanup = contextlib.ExitStack()
        self.link, self.no_link, self.no_disk = None, "", ""

    def __enter__(self):
        shutil.copy(self.good, self.model)
        shutil.copy(self.others[0], self.other)
        self.records.mkdir()
        self.clips.mkdir()
        self.step_clock(0)
        self.program.write_text(f'#!/bin/sh\nexec env LD_PRELOAD={CLOCK} STEPPED_CLOCK={self.clock} {programs.ECORCHE} "$@"\n')
        self.program.chmod(0o755)
        rig = programs.ecorche("info", self.good)
        skeleton = rig.get("skeleton", rig["name"])
        self.sequence.write_text(f"ecorche_pose_sequence: 1\nskeleton: {skeleton}\nkeys:\n- {{time_s: 0, pose: lib:anatomical}}\n"
                                 "- {time_s: 1, pose: lib:arms_up}\n- {time_s: 2, pose: lib:sitting}\n")
        try:
            call("mount", "-t", "tmpfs", "-o", f"size={DISK_KIB}k", "tmpfs", self.records)
            self._cleanup.callback(call, "umount", self.records)
        except (OSError, subprocess.CalledProcessError) as error:
            self.no_disk = f"no small disk: {error}"
        try:
            self.link = self._cleanup.enter_context(SlowLink(rate=100e6, delay=0.01, loss=LOSS))
        except (OSError, subprocess.CalledProcessError) as error:
            self.no_link = f"no namespaces: {error}"
        return self

    def __exit__(self, *_):
        self._cleanup.close()

    def step_clock(self, seconds):
        with self.clock.open("r+b" if self.clock.exists() else "wb", buffering=0) as file:
            file.write(struct.pack("<q", seconds))

    def put_model(self, data):
        put(self.model, data)

    def put_other(self):
        """The other of the two bodies in place of the one that is served; its file."""
        self.others = self.others[::-1]
        put(self.other, self.others[0].read_bytes())
        return self.others[0]

    def where(self):
        """Sockets that the calling thread makes, and programs that it starts, are where the server is."""
        return self.link.at(self.link.near) if self.link else contextlib.nullcontext()

    def within(self, words):
        """The words, run where the server is."""
        return ["ip", "netns", "exec", self.link.near, *words] if self.link else list(words)


def put(path, data):
    """Whole or not at all, as whoever replaces a model should."""
    beside = path.with_suffix(".new")
    beside.write_bytes(data)
    beside.replace(path)


def call(*words):
    subprocess.run([str(word) for word in words], check=True, capture_output=True, text=True)


class Faults(Beside):
    """The plan, from when the server serves."""

    def __init__(self, place, port):
        self.port = port
        self.plan = {
            self.cut: Fault("clients cut amid a frame", "all others' frames right"),
            self.fill_disk: Fault(f"a disk of {DISK_KIB} KiB full while recording", "it is told, the next is whole", lacks=place.no_disk),
            self.replace_model: Fault("the model replaced by a damaged one, then by a good one", "refused, then read"),
            self.replace_body: Fault("a model replaced by another body that a client poses", "it is told, frames of both right"),
            self.step_clock: Fault("the clock stepped by an hour, on and back", "nobody dropped"),
            self.lose_packets: Fault(f"a network that loses {LOSS:.0%}", "frames right", lacks=place.no_link)}
        super().__init__(place, 5, self.plan)

    def do(self, one):
        fault = self.plan[one]
        if fault.lacks:
            return
        fault.times += 1
        try:
            one()
            self.check_frames(f"127.0.0.1:{self.port}", self.place.within)
        except Exception as error:  # noqa: BLE001: whatever it is, it is told
            fault.bad.append(f"{type(error).__name__}: {error}")

    def check_frames(self, address, within, seconds=2, *more, model=None):
        """Plays poses, and holds every frame against offline posing."""
        words = within([programs.ECORCHE, "--json", "stream", address, "--motion", self.place.sequence, "--rate", 20,
                        "--seconds", seconds, "--model", model or self.place.good, *more])
        done = subprocess.run([str(word) for word in words], capture_output=True, text=True, timeout=120)
        if done.returncode != 0:
            raise RuntimeError(f"stream ended with {done.returncode}: {done.stderr.strip()[-300:]}")
        told = json.loads(done.stdout)
        if told["mismatches"] or not told["checked"]:
            raise RuntimeError(f"{told['mismatches']} of {told['checked']} frames are wrong")

    @contextlib.contextmanager
    def posing(self, model=""):
        """A client with the body open, and a way to have it posed."""
        with Client("127.0.0.1", self.port) as client:
            body = client.open(model)

            def pose(times):
                for _ in range(times):
                    client.send_pose(body.rest_pose())
                    for _frame in client.frames(seconds=0.02):
                        pass

            yield client, pose

    def cut(self):
        for _ in range(10):
            with self.posing() as (client, _):
                client.subscribe_mesh()
                client.send_pose(client.body.rest_pose())
                client._socket.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, struct.pack("ii", 1, 0))  # goes by a reset

    def fill_disk(self):
        disk = self.place.records
        with self.posing() as (client, pose):
            client.subscribe_mesh()
            filler = disk / "filler"
            filler.write_bytes(bytes(max(0, os.statvfs(disk).f_bavail * os.statvfs(disk).f_frsize - 8192)))
            client.record("full")
            pose(100)
            try:
                client.record(None)
            except ServerError as error:
                if "No space left" not in str(error):
                    raise
            else:
                raise RuntimeError("a recording ended well on a full disk")
            finally:
                filler.unlink()
            for left in disk.iterdir():
                left.unlink()
            client.record("next")
            pose(10)
            client.record(None)
            until = time.monotonic() + 20
            while not (disk / "next.ecrec").exists():
                if time.monotonic() > until:
                    raise RuntimeError(f"no recording after the disk was full: {[one.name for one in disk.iterdir()]}")
                time.sleep(0.1)
            for left in disk.iterdir():
                left.unlink()

    def replace_model(self):
        good = self.place.good.read_bytes()
        with self.posing() as (client, pose):
            self.place.put_model(good[:len(good) // 2])
            try:
                client.reload(self.place.model.stem)
            except ServerError:
                pass
            else:
                raise RuntimeError("half a model was read")
            finally:
                self.place.put_model(good)
            pose(3)
            client.reload(self.place.model.stem)

    def replace_body(self):
        def right(model):
            self.check_frames(f"127.0.0.1:{self.port}", self.place.within, 1, "--open", self.place.other.stem, model=model)

        with self.posing(self.place.other.stem) as (client, pose):
            client.subscribe_mesh()
            pose(3)
            right(self.place.others[0])
            now = self.place.put_other()
            client.reload(self.place.other.stem)
            pose(3)
            if not client.model_changed:
                raise RuntimeError("nobody told the client that its model was replaced")
        right(now)

    def step_clock(self):
        with self.posing() as (client, pose):
            client.subscribe_mesh()
            for seconds in (3600, -3600, 0):
                self.place.step_clock(seconds)
                pose(10)

    def lose_packets(self):
        """The server listens on loopback only: the line's near end is carried there."""
        with contextlib.closing(socket.create_server((NEAR, 0))) as listener:
            threading.Thread(target=self._carry, args=(listener,), daemon=True).start()
            self.check_frames(f"{NEAR}:{listener.getsockname()[1]}", lambda words: ["ip", "netns", "exec", self.place.link.far, *words], 10,
                              "--encoding", "u16-delta")

    def _carry(self, listener):
        with contextlib.suppress(OSError), listener.accept()[0] as near, socket.create_connection(("127.0.0.1", self.port)) as there:
            back = threading.Thread(target=pass_on, args=(there, near))
            back.start()
            pass_on(near, there)
            back.join()


def pass_on(one, other):
    with contextlib.suppress(OSError):
        while data := one.recv(1 << 16):
            other.sendall(data)
    with contextlib.suppress(OSError):
        other.shutdown(socket.SHUT_WR)
