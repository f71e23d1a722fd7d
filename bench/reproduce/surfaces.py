# SPDX-License-Identifier: Apache-2.0
"""Distances between surfaces, and what lies within them."""
import numpy as np
from vtkmodules.util.numpy_support import numpy_to_vtk, vtk_to_numpy
from vtkmodules.vtkCommonCore import mutable, vtkPoints
from vtkmodules.vtkCommonDataModel import vtkPolyData, vtkStaticCellLocator
from vtkmodules.vtkFiltersGeometry import vtkGeometryFilter
from vtkmodules.vtkFiltersModeling import vtkSelectEnclosedPoints
from vtkmodules.vtkIOGeometry import vtkSTLReader
from vtkmodules.vtkIOXML import vtkXMLUnstructuredGridReader

MOST = 20_000  # points of a surface that are asked, evenly along its own order


def read(path):
    """A surface; an STL's corners that are the same become one vertex."""
    reader = vtkSTLReader()
    reader.SetFileName(str(path))
    reader.Update()
    return reader.GetOutput()


def boundary(path):
    """The outside of the tets of a .vtu."""
    reader, outside = vtkXMLUnstructuredGridReader(), vtkGeometryFilter()
    reader.SetFileName(str(path))
    outside.SetInputConnection(reader.GetOutputPort())
    outside.Update()
    return outside.GetOutput()


def vertices(surface):
    return vtk_to_numpy(surface.GetPoints().GetData()).astype(float)


def thinned(points, most=MOST):
    return points[:: max(1, -(-len(points) // most))]


def some_vertices(path):
    return thinned(vertices(read(path)), 100)


def distances(points, surface):
    """mm from each point to the nearest place of the surface."""
    locator = vtkStaticCellLocator()
    locator.SetDataSet(surface)
    locator.BuildLocator()
    out, at, cell, part, square = np.empty(len(points)), [0.0] * 3, mutable(0), mutable(0), mutable(0.0)
    for row, point in enumerate(points):
        locator.FindClosestPoint(point, at, cell, part, square)
        out[row] = square.get() ** 0.5
    return out


def apart(one, other):
    """Mean distance in mm of one's vertices to the other, and of the other's to the one."""
    return tuple(float(distances(thinned(vertices(a)), b).mean()) for a, b in ((one, other), (other, one)))


def inside(points, surface):
    """Which points a closed surface encloses."""
    cloud, where, test = vtkPolyData(), vtkPoints(), vtkSelectEnclosedPoints()
    where.SetData(numpy_to_vtk(np.ascontiguousarray(points, float), deep=True))
    cloud.SetPoints(where)
    test.SetInputData(cloud)
    test.SetSurfaceData(surface)
    test.SetTolerance(1e-6)
    test.Update()
    return vtk_to_numpy(test.GetOutput().GetPointData().GetArray("SelectedPoints")).astype(bool)
