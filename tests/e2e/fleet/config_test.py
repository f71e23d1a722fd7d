#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""`ecorche serve` by a configuration file, tokens with roles that change under way, and its log as JSON.

usage: config_test.py SOURCE; the environment is that of the fixtures
"""
import hashlib
import json
import os
import pathlib
import re
import signal
import subprocess
import sys
import tempfile
import time
import unittest
import urllib.request

from ecorche.v1 import envelope_pb2
from ecorche_client import Client, ServerError
from serving import Server

ECORCHE, MODEL = os.environ["ECORCHE_BIN"], os.environ["ECORCHE_BAR_MODEL"]


def digest(token):
    return hashlib.sha256(token.encode()).hexdigest()


class Folder(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = pathlib.Path(folder.name)

    def write(self, name, text):
        path = self.folder / name
        path.write_text(text)
        return path

    def checked(self, text, *words):
        """`serve --check-config` of such a file: exit code, result, last line of stderr."""
        path = self.write("serve.yaml", text)
        done = subprocess.run([ECORCHE, "--json", "serve", "--config", path, "--check-config", *words], capture_output=True, text=True, timeout=60)
        return done.returncode, json.loads(done.stdout), (done.stderr.splitlines() or [""])[-1]

    def refused(self, text, *words):
        code, _, said = self.checked(text, *words)
        self.assertEqual(code, 78, said)
        return said.replace(f"error: {self.folder}/serve.yaml:", "")


class Config(Folder):
    def test_what_is_good(self):
        code, result, _ = self.checked(f"models: [{MODEL}]\nlisten: 127.0.0.1:7171\nno_http: true\nmax_connections: 12\ninsecure: false\nthreads: 2\n")
        self.assertEqual((code, result["ok"], result["models"], result["address"], result["tokens"]), (0, True, 1, "127.0.0.1:7171", 0))

    def test_one_model_needs_no_list_and_the_command_line_wins(self):
        code, result, _ = self.checked(f"models: {MODEL}\nlisten: 127.0.0.1:7171\nno_http: true\n", "--listen", "127.0.0.1:7272", "--http", "127.0.0.1:7273")
        self.assertEqual((code, result["address"]), (0, "127.0.0.1:7272"))

    def test_what_is_wrong_is_told_with_line_and_key(self):
        for text, said in {
            f"models: [{MODEL}]\nmax_conections: 3\n": "2:max_conections: unknown key 'max_conections' (did you mean 'max_connections'?)",
            f"models: [{MODEL}]\n\nmax_connections: 0\n": "3:max_connections: --max-connections: Value 0 not in range 1 to 65536 (see --help)",
            "max_connections: many\n": "1:max_connections: ",
            f"models: [{MODEL}]\nlog: loud\n": "2:log: --log: loud not in {debug,info,warn,error,off} (see --help)",
            "log: [info, warn]\n": "1:log: a list, where one value belongs (give one value)",
            "models: []\n": "1:models: an empty list (leave the key out, or give values)",
            "pose_rate: nan\n": "1:pose_rate: 'nan' is no number (see --help)",
            "insecure: yes\n": "1:insecure: 'yes' is neither true nor false (write one of the two)",
            "http: 127.0.0.1:0\nno_http: true\n": "2:no_http: goes not together with http (leave one of them out)",
            "config: other.yaml\n": "1:config: unknown key 'config'",
        }.items():
            with self.subTest(text=text):
                found = self.refused(text)
                self.assertTrue(found.startswith(said), found)

    def test_what_serving_would_refuse(self):
        code, _, said = self.checked("listen: 127.0.0.1:7171\n")
        self.assertEqual((code, said), (64, "error: ecorche serve: models is required (see ecorche serve --help)"))
        code, _, said = self.checked(f"models: [{MODEL}]\nlisten: 0.0.0.0:7171\n")
        self.assertEqual(code, 77, said)
        code, _, said = self.checked(f"models: [{self.folder}/none.hdf]\n")
        self.assertEqual(code, 66, said)
        code, _, said = self.checked(f"models: [{MODEL}]\nelsewhere: nowhere\n")
        self.assertEqual(code, 64, said)

    def test_it_serves_so(self):
        config = self.write("serve.yaml", f"models:\n  - {MODEL}\nmax_connections: 7\n")
        with Server("--config", config) as server, Client("127.0.0.1", server.port) as client:
            self.assertEqual(client.server.limits.connections, 7)

    def test_the_kernel_may_merge_pages(self):
        if tuple(map(int, os.uname().release.split(".")[:2])) < (6, 4):
            code, _, said = self.checked(f"models: [{MODEL}]\nmerge_pages: true\n")
            self.assertEqual(code, 77, said)
            return
        with Server(MODEL, options=("--merge-pages",)) as merged, Server(MODEL) as alone:
            for server, word in ((merged, "yes"), (alone, "no")):
                told = pathlib.Path(f"/proc/{server.process.pid}/ksm_stat").read_text()
                if "ksm_merge_any" in told:  # younger kernels say it
                    self.assertIn(f"ksm_merge_any: {word}", told)

    def test_every_option_may_stand_there(self):
        """The keys are the options: each that --help names, but for those about the command line and the file itself."""
        text = subprocess.run([ECORCHE, "serve", "--help"], capture_output=True, text=True, check=True).stdout
        options = set(re.findall(r"^  (?:-\w,)?--([a-z-]+)", text, re.M))
        self.assertGreater(len(options), 40)
        keys = [name.replace("-", "_") for name in sorted(options - {"help", "config", "check-config"})]
        # Keys are looked at before any value.
        found = self.refused("".join(f"{key}: {{}}\n" for key in keys) + "not_one: 1\n")
        self.assertTrue(found.startswith(f"{len(keys) + 1}:not_one: unknown key 'not_one'"), found)


TOKENS = {"nurse-token-0123456789": "watch", "trainer-token-0123456789": "pose", "admin-token-0123456789": "manage"}


def tokens_file(tokens, extra=""):
    rows = "".join(f"  - {{name: {token.split('-')[0]}, sha256: {digest(token)}, role: {role}{extra}}}\n" for token, role in tokens.items())
    return "ecorche_tokens: 1\ntokens:\n" + rows


class Tokens(Folder):
    def connect(self, server, token, session=""):
        client = Client("127.0.0.1", server.port, token=token.encode())
        self.addCleanup(client.close)
        body = client.open(session=session)
        return client, body

    def test_what_is_wrong_is_told(self):
        good = tokens_file({"nurse-token-0123456789": "watch"})
        for text, said in {
            good.replace("watch", "own"): "role: unknown role 'own'",
            good.replace("tokens: 1", "tokens: 2"): "ecorche_tokens: version 2 is unknown",
            re.sub("sha256: .", "sha256: x", good): "is no SHA-256 of 64 hexadecimal digits",
            good.replace("role:", "rule:"): "tokens[0].rule: unknown key 'rule' (did you mean 'role'?)",
            good + good.splitlines()[-1] + "\n": "two tokens have this name",
            good + good.splitlines()[-1].replace("nurse", "other") + "\n": "two tokens have this digest",
            "ecorche_tokens: 1\ntokens: []\n": "no token is there",
            tokens_file({"nurse-token-0123456789": "watch"}, ", max_connections: 0"): "0 is not 1 to 65536",
            tokens_file({"nurse-token-0123456789": "watch"}, ", message_rate: 0.5"): "0.5 is not 1 to 1e6",
        }.items():
            with self.subTest(said=said):
                path = self.write("tokens.yaml", text)
                found = self.refused(f"models: [{MODEL}]\ntokens: {path}\n")
                self.assertTrue(found.startswith(f"error: {path}:"), found)
                self.assertIn(said, found)

    def test_roles(self):
        path = self.write("tokens.yaml", tokens_file(TOKENS))
        with Server(MODEL, options=("--tokens", str(path), "--http", "127.0.0.1:0")) as server:
            with self.assertRaises(ServerError):
                Client("127.0.0.1", server.port, token=b"nobodys-token-0123456789")
            watcher, _ = self.connect(server, "nurse-token-0123456789", "ward_3")
            self.assertFalse(watcher.has_control, "it was the first, and yet")
            poser, body = self.connect(server, "trainer-token-0123456789", "ward_3")
            self.assertTrue(poser.has_control)
            watcher.subscribe_mesh()
            poser.send_pose(body.rest_pose())
            self.assertTrue(any(frame.pose_sequence == 1 for frame in watcher.frames(seconds=10)))
            for client, allowed in ((poser, False), (self.connect(server, "admin-token-0123456789")[0], True)):
                if allowed:
                    client.reload(pathlib.Path(MODEL).stem)
                else:
                    with self.assertRaisesRegex(ServerError, "may only pose"):
                        client.reload(pathlib.Path(MODEL).stem)
            page = urllib.request.Request(f"http://127.0.0.1:{server.http_port}/metrics", headers={"Authorization": "Bearer nurse-token-0123456789"})
            with urllib.request.urlopen(page) as answer:
                self.assertEqual(answer.status, 200)

    def test_they_change_under_way(self):
        path = self.write("tokens.yaml", tokens_file(TOKENS))
        with Server(MODEL, options=("--tokens", str(path))) as server:
            gone, _ = self.connect(server, "trainer-token-0123456789")
            stays, _ = self.connect(server, "nurse-token-0123456789")
            path.write_text(tokens_file({"nurse-token-0123456789": "manage", "second-token-0123456789": "pose"}))
            server.process.send_signal(signal.SIGHUP)
            deadline = time.monotonic() + 20
            with self.assertRaisesRegex(ServerError, "no longer good"):
                while time.monotonic() < deadline:
                    list(gone.frames(seconds=0.1))
            self.assertTrue(stays.ask_control(), "it may pose now, too")
            self.connect(server, "second-token-0123456789")
            with self.assertRaises(ServerError):
                self.connect(server, "trainer-token-0123456789")
            path.write_text("ecorche_tokens: 1\n")
            server.process.send_signal(signal.SIGHUP)
            time.sleep(0.5)
            self.connect(server, "second-token-0123456789")
            _, _, log = server.stop()
            self.assertIn("those from before are still good", log)


class Log(Folder):
    def test_json(self):
        path = self.write("tokens.yaml", tokens_file(TOKENS))
        with Server(MODEL, options=("--tokens", str(path), "--log-format", "json", "--log", "debug")) as server:
            with Client("127.0.0.1", server.port, token=b"trainer-token-0123456789") as client:
                client.open(session="ward_3")
                request = envelope_pb2.Envelope()
                request.client_hello.protocol_min = 1  # a second one, which ends it
                with self.assertRaises(ServerError):
                    client._call(request)
            code, _, log = server.stop()
        self.assertEqual(code, 0)
        lines = [json.loads(line) for line in log.splitlines()]
        for line in lines:
            self.assertRegex(line["time"], r"^\d{4}-\d\d-\d\dT\d\d:\d\d:\d\d\.\d{3}Z$")
            self.assertIn(line["level"], ("debug", "info", "warning", "error"))
            self.assertTrue(line["message"])
        ended = [line for line in lines if line["message"].startswith("ended: hello: it comes first")]
        self.assertEqual(len(ended), 1, log)
        self.assertEqual((ended[0]["connection"], ended[0]["token"], ended[0]["session"]), (1, "trainer", "ward_3"))
        self.assertRegex(ended[0]["peer"], r"^127\.0\.0\.1:\d+$")
        self.assertTrue(any("stopping" in line["message"] and "connection" not in line for line in lines), log)


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1])
