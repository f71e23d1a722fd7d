// SPDX-License-Identifier: Apache-2.0
#include "io/image/scan_slices.hpp"

#include <algorithm>
#include <cmath>

#include "core/values/text.hpp"
#include "io/image/dicom.hpp"
#include "io/image/dicom_image.hpp"
#include "io/image/dicom_stack.hpp"
#include "io/image/header_fields.hpp"
#include "io/image/image_file.hpp"

namespace ecorche::io {
namespace {

using dicom::dot;
using dicom::Vector;

constexpr double kPlaced = 2e-3;  // mm; DICOM writes positions in sixteen letters
constexpr double kRight = 1e-3;   // sine of what rows and columns may be off

Vector axis_of(const ImageGrid& grid, std::size_t a) {
  return {grid.direction[a], grid.direction[3 + a], grid.direction[6 + a]};
}

ScanSlices of_series(const std::filesystem::path& path, const files::ReadOptions& options,
                     const ImageChoice& choice) {
  std::vector<dicom::Slice> slices;
  for (const std::filesystem::path& file : dicom_files(path)) {
    std::vector<dicom::Slice> more = dicom::slices_of(dicom::read_data_set(file, options));
    std::move(more.begin(), more.end(), std::back_inserter(slices));
  }
  if (slices.empty())
    fields::refuse(path, "holds no slices of an image", "name the folder of the series that was scanned");
  const dicom::PlacedStack stack =
      dicom::placed(dicom::chosen_stack(dicom::stacks_of(std::move(slices), path), choice.series, path),
                    choice.phase, path, {options.limits, {}});
  const dicom::StoredPixels& pixels = stack.slices.front().file->pixels;
  ScanSlices out{stack.grid, {}};
  out.grid.origin = stack.slices.front().position;
  out.grid.size = {static_cast<std::int32_t>(pixels.columns), static_cast<std::int32_t>(pixels.rows),
                   static_cast<std::int32_t>(stack.slices.size())};
  for (const dicom::Slice& slice : stack.slices) out.positions.push_back(slice.position);
  return out;
}

ScanSlices of_affine(ImageGrid grid, const std::filesystem::path& path) {
  const Vector right = axis_of(grid, 0), down = axis_of(grid, 1), up = axis_of(grid, 2);
  if (std::abs(dot(right, down)) > kRight)
    fields::refuse(path, "its rows and columns are not at right angles, which no slice can be",
                   "leave out --resample slices");
  ScanSlices out{grid, {}};
  for (int k = 0; k < grid.size[2]; ++k) out.positions.push_back(grid.point(0, 0, k));
  Vector normal{right[1] * down[2] - right[2] * down[1], right[2] * down[0] - right[0] * down[2],
                right[0] * down[1] - right[1] * down[0]};
  if (dot(normal, up) < 0) {
    for (double& x : normal) x = -x;
  }
  out.grid.spacing[2] *= dot(normal, up);
  for (std::size_t row = 0; row < 3; ++row) out.grid.direction[3 * row + 2] = normal[row];
  return out;
}

}  // namespace

ImageGrid ScanSlices::slice(std::size_t k) const {
  ImageGrid out = grid;
  out.size[2] = 1;
  out.origin = positions[k];
  return out;
}

bool ScanSlices::even() const {
  const double most = std::max(kPlaced, 0.01 * grid.spacing[2]);  // as series are read
  for (std::size_t k = 0; k < positions.size(); ++k) {
    const Vector at = grid.point(0, 0, static_cast<double>(k));
    if (std::hypot(at[0] - positions[k][0], at[1] - positions[k][1], at[2] - positions[k][2]) > most)
      return false;
  }
  return true;
}

ScanSlices read_scan_slices(const std::filesystem::path& path, const files::ReadOptions& options,
                            const ImageChoice& choice) {
  if (is_dicom(path)) return of_series(path, options, choice);
  bool in_time = false;
  return of_affine(read_stored_image(path, {options.limits, {}}, choice.phase, in_time).grid, path);
}

}  // namespace ecorche::io
