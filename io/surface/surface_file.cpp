// SPDX-License-Identifier: Apache-2.0
#include "io/surface/surface_file.hpp"

#include "core/files/atomic_file.hpp"
#include "core/values/error.hpp"
#include "io/surface/glb.hpp"
#include "io/surface/stl.hpp"
#include "io/surface/vtk_files.hpp"

namespace ecorche::io {
namespace {

constexpr std::size_t kLargestFile = std::size_t{1} << 33;

std::string extension_of(const std::filesystem::path& path) {
  std::string extension = path.extension().string();
  for (char& c : extension) c = c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c;
  return extension;
}

}  // namespace

TaggedSurface read_tagged_surface(const std::filesystem::path& path) {
  const std::string extension = extension_of(path);
  if (extension != ".stl") {
    throw Error(ErrorKind::data, path.string(), "'" + extension + "' surfaces cannot be read",
                "convert it to .stl");
  }
  const std::string bytes = files::read_text(path, kLargestFile);
  return {stl::decode(bytes, path.string()), stl::space_tag(bytes)};
}

SurfaceMesh read_surface(const std::filesystem::path& path) {
  return read_tagged_surface(path).mesh;
}

void write_surface(const std::filesystem::path& path, const SurfaceMesh& mesh) {
  const std::string extension = extension_of(path);
  if (extension == ".stl") return files::write_text(path, stl::encode(mesh));
  const auto write = extension == ".ply"   ? vtk_files::write_ply
                     : extension == ".vtp" ? vtk_files::write_vtp
                     : extension == ".glb" ? write_glb
                                           : nullptr;
  if (write == nullptr) {
    throw Error(ErrorKind::usage, path.string(), "cannot write '" + extension + "' surfaces",
                "use .stl, .ply, .vtp or .glb");
  }
  files::AtomicFile file(path);
  write(file.temporary(), mesh);
  file.commit();
}

void write_tets(const std::filesystem::path& path, const PointsF& V, const Tets& T,
                const std::vector<GridArray>& point_data, const std::vector<GridArray>& cell_data) {
  if (extension_of(path) != ".vtu") {
    throw Error(ErrorKind::usage, path.string(), "cannot write tets as '" + extension_of(path) + "'",
                "use .vtu");
  }
  files::AtomicFile file(path);
  vtk_files::write_vtu(file.temporary(), V, T, point_data, cell_data);
  file.commit();
}

}  // namespace ecorche::io
