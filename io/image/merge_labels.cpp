// SPDX-License-Identifier: Apache-2.0
#include "io/image/merge_labels.hpp"

#include <algorithm>

#include <ecorche/values/error.hpp>
#include "io/image/renumber.hpp"

namespace ecorche::io {
namespace {

constexpr std::size_t kMostIds = 65535;

std::set<std::int64_t> ids_of(const Segmentation& map) {
  std::set<std::int64_t> ids;
  for (const Image& layer : map.layers) {
    const auto more = distinct_values(layer, kMostIds);
    ids.insert(more.begin(), more.end());
    if (ids.size() > kMostIds)
      throw Error(ErrorKind::data, "labels", "a label map has more than 65535 ids",
                  "is it a label map, or a picture?");
  }
  ids.erase(0);
  return ids;
}

}  // namespace

void leave_out(Segmentation& map, const std::set<std::int64_t>& ids) {
  for (Image& layer : map.layers) {
    with_scalar_type(layer.type, [&](auto zero) {
      using T = decltype(zero);
      T last{};
      bool gone = false;
      for (T& voxel : layer.scalars<T>()) {
        if (voxel != last) {
          last = voxel;
          gone = ids.contains(static_cast<std::int64_t>(last));
        }
        if (gone) voxel = T{};
      }
    });
  }
  for (const std::int64_t id : ids) {
    map.names.erase(id);
    map.codes.erase(id);
  }
}

Segmentation merged(std::vector<Segmentation> maps) {
  if (maps.size() == 1) return std::move(maps.front());
  Segmentation out;
  const ImageGrid grid = maps.front().layers.front().grid;
  std::vector<std::uint8_t> taken(grid.voxels(), 0);
  std::uint32_t next = 1;
  for (Segmentation& map : maps) {
    std::map<std::int64_t, std::uint16_t> numbers;
    for (const std::int64_t id : ids_of(map)) {
      if (next > kMostIds)
        throw Error(ErrorKind::data, "labels", "the label maps have more than 65535 ids together",
                    "leave some out");
      const auto number = static_cast<std::uint16_t>(next++);
      numbers.emplace(id, number);
      if (const auto name = map.names.find(id); name != map.names.end())
        out.names.emplace(number, name->second);
      if (const auto code = map.codes.find(id); code != map.codes.end())
        out.codes.emplace(number, code->second);
    }
    for (std::size_t layer = 0; layer < map.layers.size(); ++layer) {
      if (layer == out.layers.size()) out.layers.emplace_back(grid, ScalarType::u16);
      const Image numbered = renumber(map.layers[layer], numbers);
      const auto from = numbered.scalars<std::uint16_t>();
      const auto to = out.layers[layer].scalars<std::uint16_t>();
      for (std::size_t v = 0; v < from.size(); ++v) {
        if (from[v] != 0 && taken[v] == 0) to[v] = from[v];
      }
    }
    map = {};  // its memory is not needed any more
    for (const Image& layer : out.layers) {
      const auto voxels = layer.scalars<std::uint16_t>();
      for (std::size_t v = 0; v < voxels.size(); ++v) taken[v] |= static_cast<std::uint8_t>(voxels[v] != 0);
    }
  }
  return out;
}

}  // namespace ecorche::io
