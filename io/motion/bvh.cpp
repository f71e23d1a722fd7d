// SPDX-License-Identifier: Apache-2.0
#include "io/motion/bvh.hpp"

#include <charconv>
#include <cmath>
#include <numbers>

#include <ecorche/values/error.hpp>
#include "core/files/atomic_file.hpp"
#include "io/motion/bvh_parser.hpp"
#include "io/motion/frame_rows.hpp"

namespace ecorche::io {
namespace {

using bvh::Channel;
using Eigen::Quaterniond;
using Eigen::Vector3d;

constexpr double kCentimetre = 10;
constexpr double kDegree = std::numbers::pi / 180;

// From LPS to the file's frame, x Left, y Superior, z Anterior: a quarter turn about x.
Vector3d to_lsa(const Vector3d& v) {
  return {v.x(), v.z(), -v.y()};
}
Quaterniond to_lsa(const Quaterniond& q) {
  return {q.w(), q.x(), q.z(), -q.y()};
}

// The turns and the way of one joint in one frame: turns multiply in the order of their channels.
struct Motion {
  Quaterniond rotation = Quaterniond::Identity();
  Vector3d position;
};

Motion read_motion(const bvh::FileJoint& joint, const double* values) {
  Motion motion;
  motion.position = Vector3d(joint.offset[0], joint.offset[1], joint.offset[2]);
  for (std::size_t c = 0; c < joint.channels.size(); ++c) {
    const auto channel = static_cast<int>(joint.channels[c]);
    const int axis = channel % 3;
    if (channel < static_cast<int>(Channel::x_rotation)) {
      motion.position[axis] = values[c];
    } else {
      motion.rotation =
          motion.rotation * Quaterniond(Eigen::AngleAxisd(values[c] * kDegree, Vector3d::Unit(axis)));
    }
  }
  motion.rotation.normalize();
  return motion;
}

// Angles about z, x, y, degrees, of q = q(z) q(x) q(y). Where x is a quarter turn, y is 0.
Vector3d zxy_degrees(const Quaterniond& q) {
  const Eigen::Matrix3d r = q.normalized().toRotationMatrix();
  const double cosine = std::hypot(r(2, 0), r(2, 2));
  const double x = std::atan2(r(2, 1), cosine);
  const bool locked = cosine < 1e-9;
  const double z = locked ? std::atan2(r(1, 0), r(0, 0)) : std::atan2(-r(0, 1), r(1, 1));
  const double y = locked ? 0 : std::atan2(-r(2, 0), r(2, 2));
  return Vector3d(z, x, y) / kDegree;
}

void append(std::string& out, double value) {
  char text[400];
  out += ' ';
  out.append(text, std::to_chars(text, text + sizeof text, value, std::chars_format::fixed, 7).ptr);
}

void append(std::string& out, const Vector3d& v) {
  for (int k = 0; k < 3; ++k) append(out, v[k] == 0 ? 0 : v[k]);  // no -0
}

class Writer {
 public:
  Writer(const Clip& clip, double unit_mm) : clip_(clip), unit_mm_(unit_mm), children_(clip.joints.size()) {
    for (std::size_t j = 1; j < clip.joints.size(); ++j) {
      children_.at(static_cast<std::size_t>(clip.joints[j].parent)).push_back(j);
    }
  }

  std::string write() {
    out_ = "HIERARCHY\n";
    joint(0, "");
    out_ += "MOTION\nFrames: " + std::to_string(clip_.frames()) + "\nFrame Time:";
    append(out_, clip_.frame_seconds);
    out_ += '\n';
    for (std::size_t frame = 0; frame < clip_.frames(); ++frame) {
      append(out_, to_lsa(clip_.root_position[frame]) / unit_mm_);
      for (const std::size_t j : order_)
        append(out_, zxy_degrees(to_lsa(clip_.rotation[frame * clip_.joints.size() + j])));
      out_ += '\n';
    }
    return std::move(out_);
  }

 private:
  // Depth first, as the values of a frame are ordered; joints nest a few dozen deep at most.
  void joint(std::size_t j, const std::string& indent) {
    order_.push_back(j);
    const ClipJoint& at = clip_.joints[j];
    out_ += indent + (j == 0 ? "ROOT " : "JOINT ") + at.name + "\n" + indent + "{\n" + indent + "  OFFSET";
    append(out_, to_lsa(at.offset) / unit_mm_);
    out_ += "\n" + indent + "  CHANNELS " + (j == 0 ? "6 Xposition Yposition Zposition" : "3") +
            " Zrotation Xrotation Yrotation\n";
    for (const std::size_t child : children_[j]) joint(child, indent + "  ");
    if (children_[j].empty()) {
      out_ += indent + "  End Site\n" + indent + "  {\n" + indent + "    OFFSET";
      append(out_, to_lsa(tip(at)) / unit_mm_);
      out_ += "\n" + indent + "  }\n";
    }
    out_ += indent + "}\n";
  }

  // Where a limb's last bone is drawn to: programs refuse, or warn of, one without length.
  static Vector3d tip(const ClipJoint& joint) {
    return joint.parent >= 0 && joint.offset.norm() > 1 ? Vector3d(joint.offset / 2) : Vector3d(0, 0, 50);
  }

  const Clip& clip_;
  double unit_mm_;
  std::vector<std::vector<std::size_t>> children_;
  std::vector<std::size_t> order_;
  std::string out_;
};

void check_clip(const Clip& clip, const std::filesystem::path& path) {
  bool whole =
      !clip.joints.empty() && clip.rotation.size() == clip.frames() * clip.joints.size() && clip.frames() > 0;
  for (std::size_t j = 0; whole && j < clip.joints.size(); ++j) {
    whole = j == 0 ? clip.joints[j].parent == -1
                   : clip.joints[j].parent >= 0 && clip.joints[j].parent < static_cast<int>(j);
  }
  if (!whole)
    throw Error(ErrorKind::internal, path.string(), "the clip's joints and frames do not fit together",
                "report this");
}

class BvhFile final : public ClipFile {
 public:
  BvhFile(TextStream stream, const std::string& name, const MotionSpace& space)
      : space_(space), header_(bvh::read_header(stream)), rows_(rows(std::move(stream))) {
    head_.name = name;
    head_.frame_seconds = header_.frame_seconds;
    for (const bvh::FileJoint& joint : header_.joints) {
      const Vector3d offset(joint.offset[0], joint.offset[1], joint.offset[2]);
      head_.joints.push_back({joint.name, joint.parent, unit() * space_.direction(offset)});
    }
    frames_ = rows_.frames();
  }

  void read(std::size_t frame, Vector3d& root, std::span<Quaterniond> rotation) override {
    const double* values = rows_.row(frame).data();
    for (std::size_t j = 0; j < header_.joints.size(); ++j) {
      const Motion motion = read_motion(header_.joints[j], values);
      if (j == 0) root = unit() * space_.direction(motion.position);
      rotation[j] = space_.turn(motion.rotation);
      values += header_.joints[j].channels.size();
    }
  }

 private:
  double unit() const { return space_.unit_mm.value_or(kCentimetre); }
  FrameRows rows(TextStream stream) {
    return {std::move(stream), header_.channels,
            [this](TextStream& in, std::size_t frame, std::span<double> values) {
              return bvh::read_frame(in, header_, frame, values);
            }};
  }

  MotionSpace space_;
  bvh::Header header_;
  FrameRows rows_;
};

}  // namespace

std::unique_ptr<ClipFile> open_bvh(TextStream stream, const std::string& name, const MotionSpace& space) {
  check_unit(space.unit_mm.value_or(kCentimetre));
  return std::make_unique<BvhFile>(std::move(stream), name, space);
}

std::unique_ptr<ClipFile> open_bvh(const std::filesystem::path& path, const MotionSpace& space) {
  check_unit(space.unit_mm.value_or(kCentimetre));
  return open_bvh(TextStream::open(path), path.stem().string(), space);
}

Clip read_bvh(const std::filesystem::path& path, double unit_mm) {
  MotionSpace space;
  space.unit_mm = unit_mm;
  return read_whole(*open_bvh(path, space));
}

void write_bvh(const std::filesystem::path& path, const Clip& clip, double unit_mm) {
  check_unit(unit_mm);
  check_clip(clip, path);
  files::write_text(path, Writer(clip, unit_mm).write());
}

}  // namespace ecorche::io
