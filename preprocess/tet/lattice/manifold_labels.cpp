// SPDX-License-Identifier: Apache-2.0
#include "preprocess/tet/lattice/manifold_labels.hpp"

#include <tbb/parallel_for.h>

#include <algorithm>

#include "preprocess/tet/lattice/incidence.hpp"
#include "preprocess/voxel/voxelize.hpp"

namespace ecorche::tet {
namespace {

using Quad = std::array<std::int32_t, 4>;
constexpr int kGentleVisits = 4;  // of a node, before its neighbourhood turns soft

/// The tets around one node and which of them share faces.
class Star {
 public:
  Star(const std::vector<Quad>& quads, const Incidence& at, std::int32_t node) {
    const auto n = static_cast<std::size_t>(node);
    tets_.assign(at.tets.begin() + static_cast<std::ptrdiff_t>(at.first[n]),
                 at.tets.begin() + static_cast<std::ptrdiff_t>(at.first[n + 1]));
    struct Face {
      std::int32_t low, high;
      std::size_t tet;
    };
    std::vector<Face> faces;
    for (std::size_t t = 0; t < tets_.size(); ++t) {
      std::int32_t others[3];
      int k = 0;
      for (const std::int32_t other : quads[static_cast<std::size_t>(tets_[t])])
        if (other != node) others[k++] = other;
      for (int e = 0; e < 3; ++e)
        faces.push_back(
            {std::min(others[e], others[(e + 1) % 3]), std::max(others[e], others[(e + 1) % 3]), t});
    }
    std::sort(faces.begin(), faces.end(), [](const Face& a, const Face& b) {
      return a.low != b.low ? a.low < b.low : a.high != b.high ? a.high < b.high : a.tet < b.tet;
    });
    neighbours_.assign(tets_.size(), {npos, npos, npos});
    for (std::size_t f = 0; f + 1 < faces.size(); ++f) {
      if (faces[f].low != faces[f + 1].low || faces[f].high != faces[f + 1].high) continue;
      join(faces[f].tet, faces[f + 1].tet);
      join(faces[f + 1].tet, faces[f].tet);
    }
  }

  const std::vector<std::int32_t>& tets() const { return tets_; }

  /// Groups of the tets for which `in` holds, largest first (of equal ones, the one with the lowest tet).
  template <class In>
  std::vector<std::vector<std::int32_t>> groups(const In& in) const {
    std::vector<std::vector<std::int32_t>> all;
    std::vector<std::uint8_t> seen(tets_.size(), 0);
    std::vector<std::size_t> front;
    for (std::size_t start = 0; start < tets_.size(); ++start) {
      if (seen[start] != 0 || !in(tets_[start])) continue;
      seen[start] = 1;
      front = {start};
      std::vector<std::int32_t> group;
      while (!front.empty()) {
        const std::size_t t = front.back();
        front.pop_back();
        group.push_back(tets_[t]);
        for (const std::size_t other : neighbours_[t])
          if (other != npos && seen[other] == 0 && in(tets_[other])) {
            seen[other] = 1;
            front.push_back(other);
          }
      }
      all.push_back(std::move(group));
    }
    std::stable_sort(all.begin(), all.end(),
                     [](const auto& a, const auto& b) { return a.size() > b.size(); });
    return all;
  }

 private:
  static constexpr std::size_t npos = static_cast<std::size_t>(-1);
  void join(std::size_t t, std::size_t other) {
    for (std::size_t& place : neighbours_[t])
      if (place == npos) {
        place = other;
        return;
      }
  }

  std::vector<std::int32_t> tets_;
  std::vector<std::array<std::size_t, 3>> neighbours_;
};

class ManifoldRepair {
 public:
  ManifoldRepair(const std::vector<Quad>& quads, std::size_t nodes, std::vector<std::uint16_t>& label)
      : quads_(quads),
        label_(label),
        at_(quads.size(), nodes, [&](std::size_t t, std::size_t c) { return quads[t][c]; }),
        visits_(nodes, 0) {}

  /// Whether labels differ around a node.
  bool mixed(std::int32_t node) const {
    const auto n = static_cast<std::size_t>(node);
    for (std::size_t e = at_.first[n] + 1; e < at_.first[n + 1]; ++e)
      if (label(at_.tets[e]) != label(at_.tets[at_.first[n]])) return true;
    return false;
  }

  /// The first change that a node needs: tets and their new label; empty where it is well.
  std::pair<std::vector<std::int32_t>, std::uint16_t> change(std::int32_t node, bool gentle) const {
    const Star star(quads_, at_, node);
    const auto bodily = [&](std::int32_t t) { return label(t) != voxel::outside; };
    const auto outer = [&](std::int32_t t) { return !bodily(t); };
    const auto rest_of = [](std::vector<std::vector<std::int32_t>> groups) {  // all but the largest
      std::vector<std::int32_t> rest;
      for (std::size_t g = 1; g < groups.size(); ++g)
        rest.insert(rest.end(), groups[g].begin(), groups[g].end());
      return rest;
    };
    const auto all = [&](const auto& in) {
      std::vector<std::int32_t> chosen;
      for (const std::int32_t t : star.tets())
        if (in(t)) chosen.push_back(t);
      return chosen;
    };
    if (star.groups(bodily).size() > 1) return {all(outer), voxel::soft};
    if (auto gaps = star.groups(outer); gaps.size() > 1) return {rest_of(std::move(gaps)), voxel::soft};
    std::vector<std::uint16_t> bones;
    for (const std::int32_t t : star.tets())
      if (label(t) >= voxel::first_bone) bones.push_back(label(t));
    std::sort(bones.begin(), bones.end());
    bones.erase(std::unique(bones.begin(), bones.end()), bones.end());
    for (const std::uint16_t bone : bones) {
      const auto in = [&](std::int32_t t) { return label(t) == bone; };
      if (auto parts = star.groups(in); parts.size() > 1) return {rest_of(std::move(parts)), voxel::soft};
      auto gaps = star.groups([&](std::int32_t t) { return !in(t); });
      if (gaps.size() < 2) continue;
      std::vector<std::int32_t> rest = rest_of(std::move(gaps));
      const bool enclosed =
          std::all_of(rest.begin(), rest.end(), [&](std::int32_t t) { return label(t) == voxel::soft; });
      if (gentle && enclosed) return {std::move(rest), bone};
      return {all(in), voxel::soft};
    }
    const auto soft = [&](std::int32_t t) { return label(t) == voxel::soft; };
    if (star.groups(soft).size() > 1 || star.groups([&](std::int32_t t) { return !soft(t); }).size() > 1)
      return {all([&](std::int32_t t) { return label(t) >= voxel::first_bone; }), voxel::soft};
    return {};
  }

  std::int64_t run(const Context& context) {
    const std::size_t nodes = visits_.size();
    constexpr std::size_t kRun = 1 << 10;
    std::vector<std::vector<std::int32_t>> found((nodes + kRun - 1) / kRun);
    tbb::parallel_for(std::size_t{0}, found.size(), [&](std::size_t run) {
      context.check_stop();
      for (std::size_t n = run * kRun; n < std::min(nodes, (run + 1) * kRun); ++n) {
        const auto node = static_cast<std::int32_t>(n);
        if (mixed(node) && !change(node, true).first.empty()) found[run].push_back(node);
      }
    });
    std::vector<std::int32_t> queue;
    for (const std::vector<std::int32_t>& some : found) queue.insert(queue.end(), some.begin(), some.end());
    std::vector<std::uint8_t> queued(nodes, 0);
    for (const std::int32_t node : queue) queued[static_cast<std::size_t>(node)] = 1;
    std::int64_t changed = 0;
    for (std::size_t q = 0; q < queue.size(); ++q) {
      if ((q & 0xfff) == 0) context.check_stop();
      const std::int32_t node = queue[q];
      queued[static_cast<std::size_t>(node)] = 0;
      const bool gentle = visits_[static_cast<std::size_t>(node)] < kGentleVisits;
      const auto [tets, to] = change(node, gentle);
      if (tets.empty()) continue;
      visits_[static_cast<std::size_t>(node)] += gentle ? 1 : 0;
      for (const std::int32_t t : tets) {
        label_[static_cast<std::size_t>(t)] = to;
        ++changed;
        for (const std::int32_t other : quads_[static_cast<std::size_t>(t)]) {
          if (queued[static_cast<std::size_t>(other)] != 0) continue;
          queued[static_cast<std::size_t>(other)] = 1;
          queue.push_back(other);
        }
      }
    }
    return changed;
  }

 private:
  std::uint16_t label(std::int32_t t) const { return label_[static_cast<std::size_t>(t)]; }

  const std::vector<Quad>& quads_;
  std::vector<std::uint16_t>& label_;
  Incidence at_;
  std::vector<std::uint8_t> visits_;
};

}  // namespace

std::int64_t make_manifold(const std::vector<Quad>& tets, std::size_t nodes,
                           std::vector<std::uint16_t>& label, const Context& context) {
  return ManifoldRepair(tets, nodes, label).run(context);
}

}  // namespace ecorche::tet
