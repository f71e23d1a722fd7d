// SPDX-License-Identifier: Apache-2.0
// The quality of a pose in a fraction of a frame: on a stated subset of tets, with its error.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include <ecorche/runtime/coarse_surface.hpp>
#include <ecorche/runtime/pose_quality.hpp>

namespace ecorche::runtime {

class OverlapMeter;

/// Made once per model; shared and immutable, as BodyPoser is.
class QualityMeter {
 public:
  /// Default subset: at a share of 1e-3 of inverted tets, the threshold, the standard error is 3.5e-4.
  static constexpr std::size_t default_tets = 8192;
  /// About so many of a tissue: see coarsen.
  static constexpr std::size_t coarse_triangles = 256;

  /// Looks at `most_tets` tets, one drawn from each of as many equal runs of the model's order (Morton: so
  /// everywhere in the body), the same ones in every pose; at all where there are no more.
  explicit QualityMeter(std::shared_ptr<const Model> model, std::size_t most_tets = default_tets);
  ~QualityMeter();

  /// As runtime::measure, which is its slow twin, but for what follows. Tets: shares, volume change and the
  /// count of inverted ones are estimates from the subset, their standard errors are in
  /// `inverted_share_error` and `volume_change_error`; the smallest det F is that of the subset, so no less
  /// than the true one. Tissues that follow the tets: a coarse surface on some of their vertices, whose
  /// difference from a coarser one is `share_error`; small surfaces whole, exact to 1e-5 of their volume.
  /// Which place is worst is not looked for. Bones: their rigidity is that of up to 64 vertices each, their
  /// volume is the rest's, and how deep they run into each other is looked for near joints, and where they
  /// nearly touch in the scan (OverlapMeter). Same figures for any thread count.
  PoseQuality measure(const PosedBody& body, std::span<const std::uint32_t> tissues,
                      const QualityThresholds& thresholds = {}) const;
  /// The same at once: where `prepare` has not worked out what the pose asks for, nobody has looked how deep
  /// bones run into each other, and `overlap_pending` says so.
  PoseQuality measure_now(const PosedBody& body, std::span<const std::uint32_t> tissues,
                          const QualityThresholds& thresholds = {}) const;

  /// What `measure` works out first, once, of bones that never moved against each other before: up to a
  /// second for a whole body.
  void prepare(const PosedBody& body) const;
  /// The same of one tissue, a row of Model::tissues, whatever moves against it.
  void prepare(std::size_t tissue) const;

  /// How many are measured.
  std::size_t tets() const { return rest_.size(); }

 private:
  struct Part {
    bool closed = false;
    double rest_mm3 = 0;
    std::vector<CoarseSurface> coarse;  // of a closed tissue that follows the tets
    std::vector<std::uint32_t> sample;  // of a bone's vertices
    std::vector<float> sample_rest;
  };
  struct Sums;
  struct Change;

  // `overlap`: nothing where it is pending.
  PoseQuality measure_with(const std::optional<BoneOverlap>& overlap, const PosedBody& body,
                           std::span<const std::uint32_t> tissues, const QualityThresholds& thresholds) const;
  static Part look_at(const Tissue& tissue);
  static Change change(const Part& part, std::span<const float> posed);
  Sums sum(std::span<const float> nodes, std::size_t begin, std::size_t end) const;

  std::shared_ptr<const Model> model_;
  std::vector<std::array<std::uint32_t, 4>> corners_;  // of the subset
  std::vector<float> rest_;                            // their determinants
  double tets_per_drawn_ = 1;
  std::vector<Part> parts_;
  std::unique_ptr<const OverlapMeter> overlaps_;
};

}  // namespace ecorche::runtime
