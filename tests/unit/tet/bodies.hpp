// SPDX-License-Identifier: Apache-2.0
// Bodies known by formula, ready to be meshed.
#pragma once

#include <algorithm>
#include <cmath>
#include <span>
#include <string_view>
#include <utility>

#include "preprocess/tet/mesher.hpp"
#include "preprocess/voxel/voxelize.hpp"
#include "tests/unit/voxel/shapes.hpp"

namespace ecorche::tet {

/// A body with two bones and a plate, all apart from one another.
inline Case trunk() {
  return shapes::body(
      shapes::ellipsoid({0, 0, 0}, {30, 25, 45}, 16),
      {shapes::ellipsoid({5, 0, 20}, {10, 8, 10}, 10), shapes::ellipsoid({-5, 0, -15}, {6, 10, 15}, 10),
       shapes::ellipsoid({14, 0, -14}, {1, 8, 8}, 8)});
}

struct Prepared {
  Case patient;
  Image labels;
  Prepared(Case c, double voxel)
      : patient(std::move(c)), labels(voxel::voxelize(patient, {.voxel_mm = voxel}, {})) {}
  TetMesh mesh(std::string_view mesher, const Options& options = {}, const Context& context = {}) const {
    return make_mesher(mesher)->mesh({patient, labels}, options, context);
  }
};

inline double voxel_volume(const Image& labels, std::uint16_t label) {
  const std::span<const std::uint16_t> voxels = labels.scalars<std::uint16_t>();
  return static_cast<double>(std::count(voxels.begin(), voxels.end(), label)) *
         std::pow(labels.grid.spacing[0], 3);
}

}  // namespace ecorche::tet
