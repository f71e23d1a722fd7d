// SPDX-License-Identifier: Apache-2.0
#include "preprocess/parting/limb_parts.hpp"

#include <tbb/parallel_for.h>
#include <tbb/parallel_pipeline.h>
#include <tbb/task_arena.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <memory>
#include <utility>

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

  int top() const { return top_; }
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

// What limbs claim of each tet, one limb after the other.
class Claims {
 public:
  explicit Claims(std::size_t tets) : claims_(tets), part_(tets, -1) {}

  void take(const OneLimb& limb, const std::vector<std::uint8_t>& own) {
    tbb::parallel_for(std::size_t{0}, claims_.size(), [&](std::size_t t) {
      const float share = limb.share(t);
      Claim& claim = claims_[t];
      claim.rest -= share;
      claim.second = std::max(claim.second, std::min(claim.most, share));
      if (share > claim.most) {
        claim.most = share;
        claim.limb = static_cast<std::int16_t>(limb.top());
      }
      if (own[t] == 0 || share <= claim.owned) return;
      claim.owned = share;
      part_[t] = static_cast<std::int16_t>(limb.top());
    });
  }

  std::vector<std::int16_t> parts(const std::vector<std::uint16_t>& label) && {
    tbb::parallel_for(std::size_t{0}, claims_.size(), [&](std::size_t t) {
      if (part_[t] < 0 && label[t] == TetMesh::soft && claims_[t].second > claims_[t].rest)
        part_[t] = claims_[t].limb;
    });
    return std::move(part_);
  }

 private:
  struct Claim {
    float most = 0, second = 0;  // of the two limbs with the largest shares
    float rest = 1;              // what no limb has
    float owned = 0;             // the share of the limb that has it
    std::int16_t limb = -1;      // with the largest share
  };
  std::vector<Claim> claims_;
  std::vector<std::int16_t> part_;
};

}  // namespace

std::vector<std::int16_t> limb_parts(const Flesh& flesh, const SolidFaces& solid, const Context& context) {
  std::vector<int> tops;
  for (std::size_t s = 0; s < flesh.limb.size(); ++s) {
    if (flesh.limb[s] == static_cast<int>(s)) tops.push_back(flesh.limb[s]);
  }
  struct Cut {
    OneLimb limb;
    std::vector<std::uint8_t> own;
  };
  Claims claims(static_cast<std::size_t>(flesh.mesh.T.rows()));
  // Limbs are cut side by side, since a cut takes one thread, and claim in turn: sums do not depend on who is
  // first.
  std::size_t next = 0;
  const auto limb =
      tbb::make_filter<void, int>(tbb::filter_mode::serial_in_order, [&](tbb::flow_control& flow) {
        if (next == tops.size()) {
          flow.stop();
          return -1;
        }
        return tops[next++];
      });
  const auto cut = tbb::make_filter<int, std::shared_ptr<Cut>>(tbb::filter_mode::parallel, [&](int top) {
    context.check_stop();
    auto out = std::make_shared<Cut>(Cut{OneLimb(flesh, top), {}});
    out->own = out->limb.tets_of(solid);
    return out;
  });
  const auto claim = tbb::make_filter<std::shared_ptr<Cut>, void>(
      tbb::filter_mode::serial_in_order,
      [&](const std::shared_ptr<Cut>& of) { claims.take(of->limb, of->own); });
  tbb::parallel_pipeline(static_cast<std::size_t>(tbb::this_task_arena::max_concurrency()),
                         limb & cut & claim);
  return std::move(claims).parts(flesh.mesh.label);
}

}  // namespace ecorche::parting
