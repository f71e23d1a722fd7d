// SPDX-License-Identifier: Apache-2.0
// Where the slices of a stack lie, and what is wrong with that.
#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>
#include <set>

#include "core/values/text.hpp"
#include "io/image/dicom_stack.hpp"
#include "io/image/header_fields.hpp"

namespace ecorche::io::dicom {
namespace {

using fields::refuse;
namespace fs = std::filesystem;

constexpr double kSamePlace = 1e-3;  // mm: positions are written to six digits at least
constexpr double kEven = 0.01;       // of the distance between slices
constexpr double kMissing = 0.1;     // the same, of a gap from a multiple
constexpr double kWidest = 4;        // distances: what is wider is not filled by interpolation

std::string at(const Slice& slice) {
  const auto digit = [&](std::size_t k) { return text::number(slice.position[k], 7); };
  return slice.name() + " at (" + digit(0) + ", " + digit(1) + ", " + digit(2) + ")";
}

// Slices of one place, in the order of time.
struct Place {
  double z = 0;  // along the normal
  std::vector<Slice> slices;
};

// Whatever was copied twice is one slice.
void drop_copies(std::vector<Slice>& slices, const fs::path& path, const files::ReadOptions& options) {
  std::set<std::pair<std::string, std::uint32_t>> seen;
  const std::size_t before = slices.size();
  std::string first;
  std::erase_if(slices, [&](const Slice& slice) {
    if (slice.file->object.empty() || seen.emplace(slice.file->object, slice.frame).second) return false;
    if (first.empty()) first = slice.name();
    return true;
  });
  if (slices.size() == before) return;
  options.say(path.string() + ": " + std::to_string(before - slices.size()) +
              " slices are there twice (the first is " + first + "): each is taken once");
}

std::vector<Place> places_of(std::vector<Slice> slices) {
  const Vector normal = slices.front().normal();
  std::vector<std::pair<double, std::size_t>> order;
  for (std::size_t i = 0; i < slices.size(); ++i) order.emplace_back(dot(slices[i].position, normal), i);
  std::sort(order.begin(), order.end(), [&](const auto& a, const auto& b) {
    if (a.first != b.first) return a.first < b.first;
    return slices[a.second].file->path.filename() < slices[b.second].file->path.filename();
  });
  std::vector<Place> out;
  for (const auto& [z, i] : order) {
    if (out.empty() || z - out.back().z > kSamePlace) out.push_back({z, {}});
    out.back().slices.push_back(std::move(slices[i]));
  }
  for (Place& place : out) {
    std::stable_sort(place.slices.begin(), place.slices.end(),
                     [](const Slice& a, const Slice& b) { return a.when < b.when; });
  }
  return out;
}

// One slice a place: those of `phase` where every place has several.
void take_phase(std::vector<Place>& places, int phase, const fs::path& path) {
  const std::size_t volumes = places.front().slices.size();
  const auto odd = std::find_if(places.begin(), places.end(),
                                [&](const Place& one) { return one.slices.size() != volumes; });
  if (odd != places.end()) {
    const auto doubled = std::max_element(places.begin(), places.end(), [](const Place& a, const Place& b) {
      return a.slices.size() < b.slices.size();
    });
    refuse(path,
           "has two slices at one place: " + at(doubled->slices[0]) + " and " + doubled->slices[1].name(),
           "keep one of them in the folder");
  }
  if (phase == 0 && volumes > 1) {
    refuse(path, "holds " + std::to_string(volumes) + " volumes, one after the other in time",
           "take one by --phase, in a case by phase:, from 1 to " + std::to_string(volumes));
  }
  if (phase > static_cast<int>(volumes))
    refuse(path, "has no phase " + std::to_string(phase), "it has " + std::to_string(volumes));
  for (Place& place : places) {
    Slice taken = std::move(place.slices[static_cast<std::size_t>(std::max(phase, 1)) - 1]);
    place.slices.clear();
    place.slices.push_back(std::move(taken));
  }
}

double median_gap(const std::vector<Place>& places) {
  std::vector<double> gaps;
  for (std::size_t k = 1; k < places.size(); ++k) gaps.push_back(places[k].z - places[k - 1].z);
  const auto middle = gaps.begin() + static_cast<std::ptrdiff_t>(gaps.size() / 2);
  std::nth_element(gaps.begin(), middle, gaps.end());
  return *middle;
}

// A few gaps of a whole number of distances, which no slice is thick enough to fill.
void refuse_missing(const std::vector<Place>& places, double gap, const fs::path& path) {
  std::size_t wide = 0, lost = 0;
  std::optional<std::size_t> first;
  for (std::size_t k = 1; k < places.size(); ++k) {
    const double times = (places[k].z - places[k - 1].z) / gap;
    const double thick = places[k].slices.front().thickness / gap;
    if (times < 2 - kMissing || std::abs(times - std::round(times)) > kMissing ||
        std::abs(times - thick) < kMissing)
      continue;
    ++wide;
    lost += static_cast<std::size_t>(std::min(std::round(times), 1e6)) - 1;
    if (!first) first = k;
  }
  if (!first || wide > std::max<std::size_t>(1, places.size() / 5)) return;
  refuse(path,
         "lacks " + std::to_string(lost) + (lost == 1 ? " slice" : " slices") + ", the first between " +
             at(places[*first - 1].slices.front()) + " and " + at(places[*first].slices.front()),
         "copy the series from the archive again");
}

// Of slices at even distances; others are given their place in `out.at`.
double spacing_of(const std::vector<Place>& places, PlacedStack& out, const fs::path& path,
                  const files::ReadOptions& options) {
  if (places.size() == 1) {
    const double thickness = places.front().slices.front().thickness;
    options.say(
        path.string() + ": is one slice, taken as " +
        (thickness > 0 ? text::number(thickness) + " mm thick, as it says" : std::string("1 mm thick")));
    return thickness > 0 ? thickness : 1;
  }
  const double gap = median_gap(places), first = places.front().z;
  const double even = (places.back().z - first) / static_cast<double>(places.size() - 1);
  double worst = 0, widest = 0, narrowest = gap;
  std::size_t widest_at = 1;
  for (std::size_t k = 1; k < places.size(); ++k) {
    const double here = places[k].z - places[k - 1].z;
    worst = std::max(worst, std::abs(here - gap));
    narrowest = std::min(narrowest, here);
    if (here > widest) widest_at = k;
    widest = std::max(widest, here);
  }
  if (worst <= std::max(kEven * gap, 2 * kSamePlace)) return even;
  refuse_missing(places, gap, path);
  const std::string between =
      at(places[widest_at - 1].slices.front()) + " and " + places[widest_at].slices.front().name();
  if (widest > kWidest * gap)
    refuse(path,
           "has a gap of " + text::number(widest) + " mm, between " + between + ", where others are " +
               text::number(gap),
           "copy the series from the archive again");
  for (const Place& place : places) out.at.push_back((place.z - first) / gap);
  options.say(path.string() + ": its slices are " + text::number(narrowest) + " to " + text::number(widest) +
              " mm apart (the widest gap is between " + between + "): resampled to every " +
              text::number(gap) + " mm");
  return gap;
}

// A gantry that leans: slices lie over each other along another way than their normal.
void place_tilt(PlacedStack& out, const fs::path& path, const files::ReadOptions& options) {
  const Slice& first = out.slices.front();
  const Vector normal = first.normal();
  std::vector<std::array<double, 2>> shift;
  std::array<double, 2> low{}, high{};
  double largest = 0;
  for (const Slice& slice : out.slices) {
    Vector way{};
    for (std::size_t k = 0; k < 3; ++k) way[k] = slice.position[k] - first.position[k];
    const std::array<double, 2> mm{dot(way, first.right), dot(way, first.down)};
    shift.push_back({mm[0] / first.spacing[0], mm[1] / first.spacing[1]});
    for (std::size_t a = 0; a < 2; ++a) {
      low[a] = std::min(low[a], shift.back()[a]);
      high[a] = std::max(high[a], shift.back()[a]);
      largest = std::max(largest, std::abs(mm[a]));
    }
  }
  const double pixel = std::min(first.spacing[0], first.spacing[1]);
  if (largest <= std::max(0.01, 0.02 * pixel)) return;
  for (std::size_t a = 0; a < 2; ++a) {
    const std::int32_t size = out.grid.size[a];
    if (high[a] - low[a] > 2.0 * size)
      refuse(path, "its slices do not lie over each other: they are " + text::number(largest) + " mm apart",
             "choose one stack of slices");
    // The first pixel of the grid lies on one of the first slice.
    const double down = std::floor(low[a]);
    out.grid.size[a] = size + static_cast<std::int32_t>(std::ceil(high[a]) - down);
    for (auto& one : shift) one[a] -= down;
    const Vector& axis = a == 0 ? first.right : first.down;
    for (std::size_t k = 0; k < 3; ++k) out.grid.origin[k] += axis[k] * down * first.spacing[a];
  }
  out.shift = std::move(shift);
  Vector whole{};
  for (std::size_t k = 0; k < 3; ++k) whole[k] = out.slices.back().position[k] - first.position[k];
  const double along = dot(whole, normal),
               across = std::hypot(dot(whole, first.right), dot(whole, first.down));
  options.say(path.string() + ": its gantry was tilted by " +
              text::number(std::atan2(across, along) * 180 / std::numbers::pi) +
              " degrees: each slice is shifted by up to " + text::number(largest) +
              " mm onto right-angled voxels, interpolated within the slice");
}

}  // namespace

PlacedStack placed(Stack stack, int phase, const fs::path& path, const files::ReadOptions& options) {
  drop_copies(stack.slices, path, options);
  std::vector<Place> places = places_of(std::move(stack.slices));
  take_phase(places, phase, path);
  PlacedStack out;
  const double spacing = spacing_of(places, out, path, options);
  for (Place& place : places) out.slices.push_back(std::move(place.slices.front()));
  const Slice& first = out.slices.front();
  const Vector normal = first.normal();
  ImageGrid& grid = out.grid;
  const double last = out.at.empty() ? static_cast<double>(places.size() - 1) : out.at.back();
  grid.size = {static_cast<std::int32_t>(first.file->pixels.columns),
               static_cast<std::int32_t>(first.file->pixels.rows),
               static_cast<std::int32_t>(std::floor(last + 1e-6)) + 1};
  grid.origin = first.position;
  grid.spacing = {first.spacing[0], first.spacing[1], spacing};
  for (std::size_t k = 0; k < 3; ++k) {
    grid.direction[3 * k] = first.right[k];
    grid.direction[3 * k + 1] = first.down[k];
    grid.direction[3 * k + 2] = normal[k];
  }
  place_tilt(out, path, options);
  return out;
}

}  // namespace ecorche::io::dicom
