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

LabelBlocks::Layer LabelBlocks::read_layer(const Image& image, const Context& context) {
  Layer layer;
  layer.index.resize(image.grid.voxels());
  layer.ids = distinct_values(image, kMostIds);
  if (layer.ids.size() > kMostIds) {
    throw Error(ErrorKind::data, "labels", "the label map has more than 65536 ids",
                "is it a label map, or a picture?");
  }
  context.check_stop();
  with_scalar_type(image.type, [&](auto zero) {
    using T = decltype(zero);
    number(image.scalars<T>(), layer.ids, layer.index);
  });
  context.check_stop();
  const auto& n = image.grid.size;
  layer.boxes.assign(layer.ids.size(), {{n[0], n[1], n[2]}, {-1, -1, -1}});
  std::size_t at = 0;
  for (int k = 0; k < n[2]; ++k) {
    for (int j = 0; j < n[1]; ++j) {
      for (int i = 0; i < n[0];) {  // by runs of one id
        const std::uint16_t id = layer.index[at];
        int end = i + 1;
        ++at;
        for (; end < n[0] && layer.index[at] == id; ++end) ++at;
        Box& b = layer.boxes[id];
        b.low = {std::min(b.low[0], i), std::min(b.low[1], j), std::min(b.low[2], k)};
        b.high = {std::max(b.high[0], end - 1), std::max(b.high[1], j), std::max(b.high[2], k)};
        i = end;
      }
    }
  }
  return layer;
}

LabelBlocks::LabelBlocks(const CaseLabels& labels, const Context& context) : grid_(labels.image.grid) {
  layers_.push_back(read_layer(labels.image, context));
  for (const Image& overlap : labels.overlaps) layers_.push_back(read_layer(overlap, context));
}

std::vector<std::uint8_t> LabelBlocks::chosen(const LabelSource& source, const Layer& layer) {
  std::vector<std::uint8_t> chosen(layer.ids.size(), 0);
  for (std::size_t i = 0; i < chosen.size(); ++i) {
    chosen[i] = source.ids.empty()
                    ? layer.ids[i] != 0
                    : std::find(source.ids.begin(), source.ids.end(), layer.ids[i]) != source.ids.end();
  }
  return chosen;
}

LabelBlocks::Box LabelBlocks::box(const LabelSource& source) const {
  const auto& n = grid_.size;
  Box all{{n[0], n[1], n[2]}, {-1, -1, -1}};
  for (const Layer& layer : layers_) {
    const std::vector<std::uint8_t> take = chosen(source, layer);
    for (std::size_t i = 0; i < take.size(); ++i) {
      if (take[i] == 0) continue;
      for (std::size_t a = 0; a < 3; ++a) {
        all.low[a] = std::min(all.low[a], layer.boxes[i].low[a]);
        all.high[a] = std::max(all.high[a], layer.boxes[i].high[a]);
      }
    }
  }
  return all;
}

void LabelBlocks::keep_within(const Mask& body) {
  for (Layer& layer : layers_) {
    const auto nothing = std::lower_bound(layer.ids.begin(), layer.ids.end(), 0) - layer.ids.begin();
    if (nothing == std::ssize(layer.ids) || layer.ids[static_cast<std::size_t>(nothing)] != 0)
      continue;  // no voxel is outside
    std::size_t at = 0;
    for (int k = 0; k < grid_.size[2]; ++k) {
      for (int j = 0; j < grid_.size[1]; ++j) {
        for (int i = 0; i < grid_.size[0]; ++i, ++at) {
          const std::array<int, 3> v{i - body.low[0], j - body.low[1], k - body.low[2]};
          bool in = true;
          for (std::size_t a = 0; a < 3; ++a) in = in && v[a] >= 0 && v[a] < body.size[a];
          if (!in || body.inside[body.offset(v[0], v[1], v[2])] == 0)
            layer.index[at] = static_cast<std::uint16_t>(nothing);
        }
      }
    }
  }
}

std::size_t LabelBlocks::work(const LabelSource& source) const {
  const Box b = box(source);
  std::size_t voxels = 1;
  for (std::size_t a = 0; a < 3; ++a)
    voxels *= static_cast<std::size_t>(std::max(0, b.high[a] - b.low[a] + 1));
  return voxels;
}

Mask LabelBlocks::mask(const LabelSource& source, const Context& context) const {
  const ImageGrid& grid = grid_;
  const Box b = box(source);
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
  const auto fill_from = [&](const Layer& layer, const auto& allowed) {
    const std::vector<std::uint8_t> take = chosen(source, layer);
    for (int k = b.low[2]; k <= b.high[2]; ++k) {
      context.check_stop();
      for (int j = b.low[1]; j <= b.high[1]; ++j) {
        std::size_t from = grid.offset(b.low[0], j, k);
        std::size_t to = mask.offset(b.low[0] - mask.low[0], j - mask.low[1], k - mask.low[2]);
        for (int i = b.low[0]; i <= b.high[0]; ++i, ++from, ++to) {
          if (take[layer.index[from]] == 0 || !allowed(from) || !on_side(i, j, k)) continue;
          mask.inside[to] = 1;
          any = true;
        }
      }
    }
  };
  const auto fill = [&](const auto& allowed) {
    for (const Layer& layer : layers_) fill_from(layer, allowed);
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
