// SPDX-License-Identifier: Apache-2.0
#include "app/safe_range.hpp"

#include <algorithm>
#include <charconv>
#include <cmath>

#include <ecorche/kinematics/forward.hpp>
#include <ecorche/model_file/model_file.hpp>
#include <ecorche/runtime/body_poser.hpp>
#include <ecorche/runtime/pose_quality.hpp>
#include "core/elastic/flesh.hpp"
#include "preprocess/cache/kept_stage.hpp"
#include "preprocess/correct/samples.hpp"
#include "preprocess/fem/self_contact.hpp"
#include "runtime/quality/bone_overlaps.hpp"

namespace ecorche::app {
namespace {

constexpr int kContactStride = 4;  // steps between looks for contact, which goes on where it has begun

// Of the preparation; a millimetre where the model does not say.
double voxel_mm(const Model& model) {
  const auto found = model.provenance.find("option/voxel_mm");
  double value = 0;
  if (found != model.provenance.end())
    std::from_chars(found->second.data(), found->second.data() + found->second.size(), value);
  return value > 0 ? value : 1;
}

// What of a body can go wrong by skinning.
struct Watched {
  std::vector<std::int32_t> tets;      // free ones that bones do not squeeze
  std::vector<std::uint32_t> tissues;  // closed, and hung on tets
  std::vector<double> volume;          // theirs at rest
};

Watched watched(const Model& model) {
  Watched out;
  out.tets = elastic::flesh_of(model).tet;
  const std::vector<std::uint8_t> closed = runtime::closed_surfaces(model);
  for (std::size_t t = 0; t < model.tissues.size(); ++t) {
    const Tissue& tissue = model.tissues[t];
    if (closed[t] == 0 || tissue.segment != Tissue::by_tets) continue;
    const double volume =
        runtime::enclosed_volume({tissue.V.data(), static_cast<std::size_t>(tissue.V.size())}, tissue.F);
    if (!(std::abs(volume) > 0)) continue;
    out.tissues.push_back(static_cast<std::uint32_t>(t));
    out.volume.push_back(volume);
  }
  return out;
}

// One way of skinning.
class Skinned {
 public:
  Skinned(const std::shared_ptr<const Model>& model, const Watched& watched,
          const fem::SelfContactFinder& contact)
      : poser_(model), watched_(watched), contact_(contact), body_(poser_.make_frame()) {}

  // Writes `turn` into what of `ends` fails here first.
  void look(const Pose& pose, double turn, SafeRange::Ends& ends) {
    const bool tets = ends.inverted == SafeRange::none, volumes = ends.volume == SafeRange::none;
    if (!tets && !volumes) return;
    const std::span<const std::uint32_t> tissues =
        volumes ? std::span(watched_.tissues) : std::span<const std::uint32_t>();
    if (!poser_.run(pose, runtime::Skinning::cor, tissues, body_).ok()) return;
    if (tets && any_inverted()) ends.inverted = turn;
    if (volumes && any_changed()) ends.volume = turn;
  }

  // Whether flesh lies deeper than that in other flesh.
  bool meets_itself(const Pose& pose, double by_mm) {
    if (!poser_.run(pose, runtime::Skinning::cor, {}, body_).ok()) return false;
    const auto rows = static_cast<Eigen::Index>(body_.nodes.size() / 3);
    return contact_(Eigen::Map<const PointsF>(body_.nodes.data(), rows, 3).cast<double>()).depth_mm > by_mm;
  }

 private:
  bool any_inverted() const {
    const std::vector<float> det = runtime::tet_det_f(poser_.model(), body_.nodes);
    return std::any_of(watched_.tets.begin(), watched_.tets.end(),
                       [&](std::int32_t t) { return !(det[static_cast<std::size_t>(t)] > 0); });
  }
  bool any_changed() const {
    for (std::size_t i = 0; i < watched_.tissues.size(); ++i) {
      const std::uint32_t t = watched_.tissues[i];
      const double now = runtime::enclosed_volume(body_.tissues[t], poser_.model().tissues[t].F);
      if (std::abs(now / watched_.volume[i] - 1) > kSafeVolume) return true;
    }
    return false;
  }

  runtime::BodyPoser poser_;
  const Watched& watched_;
  const fem::SelfContactFinder& contact_;
  runtime::PosedBody body_;
};

std::shared_ptr<const Model> without_corrections(const Model& model) {
  auto out = std::make_shared<Model>(model);
  out->corrections.clear();
  out->pose_corrections.clear();
  return out;
}

bool corrects(const Model& model, std::size_t joint) {
  const auto row = static_cast<std::int32_t>(joint);
  return std::any_of(model.corrections.begin(), model.corrections.end(),
                     [&](const JointCorrection& c) { return c.joint == row; }) ||
         std::any_of(model.pose_corrections.begin(), model.pose_corrections.end(),
                     [&](const PoseCorrection& c) { return std::ranges::binary_search(c.joint, row); });
}

bool both(const SafeRange::Ends& ends) {
  return ends.inverted != SafeRange::none && ends.volume != SafeRange::none;
}

// All that it takes to look at a joint; made when the first is.
class Looking {
 public:
  explicit Looking(const std::shared_ptr<const Model>& model)
      : model_(*model),
        what_(watched(*model)),
        rest_(model->nodes.cast<double>()),
        contact_(rest_, model->tets),
        plain_(without_corrections(*model), what_, contact_),
        corrected_(model, what_, contact_),
        bones_(*model),
        voxel_(voxel_mm(*model)) {}

  std::vector<SafeRange> of(std::size_t joint, const Context& context) {
    std::vector<SafeRange> out;
    for (std::size_t a = 0; a < 3; ++a) {
      for (const int way : {-1, 1}) {
        SafeRange range;
        range.joint = static_cast<std::int32_t>(joint);
        range.angle = static_cast<std::int32_t>(a);
        range.way = way;
        range.looked = correct::reach(model_.rig.skeleton.segments[joint].joint, a, way);
        if (!(range.looked >= kSafeStep)) continue;
        look(range, context);
        out.push_back(range);
      }
    }
    return out;
  }

 private:
  void look(SafeRange& range, const Context& context) {
    const auto joint = static_cast<std::size_t>(range.joint);
    const bool both_ways = corrects(model_, joint);
    const int steps = static_cast<int>(std::floor(range.looked / kSafeStep));
    for (int n = 1; n <= steps; ++n) {
      context.check_stop();
      const double turn = n * kSafeStep;
      if (both(range.skinned) && (both(range.corrected) || !both_ways) && range.bones != SafeRange::none)
        break;
      const Pose pose = turned(range, n);
      plain_.look(pose, turn, range.skinned);
      if (both_ways) corrected_.look(pose, turn, range.corrected);
      if (range.bones == SafeRange::none && bones_.meet(kinematics::forward(model_.rig, pose), voxel_))
        range.bones = turn;
    }
    range.skinned.contact = contact(plain_, range, steps, context);
    if (both_ways) range.corrected.contact = contact(corrected_, range, steps, context);
    if (!both_ways) range.corrected = range.skinned;
  }
  Pose turned(const SafeRange& range, int step) const {
    return correct::turned(model_.rig.skeleton, static_cast<std::size_t>(range.joint),
                           range.way * step * kSafeStep * Eigen::Vector3d::Unit(range.angle));
  }
  // The first step at which flesh meets other flesh by a voxel, as a turn.
  double contact(Skinned& body, const SafeRange& range, int steps, const Context& context) const {
    int before = 0;
    for (int n = std::min(kContactStride, steps);; n = std::min(n + kContactStride, steps)) {
      context.check_stop();
      if (body.meets_itself(turned(range, n), voxel_)) {
        int first = before + 1;
        while (first < n && !body.meets_itself(turned(range, first), voxel_)) ++first;
        return first * kSafeStep;
      }
      if (n == steps) return SafeRange::none;
      before = n;
    }
  }

  const Model& model_;
  Watched what_;
  Points rest_;
  fem::SelfContactFinder contact_;
  Skinned plain_, corrected_;
  runtime::BoneOverlaps bones_;
  double voxel_;
};

}  // namespace

std::vector<SafeRange> measure_safe_ranges(const std::shared_ptr<const Model>& model,
                                           const std::vector<std::size_t>& joints,
                                           preprocess::StageStore* store, const Context& context) {
  const Skeleton& skeleton = model->rig.skeleton;
  const std::uint64_t identity = store != nullptr ? model_file::identity(*model) : 0;
  const double voxel = voxel_mm(*model);  // in no model's identity
  std::unique_ptr<Looking> looking;
  std::vector<SafeRange> out;
  for (std::size_t j = 0; j < skeleton.segments.size(); ++j) {
    context.report(static_cast<double>(j) / static_cast<double>(skeleton.segments.size()));
    const bool asked = joints.empty() || std::find(joints.begin(), joints.end(), j) != joints.end();
    if (!asked || !correct::turns_by_itself(skeleton, j)) continue;
    const auto look = [&](const Context& inner) {
      if (!looking) looking = std::make_unique<Looking>(model);
      return looking->of(j, inner);
    };
    std::vector<SafeRange> of_joint;
    if (store == nullptr) {
      of_joint = look(context);
    } else {
      namespace cache = preprocess::cache;
      const std::string name =
          cache::key(*store, "range", identity, std::uint64_t{j}, voxel, kSafeStep, kSafeVolume);
      auto kept = cache::take<std::vector<SafeRange>>(*store, name, context);
      of_joint = kept ? std::move(*kept) : cache::make_and_keep(*store, name, context, look);
    }
    out.insert(out.end(), of_joint.begin(), of_joint.end());
  }
  context.report(1);
  return out;
}

}  // namespace ecorche::app
