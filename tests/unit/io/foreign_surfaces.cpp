// SPDX-License-Identifier: Apache-2.0
#include "tests/unit/io/foreign_surfaces.hpp"

#include <assimp/postprocess.h>
#include <assimp/scene.h>
#include <vtkCellArray.h>
#include <vtkFieldData.h>
#include <vtkNew.h>
#include <vtkOBJWriter.h>
#include <vtkPLYWriter.h>
#include <vtkPoints.h>
#include <vtkPolyData.h>
#include <vtkPolyDataWriter.h>
#include <vtkStringArray.h>
#include <vtkStripper.h>
#include <vtkTriangleFilter.h>
#include <vtkXMLPolyDataWriter.h>

#include <assimp/Exporter.hpp>
#include <assimp/Importer.hpp>
#include <stdexcept>

namespace ecorche::foreign {
namespace {

vtkNew<vtkPolyData> poly_data(const SurfaceMesh& mesh) {
  vtkNew<vtkPolyData> out;
  const vtkNew<vtkPoints> points;
  points->SetDataTypeToFloat();
  for (Eigen::Index i = 0; i < mesh.V.rows(); ++i)
    points->InsertNextPoint(mesh.V(i, 0), mesh.V(i, 1), mesh.V(i, 2));
  const vtkNew<vtkCellArray> cells;
  for (Eigen::Index f = 0; f < mesh.F.rows(); ++f) {
    const vtkIdType corners[3]{mesh.F(f, 0), mesh.F(f, 1), mesh.F(f, 2)};
    cells->InsertNextCell(3, corners);
  }
  out->SetPoints(points);
  out->SetPolys(cells);
  return out;
}

template <class W>
void write(W& writer, vtkPolyData* data, const std::filesystem::path& path) {
  writer.SetFileName(path.c_str());
  writer.SetInputData(data);
  if (writer.Write() != 1) throw std::runtime_error("VTK did not write " + path.string());
}

void write_vtp(vtkPolyData* data, const std::filesystem::path& path, const std::string& form) {
  const vtkNew<vtkXMLPolyDataWriter> writer;
  writer->SetCompressorTypeToNone();
  if (form == "text") writer->SetDataModeToAscii();
  if (form == "inline") writer->SetDataModeToBinary();
  if (form == "raw" || form == "base64" || form == "big") writer->SetDataModeToAppended();
  if (form == "raw" || form == "big") writer->EncodeAppendedDataOff();
  if (form == "big") writer->SetByteOrderToBigEndian();
  if (form == "zlib" || form == "zlib64") writer->SetCompressorTypeToZLib();
  if (form == "zlib") writer->EncodeAppendedDataOff();
  if (form == "zlib64") {
    writer->SetDataModeToBinary();
    writer->SetHeaderTypeToUInt64();
  }
  if (form == "lz4") writer->SetCompressorTypeToLZ4();
  writer->SetBlockSize(64);  // several blocks even of a small mesh
  write(*writer, data, path);
}

}  // namespace

void vtk_write(const std::filesystem::path& path, const SurfaceMesh& mesh, const std::string& form) {
  const vtkNew<vtkPolyData> made = poly_data(mesh);
  vtkPolyData* data = made;
  std::string how = form;
  const vtkNew<vtkStripper> stripper;
  if (form.starts_with("strips ")) {
    how = form.substr(7);
    stripper->SetInputData(data);
    stripper->Update();
    data = stripper->GetOutput();
    if (data->GetNumberOfStrips() == 0) throw std::runtime_error("VTK made no strip");
  }
  if (form.starts_with("strings ")) {  // of lengths that take one byte and two
    how = form.substr(8);
    const vtkNew<vtkStringArray> names;
    names->SetName("names");
    for (const char* name : {"one", "", "two words"}) names->InsertNextValue(name);
    names->InsertNextValue(std::string(100, 'x'));
    data->GetFieldData()->AddArray(names);
  }
  const std::string extension = path.extension().string();
  if (extension == ".ply") {
    const vtkNew<vtkPLYWriter> writer;
    writer->SetFileType(how == "text" ? 1 : 2);
    if (how == "big") writer->SetDataByteOrderToBigEndian();
    write(*writer, data, path);
  } else if (extension == ".vtk") {
    const vtkNew<vtkPolyDataWriter> writer;
    if (how.starts_with("binary")) writer->SetFileTypeToBinary();
    if (how.ends_with("4")) writer->SetFileVersion(42);
    writer->SetHeader("a title with SPACE=RAS in it");
    write(*writer, data, path);
  } else if (extension == ".obj") {
    const vtkNew<vtkOBJWriter> writer;
    write(*writer, data, path);
  } else {
    write_vtp(data, path, how);
  }
}

SurfaceMesh assimp_surface(const std::filesystem::path& path) {
  Assimp::Importer importer;
  const aiScene* scene =
      importer.ReadFile(path.string(), aiProcess_Triangulate | aiProcess_PreTransformVertices);
  if (scene == nullptr) throw std::runtime_error(importer.GetErrorString());
  SurfaceMesh out;
  for (unsigned m = 0; m < scene->mNumMeshes; ++m) {
    const aiMesh& mesh = *scene->mMeshes[m];
    const Eigen::Index points = out.V.rows();
    out.V.conservativeResize(points + mesh.mNumVertices, 3);
    for (unsigned i = 0; i < mesh.mNumVertices; ++i) {
      const aiVector3D& p = mesh.mVertices[i];
      out.V.row(points + i) = Eigen::RowVector3d(p.x, p.y, p.z);
    }
    for (unsigned f = 0; f < mesh.mNumFaces; ++f) {
      if (mesh.mFaces[f].mNumIndices != 3) continue;  // points and lines
      out.F.conservativeResize(out.F.rows() + 1, 3);
      for (unsigned c = 0; c < 3; ++c)
        out.F(out.F.rows() - 1, c) = static_cast<std::int32_t>(points + mesh.mFaces[f].mIndices[c]);
    }
  }
  return out;
}

void assimp_write(const std::filesystem::path& path, const SurfaceMesh& mesh, const std::string& format) {
  aiScene scene;  // owns all that follows
  scene.mRootNode = new aiNode();
  scene.mMaterials = new aiMaterial* [1] { new aiMaterial() };
  scene.mNumMaterials = 1;
  auto* out = new aiMesh();
  scene.mMeshes = new aiMesh* [1] { out };
  scene.mNumMeshes = 1;
  scene.mRootNode->mMeshes = new unsigned[1]{0};
  scene.mRootNode->mNumMeshes = 1;
  out->mPrimitiveTypes = aiPrimitiveType_TRIANGLE;
  out->mNumVertices = static_cast<unsigned>(mesh.V.rows());
  out->mVertices = new aiVector3D[out->mNumVertices];
  for (unsigned i = 0; i < out->mNumVertices; ++i) {
    out->mVertices[i] = aiVector3D(static_cast<float>(mesh.V(i, 0)), static_cast<float>(mesh.V(i, 1)),
                                   static_cast<float>(mesh.V(i, 2)));
  }
  out->mNumFaces = static_cast<unsigned>(mesh.F.rows());
  out->mFaces = new aiFace[out->mNumFaces];
  for (unsigned f = 0; f < out->mNumFaces; ++f) {
    out->mFaces[f].mNumIndices = 3;
    out->mFaces[f].mIndices = new unsigned[3];
    for (unsigned c = 0; c < 3; ++c) out->mFaces[f].mIndices[c] = static_cast<unsigned>(mesh.F(f, c));
  }
  Assimp::Exporter exporter;
  if (exporter.Export(&scene, format, path.string()) != aiReturn_SUCCESS)
    throw std::runtime_error(exporter.GetErrorString());
}

}  // namespace ecorche::foreign
