// SPDX-License-Identifier: Apache-2.0
#include "preprocess/thin/attach.hpp"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <tuple>

#include "preprocess/thin/tree.hpp"

namespace ecorche::thin {
namespace {

using Eigen::Vector3d;
constexpr std::int32_t none = VolumetricSkeleton::none;

bool is_inside(const Mask& mask, const Vector3d& index) {
  std::array<int, 3> v{};
  for (std::size_t a = 0; a < 3; ++a) {
    const double x = std::floor(index[static_cast<Eigen::Index>(a)] + 0.5);
    if (!(x >= 0 && x < mask.grid.size[a])) return false;
    v[a] = static_cast<int>(x);
  }
  return mask.inside[mask.grid.offset(v[0], v[1], v[2])] != 0;
}

Vector3d index_of(const ImageGrid& grid, const Vector3d& point) {
  const auto i = grid.index({point.x(), point.y(), point.z()});
  return {i[0], i[1], i[2]};
}

struct Bone {
  Vector3d from, to;
  std::int32_t segment;
};

std::vector<Bone> bones_of(const Skeleton& rig) {
  std::vector<Bone> bones;
  std::vector<std::uint8_t> has_child(rig.segments.size(), 0);
  for (std::size_t i = 0; i < rig.segments.size(); ++i) {
    const int parent = rig.segments[i].parent;
    if (parent < 0) continue;
    has_child[static_cast<std::size_t>(parent)] = 1;
    bones.push_back(
        {rig.segments[static_cast<std::size_t>(parent)].joint.center, rig.segments[i].joint.center, parent});
  }
  for (std::size_t i = 0; i < rig.segments.size(); ++i) {
    if (has_child[i] == 0)
      bones.push_back({rig.segments[i].joint.center, rig.segments[i].joint.center, static_cast<int>(i)});
  }
  return bones;
}

// The nearest point of a bone; its ends are their own bits, so that bones that meet there are as far.
Vector3d nearest_point(const Bone& bone, const Vector3d& p) {
  const Vector3d along = bone.to - bone.from;
  const double t = (p - bone.from).dot(along), all = along.squaredNorm();
  if (t <= 0) return bone.from;
  if (t >= all) return bone.to;
  return bone.from + t / all * along;
}

// The segment of the nearest bone that `sees(point of the bone)`, or none.
template <class F>
std::int32_t nearest_segment(const std::vector<Bone>& bones, const Vector3d& p, F&& sees) {
  struct Candidate {
    double square;
    std::int32_t segment;
    Vector3d point;
  };
  std::vector<Candidate> all;
  all.reserve(bones.size());
  for (const Bone& bone : bones) {
    const Vector3d point = nearest_point(bone, p);
    all.push_back({(p - point).squaredNorm(), bone.segment, point});
  }
  std::sort(all.begin(), all.end(), [](const Candidate& a, const Candidate& b) {
    return a.square < b.square || (a.square == b.square && a.segment > b.segment);
  });
  for (const Candidate& c : all) {
    if (sees(c.point)) return c.segment;
  }
  return none;
}

// The nearest seed along the tree.
struct Way {
  double mm = std::numeric_limits<double>::infinity();
  std::int32_t seed = std::numeric_limits<std::int32_t>::max();

  bool operator<(const Way& other) const { return std::tie(mm, seed) < std::tie(other.mm, other.seed); }
};

void spread(const VolumetricSkeleton& s, const std::vector<std::int32_t>& order, std::vector<Way>& ways) {
  const auto edge = [&](std::size_t child, std::size_t parent) {
    return (voxel_place(s, child) - voxel_place(s, parent)).norm();
  };
  const auto relax = [&](std::size_t to, std::size_t from, double mm) {
    ways[to] = std::min(ways[to], Way{ways[from].mm + mm, ways[from].seed});
  };
  for (auto it = order.rbegin(); it != order.rend(); ++it) {  // up, children first
    const auto child = static_cast<std::size_t>(*it);
    if (s.parent[child] < 0) continue;
    const auto parent = static_cast<std::size_t>(s.parent[child]);
    if (ways[child].seed != Way().seed) relax(parent, child, edge(child, parent));
  }
  for (const std::int32_t row : order) {  // and down
    const auto child = static_cast<std::size_t>(row);
    if (s.parent[child] < 0) continue;
    const auto parent = static_cast<std::size_t>(s.parent[child]);
    if (ways[parent].seed != Way().seed) relax(child, parent, edge(child, parent));
  }
}

[[noreturn]] void refuse(const std::string& what, const std::string& mend) {
  throw Error(ErrorKind::config, "--reassign", what, mend);
}

std::int32_t segment_row(const Skeleton& rig, const std::string& name) {
  const int row = rig.find_segment(name);
  if (row < 0) refuse("no segment '" + name + "'", "name one of the skeleton");
  return row;
}

struct Plane {
  Vector3d at, normal;
};

Plane split_plane(const Skeleton& rig, int row) {
  const Segment& segment = rig.segments[static_cast<std::size_t>(row)];
  const Vector3d at = segment.joint.center;
  const Vector3d in = at - rig.segments[static_cast<std::size_t>(segment.parent)].joint.center;
  Vector3d out = Vector3d::Zero();
  for (const Segment& child : rig.segments) {
    if (child.parent != row) continue;
    out += child.joint.center - at;
  }
  const auto unit = [](const Vector3d& v) { return v.norm() > 0 ? Vector3d(v.normalized()) : v; };
  const Vector3d normal = unit(in) + unit(out);
  if (!(normal.norm() > 1e-6))
    refuse("the bones at joint '" + segment.joint.name + "' give no plane to split by",
           "use a region instead");
  return {at, normal};
}

bool within(const AttachmentRegion& region, const Vector3d& p) {
  if (region.box) {
    for (std::size_t a = 0; a < 3; ++a) {
      const double x = p[static_cast<Eigen::Index>(a)];
      if (x < (*region.box)[0][a] || x > (*region.box)[1][a]) return false;
    }
    return true;
  }
  const auto& c = *region.center;
  return (p - Vector3d(c[0], c[1], c[2])).norm() <= region.radius;
}

}  // namespace

bool line_inside(const Mask& mask, const Vector3d& from, const Vector3d& to) {
  const Vector3d a = index_of(mask.grid, from), way = index_of(mask.grid, to) - a;
  const int steps = std::max(1, static_cast<int>(std::ceil(2 * way.norm())));
  for (int s = 1; s <= steps; ++s) {
    if (!is_inside(mask, a + static_cast<double>(s) / steps * way)) return false;
  }
  return true;
}

Vector3d voxel_place(const VolumetricSkeleton& s, std::size_t row) {
  const auto& v = s.voxel[row];
  const auto p = s.grid.point(v[0], v[1], v[2]);
  return {p[0], p[1], p[2]};
}

std::size_t nearest_voxel(const VolumetricSkeleton& skeleton, const Vector3d& to) {
  double best = std::numeric_limits<double>::infinity();
  std::size_t out = 0;
  for (std::size_t r = 0; r < skeleton.size(); ++r) {
    const double square = (voxel_place(skeleton, r) - to).squaredNorm();
    if (square < best) best = square, out = r;
  }
  return out;
}

std::vector<Snapped> snap_joints(const VolumetricSkeleton& skeleton, Skeleton& rig) {
  std::vector<Snapped> moved;
  if (skeleton.size() == 0) return moved;
  for (Segment& segment : rig.segments) {
    Vector3d& center = segment.joint.center;
    const Vector3d to = voxel_place(skeleton, nearest_voxel(skeleton, center));
    moved.push_back({segment.joint.name, (to - center).norm()});
    center = to;
  }
  return moved;
}

std::vector<std::string> joints_outside(const Mask& mask, const Skeleton& rig) {
  std::vector<std::string> out;
  for (const Segment& segment : rig.segments) {
    if (!is_inside(mask, index_of(mask.grid, segment.joint.center))) out.push_back(segment.joint.name);
  }
  return out;
}

Attachment attach(const VolumetricSkeleton& s, const Mask& mask, const Skeleton& rig,
                  const Context& context) {
  if (s.parent.size() != s.size() || s.grid != mask.grid || rig.segments.empty() ||
      rig.segments.size() > 65535)
    throw Error(ErrorKind::internal, "attach", "no tree, another mask, or no segment", "report this");
  const std::vector<Bone> bones = bones_of(rig);
  Attachment out;
  out.segment.assign(s.size(), none);
  tbb::parallel_for(std::size_t{0}, s.size(), [&](std::size_t r) {
    if (context.stop.stop_requested()) return;
    const Vector3d p = voxel_place(s, r);
    out.segment[r] = nearest_segment(bones, p, [&](const Vector3d& to) { return line_inside(mask, p, to); });
  });
  context.check_stop();
  out.near = s.size() - static_cast<std::size_t>(std::count(out.segment.begin(), out.segment.end(), none));

  const std::vector<std::int32_t> order = parents_first(s.parent);
  std::vector<Way> ways(s.size());
  for (std::size_t r = 0; r < s.size(); ++r) {
    if (out.segment[r] != none) ways[r] = {0, static_cast<std::int32_t>(r)};
  }
  spread(s, order, ways);
  for (std::size_t r = 0; r < s.size(); ++r) {
    if (s.parent[r] >= 0 || ways[r].seed != Way().seed) continue;
    ++out.far_components;
    ways[r] = {0, static_cast<std::int32_t>(r)};
    out.segment[r] = nearest_segment(bones, voxel_place(s, r), [](const Vector3d&) { return true; });
  }
  if (out.far_components > 0) spread(s, order, ways);
  for (std::size_t r = 0; r < s.size(); ++r)
    out.segment[r] = out.segment[static_cast<std::size_t>(ways[r].seed)];
  return out;
}

std::size_t reassign(const VolumetricSkeleton& s, const Skeleton& rig, const Reassignment& by_hand,
                     std::vector<std::int32_t>& segment) {
  const std::vector<std::int32_t> before = segment;
  for (const AttachmentSplit& split : by_hand.splits) {
    const int row = rig.find_joint(split.joint);
    if (row < 0) refuse("no joint '" + split.joint + "'", "name one of the skeleton");
    const int parent = rig.segments[static_cast<std::size_t>(row)].parent;
    if (parent < 0)
      refuse("joint '" + split.joint + "' is the root's", "split at a joint between two segments");
    const Plane plane = split_plane(rig, row);
    for (std::size_t r = 0; r < s.size(); ++r) {
      const Vector3d way = voxel_place(s, r) - plane.at;
      if ((segment[r] != row && segment[r] != parent) || way.norm() > split.within_mm) continue;
      segment[r] = way.dot(plane.normal) > 0 ? row : parent;
    }
  }
  for (const AttachmentRegion& region : by_hand.regions) {
    const std::int32_t to = segment_row(rig, region.segment);
    const std::int32_t from = region.from.empty() ? none : segment_row(rig, region.from);
    for (std::size_t r = 0; r < s.size(); ++r) {
      if ((region.from.empty() || segment[r] == from) && within(region, voxel_place(s, r))) segment[r] = to;
    }
  }
  std::size_t changed = 0;
  for (std::size_t r = 0; r < segment.size(); ++r) changed += segment[r] != before[r] ? 1 : 0;
  return changed;
}

}  // namespace ecorche::thin
