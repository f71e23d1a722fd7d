// SPDX-License-Identifier: Apache-2.0
#include "io/image/dicom_planes.hpp"

#include <algorithm>
#include <cmath>

#include "core/values/text.hpp"
#include "io/image/dicom_slice.hpp"
#include "io/image/header_fields.hpp"

namespace ecorche::io::dicom {
namespace {

using fields::refuse;

constexpr Tag kIdentification = 0x0062000a, kReferenced = 0x0062000b;
constexpr double kSamePlane = 1e-3;  // mm
constexpr double kOfMultiple = 0.01;

std::int64_t segment_of(const DataSet& set, const Item* own) {
  for (const Item* group : {own, set.top.only(kSharedGroups)}) {
    const Item* item = group == nullptr ? nullptr : group->only(kIdentification);
    if (item != nullptr) return item->whole(kReferenced).value_or(0);
  }
  return 0;
}

double written_distance(const DataSet& set, const Item* own) {
  for (const Tag tag : {kSpacingBetween, kThickness}) {
    for (const Item* group : {own, set.top.only(kSharedGroups)}) {
      const Item* item = group == nullptr ? nullptr : group->only(kMeasures);
      const double mm = item == nullptr ? 0 : std::abs(item->number(tag).value_or(0));
      if (mm > kSamePlane && mm < 1e4) return mm;
    }
  }
  return 1;
}

bool divides(double distance, const std::vector<double>& depths) {
  return std::all_of(depths.begin(), depths.end(), [&](double z) {
    const double times = (z - depths.front()) / distance;
    return std::abs(times - std::round(times)) <= std::max(kOfMultiple, kSamePlane / distance);
  });
}

// Of neighbouring planes: as the file says where that fits, else the least that there is.
double distance_of(const DataSet& set, const std::vector<double>& depths, double written) {
  if (divides(written, depths)) return written;
  double least = depths.back() - depths.front();
  for (std::size_t i = 1; i < depths.size(); ++i) least = std::min(least, depths[i] - depths[i - 1]);
  if (!divides(least, depths))
    refuse(set.path, "its planes are at uneven distances, the least " + text::number(least) + " mm",
           "export the segmentation on its own voxels");
  return least;
}

}  // namespace

SegmentPlanes planes_of(const DataSet& set) {
  const std::vector<Slice> slices = framed_slices(set);
  const Slice& first = slices.front();
  const std::array<double, 3> normal = first.normal();
  std::vector<double> depths;
  for (const Slice& slice : slices) {
    std::array<double, 3> way{};
    for (std::size_t k = 0; k < 3; ++k) way[k] = slice.position[k] - first.position[k];
    const bool turned = dot(slice.normal(), normal) < 1 - 1e-6 || dot(slice.right, first.right) < 1 - 1e-6;
    if (turned || std::abs(dot(way, first.right)) > 0.05 * first.spacing[0] ||
        std::abs(dot(way, first.down)) > 0.05 * first.spacing[1] || slice.spacing != first.spacing) {
      refuse(set.path, slice.name() + " does not lie over frame 1", "export the segmentation on one grid");
    }
    depths.push_back(dot(way, normal));
  }
  std::vector<double> sorted = depths;
  std::sort(sorted.begin(), sorted.end());
  sorted.erase(
      std::unique(sorted.begin(), sorted.end(), [](double a, double b) { return b - a <= kSamePlane; }),
      sorted.end());
  const Element* own = set.top.find(kFrameGroups);
  const auto group = [&](std::size_t f) { return own == nullptr ? nullptr : &own->items[f]; };
  const double distance = distance_of(set, sorted, written_distance(set, group(0)));
  SegmentPlanes out;
  ImageGrid& grid = out.grid;
  const double planes = std::round((sorted.back() - sorted.front()) / distance) + 1;
  if (planes > 1e6)
    refuse(set.path, "its planes span " + text::number(planes, 9) + " slices", "export it again");
  grid.size = {static_cast<std::int32_t>(first.file->pixels.columns),
               static_cast<std::int32_t>(first.file->pixels.rows), static_cast<std::int32_t>(planes)};
  grid.spacing = {first.spacing[0], first.spacing[1], distance};
  for (std::size_t k = 0; k < 3; ++k) {
    grid.origin[k] = first.position[k] + normal[k] * sorted.front();
    grid.direction[3 * k] = first.right[k];
    grid.direction[3 * k + 1] = first.down[k];
    grid.direction[3 * k + 2] = normal[k];
  }
  for (std::size_t f = 0; f < slices.size(); ++f) {
    const double plane = std::round((depths[f] - sorted.front()) / distance);
    out.frames.push_back({segment_of(set, group(f)), static_cast<std::int32_t>(plane)});
  }
  return out;
}

}  // namespace ecorche::io::dicom
