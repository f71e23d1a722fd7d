// SPDX-License-Identifier: Apache-2.0
#include "preprocess/label_surfaces/mask.hpp"

#include <algorithm>
#include <cmath>

#include "preprocess/label_surfaces/closing.hpp"

namespace ecorche::label_surfaces {
namespace {

constexpr std::size_t kMostIds = 65536;
// Stray voxels off the body are no bodies: fewer than this share of the largest piece.
constexpr double kSpeck = 1e-3;

// Where every voxel's id stands in `ids`.
template <class T>
void number(std::span<const T> voxels, const std::vector<std::int64_t>& ids,
            std::vector<std::uint16_t>& index) {
  T last = voxels.empty() ? T{} : voxels[0];
  const auto find = [&](T v) {
    return static_cast<std::uint16_t>(std::lower_bound(ids.begin(), ids.end(), static_cast<std::int64_t>(v)) -
                                      ids.begin());
  };
  std::uint16_t at = voxels.empty() ? std::uint16_t{0} : find(last);
  for (std::size_t i = 0; i < voxels.size(); ++i) {
    if (voxels[i] != last) {
      last = voxels[i];
      at = find(last);
    }
    index[i] = at;
  }
}

}  // namespace

LabelBlocks::LabelBlocks(const CaseLabels& labels, const Context& context) : labels_(labels) {
  const Image& image = labels.image;
  index_.resize(image.grid.voxels());
  ids_ = distinct_values(image, kMostIds);
  if (ids_.size() > kMostIds) {
    throw Error(ErrorKind::data, "labels", "the label map has more than 65536 ids",
                "is it a label map, or a picture?");
  }
  context.check_stop();
  with_scalar_type(image.type, [&](auto zero) {
    using T = decltype(zero);
    number(image.scalars<T>(), ids_, index_);
  });
  context.check_stop();
  const auto& n = image.grid.size;
  boxes_.assign(ids_.size(), {{n[0], n[1], n[2]}, {-1, -1, -1}});
  std::size_t at = 0;
  for (int k = 0; k < n[2]; ++k) {
    for (int j = 0; j < n[1]; ++j) {
      for (int i = 0; i < n[0];) {  // by runs of one id
        const std::uint16_t id = index_[at];
        int end = i + 1;
        ++at;
        for (; end < n[0] && index_[at] == id; ++end) ++at;
        Box& b = boxes_[id];
        b.low = {std::min(b.low[0], i), std::min(b.low[1], j), std::min(b.low[2], k)};
        b.high = {std::max(b.high[0], end - 1), std::max(b.high[1], j), std::max(b.high[2], k)};
        i = end;
      }
    }
  }
}

std::vector<std::uint8_t> LabelBlocks::chosen(const LabelSource& source) const {
  std::vector<std::uint8_t> chosen(ids_.size(), 0);
  for (std::size_t i = 0; i < ids_.size(); ++i) {
    chosen[i] = source.ids.empty()
                    ? ids_[i] != 0
                    : std::find(source.ids.begin(), source.ids.end(), ids_[i]) != source.ids.end();
  }
  return chosen;
}

LabelBlocks::Box LabelBlocks::box(const std::vector<std::uint8_t>& chosen) const {
  const auto& n = labels_.image.grid.size;
  Box all{{n[0], n[1], n[2]}, {-1, -1, -1}};
  for (std::size_t i = 0; i < chosen.size(); ++i) {
    if (chosen[i] == 0) continue;
    for (std::size_t a = 0; a < 3; ++a) {
      all.low[a] = std::min(all.low[a], boxes_[i].low[a]);
      all.high[a] = std::max(all.high[a], boxes_[i].high[a]);
    }
  }
  return all;
}

void LabelBlocks::keep_within(const Mask& body) {
  const auto nothing = std::lower_bound(ids_.begin(), ids_.end(), 0) - ids_.begin();
  if (nothing == std::ssize(ids_) || ids_[static_cast<std::size_t>(nothing)] != 0)
    return;  // no voxel is outside
  const auto& n = labels_.image.grid.size;
  std::size_t at = 0;
  for (int k = 0; k < n[2]; ++k) {
    for (int j = 0; j < n[1]; ++j) {
      for (int i = 0; i < n[0]; ++i, ++at) {
        const std::array<int, 3> v{i - body.low[0], j - body.low[1], k - body.low[2]};
        bool in = true;
        for (std::size_t a = 0; a < 3; ++a) in = in && v[a] >= 0 && v[a] < body.size[a];
        if (!in || body.inside[body.offset(v[0], v[1], v[2])] == 0)
          index_[at] = static_cast<std::uint16_t>(nothing);
      }
    }
  }
}

std::size_t LabelBlocks::work(const LabelSource& source) const {
  const Box b = box(chosen(source));
  std::size_t voxels = 1;
  for (std::size_t a = 0; a < 3; ++a)
    voxels *= static_cast<std::size_t>(std::max(0, b.high[a] - b.low[a] + 1));
  return voxels;
}

Mask LabelBlocks::mask(const LabelSource& source, const Context& context) const {
  const ImageGrid& grid = labels_.image.grid;
  const std::vector<std::uint8_t> take = chosen(source);
  const Box b = box(take);
  Mask mask;
  if (b.high[0] < b.low[0]) return mask;
  for (std::size_t a = 0; a < 3; ++a) {
    const int margin = 1 + static_cast<int>(std::ceil(source.close_mm / grid.spacing[a]));
    mask.low[a] = b.low[a] - margin;
    mask.size[a] = b.high[a] - b.low[a] + 1 + 2 * margin;
  }
  mask.inside.assign(mask.offset(0, 0, mask.size[2]), 0);

  // x is affine in the index: where a voxel lies of the mid-plane takes three products.
  const std::array<double, 3> along{grid.direction[0] * grid.spacing[0], grid.direction[1] * grid.spacing[1],
                                    grid.direction[2] * grid.spacing[2]};
  const auto on_side = [&](int i, int j, int k) {
    if (source.side == Side::both) return true;
    const double x = grid.origin[0] + along[0] * i + along[1] * j + along[2] * k;
    return (x >= source.plane_mm) == (source.side == Side::left);
  };
  bool any = false;
  const auto fill = [&](const auto& allowed) {
    for (int k = b.low[2]; k <= b.high[2]; ++k) {
      context.check_stop();
      for (int j = b.low[1]; j <= b.high[1]; ++j) {
        std::size_t from = grid.offset(b.low[0], j, k);
        std::size_t to = mask.offset(b.low[0] - mask.low[0], j - mask.low[1], k - mask.low[2]);
        for (int i = b.low[0]; i <= b.high[0]; ++i, ++from, ++to) {
          if (take[index_[from]] == 0 || !allowed(from) || !on_side(i, j, k)) continue;
          mask.inside[to] = 1;
          any = true;
        }
      }
    }
  };
  if (source.within) {
    with_scalar_type(source.within->type, [&](auto zero) {
      using T = decltype(zero);
      const auto values = source.within->scalars<T>();
      fill([&](std::size_t at) {
        const auto value = static_cast<std::int64_t>(values[at]);
        return std::find(source.within_ids.begin(), source.within_ids.end(), value) !=
               source.within_ids.end();
      });
    });
  } else {
    fill([](std::size_t) { return true; });
  }
  if (!any) return {};
  if (source.close_mm > 0) close_gaps(mask, grid.spacing, source.close_mm, context);
  if (source.ids.empty()) {
    fill_hollows(mask);
    drop_specks(mask, kSpeck);
  }
  return mask;
}

}  // namespace ecorche::label_surfaces
