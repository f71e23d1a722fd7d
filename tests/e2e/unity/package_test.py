#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""The package for Unity as a package: its metas, its assemblies as their definitions say, what is made of other files, its shaders.

usage: package_test.py SOURCE
"""
import json
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile
import unittest

SOURCE = pathlib.Path(sys.argv[1])
PACKAGE = SOURCE / "clients" / "unity"
HERE = SOURCE / "tests" / "e2e" / "unity"


def run(*words, **more):
    return subprocess.run([str(word) for word in words], capture_output=True, text=True, **more)


class Package(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = pathlib.Path(folder.name)

    def test_every_file_has_a_meta_and_no_guid_is_there_twice(self):
        check = [SOURCE / "scripts" / "unity_metas", "--check"]
        self.assertEqual(run(*check).stdout, "")
        copy = self.folder / "unity"
        shutil.copytree(PACKAGE, copy)
        (copy / "Runtime" / "New.cs").write_text("")
        (copy / "Editor.meta").unlink()
        shutil.copy(copy / "Tests.meta", copy / "Runtime.meta")
        (copy / "Gone.cs.meta").write_text("fileFormatVersion: 2\n")
        told = run(*check, copy)
        self.assertEqual(told.returncode, 1)
        for what in ("New.cs.meta: is missing", "Editor.meta: is missing", "Gone.cs.meta: belongs to nothing", "Gone.cs.meta: has no GUID",
                     f"Tests.meta: has the GUID of {copy}/Runtime.meta"):
            self.assertIn(what, told.stdout)

    def test_the_messages_are_those_of_proto(self):
        made = self.folder / "made"
        run(SOURCE / "scripts" / "csharp_messages", made, check=True)
        kept = PACKAGE / "Runtime" / "Client" / "Messages"
        self.assertEqual(sorted(path.name for path in made.iterdir()), sorted(path.name for path in kept.glob("*.cs")))
        for path in made.iterdir():
            self.assertEqual(path.read_text(), (kept / path.name).read_text(), f"{path.name}: run scripts/csharp_messages")

    def test_the_manifest(self):
        manifest = json.loads((PACKAGE / "package.json").read_text())
        self.assertRegex(manifest["version"], r"^\d+\.\d+\.\d+$")
        version = re.search(r"project\(ecorche\s+VERSION (\S+)", (SOURCE / "CMakeLists.txt").read_text())
        self.assertEqual(manifest["version"], version.group(1))
        for sample in manifest["samples"]:
            self.assertTrue(list((PACKAGE / sample["path"]).glob("*.cs")), sample["path"])

    def test_assemblies_compile_as_their_definitions_say(self):
        engine = self.folder / "UnityEngine.dll"
        self.compile(engine, (HERE / "declarations").glob("*.cs"), [], "-nowarn:0649")
        definitions = {}
        for path in PACKAGE.rglob("*.asmdef"):
            one = json.loads(path.read_text())
            definitions[one["name"]] = path, one
        made = {}

        def make(name):
            if name in made or name not in definitions:
                return
            path, one = definitions[name]
            self.assertEqual(path.stem, name)
            for other in one["references"]:
                make(other)
            references = [made[other] for other in one["references"] if other in made]
            if not one.get("noEngineReferences"):
                references.append(engine)
            made[name] = self.folder / (name + ".dll")
            self.compile(made[name], path.parent.rglob("*.cs"), references, *(["-unsafe"] if one.get("allowUnsafeCode") else []))

        for name in definitions:
            make(name)
        self.assertEqual(len(made), 5)
        sample = PACKAGE / "Samples~" / "FiveSteps" / "FiveSteps.cs"
        self.compile(self.folder / "sample.dll", [sample], [made["Ecorche.Client"], made["Ecorche.Unity"], engine])

    def compile(self, out, sources, references, *more):
        # 0649: fields that Unity sets.
        done = run("mcs", "-langversion:latest", "-warnaserror", "-nowarn:0649", "-target:library", f"-out:{out}", *more, *(f"-r:{one}" for one in references),
                   *sorted(sources))
        self.assertEqual(done.returncode, 0, done.stdout + done.stderr)

    def test_the_shader_is_that_of_the_server(self):
        copy = PACKAGE / "Runtime" / "Unity" / "Shaders" / "skinning.hlsl"
        self.assertEqual(copy.read_bytes(), (SOURCE / "clients" / "shaders" / "skinning.hlsl").read_bytes(), "copy clients/shaders/skinning.hlsl")

    @unittest.skipUnless(shutil.which("glslangValidator"), "no glslangValidator (scripts/setup --tests installs it)")
    def test_shaders_compile(self):
        shaders = PACKAGE / "Runtime" / "Unity" / "Shaders"
        chosen = re.findall(r"(?:defined\((\w+)\)|#else)\n#define (METHOD|INFLUENCES) (\d)", (shaders / "EcorcheSkinning.compute").read_text())
        self.assertEqual(chosen, [("METHOD_LBS", "METHOD", "1"), ("METHOD_DQS", "METHOD", "2"), ("", "METHOD", "3"), ("INFLUENCES_1", "INFLUENCES", "1"),
                                  ("INFLUENCES_4", "INFLUENCES", "4"), ("", "INFLUENCES", "8")])
        for method in ("LBS", "DQS", "COR"):
            for influences in (1, 4, 8):
                self.glslang("comp", "EcorcheSkinning", shaders / "EcorcheSkinning.compute", f"-DMETHOD_{method}=1", f"-DINFLUENCES_{influences}=1")
        text = (shaders / "EcorcheSkinned.shader").read_text()
        program = re.search(r"HLSLPROGRAM(.*)ENDHLSL", text, re.S).group(1)
        plain = self.folder / "drawn.hlsl"
        plain.write_text(program.replace('#include "UnityCG.cginc"', "float4x4 UNITY_MATRIX_VP; float3 _WorldSpaceCameraPos;"))
        self.glslang("vert", "vertex", plain)
        self.glslang("frag", "fragment", plain)

    def glslang(self, stage, entry, source, *defines):
        done = run("glslangValidator", "-D", "-V", "-S", stage, "-e", entry, "--auto-map-bindings", "--auto-map-locations", *defines, "-o",
                   self.folder / "out.spv", source)
        self.assertEqual(done.returncode, 0, done.stdout + done.stderr)


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1] + sys.argv[2:])
