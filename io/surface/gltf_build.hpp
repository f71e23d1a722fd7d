// SPDX-License-Identifier: Apache-2.0
// The parts that every glTF of ours is made of: arrays in one buffer, positions, normals, indices.
#pragma once

#include <tiny_gltf.h>

#include <filesystem>

#include <ecorche/values/mesh.hpp>

namespace ecorche::io::gltf {

using Rows = PointsF;

/// LPS to glTF's left, superior, anterior, times `scale` (1e-3: mm to metres).
Rows to_gltf(const Points& V, double scale);

/// An empty glTF 2.0 with one buffer.
tinygltf::Model new_model();

/// Appends an array to the one buffer, with its view and accessor; returns the accessor's number. `target` 0:
/// none.
int add_array(tinygltf::Model& gltf, const void* data, std::size_t bytes, std::size_t count, int component,
              int type, int target);

/// Positions (with their bounds), area-weighted normals and 32-bit indices of a surface, LPS mm. Throws
/// Error{internal} for a triangle of vertices that are not there.
tinygltf::Primitive add_surface(tinygltf::Model& gltf, const SurfaceMesh& mesh);

/// Writes a `.glb`. Throws Error{io}.
void write_file(tinygltf::Model& gltf, const std::filesystem::path& path);

}  // namespace ecorche::io::gltf
