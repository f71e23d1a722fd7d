// SPDX-License-Identifier: Apache-2.0
#include "preprocess/label_surfaces/hold_apart.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <limits>
#include <map>
#include <string>
#include <unordered_map>

#include "core/values/text.hpp"
#include "preprocess/label_surfaces/mask.hpp"
#include "preprocess/label_surfaces/nearest.hpp"

namespace ecorche::label_surfaces {
namespace {

using Index = std::array<std::int32_t, 3>;

// A box of voxels, both ends included; empty where low > high.
struct Box {
  Index low{0, 0, 0}, high{-1, -1, -1};

  void add(const Index& v) {
    if (high[0] < low[0]) low = high = v;
    for (std::size_t a = 0; a < 3; ++a) {
      low[a] = std::min(low[a], v[a]);
      high[a] = std::max(high[a], v[a]);
    }
  }
};

// Runs over the voxels of a box: their place in the box, in the image, and their index.
template <class F>
void each_voxel(const ImageGrid& grid, const Box& box, const F& f) {
  std::size_t at = 0;
  for (int k = box.low[2]; k <= box.high[2]; ++k)
    for (int j = box.low[1]; j <= box.high[1]; ++j) {
      std::size_t voxel = grid.offset(box.low[0], j, k);
      for (int i = box.low[0]; i <= box.high[0]; ++i) f(at++, voxel++, Index{i, j, k});
    }
}

Box whole(const ImageGrid& grid) {
  return {{0, 0, 0}, {grid.size[0] - 1, grid.size[1] - 1, grid.size[2] - 1}};
}

// The nearest of the voxels of a box that `tag_of` gives a tag of 0 or more.
struct Nearest {
  std::vector<float> squared;
  std::vector<std::int32_t> tag;

  template <class F>
  Nearest(const ImageGrid& grid, const Box& box, const Context& context, const F& tag_of) {
    Index size{};
    std::size_t count = 1;
    for (std::size_t a = 0; a < 3; ++a) {
      size[a] = std::max(0, box.high[a] - box.low[a] + 1);
      count *= static_cast<std::size_t>(size[a]);
    }
    squared.assign(count, kFar);
    tag.assign(count, -1);
    each_voxel(grid, box, [&](std::size_t at, std::size_t voxel, const Index&) {
      tag[at] = tag_of(at, voxel);
      if (tag[at] >= 0) squared[at] = 0;
    });
    spread_nearest(squared, tag, size, grid.spacing, context);
  }
};

// Which limb each segment is of (-1: none), how many joints lie between two, and the entry of each limb.
class Tree {
 public:
  Tree(const Skeleton& skeleton, const HeldApart& apart) : skeleton_(skeleton), apart_(apart) {
    const std::size_t n = skeleton.segments.size();
    limb_.assign(n, -1);
    entry_.assign(n, static_cast<int>(apart.limbs.size()));
    for (std::size_t e = 0; e < apart.limbs.size(); ++e)
      for (const std::string& name : apart.limbs[e].segments) {
        const auto top = static_cast<std::size_t>(skeleton.find_segment(name));
        limb_[top] = static_cast<int>(top);
        entry_[top] = static_cast<int>(e);
      }
    for (std::size_t s = 0; s < n; ++s) {  // parents come first
      if (limb_[s] >= 0 || parent(s) < 0) continue;
      limb_[s] = limb_[static_cast<std::size_t>(parent(s))];
      entry_[s] = entry_[static_cast<std::size_t>(parent(s))];
    }
  }

  int limb(int segment) const { return limb_[static_cast<std::size_t>(segment)]; }
  int entry(int segment) const { return entry_[static_cast<std::size_t>(segment)]; }
  bool strangers(int a, int b) const {
    return limb(a) != limb(b) && joints_between(a, b) > std::min(joints(a), joints(b));
  }

 private:
  int parent(std::size_t segment) const { return skeleton_.segments[segment].parent; }
  int joints_between(int a, int b) const {
    int count = 0;
    for (; a != b; ++count) {  // a parent's row is the lower one
      int& lower = a > b ? a : b;
      lower = parent(static_cast<std::size_t>(lower));
    }
    return count;
  }

  int joints(int segment) const {
    const auto e = static_cast<std::size_t>(entry(segment));
    return e < apart_.limbs.size() ? apart_.limbs[e].joints : std::numeric_limits<int>::max();
  }

  const Skeleton& skeleton_;
  const HeldApart& apart_;
  std::vector<int> limb_, entry_;
};

// The entry of limbs that each labelled voxel is of, `none` for those of no limb, -1 where nothing is, or
// nothing that takes part.
std::vector<std::int32_t> entries(const CaseLabels& labels, std::int32_t none) {
  std::map<std::int64_t, std::int32_t> of_id;
  for (std::size_t e = 0; e < labels.apart->limbs.size(); ++e) {
    const HeldApart::Limbs& limbs = labels.apart->limbs[e];
    for (const std::int64_t id : limbs.ids)
      of_id[id] = limbs.segments.empty() ? std::int32_t{-1} : static_cast<std::int32_t>(e);
  }
  std::vector<std::int32_t> out(labels.image.grid.voxels(), -1);
  const auto read = [&](const Image& layer) {
    with_scalar_type(layer.type, [&](auto zero) {
      using T = decltype(zero);
      const auto voxels = layer.scalars<T>();
      T last{};
      std::int32_t entry = -1;
      for (std::size_t v = 0; v < voxels.size(); ++v) {
        if (voxels[v] != last) {
          last = voxels[v];
          const auto found = of_id.find(static_cast<std::int64_t>(last));
          entry = found != of_id.end() ? found->second : none;
          if (last == zero) entry = -1;
        }
        if (out[v] < 0) out[v] = entry;
      }
    });
  };
  read(labels.image);
  for (const Image& layer : labels.overlaps) read(layer);
  return out;
}

// The segment of every labelled voxel, -1 elsewhere.
std::vector<std::int32_t> segments_of_voxels(const Case& patient, const Tree& tree, const Context& context) {
  const CaseLabels& labels = *patient.labels;
  const ImageGrid& grid = labels.image.grid;
  const auto count = labels.apart->limbs.size() + 1;
  const std::vector<std::int32_t> entry = entries(labels, static_cast<std::int32_t>(count - 1));
  std::vector<std::int32_t> of_bone(entry.size(), -1);
  std::vector<Box> boxes(count);  // of each entry's voxels and bones
  std::vector<bool> boned(count, false), fleshed(count, false);
  const LabelBlocks blocks(labels, context);
  for (const CaseBone& bone : patient.bones) {
    if (!bone.source) continue;
    LabelSource source = *bone.source;
    source.close_mm = 0;  // its own voxels
    const Mask mask = blocks.mask(source, context);
    const auto segment = static_cast<std::int32_t>(patient.skeleton.find_segment(bone.segment));
    const auto e = static_cast<std::size_t>(tree.entry(segment));
    for (int k = 0; k < mask.size[2]; ++k)
      for (int j = 0; j < mask.size[1]; ++j)
        for (int i = 0; i < mask.size[0]; ++i) {
          if (mask.inside[mask.offset(i, j, k)] == 0) continue;
          const Index v{mask.low[0] + i, mask.low[1] + j, mask.low[2] + k};
          of_bone[grid.offset(v[0], v[1], v[2])] = segment;
          boxes[e].add(v);
          boned[e] = true;
        }
  }
  each_voxel(grid, whole(grid), [&](std::size_t at, std::size_t, const Index& v) {
    if (entry[at] < 0) return;
    boxes[static_cast<std::size_t>(entry[at])].add(v);
    fleshed[static_cast<std::size_t>(entry[at])] = true;
  });
  std::vector<std::int32_t> out = of_bone;
  for (std::size_t e = 0; e < count; ++e) {
    if (!fleshed[e]) continue;
    if (!boned[e]) {
      const bool rest = e + 1 == count;
      throw Error(ErrorKind::config, labels.apart->where + (rest ? "" : ".limbs[" + std::to_string(e) + "]"),
                  rest ? "no bone of labels is outside of the limbs" : "these limbs have no bone of labels",
                  "give the bones there labels, not files");
    }
    const Nearest nearest(grid, boxes[e], context, [&](std::size_t, std::size_t voxel) {
      const std::int32_t segment = of_bone[voxel];
      return segment >= 0 && tree.entry(segment) == static_cast<int>(e) ? segment : -1;
    });
    each_voxel(grid, boxes[e], [&](std::size_t at, std::size_t voxel, const Index&) {
      if (out[voxel] < 0 && entry[voxel] == static_cast<int>(e))
        out[voxel] = static_cast<std::int32_t>(nearest.tag[at]);
    });
  }
  return out;
}

// The nearest stranger of a voxel, where one is nearer than the gap.
struct Stranger {
  float squared;
  std::size_t voxel;
};
using Strangers = std::unordered_map<std::size_t, Stranger>;

Strangers near_strangers(const Case& patient, const Tree& tree, const std::vector<std::int32_t>& segment,
                         const Context& context) {
  const ImageGrid& grid = patient.labels->image.grid;
  const double gap = patient.labels->apart->gap_mm;
  std::vector<Box> boxes(patient.skeleton.segments.size());
  each_voxel(grid, whole(grid), [&](std::size_t at, std::size_t, const Index& v) {
    if (segment[at] >= 0) boxes[static_cast<std::size_t>(segment[at])].add(v);
  });
  Strangers out;
  for (int s = 0; s < static_cast<int>(boxes.size()); ++s) {
    Box box = boxes[static_cast<std::size_t>(s)];
    if (tree.limb(s) < 0 || box.high[0] < box.low[0]) continue;
    for (std::size_t a = 0; a < 3; ++a) {
      const int reach = static_cast<int>(std::ceil(gap / grid.spacing[a]));
      box.low[a] = std::max(0, box.low[a] - reach);
      box.high[a] = std::min(grid.size[a] - 1, box.high[a] + reach);
    }
    std::vector<std::size_t> image_voxel;
    each_voxel(grid, box,
               [&](std::size_t, std::size_t voxel, const Index&) { image_voxel.push_back(voxel); });
    const auto is_stranger = [&](std::size_t voxel) {
      return segment[voxel] >= 0 && tree.strangers(s, segment[voxel]);
    };
    const auto is_own = [&](std::size_t voxel) { return segment[voxel] == s; };
    // Those of this segment ask for strangers, and the strangers for it.
    const auto ask = [&](const auto& who, const auto& whom) {
      const Nearest nearest(grid, box, context, [&](std::size_t at, std::size_t voxel) {
        return whom(voxel) ? static_cast<std::int32_t>(at) : -1;
      });
      for (std::size_t at = 0; at < image_voxel.size(); ++at) {
        const float d = nearest.squared[at];
        if (static_cast<double>(d) >= gap * gap || !who(image_voxel[at])) continue;
        const Stranger found{d, image_voxel[static_cast<std::size_t>(nearest.tag[at])]};
        const auto [known, fresh] = out.emplace(image_voxel[at], found);
        if (!fresh && d < known->second.squared) known->second = found;
      }
    };
    ask(is_own, is_stranger);
    ask(is_stranger, is_own);
  }
  return out;
}

void erase(Image& layer, const std::vector<std::size_t>& gone) {
  with_scalar_type(layer.type, [&](auto zero) {
    const auto voxels = layer.scalars<decltype(zero)>();
    for (const std::size_t v : gone) voxels[v] = zero;
  });
}

std::string in_ml(std::int64_t voxels, const ImageGrid& grid) {
  const double ml = 1e-3 * static_cast<double>(voxels) * grid.spacing[0] * grid.spacing[1] * grid.spacing[2];
  return text::number(ml, 4) + " ml";
}

void warn_of_removed(const Case& patient, const std::vector<RemovedVoxels>& taken, std::int64_t labelled,
                     const Context& context) {
  const ImageGrid& grid = patient.labels->image.grid;
  std::int64_t all = 0;
  std::string pairs;
  for (const RemovedVoxels& t : taken) {
    all += t.voxels;
    const auto name = [&](int s) { return patient.skeleton.segments[static_cast<std::size_t>(s)].name; };
    pairs += (pairs.empty() ? ": " : ", ") + in_ml(t.voxels, grid) + " of " + name(t.a) + " and " + name(t.b);
  }
  const std::string share = text::number(100 * static_cast<double>(all) / static_cast<double>(labelled));
  context.warn(patient.labels->apart->where + ": " + in_ml(all, grid) + " (" + share +
               " % of what is labelled) taken out, so that limbs are apart" + pairs +
               " (a smaller gap_mm takes less)");
}

}  // namespace

std::vector<RemovedVoxels> hold_apart(Case& patient, const Context& context) {
  const Tree tree(patient.skeleton, *patient.labels->apart);
  const std::vector<std::int32_t> segment = segments_of_voxels(patient, tree, context);
  const Strangers strangers = near_strangers(patient, tree, segment, context);
  const double gap = patient.labels->apart->gap_mm;
  std::vector<std::size_t> gone;
  std::map<std::pair<int, int>, std::int64_t> count;
  for (const auto& [voxel, stranger] : strangers) {
    const double d = std::sqrt(static_cast<double>(stranger.squared));
    const double theirs = std::sqrt(static_cast<double>(strangers.at(stranger.voxel).squared));
    if (2 * d >= gap + theirs) continue;
    gone.push_back(voxel);
    const int a = segment[voxel], b = segment[stranger.voxel];
    ++count[{std::min(a, b), std::max(a, b)}];
  }
  erase(patient.labels->image, gone);
  for (Image& layer : patient.labels->overlaps) erase(layer, gone);
  std::vector<RemovedVoxels> out;
  out.reserve(count.size());
  for (const auto& [pair, voxels] : count) out.push_back({pair.first, pair.second, voxels});
  warn_of_removed(patient, out,
                  std::count_if(segment.begin(), segment.end(), [](std::int32_t s) { return s >= 0; }),
                  context);
  return out;
}

}  // namespace ecorche::label_surfaces
