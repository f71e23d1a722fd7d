// SPDX-License-Identifier: Apache-2.0
#include <ecorche/runtime/pose_quality.hpp>

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <vector>

#include <ecorche/runtime/verdict.hpp>
#include "core/linear/decompositions.hpp"
#include "runtime/quality/floats.hpp"
#include "runtime/quality/tet_kinds.hpp"

namespace ecorche::runtime {
namespace {

using Eigen::Vector3d;

constexpr std::size_t kTetsPerBlock = 8192;

// Sums over a block of tets; blocks are added in order, so that threads change nothing.
struct TetSums {
  double rest = 0, posed = 0, changed = 0;  // determinants; of changes without their signs
  double inverted_rest = 0;
  std::uint64_t tets = 0, inverted = 0;
  double min_det_f = 1;
};

TetSums sum_block(const Model& model, std::span<const float> posed, std::span<const TetKind> kinds,
                  std::size_t begin, std::size_t end) {
  TetSums sums;
  for (std::size_t t = begin; t < end; ++t) {
    if (kinds[t] != TetKind::body) continue;
    ++sums.tets;
    const double before = det_of(model.tets, floats(model.nodes), t), after = det_of(model.tets, posed, t);
    sums.rest += before;
    sums.posed += after;
    sums.changed += std::abs(after - before);
    if (after <= 0) {
      ++sums.inverted;
      sums.inverted_rest += before;
    }
    sums.min_det_f = std::min(sums.min_det_f, after / before);
  }
  return sums;
}

TetSums sum_tets(const Model& model, std::span<const float> posed, std::span<const TetKind> kinds) {
  const std::size_t count = model.tet_count();
  std::vector<TetSums> blocks((count + kTetsPerBlock - 1) / kTetsPerBlock);
  tbb::parallel_for(std::size_t{0}, blocks.size(), [&](std::size_t b) {
    blocks[b] = sum_block(model, posed, kinds, b * kTetsPerBlock, std::min(count, (b + 1) * kTetsPerBlock));
  });
  TetSums all;
  for (const TetSums& block : blocks) {
    all.rest += block.rest;
    all.posed += block.posed;
    all.changed += block.changed;
    all.tets += block.tets;
    all.inverted += block.inverted;
    all.inverted_rest += block.inverted_rest;
    all.min_det_f = std::min(all.min_det_f, block.min_det_f);
  }
  return all;
}

JointGaps sum_gaps(const Model& model, std::span<const float> posed, std::span<const TetKind> kinds) {
  JointGaps out;
  for (std::size_t t = 0; t < kinds.size(); ++t) {
    if (kinds[t] != TetKind::gap) continue;
    const double rest_mm3 = det_of(model.tets, floats(model.nodes), t) / 6;
    ++out.tets;
    out.rest_mm3 += rest_mm3;
    if (det_of(model.tets, posed, t) > 0) continue;
    ++out.inverted_tets;
    out.inverted_rest_mm3 += rest_mm3;
  }
  return out;
}

Vector3d mean_of(std::span<const float> points) {
  Vector3d sum = Vector3d::Zero();
  const std::size_t count = points.size() / 3;
  for (std::size_t v = 0; v < count; ++v) sum += point(points, v);
  return sum / static_cast<double>(count);
}

}  // namespace

std::vector<float> tet_det_f(const Model& model, std::span<const float> nodes) {
  std::vector<float> out(model.tet_count());
  tbb::parallel_for(tbb::blocked_range<std::size_t>(0, out.size(), kTetsPerBlock), [&](const auto& range) {
    for (std::size_t t = range.begin(); t < range.end(); ++t) {
      out[t] = static_cast<float>(det_of(model.tets, nodes, t) / det_of(model.tets, floats(model.nodes), t));
    }
  });
  return out;
}

double enclosed_volume(std::span<const float> vertices, const Triangles& F) {
  if (F.rows() == 0) return 0;
  const Vector3d origin = point(vertices, 0);
  double sum = 0;
  for (Eigen::Index f = 0; f < F.rows(); ++f) {
    const auto corner = [&](int c) -> Vector3d {
      return point(vertices, static_cast<std::size_t>(F(f, c))) - origin;
    };
    sum += corner(0).cross(corner(1)).dot(corner(2));
  }
  return sum / 6;
}

namespace {

// The edges of one direction, by their lower vertex: the upper ones of each, ascending.
struct Edges {
  std::vector<std::uint32_t> begin;  // #vertices + 1
  std::vector<std::int32_t> upper;
};

// Of all edges whose corners go up, or go down. Counted, then put in place: sorting all of them takes five
// times as long, and models are looked at while somebody waits for them.
Edges edges_of(const Triangles& F, std::size_t vertices, bool up) {
  const auto each = [&](auto&& edge) {
    for (Eigen::Index f = 0; f < F.rows(); ++f) {
      if (F(f, 0) == F(f, 1) || F(f, 1) == F(f, 2) || F(f, 2) == F(f, 0)) continue;
      for (int c = 0; c < 3; ++c) {
        const std::int32_t a = F(f, c), b = F(f, (c + 1) % 3);
        if ((a < b) == up) edge(static_cast<std::size_t>(std::min(a, b)), std::max(a, b));
      }
    }
  };
  Edges out{std::vector<std::uint32_t>(vertices + 2, 0), {}};
  each([&](std::size_t lower, std::int32_t) { ++out.begin[lower + 2]; });
  std::partial_sum(out.begin.begin(), out.begin.end(), out.begin.begin());
  out.upper.resize(out.begin.back());
  each([&](std::size_t lower, std::int32_t upper) { out.upper[out.begin[lower + 1]++] = upper; });
  out.begin.pop_back();
  for (std::size_t v = 0; v < vertices; ++v)
    std::sort(out.upper.begin() + out.begin[v], out.upper.begin() + out.begin[v + 1]);
  return out;
}

}  // namespace

bool is_closed(const Triangles& F) {
  const auto vertices = static_cast<std::size_t>(F.size() > 0 ? F.maxCoeff() + 1 : 0);
  const Edges forward = edges_of(F, vertices, true), backward = edges_of(F, vertices, false);
  if (forward.upper.empty() || forward.begin != backward.begin || forward.upper != backward.upper)
    return false;
  for (std::size_t v = 0; v < vertices; ++v) {
    const auto first = forward.upper.begin() + forward.begin[v],
               last = forward.upper.begin() + forward.begin[v + 1];
    if (std::adjacent_find(first, last) != last) return false;
  }
  return true;
}

double rigid_residual(std::span<const float> rest, std::span<const float> posed) {
  if (rest.empty()) return 0;
  const Vector3d from = mean_of(rest), to = mean_of(posed);
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();
  for (std::size_t v = 0; v < rest.size() / 3; ++v) {
    covariance += (point(posed, v) - to) * (point(rest, v) - from).transpose();
  }
  const Eigen::Matrix3d turn = linear::nearest_turn(covariance);
  double worst = 0;
  for (std::size_t v = 0; v < rest.size() / 3; ++v) {
    worst = std::max(worst, (turn * (point(rest, v) - from) + to - point(posed, v)).norm());
  }
  return worst;
}

std::vector<std::uint8_t> closed_surfaces(const Model& model) {
  std::vector<std::uint8_t> out(model.tissues.size());
  tbb::parallel_for(std::size_t{0}, out.size(),
                    [&](std::size_t t) { out[t] = is_closed(model.tissues[t].F) ? 1 : 0; });
  return out;
}

PoseQuality measure(const Model& model, const PosedBody& body, std::span<const std::uint32_t> tissues,
                    const QualityThresholds& thresholds, std::span<const std::uint8_t> closed) {
  PoseQuality out;
  const std::vector<TetKind> kinds = tet_kinds(model);
  const TetSums sums = sum_tets(model, body.nodes, kinds);
  out.tets_measured = sums.tets;
  out.inverted_tets = sums.inverted;
  out.inverted_rest_mm3 = sums.inverted_rest / 6;
  out.min_det_f = sums.min_det_f;
  if (sums.rest > 0) {
    out.inverted_share = sums.inverted_rest / sums.rest;
    out.volume_change = sums.posed / sums.rest - 1;
    out.unsigned_volume_change = sums.changed / sums.rest;
  }
  std::vector<std::uint8_t> left_out(kinds.size());
  std::transform(kinds.begin(), kinds.end(), left_out.begin(),
                 [](TetKind kind) { return kind == TetKind::body ? 0 : 1; });
  out.places = worst_places(model, body.nodes, left_out);
  out.gaps = sum_gaps(model, body.nodes, kinds);

  out.tissues.resize(tissues.size());
  std::vector<double> residuals(tissues.size(), 0);
  tbb::parallel_for(std::size_t{0}, tissues.size(), [&](std::size_t i) {
    const Tissue& tissue = model.tissues[tissues[i]];
    const std::vector<float>& posed = body.tissues[tissues[i]];
    TissueChange& change = out.tissues[i];
    change.name = tissue.name;
    change.group = tissue.group;
    change.closed = closed.empty() ? is_closed(tissue.F) : closed[tissues[i]] != 0;
    if (change.closed) {
      change.rest_mm3 = enclosed_volume(floats(tissue.V), tissue.F);
      change.posed_mm3 = enclosed_volume(posed, tissue.F);
    }
    if (change.rest_mm3 != 0) change.share = (change.posed_mm3 - change.rest_mm3) / change.rest_mm3;
    if (tissue.segment != Tissue::by_tets) residuals[i] = rigid_residual(floats(tissue.V), posed);
  });
  for (const double residual : residuals) out.bone_rigidity_mm = std::max(out.bone_rigidity_mm, residual);

  out.clamped = body.clamped;
  out.doubtful = doubtful_joints(model.rig, body.pose, thresholds);
  judge(thresholds, out);
  return out;
}

}  // namespace ecorche::runtime
