// SPDX-License-Identifier: Apache-2.0
#include "app/scan/scan_doubts.hpp"

#include <algorithm>
#include <array>
#include <cmath>

namespace ecorche::app {
namespace {

using Role = ScanEntry::Role;
using Point = std::array<double, 3>;

constexpr double kImageCovers = 0.5;  // of the labelled voxels
constexpr std::size_t kLook =
    997;                         // each such voxel is looked at: many of any body, and no multiple of a row
constexpr double kApartMm = 10;  // middles of a pair that tell left from right

void tell_elsewhere(ScanCase& out, const ScanImage& image) {
  const ImageGrid &grid = out.labels.grid, &own = image.image.grid;
  const auto labels = std::as_const(out.labels).scalars<std::uint16_t>();
  const auto nx = static_cast<std::size_t>(grid.size[0]), ny = static_cast<std::size_t>(grid.size[1]);
  // A small map is looked at whole.
  const std::size_t step = labels.size() > 1000 * kLook ? kLook : 1;
  std::size_t all = 0, within = 0;
  for (std::size_t v = 0; v < labels.size(); v += step) {
    if (labels[v] == 0) continue;
    const std::size_t slice = v / (nx * ny);
    const Point index = own.index(grid.point(static_cast<double>(v % nx), static_cast<double>(v / nx % ny),
                                             static_cast<double>(slice)));
    bool in = true;
    for (std::size_t a = 0; a < 3; ++a) in = in && index[a] >= -0.5 && index[a] <= own.size[a] - 0.5;
    ++all;
    within += in ? 1 : 0;
  }
  const double share = all == 0 ? 1 : static_cast<double>(within) / static_cast<double>(all);
  if (share < kImageCovers)
    out.doubts.push_back(image.path.filename().string() + " covers " +
                         std::to_string(std::lround(100 * share)) +
                         " % of what is labelled: is it of the same scan, and are both headers right?");
}

// The middle of each entry, LPS mm.
std::vector<Point> middles(const ScanCase& scan) {
  const ImageGrid& grid = scan.labels.grid;
  const auto labels = scan.labels.scalars<std::uint16_t>();
  std::vector<Point> sum(scan.entries.size() + 1, Point{0, 0, 0});
  std::size_t at = 0;
  for (int k = 0; k < grid.size[2]; ++k) {
    for (int j = 0; j < grid.size[1]; ++j) {
      for (int i = 0; i < grid.size[0];) {  // by runs of one id
        const std::uint16_t id = labels[at];
        const int begin = i;
        for (; i < grid.size[0] && labels[at] == id; ++i) ++at;
        const double count = i - begin;
        sum[id][0] += count * 0.5 * (begin + i - 1);
        sum[id][1] += count * j;
        sum[id][2] += count * k;
      }
    }
  }
  for (std::size_t e = 0; e < scan.entries.size(); ++e) {
    const auto count = static_cast<double>(std::max<std::size_t>(1, scan.entries[e].voxels));
    Point& p = sum[e + 1];
    p = grid.point(p[0] / count, p[1] / count, p[2] / count);
  }
  return sum;
}

void tell_exchanged(ScanCase& out) {
  const auto shown = [](const ScanEntry& e) { return e.role == Role::bone && e.drawn && e.voxels > 0; };
  const std::vector<Point> middle = middles(out);
  std::size_t right = 0, exchanged = 0;
  std::string first;
  for (std::size_t e = 0; e < out.entries.size(); ++e) {
    const std::string& name = out.entries[e].name;
    if (!shown(out.entries[e]) || !name.ends_with("_left")) continue;
    const std::string other = name.substr(0, name.size() - 5) + "_right";
    const auto pair = std::find_if(out.entries.begin(), out.entries.end(),
                                   [&](const ScanEntry& o) { return shown(o) && o.name == other; });
    if (pair == out.entries.end()) continue;
    const double x = middle[e + 1][0] - middle[static_cast<std::size_t>(pair - out.entries.begin()) + 1][0];
    if (std::abs(x) < kApartMm) continue;
    ++(x > 0 ? right : exchanged);
    if (x < 0 && first.empty()) first.append(name).append(" lies to the right of ").append(other);
  }
  if (exchanged <= right) return;
  out.doubts.push_back(
      first + ", and so do " + std::to_string(exchanged) + " of " + std::to_string(exchanged + right) +
      " pairs of bones: left and right are exchanged in the labels' names, or the image's axes "
      "are wrong");
}

}  // namespace

void tell_contradictions(ScanCase& out, const std::vector<ScanImage>& images) {
  for (const ScanImage& image : images) tell_elsewhere(out, image);
  tell_exchanged(out);
}

}  // namespace ecorche::app
