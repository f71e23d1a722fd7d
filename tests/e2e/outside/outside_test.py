#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Projects outside of this tree use ecorche: installed, by find_package; and as a part of their own, by add_subdirectory.

usage: outside_test.py SOURCE BUILD; the environment is that of the fixtures
"""
import ctypes
import os
import pathlib
import re
import subprocess
import sys
import tempfile
import time
import unittest

SOURCE, BUILD = (pathlib.Path(word) for word in sys.argv[1:3])
HERE = pathlib.Path(__file__).resolve().parent


def run(*words, **options):
    result = subprocess.run([str(word) for word in words], capture_output=True, text=True, **options)
    assert result.returncode == 0, f"{words}: {result.returncode}\n{result.stdout[-4000:]}\n{result.stderr[-4000:]}"
    return result.stdout


class Outside(unittest.TestCase):
    def setUp(self):
        self.scratch = tempfile.TemporaryDirectory()
        self.addCleanup(self.scratch.cleanup)
        self.folder = pathlib.Path(self.scratch.name)

    def nobody_answers(self, connect):
        result = subprocess.run([connect, "127.0.0.1:1"], capture_output=True, text=True)
        self.assertEqual(result.returncode, 1)
        self.assertRegex(result.stderr, r"^error: 127\.0\.0\.1:1: ")

    def first_client(self, program):
        port, obj = self.folder / "port", self.folder / "bent.obj"
        with subprocess.Popen([os.environ["ECORCHE_BIN"], "serve", os.environ["ECORCHE_MODEL"], "--listen", "127.0.0.1:0", "--port-file", port],
                              stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL) as server:
            try:
                for _ in range(600):
                    if port.exists() or server.poll() is not None:
                        break
                    time.sleep(0.1)
                said = run(program, f"127.0.0.1:{port.read_text().strip()}", obj)
            finally:
                server.terminate()
        vertices = int(re.fullmatch(r"pose 1: (\d+) vertices\n", said)[1])
        lines = obj.read_text().splitlines()
        self.assertEqual(sum(line.startswith("v ") for line in lines), vertices)
        self.assertGreater(sum(line.startswith("f ") for line in lines), vertices)

    def test_installed(self):
        first, prefix, build = self.folder / "first", self.folder / "moved", self.folder / "build"
        run("cmake", "--install", BUILD, "--prefix", first)
        first.rename(prefix)  # nothing in it knows where it was installed
        for file in prefix.rglob("*.cmake"):
            self.assertNotRegex(file.read_text(), re.escape(str(SOURCE)), file)
        for header in (prefix / "include").rglob("*.hpp"):
            self.assertEqual(header.relative_to(prefix).parts[1], "ecorche", header)
        run("cmake", "-S", HERE / "installed", "-B", build, "-G", "Ninja", f"-DCMAKE_PREFIX_PATH={prefix}", "-Wno-dev")
        run("cmake", "--build", build)
        self.assertRegex(run(prefix / "bin" / "ecorche", "--version"), r"^\d+\.\d+\.\d+$")

        model = self.folder / "body.hdf"
        self.assertRegex(run(build / "prepare", os.environ["ECORCHE_CASE"], model), r"^\d{4,6} tets$")
        said = run(build / "pose", model, "knee_right", "flexion", "60")
        self.assertRegex(said, r"^ecorche \d+\.\d+\.\d+: [2-9]\d\d\.\d mm, (pass|warn)$")
        self.nobody_answers(build / "connect")

        self.first_client(build / "first_client")

        plugin = build / "libplugin.so"
        self.assertGreater(ctypes.CDLL(str(plugin)).plugin_nodes(str(model).encode()), 1000)
        shown = run("nm", "-D", "--defined-only", "-C", plugin)
        self.assertIn("plugin_nodes", shown)
        self.assertEqual([line for line in shown.splitlines() if re.search(r" [A-Z] ecorche::", line)], [])

    def test_part_of_another_project(self):
        build = self.folder / "build"
        run("cmake", "-S", HERE / "subproject", "-B", build, "-G", "Ninja", f"-DECORCHE_SOURCE={SOURCE}", "-Wno-dev")
        run("cmake", "--build", build)
        self.nobody_answers(build / "connect")
        self.assertFalse((build / "bin").exists(), "the outer project's folders are its own")

    def test_pages_show_these_programs(self):
        shown = {"embedding.md": ("pose", "prepare", "connect"), "tutorial/first_client.md": ("first_client",)}
        for page, names in shown.items():
            text = (SOURCE / "docs" / page).read_text()
            for name in names:
                self.assertIn((HERE / "installed" / f"{name}.cpp").read_text(), text, f"{page} shows another {name}.cpp")


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1])
