// SPDX-License-Identifier: Apache-2.0
// What a cell of groups is read from, its posed nodes, and the corners of a vector of vertices among them.
// Included once per instruction set.
#if defined(ECORCHE_RUNTIME_SKIN_CELL_NODES_INL) == defined(HWY_TARGET_TOGGLE)
#ifdef ECORCHE_RUNTIME_SKIN_CELL_NODES_INL
#undef ECORCHE_RUNTIME_SKIN_CELL_NODES_INL
#else
#define ECORCHE_RUNTIME_SKIN_CELL_NODES_INL
#endif

#include <algorithm>

#include "runtime/skin/palette-inl.hpp"
#include "runtime/skin/vectors-inl.hpp"
#include "runtime/skin/vertex_groups.hpp"

HWY_BEFORE_NAMESPACE();
namespace ecorche::runtime::HWY_NAMESPACE {

// Cells are too short for the processor to foresee them: asked for this many cells ahead.
constexpr std::size_t kCellsAhead = 2;

/// Asks for what a cell is read from: its palette, and its groups' arrays.
HWY_INLINE void ask_for_cell(const VertexGroups& groups, std::size_t c, bool normals) {
  constexpr std::size_t size = VertexGroups::size;
  const VertexGroups::Cell& cell = groups.cells[c];
  const std::size_t first = groups.first_group(c), count = cell.end - first;
  ask_for_run(&groups.rows[cell.palette], cell.count);
  ask_for_run(&groups.corners[size * first], size * count);
  if (normals) ask_for_run(&groups.normal[2 * size * first], 2 * size * count);
  if (groups.groups[first].step == 0) return;
  const std::size_t data = groups.groups[first].data;
  ask_for_run(&groups.narrow[data], std::min(3 * size * count, groups.narrow.size() - data));
}

#if HWY_TARGET <= HWY_AVX3

/// 16 kBlocks nodes, which stay in registers while the groups of the cell are moved: a vector of corners is
/// then one permutation of up to 32 of them, or two of 64.
template <std::size_t kBlocks>
class CellNodes {
 public:
  /// `rows`: where each node begins in `places`. The fourth number that is loaded of a node is its
  /// neighbour's.
  HWY_INLINE CellNodes(const float* places, const std::uint32_t* rows) {
    for (std::size_t b = 0; b < kBlocks; ++b) {
      // Rows 0, 4, 8, 12, and so on, since pairs are taken within quarters of a vector.
      const auto quarters = [&](std::size_t first) HWY_ATTR {
        const auto row = [&](std::size_t i)
                             HWY_ATTR { return _mm_loadu_ps(places + rows[16 * b + first + i]); };
        const __m256 low = _mm256_insertf128_ps(_mm256_castps128_ps256(row(0)), row(4), 1);
        const __m256 high = _mm256_insertf128_ps(_mm256_castps128_ps256(row(8)), row(12), 1);
        return _mm512_insertf32x8(_mm512_castps256_ps512(low), high, 1);
      };
      const __m512 r0 = quarters(0), r1 = quarters(1), r2 = quarters(2), r3 = quarters(3);
      const __m512d xy01 = _mm512_castps_pd(_mm512_unpacklo_ps(r0, r1));
      const __m512d xy23 = _mm512_castps_pd(_mm512_unpacklo_ps(r2, r3));
      const __m512d z01 = _mm512_castps_pd(_mm512_unpackhi_ps(r0, r1));
      const __m512d z23 = _mm512_castps_pd(_mm512_unpackhi_ps(r2, r3));
      x_[b] = _mm512_castpd_ps(_mm512_unpacklo_pd(xy01, xy23));
      y_[b] = _mm512_castpd_ps(_mm512_unpackhi_pd(xy01, xy23));
      z_[b] = _mm512_castpd_ps(_mm512_unpacklo_pd(z01, z23));
    }
  }

  /// `corners`: of a vector of vertices, four bytes each, corner 0 lowest.
  template <int kCorner>
  HWY_INLINE V3 corner(const std::uint32_t* corners) const {
    // Permutations take as many bits as they need: there is nothing to mask.
    const __m512i at = _mm512_srli_epi32(_mm512_loadu_si512(corners), 8 * kCorner);
    return {V{of(x_, at)}, V{of(y_, at)}, V{of(z_, at)}};
  }

 private:
  static HWY_INLINE __m512 of(const __m512* nodes, __m512i at) {
    if constexpr (kBlocks == 1) {
      return _mm512_permutexvar_ps(at, nodes[0]);
    } else if constexpr (kBlocks == 2) {
      return _mm512_permutex2var_ps(nodes[0], at, nodes[1]);
    } else {
      // Lanes that are not among the first 32 keep their number for the second permutation.
      const __mmask16 beyond = _mm512_test_epi32_mask(at, _mm512_set1_epi32(32));
      const __m512 low = _mm512_mask2_permutex2var_ps(nodes[0], at, _knot_mask16(beyond), nodes[1]);
      return _mm512_mask2_permutex2var_ps(nodes[2], _mm512_castps_si512(low), beyond, nodes[kBlocks - 1]);
    }
  }

  __m512 x_[kBlocks], y_[kBlocks], z_[kBlocks];
};

#elif HWY_TARGET != HWY_SCALAR && !HWY_HAVE_SCALABLE

template <std::size_t kBlocks>
class CellNodes {
 public:
  HWY_INLINE CellNodes(const float* places, const std::uint32_t* rows) : nodes_(places, rows, 16 * kBlocks) {}

  template <int kCorner>
  HWY_INLINE V3 corner(const std::uint32_t* corners) const {
    const auto [x, y, z] = nodes_.columns([&](std::size_t i) { return corners[i] >> (8 * kCorner) & 255; });
    return {x, y, z};
  }

 private:
  PaletteRows<float, 16 * kBlocks> nodes_;
};

#else

template <std::size_t kBlocks>
class CellNodes {
 public:
  HWY_INLINE CellNodes(const float* places, const std::uint32_t* rows) {
    fetch(places, rows, 16 * kBlocks, nodes_);
  }

  template <int kCorner>
  HWY_INLINE V3 corner(const std::uint32_t* corners) const {
    const hn::Rebind<std::uint32_t, F> d;
    const hn::Vec<I> at =
        hn::And(hn::BitCast(I(), hn::ShiftRight<8 * kCorner>(hn::LoadU(d, corners))), hn::Set(I(), 255));
    return {hn::GatherIndex(F(), nodes_.x, at), hn::GatherIndex(F(), nodes_.y, at),
            hn::GatherIndex(F(), nodes_.z, at)};
  }

 private:
  Table<float> nodes_;
};

#endif

}  // namespace ecorche::runtime::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
