// SPDX-License-Identifier: Apache-2.0
#include "preprocess/check/label_ids.hpp"

#include <cmath>
#include <type_traits>

namespace ecorche::check {

std::map<std::int64_t, LabelUse> label_ids(const Image& labels) {
  std::map<std::int64_t, LabelUse> out;
  if (labels.grid.voxels() == 0) return out;
  with_scalar_type(labels.type, [&](auto zero) {
    using T = decltype(zero);
    const std::span<const T> values = labels.scalars<T>();
    const auto components = static_cast<std::size_t>(labels.components);
    const auto nx = static_cast<std::size_t>(labels.grid.size[0]);
    const auto ny = static_cast<std::size_t>(labels.grid.size[1]);
    // Voxels come in runs of one id: the table is asked once a run.
    LabelUse* use = nullptr;
    T run = 0;
    for (std::size_t i = 0; i < values.size(); ++i) {
      const T value = values[i];
      if constexpr (std::is_floating_point_v<T>) {
        if (!(std::abs(value) < T(1e15))) continue;  // no id at all
      }
      if (value == 0) continue;
      if (use == nullptr || value != run) {
        const std::size_t voxel = i / components;
        use = &out[static_cast<std::int64_t>(value)];
        run = value;
        if (use->voxels == 0) {
          const auto p =
              labels.grid.point(static_cast<double>(voxel % nx), static_cast<double>(voxel / nx % ny),
                                static_cast<double>(voxel / (nx * ny)));
          use->first = {p[0], p[1], p[2]};
        }
      }
      ++use->voxels;
    }
  });
  return out;
}

}  // namespace ecorche::check
