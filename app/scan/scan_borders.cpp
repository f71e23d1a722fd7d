// SPDX-License-Identifier: Apache-2.0
#include "app/scan/scan_borders.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include "core/values/text.hpp"
#include "preprocess/scan/pieces.hpp"

namespace ecorche::app {
namespace {

using Role = ScanEntry::Role;

constexpr double kCapCm2 = 1;  // smaller ones are grazes of the skin

// Where a face of the image looks, as people say it; face 0 is the first layer of i, 1 the last, 2 of j, ...
std::string face_name(const ImageGrid& grid, std::size_t face) {
  const std::size_t axis = face / 2;
  const double sign = face % 2 == 0 ? -1 : 1;
  std::array<double, 3> d{};
  for (std::size_t row = 0; row < 3; ++row) d[row] = sign * grid.direction[3 * row + axis];
  std::size_t most = 0;
  for (std::size_t row = 1; row < 3; ++row) {
    if (std::abs(d[row]) > std::abs(d[most])) most = row;
  }
  static constexpr std::array<std::array<const char*, 2>, 3> names{
      {{"right", "left"}, {"front", "back"}, {"lower", "upper"}}};
  return names[most][d[most] > 0 ? 1 : 0];
}

struct Face {
  std::size_t voxels = 0;
  std::array<double, 3> sum{0, 0, 0};
};

std::string at(const std::array<double, 3>& p) {
  return "[" + text::number(p[0], 4) + ", " + text::number(p[1], 4) + ", " + text::number(p[2], 4) + "]";
}

}  // namespace

void tell_borders(ScanCase& out, const Context& context) {
  const ImageGrid& grid = out.labels.grid;
  const auto voxels = std::as_const(out.labels).scalars<std::uint16_t>();
  std::vector<std::array<std::size_t, 6>> on(out.entries.size() + 1);
  std::array<Face, 6> skin;
  for (std::size_t face = 0; face < 6; ++face) {
    context.check_stop();
    const std::size_t axis = face / 2, u = (axis + 1) % 3, w = (axis + 2) % 3;
    std::array<int, 3> v{};
    v[axis] = face % 2 == 0 ? 0 : grid.size[axis] - 1;
    for (v[u] = 0; v[u] < grid.size[u]; ++v[u]) {
      for (v[w] = 0; v[w] < grid.size[w]; ++v[w]) {
        const std::uint16_t id = voxels[grid.offset(v[0], v[1], v[2])];
        if (id == 0) continue;
        ++on[id][face];
        ++skin[face].voxels;
        for (std::size_t c = 0; c < 3; ++c) skin[face].sum[c] += v[c];
      }
    }
  }
  for (std::size_t face = 0; face < 6; ++face) {
    const std::size_t axis = face / 2;
    const double cm2 = static_cast<double>(skin[face].voxels) * grid.spacing[(axis + 1) % 3] *
                       grid.spacing[(axis + 2) % 3] / 100;
    if (cm2 < kCapCm2) continue;
    const auto count = static_cast<double>(skin[face].voxels);
    const auto middle =
        grid.point(skin[face].sum[0] / count, skin[face].sum[1] / count, skin[face].sum[2] / count);
    out.skin.caps.push_back("the " + face_name(grid, face) + " border: " + text::number(cm2) + " cm2 about " +
                            at(middle));
  }
  for (std::size_t e = 0; e < out.entries.size(); ++e) {
    ScanEntry& entry = out.entries[e];
    if (!entry.drawn) continue;
    for (std::size_t face = 0; face < 6; ++face) {
      if (on[e + 1][face] > 0) entry.cut.push_back(face_name(grid, face));
    }
    if (entry.role == Role::bone && !entry.cut.empty())
      out.notes.push_back(entry.name + ": cut by the " + text::joined(entry.cut, " and ") +
                          " border of the image: what is left is a stump, whose joint there is found from "
                          "what is seen, or not at all");
  }
}

double exposed_bone(const ScanCase& out, const Context& context) {
  const ImageGrid& grid = out.labels.grid;
  const auto labels = out.labels.scalars<std::uint16_t>();
  const scan::Pieces air = scan::find_pieces(out.labels, {1}, context);
  std::vector<std::uint8_t> around(air.pieces.size(), 0);
  for (std::size_t p = 0; p < around.size(); ++p) {
    for (const std::size_t on : air.pieces[p].on_border) around[p] |= on > 0 ? 1 : 0;
  }
  std::size_t faces = 0, bones = 0;
  const auto look = [&](int i, int j, int k) {
    if (i < 0 || j < 0 || k < 0 || i >= grid.size[0] || j >= grid.size[1] || k >= grid.size[2]) return;
    const std::uint16_t id = labels[grid.offset(i, j, k)];
    if (id == 0) return;
    ++faces;
    bones += out.entries[id - 1U].role == Role::bone ? 1 : 0;
  };
  for (const scan::Run& run : air.runs) {
    if (around[run.piece] == 0) continue;
    look(run.begin - 1, run.j, run.k);
    look(run.end, run.j, run.k);
    for (int i = run.begin; i < run.end; ++i) {
      for (const int step : {-1, 1}) {
        look(i, run.j + step, run.k);
        look(i, run.j, run.k + step);
      }
    }
  }
  return faces == 0 ? 1 : static_cast<double>(bones) / static_cast<double>(faces);
}

void tell_missing(ScanCase& out) {
  const auto bone = [&](const std::string& name) {
    return std::find_if(out.entries.begin(), out.entries.end(), [&](const ScanEntry& e) {
      return e.drawn && e.role == Role::bone && e.name == name;
    });
  };
  const auto has = [&](const std::string& name) { return bone(name) != out.entries.end(); };
  const auto has_segment = [&](const std::string& segment) {
    return std::any_of(out.entries.begin(), out.entries.end(), [&](const ScanEntry& e) {
      return e.drawn && e.role == Role::bone && e.segment == segment;
    });
  };
  for (const char* side : {"_left", "_right"}) {
    for (const auto& [one, other] :
         {std::pair("tibia", "fibula"), std::pair("radius", "ulna"), std::pair("ulna", "radius")}) {
      if (has(std::string(one) + side) && !has(std::string(other) + side))
        out.doubts.push_back(std::string(one) + side + " has no " + other +
                             " beside it: flesh there follows the " + one + " alone");
    }
    // A limb without its middle: what hangs below it would hang on air.
    for (const auto& [above, between, below] : {std::array<const char*, 3>{"thigh", "shank", "foot"},
                                                std::array<const char*, 3>{"upper_arm", "forearm", "hand"}}) {
      const std::string s = side;
      if (has_segment(above + s) && has_segment(below + s) && !has_segment(between + s))
        out.doubts.push_back("no bone of " + (between + s) + ", though " + above + s + " and " + below + s +
                             " have some: " + below + s + " then hangs on " + above + s);
    }
  }
  const bool ribs = std::any_of(out.entries.begin(), out.entries.end(), [](const ScanEntry& e) {
    return e.drawn && (e.name == "ribs" || e.name.starts_with("rib_")) && e.name != "rib_cage";
  });
  if (ribs && !has("sternum"))
    out.doubts.push_back("ribs without a sternum: the front of the chest follows the ribs alone");
  if (has("skull") && !has("mandible"))
    out.notes.push_back(
        "no mandible of its own: the jaw does not open (TotalSegmentator -ta craniofacial_structures has "
        "one)");
}

}  // namespace ecorche::app
