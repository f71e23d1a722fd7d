// SPDX-License-Identifier: Apache-2.0
#include "app/inverted_tets.hpp"

#include <algorithm>

#include "runtime/quality/tet_kinds.hpp"

namespace ecorche::app {
namespace {

std::size_t nearest_joint(const Skeleton& skeleton, const Eigen::Vector3d& p) {
  std::size_t nearest = 0;
  for (std::size_t s = 1; s < skeleton.segments.size(); ++s) {
    if ((skeleton.segments[s].joint.center - p).squaredNorm() <
        (skeleton.segments[nearest].joint.center - p).squaredNorm())
      nearest = s;
  }
  return nearest;
}

std::vector<std::uint8_t> tets_of_tissues(const Model& model) {
  std::vector<std::uint8_t> held(model.tet_count(), 0);
  for (const Tissue& tissue : model.tissues) {
    if (tissue.group == Group::skin) continue;
    for (const std::int32_t t : tissue.tet) held[static_cast<std::size_t>(t)] = 1;
  }
  return held;
}

}  // namespace

InvertedTets inverted_tets(const Model& model, std::span<const float> det_f) {
  const std::vector<std::uint8_t> held = tets_of_tissues(model);
  const std::vector<runtime::TetKind> kinds = runtime::tet_kinds(model);
  const auto& segments = model.rig.skeleton.segments;
  std::vector<InvertedNear> near(segments.size());
  InvertedTets out;
  for (std::size_t t = 0; t < det_f.size(); ++t) {
    if (det_f[t] > 0 || kinds[t] != runtime::TetKind::body) continue;
    out.in_tissues += held[t];
    const auto corner = [&](Eigen::Index k) -> Eigen::RowVector3d {
      return model.nodes.row(model.tets(static_cast<Eigen::Index>(t), k)).cast<double>();
    };
    const Eigen::RowVector3d a = corner(0), b = corner(1), c = corner(2), d = corner(3);
    InvertedNear& here = near[nearest_joint(model.rig.skeleton, 0.25 * (a + b + c + d).transpose())];
    ++here.tets;
    here.rest_mm3 += tet_det(a, b, c, d) / 6;
  }
  for (std::size_t s = 0; s < near.size(); ++s) {
    if (near[s].tets == 0) continue;
    near[s].joint = segments[s].joint.name;
    out.near.push_back(std::move(near[s]));
  }
  std::stable_sort(out.near.begin(), out.near.end(),
                   [](const InvertedNear& x, const InvertedNear& y) { return x.rest_mm3 > y.rest_mm3; });
  return out;
}

}  // namespace ecorche::app
