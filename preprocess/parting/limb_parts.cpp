// SPDX-License-Identifier: Apache-2.0
#include "preprocess/parting/limb_parts.hpp"

#include <tbb/parallel_for.h>

#include <Eigen/Geometry>
#include <algorithm>

#include "preprocess/parting/minimum_cut.hpp"

namespace ecorche::parting {
namespace {

using Eigen::Vector3d;

constexpr float kLimb = 0.92F, kRest = 0.08F;
constexpr double kBridge = 0.02;  // of a face in the air: of two ways through it the shorter

enum class Lean : std::int8_t { rest, open, limb };

class OneLimb {
 public:
  OneLimb(const Flesh& flesh, int top) : flesh_(flesh), top_(top), share_(tets()) {
    std::vector<float> node(static_cast<std::size_t>(flesh.mesh.V.rows()), 0);
    const Weights& w = flesh.weights;
    tbb::parallel_for(std::size_t{0}, node.size(), [&](std::size_t n) {
      for (std::uint64_t i = w.offsets[n]; i < w.offsets[n + 1]; ++i)
        if (is_own(static_cast<std::size_t>(w.segment[i]))) node[n] += w.weight[i];
    });
    tbb::parallel_for(std::size_t{0}, share_.size(), [&](std::size_t t) {
      for (int c = 0; c < 4; ++c)
        share_[t] += 0.25F * node[static_cast<std::size_t>(flesh.mesh.T(static_cast<Eigen::Index>(t), c))];
    });
  }

  float share(std::size_t tet) const { return share_[tet]; }

  std::vector<std::uint8_t> tets_of(const SolidFaces& solid) const {
    std::vector<std::uint8_t> own(share_.size());
    std::vector<std::int32_t> open;                       // tets between both
    std::vector<std::int32_t> vertex(share_.size(), -1);  // of open tets
    for (std::size_t t = 0; t < share_.size(); ++t) {
      own[t] = lean(t) == Lean::limb;
      if (lean(t) != Lean::open) continue;
      vertex[t] = static_cast<std::int32_t>(open.size());
      open.push_back(static_cast<std::int32_t>(t));
    }
    std::vector<std::array<double, 4>> cost(open.size());
    tbb::parallel_for(std::size_t{0}, open.size(), [&](std::size_t v) {
      for (int c = 0; c < 4; ++c) cost[v][static_cast<std::size_t>(c)] = price({open[v], c}, solid);
    });
    CutGraph graph(static_cast<std::int32_t>(open.size()));
    for (std::size_t v = 0; v < open.size(); ++v) {
      const auto here = static_cast<std::int32_t>(v);
      for (int c = 0; c < 4; ++c) {
        const std::int32_t next = flesh_.across.behind({open[v], c});
        if (next < 0) continue;
        const double price = cost[v][static_cast<std::size_t>(c)];
        const std::int32_t there = vertex[static_cast<std::size_t>(next)];
        if (there > here) graph.tie(here, there, price);
        if (there >= 0) continue;
        if (own[static_cast<std::size_t>(next)] != 0)
          graph.hold_inside(here, price);
        else
          graph.hold_outside(here, price);
      }
    }
    const std::vector<std::uint8_t> inside = graph.inside();
    for (std::size_t v = 0; v < open.size(); ++v) own[static_cast<std::size_t>(open[v])] = inside[v];
    return own;
  }

 private:
  std::size_t tets() const { return static_cast<std::size_t>(flesh_.mesh.T.rows()); }
  bool is_own(std::size_t segment) const { return flesh_.limb[segment] == top_; }

  Lean lean(std::size_t tet) const {
    const std::uint16_t label = flesh_.mesh.label[tet];
    if (label != TetMesh::soft)
      return is_own(static_cast<std::size_t>(flesh_.bone_segment[label - 1U])) ? Lean::limb : Lean::rest;
    return share_[tet] > kLimb ? Lean::limb : share_[tet] < kRest ? Lean::rest : Lean::open;
  }

  double price(const Face& face, const SolidFaces& solid) const {
    const std::array<Vector3d, 3> p = corners_of(flesh_.mesh, face);
    const double area = 0.5 * (p[1] - p[0]).cross(p[2] - p[0]).norm();
    return area * (kBridge + (1 - kBridge) * solid.price(p));
  }

  const Flesh& flesh_;
  int top_;
  std::vector<float> share_;  // of each tet
};

}  // namespace

std::vector<std::int16_t> limb_parts(const Flesh& flesh, const SolidFaces& solid, const Context& context) {
  // Of each tet the two limbs with the largest shares, and what no limb has.
  struct Claim {
    float most = 0, second = 0, rest = 1;
    std::int16_t limb = -1;
  };
  const auto tets = static_cast<std::size_t>(flesh.mesh.T.rows());
  std::vector<std::int16_t> part(tets, -1);
  std::vector<float> claimed(tets, 0);
  std::vector<Claim> claims(tets);
  for (int top = 0; top < static_cast<int>(flesh.limb.size()); ++top) {
    if (flesh.limb[static_cast<std::size_t>(top)] != top) continue;
    context.check_stop();
    const OneLimb limb(flesh, top);
    const std::vector<std::uint8_t> own = limb.tets_of(solid);
    for (std::size_t t = 0; t < tets; ++t) {
      const float share = limb.share(t);
      Claim& claim = claims[t];
      claim.rest -= share;
      claim.second = std::max(claim.second, std::min(claim.most, share));
      if (share > claim.most) {
        claim.most = share;
        claim.limb = static_cast<std::int16_t>(top);
      }
      if (own[t] == 0 || share <= claimed[t]) continue;
      claimed[t] = share;
      part[t] = static_cast<std::int16_t>(top);
    }
  }
  for (std::size_t t = 0; t < tets; ++t) {
    if (part[t] < 0 && flesh.mesh.label[t] == TetMesh::soft && claims[t].second > claims[t].rest)
      part[t] = claims[t].limb;
  }
  return part;
}

}  // namespace ecorche::parting
