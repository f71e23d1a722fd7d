// SPDX-License-Identifier: Apache-2.0
#include "preprocess/thin/mask.hpp"

#include <algorithm>
#include <limits>
#include <sstream>
#include <string>

#include "preprocess/thin/runs.hpp"

namespace ecorche::thin {
namespace {

[[noreturn]] void refuse(const char* option, std::string what, std::string mend) {
  throw Error(ErrorKind::usage, option, std::move(what), std::move(mend));
}

void check(const Image& image, const Segmentation& how) {
  const bool real = image.type == ScalarType::f32 || image.type == ScalarType::f64;
  const bool range = how.low || how.high;
  if (how.component < 0 || how.component >= image.components) {
    refuse("--component",
           std::to_string(how.component) + " of an image with " + std::to_string(image.components) +
               " component(s) a voxel",
           "they count from 0");
  }
  if (range && !how.labels.empty()) refuse("--labels", "stands beside a threshold", "give one of the two");
  if (how.low && how.high && !(*how.low <= *how.high)) {
    std::ostringstream what;
    what << "the range " << *how.low << " to " << *how.high << " is empty";
    refuse("--threshold", what.str(), "the lower end comes first");
  }
  if (real && !how.labels.empty())
    refuse("--labels", "the voxels are " + std::string(scalar_name(image.type)) + ", no whole numbers",
           "give a threshold");
  if (real && !range)
    refuse("--threshold", "is needed for voxels of type " + std::string(scalar_name(image.type)),
           "say which values are the object, as LOW:HIGH");
}

template <class T, class F>
void mark(const Image& image, int component, const Context& context, std::vector<std::uint8_t>& inside,
          F&& is_object) {
  const auto values = image.scalars<T>();
  const auto step = static_cast<std::size_t>(image.components);
  const T* from = values.data() + component;
  constexpr std::size_t block = std::size_t{1} << 22;
  for (std::size_t at = 0; at < inside.size(); at += block) {
    context.check_stop();
    const std::size_t end = std::min(inside.size(), at + block);
    for (std::size_t v = at; v < end; ++v)
      inside[v] = is_object(from[v * step]) ? std::uint8_t{1} : std::uint8_t{0};
  }
}

}  // namespace

Mask segment(const Image& image, const Segmentation& how, const Context& context) {
  check(image, how);
  Mask mask{image.grid, std::vector<std::uint8_t>(image.grid.voxels())};
  std::vector<std::int64_t> labels = how.labels;
  std::sort(labels.begin(), labels.end());
  with_scalar_type(image.type, [&](auto zero) {
    using T = decltype(zero);
    if (how.low || how.high) {
      const double low = how.low.value_or(-std::numeric_limits<double>::infinity()),
                   high = how.high.value_or(std::numeric_limits<double>::infinity());
      mark<T>(image, how.component, context, mask.inside,
              [=](T v) { return static_cast<double>(v) >= low && static_cast<double>(v) <= high; });
    } else if (labels.empty()) {
      bool negative = false;
      mark<T>(image, how.component, context, mask.inside, [&](T v) {
        negative = negative || v < T{0};
        return v != T{0};
      });
      if (negative)
        refuse("--threshold", "is needed for values below 0, as of a CT: 0 is not their background",
               "say which values are the object, as LOW:HIGH, or --labels");
    } else {
      mark<T>(image, how.component, context, mask.inside, [&](T v) {
        return std::binary_search(labels.begin(), labels.end(), static_cast<std::int64_t>(v));
      });
    }
  });
  if (std::find(mask.inside.begin(), mask.inside.end(), 1) == mask.inside.end()) {
    throw Error(ErrorKind::data, "image", "no voxel is of the object",
                how.labels.empty() ? "look at the image's values and choose another threshold"
                                   : "look at which labels the image holds");
  }
  return how.largest ? largest_piece(mask, how.boundary, context) : mask;
}

Pieces pieces(const Mask& mask, Boundary boundary, const Context& context) {
  const Runs runs(mask, boundary, context);
  Pieces out;
  for (const std::size_t voxels : runs.piece_voxels()) {
    if (voxels == 0) continue;
    ++out.count;
    out.voxels += voxels;
    out.largest_voxels = std::max(out.largest_voxels, voxels);
  }
  return out;
}

Mask largest_piece(const Mask& mask, Boundary boundary, const Context& context) {
  const Runs runs(mask, boundary, context);
  const std::vector<std::size_t> voxels = runs.piece_voxels();
  const auto largest =
      static_cast<std::size_t>(std::max_element(voxels.begin(), voxels.end()) - voxels.begin());
  Mask out{mask.grid, std::vector<std::uint8_t>(mask.inside.size())};
  for (std::size_t r = 0; r < runs.all().size(); ++r) {
    const Run& run = runs.all()[r];
    if (runs.piece(r) == largest) std::fill_n(out.inside.begin() + run.begin, run.end - run.begin, 1);
  }
  return out;
}

std::vector<std::uint8_t> boundary_voxels(const Mask& mask, Boundary boundary) {
  const auto& n = mask.grid.size;
  const int reach = boundary == Boundary::faces_6 ? 1 : 3;
  std::vector<std::uint8_t> out(mask.inside.size());
  const auto background = [&](int i, int j, int k) {
    return i < 0 || j < 0 || k < 0 || i >= n[0] || j >= n[1] || k >= n[2] ||
           mask.inside[mask.grid.offset(i, j, k)] == 0;
  };
  std::size_t at = 0;
  for (int k = 0; k < n[2]; ++k) {
    for (int j = 0; j < n[1]; ++j) {
      for (int i = 0; i < n[0]; ++i, ++at) {
        if (mask.inside[at] == 0) continue;
        for (int b = 0; b < 27 && out[at] == 0; ++b) {
          const int x = b % 3 - 1, y = b / 3 % 3 - 1, z = b / 9 - 1;
          if (x * x + y * y + z * z <= reach && background(i + x, j + y, k + z)) out[at] = 1;
        }
      }
    }
  }
  return out;
}

}  // namespace ecorche::thin
