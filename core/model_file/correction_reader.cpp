// SPDX-License-Identifier: Apache-2.0
#include "core/model_file/correction_reader.hpp"

#include "core/model_file/packed_field.hpp"

namespace ecorche::model_file {
namespace {

// Packed, or as older models have it: of `shape`.
std::vector<std::int16_t> read_field(const Source& source, const std::string& at, std::size_t modes,
                                     std::size_t rows, const Source::Shape& shape) {
  if (!source.catalogue().datasets.contains(at + "shift"))
    return source.vector<std::int16_t>(at + "field", shape);
  const PackedField packed{source.vector<std::uint8_t>(at + "shift", {modes, PackedField::blocks(rows)}),
                           source.vector<std::int8_t>(at + "byte"), source.vector<std::int16_t>(at + "word")};
  auto field = unpack(packed, modes, rows);
  if (!field) source.refuse(at + "shift", "does not fit the numbers in byte and word");
  return std::move(*field);
}

}  // namespace

JointCorrection read_correction(const Source& source, const Skeleton& skeleton, const std::string& group,
                                const std::string& joint) {
  const std::string at = group + "/" + joint + "/";
  JointCorrection correction;
  correction.joint = skeleton.find_joint(joint);
  if (correction.joint < 0) source.refuse(at + "index", "is of a joint that the skeleton has not");
  correction.turn = source.matrix<JointCorrection::Turns>(at + "turn");
  correction.scale = source.vector<float>(at + "scale");
  const std::size_t modes = correction.scale.size();
  const auto samples = static_cast<std::uint64_t>(correction.turn.rows());
  const auto mix = source.vector<float>(at + "mix", {samples, modes});
  correction.mix = Eigen::Map<const JointCorrection::Mix>(mix.data(), static_cast<Eigen::Index>(samples),
                                                          static_cast<Eigen::Index>(modes));
  correction.node = source.vector<std::uint32_t>(at + "node");
  const std::size_t rows = correction.node.size();
  correction.field = read_field(source, at, modes, rows, {modes, rows, 3});
  return correction;
}

PoseCorrection read_pose_correction(const Source& source, const std::string& group,
                                    const std::string& place) {
  const std::string at = group + "/" + place + "/";
  PoseCorrection correction;
  correction.pose = source.text(at + "pose");
  correction.joint = source.vector<std::int32_t>(at + "joint");
  correction.turn = source.matrix<JointCorrection::Turns>(at + "turn");
  correction.reach = source.scalar<double>(at + "reach");
  correction.scale = source.scalar<float>(at + "scale");
  correction.node = source.vector<std::uint32_t>(at + "node");
  const std::size_t rows = correction.node.size();
  correction.field = read_field(source, at, 1, rows, {rows, 3});
  return correction;
}

std::vector<SafeRange> read_safe_ranges(const Source& source) {
  const std::string at = "/ecorche/safe_range/";
  if (!source.catalogue().groups.contains("/ecorche/safe_range")) return {};
  const auto joints = source.vector<std::int32_t>(at + "joint");
  std::vector<SafeRange> ranges(joints.size());
  const auto fill = [&](const char* name, auto member) {
    using Value = std::decay_t<decltype(member(ranges[0]))>;
    const auto values = source.vector<Value>(at + name, {ranges.size()});
    for (std::size_t i = 0; i < ranges.size(); ++i) member(ranges[i]) = values[i];
  };
  fill("joint", [](SafeRange& r) -> std::int32_t& { return r.joint; });
  fill("angle", [](SafeRange& r) -> std::int32_t& { return r.angle; });
  fill("way", [](SafeRange& r) -> std::int32_t& { return r.way; });
  fill("looked", [](SafeRange& r) -> double& { return r.looked; });
  fill("skinned_inverted", [](SafeRange& r) -> double& { return r.skinned.inverted; });
  fill("skinned_volume", [](SafeRange& r) -> double& { return r.skinned.volume; });
  fill("corrected_inverted", [](SafeRange& r) -> double& { return r.corrected.inverted; });
  fill("corrected_volume", [](SafeRange& r) -> double& { return r.corrected.volume; });
  fill("bones", [](SafeRange& r) -> double& { return r.bones; });
  if (source.catalogue().datasets.contains(at + "skinned_contact")) {
    fill("skinned_contact", [](SafeRange& r) -> double& { return r.skinned.contact; });
    fill("corrected_contact", [](SafeRange& r) -> double& { return r.corrected.contact; });
  } else {
    for (SafeRange& range : ranges) range.skinned.contact = range.corrected.contact = SafeRange::not_looked;
  }
  return ranges;
}

}  // namespace ecorche::model_file
