# SPDX-License-Identifier: Apache-2.0
"""Cases, models and posed folders, read into one plain form for drawing."""
import dataclasses
import gzip
import json
import pathlib

import h5py
import numpy as np
import yaml
from vtkmodules.util.numpy_support import numpy_to_vtk, numpy_to_vtkIdTypeArray
from vtkmodules.vtkCommonCore import vtkPoints
from vtkmodules.vtkCommonDataModel import VTK_TETRA, vtkCellArray, vtkPolyData, vtkUnstructuredGrid
from vtkmodules.vtkIOGeometry import vtkSTLReader
from vtkmodules.vtkIOPLY import vtkPLYReader
from vtkmodules.vtkIOXML import vtkXMLPolyDataReader, vtkXMLUnstructuredGridReader

SURFACES = {".stl": vtkSTLReader, ".ply": vtkPLYReader, ".vtp": vtkXMLPolyDataReader}
NRRD_TYPES = {"signed char": "i1", "int8": "i1", "unsigned char": "u1", "uint8": "u1", "uchar": "u1",
              "short": "i2", "int16": "i2", "unsigned short": "u2", "uint16": "u2", "ushort": "u2",
              "int": "i4", "int32": "i4", "unsigned int": "u4", "uint32": "u4", "uint": "u4", "float": "f4", "double": "f8"}


@dataclasses.dataclass
class Tissue:
    name: str
    group: str
    surface: vtkPolyData


@dataclasses.dataclass
class Volume:
    name: str
    voxels: np.ndarray  # indexed [k, j, i]
    spacing: np.ndarray  # mm along i, j, k
    labels: bool
    names: dict = dataclasses.field(default_factory=dict)  # of labels, by value


@dataclasses.dataclass
class Body:
    name: str
    tissues: list
    volumes: list
    tets: vtkUnstructuredGrid = None
    weights: dict = None  # segment name -> per-node weight
    segments: list = None
    bones: list = None  # of tet labels 1, 2, ...


def fail(where, what, mend):
    raise SystemExit(f"error: {where}: {what} ({mend})")


def read(path):
    """A case folder, a model file or a posed folder."""
    if path.is_dir() and (path / "case.yaml").exists():
        return read_case(path)
    if path.is_dir() and (path / "quality.json").exists():
        return read_posed(path)
    if path.suffix == ".hdf" and path.exists():
        return read_model(path)
    fail(path, "is no case folder, model (.hdf) or posed folder", "name a folder with case.yaml or quality.json, or a model")


def read_surface(path):
    reader = SURFACES[path.suffix]()
    reader.SetFileName(str(path))
    reader.Update()
    if reader.GetOutput().GetNumberOfPoints() == 0:
        fail(path, "holds no surface", "check that it is whole")
    return reader.GetOutput()


def surface_of(points, triangles):
    data = vtkPolyData()
    vtk_points = vtkPoints()
    vtk_points.SetData(numpy_to_vtk(np.ascontiguousarray(points, np.float32), deep=True))
    data.SetPoints(vtk_points)
    cells = vtkCellArray()
    count = len(triangles)
    cells.SetData(numpy_to_vtkIdTypeArray(np.arange(0, 3 * count + 1, 3, dtype=np.int64), deep=True),
                  numpy_to_vtkIdTypeArray(np.ascontiguousarray(triangles, np.int64).ravel(), deep=True))
    data.SetPolys(cells)
    return data


def tets_of(points, connectivity, cell_data):
    grid = vtkUnstructuredGrid()
    vtk_points = vtkPoints()
    vtk_points.SetData(numpy_to_vtk(np.ascontiguousarray(points, np.float32), deep=True))
    grid.SetPoints(vtk_points)
    cells = vtkCellArray()
    count = len(connectivity) // 4
    cells.SetData(numpy_to_vtkIdTypeArray(np.arange(0, 4 * count + 1, 4, dtype=np.int64), deep=True),
                  numpy_to_vtkIdTypeArray(np.ascontiguousarray(connectivity, np.int64), deep=True))
    grid.SetCells(VTK_TETRA, cells)
    for name, values in cell_data.items():
        array = numpy_to_vtk(np.ascontiguousarray(values), deep=True)
        array.SetName(name)
        grid.GetCellData().AddArray(array)
    return grid


def read_image(path):
    """Voxels and spacing of `read_placed_image`."""
    return read_placed_image(path)[:2]


def read_placed_image(path):
    """A 3-D scalar NRRD as ecorche writes it (attached data, raw or gzip, little-endian): voxels, spacing, origin."""
    data = path.read_bytes()
    head, _, body = data.partition(b"\n\n")
    fields = {}
    for line in head.decode("latin-1").splitlines()[1:]:
        key, separator, value = line.partition(":")
        if separator and not line.startswith("#"):
            fields[key.strip()] = value.lstrip("=").strip()
    sizes = [int(word) for word in fields["sizes"].split()]
    if len(sizes) != 3:
        return None, None, None  # a vector field: nothing to show as a slice
    if fields["encoding"] in ("gzip", "gz"):
        body = gzip.decompress(body)
    kind = np.dtype("<" + NRRD_TYPES[fields["type"]])
    voxels = np.frombuffer(body, kind, count=int(np.prod(sizes))).reshape(sizes[::-1])
    vectors = [np.array([float(x) for x in word.strip("()").split(",")]) for word in fields["space directions"].split()]
    origin = np.array([float(x) for x in fields.get("space origin", "(0,0,0)").strip("()").split(",")])
    return voxels, np.array([np.linalg.norm(vector) for vector in vectors]), origin


def read_case(folder):
    case = yaml.safe_load((folder / "case.yaml").read_text())

    def source(entry):
        return folder / (entry if isinstance(entry, str) else entry["file"])

    tissues = [Tissue("skin", "skin", read_surface(source(case["skin"])))]
    tissues += [Tissue(b["name"], "bone", read_surface(source(b))) for b in case["bones"]]
    tissues += [Tissue(t["name"], t.get("group", "other"), read_surface(source(t))) for t in case.get("tissues", [])]
    volumes = []
    entries = [(v["name"], v["file"], {}) for v in case.get("volumes", [])]
    if case.get("labels"):
        table = case["labels"].get("table")
        entries.append(("labels", case["labels"]["file"], table if isinstance(table, dict) else {0: "background"}))
    for name, file, names in entries:
        if file.endswith(".nrrd"):
            volumes.append(Volume(name, *read_image(folder / file), bool(names), names))
    return Body(case["name"], tissues, volumes)


def read_posed(folder):
    quality = json.loads((folder / "quality.json").read_text())
    groups = {entry["name"]: entry.get("group", "other") for entry in quality["tissues"]}
    written = {file["file"]: file for file in json.loads((folder / "posed.json").read_text())["files"]}
    tissues, volumes, tets, bones = [], [], None, []
    for path in sorted(folder.iterdir()):
        if path.suffix in SURFACES and path.stem in groups:
            tissues.append(Tissue(path.stem, groups[path.stem], read_surface(path)))
        elif path.suffix == ".nrrd" and path.stem not in ("displacement", "mask") and not path.stem.endswith("-mask"):
            voxels, spacing = read_image(path)
            if voxels is not None:
                file = written.get(path.name, {})
                names = {int(value): name for value, name in file.get("labels", {}).items()}
                volumes.append(Volume(path.stem, voxels, spacing, file.get("is") == "labels", names))
        elif path.suffix == ".vtu":
            reader = vtkXMLUnstructuredGridReader()
            reader.SetFileName(str(path))
            reader.Update()
            tets = reader.GetOutput()
            names = written.get(path.name, {}).get("labels", {})
            bones = [names[str(label)] for label in range(1, len(names))]
    return Body(folder.name, tissues, volumes, tets, bones=bones)


def text(value):
    return value.decode() if isinstance(value, bytes) else str(value)


def read_model(path):
    with h5py.File(path, "r") as file:
        vtk, own = file["VTKHDF"], file["ecorche"]
        points, connectivity = vtk["Points"][:], vtk["Connectivity"][:]
        label = vtk["CellData/label"][:]
        segments = [text(name) for name in own["skeleton/segment"][:]]
        offsets = own["weights/offsets"][:].astype(np.int64)
        rows = np.repeat(np.arange(len(points)), np.diff(offsets))
        weights = {}
        for index, name in enumerate(segments):
            dense = np.zeros(len(points), np.float32)
            mine = own["weights/segment"][:] == index
            dense[rows[mine]] = own["weights/weight"][:][mine]
            weights[name] = dense
        table = np.stack([weights[name] for name in segments])
        owner = table.argmax(axis=0)
        corner = connectivity.reshape(-1, 4)
        tets = tets_of(points, connectivity, {"label": label.astype(np.int32), "owner": owner[corner[:, 0]].astype(np.int32)})
        bones = [text(name) for name in own["labels/bone"][:]]
        tissues = []
        for name, group in own["tissues"].items():
            tissues.append(Tissue(name, text(group["group"][0]), surface_of(group["points"][:], group["triangles"][:])))
    return Body(path.stem, tissues, [], tets, weights, segments, bones)


def is_posed_folder(path):
    return pathlib.Path(path, "quality.json").exists()
