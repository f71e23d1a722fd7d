// SPDX-License-Identifier: Apache-2.0
#include "app/scan/scan_handedness.hpp"

#include <algorithm>
#include <cmath>
#include <optional>
#include <string_view>

namespace ecorche::app {
namespace {

using Vec = std::array<double, 3>;

constexpr double kBeforeMm = 8;  // one lies before the other by more: it tells

Vec minus(const Vec& a, const Vec& b) {
  return {a[0] - b[0], a[1] - b[1], a[2] - b[2]};
}

double dot(const Vec& a, const Vec& b) {
  return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

Vec cross(const Vec& a, const Vec& b) {
  return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}

// The middle of all entries, each by its voxels, for which `which` is true.
template <class F>
std::optional<Vec> middle_of(const ScanCase& scan, const std::vector<Vec>& middle, F&& which) {
  Vec sum{};
  double all = 0;
  for (std::size_t e = 0; e < scan.entries.size(); ++e) {
    const ScanEntry& entry = scan.entries[e];
    if (!entry.drawn || entry.voxels == 0 || !which(entry)) continue;
    const auto n = static_cast<double>(entry.voxels);
    for (std::size_t a = 0; a < 3; ++a) sum[a] += n * middle[e + 1][a];
    all += n;
  }
  if (all == 0) return std::nullopt;
  return Vec{sum[0] / all, sum[1] / all, sum[2] / all};
}

bool bone(const ScanEntry& entry) {
  return entry.role == ScanEntry::Role::bone;
}

bool of_segment(const ScanEntry& entry, std::string_view segment) {
  return bone(entry) && entry.segment.starts_with(segment);
}

// Unit, towards the head; by the trunk, whose bones no posture bends far, else by the legs.
std::optional<Vec> upwards(const ScanCase& scan, const std::vector<Vec>& middle) {
  const auto along = [&](std::initializer_list<std::string_view> downwards) -> std::optional<Vec> {
    std::optional<Vec> first, last;
    for (const std::string_view segment : downwards) {
      const auto at = middle_of(scan, middle, [&](const ScanEntry& e) { return of_segment(e, segment); });
      if (!at) continue;
      if (!first) first = at;
      last = at;
    }
    if (!first || first == last) return std::nullopt;
    const Vec up = minus(*first, *last);
    const double length = std::sqrt(dot(up, up));
    if (length < kBeforeMm) return std::nullopt;
    return Vec{up[0] / length, up[1] / length, up[2] / length};
  };
  if (const auto trunk = along({"head", "neck", "thorax", "lumbar", "pelvis"})) return trunk;
  return along({"pelvis", "thigh", "shank", "foot"});
}

}  // namespace

Handedness handedness(const ScanCase& scan, const std::vector<Vec>& middle, const Vec& to_left) {
  const auto up = upwards(scan, middle);
  const double wide = std::sqrt(dot(to_left, to_left));
  if (!up || wide == 0) return Handedness::unknown;
  // Of a body, left is upwards x forwards.
  const Vec forwards = cross(to_left, *up);
  int ahead = 0, behind = 0;
  const auto tell = [&](auto&& before, auto&& after) {
    const auto a = middle_of(scan, middle, before), b = middle_of(scan, middle, after);
    if (!a || !b) return;
    const double by = dot(minus(*a, *b), forwards) / wide;
    if (std::abs(by) >= kBeforeMm) ++(by > 0 ? ahead : behind);
  };
  const auto spine = [](const ScanEntry& e) {
    return bone(e) && (e.name.starts_with("vertebra_t") || e.name == "thoracic_spine");
  };
  tell([](const ScanEntry& e) { return bone(e) && e.name == "sternum"; }, spine);
  tell([](const ScanEntry& e) { return bone(e) && e.name.starts_with("rib") && e.name != "rib_cage"; },
       spine);
  tell([](const ScanEntry& e) { return bone(e) && e.name.starts_with("hip_"); },
       [](const ScanEntry& e) { return bone(e) && e.name == "sacrum"; });
  tell([](const ScanEntry& e) { return bone(e) && e.name == "mandible"; },
       [](const ScanEntry& e) {
         return bone(e) && (e.name == "vertebra_c1" || e.name == "vertebra_c2" || e.name == "vertebra_c3" ||
                            e.name == "cervical_spine");
       });
  for (const std::string_view side : {"left", "right"})
    tell([&](const ScanEntry& e) { return of_segment(e, "toes") && e.name.ends_with(side); },
         [&](const ScanEntry& e) { return of_segment(e, "foot") && e.name.ends_with(side); });
  if (ahead > behind) return Handedness::body;
  return behind > ahead ? Handedness::mirrored : Handedness::unknown;
}

int organs_agree(const ScanCase& scan, const std::vector<Vec>& middle, const Vec& to_left) {
  const auto spine = middle_of(scan, middle, [](const ScanEntry& e) {
    return bone(e) && (e.name.starts_with("vertebra_") || e.name.ends_with("_spine") || e.name == "sacrum");
  });
  if (!spine) return 0;
  const double wide = std::sqrt(dot(to_left, to_left));
  int votes = 0;
  for (const std::pair<const char*, bool>& organ :
       {std::pair("liver", false), std::pair("spleen", true), std::pair("stomach", true)}) {
    const auto at = middle_of(scan, middle, [&](const ScanEntry& e) { return e.name == organ.first; });
    if (!at || wide == 0) continue;
    const double by = dot(minus(*at, *spine), to_left) / wide;
    if (std::abs(by) >= kBeforeMm) votes += (by > 0) == organ.second ? 1 : -1;
  }
  return votes > 0 ? 1 : votes < 0 ? -1 : 0;
}

}  // namespace ecorche::app
