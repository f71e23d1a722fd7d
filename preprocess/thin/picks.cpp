// SPDX-License-Identifier: Apache-2.0
#include "preprocess/thin/picks.hpp"

#include <algorithm>
#include <cstdio>
#include <limits>

#include "core/values/error.hpp"
#include "preprocess/thin/tree.hpp"

namespace ecorche::thin {
namespace {

using Eigen::Vector3d;

constexpr std::size_t kNone = std::numeric_limits<std::size_t>::max();

[[noreturn]] void bad(const Pick& pick, const std::string& what, const std::string& mend) {
  throw Error(ErrorKind::config, "pick '" + pick.name + "'", what, mend);
}

// Named, and no two alike.
std::vector<Pick> named(std::vector<Pick> picks) {
  if (picks.empty()) throw Error(ErrorKind::config, "picks", "there are none", "give a line for each joint");
  for (std::size_t p = 0; p < picks.size(); ++p) {
    char name[32] = "";
    std::snprintf(name, sizeof name, "joint_%02zu", p + 1);
    if (picks[p].name.empty()) picks[p].name = name;
  }
  for (auto pick = picks.begin(); pick != picks.end(); ++pick) {
    if (std::any_of(picks.begin(), pick, [&](const Pick& other) { return other.name == pick->name; }))
      bad(*pick, "two have this name", "name every joint differently");
  }
  return picks;
}

// Row of the skeletal voxel nearest to each.
std::vector<std::size_t> voxels_of(const VolumetricSkeleton& skeleton, const std::vector<Pick>& picks) {
  std::vector<std::size_t> out;
  for (const Pick& pick : picks) {
    out.push_back(nearest_voxel(skeleton, pick.at));
    const auto same = std::find(out.begin(), out.end() - 1, out.back());
    if (same != out.end() - 1)
      bad(pick,
          "its nearest skeletal voxel is also that of '" +
              picks[static_cast<std::size_t>(same - out.begin())].name + "'",
          "pick farther apart, or thin less");
  }
  return out;
}

// Of every voxel the next one towards `root` along the tree, and how far that way is, mm; none where no way
// leads there.
struct Ways {
  std::vector<std::size_t> next;
  std::vector<double> far;
};

Ways ways_to(const VolumetricSkeleton& skeleton, std::size_t root) {
  std::vector<std::vector<std::size_t>> beside(skeleton.size());
  for (std::size_t v = 0; v < skeleton.size(); ++v) {
    if (skeleton.parent[v] < 0) continue;
    const auto up = static_cast<std::size_t>(skeleton.parent[v]);
    beside[v].push_back(up);
    beside[up].push_back(v);
  }
  Ways out{std::vector<std::size_t>(skeleton.size(), kNone), std::vector<double>(skeleton.size(), 0)};
  std::vector<std::size_t> open{root};
  while (!open.empty()) {
    const std::size_t at = open.back();
    open.pop_back();
    for (const std::size_t v : beside[at]) {
      if (v == out.next[at]) continue;
      out.next[v] = at;
      out.far[v] = out.far[at] + (voxel_place(skeleton, v) - voxel_place(skeleton, at)).norm();
      open.push_back(v);
    }
  }
  return out;
}

// The body's radius at every pick, mm: of the largest ball that holds its voxel.
std::vector<double> radii_at(const VolumetricSkeleton& skeleton, const std::vector<std::size_t>& voxel) {
  std::vector<double> out(voxel.size(), 0);
  for (std::size_t v = 0; v < skeleton.size(); ++v) {
    const double radius = length(skeleton.metric, skeleton.distance[v]) * skeleton.grid.spacing[0];
    const Vector3d at = voxel_place(skeleton, v);
    for (std::size_t p = 0; p < voxel.size(); ++p) {
      if (radius > out[p] && (voxel_place(skeleton, voxel[p]) - at).norm() < radius) out[p] = radius;
    }
  }
  return out;
}

// Near which pick does the way from p to the first one lead first, of those that are nearer to the first?
// Near is within the body's radius there; near several at once, the one that is nearer to p along the tree.
std::size_t next_on_the_way(const VolumetricSkeleton& skeleton, const Ways& ways,
                            const std::vector<std::size_t>& voxel, const std::vector<double>& radius,
                            std::size_t p) {
  for (std::size_t at = voxel[p]; at != kNone; at = ways.next[at]) {
    std::size_t met = kNone;
    for (std::size_t q = 0; q < voxel.size(); ++q) {
      if (q == p || !(ways.far[voxel[q]] < ways.far[voxel[p]])) continue;
      if (q > 0 && ways.next[voxel[q]] == kNone) continue;  // of another component
      const double far = (voxel_place(skeleton, at) - voxel_place(skeleton, voxel[q])).norm();
      if (far >= radius[q]) continue;
      if (met == kNone || ways.far[voxel[q]] > ways.far[voxel[met]]) met = q;
    }
    if (met != kNone) return met;
  }
  return kNone;
}

// Row of every pick's parent; the first has none.
std::vector<std::size_t> parents_of(const VolumetricSkeleton& skeleton, const std::vector<Pick>& picks,
                                    const std::vector<std::size_t>& voxel) {
  if (!picks[0].parent.empty())
    bad(picks[0], "the first is the root, and has a parent", "leave its parent out");
  const Ways ways = ways_to(skeleton, voxel[0]);
  const std::vector<double> radius = radii_at(skeleton, voxel);
  std::vector<std::size_t> out{kNone};
  for (std::size_t p = 1; p < picks.size(); ++p) {
    if (!picks[p].parent.empty()) {
      const auto found = std::find_if(picks.begin(), picks.end(),
                                      [&](const Pick& other) { return other.name == picks[p].parent; });
      if (found == picks.end())
        bad(picks[p], "its parent '" + picks[p].parent + "' is no pick", "correct the name");
      out.push_back(static_cast<std::size_t>(found - picks.begin()));
      continue;
    }
    if (ways.next[voxel[p]] == kNone)
      bad(picks[p], "the skeleton tree does not join it to '" + picks[0].name + "'",
          "join the tree's components by --connect, or name its parent");
    out.push_back(next_on_the_way(skeleton, ways, voxel, radius, p));
  }
  return out;
}

// Rows of the picks, parents first, else in their order.
std::vector<std::size_t> parents_first(const std::vector<Pick>& picks,
                                       const std::vector<std::size_t>& parent) {
  std::vector<std::size_t> order, place(picks.size(), kNone);
  while (order.size() < picks.size()) {
    const std::size_t before = order.size();
    for (std::size_t p = 0; p < picks.size(); ++p) {
      if (place[p] != kNone || (parent[p] != kNone && place[parent[p]] == kNone)) continue;
      place[p] = order.size();
      order.push_back(p);
    }
    if (order.size() > before) continue;
    const auto left = static_cast<std::size_t>(std::find(place.begin(), place.end(), kNone) - place.begin());
    bad(picks[left], "its parents lead back to itself", "let every one lead to the first pick");
  }
  return order;
}

Joint joint_of(const Pick& pick, bool root) {
  Joint joint;
  joint.name = pick.name;
  joint.kind = root ? JointKind::free : JointKind::ball;
  joint.center = pick.at;
  for (int axis = 0; axis < 3; ++axis) {
    AngleAxis angle;
    angle.name = std::string(1, "xyz"[axis]);
    angle.axis = axis;
    joint.sequence.push_back(angle);
  }
  return joint;
}

}  // namespace

Skeleton skeleton_of_picks(const VolumetricSkeleton& skeleton, const std::vector<Pick>& by_hand,
                           std::vector<Snapped>& moved) {
  if (skeleton.parent.size() != skeleton.size())
    throw Error(ErrorKind::internal, "picks", "the volumetric skeleton has no tree", "report this");
  std::vector<Pick> picks = named(by_hand);
  const std::vector<std::size_t> voxel = voxels_of(skeleton, picks);
  const std::vector<std::size_t> parent = parents_of(skeleton, picks, voxel);
  const std::vector<std::size_t> order = parents_first(picks, parent);
  Skeleton out;
  out.name = "picked";
  moved.clear();
  for (const std::size_t p : order) {
    const Vector3d to = voxel_place(skeleton, voxel[p]);
    moved.push_back({picks[p].name, (to - picks[p].at).norm()});
    picks[p].at = to;
    Segment segment;
    segment.name = picks[p].name;
    if (parent[p] != kNone) segment.parent = out.find_segment(picks[parent[p]].name);
    segment.joint = joint_of(picks[p], parent[p] == kNone);
    out.segments.push_back(std::move(segment));
  }
  return out;
}

}  // namespace ecorche::thin
