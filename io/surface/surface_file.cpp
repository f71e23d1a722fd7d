// SPDX-License-Identifier: Apache-2.0
#include "io/surface/surface_file.hpp"

#include "core/files/atomic_file.hpp"
#include "core/values/error.hpp"
#include "io/surface/stl.hpp"

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
  throw Error(ErrorKind::usage, path.string(), "cannot write '" + extension + "' surfaces",
              "use .stl, .ply, .vtp or .glb");
}

}  // namespace ecorche::io
