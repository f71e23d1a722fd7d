// SPDX-License-Identifier: Apache-2.0
#include "preprocess/scan/part_joints.hpp"

#include <algorithm>
#include <cmath>

#include "preprocess/parting/minimum_cut.hpp"
#include "preprocess/scan/cut_bones.hpp"
#include "preprocess/scan/views.hpp"

namespace ecorche::scan {
namespace {

constexpr double kBandMm = 45,
                 kBandOfLength = 0.15;  // mm, and of the longer segment: from the joint, along the limb
constexpr double kNearJoint = 25;       // mm: so far off a face counts twice
constexpr double kLongAndThin = 0.2;    // of its length: what a long segment lies off its line
constexpr double kMuchLess = 0.75;      // of the bone that the border crossed before
// What wraps its joint: an olecranon reaches up behind it, malleoli down beside it. There the least cut is no
// plane, and may go through a bone.
bool wraps_joint(const std::string& segment) {
  return segment == "forearm" || segment == "foot";
}
constexpr double kMarrowMm2 = 4000;
constexpr double kHeldWhole = 1e5;

// A joint behind a long segment.
struct LimbJoint {
  std::size_t parent = 0, child = 0;
  Eigen::Vector3d at, along;
  double band = 0;
};

std::vector<LimbJoint> limb_joints(const BodyTemplate& body, const std::vector<SegmentCloud>& clouds,
                                   const Placed& placed) {
  std::vector<LimbJoint> out;
  for (std::size_t s = 0; s < clouds.size(); ++s) {
    const TemplateSegment& child = body.segments[s];
    if (child.parent < 0 || !clouds[s].nearest) continue;
    const auto p = static_cast<std::size_t>(child.parent);
    const TemplateSegment& parent = body.segments[p];
    const std::string name = without_side(child.name);
    if (!clouds[p].nearest || name == child.name || wraps_joint(name) ||
        without_side(parent.name) == parent.name)
      continue;
    const Eigen::Vector3d line = child.joint - parent.joint;
    const double length = line.norm();
    if (length <= 0) continue;
    double square = 0;
    for (Eigen::Index r = 0; r < clouds[p].points.rows(); ++r)
      square += (clouds[p].points.row(r).transpose() - parent.joint).cross(line / length).squaredNorm();
    if (std::sqrt(square / static_cast<double>(clouds[p].points.rows())) > kLongAndThin * length) continue;
    LimbJoint joint;
    joint.parent = p;
    joint.child = s;
    joint.at = (placed.segments[p](child.joint) + placed.segments[s](child.joint)) / 2;
    joint.along = (joint.at - placed.segments[p](parent.joint)).normalized();
    joint.band = std::min(kBandMm, kBandOfLength * placed.segments[p].scale * length);
    out.push_back(joint);
  }
  return out;
}

class JointParter {
 public:
  JointParter(const BodyTemplate& body, const std::vector<SegmentCloud>& clouds, const Placed& placed,
              const ImageGrid& grid, std::vector<std::uint16_t>& of)
      : body_(body), clouds_(clouds), placed_(placed), grid_(grid), of_(of) {
    for (std::size_t a = 0; a < 3; ++a) area_[a] = grid.spacing[(a + 1) % 3] * grid.spacing[(a + 2) % 3];
  }

  void part(const LimbJoint& joint) {
    if (!find_box(joint)) return;
    fill();
    const std::vector<std::uint8_t> upper = cut(joint);
    if (upper.empty()) return;
    give(joint, upper);
  }

 private:
  int side_of(std::uint16_t id, const LimbJoint& joint) const {
    if (id == 0) return 0;
    const auto s = static_cast<std::size_t>(body_.bones[id - 1U].segment);
    return s == joint.parent ? 1 : s == joint.child ? 2 : 0;
  }
  double along(const LimbJoint& joint, int i, int j, int k) const {
    const auto p = grid_.point(i, j, k);
    return joint.along.dot(Eigen::Vector3d(p[0], p[1], p[2]) - joint.at);
  }
  // Bones that end within the band on both sides hang on nothing beyond: they stay whose they are.
  bool crosses(std::uint16_t id, const LimbJoint& joint) const {
    const TemplateBone& bone = body_.bones[id - 1U];
    const Similarity& place = placed_.segments[static_cast<std::size_t>(bone.segment)];
    for (Eigen::Index r = 0; r < bone.points.rows(); ++r) {
      if (std::abs(joint.along.dot(place(bone.points.row(r).transpose()) - joint.at)) > joint.band)
        return true;
    }
    return false;
  }

  template <class F>
  void each(F&& f) const {
    std::size_t n = 0;
    for (int k = 0; k < box_.size[2]; ++k) {
      for (int j = 0; j < box_.size[1]; ++j) {
        for (int i = 0; i < box_.size[0]; ++i, ++n) f(n, low_[0] + i, low_[1] + j, low_[2] + k);
      }
    }
  }

  bool find_box(const LimbJoint& joint) {
    std::vector<std::uint8_t> takes(body_.bones.size() + 1, 0);
    for (std::size_t b = 0; b < body_.bones.size(); ++b) {
      const auto id = static_cast<std::uint16_t>(b + 1);
      takes[id] = side_of(id, joint) != 0 && crosses(id, joint) ? 1 : 0;
    }
    low_ = grid_.size;
    std::array<std::int32_t, 3> high{-1, -1, -1};
    std::size_t v = 0;
    for (int k = 0; k < grid_.size[2]; ++k) {
      for (int j = 0; j < grid_.size[1]; ++j) {
        for (int i = 0; i < grid_.size[0]; ++i, ++v) {
          if (of_[v] == 0 || takes[of_[v]] == 0 || std::abs(along(joint, i, j, k)) > joint.band) continue;
          const std::array<std::int32_t, 3> at{i, j, k};
          for (std::size_t a = 0; a < 3; ++a) {
            low_[a] = std::min(low_[a], at[a]);
            high[a] = std::max(high[a], at[a]);
          }
        }
      }
    }
    box_ = grid_;
    for (std::size_t a = 0; a < 3; ++a) box_.size[a] = high[a] - low_[a] + 1;
    if (high[0] < 0) return false;
    solid_.assign(box_.voxels(), 0);
    each([&](std::size_t n, int i, int j, int k) {
      const std::uint16_t id = of_[grid_.offset(i, j, k)];
      if (id != 0 && takes[id] != 0 && std::abs(along(joint, i, j, k)) <= joint.band) solid_[n] = 1;
    });
    return true;
  }

  // Marrow counts as bone: else a cut through a shaft costs as little as its shell.
  void fill() { fill_hollows(solid_, box_, {kMarrowMm2}); }

  std::vector<std::uint8_t> cut(const LimbJoint& joint) const {
    std::vector<std::int32_t> node(solid_.size(), -1);
    std::int32_t count = 0;
    for (std::size_t n = 0; n < node.size(); ++n) {
      if (solid_[n] != 0) node[n] = count++;
    }
    parting::CutGraph graph(count);
    const double edge = *std::max_element(grid_.spacing.begin(), grid_.spacing.end());
    std::array<std::size_t, 3> stride{1, static_cast<std::size_t>(box_.size[0]), 0};
    stride[2] = stride[1] * static_cast<std::size_t>(box_.size[1]);
    std::array<bool, 2> held{false, false};
    double before = 0;
    const auto faces = [&](auto&& f) {
      each([&](std::size_t n, int i, int j, int k) {
        if (node[n] < 0) return;
        const std::array<int, 3> at{i - low_[0], j - low_[1], k - low_[2]};
        for (std::size_t a = 0; a < 3; ++a) {
          if (at[a] + 1 >= box_.size[a] || node[n + stride[a]] < 0) continue;
          const double off = along(joint, i, j, k) / kNearJoint;
          f(n, n + stride[a], area_[a] * (1 + off * off));
        }
      });
    };
    faces([&](std::size_t a, std::size_t b, double cost) { graph.tie(node[a], node[b], cost); });
    std::vector<int> side(solid_.size(), 0);
    each([&](std::size_t n, int i, int j, int k) {
      side[n] = side_of(of_[grid_.offset(i, j, k)], joint);
      if (node[n] < 0) return;
      const double off = along(joint, i, j, k);
      if (std::abs(off) < joint.band - edge) return;
      held[off < 0 ? 0 : 1] = true;
      if (off < 0)
        graph.hold_inside(node[n], kHeldWhole);
      else
        graph.hold_outside(node[n], kHeldWhole);
    });
    if (!held[0] || !held[1]) return {};
    const std::vector<std::uint8_t> inside = graph.inside();
    double after = 0;
    faces([&](std::size_t a, std::size_t b, double cost) {
      if (side[a] == 0 || side[b] == 0) return;
      before += side[a] != side[b] ? cost : 0;
      after +=
          inside[static_cast<std::size_t>(node[a])] != inside[static_cast<std::size_t>(node[b])] ? cost : 0;
    });
    if (after >= kMuchLess * before) return {};
    std::vector<std::uint8_t> out(solid_.size(), 0);
    for (std::size_t n = 0; n < out.size(); ++n) {
      if (node[n] >= 0) out[n] = inside[static_cast<std::size_t>(node[n])] != 0 ? 1 : 2;
    }
    return out;
  }

  void give(const LimbJoint& joint, const std::vector<std::uint8_t>& to) {
    each([&](std::size_t n, int i, int j, int k) {
      std::uint16_t& id = of_[grid_.offset(i, j, k)];
      const int side = side_of(id, joint);
      if (to[n] == 0 || side == 0 || side == to[n]) return;
      const std::size_t s = to[n] == 1 ? joint.parent : joint.child;
      const auto p = grid_.point(i, j, k);
      double square = 0;
      const std::int32_t point =
          clouds_[s].nearest->find(placed_.segments[s].back({p[0], p[1], p[2]}), square);
      id = static_cast<std::uint16_t>(clouds_[s].bone[static_cast<std::size_t>(point)] + 1);
    });
  }

  const BodyTemplate& body_;
  const std::vector<SegmentCloud>& clouds_;
  const Placed& placed_;
  const ImageGrid& grid_;
  std::vector<std::uint16_t>& of_;
  std::array<double, 3> area_{};
  // The band about a joint, as an image of its own.
  std::array<std::int32_t, 3> low_{};
  ImageGrid box_;
  std::vector<std::uint16_t> solid_;
};

}  // namespace

void part_joints(const BodyTemplate& body, const std::vector<SegmentCloud>& clouds, const Placed& placed,
                 const ImageGrid& grid, std::vector<std::uint16_t>& of, const Context& context) {
  JointParter parter(body, clouds, placed, grid, of);
  for (const LimbJoint& joint : limb_joints(body, clouds, placed)) {
    context.check_stop();
    parter.part(joint);
  }
}

}  // namespace ecorche::scan
