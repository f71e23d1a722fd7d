// SPDX-License-Identifier: Apache-2.0
#include <ecorche/runtime/quality_meter.hpp>

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>

#include <ecorche/runtime/verdict.hpp>
#include "runtime/quality/floats.hpp"
#include "runtime/quality/overlap_meter.hpp"
#include "runtime/quality/tet_kinds.hpp"

namespace ecorche::runtime {
namespace {

using Vec = std::array<float, 3>;

constexpr std::size_t kTetsPerSample = 1024;
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

// Which of `run` to take: the same for the same number, and spread evenly (a golden-ratio hash).
std::size_t drawn(std::size_t number, std::size_t run) {
  return static_cast<std::size_t>((number * 0x9e3779b97f4a7c15U >> 32) % run);
}

}  // namespace

struct QualityMeter::Sums {
  double rest = 0, posed = 0, changed = 0, inverted_rest = 0;
  double rest_rest = 0, rest_posed = 0, posed_posed = 0, inverted_squared = 0;
  std::uint64_t inverted = 0;
  double min_det_f = 1;

  void add(const Sums& other) {
    rest += other.rest;
    posed += other.posed;
    changed += other.changed;
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
  if (count > 0) tets_per_drawn_ = static_cast<double>(all) / static_cast<double>(count);
  const std::vector<TetKind> kinds = tet_kinds(*model_);
  for (std::size_t i = 0; i < count; ++i) {
    const std::size_t begin = all * i / count, end = all * (i + 1) / count;
    const auto t = static_cast<Eigen::Index>(begin + drawn(i, end - begin));
    if (kinds[static_cast<std::size_t>(t)] != TetKind::body) continue;
    corners_.push_back({});
    for (int c = 0; c < 4; ++c) {
      corners_.back()[static_cast<std::size_t>(c)] = static_cast<std::uint32_t>(model_->tets(t, c));
    }
    rest_.push_back(det_of(floats(model_->nodes), corners_.back()));
  }
  tbb::parallel_for(std::size_t{0}, parts_.size(),
                    [&](std::size_t t) { parts_[t] = look_at(model_->tissues[t]); });
  overlaps_ = std::make_unique<const OverlapMeter>(*model_);
}

QualityMeter::~QualityMeter() = default;

void QualityMeter::prepare(const PosedBody& body) const {
  overlaps_->deepest(body.segments);
}

void QualityMeter::prepare(std::size_t tissue) const {
  overlaps_->prepare(tissue);
}

QualityMeter::Part QualityMeter::look_at(const Tissue& tissue) {
  Part part;
  part.closed = is_closed(tissue.F);
  if (part.closed) part.rest_mm3 = enclosed_volume(floats(tissue.V), tissue.F);
  if (tissue.segment == Tissue::by_tets) {
    if (part.closed) part.coarse = coarsen(tissue.V, tissue.F, coarse_triangles);
    return part;
  }
  const auto vertices = static_cast<std::size_t>(tissue.V.rows());
  for (std::size_t i = 0; i < std::min(vertices, kBoneVertices); ++i) {
    const std::size_t v = vertices * i / std::min(vertices, kBoneVertices);
    part.sample.push_back(static_cast<std::uint32_t>(v));
    for (int c = 0; c < 3; ++c) part.sample_rest.push_back(tissue.V(static_cast<Eigen::Index>(v), c));
  }
  return part;
}

// What a pose did to one tissue.
struct QualityMeter::Change {
  double share = 0, error = 0, residual = 0;
};

QualityMeter::Change QualityMeter::change(const Part& part, std::span<const float> posed) {
  Change out;
  if (!part.sample.empty()) {
    std::array<float, 3 * kBoneVertices> at;
    for (std::size_t i = 0; i < part.sample.size(); ++i)
      std::copy_n(&posed[3 * std::size_t{part.sample[i]}], 3, &at[3 * i]);
    out.residual = rigid_residual(part.sample_rest, std::span(at).first(part.sample_rest.size()));
  }
  if (part.coarse.empty() || part.coarse[0].rest_6 == 0) return out;
  const auto share = [&](const CoarseSurface& surface) {
    return volume_6(surface, posed) / surface.rest_6 - 1;
  };
  out.share = share(part.coarse[0]);
  if (part.coarse.size() > 1) out.error = std::abs(out.share - share(part.coarse[1]));
  return out;
}

QualityMeter::Sums QualityMeter::sum(std::span<const float> nodes, std::size_t begin, std::size_t end) const {
  Sums sums;
  for (std::size_t i = begin; i < end; ++i) {
    const double before = static_cast<double>(rest_[i]);
    const double after = static_cast<double>(det_of(nodes, corners_[i]));
    sums.rest += before;
    sums.posed += after;
    sums.changed += std::abs(after - before);
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
  return measure_with(overlaps_->deepest(body.segments), body, tissues, thresholds);
}

PoseQuality QualityMeter::measure_now(const PosedBody& body, std::span<const std::uint32_t> tissues,
                                      const QualityThresholds& thresholds) const {
  return measure_with(overlaps_->deepest_if_prepared(body.segments), body, tissues, thresholds);
}

PoseQuality QualityMeter::measure_with(const std::optional<BoneOverlap>& overlap, const PosedBody& body,
                                       std::span<const std::uint32_t> tissues,
                                       const QualityThresholds& thresholds) const {
  std::vector<Sums> blocks((rest_.size() + kTetsPerSample - 1) / kTetsPerSample);
  std::vector<Change> changes(tissues.size());
  tbb::parallel_for(std::size_t{0}, blocks.size() + tissues.size(), [&](std::size_t b) {
    if (b < blocks.size()) {
      blocks[b] = sum(body.nodes, b * kTetsPerSample, std::min(rest_.size(), (b + 1) * kTetsPerSample));
    } else {
      const std::uint32_t row = tissues[b - blocks.size()];
      changes[b - blocks.size()] = change(parts_[row], body.tissues[row]);
    }
  });

  Sums all;
  for (const Sums& block : blocks) all.add(block);
  PoseQuality out;
  out.tets_measured = rest_.size();
  out.min_det_f = all.min_det_f;
  const auto measured = static_cast<double>(rest_.size());
  const double scale = tets_per_drawn_;
  out.inverted_tets = static_cast<std::uint64_t>(std::llround(static_cast<double>(all.inverted) * scale));
  out.inverted_rest_mm3 = all.inverted_rest / 6 * scale;
  if (all.rest > 0) {
    // Ratio estimates r = sum a / sum b; their standard error is sqrt(n / (n - 1) sum (a - r b)^2) / sum b.
    const double share = all.inverted_rest / all.rest, change = all.posed / all.rest;
    out.inverted_share = share;
    out.volume_change = change - 1;
    out.unsigned_volume_change = all.changed / all.rest;
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
  for (std::size_t i = 0; i < tissues.size(); ++i) {
    const Part& part = parts_[tissues[i]];
    const Tissue& tissue = model_->tissues[tissues[i]];
    out.tissues[i] = {.name = tissue.name,
                      .group = tissue.group,
                      .closed = part.closed,
                      .rest_mm3 = part.rest_mm3,
                      .posed_mm3 = part.rest_mm3 * (1 + changes[i].share),
                      .share = changes[i].share,
                      .share_error = changes[i].error};
    out.bone_rigidity_mm = std::max(out.bone_rigidity_mm, changes[i].residual);
  }
  out.overlap = overlap.value_or(BoneOverlap{});
  out.overlap_pending = !overlap;
  out.clamped = body.clamped;
  out.doubtful = doubtful_joints(model_->rig, body.pose, thresholds);
  judge(thresholds, out);
  return out;
}

}  // namespace ecorche::runtime
