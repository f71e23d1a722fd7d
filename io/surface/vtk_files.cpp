// SPDX-License-Identifier: Apache-2.0
#include "io/surface/vtk_files.hpp"

#include <vtkCellArray.h>
#include <vtkCellData.h>
#include <vtkCommand.h>
#include <vtkFloatArray.h>
#include <vtkIdTypeArray.h>
#include <vtkIntArray.h>
#include <vtkNew.h>
#include <vtkPLYWriter.h>
#include <vtkPointData.h>
#include <vtkPoints.h>
#include <vtkPolyData.h>
#include <vtkUnstructuredGrid.h>
#include <vtkXMLPolyDataWriter.h>
#include <vtkXMLUnstructuredGridWriter.h>

#include <algorithm>
#include <cstring>

#include <ecorche/values/error.hpp>

namespace ecorche::io::vtk_files {
namespace {

// Keeps what VTK would print on stderr.
class Messages final : public vtkCommand {
 public:
  static Messages* New() { return new Messages; }
  void Execute(vtkObject*, unsigned long event, void* text) override {
    if (event != vtkCommand::ErrorEvent || text == nullptr || !first.empty()) return;
    // "ERROR: In ./IO/PLY/vtkPLYWriter.cxx, line 144\nvtkPLYWriter (0x55e1): what\n\n"
    const std::string_view all = static_cast<const char*>(text);
    const std::size_t told = all.find("): ");
    first = all.substr(told == all.npos ? 0 : told + 3);
    first.erase(first.find_last_not_of(" \n") + 1);
  }
  std::string first;
};

template <class W>
void run(W& writer, const std::filesystem::path& path) {
  const vtkNew<Messages> messages;
  writer.AddObserver(vtkCommand::ErrorEvent, messages);
  writer.AddObserver(vtkCommand::WarningEvent, messages);
  writer.SetFileName(path.c_str());
  const bool written = writer.Write() == 1;
  if (written && messages->first.empty() && writer.GetErrorCode() == 0) return;
  const unsigned long code = writer.GetErrorCode();
  throw Error(ErrorKind::io, path.string(),
              "VTK could not write it" + (code != 0 ? " (error " + std::to_string(code) + ")" : "") +
                  (messages->first.empty() ? "" : ": " + messages->first),
              "check the disk's free space");
}

template <class M>
void set_points(const M& V, vtkPointSet& to) {
  const vtkNew<vtkPoints> points;
  points->SetDataTypeToFloat();
  points->SetNumberOfPoints(V.rows());
  auto* out = static_cast<float*>(points->GetVoidPointer(0));
  for (Eigen::Index i = 0; i < V.size(); ++i) out[i] = static_cast<float>(V.data()[i]);
  to.SetPoints(points);
}

template <class M>
vtkNew<vtkCellArray> cells(const M& rows, Eigen::Index points) {
  const vtkIdType corners = rows.cols();
  const vtkNew<vtkIdTypeArray> offsets, connectivity;
  offsets->SetNumberOfValues(rows.rows() + 1);
  connectivity->SetNumberOfValues(rows.size());
  for (vtkIdType i = 0; i <= rows.rows(); ++i) offsets->SetValue(i, i * corners);
  for (vtkIdType i = 0; i < rows.size(); ++i) {
    const std::int32_t v = rows.data()[i];
    if (v < 0 || v >= points) {
      throw Error(ErrorKind::internal, "mesh",
                  "row " + std::to_string(i / corners) + " uses vertex " + std::to_string(v), "report this");
    }
    connectivity->SetValue(i, v);
  }
  vtkNew<vtkCellArray> out;
  out->SetData(offsets, connectivity);
  return out;
}

template <class M>
vtkNew<vtkPolyData> poly_data(const M& mesh) {
  vtkNew<vtkPolyData> out;
  set_points(mesh.V, *out);
  out->SetPolys(cells(mesh.F, mesh.V.rows()));
  return out;
}

void add_array(const GridArray& array, std::size_t rows, vtkFieldData& to) {
  if (array.components < 1 || array.values.size() != rows * static_cast<std::size_t>(array.components)) {
    throw Error(ErrorKind::internal, array.name,
                "has " + std::to_string(array.values.size()) + " values for " + std::to_string(rows) +
                    " rows of " + std::to_string(array.components),
                "report this");
  }
  const vtkNew<vtkFloatArray> values;
  values->SetName(array.name.c_str());
  values->SetNumberOfComponents(array.components);
  values->SetNumberOfTuples(static_cast<vtkIdType>(rows));
  if (!array.values.empty())
    std::memcpy(values->GetPointer(0), array.values.data(), array.values.size() * sizeof(float));
  to.AddArray(values);
}

// As plain bytes after the XML: the fastest form that every reader of VTK files knows.
void set_raw(vtkXMLWriter& writer) {
  writer.SetDataModeToAppended();
  writer.EncodeAppendedDataOff();
  writer.SetCompressorTypeToNone();
  writer.SetHeaderTypeToUInt64();
}

}  // namespace

void write_ply(const std::filesystem::path& path, const SurfaceMesh& mesh) {
  const vtkNew<vtkPLYWriter> writer;
  writer->SetFileTypeToBinary();
  writer->SetDataByteOrderToLittleEndian();
  writer->AddComment("SPACE=LPS");
  const auto data = poly_data(mesh);
  writer->SetInputData(data);
  run(*writer, path);
}

void write_vtp(const std::filesystem::path& path, const SurfaceMesh& mesh,
               const std::vector<GridArray>& point_data) {
  const vtkNew<vtkXMLPolyDataWriter> writer;
  set_raw(*writer);
  const auto data = poly_data(mesh);
  for (const GridArray& array : point_data)
    add_array(array, static_cast<std::size_t>(mesh.V.rows()), *data->GetPointData());
  writer->SetInputData(data);
  run(*writer, path);
}

void write_tied(const std::filesystem::path& path, const TiedSurfaces& surfaces) {
  const vtkNew<vtkXMLPolyDataWriter> writer;
  set_raw(*writer);
  const auto data = poly_data(surfaces);
  const vtkNew<vtkIntArray> tets;
  tets->SetName("tet");
  tets->SetNumberOfTuples(static_cast<vtkIdType>(surfaces.tet.size()));
  std::copy(surfaces.tet.begin(), surfaces.tet.end(), tets->GetPointer(0));
  data->GetPointData()->AddArray(tets);
  const float* shares = surfaces.share.data();
  add_array({"share", 4, {shares, shares + surfaces.share.size()}}, surfaces.tet.size(),
            *data->GetPointData());
  writer->SetInputData(data);
  run(*writer, path);
}

void write_vtu(const std::filesystem::path& path, const PointsF& V, const Tets& T,
               const std::vector<GridArray>& point_data, const std::vector<GridArray>& cell_data) {
  const vtkNew<vtkUnstructuredGrid> grid;
  set_points(V, *grid);
  grid->SetCells(VTK_TETRA, cells(T, V.rows()));
  for (const GridArray& array : point_data)
    add_array(array, static_cast<std::size_t>(V.rows()), *grid->GetPointData());
  for (const GridArray& array : cell_data)
    add_array(array, static_cast<std::size_t>(T.rows()), *grid->GetCellData());
  const vtkNew<vtkXMLUnstructuredGridWriter> writer;
  set_raw(*writer);
  writer->SetInputData(grid);
  run(*writer, path);
}

}  // namespace ecorche::io::vtk_files
