#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Tets in the formats of other programs, as meshio reads them: nodes, corners, regions."""
import json
import pathlib
import shutil
import subprocess
import sys
import tempfile
import unittest

import meshio
import numpy

IO_FILES = sys.argv.pop(1)
NAMES = {0: "soft", 1: "femur_right", 2: "9th_rib"}


class Tets(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = pathlib.Path(tempfile.mkdtemp())
        cls.addClassCleanup(shutil.rmtree, cls.folder)
        truth = subprocess.run([IO_FILES, "tets", str(cls.folder), "."], check=True, capture_output=True, text=True)
        truth = json.loads(truth.stdout)
        cls.points, cls.tets = numpy.array(truth["points"]), numpy.array(truth["tets"])
        cls.labels = numpy.array(truth["labels"])

    def assert_mesh(self, mesh, scale=1):
        numpy.testing.assert_allclose(mesh.points, scale * self.points, rtol=1e-6)
        cells = numpy.vstack([block.data for block in mesh.cells if block.type == "tetra"])
        numpy.testing.assert_array_equal(cells, self.tets)
        a, b, c, d = (mesh.points[cells[:, i]] for i in range(4))
        self.assertTrue((numpy.einsum("ij,ij->i", numpy.cross(b - a, c - a), d - a) > 0).all())

    def assert_sets(self, mesh, names):
        for label, name in names.items():
            found = numpy.concatenate([numpy.asarray(rows).ravel() for rows in mesh.cell_sets[name]])
            numpy.testing.assert_array_equal(found.astype(int), numpy.flatnonzero(self.labels == label), name)

    def test_gmsh(self):
        mesh = meshio.read(self.folder / "a.msh")
        self.assert_mesh(mesh)
        numpy.testing.assert_array_equal(numpy.concatenate(mesh.cell_data["gmsh:physical"]), self.labels + 1)
        self.assertEqual({name: tuple(value) for name, value in mesh.field_data.items()},
                         {name: (label + 1, 3) for label, name in NAMES.items()})

    def test_tetgen(self):
        mesh = meshio.read(self.folder / "a.ele")
        self.assert_mesh(mesh)
        numpy.testing.assert_array_equal(numpy.concatenate(mesh.cell_data["tetgen:ref"]), self.labels)
        for label, name in NAMES.items():
            self.assertIn(f"# region {label} {name}\n", (self.folder / "a.ele").read_text())

    def test_abaqus(self):
        mesh = meshio.read(self.folder / "a.inp")
        self.assert_mesh(mesh)
        self.assert_sets(mesh, {0: "soft", 1: "femur_right", 2: "r_9th_rib"})

    def test_mcnp(self):
        mesh = meshio.read(self.folder / "a.mcnp.inp")
        self.assert_mesh(mesh, 0.1)
        self.assert_sets(mesh, {label: f"Set-material_tally_{label + 1:03}" for label in NAMES})
        text = (self.folder / "a.mcnp.inp").read_text()
        for label, name in NAMES.items():
            self.assertRegex(text, rf"(?m)^\*Solid Section, elset=Set-material_tally_{label + 1:03}, material=Material-{name}_{label + 1:03}$")
        self.assertLessEqual(max(line.count(",") for line in text.splitlines()), 16)
        order = [text.index(word) for word in ("*Part", "*Node", "*Element", "*Elset", "*Solid", "*End Part", "*Assembly", "*Instance",
                                               "*End Instance", "*End Assembly", "*Material")]
        self.assertEqual(order, sorted(order))

    def test_vtu(self):
        mesh = meshio.read(self.folder / "a.vtu")
        self.assert_mesh(mesh)
        numpy.testing.assert_array_equal(numpy.concatenate(mesh.cell_data["label"]).ravel(), self.labels)


if __name__ == "__main__":
    unittest.main(verbosity=2)
