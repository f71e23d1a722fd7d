// SPDX-License-Identifier: Apache-2.0
#include "io/motion/gltf_clip.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <set>

#include <ecorche/values/error.hpp>
#include "core/files/atomic_file.hpp"
#include "io/motion/gltf_track.hpp"
#include "io/surface/gltf_model.hpp"

namespace ecorche::io {
namespace {

using Eigen::Affine3d;
using Eigen::Quaterniond;
using Eigen::Vector3d;

constexpr double kMetre = 1000, kThirtieth = 1.0 / 30;
constexpr std::size_t kLargestFile = std::size_t{1} << 30;

[[noreturn]] void refuse(const std::string& where, const std::string& what,
                         const std::string& mend = "export the motion again") {
  throw Error(ErrorKind::data, where, what, mend);
}

// The turn of a transform, its scale taken out; Gram-Schmidt, so that a rotation comes back as it is.
Quaterniond turn_of(const Affine3d& transform, const std::string& where) {
  const Eigen::Matrix3d& m = transform.linear();
  const Vector3d x = m.col(0).normalized();
  const Vector3d y = (m.col(1) - x.dot(m.col(1)) * x).normalized();
  Eigen::Matrix3d r;
  r << x, y, x.cross(y);
  if (!r.allFinite() || m.determinant() == 0) refuse(where, "a joint's transform is flat");
  return Quaterniond(r).normalized();
}

// A joint of the clip: its node, at rest and in motion.
struct Driven {
  std::size_t node = 0;
  int parent = -1;
  Affine3d above = Affine3d::Identity();  // of the root: what stands above it, still
  Quaterniond local;                      // of the node at rest
  Quaterniond global;                     // at rest, in the file's frame
  const GltfTrack* translation = nullptr;
  const GltfTrack* rotation = nullptr;
};

class GltfClip final : public ClipFile {
 public:
  GltfClip(const tinygltf::Model& model, files::Budget& budget, const std::string& name,
           const MotionSpace& space)
      : space_(space), where_(budget.where()) {
    head_.name = name;
    if (model.animations.empty()) refuse(where_, "has no animation");
    read_tracks(model, model.animations[0], budget);
    choose_joints(model);
    choose_times();
  }

  // Turns are told from the rest pose, in space: D = G(t) G(rest)^-1, each beside its parent's.
  void read(std::size_t frame, Vector3d& root, std::span<Quaterniond> rotation) override {
    const double seconds = begin_ + static_cast<double>(frame) * head_.frame_seconds;
    std::vector<Quaterniond> global(joints_.size()), turn(joints_.size());
    for (std::size_t j = 0; j < joints_.size(); ++j) {
      const Driven& joint = joints_[j];
      Quaterniond local = joint.local;
      if (joint.rotation != nullptr) {
        const auto v = joint.rotation->at(seconds);
        local = Quaterniond(v[3], v[0], v[1], v[2]);
      }
      if (joint.parent < 0) {
        global[j] = turn_of(joint.above, where_) * local;
        root = root_rest_;
        if (joint.translation != nullptr) {
          const auto v = joint.translation->at(seconds);
          root = place(joint.above * Vector3d(v[0], v[1], v[2]));
        }
      } else {
        global[j] = global[static_cast<std::size_t>(joint.parent)] * local;
      }
      turn[j] = global[j] * joint.global.conjugate();
      const Quaterniond beside =
          joint.parent < 0 ? Quaterniond::Identity() : turn[static_cast<std::size_t>(joint.parent)];
      rotation[j] = space_.turn(beside.conjugate() * turn[j]).normalized();
    }
  }

 private:
  Vector3d place(const Vector3d& p) const { return space_.unit_mm.value_or(kMetre) * space_.direction(p); }

  void read_tracks(const tinygltf::Model& model, const tinygltf::Animation& animation,
                   files::Budget& budget) {
    for (const tinygltf::AnimationChannel& channel : animation.channels) {
      const bool turns = channel.target_path == "rotation";
      if (!turns && channel.target_path != "translation") continue;
      if (channel.target_node < 0) continue;  // of an extension
      if (static_cast<std::size_t>(channel.target_node) >= model.nodes.size() || channel.sampler < 0 ||
          static_cast<std::size_t>(channel.sampler) >= animation.samplers.size())
        refuse(where_, "an animation's channel names a node or a sampler that is not there");
      auto& tracks = turns ? rotations_ : translations_;
      const auto& sampler = animation.samplers[static_cast<std::size_t>(channel.sampler)];
      if (!tracks.emplace(channel.target_node, read_track(model, sampler, turns ? 4 : 3, budget)).second)
        refuse(where_, "a node is moved twice by one animation");
    }
    if (rotations_.empty()) refuse(where_, "its animation turns nothing");
  }

  void choose_joints(const tinygltf::Model& model) {
    const std::vector<gltf::PlacedNode> nodes = gltf::place_nodes(model, where_);
    std::vector<char> needed(nodes.size(), 0);
    std::set<std::size_t> wanted;
    for (const tinygltf::Skin& skin : model.skins) {
      for (const int joint : skin.joints) wanted.insert(static_cast<std::size_t>(std::max(joint, 0)));
    }
    for (const auto* tracks : {&rotations_, &translations_}) {
      for (const auto& [node, track] : *tracks) wanted.insert(static_cast<std::size_t>(node));
    }
    // Children come behind their parents: backwards, each hands its need up.
    std::vector<int> branches(nodes.size(), 0);
    for (std::size_t i = nodes.size(); i-- > 0;) {
      if (wanted.count(nodes[i].number) != 0) needed[i] = 1;
      if (needed[i] == 0 || nodes[i].parent < 0) continue;
      needed[static_cast<std::size_t>(nodes[i].parent)] = 1;
      ++branches[static_cast<std::size_t>(nodes[i].parent)];
    }
    std::vector<int> row(nodes.size(), -1);
    std::set<std::string> names;
    for (std::size_t i = 0; i < nodes.size(); ++i) {
      if (needed[i] == 0) continue;
      const int number = static_cast<int>(nodes[i].number), up = nodes[i].parent;
      const bool moved = rotations_.count(number) != 0 || translations_.count(number) != 0;
      const bool still_above = up < 0 || row[static_cast<std::size_t>(up)] < 0;
      // What stands still above the first joint is the scene's, not the figure's.
      if (still_above && !moved && branches[i] == 1) continue;
      if (still_above && !joints_.empty())
        refuse(where_, "its joints have two roots", "export one skeleton, its joints under one root");
      row[i] = static_cast<int>(joints_.size());
      Driven joint;
      joint.node = nodes[i].number;
      joint.parent = still_above ? -1 : row[static_cast<std::size_t>(up)];
      if (still_above && up >= 0) joint.above = nodes[static_cast<std::size_t>(up)].global;
      joint.local = turn_of(gltf::local_transform(model.nodes[joint.node], where_), where_);
      joint.global = (joint.parent < 0 ? turn_of(joint.above, where_)
                                       : joints_[static_cast<std::size_t>(joint.parent)].global) *
                     joint.local;
      joint.rotation = track(rotations_, number);
      joint.translation = track(translations_, number);
      std::string name = model.nodes[joint.node].name;
      if (name.empty()) name = "node_" + std::to_string(number);
      if (name.size() > 256 || !names.insert(name).second)
        refuse(where_, "the joint '" + name.substr(0, 40) + "' stands twice", "give each joint its own name");
      const Vector3d at = place(nodes[i].global.translation());
      if (joint.parent < 0) root_rest_ = at;
      rest_.push_back(at);
      head_.joints.push_back(
          {name, joint.parent,
           joint.parent < 0 ? at : Vector3d(at - rest_[static_cast<std::size_t>(joint.parent)])});
      joints_.push_back(joint);
    }
    if (joints_.empty()) refuse(where_, "no node of its scene is moved");
  }

  static const GltfTrack* track(const std::map<int, GltfTrack>& tracks, int node) {
    const auto found = tracks.find(node);
    return found == tracks.end() ? nullptr : &found->second;
  }

  void choose_times() {
    const GltfTrack* most = nullptr;
    double end = 0;
    begin_ = 1e9;
    for (const auto* tracks : {&rotations_, &translations_}) {
      for (const auto& [node, track] : *tracks) {
        if (most == nullptr || track.time.size() > most->time.size()) most = &track;
        begin_ = std::min(begin_, track.time.front());
        end = std::max(end, track.time.back());
      }
    }
    const auto keys = most->time.size();
    head_.frame_seconds = kThirtieth;
    if (keys > 1) {
      const double step = (most->time.back() - most->time.front()) / static_cast<double>(keys - 1);
      bool even = step > 1e-4;
      for (std::size_t i = 0; i < keys; ++i)
        even = even && std::abs(most->time[i] - most->time[0] - static_cast<double>(i) * step) < 0.01 * step;
      if (even) head_.frame_seconds = step;
    }
    const double frames = std::floor((end - begin_) / head_.frame_seconds + 1e-3) + 1;
    if (!(frames < 1e9)) refuse(where_, "its animation is too long");
    frames_ = static_cast<std::size_t>(frames);
  }

  MotionSpace space_;
  std::string where_;
  std::map<int, GltfTrack> rotations_, translations_;
  std::vector<Driven> joints_;
  std::vector<Vector3d> rest_;
  Vector3d root_rest_ = Vector3d::Zero();
  double begin_ = 0;
};

}  // namespace

std::unique_ptr<ClipFile> parse_gltf_clip(std::string_view bytes, const std::filesystem::path& path,
                                          const MotionSpace& space) {
  if (space.unit_mm) check_unit(*space.unit_mm);
  files::Budget budget(bytes.size(), space.limits, path.string());
  const tinygltf::Model model = gltf::parse(bytes, path, budget);
  return std::make_unique<GltfClip>(model, budget, path.stem().string(), space);
}

std::unique_ptr<ClipFile> open_gltf_clip(const std::filesystem::path& path, const MotionSpace& space) {
  return parse_gltf_clip(files::read_text(path, kLargestFile), path, space);
}

}  // namespace ecorche::io
