// SPDX-License-Identifier: Apache-2.0
#include "app/scan/label_values.hpp"

#include <cmath>

#include "io/image/equal_run.hpp"

namespace ecorche::app {
namespace {

constexpr std::size_t kMostLabels = 2048;  // values of a picture are more

}  // namespace

std::optional<std::set<std::int64_t>> label_values(const Image& image) {
  std::set<std::int64_t> seen;
  const bool fits = with_scalar_type(image.type, [&](auto zero) {
    using T = decltype(zero);
    const auto voxels = image.scalars<T>();
    const T* const end = voxels.data() + voxels.size();
    for (const T* at = voxels.data(); at != end; at = io::end_of_run(at, end)) {
      const T v = *at;
      if (!(v >= T{}) || static_cast<double>(v) != std::floor(static_cast<double>(v)) ||
          static_cast<double>(v) > 2147483647.0)
        return false;
      seen.insert(static_cast<std::int64_t>(v));
      if (seen.size() > kMostLabels) return false;
    }
    return true;
  });
  if (!fits) return std::nullopt;
  seen.erase(0);
  return seen;
}

bool looks_grey(const Image& image, std::size_t values) {
  if (values < 32) return false;
  std::size_t pairs = 0, differ = 0;
  with_scalar_type(image.type, [&](auto zero) {
    const auto voxels = image.scalars<decltype(zero)>();
    for (std::size_t v = 1; v < voxels.size(); ++v) {
      if (voxels[v] == zero || voxels[v - 1] == zero) continue;
      ++pairs;
      differ += voxels[v] != voxels[v - 1] ? 1 : 0;
    }
  });
  return 2 * differ > pairs;
}

}  // namespace ecorche::app
