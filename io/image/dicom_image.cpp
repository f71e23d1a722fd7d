// SPDX-License-Identifier: Apache-2.0
#include "io/image/dicom_image.hpp"

#include <algorithm>
#include <cmath>
#include <fstream>
#include <limits>
#include <map>
#include <memory>

#include "core/files/staged_folder.hpp"
#include "io/image/dicom_pixels.hpp"
#include "io/image/dicom_resampling.hpp"
#include "io/image/dicom_stack.hpp"
#include "io/image/header_fields.hpp"

namespace ecorche::io {
namespace {

using namespace dicom;
using fields::refuse;
namespace fs = std::filesystem;

ScalarType stored_type(const StoredPixels& pixels) {
  switch (pixels.allocated) {
    case 8:
      return pixels.is_signed ? ScalarType::i8 : ScalarType::u8;
    case 16:
      return pixels.is_signed ? ScalarType::i16 : ScalarType::u16;
    default:
      return pixels.is_signed ? ScalarType::i32 : ScalarType::u32;
  }
}

// What stands beside the stored bits (overlays, in old files) goes, and the sign comes in. The least and
// largest value.
template <class T>
std::array<double, 2> clean(std::span<T> values, const StoredPixels& pixels) {
  using U = std::make_unsigned_t<T>;
  constexpr int width = std::numeric_limits<U>::digits;
  const int above = width - 1 - pixels.high, below = pixels.high + 1 - pixels.stored;
  if (above > 0 || below > 0) {
    for (T& value : values) {
      const auto left = static_cast<U>(static_cast<U>(value) << above);
      value = static_cast<T>(static_cast<T>(left) >> (above + below));
    }
  }
  const auto [low, high] = std::minmax_element(values.begin(), values.end());
  return {static_cast<double>(*low), static_cast<double>(*high)};
}

struct Values {
  bool plain = true, whole = true;  ///< neither slope nor intercept; both whole numbers
  double low = std::numeric_limits<double>::infinity(), high = -low;

  void add(const Slice& slice, const std::array<double, 2>& range) {
    plain = plain && slice.slope == 1 && slice.intercept == 0;
    for (const double x : {slice.slope, slice.intercept})
      whole = whole && x == std::floor(x) && std::abs(x) < 1e9;
    for (const double stored : range) {
      const double value = stored * slice.slope + slice.intercept;
      low = std::min(low, value);
      high = std::max(high, value);
    }
  }
  ScalarType type(ScalarType stored) const {
    if (plain) return stored;
    const auto fits = [&](double least, double most) { return whole && low >= least && high <= most; };
    if (fits(-32768, 32767)) return ScalarType::i16;
    if (fits(0, 65535)) return ScalarType::u16;
    return fits(std::numeric_limits<std::int32_t>::min(), std::numeric_limits<std::int32_t>::max())
               ? ScalarType::i32
               : ScalarType::f32;
  }
};

template <class From, class To>
void rescale(std::span<const From> from, std::span<To> to, const Slice& slice) {
  if constexpr (std::is_integral_v<To>) {
    const auto slope = static_cast<std::int64_t>(slice.slope),
               add = static_cast<std::int64_t>(slice.intercept);
    for (std::size_t i = 0; i < from.size(); ++i)
      to[i] = static_cast<To>(static_cast<std::int64_t>(from[i]) * slope + add);
  } else {
    for (std::size_t i = 0; i < from.size(); ++i)
      to[i] = static_cast<To>(static_cast<double>(from[i]) * slice.slope + slice.intercept);
  }
}

// The stored numbers of all slices become values; where they are as wide, in place.
Image rescaled(Image stored, const std::vector<Slice>& slices, ScalarType type, files::Budget& budget) {
  if (type == stored.type && std::all_of(slices.begin(), slices.end(), [](const Slice& one) {
        return one.slope == 1 && one.intercept == 0;
      }))
    return stored;
  const bool same_width = scalar_bytes(type) == scalar_bytes(stored.type);
  Image made;
  if (!same_width) {
    budget.spend(stored.grid.voxels(), scalar_bytes(type));
    made = Image(stored.grid, type);
  }
  const std::size_t plane = stored.grid.voxels() / slices.size();
  with_scalar_type(stored.type, [&](auto from_zero) {
    using From = decltype(from_zero);
    with_scalar_type(type, [&](auto to_zero) {
      using To = decltype(to_zero);
      std::byte* into = same_width ? stored.bytes.data() : made.bytes.data();
      for (std::size_t k = 0; k < slices.size(); ++k) {
        rescale<From, To>(std::span(reinterpret_cast<const From*>(stored.bytes.data()) + k * plane, plane),
                          std::span(reinterpret_cast<To*>(into) + k * plane, plane), slices[k]);
      }
    });
  });
  if (!same_width) return made;
  stored.type = type;
  return stored;
}

// All slices as they lie in the files, one behind the other.
Image read_slices(const PlacedStack& stack, files::Budget& budget, const fs::path& path) {
  const StoredPixels& first = stack.slices.front().file->pixels;
  ImageGrid grid = stack.grid;
  grid.size = {static_cast<std::int32_t>(first.columns), static_cast<std::int32_t>(first.rows),
               static_cast<std::int32_t>(stack.slices.size())};
  const ScalarType type = stored_type(first);
  const std::size_t plane = std::size_t{first.columns} * first.rows * scalar_bytes(type);
  if (plane * stack.slices.size() > largest_image_bytes)
    refuse(path, "holds more than 2^33 bytes of voxels", "choose a part of it");
  budget.spend(stack.slices.size(), plane);
  Image stored(grid, type);
  Values values;
  std::unique_ptr<PixelFile> file;
  const SliceFile* open = nullptr;
  for (std::size_t k = 0; k < stack.slices.size(); ++k) {
    const Slice& slice = stack.slices[k];
    if (open != slice.file.get()) {
      file = std::make_unique<PixelFile>(slice.file->path, slice.file->bytes, slice.file->pixels);
      open = slice.file.get();
    }
    const std::span<std::byte> out = std::span(stored.bytes).subspan(k * plane, plane);
    file->read(slice.frame, out);
    with_scalar_type(type, [&](auto zero) {
      using T = decltype(zero);
      if constexpr (std::is_integral_v<T>)
        values.add(slice,
                   clean(std::span(reinterpret_cast<T*>(out.data()), plane / sizeof(T)), slice.file->pixels));
    });
  }
  return rescaled(std::move(stored), stack.slices, values.type(type), budget);
}

void say_what_it_is(const PlacedStack& stack, const fs::path& path, const files::ReadOptions& options) {
  if (stack.slices.front().file->monochrome1)
    options.say(path.string() + ": low values are drawn bright (MONOCHROME1): values are taken as they are");
}

}  // namespace

std::vector<fs::path> dicom_files(const fs::path& path) {
  std::error_code error;
  if (!fs::is_directory(path, error)) return {path};
  std::vector<fs::path> out;
  for (const fs::path& name : files::files_within(path)) {
    std::ifstream file(path / name, std::ios::binary);
    std::array<char, 144> head{};
    file.read(head.data(), head.size());
    const std::string_view begin(head.data(), static_cast<std::size_t>(file.gcount()));
    // A DICOMDIR lists the others.
    if (is_data_set(begin) && name.filename() != "DICOMDIR") out.push_back(path / name);
  }
  return out;
}

bool holds_slices(const fs::path& path, const files::ReadOptions& options) {
  const std::vector<fs::path> files = dicom_files(path);
  return std::any_of(files.begin(), files.end(),
                     [&](const fs::path& file) { return shows_slices(read_data_set(file, options)); });
}

Image read_dicom(const fs::path& path, const files::ReadOptions& options, const ImageChoice& choice,
                 bool labels) {
  std::vector<Slice> slices;
  std::uint64_t bytes = 0;
  const std::vector<fs::path> files = dicom_files(path);
  std::string segmentation;
  for (const fs::path& file : files) {
    const DataSet set = read_data_set(file, options);
    bytes += set.file_bytes;
    std::vector<Slice> more = slices_of(set);
    if (set.top.text(kClass) == kSegmentationClass) segmentation = file.filename().string();
    std::move(more.begin(), more.end(), std::back_inserter(slices));
  }
  if (slices.empty()) {
    if (!segmentation.empty())
      refuse(path, "holds a segmentation (" + segmentation + "), and no picture", "name it under labels");
    refuse(path, "holds " + std::to_string(files.size()) + " DICOM files, and no slices of an image",
           "name the folder of a CT or MR series");
  }
  const PlacedStack stack = placed(chosen_stack(stacks_of(std::move(slices), path), choice.series, path),
                                   choice.phase, path, options);
  say_what_it_is(stack, path, options);
  const bool interpolated = !stack.shift.empty() || !stack.at.empty();
  if (interpolated && labels)
    refuse(path, "its slices are tilted or at uneven distances, and labels cannot be interpolated",
           "resample the label map by nearest neighbour");
  files::Budget budget = files::Budget::of_image(bytes, options.limits, path.string());
  Image image = read_slices(stack, budget, path);
  if (interpolated) return resampled(image, stack, budget);
  return image;
}

}  // namespace ecorche::io
