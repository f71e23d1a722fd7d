// SPDX-License-Identifier: Apache-2.0
#include "app/hang_skeleton.hpp"

#include <nlohmann/json.hpp>

#include <ecorche/io/case_file.hpp>
#include <ecorche/model_file/model_file.hpp>
#include "app/cli.hpp"
#include "app/point_table.hpp"
#include "app/usage_error.hpp"
#include "core/files/atomic_file.hpp"
#include "io/case/attachment_file.hpp"
#include "preprocess/thin/attach.hpp"
#include "preprocess/thin/picks.hpp"

namespace ecorche::app {
namespace {

Skeleton read_rig(const Program& program, const HangSettings& settings) {
  if (!settings.model.empty())
    return model_file::read(settings.model, program.context("reading the model")).rig.skeleton;
  Skeleton skeleton = io::read_skeleton(settings.skeleton);
  for (const Segment& segment : skeleton.segments) {
    if (segment.joint.rule == CenterRule::given) continue;
    throw Error(ErrorKind::config, settings.skeleton.string(),
                "joint '" + segment.joint.name + "' is found from bones, which a skeleton alone has not",
                "write its center, or give a prepared --model");
  }
  return skeleton;
}

std::vector<thin::Pick> read_picks(const std::filesystem::path& path) {
  std::vector<thin::Pick> out;
  for (const NamedPoint& point : read_named_points(path))
    out.push_back({point.name, point.parent, Eigen::Vector3d(point.at.data())});
  return out;
}

// Where each joint was moved to, told and written.
void say_snapped(const Program& program, const HangSettings& settings, const Skeleton& rig,
                 const std::vector<thin::Snapped>& moved, nlohmann::json& report) {
  double farthest = 0;
  for (const thin::Snapped& joint : moved) {
    report["snapped_mm"][joint.joint] = joint.moved_mm;
    farthest = std::max(farthest, joint.moved_mm);
  }
  program.note("joints moved to skeletal voxels by at most " + std::to_string(farthest) + " mm");
  if (!settings.snapped.empty()) files::write_text(settings.snapped, io::skeleton_to_yaml(rig));
}

void check_joints(const std::vector<std::string>& outside) {
  if (outside.empty()) return;
  std::string names;
  for (std::size_t i = 0; i < std::min<std::size_t>(outside.size(), 5); ++i)
    names += (i > 0 ? ", " : "") + outside[i];
  if (outside.size() > 5) names += ", ...";
  throw Error(ErrorKind::config, "joints",
              std::to_string(outside.size()) + " lie outside the object: " + names,
              "correct their centres, or move all to the nearest skeletal voxels by --snap");
}

void attach(const Program& program, const HangSettings& settings, const thin::Mask& mask,
            io::VolumetricSkeletonFile& file, StepClock& clock, nlohmann::json& report) {
  VolumetricSkeleton& s = file.skeleton;
  std::vector<thin::Snapped> moved;
  Skeleton rig;
  if (!settings.picks.empty()) {
    rig = thin::skeleton_of_picks(s, mask, read_picks(settings.picks), moved);
    for (const Segment& segment : rig.segments)
      report["parents"][segment.name] =
          segment.parent < 0 ? nlohmann::json()
                             : nlohmann::json(rig.segments[static_cast<std::size_t>(segment.parent)].name);
  } else {
    rig = read_rig(program, settings);
    if (settings.snap) moved = thin::snap_joints(s, rig);
  }
  if (moved.empty()) {
    check_joints(thin::joints_outside(mask, rig));
  } else {
    say_snapped(program, settings, rig, moved, report);
  }
  const thin::Attachment attachment =
      clock.time("attach", [&] { return thin::attach(s, mask, rig, program.context("attaching")); });
  s.segment = attachment.segment;
  for (const Segment& segment : rig.segments) file.segments.push_back(segment.name);
  report["attached"] = {{"first_pass", attachment.near},
                        {"second_pass", s.size() - attachment.near},
                        {"far_components", attachment.far_components}};
  if (!settings.reassign.empty()) {
    report["attached"]["reassigned"] =
        thin::reassign(s, rig, io::read_attachment(settings.reassign, rig), s.segment);
  }
  std::vector<std::size_t> voxels(rig.segments.size(), 0);
  for (const std::int32_t row : s.segment) ++voxels[static_cast<std::size_t>(row)];
  for (std::size_t i = 0; i < voxels.size(); ++i) report["segments"][rig.segments[i].name] = voxels[i];
}

}  // namespace

void add_hang_options(CLI::App& command, HangSettings& settings) {
  using thin::TreeOptions;
  command.add_flag("--tree", settings.tree, "make the skeleton tree, a minimum spanning tree");
  command
      .add_option("--alpha", settings.options.alpha, "what a step counts beside the change of the distance")
      ->check(CLI::Range(TreeOptions::least_alpha, TreeOptions::most_alpha))
      ->capture_default_str();
  command.add_option("--reach", settings.options.reach, "voxels at most this far apart are neighbours")
      ->check(CLI::Range(TreeOptions::least_reach, TreeOptions::most_reach))
      ->capture_default_str();
  command.add_flag("--connect", settings.options.connect,
                   "join the components that are left, reaching farther");
  command.add_option("--skeleton", settings.skeleton,
                     "a skeleton file (LPS mm): hang every voxel on one of its segments");
  command.add_option("--model", settings.model, "or the fitted rig of this model");
  command.add_option(
      "--picks", settings.picks,
      "or points picked by hand (CSV: x,y,z and perhaps name,parent; the first is the root): each "
      "moves to the nearest skeletal voxel, parents are found along the tree");
  command.add_flag("--snap", settings.snap, "first move every joint to the nearest skeletal voxel");
  command.add_option("--snapped", settings.snapped, "write the skeleton file with the joints so moved");
  command.add_option("--reassign", settings.reassign, "splits and regions that say otherwise, by hand");
}

void check_hang_options(const HangSettings& settings) {
  if (!settings.skeleton.empty() && !settings.model.empty())
    usage_error("--model", "stands beside --skeleton", "give one of the two");
  if (!settings.picks.empty() && (!settings.skeleton.empty() || !settings.model.empty()))
    usage_error("--picks", "stands beside --skeleton or --model", "give one of them");
  if (!settings.picks.empty() && settings.snapped.empty())
    usage_error("--picks", "nothing keeps the skeleton that they make", "add --snapped SKELETON.yaml");
  if (!settings.attaches() && settings.snap)
    usage_error("--snap", "there are no joints to move", "give --skeleton or --model");
  if (!settings.attaches() && !settings.reassign.empty())
    usage_error("--reassign", "nothing is attached", "give --skeleton, --model or --picks");
  if (!settings.snap && settings.picks.empty() && !settings.snapped.empty())
    usage_error("--snapped", "joints are not moved", "give --snap as well");
}

void hang(const Program& program, const HangSettings& settings, const thin::Mask& mask,
          io::VolumetricSkeletonFile& file, StepClock& clock, nlohmann::json& report) {
  if (!settings.tree && !settings.attaches()) return;
  VolumetricSkeleton& s = file.skeleton;
  s.parent = clock.time(
      "tree", [&] { return thin::spanning_tree(s, settings.options, program.context("skeleton tree")); });
  const std::size_t components = thin::component_count(s.parent);
  report["tree"] = {{"components", components},
                    {"edges", s.size() - components},
                    {"alpha", settings.options.alpha},
                    {"reach", settings.options.reach}};
  if (components > 1) {
    program.note("the skeleton tree is in " + std::to_string(components) +
                 " components; --connect joins them");
  }
  if (settings.attaches()) attach(program, settings, mask, file, clock, report);
}

}  // namespace ecorche::app
