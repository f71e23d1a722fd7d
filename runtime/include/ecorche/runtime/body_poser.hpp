// SPDX-License-Identifier: Apache-2.0
// A model made ready for posing, and the buffers of one posed body.
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <string_view>
#include <vector>

#include <ecorche/runtime/aligned.hpp>
#include <ecorche/runtime/held_arrays.hpp>
#include <ecorche/runtime/quantise_box.hpp>
#include <ecorche/runtime/segment_motion.hpp>
#include <ecorche/values/error.hpp>
#include <ecorche/values/model.hpp>
#include <ecorche/values/pose.hpp>
#include <ecorche/values/transform.hpp>

namespace ecorche::runtime {

enum class Skinning : std::uint8_t {
  lbs,  ///< linear blend skinning
  dqs,  ///< dual quaternion skinning, Kavan08
  cor,  ///< optimised centres of rotation, LeHodgins16; nodes without a centre by LBS
};

/// `lbs`, `dqs`, `cor` and back; throws Error{usage} on another word.
std::string_view skinning_name(Skinning skinning);
Skinning skinning_from_name(std::string_view name);

/// What a frame holds of its tissues.
struct FrameParts {
  bool positions = true;   ///< float32
  bool quantised = false;  ///< u16 in PosedBody::box
  bool normals = false;    ///< i16
};

/// Which nodes a pose is worked out for.
enum class NodesOf : std::uint8_t {
  body,     ///< all; quality and volumes need them
  lanes,    ///< all, in PosedBody::Scratch::lanes alone: PosedBody::nodes is not written
  tissues,  ///< those that the asked tissues hang on: about half of the work. PosedBody::nodes is not written
};

/// Where the body stands.
enum class Root : std::uint8_t {
  moved,  ///< where the pose takes it
  still,  ///< as scanned, whatever turned and moved it as a whole: no digits go into where it stands. For
          ///< measuring: a body that was only moved is the rest body, to the last bit but one
};

/// One posed body. Allocated once by BodyPoser::make_frame, then only written.
struct PosedBody {
  Pose pose;                             ///< what was posed: as asked, within limits, coupled
  std::vector<RigidTransform> segments;  ///< motion of every segment from rest
  std::vector<float> nodes;              ///< 3 * #nodes, LPS mm
  std::vector<std::vector<float>>
      tissues;  ///< per tissue of the model, 3 * #V; not written when not asked for
  std::vector<std::vector<std::uint16_t>> quantised;  ///< per tissue, 3 * #V, in `box`; empty: not a part
  std::vector<std::vector<std::int16_t>>
      normals;      ///< per tissue, 3 * #V, unit vectors in 32767ths; empty: not a part
  QuantiseBox box;  ///< a cube about the body's middle as its root carries it, twice the body's diagonal wide
  std::vector<ClampedJoint> clamped;  ///< reserved for all joints; what limits took away

  /// Of `run`; but for the lanes it means nothing to others.
  struct Scratch {
    std::vector<SegmentMotion> motions;  // #segments, as the kernels read them
    Aligned<float> lanes;  // posed nodes, x, y, z in the order of BodyPoser::lanes, and one float more
    std::vector<std::uint64_t> mask;   // a bit per cluster that is skinned
    std::vector<std::uint8_t> asked;   // #tissues
    std::vector<std::uint32_t> begun;  // per slab, where its thread had begun
    std::vector<std::uint32_t> late;   // runs of cells that reach across where two threads met
    std::vector<std::uint32_t> bones;  // blocks of bones
    std::vector<float> modes;          // of the correction, mm a step of its fields
  } scratch;
};

/// Whether it stands as Root::still would have it, within float32's grain.
bool stands_still(const PosedBody& body);

/// Shared and immutable: any number of threads may pose different frames at once. Work inside runs in the
/// caller's TBB arena; results are the same bytes for any number of threads.
class BodyPoser {
 public:
  /// Drops weights below 1e-4 and renormalises their rows. Throws Error{data} for a model whose
  /// arrays do not fit together, Error{config} for a rig that cannot be constrained.
  explicit BodyPoser(std::shared_ptr<const Model> model);
  ~BodyPoser();
  BodyPoser(const BodyPoser&) = delete;
  BodyPoser& operator=(const BodyPoser&) = delete;

  /// What is posed.
  const Model& model() const;
  /// The same, to be kept.
  const std::shared_ptr<const Model>& shared_model() const;
  /// Room for a posed body, to be used again from pose to pose.
  PosedBody make_frame(const FrameParts& parts = {}) const;

  /// Constrains `pose` (limits, coupling), runs forward kinematics, skins the nodes, then moves the tissues
  /// whose rows of Model::tissues are in `tissues` (ascending). Allocates nothing. invalid_argument when the
  /// pose has not one rotation and one translation per joint, or holds a value that is not finite, beyond
  /// 1e9 mm or no unit quaternion within 1 %, when a tissue is not of the model, or when `out` is no
  /// frame of it. Positions keep 1e-3 mm at rest and under any rigid motion of the whole body within metres:
  /// see segment_motion.hpp.
  Status run(const Pose& pose, Skinning skinning, std::span<const std::uint32_t> tissues, PosedBody& out,
             NodesOf nodes = NodesOf::body, Root root = Root::moved) const;

  /// All tissues of the model.
  std::span<const std::uint32_t> all_tissues() const;

  /// mm, of PosedBody::box in every pose.
  float box_step() const;

  /// #nodes: which row of PosedBody::Scratch::lanes holds a node.
  std::span<const std::uint32_t> lanes() const;

  /// What it holds besides the model.
  HeldArrays arrays() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace ecorche::runtime
