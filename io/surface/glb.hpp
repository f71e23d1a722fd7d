// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <span>

#include "io/surface/surface_file.hpp"

namespace ecorche::io {

/// A binary glTF 2.0 with a node, a mesh and a material (tissue_material.hpp) for each surface: positions,
/// area-weighted normals, 32-bit indices; metres, glTF's frame (x left, y superior, z anterior). Surfaces
/// without triangles are left out. Throws Error{io}.
void write_glb(const std::filesystem::path& path, std::span<const NamedSurface> surfaces);

}  // namespace ecorche::io
