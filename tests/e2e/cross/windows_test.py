#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""libecorche_client for Windows: its parts' unit tests and programs in C under Wine, with a server of this machine.

usage: windows_test.py SOURCE BUILD; the environment is that of the fixtures
"""
import os
import pathlib
import re
import subprocess
import sys
import tempfile
import unittest

from built import build, run, unit_tests

SOURCE, BUILD = (pathlib.Path(word) for word in sys.argv[1:3])
HERE = pathlib.Path(__file__).resolve().parent
sys.path.insert(0, str(HERE.parent / "stream"))
from serving import Server  # noqa: E402

# As Debian's wine64 keeps them, without the package that wraps them.
WINE, WINE_SERVER = "/usr/lib/wine/wine64", "/usr/lib/wine/wineserver64"
KNEE = ("knee_right", "flexion")
TOKEN = "a-token-of-thirty-two-letters-or-so"
# Of Windows itself, and of its C library.
SYSTEM = {"KERNEL32.dll", "msvcrt.dll", "WS2_32.dll", "ADVAPI32.dll", "USER32.dll"}


class Windows(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        scratch = tempfile.TemporaryDirectory()
        cls.addClassCleanup(scratch.cleanup)
        cls.folder = pathlib.Path(scratch.name)
        # A Windows of its own, without windows and without what Wine would fetch.
        cls.wine = {**os.environ, "WINEPREFIX": str(cls.folder / "wine"), "WINEDEBUG": "-all", "WINEDLLOVERRIDES": "mscoree,mshtml=", "DISPLAY": ""}
        there = build(SOURCE, "windows_libraries", "windows")
        cls.there = there
        run(WINE, "wineboot", "--init", env=cls.wine)
        cls.addClassCleanup(lambda: subprocess.run([WINE_SERVER, "--kill"], env=cls.wine))
        cls.installed = cls.folder / "installed"
        run("cmake", "--install", there, "--prefix", cls.installed)
        cls.dll = next((cls.installed / "bin").glob("*.dll"))
        for source in (HERE / "watch_all.c", SOURCE / "tests/e2e/outside/installed/watch_c.c"):
            # Beside the library: there Windows looks for it.
            run("x86_64-w64-mingw32-gcc-posix", "-std=c11", "-Wall", "-Wextra", "-Werror", "-Wno-missing-field-initializers", source, "-o",
                cls.dll.parent / f"{source.stem}.exe", f"-I{cls.installed / 'include'}", f"-L{cls.installed / 'lib'}", "-lecorche_client")
        place = BUILD / "clients" / "c"
        run("cc", "-std=c11", HERE / "watch_all.c", "-o", cls.folder / "watch_all", f"-I{SOURCE / 'clients/c/include'}", f"-L{place}", "-lecorche_client",
            f"-Wl,-rpath,{place}")

    def windows(self, program, *words):
        return subprocess.run([WINE, self.dll.parent / f"{program}.exe", *map(str, words)], capture_output=True, text=True, env=self.wine, timeout=120)

    def test_unit_tests(self):
        print(unit_tests(self.there, 3, env=self.wine), "executables of unit tests pass under Wine", file=sys.stderr)

    def test_what_it_shows_and_needs(self):
        said = run("x86_64-w64-mingw32-objdump", "-p", self.dll)
        shown = set(re.findall(r"(?m)^\s+\[ *\d+\].*\b(\w+)$", said.split("[Ordinal/Name Pointer] Table")[1].split("\n\n")[0]))
        header = re.sub(r"/\*.*?\*/", "", (self.installed / "include/ecorche/ecorche_client.h").read_text(), flags=re.S)
        self.assertEqual(shown, set(re.findall(r"\b(ecorche_\w+)\(", header)), "only the C ABI, and all of it")
        needed = set(re.findall(r"DLL Name: (\S+)", said))
        self.assertLessEqual(needed, SYSTEM, "a program needs this file alone")

    def test_the_example(self):
        with Server(os.environ["ECORCHE_MODEL"]) as server:
            done = self.windows("watch_c", server.address, *KNEE, 60)
        self.assertEqual((done.returncode, done.stderr), (0, ""))
        self.assertRegex(done.stdout, r"^skin of session \S+ is \d{3,4} mm wide\s+$")

    def test_frames_are_the_same_bytes(self):
        with Server(os.environ["ECORCHE_MODEL"]) as server:
            for encoding in (1, 2, 3):
                here, there = self.folder / f"here{encoding}", self.folder / f"there{encoding}"
                said = run(self.folder / "watch_all", server.address, here, encoding, *KNEE)
                done = self.windows("watch_all", server.address, there, encoding, *KNEE)
                self.assertEqual((done.returncode, done.stdout.strip()), (0, said.strip()), done.stderr)
                self.assertGreater(here.stat().st_size, 1 << 20)
                self.assertTrue(here.read_bytes() == there.read_bytes(), f"encoding {encoding}")

    def test_tls_and_tokens(self):
        ours, others = (self.certificate(name) for name in ("ours", "others"))
        (self.folder / "token").write_text(TOKEN + "\n")
        options = ["--tls-certificate", ours, "--tls-key", ours.with_suffix(".key"), "--token-file", self.folder / "token"]
        with Server(os.environ["ECORCHE_MODEL"], options=[str(word) for word in options]) as server:
            out = self.folder / "by_tls"
            done = self.windows("watch_all", server.address, out, 3, *KNEE, TOKEN, ours)
            self.assertEqual((done.returncode, done.stderr), (0, ""))
            self.assertGreater(out.stat().st_size, 1 << 20)
            for words, said in (((TOKEN, others), r"its certificate is not trusted: .*\(give the certificate of its authority\)"),
                                ((TOKEN, self.folder / "none.pem"), r"none\.pem: holds no certificates"),
                                (("guessed", ours), r"token is missing or wrong"),
                                ((TOKEN,), r".*")):
                done = self.windows("watch_all", server.address, out, 3, *KNEE, *words)
                self.assertEqual(done.returncode, 1, words)
                self.assertRegex(done.stderr, r"(?m)^error: .*" + said)
                self.assertEqual(len(done.stderr.strip().splitlines()), 1, done.stderr)

    def certificate(self, name):
        path = self.folder / f"{name}.pem"
        run("openssl", "req", "-x509", "-newkey", "ec", "-pkeyopt", "ec_paramgen_curve:prime256v1", "-nodes", "-days", "2", "-subj", "/CN=test",
            "-addext", "subjectAltName=IP:127.0.0.1", "-keyout", path.with_suffix(".key"), "-out", path)
        return path

    def test_nobody_answers(self):
        for address, said in (("127.0.0.1:1", r"127\.0\.0\.1:1: cannot be reached: \S.* \(start the server there, or try again\)"),
                              ("nowhere.invalid:7070", r"nowhere\.invalid:7070: \S.* \(start the server there, or try again\)")):
            done = self.windows("watch_all", address, self.folder / "nothing", 3, *KNEE)
            self.assertEqual(done.returncode, 1)
            self.assertRegex(done.stderr, rf"^error: {said}\s+$")

    def test_a_server_that_goes(self):
        server = Server(os.environ["ECORCHE_MODEL"])
        with server, subprocess.Popen([WINE, self.dll.parent / "watch_all.exe", server.address, self.folder / "cut", "3", "nose", "flexion"],
                                      stderr=subprocess.PIPE, text=True, env=self.wine) as wrong:
            self.assertRegex(wrong.communicate(timeout=60)[1], r"^error: nose\.flexion: ")
        done = self.windows("watch_all", server.address, self.folder / "cut", 3, *KNEE)
        self.assertRegex(done.stderr, r"^error: 127\.0\.0\.1:\d+: cannot be reached: ")


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1])
