#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""The house check itself can fail: every rule is broken once in a scratch tree."""
import pathlib
import subprocess
import sys
import tempfile
import unittest

CHECK = pathlib.Path(__file__).with_name("check_house.py")
SPDX = "// SPDX-License-Identifier: Apache-2.0\n"


def problems(files):
    with tempfile.TemporaryDirectory() as scratch:
        root = pathlib.Path(scratch)
        subprocess.run(["git", "init", "-q", root], check=True)
        for path, text in files.items():
            (root / path).parent.mkdir(parents=True, exist_ok=True)
            (root / path).write_text(text)
        result = subprocess.run([sys.executable, CHECK, root], capture_output=True, text=True)
        lines = result.stdout.splitlines()
        assert (result.returncode == 0) == lines[-1].endswith(" 0 problems"), result.stdout + result.stderr
        return lines[:-1]


class House(unittest.TestCase):
    def assert_refused(self, path, text, word):
        found = [line for line in problems({path: text}) if word in line]
        self.assertTrue(found, f"{path} should be refused with '{word}'")

    def test_a_good_tree_passes(self):
        self.assertEqual([line for line in problems({
            "runtime/skin/a.cpp": SPDX + '#include <ecorche/values/mesh.hpp>\n#include "runtime/skin/a.hpp"\n#include <vector>\n',
            "runtime/server/b.cpp": SPDX + '#include "runtime/skin/a.hpp"\n#include <ecorche/model_file/model_file.hpp>\n',
            "runtime/include/ecorche/runtime/c.hpp": SPDX + '#include <ecorche/values/mesh.hpp>\n',
            "runtime/server/handlers/c.cpp": SPDX + '#include "runtime/server/net/asio.hpp"\n#include "runtime/skin/a.hpp"\n',
            "README.md": "no licence line needed\n"}) if line], [])

    def test_forbidden_arrows(self):
        for path, include in [("runtime/skin/a.cpp", "preprocess/rig/fit_rig.hpp"), ("runtime/skin/a.cpp", "io/case/case_file.hpp"),
                              ("runtime/skin/a.cpp", "runtime/server/server.hpp"), ("core/values/a.hpp", "core/files/atomic_file.hpp"),
                              ("core/kinematics/a.cpp", "core/solve/spd_solver.hpp"), ("io/image/a.cpp", "preprocess/pipeline.hpp"),
                              ("preprocess/cor/a.cpp", "runtime/skin/body_poser.hpp"), ("phantom/a.cpp", "io/case/case_file.hpp"),
                              ("io/case/a.cpp", "app/command.hpp"),
                              ("runtime/server/net/a.cpp", "runtime/server/schedule/workers.hpp"),
                              ("runtime/server/net/a.cpp", "runtime/skin/body_poser.hpp"),
                              ("runtime/server/schedule/a.cpp", "runtime/server/session/session.hpp"),
                              ("runtime/server/session/a.cpp", "runtime/server/registry/recordings.hpp"),
                              ("runtime/server/registry/a.cpp", "runtime/server/handlers/connection.hpp"),
                              ("runtime/server/handlers/a.cpp", "runtime/server/server.hpp")]:
            self.assert_refused(path, SPDX + f'#include "{include}"\n', "may not include")

        for path, include in [("runtime/skin/a.cpp", "preprocess/pipeline.hpp"), ("core/values/a.cpp", "runtime/body_poser.hpp"),
                              ("runtime/include/ecorche/runtime/a.hpp", "wire/framing.hpp")]:
            self.assert_refused(path, SPDX + f"#include <ecorche/{include}>\n", "may not include")

    def test_public_headers(self):
        header = "runtime/include/ecorche/runtime/a.hpp"
        self.assert_refused(header, SPDX + '#include "runtime/skin/aligned.hpp"\n', "public headers only")
        self.assert_refused("app/a.cpp", SPDX + "#include <ecorche/nowhere/a.hpp>\n", "belongs to no folder")

    def test_licences(self):
        self.assert_refused("core/values/a.cpp", "int a;\n", "SPDX")
        self.assert_refused("preprocess/cor/a.cpp", SPDX + "#include <CGAL/Mesh_3.h>\n", "outside of")
        self.assert_refused("preprocess/tet/cgal/a.cpp", SPDX + "#include <CGAL/Mesh_3.h>\n", "AGPL-3.0-or-later")

    def test_plain_values(self):
        self.assert_refused("core/values/a.cpp", SPDX + "#include <fstream>\n", "plain data")
        self.assert_refused("core/include/ecorche/values/image.hpp", SPDX + "#include <Eigen/Core>\n", "brings its own Eigen")

    def test_platform(self):
        posix = ["#include <unistd.h>", "#include <sys/stat.h>", "#include <netinet/tcp.h>", "#include <csignal>",
                 "#ifdef __linux__\n#include <sched.h>\n#endif", 'const char* a = "/proc/self/exe";']
        # One tree: a run of the check a file would take longer than all the other tests.
        files = {f"{folder}/{n}.cpp": f"{SPDX}{line}\n" for n, line in enumerate(posix)
                 for folder in ("core/files", "runtime/server/net", "core/platform", "tests/unit/files", "bench/server")}
        found = [line.split(":")[0] for line in problems(files) if "only core/platform knows them" in line]
        self.assertEqual(sorted(found), sorted(path for path in files if path.startswith(("core/files", "runtime"))))
        self.assert_refused("core/platform/a.cpp", SPDX + '#include "core/files/atomic_file.hpp"\n', "may not include")
        self.assert_refused("core/values/a.cpp", SPDX + '#include "core/platform/file.hpp"\n', "may not include")
        using = '#include "core/platform/file.hpp"\n'
        self.assertEqual(problems({f"{folder}/a.cpp": SPDX + using for folder in (
            "runtime/skin", "io/image", "clients/cpp", "core/model_file", "runtime/server/net", "app", "phantom")}), [""])

    def test_papers(self):
        paper = "Nobody" + "99"
        for path, comment in [("preprocess/cor/a.cpp", f"// As {paper} has it."), ("tests/a.py", f"# As {paper} has it.")]:
            spdx = SPDX if path.endswith("cpp") else SPDX.replace("//", "#")
            self.assert_refused(path, f"{spdx}{comment}\n", f"cites {paper}")
            self.assertEqual(problems({path: f"{spdx}{comment}\n", "CONVENTIONS.md": f"| {paper} | a paper |\n"}), [""])

    def test_large_rooms(self):
        self.assert_refused("app/a.cpp", SPDX + "int a;\n" * 401, "one idea a file")


if __name__ == "__main__":
    unittest.main()
