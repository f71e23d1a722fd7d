// SPDX-License-Identifier: Apache-2.0
#include "app/balls_of_file.hpp"

#include <string>
#include <tuple>
#include <vector>

#include <ecorche/io/case_file.hpp>
#include <ecorche/kinematics/angles.hpp>
#include <ecorche/kinematics/forward.hpp>
#include <ecorche/model_file/model_file.hpp>
#include <ecorche/values/error.hpp>
#include "app/pose_frames.hpp"
#include "io/surface/volumetric_skeleton_file.hpp"

namespace ecorche::app {

namespace {

namespace fs = std::filesystem;

bool is_model(const fs::path& path) {
  return path.extension() == ".hdf";
}

// Its voxels on the rows of `rig`.
void hang_on(const fs::path& path, const std::vector<std::string>& names, const Rig& rig,
             VolumetricSkeleton& skeleton) {
  if (skeleton.segment.empty())
    throw Error(ErrorKind::data, path.string(), "its voxels hang on no segments",
                "attach it to the rig: ecorche thin");
  std::vector<std::int32_t> row;
  for (const std::string& name : names) {
    row.push_back(rig.skeleton.find_segment(name));
    if (row.back() < 0)
      throw Error(ErrorKind::config, path.string(), "the rig has no segment '" + name + "'",
                  "name the rig that it was attached to");
  }
  for (std::int32_t& segment : skeleton.segment) {
    if (segment >= 0) segment = row[static_cast<std::size_t>(segment)];
  }
}

// Where the file has them; the names are segments of the rig.
void move_joints(const io::VolumetricSkeletonFile& file, Rig& rig) {
  for (std::size_t s = 0; s < file.joints.size(); ++s) {
    const std::int32_t row = rig.skeleton.find_segment(file.segments[s]);
    rig.skeleton.segments[static_cast<std::size_t>(row)].joint.center =
        Eigen::Vector3d(file.joints[s].data());
  }
}

}  // namespace

Rig read_placed_rig(const fs::path& path) {
  if (is_model(path)) return model_file::read(path, {}).rig;
  Rig rig{io::read_skeleton(path), {}};
  for (const Segment& segment : rig.skeleton.segments) {
    if (segment.joint.rule != CenterRule::given)
      throw Error(ErrorKind::config, path.string(),
                  "joint '" + segment.joint.name + "' is to be fitted to bones",
                  "name a model, whose rig is fitted");
  }
  return rig;
}

std::pair<VolumetricSkeleton, Rig> read_skeleton_and_rig(const fs::path& skeleton, const fs::path& rig) {
  if (!is_model(skeleton)) {
    io::VolumetricSkeletonFile file = io::read_volumetric_skeleton(skeleton);
    if (rig.empty()) return {std::move(file.skeleton), Rig()};
    Rig moved_by = read_placed_rig(rig);
    hang_on(skeleton, file.segments, moved_by, file.skeleton);
    move_joints(file, moved_by);
    return {std::move(file.skeleton), std::move(moved_by)};
  }
  Model model = model_file::read(skeleton, {});
  if (model.spheres.empty())
    throw Error(ErrorKind::config, skeleton.string(), "it holds no spheres",
                "preprocess it with spheres, or name a skeleton (.vtp)");
  VolumetricSkeleton own = std::move(model.spheres.front());
  if (rig.empty()) return {std::move(own), std::move(model.rig)};
  std::vector<std::string> names;
  for (const Segment& segment : model.rig.skeleton.segments) names.push_back(segment.name);
  Rig moved_by = read_placed_rig(rig);
  hang_on(skeleton, names, moved_by, own);
  return {std::move(own), std::move(moved_by)};
}

runtime::BallSet posed_balls(const VolumetricSkeleton& skeleton, const ImageGrid& lattice, const Rig& rig,
                             Pose pose, const runtime::Seams& seams, std::size_t& clamped) {
  std::vector<ClampedJoint> held;
  kinematics::constrain(rig.skeleton, pose, held);
  clamped = held.size();
  runtime::BallSet set = runtime::balls_at_rest(skeleton, lattice);
  const std::vector<RigidTransform> motions = kinematics::forward(rig, pose);
  runtime::move_balls(skeleton, motions, set);
  runtime::bridge(seams, motions, set);
  return set;
}

PlacedBalls read_placed_balls(const Program& program, const fs::path& skeleton, const fs::path& rig,
                              const std::string& pose) {
  if (!pose.empty() && rig.empty() && !is_model(skeleton))
    throw Error(ErrorKind::usage, "--rig", "a pose needs a rig", "add --rig SKELETON.yaml or MODEL.hdf");
  PlacedBalls out;
  std::tie(out.skeleton, out.rig) = read_skeleton_and_rig(skeleton, rig);
  if (pose.empty()) {
    out.set = runtime::balls_at_rest(out.skeleton, out.skeleton.grid);
    return out;
  }
  const Pose wanted = read_frames(program, {pose, {}, {}, {}}, out.rig).front().pose;
  std::size_t clamped = 0;
  out.set = posed_balls(out.skeleton, out.skeleton.grid, out.rig, wanted, {}, clamped);
  if (clamped > 0) program.note("note: limits held back " + std::to_string(clamped) + " joint(s)");
  return out;
}

}  // namespace ecorche::app
