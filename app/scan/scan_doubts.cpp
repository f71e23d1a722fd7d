// SPDX-License-Identifier: Apache-2.0
#include "app/scan/scan_doubts.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include "app/scan/scan_handedness.hpp"
#include "core/values/text.hpp"

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

// The bones of both sides of one name.
struct BonePair {
  std::string name;       // without its side
  Point to_left{};        // from the right one's middle to the left one's, mm
  bool of_trunk = false;  // whose sides no posture exchanges
};

std::vector<BonePair> pairs_of(const ScanCase& scan, const std::vector<Point>& middle) {
  const auto shown = [](const ScanEntry& e) { return e.role == Role::bone && e.drawn && e.voxels > 0; };
  std::vector<BonePair> out;
  for (std::size_t e = 0; e < scan.entries.size(); ++e) {
    const ScanEntry& left = scan.entries[e];
    if (!shown(left) || !left.name.ends_with("_left")) continue;
    BonePair pair{left.name.substr(0, left.name.size() - 5), {}, true};
    const auto right = std::find_if(scan.entries.begin(), scan.entries.end(), [&](const ScanEntry& o) {
      return shown(o) && o.name == pair.name + "_right";
    });
    if (right == scan.entries.end()) continue;
    for (const char* limb : {"forearm", "hand", "shank", "foot", "toes"})
      pair.of_trunk = pair.of_trunk && !left.segment.starts_with(limb);
    const Point& other = middle[static_cast<std::size_t>(right - scan.entries.begin()) + 1];
    for (std::size_t k = 0; k < 3; ++k) pair.to_left[k] = middle[e + 1][k] - other[k];
    out.push_back(pair);
  }
  return out;
}

double inner(const Point& a, const Point& b) {
  return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

// Of a trunk's bones, thighs and upper arms those whose left one lies where all others have their right one.
void tell_odd_pairs(ScanCase& out, const std::vector<BonePair>& pairs) {
  Point sum{};
  std::size_t count = 0;
  for (const BonePair& pair : pairs) {
    if (!pair.of_trunk) continue;
    for (std::size_t k = 0; k < 3; ++k) sum[k] += pair.to_left[k];
    ++count;
  }
  std::vector<std::string> odd;
  for (const BonePair& pair : pairs) {
    Point others = sum;
    for (std::size_t k = 0; k < 3; ++k) others[k] -= pair.to_left[k];
    const double along = inner(pair.to_left, others), length = std::sqrt(inner(others, others));
    if (pair.of_trunk && along < -kApartMm * length) odd.push_back(pair.name);
  }
  if (odd.empty()) return;
  const std::string said = "left and right are exchanged in the names of one or the other";
  if (odd.size() == count) {
    out.doubts.push_back(text::joined(odd, " and ") + " have their left ones on different sides: " + said);
    return;
  }
  std::string like;
  for (std::size_t i = 1; i < odd.size(); ++i) like += (i == 1 ? ", as does " : ", ") + odd[i] + "_left";
  out.doubts.push_back(odd.front() + "_left lies to the right of " + odd.front() + "_right, against " +
                       std::to_string(count - odd.size()) + " other pairs of bones" + like + ": " + said);
}

// The mean of all pairs of the trunk, thighs and upper arms.
Point mean_to_left(const std::vector<BonePair>& pairs) {
  Point out{};
  double count = 0;
  for (const BonePair& pair : pairs) {
    if (!pair.of_trunk) continue;
    for (std::size_t k = 0; k < 3; ++k) out[k] += pair.to_left[k];
    ++count;
  }
  for (double& v : out) v /= std::max(1.0, count);
  return out;
}

// Why left is where right should be.
std::string exchanged_by(const ScanCase& scan, const std::vector<Point>& middle, const Point& to_left) {
  const int organs = organs_agree(scan, middle, to_left);
  if (organs > 0)
    return "organs lie on the sides that the names say: the image's axes show the body as in a mirror; write "
           "them as the scanner did";
  const std::string names = "left and right are exchanged in the labels' names";
  if (organs < 0) return names + ", as the organs tell, too: exchange them in the table of names";
  return names + ", or the image's axes are mirrored: see which, and mend the table of names or the header";
}

void tell_exchanged(ScanCase& out) {
  const std::vector<Point> middle = middles(out);
  const std::vector<BonePair> pairs = pairs_of(out, middle);
  std::size_t right = 0, exchanged = 0;
  std::string first;
  for (const BonePair& pair : pairs) {
    const double x = pair.to_left[0];
    if (std::abs(x) < kApartMm) continue;
    ++(x > 0 ? right : exchanged);
    if (x < 0 && first.empty()) first = pair.name + "_left lies to the right of " + pair.name + "_right";
  }
  const bool odd = exchanged > right;
  const Point to_left = mean_to_left(pairs);
  const Handedness hand = handedness(out, middle, to_left);
  if (hand == Handedness::body || (hand == Handedness::unknown && !odd)) {
    if (odd)
      out.notes.push_back(first +
                          ", but front and back agree with the names: the body lies turned in the image, "
                          "such as on its belly, and nothing is wrong");
    return tell_odd_pairs(out, pairs);
  }
  const std::string counted = odd ? first + ", and so do " + std::to_string(exchanged) + " of " +
                                        std::to_string(exchanged + right) + " pairs of bones"
                                  : "the body's front lies where its back should, beside its head and " +
                                        std::to_string(right) + " pairs of left and right bones";
  if (hand == Handedness::unknown) {
    out.doubts.push_back(counted +
                         ": left and right are exchanged in the labels' names, or the image's axes "
                         "are mirrored, or the body lies turned, such as on its belly: nothing here "
                         "tells its front");
    return;
  }
  out.doubts.push_back(counted + ": " + exchanged_by(out, middle, to_left));
}

}  // namespace

void tell_contradictions(ScanCase& out, const std::vector<ScanImage>& images) {
  for (const ScanImage& image : images) tell_elsewhere(out, image);
  tell_exchanged(out);
}

std::string images_without_hu(const std::vector<ScanImage>& images) {
  if (images.empty() || std::any_of(images.begin(), images.end(), [](const ScanImage& i) { return i.ct; }))
    return {};
  return "; " + images.front().path.filename().string() + " is no CT in HU (its least value is " +
         text::number(images.front().background) + ")";
}

}  // namespace ecorche::app
