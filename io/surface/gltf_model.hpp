// SPDX-License-Identifier: Apache-2.0
// A glTF 2.0 as tinygltf parses it, guarded; and where its nodes stand.
#pragma once

#include <tiny_gltf.h>

#include <Eigen/Geometry>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include <ecorche/files/budget.hpp>

namespace ecorche::io::gltf {

/// The parsed file, buffers loaded: in it or, named plainly, beside it; no pictures. Throws Error{data}: no
/// glTF 2.0, JSON nested more than 64 deep, a required extension that changes geometry, more values than
/// `budget` pays for. Files beside it add to the budget.
tinygltf::Model parse(std::string_view file, const std::filesystem::path& path, files::Budget& budget);

/// A node's own transform. Throws Error{data} where it is damaged or not affine.
Eigen::Affine3d local_transform(const tinygltf::Node& node, const std::string& where);

struct PlacedNode {
  std::size_t number;      ///< in the model
  int parent;              ///< row in the list, -1 for a root
  Eigen::Affine3d global;  ///< in the file's frame and unit, at rest
};

/// The nodes of the (default, else first, else every root's) scene, parents first, depth first. Throws
/// Error{data} for nodes that are no tree.
std::vector<PlacedNode> place_nodes(const tinygltf::Model& model, const std::string& where);

}  // namespace ecorche::io::gltf
