// SPDX-License-Identifier: Apache-2.0
// Whether bones stay whole: bench_rigid MODEL... [--walk CLIP.bvh] [--step MM] prints, for every library pose
// and some frames of the clip, how many tets of bones are inverted or changed, and how much of the bones a
// posed volume shows more than 1 mm off. For the last, points on a grid of MM (default 3) inside the bones'
// surfaces are moved by their bones' own segments, and the probe, which finds the tets that volumes are drawn
// by, says where each came from.
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <memory>
#include <string>
#include <vector>

#include <ecorche/io/pose_library.hpp>
#include <ecorche/model_file/model_file.hpp>
#include <ecorche/runtime/body_poser.hpp>
#include <ecorche/runtime/probe.hpp>
#include "bench/table.hpp"
#include "core/kinematics/retarget.hpp"
#include "io/motion/bvh.hpp"
#include "runtime/quality/bone_tets.hpp"

namespace ecorche::bench {
namespace {

constexpr double kFar = 1;          // mm
constexpr std::size_t kFrames = 6;  // of a clip

struct NamedPose {
  std::string name;
  Pose pose;
};

std::vector<NamedPose> poses_for(const Rig& rig, const std::string& walk) {
  std::vector<NamedPose> out;
  for (const std::string& name : io::library_poses()) {
    try {
      out.push_back({name, io::library_pose(name, rig).pose});
    } catch (const Error&) {  // none of its joints is there
    }
  }
  if (walk.empty()) return out;
  const Clip clip = io::read_bvh(walk);
  const kinematics::Retarget match = kinematics::match(rig, clip);
  for (std::size_t i = 0; i < kFrames; ++i) {
    const std::size_t frame = clip.frames() * i / kFrames;
    out.push_back({"walk " + std::to_string(frame), kinematics::pose_at(rig, clip, match, frame)});
  }
  return out;
}

/// Points inside bones at rest, and whose they are.
struct BonePoints {
  std::vector<float> rest;
  std::vector<std::int32_t> segment;
};

BonePoints points_in_bones(const Model& model, const runtime::Probe& probe, double step) {
  const Eigen::RowVector3f low = model.nodes.colwise().minCoeff(), high = model.nodes.colwise().maxCoeff();
  runtime::Probe::PosedTree tree;
  probe.follow({model.nodes.data(), static_cast<std::size_t>(model.nodes.size())}, tree);
  const runtime::ProbeOptions wants{false, true, {}};
  BonePoints out;
  runtime::Probed found;
  std::vector<float> slice;
  const auto spacing = static_cast<float>(step);
  for (float z = low.z(); z < high.z(); z += spacing) {
    slice.clear();
    for (float y = low.y(); y < high.y(); y += spacing)
      for (float x = low.x(); x < high.x(); x += spacing) slice.insert(slice.end(), {x, y, z});
    probe.posed_to_rest(tree, slice, wants, found);
    for (std::size_t i = 0; i < found.tissue.size(); ++i) {
      if (found.tissue[i] < 0) continue;
      const std::int32_t segment = model.tissues[static_cast<std::size_t>(found.tissue[i])].segment;
      if (segment == Tissue::by_tets) continue;
      for (std::size_t a = 0; a < 3; ++a) out.rest.push_back(slice[3 * i + a]);
      out.segment.push_back(segment);
    }
  }
  return out;
}

struct Wrong {
  double share = 0, worst_mm = 0;
};

Wrong wrong_points(const BonePoints& bones, const std::vector<RigidTransform>& motion,
                   const runtime::Probe& probe, const runtime::Probe::PosedTree& tree) {
  const std::size_t count = bones.segment.size();
  std::vector<float> posed(3 * count);
  const auto at = [](const std::vector<float>& of, std::size_t i) {
    return Eigen::Vector3d(static_cast<double>(of[3 * i]), static_cast<double>(of[3 * i + 1]),
                           static_cast<double>(of[3 * i + 2]));
  };
  for (std::size_t i = 0; i < count; ++i) {
    const Eigen::Vector3d to = motion[static_cast<std::size_t>(bones.segment[i])] * at(bones.rest, i);
    for (std::size_t a = 0; a < 3; ++a)
      posed[3 * i + a] = static_cast<float>(to[static_cast<Eigen::Index>(a)]);
  }
  runtime::Probed found;
  probe.posed_to_rest(tree, posed, {}, found);
  std::size_t wrong = 0;
  Wrong out;
  for (std::size_t i = 0; i < count; ++i) {
    const double off = (at(found.points, i) - at(bones.rest, i)).norm();  // no number: outside
    wrong += off <= kFar ? 0 : 1;
    if (off > out.worst_mm) out.worst_mm = off;
  }
  out.share = count == 0 ? 0 : static_cast<double>(wrong) / static_cast<double>(count);
  return out;
}

void measure(const std::string& path, const std::string& walk, double step) {
  const auto model = std::make_shared<const Model>(model_file::read(path, Context{}));
  const runtime::Probe probe(model);
  const BonePoints bones = points_in_bones(*model, probe, step);
  std::printf("\n%s: %zu tets, %zu contested, %zu points in bones\n", path.c_str(), model->tet_count(),
              model->contested.size(), bones.segment.size());
  const Table table({{"pose", 12},
                     {"bone tets"},
                     {"inverted"},
                     {"changed"},
                     {"worst mm"},
                     {"CT bone off %"},
                     {"worst mm"}});
  const runtime::BodyPoser poser(model);
  runtime::PosedBody body = poser.make_frame();
  runtime::Probe::PosedTree tree;
  for (const NamedPose& pose : poses_for(model->rig, walk)) {
    const Status status = poser.run(pose.pose, runtime::Skinning::cor, {}, body);
    if (!status.ok()) throw Error(ErrorKind::data, pose.name, status.message, "mend the pose");
    const runtime::BoneTets tets = runtime::measure_bone_tets(*model, body.nodes);
    probe.follow(body.nodes, tree);
    const Wrong wrong = wrong_points(bones, body.segments, probe, tree);  // clamped as the tets were
    table.row({pose.name, std::to_string(tets.count), std::to_string(tets.inverted),
               std::to_string(tets.changed), exponent(tets.largest_change_mm, 2), fixed(100 * wrong.share, 3),
               fixed(wrong.worst_mm, 1)});
  }
}

int run(const std::vector<std::string>& words) {
  std::vector<std::string> models;
  std::string walk;
  double step = 3;
  for (std::size_t i = 0; i < words.size(); ++i) {
    if (words[i] == "--walk" && i + 1 < words.size()) {
      walk = words[++i];
    } else if (words[i] == "--step" && i + 1 < words.size()) {
      step = std::strtod(words[++i].c_str(), nullptr);
    } else {
      models.push_back(words[i]);
    }
  }
  if (models.empty() || !(step > 0)) {
    std::fprintf(stderr, "usage: bench_rigid MODEL... [--walk CLIP.bvh] [--step MM]\n");
    return exit_code(ErrorKind::usage);
  }
  try {
    for (const std::string& model : models) measure(model, walk, step);
  } catch (const Error& error) {
    std::fprintf(stderr, "%s\n", error.what());
    return exit_code(error.kind());
  }
  return 0;
}

}  // namespace
}  // namespace ecorche::bench

int main(int count, char** words) {
  return ecorche::bench::run({words + 1, words + count});
}
