// SPDX-License-Identifier: Apache-2.0
#include "tests/unit/io/vtk_reading.hpp"

#include <tiny_gltf.h>
#include <vtkCell.h>
#include <vtkCellData.h>
#include <vtkDataArray.h>
#include <vtkNew.h>
#include <vtkOBJReader.h>
#include <vtkPLYReader.h>
#include <vtkPointData.h>
#include <vtkPolyData.h>
#include <vtkSTLReader.h>
#include <vtkUnstructuredGrid.h>
#include <vtkXMLPolyDataReader.h>
#include <vtkXMLUnstructuredGridReader.h>

#include <cstring>
#include <stdexcept>

namespace ecorche::foreign {
namespace {

template <class V, class F>
void copy(vtkPointSet& from, V& points, F& cells) {
  points.resize(from.GetNumberOfPoints(), 3);
  for (vtkIdType i = 0; i < from.GetNumberOfPoints(); ++i) {
    for (int k = 0; k < 3; ++k) points(i, k) = static_cast<typename V::Scalar>(from.GetPoint(i)[k]);
  }
  cells.resize(from.GetNumberOfCells(), F::ColsAtCompileTime);
  for (vtkIdType i = 0; i < from.GetNumberOfCells(); ++i) {
    vtkCell* cell = from.GetCell(i);
    if (cell->GetNumberOfPoints() != F::ColsAtCompileTime) throw std::runtime_error("a cell of another kind");
    for (int c = 0; c < F::ColsAtCompileTime; ++c)
      cells(i, c) = static_cast<std::int32_t>(cell->GetPointId(c));
  }
}

template <class R>
SurfaceMesh read(const std::filesystem::path& path) {
  const vtkNew<R> reader;
  reader->SetFileName(path.c_str());
  reader->Update();
  SurfaceMesh mesh;
  copy(*reader->GetOutput(), mesh.V, mesh.F);
  return mesh;
}

std::map<std::string, std::vector<float>> arrays(vtkFieldData& from) {
  std::map<std::string, std::vector<float>> out;
  for (int i = 0; i < from.GetNumberOfArrays(); ++i) {
    vtkDataArray* array = from.GetArray(i);
    auto& values = out[array->GetName()];
    for (vtkIdType t = 0; t < array->GetNumberOfTuples(); ++t) {
      for (int c = 0; c < array->GetNumberOfComponents(); ++c)
        values.push_back(static_cast<float>(array->GetComponent(t, c)));
    }
  }
  return out;
}

template <class M>
M rows(const tinygltf::Model& gltf, int accessor_number, Eigen::Index columns) {
  const tinygltf::Accessor& accessor = gltf.accessors.at(static_cast<std::size_t>(accessor_number));
  const tinygltf::BufferView& view = gltf.bufferViews.at(static_cast<std::size_t>(accessor.bufferView));
  const auto& bytes = gltf.buffers.at(static_cast<std::size_t>(view.buffer)).data;
  M out(static_cast<Eigen::Index>(view.byteLength / sizeof(typename M::Scalar)) / columns, columns);
  std::memcpy(out.data(), bytes.data() + view.byteOffset, view.byteLength);
  return out;
}

}  // namespace

SurfaceMesh vtk_surface(const std::filesystem::path& path) {
  if (path.extension() == ".stl") return read<vtkSTLReader>(path);
  if (path.extension() == ".ply") return read<vtkPLYReader>(path);
  if (path.extension() == ".obj") return read<vtkOBJReader>(path);
  return read<vtkXMLPolyDataReader>(path);
}

Grid vtk_tets(const std::filesystem::path& path) {
  const vtkNew<vtkXMLUnstructuredGridReader> reader;
  reader->SetFileName(path.c_str());
  reader->Update();
  Grid grid;
  copy(*reader->GetOutput(), grid.V, grid.T);
  grid.point_data = arrays(*reader->GetOutput()->GetPointData());
  grid.cell_data = arrays(*reader->GetOutput()->GetCellData());
  return grid;
}

Glb gltf_surface(const std::filesystem::path& path) {
  tinygltf::TinyGLTF reader;
  tinygltf::Model gltf;
  std::string error, warning;
  if (!reader.LoadBinaryFromFile(&gltf, &error, &warning, path.string()) || !warning.empty()) {
    throw std::runtime_error(error + warning);
  }
  const tinygltf::Primitive& primitive = gltf.meshes.at(0).primitives.at(0);
  Glb out;
  out.positions = rows<PointsF>(gltf, primitive.attributes.at("POSITION"), 3);
  out.normals = rows<PointsF>(gltf, primitive.attributes.at("NORMAL"), 3);
  out.F = rows<Triangles>(gltf, primitive.indices, 3);
  const auto& accessor = gltf.accessors.at(static_cast<std::size_t>(primitive.attributes.at("POSITION")));
  out.lowest = accessor.minValues;
  out.highest = accessor.maxValues;
  return out;
}

}  // namespace ecorche::foreign
