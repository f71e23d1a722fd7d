# SPDX-License-Identifier: Apache-2.0
"""C# compiled by Debian's mcs, and a served body whose spine bends at each vertebra."""
import pathlib
import subprocess
import tempfile

from serving import ECORCHE, Server


def compile_program(out, *sources):
    subprocess.run(["mcs", "-langversion:latest", "-unsafe", "-optimize+", "-warnaserror", f"-out:{out}", *map(str, sources)], check=True)


def told_of_levels(check):
    """What the program says of the small phantom by vertebra."""
    with tempfile.TemporaryDirectory() as name:
        folder = pathlib.Path(name)
        scan = [folder / f"scan/{file}.nii.gz" for file in ("ct", "total", "appendicular_bones", "body")]
        for words in (("phantom", "-o", folder / "scan", "--size", "small", "--scan", "totalsegmentator_ml"),
                      ("new", *scan, "-o", folder / "case", "--spine", "vertebrae"),
                      ("preprocess", folder / "case", "-o", folder / "model.hdf", "--max-tets", "40000")):
            subprocess.run([ECORCHE, *words], check=True, capture_output=True)
        with Server(folder / "model.hdf") as server:
            return check("follow", server.address)
