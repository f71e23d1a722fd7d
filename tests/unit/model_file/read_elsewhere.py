#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Opens a model with h5py and with VTK's own reader, neither of which knows ecorche.

usage: read_elsewhere.py MODEL.hdf
"""
import sys

import h5py
import numpy as np
from vtkmodules.util.numpy_support import vtk_to_numpy
from vtkmodules.vtkCommonDataModel import VTK_TETRA
from vtkmodules.vtkIOHDF import vtkHDFReader


def check_h5py(path):
    with h5py.File(path, "r") as file:
        root = file["VTKHDF"]
        assert list(root.attrs["Version"]) == [1, 0]
        assert root.attrs["Type"] == b"UnstructuredGrid", root.attrs["Type"]
        assert root.attrs.get_id("Type").get_type().get_cset() == h5py.h5t.CSET_ASCII
        model = file["ecorche"]
        assert list(model.attrs["format"]) == [1, 6]  # it has corrections

        def check(name, item):
            if not isinstance(item, h5py.Dataset):
                return
            assert item.chunks is None and item.compression is None and item.external is None, name
            assert not item.is_virtual, name
            # Storage of 64 KiB and more begins on a page.
            assert item.nbytes < 65536 or item.id.get_offset() % 4096 == 0, name

        file.visititems(check)
        points = root["Points"][()]
        tets = root["Connectivity"][()].reshape(-1, 4)
        a, b, c, d = (points[tets[:, corner]].astype(float) for corner in range(4))
        volume = np.einsum("ij,ij->i", np.cross(b - a, c - a), d - a)
        assert volume.min() > 0, "a tet is not positive"
        offsets = model["weights/offsets"][()].astype(int)
        sums = np.add.reduceat(model["weights/weight"][()].astype(float), offsets[:-1])
        assert np.abs(sums - 1).max() < 1e-6, "a row of weights does not sum to 1"
        heaviest = root["PointData/dominant_weight"][()]
        assert np.array_equal(heaviest, np.maximum.reduceat(model["weights/weight"][()], offsets[:-1]))
        names = sorted(model["tissues"], key=lambda name: model["tissues"][name]["index"][0])
        print(f"h5py {h5py.__version__}: {len(points)} nodes, {len(tets)} tets, tissues {', '.join(names)}")
        return points, tets, root["CellData/label"][()]


def check_vtk(path, points, tets, label):
    reader = vtkHDFReader()
    assert reader.CanReadFile(path)
    reader.SetFileName(path)
    reader.Update()
    grid = reader.GetOutput()
    assert grid.GetNumberOfPoints() == len(points)
    assert grid.GetNumberOfCells() == len(tets)
    assert all(grid.GetCellType(cell) == VTK_TETRA for cell in range(len(tets)))
    bounds = np.array(grid.GetBounds()).reshape(3, 2)
    assert np.array_equal(bounds[:, 0], points.min(axis=0)) and np.array_equal(bounds[:, 1], points.max(axis=0))
    assert np.array_equal(vtk_to_numpy(grid.GetCells().GetConnectivityArray()).reshape(-1, 4), tets)
    cells, nodes = grid.GetCellData(), grid.GetPointData()
    assert np.array_equal(vtk_to_numpy(cells.GetArray("label")), label)
    for name in ("dominant_segment", "dominant_weight"):
        assert nodes.GetArray(name).GetNumberOfTuples() == len(points), name
    print(f"vtkHDFReader: {grid.GetNumberOfPoints()} points, {grid.GetNumberOfCells()} cells, bounds {grid.GetBounds()}, "
          f"cell arrays {[cells.GetArrayName(i) for i in range(cells.GetNumberOfArrays())]}, "
          f"point arrays {[nodes.GetArrayName(i) for i in range(nodes.GetNumberOfArrays())]}")


check_vtk(sys.argv[1], *check_h5py(sys.argv[1]))
