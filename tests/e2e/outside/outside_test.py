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

    def nobody_answers(self, connect, *words):
        result = subprocess.run([connect, "127.0.0.1:1", *words], capture_output=True, text=True)
        self.assertEqual(result.returncode, 1)
        self.assertRegex(result.stderr, r"^error: 127\.0\.0\.1:1: ")

    def served(self, program, *words, **options):
        """What `program ADDRESS words` prints of the model, served."""
        port = self.folder / "port"
        port.unlink(missing_ok=True)
        with subprocess.Popen([os.environ["ECORCHE_BIN"], "serve", os.environ["ECORCHE_MODEL"], "--listen", "127.0.0.1:0", "--port-file", port],
                              stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL) as server:
            try:
                for _ in range(600):
                    if port.exists() or server.poll() is not None:
                        break
                    time.sleep(0.1)
                return run(program, f"127.0.0.1:{port.read_text().strip()}", *words, **options)
            finally:
                server.terminate()

    def first_client(self, program):
        obj = self.folder / "bent.obj"
        said = self.served(program, obj)
        vertices = int(re.fullmatch(r"pose 1: (\d+) vertices\n", said)[1])
        lines = obj.read_text().splitlines()
        self.assertEqual(sum(line.startswith("v ") for line in lines), vertices)
        self.assertGreater(sum(line.startswith("f ") for line in lines), vertices)

    def built_by_hand(self, prefix, source, name):
        """The program built by pkg-config, by plain flags, and as C++20, and the environment that it runs in."""
        library = next(prefix.rglob(f"lib{name}.so")).parent
        found = {**os.environ, "PKG_CONFIG_PATH": str(library / "pkgconfig")}
        flags = run("pkg-config", "--cflags", "--libs", name, env=found).split()
        plain = (f"-I{prefix / 'include'}", f"-L{library}", f"-l{name}")
        for words in (("cc", "-std=c11", source, *flags), ("cc", "-std=c11", source, *plain), ("c++", "-std=c++20", "-x", "c++", source, *plain)):
            program = self.folder / f"{name}_by_hand"
            run(*words, "-Wall", "-Wextra", "-Werror", "-Wno-missing-field-initializers", "-o", program, "-lm")
            yield program, {**os.environ, "LD_LIBRARY_PATH": str(library)}

    def shows_only_the_c_abi(self, prefix, name, without):
        library = next(prefix.rglob(f"lib{name}.so"))
        shown = {line.split()[-1].split("@")[0] for line in run("nm", "-D", "--defined-only", library).splitlines()}
        header = (prefix / "include" / "ecorche" / f"{name}.h").read_text()
        declared = set(re.findall(r"\b(ecorche_\w+)\(", re.sub(r"/\*.*?\*/", "", header, flags=re.S)))
        self.assertEqual({one for one in shown if one != f"{name.upper()}_0"}, declared, "only the C ABI, and all of it")
        needed = run("readelf", "-d", library)
        self.assertIn(f"[lib{name}.so.0]", needed)
        self.assertNotRegex(needed, without)

    def by_the_c_abi(self, prefix, build, model, said):
        knee = ("knee_right", "flexion", "60")
        self.assertEqual(run(build / "pose_c", model, *knee), said)
        refused = subprocess.run([build / "pose_c", model, "nose", "flexion", "60"], capture_output=True, text=True)
        self.assertEqual((refused.returncode, refused.stderr), (1, "error: nose.flexion: the model has no such angle (ecorche info lists them)\n"))
        for program, paths in self.built_by_hand(prefix, HERE / "installed" / "pose_c.c", "ecorche"):
            self.assertEqual(run(program, model, *knee, env=paths), said)
        self.shows_only_the_c_abi(prefix, "ecorche", r"(?i)cgal|gmp|mpfr|cholmod|tetgen|ITK|vtk|protobuf")

        arm = ("shoulder_left", "abduction", "80")
        wide = r"^skin of session \S+ is \d{3,4} mm wide\n$"
        self.assertRegex(self.served(build / "watch_c", *arm), wide)
        self.nobody_answers(build / "watch_c", *arm)
        for program, paths in self.built_by_hand(prefix, HERE / "installed" / "watch_c.c", "ecorche_client"):
            self.assertRegex(self.served(program, *arm, env=paths), wide)
        self.shows_only_the_c_abi(prefix, "ecorche_client", r"(?i)cgal|gmp|mpfr|cholmod|tetgen|ITK|vtk|hdf5")

    def each_component_alone(self, prefix):
        """Each finds what it needs, whatever else is asked for; those in C need nothing."""
        nothing = [f"-DCMAKE_DISABLE_FIND_PACKAGE_{name}=ON" for name in ("Eigen3", "PkgConfig", "hwy", "TBB", "OpenSSL", "Protobuf")]
        for component in ("c", "c_client", "runtime", "client", "preprocess"):
            with self.subTest(component):
                run("cmake", "-S", HERE / "component", "-B", self.folder / f"only_{component}", "-G", "Ninja", f"-DCMAKE_PREFIX_PATH={prefix}",
                    f"-DCOMPONENT={component}", "-Wno-dev", *(nothing if component in ("c", "c_client") else []))

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
        self.by_the_c_abi(prefix, build, model, said)
        self.nobody_answers(build / "connect")
        self.each_component_alone(prefix)

        self.first_client(build / "first_client")

        plugin = build / "libplugin.so"
        self.assertGreater(ctypes.CDLL(str(plugin)).plugin_nodes(str(model).encode()), 1000)
        shown = run("nm", "-D", "--defined-only", "-C", plugin)
        self.assertIn("plugin_nodes", shown)
        self.assertEqual([line for line in shown.splitlines() if re.search(r" [A-Z] ecorche::", line)], [])

    def test_part_of_another_project(self):
        build = self.folder / "build"
        # Nothing is measured here: -O1 compiles in two thirds of the time.
        run("cmake", "-S", HERE / "subproject", "-B", build, "-G", "Ninja", f"-DECORCHE_SOURCE={SOURCE}", "-DCMAKE_CXX_FLAGS_RELEASE=-O1", "-Wno-dev")
        run("cmake", "--build", build)
        self.nobody_answers(build / "connect")
        self.assertFalse((build / "bin").exists(), "the outer project's folders are its own")

    def test_pages_show_these_programs(self):
        shown = {"embedding.md": ("pose_c.c", "watch_c.c", "pose.cpp", "prepare.cpp", "connect.cpp"), "tutorial/first_client.md": ("first_client.cpp",)}
        for page, names in shown.items():
            text = (SOURCE / "docs" / page).read_text()
            for name in names:
                self.assertIn((HERE / "installed" / name).read_text(), text, f"{page} shows another {name}")


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1])
