// SPDX-License-Identifier: Apache-2.0
#include "preprocess/thin/picks.hpp"

#include <algorithm>
#include <cstdio>
#include <limits>

#include <ecorche/values/error.hpp>
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

// How near two picks are: a straight line within the body, or else the way along the tree, which is behind
// every line.
struct Link {
  bool seen = false;
  double far = std::numeric_limits<double>::infinity();

  bool operator<(const Link& other) const { return seen != other.seen ? seen : far < other.far; }
};

// Row of the pick that p names as its parent, or none.
std::size_t named_parent(const std::vector<Pick>& picks, std::size_t p) {
  if (picks[p].parent.empty()) return kNone;
  const auto found = std::find_if(picks.begin(), picks.end(),
                                  [&](const Pick& other) { return other.name == picks[p].parent; });
  if (found == picks.end())
    bad(picks[p], "its parent '" + picks[p].parent + "' is no pick", "correct the name");
  return static_cast<std::size_t>(found - picks.begin());
}

// Row of every pick's parent; the first has none. The tree grows from the first by the shortest link to any
// that is in it (Prim); who names a parent waits for it. Picks in a ring of names keep the names.
std::vector<std::size_t> parents_of(const VolumetricSkeleton& skeleton, const Mask& mask,
                                    const std::vector<Pick>& picks, const std::vector<std::size_t>& voxel) {
  if (!picks[0].parent.empty())
    bad(picks[0], "the first is the root, and has a parent", "leave its parent out");
  const std::size_t count = picks.size();
  std::vector<Ways> ways;
  std::vector<std::size_t> named, parent(count, kNone);
  for (std::size_t p = 0; p < count; ++p) {
    ways.push_back(ways_to(skeleton, voxel[p]));
    named.push_back(named_parent(picks, p));
    if (p > 0 && named[p] == kNone && ways[0].next[voxel[p]] == kNone)
      bad(picks[p], "the skeleton tree does not join it to '" + picks[0].name + "'",
          "join the tree's components by --connect, or name its parent");
  }
  const auto link = [&](std::size_t p, std::size_t q) -> Link {
    const Vector3d from = voxel_place(skeleton, voxel[p]), to = voxel_place(skeleton, voxel[q]);
    if (line_inside(mask, from, to)) return {true, (to - from).norm()};
    if (ways[q].next[voxel[p]] != kNone) return {false, ways[q].far[voxel[p]]};
    return {};
  };
  std::vector<std::uint8_t> joined(count, 0);
  joined[0] = 1;
  for (;;) {
    Link shortest;
    std::size_t next = kNone, to = kNone;
    for (std::size_t p = 1; p < count; ++p) {
      if (joined[p] != 0) continue;
      for (std::size_t q = 0; q < count; ++q) {
        if (joined[q] == 0 || (named[p] != kNone && named[p] != q)) continue;
        const Link found = named[p] == q ? Link{true, 0} : link(p, q);
        if (next != kNone && !(found < shortest)) continue;
        shortest = found;
        next = p;
        to = q;
      }
    }
    if (next == kNone) break;
    joined[next] = 1;
    parent[next] = to;
  }
  for (std::size_t p = 1; p < count; ++p) {
    if (joined[p] == 0) parent[p] = named[p];
  }
  return parent;
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

Skeleton skeleton_of_picks(const VolumetricSkeleton& skeleton, const Mask& mask,
                           const std::vector<Pick>& by_hand, std::vector<Snapped>& moved) {
  if (skeleton.parent.size() != skeleton.size())
    throw Error(ErrorKind::internal, "picks", "the volumetric skeleton has no tree", "report this");
  std::vector<Pick> picks = named(by_hand);
  const std::vector<std::size_t> voxel = voxels_of(skeleton, picks);
  const std::vector<std::size_t> parent = parents_of(skeleton, mask, picks, voxel);
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
