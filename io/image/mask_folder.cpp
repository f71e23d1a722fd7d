// SPDX-License-Identifier: Apache-2.0
#include "io/image/mask_folder.hpp"

#include <algorithm>
#include <array>
#include <optional>

#include "core/values/text.hpp"
#include "io/image/header_fields.hpp"
#include "io/image/image_file.hpp"
#include "io/image/same_grid.hpp"

namespace ecorche::io {
namespace {

using Path = std::filesystem::path;

constexpr std::array<std::string_view, 6> kEndings{".nii.gz", ".nii", ".nrrd", ".nhdr", ".mha", ".mhd"};
constexpr std::size_t kMostMasks = 4096;

struct Mask {
  std::vector<std::uint8_t> inside;
  std::size_t voxels = 0;
};

// What is not 0; refuses more than one other value.
Mask mask_of(const Image& image, const Path& path) {
  Mask mask;
  mask.inside.resize(image.grid.voxels());
  with_scalar_type(image.type, [&](auto zero) {
    using T = decltype(zero);
    const auto voxels = image.scalars<T>();
    T value{};
    for (std::size_t v = 0; v < voxels.size(); ++v) {
      if (voxels[v] == T{}) continue;
      if (value == T{}) value = voxels[v];
      if (voxels[v] != value)
        fields::refuse(path,
                       "is no mask: it holds several labels, among them " +
                           std::to_string(static_cast<std::int64_t>(value)) + " and " +
                           std::to_string(static_cast<std::int64_t>(voxels[v])),
                       "name it by itself, as a label map");
      mask.inside[v] = 1;
      ++mask.voxels;
    }
  });
  return mask;
}

bool free_for(const Image& layer, const Mask& mask) {
  const auto voxels = layer.scalars<std::uint16_t>();
  for (std::size_t v = 0; v < voxels.size(); ++v) {
    if (mask.inside[v] != 0 && voxels[v] != 0) return false;
  }
  return true;
}

void put(Image& layer, const Mask& mask, std::uint16_t id) {
  const auto voxels = layer.scalars<std::uint16_t>();
  for (std::size_t v = 0; v < voxels.size(); ++v) {
    if (mask.inside[v] != 0) voxels[v] = id;
  }
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

Segmentation read_masks(const std::vector<Path>& files, const files::ReadOptions& options,
                        const Context& context, std::size_t* empty) {
  Segmentation out;
  std::map<std::int64_t, std::string> names;
  std::optional<ImageGrid> grid;
  std::size_t done = 0, absent = 0;
  if (files.size() > kMostMasks)
    fields::refuse(files.front().parent_path(), "holds " + std::to_string(files.size()) + " masks",
                   "a folder may hold 4096");
  for (const Path& path : files) {
    context.check_stop();
    const Image image = read_label_image(path, options);
    if (image.components != 1)
      fields::refuse(path, "its voxels are not one whole number each", "save a mask");
    if (!grid) grid = image.grid;
    if (!same_place(image.grid, *grid))
      fields::refuse(
          path,
          "its voxels are not those of " + files.front().filename().string() + ": " + described(image.grid) +
              ", not " + described(*grid),
          "resample it onto the grid of the others by nearest neighbour, or move it to a folder of its own");
    const Mask mask = mask_of(image, path);
    context.report(static_cast<double>(++done) / static_cast<double>(files.size()));
    if (mask.voxels == 0) {
      ++absent;
      continue;
    }
    const auto id = static_cast<std::uint16_t>(names.size() + 1);
    names.emplace(id, image_stem(path));
    auto layer =
        std::find_if(out.layers.begin(), out.layers.end(), [&](const Image& l) { return free_for(l, mask); });
    if (layer == out.layers.end()) layer = out.layers.insert(layer, Image(*grid, ScalarType::u16));
    put(*layer, mask, id);
  }
  if (empty != nullptr) *empty = absent;
  if (names.empty()) {
    const Path folder = files.empty() ? Path() : files.front().parent_path();
    fields::refuse(
        folder,
        files.empty() ? "holds no image" : "each of its " + std::to_string(files.size()) + " masks is empty",
        "name a folder of masks: femur_left.nii.gz, ...");
  }
  out.names = make_identifiers(names);
  return out;
}

}  // namespace ecorche::io
