// SPDX-License-Identifier: Apache-2.0
// A surface under repair, and its steps.
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <vector>

#include <ecorche/values/context.hpp>
#include <ecorche/values/mesh.hpp>

namespace ecorche::repair {

/// Points that no triangle uses may stand among the others.
struct Soup {
  std::vector<Eigen::Vector3d> points;
  std::vector<std::array<std::int32_t, 3>> triangles;

  Triangles F() const;
  SurfaceMesh mesh() const;  ///< points and all
};

/// Vertices of open edges become the first of those nearer than `reach` mm. Returns how many did.
std::int64_t weld_open_edges(Soup& soup, double reach);

/// Splits vertices until every edge has at most two triangles, which run along it in opposite ways, and the
/// triangles of every vertex form one fan. At an edge of several sheets, the walls of one solid stay
/// together: each wall with the next one behind it. Returns how many copies were made.
std::int64_t split_sheets(Soup& soup);

struct Filled {
  std::int64_t holes = 0, triangles = 0, left = 0;
};

/// Fills each hole with the triangles of least area (Barequet and Sharir 1995; of more than 800 edges,
/// corners with the shortest chords go first until that many are left), where that is at most `area` mm^2.
/// The surface must be split into sheets. Where `chosen` is given, only holes of whose vertices it is true.
using ChosenHole = std::function<bool(const std::vector<std::int32_t>& vertices)>;
Filled fill_holes(Soup& soup, double area, const Context& context, const ChosenHole& chosen = {});

}  // namespace ecorche::repair
