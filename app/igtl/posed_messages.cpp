// SPDX-License-Identifier: Apache-2.0
#include "app/igtl/posed_messages.hpp"

#include <tbb/parallel_for.h>

#include <algorithm>

#include "app/igtl/device_names.hpp"

namespace ecorche::app::igtl {
namespace {

enum Rank : int { motions, surfaces, images };

template <class Items>
std::vector<std::string> names_of(const Items& items, const std::vector<std::uint32_t>& rows) {
  std::vector<std::string> out;
  out.reserve(rows.size());
  for (const std::uint32_t row : rows) out.push_back(items[row].name);
  return out;
}

std::vector<std::string> segment_names(const Model& model) {
  std::vector<std::string> out;
  for (const Segment& segment : model.rig.skeleton.segments) out.push_back(segment.name);
  return out;
}

}  // namespace

std::vector<std::string> PosedMessages::fitting(std::vector<std::string> names) {
  std::vector<std::string> out = device_names(names);
  for (std::size_t i = 0; i < names.size(); ++i) {
    if (out[i] != names[i]) shortened_.emplace_back(names[i], out[i]);
  }
  return out;
}

PosedMessages::PosedMessages(const std::shared_ptr<const Model>& model, Choice choice)
    : choice_(std::move(choice)),
      poser_(model),
      volume_poser_(model),
      probe_(model),
      body_(poser_.make_frame({.positions = true, .quantised = false, .normals = true})),
      segments_(fitting(segment_names(*model))),
      volumes_(fitting(names_of(model->volumes, choice_.volumes))) {
  const std::vector<std::string> tissues = fitting(names_of(model->tissues, choice_.tissues));
  for (std::size_t i = 0; i < tissues.size(); ++i) {
    const Tissue& tissue = model->tissues[choice_.tissues[i]];
    surfaces_.emplace_back(tissues[i], tissue.F, static_cast<std::size_t>(tissue.V.rows()));
  }
}

void PosedMessages::pose(const Pose& pose) {
  const auto [code, what] = poser_.run(pose, choice_.skinning, choice_.tissues, body_);
  if (code != StatusCode::ok) throw Error(ErrorKind::data, "pose", what, "mend the pose");
  tree_follows_ = false;
  next_image_ = 0;
  const std::uint64_t time = time_now();
  std::vector<NamedTransform> joints;
  for (std::size_t row = 0; row < segments_.size(); ++row) {
    const RigidTransform& motion = body_.segments[row];
    messages_[{motions, "TRANSFORM", segments_[row]}] = transform_message({segments_[row], motion});
    joints.push_back(
        {segments_[row], {motion.q, motion * poser_.model().rig.skeleton.segments[row].joint.center}});
  }
  messages_[{motions, "TDATA", "joints"}] = tracking_message("joints", joints);
  std::vector<SharedBytes> made(surfaces_.size());
  tbb::parallel_for(std::size_t{0}, made.size(), [&](std::size_t i) {
    const std::uint32_t row = choice_.tissues[i];
    made[i] = surfaces_[i].posed(body_.tissues[row], body_.normals[row], time);
  });
  for (std::size_t i = 0; i < made.size(); ++i)
    messages_[{surfaces, "POLYDATA", surfaces_[i].device()}] = std::move(made[i]);
}

bool PosedMessages::makes_image(const std::string& device) const {
  return device.empty() ? !volumes_.empty()
                        : std::find(volumes_.begin(), volumes_.end(), device) != volumes_.end();
}

Key PosedMessages::pose_image(const Context& context) {
  const ModelVolume& volume = poser_.model().volumes[choice_.volumes[next_image_]];
  Key key{images, "IMAGE", volumes_[next_image_]};
  Image posed;
  volume_poser_.pose(body_.nodes, volume, choice_.sampling, runtime::grow_to(volume.image.grid, body_.nodes),
                     posed, scratch_, context);
  messages_[key] = image_message(key.device, posed);
  ++next_image_;
  return key;
}

std::vector<NamedPoint> PosedMessages::probed(std::vector<NamedPoint> points, bool to_scan) {
  if (!tree_follows_) probe_.follow(body_.nodes, tree_);
  tree_follows_ = true;
  std::vector<float> at;
  for (const NamedPoint& point : points) at.insert(at.end(), point.at.begin(), point.at.end());
  runtime::Probed found;
  const runtime::ProbeOptions wants{.tissue = true};
  if (to_scan)
    probe_.posed_to_rest(tree_, at, wants, found);
  else
    probe_.rest_to_posed(tree_, at, wants, found);
  for (std::size_t i = 0; i < points.size(); ++i) {
    const bool held = found.tet[i] != runtime::TetPlace::none;
    const std::int32_t tissue = found.tissue[i];
    points[i].group = !held        ? "outside"
                      : tissue < 0 ? "soft"
                                   : poser_.model().tissues[static_cast<std::size_t>(tissue)].name;
    if (held) points[i].at = Eigen::Vector3f(&found.points[3 * i]);
  }
  return points;
}

}  // namespace ecorche::app::igtl
