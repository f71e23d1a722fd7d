// SPDX-License-Identifier: Apache-2.0
#include "io/image/mask_folder.hpp"

#include <algorithm>
#include <array>
#include <optional>

#include "core/values/text.hpp"
#include "io/image/equal_run.hpp"
#include "io/image/header_fields.hpp"
#include "io/image/image_file.hpp"
#include "io/image/same_grid.hpp"

namespace ecorche::io {
namespace {

using Path = std::filesystem::path;

constexpr std::array<std::string_view, 6> kEndings{".nii.gz", ".nii", ".nrrd", ".nhdr", ".mha", ".mhd"};
constexpr std::size_t kMostMasks = 4096;

using Run = Mask::Run;

template <class T>
std::optional<std::vector<Run>> runs_of(std::span<const T> voxels) {
  std::vector<Run> out;
  T value{};
  const T *const first = voxels.data(), *const last = first + voxels.size();
  for (const T* at = first; at != last;) {
    const T* const end = end_of_run(at, last);
    if (*at != T{}) {
      if (value == T{}) value = *at;
      if (*at != value) return std::nullopt;
      out.push_back({static_cast<std::uint64_t>(at - first), static_cast<std::uint64_t>(end - first)});
    }
    at = end;
  }
  return out;
}

// Two values of an image that is no mask.
std::string two_values(const Image& image) {
  return with_scalar_type(image.type, [&](auto zero) {
    using T = decltype(zero);
    const auto voxels = image.scalars<T>();
    const auto first = std::find_if(voxels.begin(), voxels.end(), [](T v) { return v != T{}; });
    const auto other = std::find_if(first, voxels.end(), [&](T v) { return v != T{} && v != *first; });
    return std::to_string(static_cast<std::int64_t>(*first)) + " and " +
           std::to_string(static_cast<std::int64_t>(*other));
  });
}

void check_count(std::size_t masks, const Path& folder) {
  if (masks > kMostMasks)
    fields::refuse(folder, "holds " + std::to_string(masks) + " masks", "a folder may hold 4096");
}

bool free_for(const Image& layer, const std::vector<Run>& runs) {
  const auto voxels = layer.scalars<std::uint16_t>();
  return std::all_of(runs.begin(), runs.end(), [&](const Run& run) {
    return std::all_of(voxels.data() + run.begin, voxels.data() + run.end,
                       [](std::uint16_t v) { return v == 0; });
  });
}

}  // namespace

std::string image_stem(const Path& path) {
  const std::string name = path.filename().string(), small = text::lower(name);
  for (const std::string_view ending : kEndings) {
    if (small.ends_with(ending) && small.size() > ending.size()) {
      std::string stem = name.substr(0, name.size() - ending.size());
      if (text::lower(stem).ends_with(".seg")) stem.resize(stem.size() - 4);
      return stem;
    }
  }
  return path.stem().string();
}

bool is_image_name(const Path& path) {
  const std::string name = text::lower(path.filename().string());
  return std::any_of(kEndings.begin(), kEndings.end(), [&](std::string_view e) { return name.ends_with(e); });
}

std::vector<Path> images_within(const Path& folder) {
  std::vector<Path> out;
  std::error_code error;
  for (std::filesystem::directory_iterator at(folder, error);
       !error && at != std::filesystem::directory_iterator(); at.increment(error)) {
    const std::string name = at->path().filename().string();
    if (at->is_regular_file(error) && !name.starts_with('.') && is_image_name(at->path()))
      out.push_back(at->path());
  }
  if (error) throw Error(ErrorKind::missing_input, folder.string(), "cannot be listed", "check its rights");
  std::sort(out.begin(), out.end());
  return out;
}

std::optional<Mask> as_mask(const Image& image) {
  if (image.components != 1) return std::nullopt;
  return with_scalar_type(image.type, [&](auto zero) -> std::optional<Mask> {
    auto runs = runs_of(image.scalars<decltype(zero)>());
    if (!runs) return std::nullopt;
    return Mask{image.grid, std::move(*runs)};
  });
}

std::optional<Image> as_binary(const Image& image) {
  const std::optional<Mask> mask = as_mask(image);
  if (!mask || mask->runs.empty()) return std::nullopt;
  Image out(image.grid, ScalarType::u8);
  const auto voxels = out.scalars<std::uint8_t>();
  for (const Run& run : mask->runs) std::fill(voxels.data() + run.begin, voxels.data() + run.end, 1);
  const bool whole = std::find(voxels.begin(), voxels.end(), 0) == voxels.end();
  const bool positive = with_scalar_type(image.type, [&](auto zero) {
    const auto value = image.scalars<decltype(zero)>()[mask->runs.front().begin];
    return value > zero || static_cast<double>(value) == -1;
  });
  if (whole || !positive) return std::nullopt;
  return out;
}

std::size_t count_shares(const Image& image) {
  if (image.components != 1) return 0;
  return with_scalar_type(image.type, [&](auto zero) -> std::size_t {
    std::size_t out = 0;
    for (const auto value : image.scalars<decltype(zero)>()) {
      const double v = static_cast<double>(value);
      if (v < 0 || v > 1) return 0;
      out += v == 0 || v == 1 ? 0 : 1;
    }
    return out;
  });
}

void MaskLayers::add(const Mask& mask, const Path& path) {
  if (count_++ == 0) first_ = path.filename().string();
  check_count(count_, path.parent_path());
  if (!grid_) grid_ = mask.grid;
  if (!same_place(mask.grid, *grid_))
    fields::refuse(
        path,
        "its voxels are not those of " + first_ + ": " + described(mask.grid) + ", not " + described(*grid_),
        "resample it onto the grid of the others by nearest neighbour, or move it to a folder of its own");
  if (mask.runs.empty()) {
    ++empty_;
    return;
  }
  const auto id = static_cast<std::uint16_t>(names_.size() + 1);
  names_.emplace(id, image_stem(path));
  auto layer = std::find_if(out_.layers.begin(), out_.layers.end(),
                            [&](const Image& l) { return free_for(l, mask.runs); });
  if (layer == out_.layers.end()) layer = out_.layers.insert(layer, Image(*grid_, ScalarType::u16));
  const auto voxels = layer->scalars<std::uint16_t>();
  for (const Run& run : mask.runs) std::fill(voxels.data() + run.begin, voxels.data() + run.end, id);
}

Segmentation MaskLayers::take(const Path& folder) {
  if (names_.empty()) {
    fields::refuse(
        folder, count_ == 0 ? "holds no image" : "each of its " + std::to_string(count_) + " masks is empty",
        "name a folder of masks: femur_left.nii.gz, ...");
  }
  out_.names = make_identifiers(names_);
  return std::move(out_);
}

Segmentation read_masks(const std::vector<Path>& files, const files::ReadOptions& options,
                        const Context& context, std::size_t* empty) {
  const Path folder = files.empty() ? Path() : files.front().parent_path();
  check_count(files.size(), folder);
  MaskLayers layers;
  std::size_t done = 0;
  for (const Path& path : files) {
    context.check_stop();
    const Image image = read_label_image(path, options);
    if (image.components != 1)
      fields::refuse(path, "its voxels are not one whole number each", "save a mask");
    const std::optional<Mask> mask = as_mask(image);
    if (!mask)
      fields::refuse(path, "is no mask: it holds several labels, among them " + two_values(image),
                     "name it by itself, as a label map");
    layers.add(*mask, path);
    context.report(static_cast<double>(++done) / static_cast<double>(files.size()));
  }
  if (empty != nullptr) *empty = layers.empty();
  return layers.take(folder);
}

}  // namespace ecorche::io
