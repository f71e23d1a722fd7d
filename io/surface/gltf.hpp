// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string_view>

#include <ecorche/files/budget.hpp>
#include <ecorche/values/mesh.hpp>

namespace ecorche::io::gltf {

/// The triangles of the scene of a glTF 2.0, `.gltf` or `.glb`, in metres and glTF's frame: all primitives of
/// all meshes in the (default, else first, else every root's) scene, node transforms composed down the tree,
/// a mirrored node's triangles turned round; triangles, strips and fans, with or without indices, sparse and
/// quantized accessors. Buffers are in the file or, named plainly, beside it. Nodes with a skin are taken in
/// the rest pose of their joints. Compressed geometry and unknown required extensions are refused by name.
/// Throws Error{data}.
SurfaceMesh decode(std::string_view file, const std::filesystem::path& path,
                   const files::ReadLimits& limits = {});

}  // namespace ecorche::io::gltf
