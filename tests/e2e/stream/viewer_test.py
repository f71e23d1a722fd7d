#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""The viewer as a browser meets it: which address is printed, what is answered and to whom, and how it gets into the program."""
import gzip
import http.client
import json
import os
import pathlib
import pty
import re
import socket
import subprocess
import tempfile
import time
import unittest

from serving import ECORCHE, Server

MODEL = pathlib.Path(os.environ["ECORCHE_MODEL"])
ROOT = pathlib.Path(__file__).resolve().parents[3]
TOKEN = "f00dfeed" * 4
PAGE = b"<!doctype html><title>test</title>" + b"x" * 100_000
SCRIPT = "app-QX3ZK7A2.js"


class Viewer(unittest.TestCase):
    def setUp(self):
        self.folder = tempfile.TemporaryDirectory()
        self.addCleanup(self.folder.cleanup)
        self.path = pathlib.Path(self.folder.name)
        self.viewer = self.path / "viewer"
        (self.viewer / "deep").mkdir(parents=True)
        (self.viewer / "index.html").write_bytes(PAGE)
        (self.viewer / SCRIPT).write_text("start()")
        (self.viewer / "deep" / "a.wasm").write_bytes(b"\0asm")
        (self.path / "secret.txt").write_text("not yours")
        (self.viewer / "link.txt").symlink_to("../secret.txt")

    def get(self, server, path, method="GET", **headers):
        """The answer and its body; `path` goes out as it is."""
        connection = http.client.HTTPConnection("127.0.0.1", server.http_port, timeout=10)
        self.addCleanup(connection.close)
        connection.putrequest(method, path, skip_host="Host" in headers, skip_accept_encoding=True)
        for name, value in headers.items():
            connection.putheader(name.replace("_", "-"), value)
        connection.endheaders()
        answer = connection.getresponse()
        return answer, answer.read()

    def serving(self, *options):
        return Server(MODEL, options=["--http", "127.0.0.1:0", "--viewer-dir", str(self.viewer), *options])

    def test_files_and_their_headers(self):
        with self.serving() as server:
            answer, body = self.get(server, "/")
            self.assertEqual((answer.status, body), (200, PAGE))
            self.assertEqual(answer.headers["Content-Type"], "text/html; charset=utf-8")
            self.assertEqual(answer.headers["Cache-Control"], "no-cache")
            for name, value in (("Cross-Origin-Opener-Policy", "same-origin"), ("Cross-Origin-Embedder-Policy", "require-corp"),
                                ("Cross-Origin-Resource-Policy", "same-origin"), ("X-Content-Type-Options", "nosniff"),
                                ("Referrer-Policy", "no-referrer")):
                self.assertEqual(answer.headers[name], value)
            rules = answer.headers["Content-Security-Policy"]
            self.assertIn("default-src 'none'; script-src 'self' 'wasm-unsafe-eval';", rules)
            self.assertIn("frame-ancestors 'none'", rules)
            self.assertNotIn("unsafe-inline", rules)
            self.assertEqual(self.get(server, "/", If_None_Match=answer.headers["ETag"])[0].status, 304)
            head, nothing = self.get(server, "/", "HEAD")
            self.assertEqual((head.status, head.headers["Content-Length"], nothing), (200, str(len(PAGE)), b""))
            kept, _ = self.get(server, "/" + SCRIPT)
            self.assertEqual(kept.headers["Cache-Control"], "public, max-age=31536000, immutable")
            self.assertEqual(self.get(server, "/deep/a.wasm")[0].headers["Content-Type"], "application/wasm")
            self.assertEqual(self.get(server, "/", "POST")[0].status, 405)
            # As it is when it is asked for.
            (self.viewer / "index.html").write_text("changed")
            changed, body = self.get(server, "/", If_None_Match=answer.headers["ETag"])
            self.assertEqual((changed.status, body), (200, b"changed"))

    def test_nothing_outside_the_folder(self):
        with self.serving() as server:
            for path in ("/../secret.txt", "/deep/../../secret.txt", "/%2e%2e/secret.txt", "/..%2fsecret.txt", "//secret.txt", "/link.txt",
                         "/deep", "/deep/", "/.", "/./index.html", "/" + "a/" * 200 + "a", str(self.path / "secret.txt"),
                         f"http://127.0.0.1{self.path}/secret.txt"):
                answer, body = self.get(server, path)
                self.assertEqual(answer.status, 404, path)
                self.assertNotIn(b"not yours", body)

    def test_names(self):
        with self.serving("--host-name", "patient.example") as server:
            own = f"127.0.0.1:{server.http_port}"
            for host in (own, f"localhost:{server.http_port}", "[::1]:80", "patient.example", "Patient.Example:443"):
                self.assertEqual(self.get(server, "/", Host=host)[0].status, 200, host)
            for host in ("evil.example", "10.0.0.1", "127.0.0.1.evil.example", "patient.example.evil"):
                answer, body = self.get(server, "/", Host=host)
                self.assertEqual(answer.status, 421, host)
                self.assertIn(b"--host-name", body)
                self.assertNotIn(b"evil", body)

            def upgrade(host, origin):
                return self.get(server, "/v1", Host=host, Upgrade="websocket", Connection="Upgrade", Sec_WebSocket_Key="dGhlIHNhbXBsZSBub25jZQ==",
                                Sec_WebSocket_Version="13", Sec_WebSocket_Protocol="ecorche.v1", Origin=origin)[0].status
            self.assertEqual(upgrade("evil.example", "http://evil.example"), 421)
            self.assertEqual(upgrade(own, "http://evil.example"), 403)
            self.assertEqual(upgrade(own, "http://127.0.0.1:1"), 403)
            with socket.create_connection(("127.0.0.1", server.http_port), 10) as page:
                page.sendall((f"GET /v1 HTTP/1.1\r\nHost: {own}\r\nOrigin: http://{own}\r\nUpgrade: websocket\r\nConnection: Upgrade\r\n"
                              "Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\nSec-WebSocket-Version: 13\r\n"
                              "Sec-WebSocket-Protocol: ecorche.v1\r\n\r\n").encode())
                self.assertTrue(page.recv(100).startswith(b"HTTP/1.1 101"))

    def test_the_address_that_is_printed(self):
        token = self.path / "token"
        token.write_text(TOKEN)
        with Server(MODEL, options=["--token-file", str(token), "--json"]) as server:
            _, out, err = server.stop()
            report = json.loads(out)
            self.assertRegex(report["url"], r"^http://127\.0\.0\.1:70[7-9]\d/$|^http://127\.0\.0\.1:71\d\d/$")
            self.assertEqual(report["url"], f"http://127.0.0.1:{report['http_port']}/")
            self.assertNotIn(TOKEN, out + err)
        with Server(MODEL, options=["--no-http", "--json"]) as server:
            _, out, _ = server.stop()
            self.assertEqual({"url", "http_port"} & json.loads(out).keys(), set())
        # On a terminal with the token, by fragment.
        leader, follower = pty.openpty()
        self.addCleanup(os.close, leader)
        process = subprocess.Popen([ECORCHE, "serve", MODEL, "--listen", "127.0.0.1:0", "--token-file", token], stdout=follower,
                                   stderr=subprocess.PIPE)
        os.close(follower)
        said, deadline = "", time.monotonic() + 60
        while "\n" not in said and time.monotonic() < deadline:
            said += os.read(leader, 4096).decode()
        url = re.search(r"http://127\.0\.0\.1:(\d+)/#token=(\w+)", said)
        self.assertTrue(url, said)
        self.assertEqual(url[2], TOKEN)
        # Whatever is asked for, the token and queries stand in no log.
        with socket.create_connection(("127.0.0.1", int(url[1])), 10) as page:
            page.sendall(f"GET /?token={TOKEN} HTTP/1.1\r\nHost: localhost\r\n\r\n".encode())
            page.recv(100)
        process.terminate()
        _, log = process.communicate(timeout=30)
        self.assertNotIn(TOKEN.encode(), log)

    def test_the_programs_own_viewer(self):
        with Server(MODEL, options=["--http", "127.0.0.1:0"]) as server:
            answer, body = self.get(server, "/", Accept_Encoding="gzip")
            if answer.status == 404:  # it was built without: the page says how to get it
                for words in (b"no viewer", b"./scripts/viewer", b"--viewer-dir"):
                    self.assertIn(words, body)
                return
            self.assertEqual((answer.status, answer.headers["Content-Encoding"]), (200, "gzip"))
            plain, whole = self.get(server, "/")
            self.assertIsNone(plain.headers["Content-Encoding"])
            self.assertEqual(gzip.decompress(body), whole)
            self.assertEqual(self.get(server, "/", If_None_Match=answer.headers["ETag"])[0].status, 304)
            for name in re.findall(rb'(?:src|href)="([^"#:]+)"', whole):
                part, _ = self.get(server, "/" + name.decode().removeprefix("./").removeprefix("/"))
                self.assertEqual(part.status, 200, name)

    def test_the_folder_becomes_a_source(self):
        """As the build does it: the same bytes, the gzip file in place of what it is of, and nothing written anew in vain."""
        (self.viewer / (SCRIPT + ".gz")).write_bytes(gzip.compress(b"start()"))
        (self.viewer / "empty.txt").write_bytes(b"")
        (self.viewer / "link.txt").unlink()
        source = self.path / "viewer_files.cpp"

        def embed():
            return subprocess.run(["cmake", "-D", f"FOLDER={self.viewer}", "-D", f"OUT={source}", "-P", ROOT / "app" / "viewer" / "embed.cmake"],
                                  capture_output=True, text=True)
        self.assertEqual(embed().returncode, 0)
        (self.path / "main.cpp").write_text('''#include "app/viewer/viewer_files.hpp"
#include <cstdio>
int main() {
  for (const auto& file : ecorche::app::viewer_files()) {
    std::printf("%s %zu %zu %s %d ", file.name, file.size, file.plain_bytes, file.etag, file.gzip);
    for (std::size_t i = 0; i < file.size; ++i) std::printf("%02x", file.data[i]);
    std::puts("");
  }
}
''')
        subprocess.run(["g++", "-std=c++20", "-I", ROOT, self.path / "main.cpp", source, "-o", self.path / "main"], check=True)
        rows = [line.split(" ") for line in subprocess.run([self.path / "main"], capture_output=True, text=True, check=True).stdout.splitlines()]
        files = {row[0]: (bytes.fromhex(row[5]), int(row[2]), row[4] == "1") for row in rows}
        self.assertEqual(set(files), {"index.html", SCRIPT, "deep/a.wasm", "empty.txt"})
        self.assertEqual(files["index.html"], (PAGE, len(PAGE), False))
        self.assertEqual(files["empty.txt"], (b"", 0, False))
        data, plain, zipped = files[SCRIPT]
        self.assertEqual((gzip.decompress(data), plain, zipped), (b"start()", 7, True))
        self.assertEqual(len({row[3] for row in rows}), 4, "each file has its own tag")
        written = source.stat().st_mtime_ns
        embed()
        self.assertEqual(source.stat().st_mtime_ns, written, "the same files")
        (self.viewer / SCRIPT).write_text("start(1)")
        embed()
        self.assertNotEqual(source.stat().st_mtime_ns, written)
        (self.viewer / "no name.txt").write_text("x")
        refused = embed()
        self.assertNotEqual(refused.returncode, 0)
        self.assertIn("use letters, digits and ._-", " ".join(refused.stderr.split()))
        # Without the folder there are no files, and the program is built all the same.
        (self.viewer / "index.html").unlink()
        self.assertEqual(embed().returncode, 0)
        subprocess.run(["g++", "-std=c++20", "-I", ROOT, self.path / "main.cpp", source, "-o", self.path / "main"], check=True)
        self.assertEqual(subprocess.run([self.path / "main"], capture_output=True, check=True).stdout, b"")

    def test_what_cannot_be_served(self):
        for words, code, message in (
                (["--viewer-dir", self.path], 66, "is no folder with an index.html"),
                (["--host-name", "https://patient.example"], 64, "is no host name"),
                (["--no-http", "--http", "127.0.0.1:0"], 64, "excludes")):
            result = subprocess.run([ECORCHE, "serve", MODEL, "--listen", "127.0.0.1:0", *map(str, words)], capture_output=True, text=True, timeout=60)
            self.assertEqual(result.returncode, code, result.stderr)
            self.assertIn(message, result.stderr)


if __name__ == "__main__":
    unittest.main(verbosity=2)
