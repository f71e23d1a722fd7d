// SPDX-License-Identifier: Apache-2.0
#include "io/surface/surface_file.hpp"

#include <algorithm>
#include <array>

#include <ecorche/values/error.hpp>
#include "core/files/atomic_file.hpp"
#include "core/values/text.hpp"
#include "io/surface/glb.hpp"
#include "io/surface/gltf.hpp"
#include "io/surface/obj.hpp"
#include "io/surface/off.hpp"
#include "io/surface/ply.hpp"
#include "io/surface/stl.hpp"
#include "io/surface/tet_formats.hpp"
#include "io/surface/vtk_files.hpp"
#include "io/surface/vtk_legacy.hpp"
#include "io/surface/vtp.hpp"
#include "io/surface/vtu.hpp"

namespace ecorche::io {
namespace {

constexpr std::size_t kLargestFile = std::size_t{1} << 33;

void check_corners(const SurfaceMesh& mesh) {
  for (Eigen::Index i = 0; i < mesh.F.size(); ++i) {
    const std::int32_t v = mesh.F.data()[i];
    if (v >= 0 && v < mesh.V.rows()) continue;
    throw Error(ErrorKind::internal, "mesh",
                "triangle " + std::to_string(i / 3) + " uses vertex " + std::to_string(v), "report this");
  }
}

}  // namespace

TaggedSurface read_tagged_surface(const std::filesystem::path& path, const files::ReadLimits& limits) {
  const std::string extension = text::lower(path.extension().string()), where = path.string();
  constexpr std::array<std::string_view, 8> known{".stl", ".obj", ".ply",  ".off",
                                                  ".vtp", ".vtk", ".gltf", ".glb"};
  if (std::find(known.begin(), known.end(), extension) == known.end()) {
    throw Error(ErrorKind::data, where, "'" + extension + "' surfaces cannot be read",
                "convert it to .stl, .obj, .ply, .off, .vtp, .vtk, .gltf or .glb");
  }
  const std::string file = files::read_text(path, kLargestFile);
  std::string_view bytes = file;
  if (bytes.starts_with("\xef\xbb\xbf")) bytes.remove_prefix(3);  // what some editors put before a text
  if (extension == ".stl") return {stl::decode(bytes, where, limits), stl::space_tag(bytes), {}};
  if (extension == ".obj") return {obj::decode(bytes, where, limits), obj::space_tag(bytes), {}};
  if (extension == ".ply") return {ply::decode(bytes, where, limits), ply::space_tag(bytes), {}};
  if (extension == ".off") return {off::decode(bytes, where, limits), off::space_tag(bytes), {}};
  if (extension == ".vtk")
    return {vtk_legacy::decode(bytes, where, limits), vtk_legacy::space_tag(bytes), {}};
  if (extension == ".vtp") {
    vtp::Decoded decoded = vtp::decode(bytes, where, limits);
    return {std::move(decoded.mesh), std::move(decoded.space), {}};
  }
  return {gltf::decode(bytes, path, limits), "LSA", 1000};
}

SurfaceMesh read_surface(const std::filesystem::path& path, const files::ReadLimits& limits) {
  return read_tagged_surface(path, limits).mesh;
}

bool writes_surface(const std::filesystem::path& path) {
  static constexpr std::array<std::string_view, 6> kFormats{".stl", ".obj", ".ply", ".off", ".vtp", ".glb"};
  const std::string extension = text::lower(path.extension().string());
  return std::find(kFormats.begin(), kFormats.end(), extension) != kFormats.end();
}

void write_surface(const std::filesystem::path& path, const SurfaceMesh& mesh,
                   const std::vector<GridArray>& point_data) {
  const std::string extension = text::lower(path.extension().string());
  if (extension == ".stl") return files::write_text(path, stl::encode(mesh));
  if (extension == ".obj" || extension == ".off") {
    check_corners(mesh);
    return files::write_text(path, extension == ".obj" ? obj::encode(mesh) : off::encode(mesh));
  }
  if (extension == ".glb") {
    const NamedSurface named{path.stem().string(), Group::other, mesh};
    return write_surfaces(path, {&named, 1});
  }
  if (!writes_surface(path)) {
    throw Error(ErrorKind::usage, path.string(), "cannot write '" + extension + "' surfaces",
                "use .stl, .obj, .ply, .off, .vtp or .glb");
  }
  files::AtomicFile file(path);
  if (extension == ".ply") vtk_files::write_ply(file.temporary(), mesh);
  if (extension == ".vtp") vtk_files::write_vtp(file.temporary(), mesh, point_data);
  file.commit();
}

void write_surfaces(const std::filesystem::path& path, std::span<const NamedSurface> surfaces) {
  if (text::lower(path.extension().string()) != ".glb") {
    throw Error(ErrorKind::usage, path.string(),
                "'" + text::lower(path.extension().string()) + "' does not hold several surfaces",
                "use .glb");
  }
  files::AtomicFile file(path);
  write_glb(file.temporary(), surfaces);
  file.commit();
}

TetFile read_tets(const std::filesystem::path& path, const files::ReadLimits& limits) {
  if (text::lower(path.extension().string()) != ".vtu")
    throw Error(ErrorKind::data, path.string(),
                "'" + text::lower(path.extension().string()) + "' tets cannot be read", "give a .vtu");
  return vtu::decode(files::read_text(path, kLargestFile), path.string(), limits);
}

void write_tets(const std::filesystem::path& path, const PointsF& V, const Tets& T,
                const std::vector<GridArray>& point_data, const std::vector<GridArray>& cell_data,
                const TetRegions& regions) {
  const std::string extension = text::lower(path.extension().string());
  if (extension == ".vtu") {
    files::AtomicFile file(path);
    vtk_files::write_vtu(file.temporary(), V, T, point_data, cell_data);
    return file.commit();
  }
  if (extension != ".msh" && extension != ".ele" && extension != ".inp") {
    throw Error(ErrorKind::usage, path.string(), "cannot write tets as '" + extension + "'",
                "use .vtu, .msh, .ele, .inp or .mcnp.inp; a rig goes into .glb or .bvh");
  }
  tet_formats::check_tets(V, T, regions);
  if (extension == ".msh") return files::write_text(path, tet_formats::encode_msh(V, T, regions));
  if (extension == ".ele") {
    // Neither means anything without the other.
    std::filesystem::path beside = path;
    files::AtomicFile nodes(beside.replace_extension(".node")), tets(path);
    files::write_text(nodes, tet_formats::encode_node(V));
    files::write_text(tets, tet_formats::encode_ele(T, regions));
    const std::array both{&nodes, &tets};
    return files::commit_together(both);
  }
  const bool mcnp = text::lower(path.stem().extension().string()) == ".mcnp";
  if (mcnp) tet_formats::refuse_degenerate(V, T, path.string());
  files::write_text(
      path, mcnp ? tet_formats::encode_mcnp(V, T, regions) : tet_formats::encode_abaqus(V, T, regions));
}

}  // namespace ecorche::io
