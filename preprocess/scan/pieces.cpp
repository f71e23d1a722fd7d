// SPDX-License-Identifier: Apache-2.0
#include "preprocess/scan/pieces.hpp"

#include <algorithm>

namespace ecorche::scan {
namespace {

// Runs as a forest: each points to an earlier one of its piece, or to itself.
class Forest {
 public:
  void add() { parent_.push_back(static_cast<std::uint32_t>(parent_.size())); }
  std::uint32_t root(std::uint32_t r) {
    while (parent_[r] != r) {
      parent_[r] = parent_[parent_[r]];
      r = parent_[r];
    }
    return r;
  }
  void join(std::uint32_t a, std::uint32_t b) {
    a = root(a);
    b = root(b);
    parent_[std::max(a, b)] = std::min(a, b);  // the earliest is the root
  }

 private:
  std::vector<std::uint32_t> parent_;
};

struct Rows {
  const Pieces& found;
  const std::vector<std::uint16_t>& ids;
  Forest& forest;

  void touch(std::size_t a, std::size_t b, int reach) {
    const Run &ra = found.runs[a], &rb = found.runs[b];
    if (ids[a] == ids[b] && ra.begin < rb.end + reach && rb.begin < ra.end + reach)
      forest.join(static_cast<std::uint32_t>(a), static_cast<std::uint32_t>(b));
  }

  // Joins the runs [a, a_end) of one row with those of another, whose voxels touch up to `reach` beside them.
  void join(std::size_t a, std::size_t a_end, std::size_t b, std::size_t b_end, int reach) {
    while (a < a_end && b < b_end) {
      const Run &ra = found.runs[a], &rb = found.runs[b];
      touch(a, b, reach);
      // The one that ends first can touch nothing further. Where both end, each may touch what follows the
      // other.
      if (ra.end == rb.end && a + 1 < a_end) touch(a + 1, b, reach);
      if (ra.end < rb.end) {
        ++a;
      } else {
        ++b;
      }
    }
  }
};

}  // namespace

Pieces find_pieces(const Image& labels, const std::vector<std::uint8_t>& wanted, const Context& context) {
  const auto voxels = labels.scalars<std::uint16_t>();
  const auto& n = labels.grid.size;
  Pieces out;
  std::vector<std::uint16_t> ids;  // of each run
  Forest forest;
  std::vector<std::size_t> row_begin(static_cast<std::size_t>(n[1]) * static_cast<std::size_t>(n[2]) + 1, 0);
  Rows rows{out, ids, forest};
  std::size_t at = 0, row = 0;
  for (int k = 0; k < n[2]; ++k) {
    context.check_stop();
    context.report(static_cast<double>(k) / n[2]);
    for (int j = 0; j < n[1]; ++j, ++row) {
      row_begin[row] = out.runs.size();
      for (int i = 0; i < n[0];) {
        const std::uint16_t id = voxels[at];
        const int begin = i;
        for (; i < n[0] && voxels[at] == id; ++i) ++at;
        if (id >= wanted.size() || wanted[id] == 0) continue;
        out.runs.push_back({begin, i, j, k, 0});
        ids.push_back(id);
        forest.add();
      }
      row_begin[row + 1] = out.runs.size();
      const auto layer = static_cast<std::size_t>(n[1]);
      const auto with = [&](std::size_t other, int reach) {
        rows.join(row_begin[row], row_begin[row + 1], row_begin[other], row_begin[other + 1], reach);
      };
      // Rows that share a face are joined also where voxels share an edge; those that share an edge, not.
      if (j > 0) with(row - 1, 1);
      if (k > 0) with(row - layer, 1);
      if (k > 0 && j > 0) with(row - layer - 1, 0);
      if (k > 0 && j + 1 < n[1]) with(row - layer + 1, 0);
    }
  }
  std::vector<std::uint32_t> number(out.runs.size(), 0);
  for (std::size_t r = 0; r < out.runs.size(); ++r) {
    const std::uint32_t root = forest.root(static_cast<std::uint32_t>(r));
    if (root == r) {
      number[r] = static_cast<std::uint32_t>(out.pieces.size());
      out.pieces.push_back({.id = ids[r]});
    }
    Run& run = out.runs[r];
    run.piece = number[root];
    Piece& piece = out.pieces[run.piece];
    const auto length = static_cast<std::size_t>(run.end - run.begin);
    piece.voxels += length;
    const double count = static_cast<double>(length);
    piece.centre[0] += count * 0.5 * (run.begin + run.end - 1);
    piece.centre[1] += count * run.j;
    piece.centre[2] += count * run.k;
    piece.on_border[0] += run.begin == 0 ? 1 : 0;
    piece.on_border[1] += run.end == n[0] ? 1 : 0;
    piece.on_border[2] += run.j == 0 ? length : 0;
    piece.on_border[3] += run.j + 1 == n[1] ? length : 0;
    piece.on_border[4] += run.k == 0 ? length : 0;
    piece.on_border[5] += run.k + 1 == n[2] ? length : 0;
  }
  for (Piece& piece : out.pieces) {
    const auto count = static_cast<double>(piece.voxels);
    piece.centre =
        labels.grid.point(piece.centre[0] / count, piece.centre[1] / count, piece.centre[2] / count);
  }
  return out;
}

std::vector<std::vector<std::array<double, 3>>> sample_points(const Pieces& pieces, const ImageGrid& grid,
                                                              std::size_t most) {
  std::vector<std::size_t> runs(pieces.pieces.size(), 0), seen(pieces.pieces.size(), 0);
  for (const Run& run : pieces.runs) ++runs[run.piece];
  std::vector<std::vector<std::array<double, 3>>> out(pieces.pieces.size());
  for (const Run& run : pieces.runs) {
    const std::size_t step = 1 + 2 * runs[run.piece] / std::max<std::size_t>(1, most);
    if (seen[run.piece]++ % step != 0) continue;
    out[run.piece].push_back(grid.point(run.begin, run.j, run.k));
    if (run.end - run.begin > 1) out[run.piece].push_back(grid.point(run.end - 1, run.j, run.k));
  }
  return out;
}

}  // namespace ecorche::scan
