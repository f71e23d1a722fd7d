// SPDX-License-Identifier: Apache-2.0
// How far a posed body can be believed.
#pragma once

#include <cstdint>
#include <numbers>
#include <span>
#include <string>
#include <vector>

#include <ecorche/runtime/body_poser.hpp>
#include <ecorche/runtime/worst_place.hpp>
#include <ecorche/values/model.hpp>

namespace ecorche::runtime {

/// Thresholds of the verdict; printed with it. What each rests on: docs/reference/quality.md.
struct QualityThresholds {
  double max_inverted_share = 1e-3;  ///< rest volume of inverted tets over that of the body
  double max_volume_change = 0.10;   ///< of the whole body, unsigned
  double max_bone_rigidity_mm = 1e-3;
  double max_bone_overlap_mm = 5;    ///< deeper than at rest, of bones that joints turn into each other
  double tissue_factor = 1;          ///< times tissue_limit of a tissue's group
  double max_place_inverted = 0.05;  ///< of the worst place's volume
  double max_place_change = 0.5;     ///< likewise, unsigned
  double min_confidence = 0.5;       ///< of a joint: one found worse may not turn by more than
  double max_doubtful_turn = 5 * std::numbers::pi / 180;  ///< this, radians
};

/// How a pose changes a tissue's volume.
struct TissueChange {
  std::string name;
  Group group = Group::other;
  bool closed = true;  ///< an open surface encloses nothing: then the figures below mean nothing and are 0
  double rest_mm3 = 0, posed_mm3 = 0;
  double share = 0;        ///< (posed - rest) / rest; enclosed volumes of the surfaces
  double share_error = 0;  ///< of an estimate; 0 where the whole surface was measured
  double max_share = 0;    ///< what `share` is judged by, either way
};

/// A joint that was found badly and is turned all the same.
struct DoubtfulJoint {
  int joint = 0;
  double turned = 0;  ///< radians, from the scanned pose
  double confidence = 0;
};

/// The tets between bones that move against each other (elastic::joint_gaps).
struct JointGaps {
  std::uint64_t tets = 0, inverted_tets = 0;
  double rest_mm3 = 0, inverted_rest_mm3 = 0;
};

/// The bone that a pose drives deepest into a bone of another segment.
struct BoneOverlap {
  std::size_t bone = 0, into = 0;                ///< rows of Model::tissues
  double mm = 0;                                 ///< how much deeper than at rest; 0: none is
  Eigen::Vector3d at = Eigen::Vector3d::Zero();  ///< its deepest vertex, scanned, LPS mm
};

/// What was measured of a pose. Tets at the skin's caps (skin_caps.hpp), and those in the gaps of joints,
/// which are no flesh, count for no figure of the tets but for `gaps`.
struct PoseQuality {
  std::uint64_t inverted_tets = 0;  ///< of posed volume zero or less
  double inverted_rest_mm3 = 0;
  double inverted_share = 0;
  double min_det_f = 1;      ///< of F, the deformation gradient: posed over rest volume of a tet
  double volume_change = 0;  ///< of the tets, all together
  double unsigned_volume_change =
      0;  ///< sum of |posed - rest| over the tets, over that of rest: folds cannot cancel
  std::uint64_t tets_measured = 0;  ///< all that count, or the subset that these are estimated from
  double inverted_share_error = 0;  ///< standard error of the estimate; 0 where all tets were measured
  double volume_change_error = 0;   ///< likewise
  std::vector<TissueChange> tissues;
  double bone_rigidity_mm = 0;   ///< largest distance of a bone vertex from its bone's best rigid fit
  WorstPlaces places;            ///< where all tets were measured
  JointGaps gaps;                ///< likewise
  BoneOverlap overlap;           ///< QualityMeter and BoneOverlaps look for it, `measure` does not
  bool overlap_pending = false;  ///< not looked for: distances between bones are still being worked out
  std::vector<ClampedJoint> clamped;
  std::vector<DoubtfulJoint> doubtful;
  QualityThresholds thresholds;
  bool pass = true;  ///< the verdict: `pass` or `warn`
};

/// `tissues`: rows of Model::tissues that `body` holds. A body that was posed with Root::still is measured to
/// float32's grain of its own size; one that stands elsewhere, to the grain of where it stands. `closed`:
/// closed_surfaces of the model, for those who measure many poses; worked out again where empty. Sums run in
/// a fixed order: same figures for any thread count.
PoseQuality measure(const Model& model, const PosedBody& body, std::span<const std::uint32_t> tissues,
                    const QualityThresholds& thresholds = {}, std::span<const std::uint8_t> closed = {});

/// is_closed of every tissue's triangles. Parallel.
std::vector<std::uint8_t> closed_surfaces(const Model& model);

/// Posed over rest volume of every tet, det F; #T. `nodes`: 3 * #nodes, posed, LPS mm.
std::vector<float> tet_det_f(const Model& model, std::span<const float> nodes);

/// Volume, mm^3, that a closed surface encloses (divergence theorem, about the surface's first vertex);
/// positive where its triangles run counter-clockwise seen from outside. `vertices`: 3 * #V.
double enclosed_volume(std::span<const float> vertices, const Triangles& F);

/// Whether the surface is watertight: at least one triangle, and every edge is run along once each way.
/// Triangles with two equal corners count for nothing. O(#F log #F).
bool is_closed(const Triangles& F);

/// Largest distance, mm, of a posed vertex from the best rigid motion of the rest vertices (Kabsch). Both 3 *
/// #V.
double rigid_residual(std::span<const float> rest, std::span<const float> posed);

}  // namespace ecorche::runtime
