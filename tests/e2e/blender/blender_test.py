#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""The add-on in Debian's Blender, without a screen: installed from its zip, with a model and with a server; and a picture.

usage: blender_test.py SOURCE LIBRARY CLIENT_LIBRARY [PICTURE.png]; the environment is that of the fixtures
"""
import os
import pathlib
import subprocess
import sys
import tempfile
import unittest

SOURCE, LIBRARY, CLIENT = (pathlib.Path(word) for word in sys.argv[1:4])
PICTURE = sys.argv[4] if len(sys.argv) > 4 else None
MODEL, ECORCHE = os.environ["ECORCHE_MODEL"], os.environ["ECORCHE_BIN"]
HERE = pathlib.Path(__file__).parent
sys.path.insert(0, str(SOURCE / "tests" / "e2e" / "stream"))

from serving import Server  # noqa: E402


class Blender(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        folder = tempfile.TemporaryDirectory()
        cls.addClassCleanup(folder.cleanup)
        cls.folder = pathlib.Path(folder.name)
        cls.zip = cls.folder / "ecorche_blender.zip"
        subprocess.run([SOURCE / "scripts" / "blender_addon", cls.zip], check=True)

    def blender(self, script, *words):
        """Runs one script in a Blender with the add-on and nothing else of the user."""
        environment = {**os.environ, "ECORCHE_LIBRARY": str(LIBRARY), "ECORCHE_CLIENT_LIBRARY": str(CLIENT), "ADDON_ZIP": str(self.zip),
                       "BLENDER_USER_SCRIPTS": str(self.folder / "scripts"), "BLENDER_USER_CONFIG": str(self.folder / "config"), "HOME": str(self.folder)}
        environment.pop("PYTHONPATH", None)
        done = subprocess.run(["blender", "--background", "--factory-startup", "--python-exit-code", "3", "--python", HERE / "within.py", "--", script,
                               *map(str, words)], capture_output=True, text=True, env=environment, timeout=280)
        self.assertEqual(done.returncode, 0, done.stdout[-3000:] + done.stderr[-3000:])
        self.assertIn(f"{script}: all well", done.stdout)

    def test_the_zip_is_the_same_bytes_again(self):
        again = self.folder / "again.zip"
        subprocess.run([SOURCE / "scripts" / "blender_addon", again], check=True)
        self.assertEqual(again.read_bytes(), self.zip.read_bytes())

    def test_a_model_here(self):
        self.blender("local", MODEL)

    def test_a_picture(self):
        picture = PICTURE or self.folder / "picture.png"
        self.blender("picture", MODEL, picture)
        self.assertGreater(pathlib.Path(picture).stat().st_size, 20000)

    def test_a_server(self):
        walk = pathlib.Path(os.environ["ECORCHE_CASE"]) / "motion"
        with Server(MODEL, options=("--clips", walk)) as server:
            self.blender("served", server.address)


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1], verbosity=2)
