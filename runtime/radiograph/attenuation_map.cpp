// SPDX-License-Identifier: Apache-2.0
#include <tbb/enumerable_thread_specific.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include <ecorche/runtime/radiograph.hpp>
#include <ecorche/values/error.hpp>

namespace ecorche::runtime {
namespace {

using Index3 = std::array<std::int32_t, 3>;

// A ray that leaves the crop sees this many empty voxels below and above: those above are a cell's far
// corner.
constexpr std::int32_t kBelow = 1, kAbove = 2;
constexpr std::size_t kBehind = 2;  // the last voxel is loaded with what comes behind it
constexpr float kLargestStep = 65535;
constexpr double kMostHu = 65535;  // no scanner says more

// The box of voxels that attenuate, and the densest.
struct Content {
  Index3 first, last{-1, -1, -1};
  double most_hu = -1000;

  Content() { first.fill(std::numeric_limits<std::int32_t>::max()); }
  void add(const Content& other) {
    for (std::size_t a = 0; a < 3; ++a) {
      first[a] = std::min(first[a], other.first[a]);
      last[a] = std::max(last[a], other.last[a]);
    }
    most_hu = std::max(most_hu, other.most_hu);
  }
};

template <class F>
void each_slice(std::int32_t slices, const Context& context, F&& f) {
  tbb::parallel_for(0, slices, [&](std::int32_t k) {
    if (!context.stop.stop_requested()) f(k);
  });
  context.check_stop();
}

template <class T>
Content content_of(const Image& hu, const Context& context) {
  const T* values = hu.scalars<T>().data();
  const Index3 size = hu.grid.size;
  tbb::enumerable_thread_specific<Content> found;
  each_slice(size[2], context, [&](std::int32_t k) {
    Content& mine = found.local();
    for (std::int32_t j = 0; j < size[1]; ++j) {
      const T* row = values + hu.grid.offset(0, j, k);
      const auto attenuates = [](T v) { return static_cast<double>(v) > -1000; };
      const T* const end = row + size[0];
      const T* const begin = std::find_if(row, end, attenuates);
      if (begin == end) continue;
      const T* back = end - 1;
      while (!attenuates(*back)) --back;
      Content one;
      one.first = {static_cast<std::int32_t>(begin - row), j, k};
      one.last = {static_cast<std::int32_t>(back - row), j, k};
      T most = *begin;
      for (const T* v = begin; v <= back; ++v) most = *v > most ? *v : most;
      one.most_hu = static_cast<double>(most);
      mine.add(one);
    }
  });
  Content all;
  for (const Content& one : found) all.add(one);
  return all;
}

// Attenuation::of_hu in steps, without branches: the loop over it becomes vectors.
struct Steps {
  float per_hu, beyond_water;

  Steps(const Attenuation& attenuation, double step)
      : per_hu(static_cast<float>(attenuation.water() / 1000 / step)),
        beyond_water(static_cast<float>(attenuation.beyond_water() / step)) {}

  std::uint16_t operator()(float hu) const {
    const float above_air = hu + 1000;
    const float steps = per_hu * (above_air > 0 ? above_air : 0) + beyond_water * (hu > 0 ? hu : 0) + 0.5F;
    return static_cast<std::uint16_t>(static_cast<std::int32_t>(steps < kLargestStep ? steps : kLargestStep));
  }
};

// The blocks of a line of voxels that are not empty.
void mark(const std::uint16_t* line, std::int32_t size, std::uint8_t* occupied) {
  for (std::int32_t i = 0; i < size; i += AttenuationMap::block) {
    const std::int32_t end = std::min(i + AttenuationMap::block, size);
    std::uint16_t any = 0;
    for (std::int32_t at = i; at < end; ++at) any = static_cast<std::uint16_t>(any | line[at]);
    if (any != 0) occupied[i / AttenuationMap::block] = 1;
  }
}

// Every number of `out` is written, those of the border as well: its memory may be old.
template <class T>
void fill(const Image& hu, const Attenuation& attenuation, const Index3& first, AttenuationMap& out,
          const Context& context) {
  const Steps steps_of(attenuation, out.step);
  const T* values = hu.scalars<T>().data();
  const Index3& padded = out.grid.size;
  const auto border = [&padded](std::size_t a, std::int32_t at) {
    return at < kBelow || at >= padded[a] - kAbove;
  };
  // A layer of blocks is one thread's.
  each_slice(out.blocks[2], context, [&](std::int32_t layer) {
    const std::int32_t end = std::min((layer + 1) * AttenuationMap::block, padded[2]);
    for (std::int32_t k = layer * AttenuationMap::block; k < end; ++k) {
      for (std::int32_t j = 0; j < padded[1]; ++j) {
        std::uint16_t* const line = &out.steps[out.grid.offset(0, j, k)];
        if (out.step == 0 || border(2, k) || border(1, j)) {
          std::fill_n(line, padded[0], std::uint16_t{0});
          continue;
        }
        const std::int32_t wide = padded[0] - kBelow - kAbove;
        const T* row = values + hu.grid.offset(first[0], first[1] + j - kBelow, first[2] + k - kBelow);
        std::uint16_t* const to = std::fill_n(line, kBelow, std::uint16_t{0});
        for (std::int32_t i = 0; i < wide; ++i) to[i] = steps_of(static_cast<float>(row[i]));
        std::fill_n(to + wide, kAbove, std::uint16_t{0});
        const std::int32_t blocks = (layer * out.blocks[1] + j / AttenuationMap::block) * out.blocks[0];
        mark(line, padded[0], &out.occupied[static_cast<std::size_t>(blocks)]);
      }
    }
  });
  std::fill_n(&out.steps[out.grid.voxels()], kBehind, std::uint16_t{0});
}

}  // namespace

void attenuation_map(const Image& hu, const Attenuation& attenuation, AttenuationMap& out,
                     const Context& context) {
  if (hu.components != 1)
    throw Error(ErrorKind::usage, "radiograph", "the volume has several components a voxel",
                "name one of Hounsfield units");
  with_scalar_type(hu.type, [&](auto zero) {
    using T = decltype(zero);
    Content content = content_of<T>(hu, context);
    if (content.last[0] < 0) content.first = content.last = {0, 0, 0};  // nothing but air: one empty voxel
    out.grid = hu.grid;
    double voxels = 1;
    for (std::size_t a = 0; a < 3; ++a) {
      out.grid.size[a] = content.last[a] - content.first[a] + 1 + kBelow + kAbove;
      voxels *= out.grid.size[a];
    }
    if (voxels > static_cast<double>(1 << 30))
      throw Error(ErrorKind::usage, "radiograph", "the volume has more than 2^30 voxels",
                  "make its voxels larger");
    out.grid.origin =
        hu.grid.point(content.first[0] - kBelow, content.first[1] - kBelow, content.first[2] - kBelow);
    out.step = attenuation.of_hu(std::min(content.most_hu, kMostHu)) / 65535;
    const std::size_t count = out.grid.voxels() + kBehind;
    if (out.room < count) {  // first written by those who fill it, not here
      out.room = 0;
      out.steps = std::make_unique_for_overwrite<std::uint16_t[]>(count);
      out.room = count;
    }
    std::size_t blocks = 1;
    for (std::size_t a = 0; a < 3; ++a) {
      out.blocks[a] = (out.grid.size[a] + AttenuationMap::block - 1) / AttenuationMap::block;
      blocks *= static_cast<std::size_t>(out.blocks[a]);
    }
    out.occupied.assign(blocks, 0);
    fill<T>(hu, attenuation, content.first, out, context);
  });
}

AttenuationMap attenuation_map(const Image& hu, const Attenuation& attenuation, const Context& context) {
  AttenuationMap out;
  attenuation_map(hu, attenuation, out, context);
  return out;
}

}  // namespace ecorche::runtime
