// SPDX-License-Identifier: Apache-2.0
#include "preprocess/label_surfaces/nearest.hpp"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

namespace ecorche::label_surfaces {
namespace {

struct Scratch {
  std::vector<double> numbers;
  std::vector<std::int32_t> tags;
};

// The lower envelope of parabolas over one line (SaitoToriwaki94 in the form of Felzenszwalb and Huttenlocher
// 2012): f(q) becomes min over p of f(p) + (spacing (q - p))^2, and q's tag that of this p.
template <bool tagged>
void transform_line(float* line, std::int32_t* tags, std::size_t stride, int n, double spacing,
                    Scratch& scratch) {
  const auto size = static_cast<std::size_t>(n);
  scratch.numbers.resize(3 * size + 1);
  if (tagged) scratch.tags.resize(size);
  double* const value = scratch.numbers.data();
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
    if (tagged) scratch.tags[static_cast<std::size_t>(top)] = tags[static_cast<std::size_t>(q) * stride];
  }
  if (top < 0) return;
  int at = 0;
  for (int q = 0; q < n; ++q) {
    while (at < top && from[at + 1] <= q) ++at;
    const double d = q - centre[at];
    line[static_cast<std::size_t>(q) * stride] = static_cast<float>(value[at] + s2 * d * d);
    if (tagged) tags[static_cast<std::size_t>(q) * stride] = scratch.tags[static_cast<std::size_t>(at)];
  }
}

template <bool tagged>
void spread(float* squared, std::int32_t* tag, const std::array<std::int32_t, 3>& size,
            const std::array<double, 3>& spacing, const Context& context) {
  const auto nx = static_cast<std::size_t>(size[0]), ny = static_cast<std::size_t>(size[1]),
             nz = static_cast<std::size_t>(size[2]);
  const auto lines = [&](std::size_t count, std::size_t axis, std::size_t stride, const auto& first) {
    context.check_stop();
    tbb::parallel_for(tbb::blocked_range<std::size_t>(0, count), [&](const auto& range) {
      Scratch scratch;
      for (std::size_t l = range.begin(); l < range.end(); ++l)
        transform_line<tagged>(squared + first(l), tagged ? tag + first(l) : nullptr, stride, size[axis],
                               spacing[axis], scratch);
    });
  };
  lines(ny * nz, 0, 1, [&](std::size_t l) { return l * nx; });
  lines(nx * nz, 1, nx, [&](std::size_t l) { return l / nx * nx * ny + l % nx; });
  lines(nx * ny, 2, nx * ny, [&](std::size_t l) { return l; });
}

}  // namespace

void spread_nearest(std::vector<float>& squared, std::vector<std::int32_t>& tag,
                    const std::array<std::int32_t, 3>& size, const std::array<double, 3>& spacing,
                    const Context& context) {
  if (tag.empty()) {
    spread<false>(squared.data(), nullptr, size, spacing, context);
  } else {
    spread<true>(squared.data(), tag.data(), size, spacing, context);
  }
}

}  // namespace ecorche::label_surfaces
