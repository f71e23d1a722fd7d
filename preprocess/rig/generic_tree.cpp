// SPDX-License-Identifier: Apache-2.0
#include "preprocess/rig/generic_tree.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "core/geometry/face_tree.hpp"
#include "preprocess/rig/bone_points.hpp"

namespace ecorche::rig {
namespace {

constexpr Eigen::Index kProbes = 400;   // vertices of a segment whose distance is measured
constexpr std::size_t kNeighbours = 8;  // by their boxes, of each segment

struct Part {
  std::string name;
  const SurfaceMesh* surface;
  Eigen::AlignedBox3d box;
};

struct Edge {
  double gap;
  std::size_t a, b;
};

std::vector<Part> parts_of(const Case& patient, BonePoints& bones) {
  std::vector<Part> parts;
  for (const CaseBone& bone : patient.bones) {
    const bool known =
        std::any_of(parts.begin(), parts.end(), [&](const Part& p) { return p.name == bone.segment; });
    if (known) continue;
    Part part{bone.segment, &bones.segment(bone.segment), {}};
    for (Eigen::Index v = 0; v < part.surface->V.rows(); ++v)
      part.box.extend(Eigen::Vector3d(part.surface->V.row(v).transpose()));
    parts.push_back(std::move(part));
  }
  return parts;
}

// Least distance of some vertices of `a` from the surface of `b`.
double gap(const Part& a, const geometry::FaceTree& b) {
  double least = std::numeric_limits<double>::infinity();
  const Eigen::Index step = std::max<Eigen::Index>(1, a.surface->V.rows() / kProbes);
  std::int32_t hint = -1;
  for (Eigen::Index v = 0; v < a.surface->V.rows(); v += step) {
    const auto hit = b.nearest(a.surface->V.row(v).transpose(), hint);
    hint = hit.face;
    least = std::min(least, hit.squared);
  }
  return std::sqrt(least);
}

// Gaps to the nearest few of each segment; all others by their boxes' centres, after those.
std::vector<Edge> edges_of(const std::vector<Part>& parts, const Context& context) {
  constexpr double kFar = 1e6;  // mm: behind every measured gap
  std::vector<Edge> edges;
  for (std::size_t a = 0; a < parts.size(); ++a) {
    context.check_stop();
    std::vector<std::size_t> others;
    for (std::size_t b = 0; b < parts.size(); ++b) {
      if (b != a) others.push_back(b);
    }
    std::stable_sort(others.begin(), others.end(), [&](std::size_t x, std::size_t y) {
      return parts[a].box.squaredExteriorDistance(parts[x].box) <
             parts[a].box.squaredExteriorDistance(parts[y].box);
    });
    const geometry::FaceTree tree(*parts[a].surface);
    for (std::size_t i = 0; i < others.size(); ++i) {
      const Part& other = parts[others[i]];
      const double far = kFar + (parts[a].box.center() - other.box.center()).norm();
      edges.push_back({i < kNeighbours ? gap(other, tree) : far, a, others[i]});
    }
  }
  std::stable_sort(edges.begin(), edges.end(), [](const Edge& x, const Edge& y) { return x.gap < y.gap; });
  return edges;
}

std::vector<std::vector<std::size_t>> spanning_tree(std::size_t count, const std::vector<Edge>& edges) {
  std::vector<std::size_t> group(count);
  std::iota(group.begin(), group.end(), std::size_t{0});
  std::vector<std::vector<std::size_t>> beside(count);
  for (const Edge& edge : edges) {
    const std::size_t from = group[edge.a], to = group[edge.b];
    if (from == to) continue;
    std::replace(group.begin(), group.end(), from, to);
    beside[edge.a].push_back(edge.b);
    beside[edge.b].push_back(edge.a);
  }
  return beside;
}

double weight_behind(const std::vector<Part>& parts, const std::vector<std::vector<std::size_t>>& beside,
                     std::size_t at, std::size_t from) {
  double sum = parts[at].box.diagonal().norm();
  for (const std::size_t next : beside[at]) {
    if (next != from) sum += weight_behind(parts, beside, next, at);
  }
  return sum;
}

std::size_t root_of(const std::vector<Part>& parts, const std::vector<std::vector<std::size_t>>& beside) {
  std::size_t best = 0;
  double least = std::numeric_limits<double>::infinity();
  for (std::size_t s = 0; s < parts.size(); ++s) {
    double largest = 0;
    for (const std::size_t next : beside[s])
      largest = std::max(largest, weight_behind(parts, beside, next, s));
    if (largest >= least) continue;
    least = largest;
    best = s;
  }
  return best;
}

PointSource centre_of(const std::string& segment, const std::string& parent) {
  PointSource sphere;
  sphere.rule = CenterRule::sphere_fit;
  sphere.on.segment = segment;
  sphere.on.facing_segment = parent;
  PointSource here, there, middle;
  here.rule = there.rule = CenterRule::centroid;
  here.on = sphere.on;
  there.on.segment = parent;
  there.on.facing_segment = segment;
  middle.rule = CenterRule::between;
  middle.parts = {here, there};
  PointSource any;
  any.rule = CenterRule::first_good;
  any.parts = {sphere, middle};
  return any;
}

}  // namespace

Skeleton generic_tree(const Case& patient, const Context& context) {
  BonePoints bones(patient);
  const std::vector<Part> parts = parts_of(patient, bones);
  if (parts.empty()) {
    throw Error(ErrorKind::config, "case " + patient.name, "no segment owns a bone",
                "list the case's bones with their segments");
  }
  const auto beside = spanning_tree(parts.size(), edges_of(parts, context));
  Skeleton out;
  out.name = patient.skeleton.name;
  std::vector<std::pair<std::size_t, int>> open{{root_of(parts, beside), -1}};
  for (std::size_t i = 0; i < open.size(); ++i) {
    const auto [at, parent] = open[i];
    Segment segment;
    segment.name = parts[at].name;
    segment.parent = parent;
    Joint& joint = segment.joint;
    joint.name = segment.name;
    joint.kind = parent < 0 ? JointKind::free : JointKind::ball;
    joint.sequence = {{.name = "x", .axis = 0}, {.name = "y", .axis = 1}, {.name = "z", .axis = 2}};
    JointRule rule;
    if (parent < 0) {
      rule.center.rule = CenterRule::centroid;
      rule.center.on.segment = segment.name;
    } else {
      rule.center = centre_of(segment.name, out.segments[static_cast<std::size_t>(parent)].name);
    }
    joint.rule = rule.center.rule;
    joint.how = std::make_shared<const JointRule>(std::move(rule));
    for (const std::size_t next : beside[at]) {
      const bool seen =
          parent >= 0 && parts[next].name == out.segments[static_cast<std::size_t>(parent)].name;
      if (!seen) open.emplace_back(next, static_cast<int>(out.segments.size()));
    }
    out.segments.push_back(std::move(segment));
  }
  return out;
}

}  // namespace ecorche::rig
