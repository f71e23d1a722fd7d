// SPDX-License-Identifier: Apache-2.0
#include "preprocess/label_surfaces/closing.hpp"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

namespace ecorche::label_surfaces {
namespace {

constexpr float kFar = std::numeric_limits<float>::infinity();

// The lower envelope of parabolas over one line (SaitoToriwaki94 in the form of Felzenszwalb and Huttenlocher
// 2012): f(q) becomes min over p of f(p) + (spacing (q - p))^2.
void transform_line(float* line, std::size_t stride, int n, double spacing, std::vector<double>& scratch) {
  scratch.resize(3 * static_cast<std::size_t>(n) + 1);
  double* const value = scratch.data();
  double* const centre = value + n;
  double* const from = centre + n;  // n + 1
  const double s2 = spacing * spacing;
  int top = -1;
  for (int q = 0; q < n; ++q) {
    const double f = line[static_cast<std::size_t>(q) * stride];
    if (f == static_cast<double>(kFar)) continue;
    double start = -1;
    while (top >= 0) {
      const double p = centre[top];
      start = ((f + s2 * q * q) - (value[top] + s2 * p * p)) / (2 * s2 * (q - p));
      if (start > from[top]) break;
      --top;
    }
    ++top;
    centre[top] = q;
    value[top] = f;
    from[top] = top == 0 ? -1 : start;
  }
  if (top < 0) return;
  int at = 0;
  for (int q = 0; q < n; ++q) {
    while (at < top && from[at + 1] <= q) ++at;
    const double d = q - centre[at];
    line[static_cast<std::size_t>(q) * stride] = static_cast<float>(value[at] + s2 * d * d);
  }
}

// Squared distance, mm^2, of every voxel's centre to the nearest one whose `inside` is `target`.
std::vector<float> squared_distance(const Mask& mask, std::uint8_t target,
                                    const std::array<double, 3>& spacing, const Context& context) {
  std::vector<float> d(mask.inside.size());
  for (std::size_t i = 0; i < d.size(); ++i) d[i] = mask.inside[i] == target ? 0 : kFar;
  const auto nx = static_cast<std::size_t>(mask.size[0]), ny = static_cast<std::size_t>(mask.size[1]),
             nz = static_cast<std::size_t>(mask.size[2]);
  const auto lines = [&](std::size_t count, const auto& each) {
    context.check_stop();
    tbb::parallel_for(tbb::blocked_range<std::size_t>(0, count), [&](const auto& range) {
      std::vector<double> scratch;
      for (std::size_t l = range.begin(); l < range.end(); ++l) each(l, scratch);
    });
  };
  lines(ny * nz, [&](std::size_t l, std::vector<double>& s) {
    transform_line(&d[l * nx], 1, mask.size[0], spacing[0], s);
  });
  lines(nx * nz, [&](std::size_t l, std::vector<double>& s) {
    transform_line(&d[l / nx * nx * ny + l % nx], nx, mask.size[1], spacing[1], s);
  });
  lines(nx * ny, [&](std::size_t l, std::vector<double>& s) {
    transform_line(&d[l], nx * ny, mask.size[2], spacing[2], s);
  });
  return d;
}

// Gives every voxel that `from` reaches through faces, over voxels like it, the value `to`; how many.
std::size_t flood(Mask& mask, std::size_t start, std::uint8_t to, std::vector<std::size_t>& work) {
  const std::uint8_t from = mask.inside[start];
  const std::array<std::size_t, 4> step{1, mask.offset(0, 1, 0), mask.offset(0, 0, 1), mask.inside.size()};
  std::size_t count = 1;
  work.assign(1, start);
  mask.inside[start] = to;
  while (!work.empty()) {
    const std::size_t at = work.back();
    work.pop_back();
    const auto visit = [&](std::size_t next) {
      if (mask.inside[next] != from) return;
      mask.inside[next] = to;
      ++count;
      work.push_back(next);
    };
    for (std::size_t a = 0; a < 3; ++a) {
      if (at % step[a + 1] >= step[a]) visit(at - step[a]);
      if (at % step[a + 1] + step[a] < step[a + 1]) visit(at + step[a]);
    }
  }
  return count;
}

}  // namespace

void close_gaps(Mask& mask, const std::array<double, 3>& spacing, double radius_mm, const Context& context) {
  const auto limit = static_cast<float>(radius_mm * radius_mm);
  {
    const std::vector<float> d = squared_distance(mask, 1, spacing, context);
    for (std::size_t i = 0; i < d.size(); ++i) mask.inside[i] = d[i] <= limit ? 1 : 0;
  }
  const std::vector<float> d = squared_distance(mask, 0, spacing, context);
  // What was inside still is: nothing outside now lies within the radius of it.
  for (std::size_t i = 0; i < d.size(); ++i) mask.inside[i] = d[i] > limit ? 1 : 0;
}

void fill_hollows(Mask& mask) {
  constexpr std::uint8_t reached = 2;
  std::vector<std::size_t> work;
  flood(mask, 0, reached, work);  // the margin is outside and one piece
  for (std::uint8_t& voxel : mask.inside) voxel = voxel == reached ? 0 : 1;
}

void drop_specks(Mask& mask, double share) {
  constexpr std::uint8_t seen = 2;
  std::vector<std::size_t> work;
  std::vector<std::pair<std::size_t, std::size_t>> pieces;  // a voxel of each, and how many it has
  std::size_t largest = 0;
  for (std::size_t i = 0; i < mask.inside.size(); ++i) {
    if (mask.inside[i] != 1) continue;
    pieces.emplace_back(i, flood(mask, i, seen, work));
    largest = std::max(largest, pieces.back().second);
  }
  for (const auto& [start, count] : pieces)
    flood(mask, start, static_cast<double>(count) < share * static_cast<double>(largest) ? 0 : 1, work);
}

}  // namespace ecorche::label_surfaces
