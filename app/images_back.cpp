// SPDX-License-Identifier: Apache-2.0
#include "app/images_back.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <map>
#include <nlohmann/json.hpp>

#include "runtime/volume/grid_affine.hpp"

namespace ecorche::app {
namespace {

using nlohmann::json;

std::span<const float> numbers(const PointsF& points) {
  return {points.data(), static_cast<std::size_t>(points.size())};
}

double first_value(const Image& image, std::size_t voxel) {
  return with_scalar_type(image.type, [&](auto zero) {
    const auto row = voxel * static_cast<std::size_t>(image.components);
    return static_cast<double>(image.scalars<decltype(zero)>()[row]);
  });
}

// Voxels of one lattice as bytes; none beyond its ends.
class Voxels {
 public:
  explicit Voxels(const Image& image)
      : image_(image), width_(scalar_bytes(image.type) * static_cast<std::size_t>(image.components)) {}

  const std::byte* at(const std::array<int, 3>& voxel) const {
    for (std::size_t a = 0; a < 3; ++a) {
      if (voxel[a] < 0 || voxel[a] >= image_.grid.size[a]) return nullptr;
    }
    return image_.bytes.data() + width_ * image_.grid.offset(voxel[0], voxel[1], voxel[2]);
  }
  bool same(const std::byte* a, const std::byte* b) const {
    return a != nullptr && b != nullptr && std::memcmp(a, b, width_) == 0;
  }

 private:
  const Image& image_;
  std::size_t width_;
};

std::array<int, 3> nearest(const ImageGrid& grid, const std::array<double, 3>& point) {
  std::array<int, 3> out{};
  const std::array<double, 3> index = grid.index(point);
  for (std::size_t a = 0; a < 3; ++a)
    out[a] = static_cast<int>(std::clamp(std::floor(index[a] + 0.5), -1.0, 2147483646.0));
  return out;
}

// All 26 neighbours that there are hold the same.
bool off_boundary(const Voxels& voxels, const std::array<int, 3>& at) {
  const std::byte* own = voxels.at(at);
  for (int n = 0; n < 27; ++n) {
    const std::byte* other = voxels.at({at[0] + n % 3 - 1, at[1] + n / 3 % 3 - 1, at[2] + n / 9 - 1});
    if (other != nullptr && !voxels.same(own, other)) return false;
  }
  return true;
}

// The group of the tissue of a point of the scan; empty outside the body.
class Groups {
 public:
  explicit Groups(const Model& model) {
    const auto labels = std::find_if(model.volumes.begin(), model.volumes.end(),
                                     [](const ModelVolume& volume) { return volume.labels; });
    if (labels == model.volumes.end()) return;
    labels_ = &labels->image;
    for (const auto& row : labels->table) {
      const auto tissue = std::find_if(model.tissues.begin(), model.tissues.end(),
                                       [&](const Tissue& one) { return one.name == row.second; });
      if (tissue != model.tissues.end()) group_[row.first] = group_name(tissue->group);
    }
  }

  std::string_view of(const std::array<double, 3>& point) const {
    if (labels_ == nullptr) return "all";
    const std::array<int, 3> voxel = nearest(labels_->grid, point);
    if (Voxels(*labels_).at(voxel) == nullptr) return {};
    const auto id =
        static_cast<std::int64_t>(first_value(*labels_, labels_->grid.offset(voxel[0], voxel[1], voxel[2])));
    if (id == 0) return {};
    const auto found = group_.find(id);
    return found == group_.end() ? group_name(Group::other) : found->second;
  }

 private:
  const Image* labels_ = nullptr;
  std::map<std::int64_t, std::string_view> group_;
};

struct Differs {
  std::uint64_t voxels = 0, differ = 0, off_boundary = 0;
};

json differs_json(const Differs& sums, bool labels) {
  const auto share = [&](std::uint64_t part) {
    return sums.voxels == 0 ? 0 : static_cast<double>(part) / static_cast<double>(sums.voxels);
  };
  json out{{"voxels", sums.voxels}, {"differ", sums.differ}, {"differ_share", share(sums.differ)}};
  if (labels) out["off_boundary_share"] = share(sums.off_boundary);
  return out;
}

}  // namespace

ImagesBack::ImagesBack(const PosedTets& body, const Context& context)
    : drawn_(runtime::drawn_body(body.tets, numbers(body.rest), numbers(body.posed), body.copies)),
      context_(context) {}

Image ImagesBack::bring(Image image, bool labels, runtime::Sampling sampling) {
  const runtime::Deformation there = way_there(), back = there.back();
  ModelVolume volume;
  volume.labels = labels;
  volume.image = std::move(image);
  const ImageGrid& grid = volume.image.grid;
  if (!(posed_.grid == grid)) runtime::locate(there, grid, posed_, context_);
  const auto empty = std::find(posed_.tet.begin(), posed_.tet.end(), runtime::InverseMap::none);
  if (empty != posed_.tet.end())
    volume.background = first_value(volume.image, static_cast<std::size_t>(empty - posed_.tet.begin()));
  const ImageGrid over = runtime::lattice_over(grid, back.posed);
  if (!(scan_.grid == over)) runtime::locate(back, over, scan_, context_);
  return runtime::resample(back, scan_, volume, sampling);
}

runtime::VoxelTrip ImagesBack::trip() const {
  return runtime::voxel_trip(way_there(), scan_, posed_, context_);
}

Image ImagesBack::mask(const ImageGrid& grid, const runtime::VoxelTrip& trip) {
  Image out(grid, ScalarType::u8);
  std::copy(trip.lost.begin(), trip.lost.end(), out.scalars<std::uint8_t>().begin());
  return out;
}

json held_against(const Model& model, const ModelVolume& volume, const Image& back) {
  const ImageGrid& grid = volume.image.grid;
  const Voxels scan(volume.image), again(back);
  const Groups groups(model);
  Differs all;
  std::map<std::string_view, Differs> by_group;
  for (int k = 0; k < grid.size[2]; ++k) {
    for (int j = 0; j < grid.size[1]; ++j) {
      for (int i = 0; i < grid.size[0]; ++i) {
        const std::array<double, 3> point = grid.point(i, j, k);
        const std::string_view group = groups.of(point);
        if (group.empty()) continue;
        const bool differs = !scan.same(scan.at({i, j, k}), again.at(nearest(back.grid, point)));
        const bool inner = differs && volume.labels && off_boundary(scan, {i, j, k});
        for (Differs* sums : {&all, &by_group[group]}) {
          ++sums->voxels;
          sums->differ += differs ? 1 : 0;
          sums->off_boundary += inner ? 1 : 0;
        }
      }
    }
  }
  json out = differs_json(all, volume.labels);
  for (const auto& [group, sums] : by_group) {
    out["groups"].push_back(differs_json(sums, volume.labels));
    out["groups"].back()["group"] = group;
  }
  return out;
}

}  // namespace ecorche::app
