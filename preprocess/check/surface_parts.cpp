// SPDX-License-Identifier: Apache-2.0
#include "preprocess/check/surface_parts.hpp"

#include <algorithm>
#include <cmath>
#include <unordered_map>

#include "preprocess/check/inside.hpp"

namespace ecorche::check {
namespace {

using Eigen::Vector3d;

// The triangles of every part, in their order.
class ByPart {
 public:
  ByPart(const SurfaceMesh& mesh, const SurfaceParts& parts) : mesh_(mesh) {
    offsets_.assign(parts.parts.size() + 1, 0);
    for (std::size_t p = 0; p < parts.parts.size(); ++p)
      offsets_[p + 1] = offsets_[p] + static_cast<std::size_t>(parts.parts[p].triangles);
    triangles_.resize(offsets_.back());
    std::vector<std::size_t> next(offsets_.begin(), offsets_.end() - 1);
    for (std::int32_t f = 0; f < mesh.F.rows(); ++f)
      triangles_[next[static_cast<std::size_t>(parts.classes.of[static_cast<std::size_t>(f)])]++] = f;
  }

  // The part alone, with its own vertices. O(its triangles).
  SurfaceMesh mesh(std::int32_t part) const {
    const std::size_t first = offsets_[static_cast<std::size_t>(part)],
                      last = offsets_[static_cast<std::size_t>(part) + 1];
    SurfaceMesh out;
    out.F.resize(static_cast<Eigen::Index>(last - first), 3);
    std::unordered_map<std::int32_t, std::int32_t> number;
    for (std::size_t i = first; i < last; ++i) {
      for (Eigen::Index c = 0; c < 3; ++c)
        out.F(static_cast<Eigen::Index>(i - first), c) =
            number.try_emplace(mesh_.F(triangles_[i], c), static_cast<std::int32_t>(number.size()))
                .first->second;
    }
    out.V.resize(static_cast<Eigen::Index>(number.size()), 3);
    for (const auto& [vertex, row] : number) out.V.row(row) = mesh_.V.row(vertex);
    return out;
  }

 private:
  const SurfaceMesh& mesh_;
  std::vector<std::size_t> offsets_;
  std::vector<std::int32_t> triangles_;
};

// From the smallest container to the largest: the first that holds a part is the innermost.
void find_inner(const SurfaceMesh& mesh, SurfaceParts& parts) {
  std::vector<std::int32_t> containers;
  for (std::int32_t p = 0; p < parts.classes.count; ++p) {
    if (parts.parts[static_cast<std::size_t>(p)].closed) containers.push_back(p);
  }
  if (containers.size() < 2) return;
  const auto at = [&](std::int32_t p) -> Part& { return parts.parts[static_cast<std::size_t>(p)]; };
  std::stable_sort(containers.begin(), containers.end(), [&](std::int32_t a, std::int32_t b) {
    return at(a).box.diagonal().norm() < at(b).box.diagonal().norm();
  });
  const ByPart by_part(mesh, parts);
  for (const std::int32_t outer : containers) {
    std::vector<std::int32_t> candidates;
    for (const std::int32_t inner : containers) {
      if (inner != outer && at(inner).inside < 0 && at(outer).box.contains(at(inner).box))
        candidates.push_back(inner);
    }
    if (candidates.empty()) continue;
    const SurfaceMesh around = by_part.mesh(outer);
    const Inside inside(around);
    for (const std::int32_t inner : candidates) {
      if (inside(mesh.V.row(mesh.F(at(inner).triangle, 0)).transpose())) at(inner).inside = outer;
    }
  }
}

}  // namespace

bool SurfaceParts::speck(std::int32_t part, double size_mm) const {
  return part != largest && parts[static_cast<std::size_t>(part)].box.diagonal().norm() < size_mm;
}

SurfaceParts surface_parts(const SurfaceMesh& mesh) {
  SurfaceParts out;
  out.classes = geometry::parts(mesh);
  out.parts.resize(static_cast<std::size_t>(out.classes.count));
  const auto part_of = [&](std::int32_t f) -> Part& {
    return out.parts[static_cast<std::size_t>(out.classes.of[static_cast<std::size_t>(f)])];
  };
  for (std::int32_t f = 0; f < mesh.F.rows(); ++f) {
    Part& part = part_of(f);
    if (part.triangles++ == 0) part.triangle = f, part.closed = true;
    const Vector3d a = mesh.V.row(mesh.F(f, 0)), b = mesh.V.row(mesh.F(f, 1)), c = mesh.V.row(mesh.F(f, 2));
    part.box.extend(a).extend(b).extend(c);
    // About the part's own place, so that nothing is lost far from the origin.
    const Vector3d middle = mesh.V.row(mesh.F(part.triangle, 0));
    part.volume_mm3 += (a - middle).dot((b - middle).cross(c - middle)) / 6;
  }
  const std::vector<geometry::HalfEdge> edges = geometry::sorted_edges(mesh.F);
  geometry::each_edge(edges, [&](std::span<const geometry::HalfEdge> edge) {
    if (edge.size() != 2) part_of(edge[0].triangle).closed = false;
  });
  double most = -1;
  for (std::int32_t p = 0; p < out.classes.count; ++p) {
    const double size = out.parts[static_cast<std::size_t>(p)].box.diagonal().norm();
    if (size > most) most = size, out.largest = p;
  }
  find_inner(mesh, out);
  return out;
}

}  // namespace ecorche::check
