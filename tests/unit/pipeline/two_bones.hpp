// SPDX-License-Identifier: Apache-2.0
// The smallest body that bends: two bones in a box of flesh.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <utility>
#include <vector>

#include <ecorche/values/case.hpp>

namespace ecorche::test {

/// An axis-parallel box, its faces in squares of about 5 mm, two triangles each: what a scanner's surface
/// looks like to a mesher, other than eight corners would.
inline SurfaceMesh box(const Eigen::Vector3d& low, const Eigen::Vector3d& high) {
  std::array<int, 3> cells;
  for (int axis = 0; axis < 3; ++axis) {
    cells[static_cast<std::size_t>(axis)] =
        std::max(1, static_cast<int>(std::lround((high[axis] - low[axis]) / 5)));
  }
  std::map<std::array<int, 3>, std::int32_t> row;
  std::vector<Eigen::RowVector3d> points;
  std::vector<Eigen::RowVector3i> faces;
  const auto vertex = [&](const std::array<int, 3>& at) {
    const auto [found, added] = row.try_emplace(at, static_cast<std::int32_t>(points.size()));
    if (added) {
      Eigen::RowVector3d p;
      for (int axis = 0; axis < 3; ++axis) {
        const auto a = static_cast<std::size_t>(axis);
        p[axis] = low[axis] + (high[axis] - low[axis]) * at[a] / cells[a];
      }
      points.push_back(p);
    }
    return found->second;
  };
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const std::size_t u = (axis + 1) % 3, v = (axis + 2) % 3;
    for (const bool top : {false, true}) {
      for (int i = 0; i < cells[u]; ++i) {
        for (int j = 0; j < cells[v]; ++j) {
          const auto at = [&](int du, int dv) {
            std::array<int, 3> ijk{};
            ijk[axis] = top ? cells[axis] : 0;
            ijk[u] = i + du;
            ijk[v] = j + dv;
            return vertex(ijk);
          };
          const std::int32_t a = at(0, 0), b = at(1, 0), c = at(1, 1), d = at(0, 1);
          faces.emplace_back(a, top ? b : c, top ? c : b);
          faces.emplace_back(a, top ? c : d, top ? d : c);
        }
      }
    }
  }
  SurfaceMesh mesh;
  mesh.V.resize(static_cast<Eigen::Index>(points.size()), 3);
  for (std::size_t i = 0; i < points.size(); ++i) mesh.V.row(static_cast<Eigen::Index>(i)) = points[i];
  mesh.F.resize(static_cast<Eigen::Index>(faces.size()), 3);
  for (std::size_t i = 0; i < faces.size(); ++i) mesh.F.row(static_cast<Eigen::Index>(i)) = faces[i];
  return mesh;
}

/// A box 50 x 50 x 150 mm along z; bones of 14 mm below and above a joint at z = 75; a muscle beside it, a
/// small CT and a label map.
inline Case two_bones() {
  Case patient;
  patient.name = "two_bones";
  patient.skeleton.name = "two";
  for (const auto& [name, parent] : {std::pair("lower", -1), std::pair("upper", 0)}) {
    Segment segment;
    segment.name = name;
    segment.parent = parent;
    segment.joint.name = std::string(name) + "_joint";
    segment.joint.center = {25, 25, parent < 0 ? 5.0 : 75.0};
    segment.joint.sequence = {{"flexion", 0}, {"adduction", 1}, {"rotation", 2}};
    patient.skeleton.segments.push_back(segment);
  }
  patient.skin = box({0, 0, 0}, {50, 50, 150});
  patient.bones = {{"shaft", "lower", box({18, 18, 10}, {32, 32, 68})},
                   {"tip", "upper", box({18, 18, 82}, {32, 32, 140})}};
  patient.tissues = {{"muscle", Group::muscle, box({36, 15, 30}, {46, 35, 120})}};
  ImageGrid grid;
  grid.size = {7, 7, 17};
  grid.spacing = {10, 10, 10};
  grid.origin = {-5, -5, -5};
  patient.volumes = {{"ct", Image(grid, ScalarType::i16), -1024}};
  patient.labels = CaseLabels{Image(grid, ScalarType::u8), {{1, "muscle"}}};
  patient.input_digests = {{"skin.stl", 0x0123456789abcdefULL}};
  return patient;
}

}  // namespace ecorche::test
