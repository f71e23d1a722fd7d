// SPDX-License-Identifier: Apache-2.0
#include "io/surface/gltf_build.hpp"

#include <Eigen/Geometry>
#include <array>
#include <cstring>
#include <fstream>

#include <ecorche/values/error.hpp>

namespace ecorche::io::gltf {
namespace {

// The cross product of two edges is twice the triangle's area long: summing it weights by area.
Points vertex_normals(const SurfaceMesh& mesh) {
  Points normals = Points::Zero(mesh.V.rows(), 3);
  for (Eigen::Index f = 0; f < mesh.F.rows(); ++f) {
    for (int c = 0; c < 3; ++c) {
      if (mesh.F(f, c) < 0 || mesh.F(f, c) >= mesh.V.rows()) {
        throw Error(ErrorKind::internal, "glb",
                    "triangle " + std::to_string(f) + " uses vertex " + std::to_string(mesh.F(f, c)),
                    "report this");
      }
    }
    const Eigen::RowVector3d a = mesh.V.row(mesh.F(f, 0));
    const Eigen::Vector3d u = mesh.V.row(mesh.F(f, 1)) - a, v = mesh.V.row(mesh.F(f, 2)) - a;
    const Eigen::RowVector3d normal = u.cross(v).transpose();
    for (int c = 0; c < 3; ++c) normals.row(mesh.F(f, c)) += normal;
  }
  for (Eigen::Index i = 0; i < normals.rows(); ++i) {
    const double length = normals.row(i).norm();
    // glTF wants unit vectors, also of vertices without area.
    normals.row(i) = length > 0 ? Eigen::RowVector3d(normals.row(i) / length) : Eigen::RowVector3d(0, 0, 1);
  }
  return normals;
}

int add_rows(tinygltf::Model& gltf, const Rows& rows) {
  return add_array(gltf, rows.data(), sizeof(float) * static_cast<std::size_t>(rows.size()),
                   static_cast<std::size_t>(rows.rows()), TINYGLTF_COMPONENT_TYPE_FLOAT, TINYGLTF_TYPE_VEC3,
                   TINYGLTF_TARGET_ARRAY_BUFFER);
}

}  // namespace

Rows to_gltf(const Points& V, double scale) {
  Rows out(V.rows(), 3);
  out.col(0) = (scale * V.col(0)).cast<float>();
  out.col(1) = (scale * V.col(2)).cast<float>();
  out.col(2) = (-scale * V.col(1)).cast<float>();
  return out;
}

tinygltf::Model new_model() {
  tinygltf::Model gltf;
  gltf.asset.version = "2.0";
  gltf.asset.generator = "ecorche";
  gltf.buffers.emplace_back();
  return gltf;
}

int add_array(tinygltf::Model& gltf, const void* data, std::size_t bytes, std::size_t count, int component,
              int type, int target) {
  auto& buffer = gltf.buffers[0].data;
  tinygltf::BufferView view;
  view.buffer = 0;
  view.byteOffset = buffer.size();
  view.byteLength = bytes;
  if (target != 0) view.target = target;
  buffer.resize(buffer.size() + bytes);
  if (bytes > 0) std::memcpy(buffer.data() + view.byteOffset, data, bytes);
  gltf.bufferViews.push_back(view);
  tinygltf::Accessor accessor;
  accessor.bufferView = static_cast<int>(gltf.bufferViews.size()) - 1;
  accessor.componentType = component;
  accessor.type = type;
  accessor.count = count;
  gltf.accessors.push_back(accessor);
  return static_cast<int>(gltf.accessors.size()) - 1;
}

tinygltf::Primitive add_surface(tinygltf::Model& gltf, const SurfaceMesh& mesh) {
  tinygltf::Primitive primitive;
  primitive.mode = TINYGLTF_MODE_TRIANGLES;
  const Rows positions = to_gltf(mesh.V, 1e-3);
  primitive.attributes["POSITION"] = add_rows(gltf, positions);
  if (positions.rows() > 0) {
    tinygltf::Accessor& bounds = gltf.accessors.back();
    for (int k = 0; k < 3; ++k) {
      bounds.minValues.push_back(static_cast<double>(positions.col(k).minCoeff()));
      bounds.maxValues.push_back(static_cast<double>(positions.col(k).maxCoeff()));
    }
  }
  primitive.attributes["NORMAL"] = add_rows(gltf, to_gltf(vertex_normals(mesh), 1));
  primitive.indices =
      add_array(gltf, mesh.F.data(), sizeof(std::int32_t) * static_cast<std::size_t>(mesh.F.size()),
                static_cast<std::size_t>(mesh.F.size()), TINYGLTF_COMPONENT_TYPE_UNSIGNED_INT,
                TINYGLTF_TYPE_SCALAR, TINYGLTF_TARGET_ELEMENT_ARRAY_BUFFER);
  return primitive;
}

namespace {

// tinygltf does not look whether its file took what it wrote; a GLB says its own length.
bool is_whole(const std::filesystem::path& path) {
  std::array<char, 12> head{};
  if (!std::ifstream(path, std::ios::binary).read(head.data(), head.size())) return false;
  std::uint32_t length = 0;
  std::memcpy(&length, head.data() + 8, sizeof length);
  std::error_code error;
  return std::filesystem::file_size(path, error) == length;
}

}  // namespace

void write_file(tinygltf::Model& gltf, const std::filesystem::path& path) {
  tinygltf::TinyGLTF writer;
  if (!writer.WriteGltfSceneToFile(&gltf, path.string(), true, true, false, true) || !is_whole(path)) {
    throw Error(ErrorKind::io, path.string(), "glTF could not be written", "check the disk's free space");
  }
}

}  // namespace ecorche::io::gltf
