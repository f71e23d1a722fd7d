// SPDX-License-Identifier: Apache-2.0
#include "preprocess/scan/part_vertebrae.hpp"

#include "preprocess/scan/cut_bones.hpp"
#include "preprocess/scan/neck_levels.hpp"

namespace ecorche::scan {
namespace {

constexpr int kSureWidth = 8, kSureDepth = 6;  // mm, of what is surely a body
constexpr double kFloodsFrom = 0.4;            // as bright as this is bone
constexpr double kUsualGap = 17;               // mm, from disc to disc
constexpr int kLowestVertebra = 7;             // of a neck

class Neck {
 public:
  Neck(const NeckLattice& lattice, const NeckLevels& levels, const Context& context)
      : l_(lattice), n_(levels), context_(context) {
    plant();
    flood();
  }

  /// Row, of a point on the neck.
  std::size_t of(const Eigen::Vector3d& p) const {
    const Eigen::Vector3i c = l_.cell(p);
    const std::uint16_t piece =
        l_.has(c[0], c[1], c[2]) ? piece_[l_.offset(c[0], c[1], c[2])] : std::uint16_t{0};
    return piece != 0 ? piece - 1U : static_cast<std::size_t>(n_.row_of(c[0], c[1], c[2]));
  }

  /// Which vertebrae the rows are: where a disc was not found there are two in one.
  std::vector<VertebraPiece> pieces() const {
    std::vector<double> gaps;
    for (std::size_t n = 1; n < n_.discs.size(); ++n) gaps.push_back(n_.discs[n - 1].k - n_.discs[n].k);
    std::sort(gaps.begin(), gaps.end());
    const double usual = gaps.size() < 2 ? kUsualGap : gaps[(gaps.size() - 1) / 2];
    int lowest = l_.size[2];
    for (std::size_t n = 0; n < l_.neck.size() && lowest == l_.size[2]; ++n) {
      if (l_.neck[n] != 0)
        lowest = static_cast<int>(
            n / (static_cast<std::size_t>(l_.size[0]) * static_cast<std::size_t>(l_.size[1])));
    }
    std::vector<VertebraPiece> out;
    const auto add = [&](int first, int last, double contrast) {
      out.push_back({first, std::min(last, kLowestVertebra), 0, contrast});
    };
    double contrast = n_.discs.front().contrast;
    if (n_.beside) {
      const double beside = std::min((*n_.beside)[0].contrast, (*n_.beside)[1].contrast);
      add(1, 1, beside);
      add(2, 2, std::min(beside, contrast));
    } else {
      add(1, 2, contrast);
    }
    for (std::size_t n = 0; n < n_.discs.size(); ++n) {
      const bool last = n + 1 == n_.discs.size();
      const double high = n_.discs[n].k - (last ? lowest : n_.discs[n + 1].k);
      const int count = std::max(1, static_cast<int>(high / usual + (last ? 0.2 : 0.5)));
      const int first = out.back().last + 1;
      // Of the lowest only one joint was seen.
      contrast = last ? 0.5 * n_.discs[n].contrast : std::min(n_.discs[n].contrast, n_.discs[n + 1].contrast);
      if (first > kLowestVertebra)
        out.back().contrast = 0;  // more vertebrae than a neck has: one was seen twice
      else
        add(first, first + count - 1, contrast);
    }
    return out;
  }

 private:
  void plant() {
    piece_.assign(l_.bright.size(), 0);
    const auto put = [&](int i, int j, int k, int piece) {
      if (l_.has(i, j, k) && l_.other[l_.offset(i, j, k)] == 0 && l_.at(i, j, k) >= kFloodsFrom)
        piece_[l_.offset(i, j, k)] = static_cast<std::uint16_t>(piece + 1);
    };
    const int atlas = n_.beside ? 1 : 0;  // rows before the axis
    for (int k = 0; k < l_.size[2] && k < n_.top; ++k) {
      for (int d = -kSureWidth; d <= kSureWidth; ++d) {
        for (int s = -kSureDepth; s <= kSureDepth; ++s) {
          const int i = n_.middle + d, j = n_.line_at(k) + s;
          bool clear = true;
          for (const NeckLevel& level : n_.discs)
            clear = clear && std::abs(k - level.k - std::tan(level.tilt) * s) >= 2;
          const bool dens = k > n_.discs.front().k + 12;  // beside and before it the atlas begins
          if (!clear || (dens && (std::abs(d) > 3 || s < -2))) continue;
          if (dens && n_.beside && k > std::min((*n_.beside)[0].k, (*n_.beside)[1].k) + 10) continue;
          put(i, j, k, dens ? atlas : n_.row_of(i, j, k) < atlas ? atlas : n_.row_of(i, j, k));
        }
      }
      for (int d = -kMass; n_.beside && d <= kMass; ++d) {
        if (std::abs(d) < kDens) continue;
        const double over = n_.over_joint(n_.middle + d, k);
        if (std::abs(over) < 2 || std::abs(over) > 9 || k < n_.discs.front().k + 4) continue;
        for (int s = -5; s <= 5; ++s) put(n_.middle + d, n_.line_at(k) + s, k, over > 0 ? 0 : 1);
      }
    }
  }

  void flood() {
    std::vector<std::uint8_t> mask(l_.bright.size(), 0);
    std::vector<float> depth(mask.size(), 0);
    for (std::size_t n = 0; n < mask.size(); ++n) {
      mask[n] =
          l_.other[n] == 0 && (l_.neck[n] != 0 || static_cast<double>(l_.bright[n]) >= kFloodsFrom) ? 1 : 0;
      depth[n] = std::max(0.0F, l_.bright[n]);
    }
    watershed(mask, depth, l_.size, 0.05, piece_, context_.quiet());
    // What no seed reaches is of the vertebra at whose level it lies.
    std::size_t n = 0;
    for (int k = 0; k < l_.size[2]; ++k) {
      for (int j = 0; j < l_.size[1]; ++j) {
        for (int i = 0; i < l_.size[0]; ++i, ++n) {
          if (l_.neck[n] != 0 && piece_[n] == 0)
            piece_[n] = static_cast<std::uint16_t>(n_.row_of(i, j, k) + 1);
        }
      }
    }
  }

  const NeckLattice& l_;
  const NeckLevels& n_;
  const Context& context_;
  std::vector<std::uint16_t> piece_;  // of each sample: row + 1
};

}  // namespace

PartedNeck part_neck(const Image& ct, const std::vector<std::uint8_t>& neck,
                     const std::vector<std::uint8_t>& other, const Eigen::Matrix3d& axes, double bone,
                     double skin, const Context& context) {
  PartedNeck out;
  const NeckLattice lattice = neck_lattice(ct, neck, other, axes, bone, skin);
  if (lattice.bright.empty()) {
    out.why = "what was found of it is no neck";
    return out;
  }
  const NeckLevels levels = find_levels(lattice, context);
  out.why = levels.why;
  if (levels.discs.empty()) return out;
  const Neck parted(lattice, levels, context);
  out.pieces = parted.pieces();
  out.of.assign(neck.size(), 0);
  std::size_t at = 0;
  const ImageGrid& grid = ct.grid;
  for (int k = 0; k < grid.size[2]; ++k) {
    for (int j = 0; j < grid.size[1]; ++j) {
      for (int i = 0; i < grid.size[0]; ++i, ++at) {
        if (neck[at] == 0) continue;
        const auto p = grid.point(i, j, k);
        const std::size_t row = std::min(parted.of({p[0], p[1], p[2]}), out.pieces.size() - 1);
        out.of[at] = static_cast<std::uint8_t>(row + 1);
        ++out.pieces[row].voxels;
      }
    }
  }
  return out;
}

}  // namespace ecorche::scan
