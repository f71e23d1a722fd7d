// SPDX-License-Identifier: Apache-2.0
#include "app/scan/dense_labels.hpp"

#include <algorithm>
#include <cmath>
#include <map>

#include "io/image/same_grid.hpp"

namespace ecorche::app {
namespace {

constexpr double kCompactHu = 500;     // in the mean: no contrast medium in a vessel is so dense
constexpr double kBoneMeanHu = 200;    // of a bone with its marrow
constexpr double kBoneSpreadHu = 100;  // ... and its standard deviation

struct Moments {
  double count = 0, sum = 0, squares = 0;
};

}  // namespace

std::vector<std::int64_t> labels_like_bone(const Image& layer, const std::set<std::int64_t>& asked,
                                           const ScanImage& ct) {
  Image placed;
  const Image* image = &ct.image;
  if (!io::same_place(image->grid, layer.grid)) {
    placed = io::resampled_nearest(ct.image, layer.grid, ct.background);
    image = &placed;
  }
  std::map<std::int64_t, Moments> of;
  for (const std::int64_t id : asked) of[id];
  with_scalar_type(layer.type, [&](auto label) {
    const auto ids = layer.scalars<decltype(label)>();
    with_scalar_type(image->type, [&](auto grey) {
      const auto values = image->scalars<decltype(grey)>();
      for (std::size_t v = 0; v < ids.size(); ++v) {
        const auto found = of.find(static_cast<std::int64_t>(+ids[v]));
        if (found == of.end()) continue;
        const auto hu = static_cast<double>(values[v]);
        found->second.count += 1;
        found->second.sum += hu;
        found->second.squares += hu * hu;
      }
    });
  });
  std::vector<std::int64_t> out;
  for (const auto& [id, m] : of) {
    if (m.count == 0) continue;
    const double mean = m.sum / m.count;
    const double spread = std::sqrt(std::max(0.0, m.squares / m.count - mean * mean));
    if (mean >= kCompactHu || (mean >= kBoneMeanHu && spread >= kBoneSpreadHu)) out.push_back(id);
  }
  return out;
}

}  // namespace ecorche::app
