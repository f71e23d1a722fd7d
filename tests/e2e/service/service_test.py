#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""`ecorche serve` under a service manager: what it tells, the ports that it is passed, SIGHUP; and the unit files of deploy/systemd.

usage: service_test.py SOURCE; the environment is that of the fixtures
"""
import fcntl
import os
import pathlib
import re
import shutil
import signal
import socket
import subprocess
import sys
import tempfile
import time
import unittest
import urllib.request

from ecorche_client import Client

SOURCE = pathlib.Path(sys.argv[1])
UNITS = SOURCE / "deploy" / "systemd"
ECORCHE, MODEL = os.environ["ECORCHE_BIN"], os.environ["ECORCHE_MODEL"]
OTHER_MODEL = os.environ["ECORCHE_MODELS"].split(":")[-1]


class Manager:
    """Starts a service as systemd does: with a socket to be told at, and ports that listen already."""

    def __init__(self, *words, passed=(), names=None, abstract=False):
        self._folder = tempfile.TemporaryDirectory()
        self.told = socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM)
        path = f"{self._folder.name}/notify" if not abstract else f"@ecorche_{os.getpid()}_{id(self)}"
        self.told.bind(path.replace("@", "\0", 1) if abstract else path)
        environment = {**os.environ, "NOTIFY_SOCKET": path}
        if passed:
            environment["LISTEN_FDS"] = str(len(passed))
            if names is not None:
                environment["LISTEN_FDNAMES"] = names

        def place():
            high = [fcntl.fcntl(one.fileno(), fcntl.F_DUPFD, 50) for one in passed]
            for number, handle in enumerate(high):
                os.dup2(handle, 3 + number)

        # The number of the process is known in the process alone.
        self.process = subprocess.Popen(
            ["sh", "-c", 'export LISTEN_PID=$$; exec "$@"', "sh", ECORCHE, "serve", *map(str, words)], env=environment, text=True,
            stdout=subprocess.PIPE, stderr=subprocess.PIPE, preexec_fn=place, pass_fds=tuple(range(3, 3 + len(passed))))

    def says(self, seconds=60):
        """The next message, as a dictionary; None where none comes."""
        self.told.settimeout(seconds)
        try:
            message = self.told.recv(4096).decode()
        except TimeoutError:
            return None
        return dict(line.split("=", 1) for line in message.splitlines())

    def __enter__(self):
        return self

    def __exit__(self, *_):
        if self.process.poll() is None:
            self.process.terminate()
            self.process.communicate(timeout=30)
        self.process.stdout.close()
        self.process.stderr.close()
        self.told.close()
        self._folder.cleanup()


def listening():
    port = socket.create_server(("127.0.0.1", 0))
    return port, port.getsockname()[1]


class Service(unittest.TestCase):
    def test_it_is_ready_once_it_answers(self):
        for abstract in (False, True):
            with tempfile.TemporaryDirectory() as folder, \
                    Manager(MODEL, "--listen", "127.0.0.1:0", "--no-http", "--port-file", f"{folder}/port", abstract=abstract) as manager:
                ready = manager.says()
                self.assertEqual(ready["READY"], "1")
                port = int(pathlib.Path(folder, "port").read_text())
                self.assertEqual(ready["STATUS"], f"listening on 127.0.0.1:{port}")
                with Client("127.0.0.1", port) as client:
                    client.open()
                manager.process.terminate()
                self.assertEqual(manager.says(), {"STOPPING": "1"})
                manager.process.communicate(timeout=30)
                self.assertEqual(manager.process.returncode, 0)

    def test_who_knows_the_port_may_send_sighup(self):
        """Though its next words, which nobody reads, hold it up: a pipe that is full."""
        reader, writer = os.pipe()
        os.set_blocking(writer, False)
        try:
            while os.write(writer, bytes(4096)):
                pass
        except BlockingIOError:
            os.set_blocking(writer, True)
        with tempfile.TemporaryDirectory() as folder:
            port = pathlib.Path(folder, "port")
            server = subprocess.Popen([ECORCHE, "serve", MODEL, "--listen", "127.0.0.1:0", "--no-http", "--port-file", port], stdout=writer,
                                      stderr=subprocess.PIPE, text=True)
            os.close(writer)
            until = time.monotonic() + 60
            while not port.exists() and server.poll() is None and time.monotonic() < until:
                time.sleep(0.005)
            server.send_signal(signal.SIGHUP)
            while b"listening on" not in (said := os.read(reader, 1 << 16)):
                self.assertTrue(said, "SIGHUP ended it")
            os.close(reader)
            server.terminate()
            _, err = server.communicate(timeout=30)
            self.assertEqual(server.returncode, 0, err)
            self.assertIn("asked to read the models again", err)

    def test_what_fails_is_never_ready(self):
        with Manager("/nowhere.hdf", "--listen", "127.0.0.1:0", "--no-http") as manager:
            _, err = manager.process.communicate(timeout=60)
            self.assertEqual(manager.process.returncode, 66, err)
            self.assertIsNone(manager.says(0.1))

    def test_whoever_came_before_the_server_is_served(self):
        frames, port = listening()
        pages, http = listening()
        early = socket.create_connection(("127.0.0.1", port))  # waits in the kernel
        # The options name ports that nobody may have: what is passed comes before them.
        with frames, pages, early, Manager(MODEL, "--listen", "127.0.0.1:1", "--http", "127.0.0.1:1", passed=(frames, pages),
                                           names="ecorche.socket:ecorche.socket") as manager:
            self.assertEqual(manager.says()["STATUS"], f"listening on 127.0.0.1:{port}")
            with Client("127.0.0.1", port) as client:
                client.open()
                client.subscribe_mesh(["skin"])
                self.assertTrue(list(client.frames(5))[:1])
            with urllib.request.urlopen(f"http://127.0.0.1:{http}/healthz") as answer:
                self.assertEqual(answer.status, 200)
            early.settimeout(10)
            early.sendall(b"\xff" * 64)
            self.assertTrue(early.recv(64), "it is told that it said nonsense")

    def test_a_port_is_known_by_its_name(self):
        pages, http = listening()
        frames, port = listening()
        with frames, pages, Manager(MODEL, passed=(pages, frames), names="http:frames") as manager:
            self.assertEqual(manager.says()["STATUS"], f"listening on 127.0.0.1:{port}")
            with urllib.request.urlopen(f"http://127.0.0.1:{http}/readyz") as answer:
                self.assertEqual(answer.status, 200)

    def test_ports_that_cannot_be_used_are_refused(self):
        open_port = socket.create_server(("0.0.0.0", 0))
        first, second, third = (listening()[0] for _ in range(3))
        mute = socket.socket()
        cases = (((open_port,), (), 77, "0.0.0.0: is reachable by others"),
                 ((first, second, third), (), 78, "LISTEN_FDS: 3 sockets are passed, for two ports"),
                 ((first, second), ("--no-http",), 78, "LISTEN_FDS: a socket for HTTP is passed, and --no-http given"),
                 ((mute,), (), 78, "LISTEN_FDS: socket 3 does not listen"))
        for passed, options, code, what in cases:
            with self.subTest(what), Manager(MODEL, *options, passed=passed) as manager:
                _, err = manager.process.communicate(timeout=60)
                self.assertEqual(manager.process.returncode, code, err)
                self.assertIn(f"error: {what}", err)
        for one in (open_port, first, second, third, mute):
            one.close()

    def test_a_replaced_model_is_read_on_sighup(self):
        with tempfile.TemporaryDirectory() as folder:
            model = pathlib.Path(folder, "body.hdf")
            shutil.copy(MODEL, model)
            frames, port = listening()
            with frames, Manager(model, "--no-http", passed=(frames,)) as manager, Client("127.0.0.1", port) as old:
                self.assertEqual(manager.says()["READY"], "1")
                before = old.open("body").message.identity
                changed = pathlib.Path(folder, "changed")
                shutil.copy(OTHER_MODEL, changed)
                changed.rename(model)
                asked = time.monotonic_ns() // 1000
                manager.process.send_signal(signal.SIGHUP)
                reloading = manager.says()
                self.assertEqual(reloading["RELOADING"], "1")
                self.assertGreaterEqual(int(reloading["MONOTONIC_USEC"]), asked)
                self.assertEqual(manager.says(), {"READY": "1"})
                # Ready again means read again: no waiting here.
                with Client("127.0.0.1", port) as new:
                    self.assertNotEqual(new.open("body").message.identity, before)
                old.subscribe_mesh(["skin"])  # who has the old one keeps it
                self.assertTrue(list(old.frames(5))[:1])
                # What comes while models are read is not lost.
                for _ in range(3):
                    manager.process.send_signal(signal.SIGHUP)
                    self.assertEqual(manager.says()["RELOADING"], "1")
                for _ in range(3):
                    said = manager.says()
                    while said and "RELOADING" in said:
                        said = manager.says()
                    self.assertEqual(said, {"READY": "1"})


class Units(unittest.TestCase):
    @unittest.skipUnless(shutil.which("systemd-analyze"), "no systemd-analyze")
    def test_systemd_takes_them(self):
        with tempfile.TemporaryDirectory() as folder:
            units = sorted(UNITS.iterdir())
            for unit in units:
                # Verified is also that the command is there: this build's.
                pathlib.Path(folder, unit.name).write_text(unit.read_text().replace("ExecStart=ecorche ", f"ExecStart={ECORCHE} "))
            for unit in units:
                result = subprocess.run(["systemd-analyze", "verify", "--man=no", unit.name], capture_output=True, text=True, cwd=folder,
                                        env={**os.environ, "SYSTEMD_UNIT_PATH": f"{folder}:"})
                said = "\n".join(line for line in result.stderr.splitlines() if "ecorche" in line)
                self.assertEqual((result.returncode, said), (0, ""), unit.name)

    @unittest.skipUnless(shutil.which("systemd-analyze"), "no systemd-analyze")
    def test_the_service_may_little(self):
        result = subprocess.run(["systemd-analyze", "security", "--offline=true", "--threshold=15", "--no-pager", UNITS / "ecorche.service"],
                                capture_output=True, text=True)
        self.assertEqual(result.returncode, 0, result.stdout + result.stderr)
        exposure = float(re.search(r"exposure level for ecorche.service: ([\d.]+)", result.stdout)[1])
        self.assertLessEqual(exposure, 1.5)

    def test_the_service_has_what_was_promised(self):
        text = (UNITS / "ecorche.service").read_text()
        for line in ("Type=notify", "DynamicUser=yes", "ProtectSystem=strict", "NoNewPrivileges=yes", 'ExecReload=sh -c "kill -HUP ${MAINPID}"'):
            self.assertIn(f"\n{line}\n", text)
        self.assertRegex(text, r"\nMemoryMax=\d+%\n")


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1])
