// SPDX-License-Identifier: Apache-2.0
#include "runtime/quality/quality_meter.hpp"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>

namespace ecorche::runtime {
namespace {

using Vec = std::array<float, 3>;

constexpr std::size_t kTetsPerBlock = 1024;
constexpr Eigen::Index kTrianglesPerBlock = 4096;
constexpr std::size_t kBoneVertices = 64;

Vec edge(std::span<const float> points, std::size_t from, std::size_t to) {
  return {points[3 * to] - points[3 * from], points[3 * to + 1] - points[3 * from + 1],
          points[3 * to + 2] - points[3 * from + 2]};
}

float det(const Vec& a, const Vec& b, const Vec& c) {
  return (a[1] * b[2] - a[2] * b[1]) * c[0] + (a[2] * b[0] - a[0] * b[2]) * c[1] +
         (a[0] * b[1] - a[1] * b[0]) * c[2];
}

float det_of(std::span<const float> nodes, const std::array<std::uint32_t, 4>& t) {
  return det(edge(nodes, t[0], t[1]), edge(nodes, t[0], t[2]), edge(nodes, t[0], t[3]));
}

std::span<const float> floats(const PointsF& points) {
  return {points.data(), static_cast<std::size_t>(points.size())};
}

// Which of `run` to take: the same for the same number, and spread evenly (a golden-ratio hash).
std::size_t drawn(std::size_t number, std::size_t run) {
  return static_cast<std::size_t>((number * 0x9e3779b97f4a7c15U >> 32) % run);
}

// Six times the signed volume of the triangles [begin, end) about the first vertex.
double volume_6(std::span<const float> vertices, const Triangles& F, Eigen::Index begin, Eigen::Index end) {
  double sum = 0;
  for (Eigen::Index f = begin; f < end; ++f) {
    const auto corner = [&](int c) { return edge(vertices, 0, static_cast<std::size_t>(F(f, c))); };
    sum += static_cast<double>(det(corner(0), corner(1), corner(2)));
  }
  return sum;
}

struct TriangleBlock {
  std::size_t tissue;
  Eigen::Index begin;
  double volume;
};

}  // namespace

struct QualityMeter::Sums {
  double rest = 0, posed = 0, inverted_rest = 0;
  double rest_rest = 0, rest_posed = 0, posed_posed = 0, inverted_squared = 0;
  std::uint64_t inverted = 0;
  double min_det_f = 1;

  void add(const Sums& other) {
    rest += other.rest;
    posed += other.posed;
    inverted_rest += other.inverted_rest;
    rest_rest += other.rest_rest;
    rest_posed += other.rest_posed;
    posed_posed += other.posed_posed;
    inverted_squared += other.inverted_squared;
    inverted += other.inverted;
    min_det_f = std::min(min_det_f, other.min_det_f);
  }
};

QualityMeter::QualityMeter(std::shared_ptr<const Model> model, std::size_t most_tets)
    : model_(std::move(model)), parts_(model_->tissues.size()) {
  const std::size_t all = model_->tet_count(), count = std::min(all, most_tets);
  for (std::size_t i = 0; i < count; ++i) {
    const std::size_t begin = all * i / count, end = all * (i + 1) / count;
    const auto t = static_cast<Eigen::Index>(begin + drawn(i, end - begin));
    corners_.push_back({});
    for (int c = 0; c < 4; ++c) {
      corners_.back()[static_cast<std::size_t>(c)] = static_cast<std::uint32_t>(model_->tets(t, c));
    }
    rest_.push_back(det_of(floats(model_->nodes), corners_.back()));
  }
  for (std::size_t t = 0; t < parts_.size(); ++t) {
    const Tissue& tissue = model_->tissues[t];
    parts_[t].closed = is_closed(tissue.F);
    if (parts_[t].closed) parts_[t].rest_mm3 = enclosed_volume(floats(tissue.V), tissue.F);
    if (tissue.segment == Tissue::by_tets) continue;
    const auto vertices = static_cast<std::size_t>(tissue.V.rows());
    for (std::size_t i = 0; i < std::min(vertices, kBoneVertices); ++i) {
      const std::size_t v = vertices * i / std::min(vertices, kBoneVertices);
      parts_[t].sample.push_back(static_cast<std::uint32_t>(v));
      for (int c = 0; c < 3; ++c) {
        parts_[t].sample_rest.push_back(tissue.V(static_cast<Eigen::Index>(v), c));
      }
    }
  }
}

QualityMeter::Sums QualityMeter::sum(std::span<const float> nodes, std::size_t begin, std::size_t end) const {
  Sums sums;
  for (std::size_t i = begin; i < end; ++i) {
    const double before = static_cast<double>(rest_[i]);
    const double after = static_cast<double>(det_of(nodes, corners_[i]));
    sums.rest += before;
    sums.posed += after;
    sums.rest_rest += before * before;
    sums.rest_posed += before * after;
    sums.posed_posed += after * after;
    sums.min_det_f = std::min(sums.min_det_f, after / before);
    if (after > 0) continue;
    ++sums.inverted;
    sums.inverted_rest += before;
    sums.inverted_squared += before * before;
  }
  return sums;
}

PoseQuality QualityMeter::measure(const PosedBody& body, std::span<const std::uint32_t> tissues,
                                  const QualityThresholds& thresholds) const {
  std::vector<Sums> blocks((rest_.size() + kTetsPerBlock - 1) / kTetsPerBlock);
  std::vector<TriangleBlock> triangles;
  for (std::size_t i = 0; i < tissues.size(); ++i) {
    const Tissue& tissue = model_->tissues[tissues[i]];
    if (tissue.segment != Tissue::by_tets || !parts_[tissues[i]].closed) continue;
    for (Eigen::Index f = 0; f < tissue.F.rows(); f += kTrianglesPerBlock) triangles.push_back({i, f, 0});
  }
  tbb::parallel_for(std::size_t{0}, blocks.size() + triangles.size(), [&](std::size_t b) {
    if (b < blocks.size()) {
      blocks[b] = sum(body.nodes, b * kTetsPerBlock, std::min(rest_.size(), (b + 1) * kTetsPerBlock));
      return;
    }
    TriangleBlock& block = triangles[b - blocks.size()];
    const std::uint32_t row = tissues[block.tissue];
    const Triangles& F = model_->tissues[row].F;
    block.volume =
        volume_6(body.tissues[row], F, block.begin, std::min(F.rows(), block.begin + kTrianglesPerBlock));
  });

  Sums all;
  for (const Sums& block : blocks) all.add(block);
  PoseQuality out;
  out.tets_measured = rest_.size();
  out.min_det_f = all.min_det_f;
  const auto measured = static_cast<double>(rest_.size());
  const double scale = static_cast<double>(model_->tet_count()) / std::max(1.0, measured);
  out.inverted_tets = static_cast<std::uint64_t>(std::llround(static_cast<double>(all.inverted) * scale));
  out.inverted_rest_mm3 = all.inverted_rest / 6 * scale;
  if (all.rest > 0) {
    // Ratio estimates r = sum a / sum b; their standard error is sqrt(n / (n - 1) sum (a - r b)^2) / sum b.
    const double share = all.inverted_rest / all.rest, change = all.posed / all.rest;
    out.inverted_share = share;
    out.volume_change = change - 1;
    if (scale > 1 && measured > 1) {
      const auto error = [&](double aa, double ab, double r) {
        const double squares = std::max(0.0, aa - 2 * r * ab + r * r * all.rest_rest);
        return std::sqrt(squares * measured / (measured - 1)) / all.rest;
      };
      out.inverted_share_error = error(all.inverted_squared, all.inverted_squared, share);
      out.volume_change_error = error(all.posed_posed, all.rest_posed, change);
    }
  }

  out.tissues.resize(tissues.size());
  std::vector<float> posed;
  for (std::size_t i = 0; i < tissues.size(); ++i) {
    const Tissue& tissue = model_->tissues[tissues[i]];
    const Part& part = parts_[tissues[i]];
    TissueChange& change = out.tissues[i];
    change.name = tissue.name;
    change.closed = part.closed;
    change.rest_mm3 = change.posed_mm3 = part.rest_mm3;
    if (tissue.segment == Tissue::by_tets) {
      change.posed_mm3 = 0;
      continue;
    }
    posed.clear();
    for (const std::uint32_t v : part.sample) {
      const float* x = &body.tissues[tissues[i]][3 * std::size_t{v}];
      posed.insert(posed.end(), x, x + 3);
    }
    out.bone_rigidity_mm = std::max(out.bone_rigidity_mm, rigid_residual(part.sample_rest, posed));
  }
  for (const TriangleBlock& block : triangles) out.tissues[block.tissue].posed_mm3 += block.volume / 6;
  for (TissueChange& change : out.tissues) {
    if (change.rest_mm3 != 0) change.share = (change.posed_mm3 - change.rest_mm3) / change.rest_mm3;
  }
  out.clamped = body.clamped;
  judge(thresholds, out);
  return out;
}

}  // namespace ecorche::runtime
