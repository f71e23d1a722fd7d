// SPDX-License-Identifier: Apache-2.0
#include "app/scan/scan_bodies.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>
#include <limits>
#include <utility>

#include "app/scan/scan_bounds.hpp"
#include "core/values/text.hpp"
#include "preprocess/scan/pieces.hpp"
#include "preprocess/scan/views.hpp"

namespace ecorche::app {
namespace {

using Place = std::array<double, 3>;
using Cloud = std::vector<Place>;

constexpr double kSecondPiece = 0.25;  // of the largest: no fragment
constexpr double kChild = 0.015;       // ... where many bones have such a one: a child's, a quarter as long
constexpr std::size_t kFewestOfChild = 5;
constexpr double kAlike = 3;         // a child's bones are all smaller by about the same
constexpr double kFractureMm = 60;   // pieces of one bone lie nearer to each other than this
constexpr double kInLine = 0.8;      // width over length, along the line through both: one bone, broken
constexpr double kTwiceThere = 0.5;  // confidence of a bone in two large pieces
constexpr std::size_t kBodiesPoints = 300;  // of a piece
constexpr std::size_t kNamesOfTwo = 4;
// Each a single piece in a body. No mandible: of one that the field of view cuts two rami are left.
constexpr const char* kOfOnePiece[] = {"skull",   "sternum", "sacrum", "hip",   "scapula", "clavicle",
                                       "humerus", "radius",  "ulna",   "femur", "tibia",   "fibula"};

double distance(const Place& a, const Place& b) {
  return std::hypot(a[0] - b[0], a[1] - b[1], a[2] - b[2]);
}

double gap(const Cloud& a, const Cloud& b) {
  double least = std::numeric_limits<double>::infinity();
  for (const Place& p : a) {
    for (const Place& q : b) least = std::min(least, distance(p, q));
  }
  return least;
}

// How wide a piece is across the line along `way`, over how long it is along it.
double width_over_length(const Cloud& cloud, const Place& middle, const Place& way) {
  double low = 0, high = 0, across = 0;
  for (const Place& p : cloud) {
    const Place d{p[0] - middle[0], p[1] - middle[1], p[2] - middle[2]};
    const double along = d[0] * way[0] + d[1] * way[1] + d[2] * way[2];
    low = std::min(low, along);
    high = std::max(high, along);
    across =
        std::max(across, std::sqrt(std::max(0.0, d[0] * d[0] + d[1] * d[1] + d[2] * d[2] - along * along)));
  }
  return 2 * across / std::max(1e-9, high - low);
}

// A bone that is there twice.
struct Twice {
  std::size_t entry = 0;
  std::array<Place, 2> middle{};
  std::array<Cloud, 2> cloud;
  double gap = 0;
  double share = 0;  // of the second piece's voxels over the first's
};

// Pieces of a long bone whose middle is missing lie end to end.
bool in_line(const Twice& twice) {
  const auto& [a, b] = twice.middle;
  const double d = std::max(1e-9, distance(a, b));
  const Place way{(b[0] - a[0]) / d, (b[1] - a[1]) / d, (b[2] - a[2]) / d};
  return width_over_length(twice.cloud[0], a, way) < kInLine &&
         width_over_length(twice.cloud[1], b, way) < kInLine;
}

bool of_one_piece(const ScanEntry& entry) {
  const std::string name = scan::without_side(entry.name);
  return entry.role == ScanEntry::Role::bone && entry.drawn && entry.voxels > 0 &&
         (name.starts_with("vertebra_") ||
          std::find(std::begin(kOfOnePiece), std::end(kOfOnePiece), name) != std::end(kOfOnePiece));
}

std::vector<Twice> bones_there_twice(const ScanCase& scan, const Context& context) {
  std::vector<std::uint8_t> wanted(scan.entries.size() + 1, 0);
  for (std::size_t e = 0; e < scan.entries.size(); ++e) wanted[e + 1] = of_one_piece(scan.entries[e]) ? 1 : 0;
  const scan::Pieces found = scan::find_pieces(scan.labels, wanted, context);
  constexpr std::size_t none = static_cast<std::size_t>(-1);
  std::vector<std::array<std::size_t, 2>> largest(scan.entries.size(), {none, none});
  const auto larger = [&](std::size_t p, std::size_t q) {
    return q == none || found.pieces[p].voxels > found.pieces[q].voxels;
  };
  for (std::size_t p = 0; p < found.pieces.size(); ++p) {
    auto& [first, second] = largest[found.pieces[p].id - 1U];
    if (larger(p, first)) {
      second = std::exchange(first, p);
    } else if (larger(p, second)) {
      second = p;
    }
  }
  // Points are taken of those alone.
  scan::Pieces two;
  std::vector<Twice> out;
  std::vector<std::uint32_t> row(found.pieces.size(), 0);
  for (std::size_t e = 0; e < largest.size(); ++e) {
    if (largest[e][1] == none) continue;
    const scan::Piece &a = found.pieces[largest[e][0]], &b = found.pieces[largest[e][1]];
    const auto cut = [](const scan::Piece& p) {
      return std::any_of(p.on_border.begin(), p.on_border.end(), [](std::size_t n) { return n > 0; });
    };
    const double share =
        static_cast<double>(b.voxels) / static_cast<double>(std::max<std::size_t>(1, a.voxels));
    if (share < kChild || cut(a) || cut(b)) continue;
    for (const std::size_t p : largest[e]) {
      two.pieces.push_back(found.pieces[p]);
      row[p] = static_cast<std::uint32_t>(two.pieces.size());
    }
    out.push_back({e, {a.centre, b.centre}, {}, 0, share});
  }
  for (scan::Run run : found.runs) {
    if (row[run.piece] == 0) continue;
    run.piece = row[run.piece] - 1;
    two.runs.push_back(run);
  }
  auto points = scan::sample_points(two, scan.labels.grid, kBodiesPoints);
  for (std::size_t t = 0; t < out.size(); ++t) {
    out[t].cloud = {std::move(points[2 * t]), std::move(points[2 * t + 1])};
    out[t].gap = gap(out[t].cloud[0], out[t].cloud[1]);
  }
  std::erase_if(out, [](const Twice& twice) { return twice.gap < kFractureMm || in_line(twice); });
  return out;
}

// One that lies in the middle of a body, or one of each side: a left bone that is named as a right one makes
// a second right one, and no second body.
bool two_bodies(const ScanCase& scan, const std::vector<Twice>& twice) {
  if (twice.size() < 2) return false;
  return std::any_of(twice.begin(), twice.end(), [&](const Twice& one) {
    const std::string& name = scan.entries[one.entry].name;
    const std::string bare = scan::without_side(name);
    return bare == name || std::any_of(twice.begin(), twice.end(), [&](const Twice& other) {
             const std::string& theirs = scan.entries[other.entry].name;
             return theirs != name && scan::without_side(theirs) == bare;
           });
  });
}

std::string in_words(const Place& p) {
  return "[" + text::number(p[0], 4) + ", " + text::number(p[1], 4) + ", " + text::number(p[2], 4) + "]";
}

// Which pieces are one body's: those that lie nearer to its piece of the bone that is farthest apart.
std::array<Bounds, 2> bounds_of_both(const std::vector<Twice>& twice) {
  const auto seed = std::max_element(twice.begin(), twice.end(),
                                     [](const Twice& a, const Twice& b) { return a.gap < b.gap; });
  const auto& [a, b] = seed->middle;
  std::array<Bounds, 2> out;
  for (const Twice& one : twice) {
    const bool crossed = distance(one.middle[0], b) + distance(one.middle[1], a) <
                         distance(one.middle[0], a) + distance(one.middle[1], b);
    for (std::size_t i = 0; i < 2; ++i) {
      for (const Place& p : one.cloud[i]) out[crossed ? 1 - i : i].add(p);
    }
  }
  return out;
}

// Those that tell of a second body: large ones, else many that are all smaller by about the same.
std::vector<Twice> of_second_body(const ScanCase& scan, const std::vector<Twice>& all) {
  std::vector<Twice> out;
  std::copy_if(all.begin(), all.end(), std::back_inserter(out),
               [](const Twice& t) { return t.share >= kSecondPiece; });
  if (all.size() < kFewestOfChild || two_bodies(scan, out)) return out;
  std::vector<double> shares;
  shares.reserve(all.size());
  for (const Twice& t : all) shares.push_back(t.share);
  std::nth_element(shares.begin(), shares.begin() + static_cast<std::ptrdiff_t>(shares.size() / 2),
                   shares.end());
  const double usual = shares[shares.size() / 2];
  std::vector<Twice> child;
  std::copy_if(all.begin(), all.end(), std::back_inserter(child),
               [&](const Twice& t) { return t.share > usual / kAlike && t.share < usual * kAlike; });
  return child.size() >= kFewestOfChild && two_bodies(scan, child) ? child : out;
}

}  // namespace

void tell_bodies(ScanCase& out, const Context& context) {
  const std::vector<Twice> twice = of_second_body(out, bones_there_twice(out, context));
  std::vector<std::string> names;
  for (const Twice& one : twice) {
    ScanEntry& entry = out.entries[one.entry];
    entry.confidence = std::min(entry.confidence, kTwiceThere);
    entry.how += "; it is there in two pieces, " + text::number(one.gap, 3) + " mm apart";
    names.push_back(entry.name);
  }
  if (twice.empty()) return;
  if (two_bodies(out, twice)) {
    const auto [one, other] = bounds_of_both(twice);
    const std::size_t more = names.size() - std::min(names.size(), kNamesOfTwo);
    names.resize(names.size() - more);
    out.doubts.push_back("there seem to be two bodies: " + text::joined(names) +
                         (more > 0 ? " and " + std::to_string(more) + " more bones" : "") +
                         " are there twice, the bones of one " + one.in_words() + ", of the other " +
                         other.in_words() +
                         ": they would become one: cut all files to one of them, or erase the other in the "
                         "labels, and run new again");
    return;
  }
  for (const Twice& one : twice)
    out.doubts.push_back(out.entries[one.entry].name + " is in two large pieces, at " +
                         in_words(one.middle[0]) + " and " + in_words(one.middle[1]) + ", " +
                         text::number(one.gap, 3) +
                         " mm apart: one of them may be another bone; see picture.png, and erase it or name "
                         "it in the labels");
}

}  // namespace ecorche::app
