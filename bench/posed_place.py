# SPDX-License-Identifier: Apache-2.0
"""Where a place of the scan lies in a posed folder."""
import numpy as np
from vtkmodules.util.numpy_support import vtk_to_numpy
from vtkmodules.vtkIOXML import vtkXMLUnstructuredGridReader


def posed_place(folder, scanned):
    """Where the node nearest to `scanned`, LPS mm, goes in the tets (body.vtu) of the folder."""
    reader = vtkXMLUnstructuredGridReader()
    reader.SetFileName(str(folder / "body.vtu"))
    reader.Update()
    grid = reader.GetOutput()
    posed, moved = (vtk_to_numpy(array) for array in (grid.GetPoints().GetData(), grid.GetPointData().GetArray("displacement")))
    nearest = np.argmin(((posed - moved - scanned) ** 2).sum(axis=1))
    return scanned + moved[nearest]
