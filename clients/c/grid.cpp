// SPDX-License-Identifier: Apache-2.0
#include "clients/c/grid.hpp"

#include <algorithm>
#include <cmath>
#include <string>

#include <ecorche/values/error.hpp>
#include "clients/c/guard.hpp"

namespace ecorche::c {
namespace {

constexpr std::uint64_t kMostVoxels = std::uint64_t{1} << 31U;

// Whether the columns are of length 1 and at right angles.
bool orthonormal(const double* d) {
  for (int a = 0; a < 3; ++a) {
    for (int b = 0; b < 3; ++b) {
      double dot = 0;
      for (int r = 0; r < 3; ++r) dot += d[3 * r + a] * d[3 * r + b];
      if (!(std::abs(dot - (a == b ? 1 : 0)) < 1e-4)) return false;
    }
  }
  return true;
}

}  // namespace

ecorche_grid to_c(const ImageGrid& grid) {
  ecorche_grid out{};
  std::copy(grid.size.begin(), grid.size.end(), out.size);
  std::copy(grid.origin.begin(), grid.origin.end(), out.origin);
  std::copy(grid.spacing.begin(), grid.spacing.end(), out.spacing);
  std::copy(grid.direction.begin(), grid.direction.end(), out.direction);
  return out;
}

ImageGrid read_grid(const ecorche_grid& from) {
  const auto finite = [](const double* values) {
    return std::all_of(values, values + 3, [](double v) { return std::isfinite(v); });
  };
  std::uint64_t voxels = 1;
  for (const std::int32_t n : from.size) {
    if (n < 1)
      throw Error(ErrorKind::usage, "grid", "its size is not positive", "a slice is one voxel thick");
    voxels *= static_cast<std::uint64_t>(n);
    if (voxels > kMostVoxels)
      throw Error(ErrorKind::usage, "grid", "has more than 2^31 voxels", "ask for a part");
  }
  if (!finite(from.origin) || !finite(from.spacing) ||
      std::any_of(from.spacing, from.spacing + 3, [](double s) { return s <= 0; }))
    throw Error(ErrorKind::usage, "grid", "its origin or spacing is no place",
                "give finite, positive millimetres");
  if (!orthonormal(from.direction))
    throw Error(ErrorKind::usage, "grid", "its direction is not orthonormal",
                "give three axes at right angles");
  ImageGrid out;
  std::copy_n(from.size, 3, out.size.begin());
  std::copy_n(from.origin, 3, out.origin.begin());
  std::copy_n(from.spacing, 3, out.spacing.begin());
  std::copy_n(from.direction, 9, out.direction.begin());
  return out;
}

ecorche_code check_room(const Image& like, const ImageGrid& grid, std::size_t bytes) {
  const std::size_t needed =
      grid.voxels() * static_cast<std::size_t>(like.components) * scalar_bytes(like.type);
  if (bytes >= needed) return ECORCHE_OK;
  return fail(ECORCHE_INVALID_ARGUMENT, "bytes: the grid takes " + std::to_string(needed) + " of them");
}

}  // namespace ecorche::c
