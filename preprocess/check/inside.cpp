// SPDX-License-Identifier: Apache-2.0
#include "preprocess/check/inside.hpp"

#include <tbb/parallel_for.h>
#include <tbb/task_arena.h>

#include <algorithm>
#include <cmath>

namespace ecorche::check {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

// How often the edge a -> b passes the ray from p along +x in the plane: 1 upward, -1 downward. Always
// computed from the lower end, so that both triangles of an edge see the same.
int passes(const Vector2d& p, const Vector2d& a, const Vector2d& b) {
  if ((a.y() <= p.y()) == (b.y() <= p.y())) return 0;
  const bool upward = a.y() <= p.y();
  const Vector2d& low = upward ? a : b;
  const Vector2d& high = upward ? b : a;
  const double x = low.x() + (p.y() - low.y()) * ((high.x() - low.x()) / (high.y() - low.y()));
  if (!(x > p.x())) return 0;
  return upward ? 1 : -1;
}

}  // namespace

// While it waits for its own loop, the thread must not take up another job: that one could ask the same.
const Inside::Columns& Inside::columns(int axis) const {
  std::call_once(built_, [&] {
    tbb::this_task_arena::isolate([&] {
      tbb::parallel_for(0, 3, [&](int each) { columns_[static_cast<std::size_t>(each)] = build(each); });
    });
  });
  return columns_[static_cast<std::size_t>(axis)];
}

Inside::Columns Inside::build(int axis) const {
  Columns out;
  const int u = (axis + 1) % 3, v = (axis + 2) % 3;  // u, v, axis: right-handed
  const Points& V = surface_.V;
  const Eigen::Index count = surface_.F.rows();
  if (count == 0) {
    out.offsets = {0, 0};
    return out;
  }
  out.low = {V.col(u).minCoeff(), V.col(v).minCoeff()};
  const Vector2d extent = Vector2d(V.col(u).maxCoeff(), V.col(v).maxCoeff()) - out.low;
  // About two triangles a cell, were they spread evenly.
  out.edge = std::max(std::sqrt(extent.x() * extent.y() / (0.5 * static_cast<double>(count) + 1)),
                      extent.maxCoeff() / 4096 + 1e-9);
  for (int k = 0; k < 2; ++k)
    out.size[static_cast<std::size_t>(k)] = static_cast<int>(extent[k] / out.edge) + 1;
  const auto cell = [&](double x, int k) {
    return std::clamp(static_cast<int>((x - out.low[k]) / out.edge), 0,
                      out.size[static_cast<std::size_t>(k)] - 1);
  };
  const auto each_cell = [&](Eigen::Index f, auto&& visit) {
    const Eigen::Vector3i corners = surface_.F.row(f).transpose();
    const Vector3d us(V(corners[0], u), V(corners[1], u), V(corners[2], u));
    const Vector3d vs(V(corners[0], v), V(corners[1], v), V(corners[2], v));
    for (int j = cell(vs.minCoeff(), 1); j <= cell(vs.maxCoeff(), 1); ++j) {
      for (int i = cell(us.minCoeff(), 0); i <= cell(us.maxCoeff(), 0); ++i) {
        visit(static_cast<std::size_t>(i) +
              static_cast<std::size_t>(out.size[0]) * static_cast<std::size_t>(j));
      }
    }
  };
  out.offsets.assign(static_cast<std::size_t>(out.size[0]) * static_cast<std::size_t>(out.size[1]) + 1, 0);
  for (Eigen::Index f = 0; f < count; ++f) each_cell(f, [&](std::size_t at) { ++out.offsets[at + 1]; });
  for (std::size_t at = 1; at < out.offsets.size(); ++at) out.offsets[at] += out.offsets[at - 1];
  out.triangles.resize(static_cast<std::size_t>(out.offsets.back()));
  std::vector<std::int32_t> next(out.offsets.begin(), out.offsets.end() - 1);
  for (Eigen::Index f = 0; f < count; ++f) {
    each_cell(f, [&](std::size_t at) {
      out.triangles[static_cast<std::size_t>(next[at]++)] = static_cast<std::int32_t>(f);
    });
  }
  return out;
}

int Inside::crossings(const Vector3d& p, int axis) const {
  const Columns& along = columns(axis);
  const int u = (axis + 1) % 3, v = (axis + 2) % 3;  // u, v, axis: right-handed
  const Vector2d q(p[u], p[v]);
  std::array<int, 2> cell{};
  for (int k = 0; k < 2; ++k) {
    const double place = (q[k] - along.low[k]) / along.edge;
    if (!(place >= 0 && place < along.size[static_cast<std::size_t>(k)])) return 0;
    cell[static_cast<std::size_t>(k)] = static_cast<int>(place);
  }
  const std::size_t at = static_cast<std::size_t>(cell[0]) +
                         static_cast<std::size_t>(along.size[0]) * static_cast<std::size_t>(cell[1]);
  int sum = 0;
  for (std::int32_t i = along.offsets[at]; i < along.offsets[at + 1]; ++i) {
    const std::int32_t f = along.triangles[static_cast<std::size_t>(i)];
    std::array<Vector3d, 3> corner;
    for (int c = 0; c < 3; ++c)
      corner[static_cast<std::size_t>(c)] = surface_.V.row(surface_.F(f, c)).transpose();
    const auto flat = [u, v](const Vector3d& x) { return Vector2d(x[u], x[v]); };
    const int turn = passes(q, flat(corner[0]), flat(corner[1])) +
                     passes(q, flat(corner[1]), flat(corner[2])) +
                     passes(q, flat(corner[2]), flat(corner[0]));
    if (turn == 0) continue;
    const Vector3d normal = (corner[1] - corner[0]).cross(corner[2] - corner[0]);
    // Height of the plane over q; a plane that holds the ray has no height and is not crossed.
    const double height =
        corner[0][axis] -
        (normal[u] * (q[0] - corner[0][u]) + normal[v] * (q[1] - corner[0][v])) / normal[axis];
    if (height > p[axis]) sum += turn;
  }
  return sum;
}

bool Inside::operator()(const Vector3d& p) const {
  int votes = 0;
  for (int axis = 0; axis < 3; ++axis) votes += crossings(p, axis) != 0;
  if (votes == 0 || votes == 3) return votes == 3;
  std::call_once(asked_, [&] { winding_.emplace(surface_); });
  return std::abs((*winding_)(p)) >= 0.5;
}

}  // namespace ecorche::check
