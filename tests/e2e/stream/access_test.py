#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""TLS, tokens and the HTTP port as their users meet them."""
import ctypes
import json
import os
import pathlib
import resource
import ssl
import subprocess
import tempfile
import unittest
import urllib.error
import urllib.request

from ecorche_client import Client, ServerError
from serving import ECORCHE, Server

MODEL = pathlib.Path(os.environ["ECORCHE_MODEL"])
TOKEN = "f00dfeed" * 4


def run(*words):
    return subprocess.run([ECORCHE, *map(str, words)], capture_output=True, text=True, timeout=60)


class Access(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = tempfile.TemporaryDirectory()
        path = pathlib.Path(cls.folder.name)
        cls.certificate, cls.key, cls.token = path / "test.pem", path / "test.key", path / "token"
        subprocess.run(["openssl", "req", "-x509", "-newkey", "ec", "-pkeyopt", "ec_paramgen_curve:prime256v1", "-nodes", "-days", "2",
                        "-subj", "/CN=test", "-addext", "subjectAltName=IP:127.0.0.1", "-keyout", cls.key, "-out", cls.certificate],
                       check=True, capture_output=True)
        cls.token.write_text(TOKEN + "\n")

    @classmethod
    def tearDownClass(cls):
        cls.folder.cleanup()

    def server(self):
        return Server(MODEL, options=["--tls-certificate", str(self.certificate), "--tls-key", str(self.key), "--token-file",
                                      str(self.token), "--http", "127.0.0.1:0"])

    def test_both_clients_stream_over_tls(self):
        with self.server() as server:
            result = run("stream", server.address, "--seconds", 0.3, "--model", MODEL, "--tls-ca", self.certificate, "--token-file",
                         self.token, "--json")
            self.assertEqual(result.returncode, 0, result.stderr)
            self.assertEqual(json.loads(result.stdout)["mismatches"], 0)
            with Client("127.0.0.1", server.port, tls_ca=self.certificate, token=TOKEN.encode()) as client:
                body = client.open()
                client.subscribe_mesh()
                sequence = client.send_pose(body.rest_pose())
                self.assertIn(sequence, [frame.pose_sequence for frame in client.frames(1)])

    def test_who_may_not(self):
        with self.server() as server:
            denied = run("stream", server.address, "--seconds", 0.3, "--tls-ca", self.certificate)
            self.assertEqual(denied.returncode, 77, denied.stderr)
            self.assertIn("token is missing or wrong", denied.stderr)
            with self.assertRaises(ServerError):
                Client("127.0.0.1", server.port, tls_ca=self.certificate, token=b"guessed")
            with self.assertRaises(ssl.SSLError):
                Client("127.0.0.1", server.port, tls_ca="/etc/ssl/certs/ca-certificates.crt" if os.path.exists(
                    "/etc/ssl/certs/ca-certificates.crt") else self.key)

    def test_the_http_port(self):
        trusted = ssl.create_default_context(cafile=self.certificate)

        def get(server, path, token=None):
            request = urllib.request.Request(f"https://127.0.0.1:{server.http_port}{path}")
            if token:
                request.add_header("Authorization", "Bearer " + token)
            with urllib.request.urlopen(request, context=trusted, timeout=10) as answer:
                return answer.read().decode()

        with self.server() as server:
            self.assertEqual(get(server, "/healthz"), "alive\n")
            self.assertEqual(get(server, "/readyz"), "ready\n")
            self.assertIn("ecorche_clients 0", get(server, "/metrics", TOKEN))
            with self.assertRaises(urllib.error.HTTPError) as caught:
                get(server, "/metrics")
            self.assertEqual(caught.exception.code, 401)
            caught.exception.close()
            _, out, _ = server.stop()
            self.assertEqual(out, f"listening on {server.address}, and https://127.0.0.1:{server.http_port}/\n", "both ports are named")
        with Server(MODEL, options=["--http", "[::1]:0"], host="[::1]") as server:
            _, out, _ = server.stop()
            self.assertEqual(out, f"listening on {server.address}, and http://[::1]:{server.http_port}/\n")

    def test_real_time_is_for_who_may(self):
        """One thread of the server alone, and none where the system does not let it."""
        def drop():
            ctypes.CDLL(None).prctl(24, 23, 0, 0, 0)  # PR_CAPBSET_DROP, CAP_SYS_NICE: as root
            resource.setrlimit(resource.RLIMIT_RTPRIO, (0, 0))
        result = subprocess.run([ECORCHE, "serve", MODEL, "--listen", "127.0.0.1:0", "--real-time"], capture_output=True, text=True,
                                timeout=60, preexec_fn=drop)
        self.assertEqual(result.returncode, 77, result.stderr)
        self.assertIn("the system does not let this process", result.stderr)
        self.assertEqual(result.stdout, "")
        if subprocess.run(["chrt", "-r", "1", "true"], capture_output=True).returncode != 0:
            self.skipTest("this system lets nobody")
        with Server(MODEL, options=["--real-time"]) as server:
            result = run("stream", server.address, "--seconds", 0.3, "--model", MODEL, "--json")
            self.assertEqual(json.loads(result.stdout)["mismatches"], 0)
            threads = {int(name): os.sched_getscheduler(int(name)) for name in os.listdir(f"/proc/{server.process.pid}/task")}
        first = [thread for thread, policy in threads.items() if policy & ~os.SCHED_RESET_ON_FORK == os.SCHED_RR]
        self.assertEqual(first, [server.process.pid])
        self.assertGreater(len(threads), 2)

    def test_frames_give_way_where_probes_go_first(self):
        """Threads that pose run last then, too; the one that answers never does."""
        last = {}
        for options in ((), ("--probes-first",)):
            with Server(MODEL, options=options) as server:
                result = run("stream", server.address, "--seconds", 0.3, "--model", MODEL, "--json")
                self.assertEqual(json.loads(result.stdout)["mismatches"], 0)
                policies = {int(name): os.sched_getscheduler(int(name)) & ~os.SCHED_RESET_ON_FORK for name in os.listdir(f"/proc/{server.process.pid}/task")}
            self.assertEqual(policies[server.process.pid], os.SCHED_OTHER)
            last[options] = list(policies.values()).count(os.SCHED_IDLE)
        self.assertLessEqual(last[()], 1, "for what nobody waits for")
        self.assertGreater(last["--probes-first",], last[()])

    def test_what_cannot_be_served(self):
        empty = pathlib.Path(self.folder.name) / "empty"
        empty.write_text("\n")
        for words, code, message in (
                (["--token-file", empty], 78, "does not hold one token"),
                (["--tls-certificate", self.certificate], 64, "a certificate and its key go together"),
                (["--tls-certificate", self.token, "--tls-key", self.key], 78, "is of no use for TLS"),
                (["--listen", "0.0.0.0:0", "--token-file", self.token], 77, "is reachable by others"),
                (["--http", "nowhere"], 64, "is not HOST:PORT")):
            result = run("serve", MODEL, "--listen", "127.0.0.1:0", *words) if "--listen" not in words else run("serve", MODEL, *words)
            self.assertEqual(result.returncode, code, result.stderr)
            self.assertIn(message, result.stderr)


if __name__ == "__main__":
    unittest.main(verbosity=2)
