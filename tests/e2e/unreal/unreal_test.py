#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""The module for Unreal without Unreal: compiled against declarations of its API; what needs none runs against a server.

usage: unreal_test.py SOURCE LIBRARY_FOLDER; the environment is that of the fixtures
"""
import os
import pathlib
import re
import subprocess
import sys
import tempfile
import unittest

SOURCE, LIBRARIES = (pathlib.Path(word) for word in sys.argv[1:3])
MODULE, HERE = SOURCE / "clients" / "unreal" / "EcorcheUnreal", SOURCE / "tests" / "e2e" / "unreal"
sys.path.insert(0, str(SOURCE / "tests" / "e2e" / "stream"))

from relay import Relay  # noqa: E402
from serving import Server  # noqa: E402

FLAGS = ["-std=c++17", "-Wall", "-Wextra", "-Werror", f"-I{MODULE / 'Public'}", f"-I{SOURCE / 'clients' / 'c' / 'include'}"]


class Unreal(unittest.TestCase):
    def compile(self, *words):
        done = subprocess.run(["c++", *FLAGS, *map(str, words)], capture_output=True, text=True)
        self.assertEqual(done.returncode, 0, done.stderr)

    def test_it_compiles_against_declarations_of_unreal(self):
        for source in (MODULE / "Private").glob("*.cpp"):
            self.compile("-fsyntax-only", f"-I{HERE / 'declarations'}", source)
        # Unreal makes a macro of the module's name, which must not be one of ecorche.h.
        self.assertIn("class EcorcheUnreal : ModuleRules", (MODULE / "EcorcheUnreal.Build.cs").read_text())

    def test_a_body_in_unreals_space(self):
        with tempfile.TemporaryDirectory() as folder:
            program = pathlib.Path(folder) / "watch"
            self.compile(HERE / "watch.cpp", MODULE / "Private" / "EcorcheStream.cpp", "-O1", "-o", program, f"-L{LIBRARIES}", "-lecorche_client")
            environment = {**os.environ, "LD_LIBRARY_PATH": str(LIBRARIES)}
            with Server(os.environ["ECORCHE_MODEL"]) as server, Relay(server.port) as relay, subprocess.Popen(
                    [program, relay.address], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True, env=environment) as watch:
                self.assertIn("nose.flexion: the model has no such angle", watch.stdout.readline())
                told = re.match(r"left to (\S+) right to (\S+) high (\S+) litres (\S+) agree (\S+) in (\w+)", watch.stdout.readline())
                left, right, high, litres, agree = map(float, told.groups()[:5])
                # The left arm is lifted: -y is left.
                self.assertLess(left, -right - 10)
                self.assertTrue(150 < high < 220 and 30 < litres < 120 and agree > 0.95, told.group())
                self.assertNotEqual(told.group(6), "nothing")
                relay.cut()
                relay.mend()
                watch.stdin.write("\n")
                watch.stdin.flush()
                self.assertEqual(watch.stdout.readline(), "back\n")
                self.assertEqual(watch.wait(20), 0)


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1] + sys.argv[3:])
