// SPDX-License-Identifier: Apache-2.0
#include "preprocess/scan/ct_body.hpp"

#include <algorithm>

#include "preprocess/label_surfaces/nearest.hpp"
#include "preprocess/scan/pieces.hpp"

namespace ecorche::scan {
namespace {

using Voxels = std::vector<std::uint8_t>;

// To the nearest voxel whose `mask` is `value`, mm^2.
std::vector<float> squared_distance_to(const Voxels& mask, std::uint8_t value, const ImageGrid& grid,
                                       const Context& context) {
  std::vector<float> squared(mask.size());
  std::transform(mask.begin(), mask.end(), squared.begin(),
                 [&](std::uint8_t v) { return v == value ? 0.0F : label_surfaces::kFar; });
  std::vector<std::int32_t> none;
  label_surfaces::spread_nearest(squared, none, grid.size, grid.spacing, context);
  return squared;
}

// The largest piece of `mask`, and those that hold a known voxel.
Voxels patient_of(const Voxels& mask, const ImageGrid& grid, const Voxels& known, const Context& context) {
  Image labels(grid, ScalarType::u16);
  std::copy(mask.begin(), mask.end(), labels.scalars<std::uint16_t>().begin());
  const Pieces found = find_pieces(labels, {0, 1}, context);
  std::vector<std::uint8_t> kept(found.pieces.size(), 0);
  const auto largest = std::max_element(found.pieces.begin(), found.pieces.end(),
                                        [](const Piece& a, const Piece& b) { return a.voxels < b.voxels; });
  if (largest != found.pieces.end() && known.empty())
    kept[static_cast<std::size_t>(largest - found.pieces.begin())] = 1;
  const auto each = [&](auto&& f) {
    for (const Run& run : found.runs) {
      const std::size_t at = grid.offset(run.begin, run.j, run.k);
      f(run, at, at + static_cast<std::size_t>(run.end - run.begin));
    }
  };
  if (!known.empty()) {
    each([&](const Run& run, std::size_t begin, std::size_t end) {
      const auto* first = known.data() + begin;
      if (std::any_of(first, first + (end - begin), [](std::uint8_t v) { return v != 0; }))
        kept[run.piece] = 1;
    });
  }
  Voxels out(mask.size(), 0);
  each([&](const Run& run, std::size_t begin, std::size_t end) {
    if (kept[run.piece] != 0)
      std::fill(out.begin() + static_cast<std::ptrdiff_t>(begin),
                out.begin() + static_cast<std::ptrdiff_t>(end), std::uint8_t{1});
  });
  return out;
}

// In every layer of k: what its border does not reach through faces becomes inside.
void fill_layers(Voxels& mask, const ImageGrid& grid) {
  const int nx = grid.size[0], ny = grid.size[1];
  std::vector<std::int32_t> stack;
  const std::size_t layer = static_cast<std::size_t>(nx) * static_cast<std::size_t>(ny);
  for (int k = 0; k < grid.size[2]; ++k) {
    std::uint8_t* m = mask.data() + layer * static_cast<std::size_t>(k);
    const auto reach = [&](int i, int j) {
      std::uint8_t& v =
          m[static_cast<std::size_t>(j) * static_cast<std::size_t>(nx) + static_cast<std::size_t>(i)];
      if (v != 0) return;
      v = 2;
      stack.push_back(j * nx + i);
    };
    for (int i = 0; i < nx; ++i) reach(i, 0), reach(i, ny - 1);
    for (int j = 0; j < ny; ++j) reach(0, j), reach(nx - 1, j);
    while (!stack.empty()) {
      const int at = stack.back(), i = at % nx, j = at / nx;
      stack.pop_back();
      if (i > 0) reach(i - 1, j);
      if (i + 1 < nx) reach(i + 1, j);
      if (j > 0) reach(i, j - 1);
      if (j + 1 < ny) reach(i, j + 1);
    }
    for (std::size_t v = 0; v < layer; ++v) m[v] = m[v] == 2 ? 0 : 1;
  }
}

}  // namespace

CtBody find_body(const Image& image, double threshold, double bridge_mm, const Voxels& known,
                 const Context& context) {
  const ImageGrid& grid = image.grid;
  Voxels dense(grid.voxels(), 0);
  with_scalar_type(image.type, [&](auto zero) {
    const auto voxels = image.scalars<decltype(zero)>();
    for (std::size_t v = 0; v < dense.size(); ++v)
      dense[v] = static_cast<double>(voxels[v]) > threshold ? 1 : 0;
  });
  context.check_stop();
  // Hollows are filled last: a gap between the back and a bent table is none of the patient's.
  const auto radius = static_cast<float>(0.25 * bridge_mm * bridge_mm);
  std::vector<float> squared = squared_distance_to(dense, 0, grid, context);
  context.report(0.4);
  Voxels core(dense.size());
  std::transform(squared.begin(), squared.end(), core.begin(),
                 [&](float s) { return static_cast<std::uint8_t>(s > radius); });
  core = patient_of(core, grid, known, context.quiet());
  context.report(0.6);
  // Back to the skin: as far as it was worn down, and a little, but only into what was dense.
  squared = squared_distance_to(core, 1, grid, context);
  CtBody out;
  out.inside.resize(dense.size());
  double off = 0;
  for (std::size_t v = 0; v < dense.size(); ++v) {
    out.inside[v] = dense[v] != 0 && squared[v] <= 1.5F * radius ? 1 : 0;
    if (dense[v] != 0 && out.inside[v] == 0) off += 1;
  }
  out.taken_off_ml = off * grid.spacing[0] * grid.spacing[1] * grid.spacing[2] * 1e-3;
  fill_layers(out.inside, grid);
  context.report(1);
  return out;
}

}  // namespace ecorche::scan
