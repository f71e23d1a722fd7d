#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""What somebody sees who does not know the command yet: help, its examples, what a slip of the hand is told, and --json on failure."""
import json
import os
import pathlib
import re
import shlex
import shutil
import subprocess
import tempfile
import unittest

ECORCHE = os.environ["ECORCHE_BIN"]
CASE = pathlib.Path(os.environ["ECORCHE_CASE"])
MODEL = pathlib.Path(os.environ["ECORCHE_MODEL"])


def run(*words, cwd=None):
    return subprocess.run([ECORCHE, *map(str, words)], capture_output=True, text=True, timeout=240, cwd=cwd)


def subcommands():
    text = run("--help").stdout
    return re.findall(r"^  ([a-z]+) ", text[text.index("Subcommands:"):], re.M)


class Help(unittest.TestCase):
    def setUp(self):
        self.folder = pathlib.Path(tempfile.mkdtemp())
        self.addCleanup(shutil.rmtree, self.folder)

    def refused(self, code, line, *words):
        result = run(*words)
        self.assertEqual(result.returncode, code, result.stderr)
        self.assertIn(line, result.stderr)
        self.assertRegex(result.stderr.splitlines()[-1], r"^error: .+: .+ \(.+\)$")

    def test_every_page_has_types_and_an_example(self):
        self.assertGreater(len(subcommands()), 15)
        for name in subcommands():
            with self.subTest(name):
                page = run(name, "--help")
                self.assertEqual(page.returncode, 0)
                self.assertRegex(page.stdout, rf"(?m)^Example: ecorche {name} ")
                self.assertNotIn("TEXT:{", page.stdout)
                self.assertNotRegex(page.stdout, r"--output TEXT")

    def test_examples_run(self):
        """In the order of the pages, on the small phantom and a model of few tets: `fem` solves for it."""
        shutil.copytree(CASE, self.folder / "patient")
        made = run("preprocess", "patient", "-o", "patient.hdf", "--mesher", "lattice", "--max-tets", "40000", cwd=self.folder)
        self.assertEqual(made.returncode, 0, made.stderr)
        lines = [re.search(r"(?m)^Example: ecorche (.*)$", run(name, "--help").stdout).group(1) for name in subcommands()]
        later = ("phantom", "new", "preprocess", "probe", "serve", "stream", "unpose", "refill", "path", "deformers", "tears", "contact", "cohort", "report", "calibrate", "igtl")
        chosen = [line for line in lines if line.split()[0] not in later]
        chosen += [line for line in lines if line.split()[0] in ("unpose", "refill", "path")]
        self.assertGreater(len(chosen), 10)
        for line in chosen:
            result = run(*shlex.split(line), cwd=self.folder)
            self.assertEqual(result.returncode, 0, f"{line}: {result.stderr}")

    def test_slips(self):
        self.refused(64, "error: ecorche: unknown subcommand 'preproces' (did you mean 'preprocess'?)", "preproces", "ph")
        self.refused(64, "unknown subcommand 'nonsense' (one of phantom, new, check,", "nonsense", "--help")
        self.refused(64, "error: ecorche: no subcommand (one of phantom, new, check,")
        self.refused(64, "did you mean --output?", "phantom", "-o", self.folder / "x", "--outptu", "y")
        self.refused(64, "skin.stl: is no case (give a case.yaml, or the folder that holds one", "check", CASE / "skin.stl")
        self.refused(65, "case.yaml: is not an HDF5 file (a model is what ecorche preprocess writes", "info", CASE / "case.yaml")
        self.refused(64, "the model has no 'skn' (did you mean 'skin'?)", "pose", MODEL, "-o", self.folder / "p", "--tissues", "skn")
        self.refused(64, "cannot write tets as '.fbx' (use .vtu, .msh, .ele, .inp or .mcnp.inp; a rig goes into .glb or .bvh)",
                     "export", MODEL, "-o", self.folder / "m.fbx")
        open_brace = self.folder / "case.yaml"
        open_brace.write_text("name: x\nskin: {{file: a}\n")
        self.refused(78, "is a { or [ before this line not closed?", "check", open_brace)

    def test_failures_are_json_too(self):
        for code, kind, words in ((64, "usage", ("nonsense",)), (66, "missing_input", ("info", self.folder / "none.hdf")),
                                  (78, "config", ("check", CASE / "truth.yaml"))):
            result = run(*words, "--json")
            self.assertEqual(result.returncode, code, result.stderr)
            said = json.loads(result.stdout)
            self.assertIs(said["ok"], False)
            self.assertEqual((said["error"]["kind"], said["error"]["exit_code"]), (kind, code))
            where, what, mend = (said["error"][key] for key in ("where", "what", "mend"))
            self.assertEqual(result.stderr.splitlines()[-1], f"error: {where}: {what} ({mend})")

    def test_ok_is_always_said(self):
        for words in (("info", MODEL), ("rig", CASE), ("export", MODEL, "-o", self.folder / "m.bvh"),
                      ("motion", CASE / "motion" / "walk.bvh", "--model", MODEL)):
            self.assertIs(json.loads(run(*words, "--json").stdout)["ok"], True, words)


if __name__ == "__main__":
    unittest.main()
