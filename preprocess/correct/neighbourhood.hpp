// SPDX-License-Identifier: Apache-2.0
// The flesh that a joint deforms, cut out of the body.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include <ecorche/values/model.hpp>
#include <ecorche/values/transform.hpp>
#include "core/elastic/flesh.hpp"
#include "preprocess/fem/mesh.hpp"

namespace ecorche::correct {

struct Neighbourhood {
  std::vector<std::uint32_t> node;  ///< rows of the model's nodes that its tets have, ascending
  fem::Mesh mesh;                   ///< linear tets over these; held are bones, and the border of the part
};

/// The soft tets about nodes that do not move rigidly with one half of the body in some of `poses` (motions
/// of all segments): nodes whose weights divide, beyond `least_share`, between segments that move
/// differently. These are free; the other corners of their tets are the border, where skinning is as good as
/// rigid. Left out are tets that `flesh` (elastic::flesh_of the model) leaves out, and those whose part hangs
/// on fewer than three held nodes, which nothing places. May be empty.
Neighbourhood neighbourhood(const Model& model, const elastic::Flesh& flesh,
                            std::span<const std::vector<RigidTransform>> poses, double least_share);

}  // namespace ecorche::correct
