// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>

#include "core/values/mesh.hpp"

namespace ecorche::io {

/// A binary glTF 2.0 of one mesh: positions, area-weighted normals, 32-bit indices; metres, glTF's frame (x
/// left, y superior, z anterior). Throws Error{io}.
void write_glb(const std::filesystem::path& path, const SurfaceMesh& mesh);

}  // namespace ecorche::io
