// SPDX-License-Identifier: Apache-2.0
// A vector of tets is set up at a time, then a vector of voxel rows of one tet is cut by its four planes.
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "runtime/volume/draw_tets.cpp"
#include <hwy/foreach_target.h>
// After foreach_target.h, as Highway asks.
#include <hwy/highway.h>

#include <algorithm>
#include <cstring>

#include "runtime/skin/vectors-inl.hpp"
#include "runtime/volume/corners-inl.hpp"
#include "runtime/volume/draw_tets.hpp"

HWY_BEFORE_NAMESPACE();
namespace ecorche::runtime::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

// Rounding moves a plane's value, edge x edge x distance, by about 4e-7 of the longest edge cubed.
constexpr float kMargin = 2e-6F;

HWY_INLINE V dot(const V3& a, const V3& b) {
  return hn::MulAdd(a.x, b.x, hn::MulAdd(a.y, b.y, hn::Mul(a.z, b.z)));
}

HWY_INLINE V3 edge(const Corners& c, int to, V one) {
  const auto along = [&](int a) HWY_ATTR {
    return hn::Mul(hn::ConvertTo(F(), hn::Sub(c.x[to][a], c.x[0][a])), one);
  };
  return {along(0), along(1), along(2)};
}

struct Edges {
  V3 e1, e2, e3, n1, n2, n3;
  V det, cube;  // the longest edge cubed
};

HWY_INLINE Edges edges_of(const Corners& c, V one) {
  Edges out;
  out.e1 = edge(c, 1, one);
  out.e2 = edge(c, 2, one);
  out.e3 = edge(c, 3, one);
  out.n1 = cross(out.e2, out.e3);
  out.n2 = cross(out.e3, out.e1);
  out.n3 = cross(out.e1, out.e2);
  out.det = dot(out.e1, out.n1);
  const V3 a = minus(out.e2, out.e1), b = minus(out.e3, out.e2), d = minus(out.e1, out.e3);
  const V squared = hn::Max(hn::Max(hn::Max(dot(out.e1, out.e1), dot(out.e2, out.e2)), dot(out.e3, out.e3)),
                            hn::Max(hn::Max(dot(a, a), dot(b, b)), dot(d, d)));
  out.cube = hn::Mul(squared, hn::Sqrt(squared));
  return out;
}

std::size_t classify_tets(const DrawTets& job, const VoxelRange& range, int axis, std::int32_t band,
                          std::size_t begin, std::size_t end, std::span<TetExtent> extents,
                          std::span<std::uint32_t> inverted) {
  const std::size_t lanes = hn::Lanes(F());
  const V one = hn::Set(F(), 1.0F / static_cast<float>(1 << job.bits));
  const auto along = static_cast<std::size_t>(axis);
  std::size_t found = 0;
  const auto classify = [&](const Corners& corners, std::size_t t) HWY_ATTR {
    const std::size_t count = std::min(lanes, end - t);
    HWY_ALIGN std::int32_t first[3][kMostLanes], last[3][kMostLanes];
    HWY_ALIGN float det[kMostLanes], cube[kMostLanes];
    for (std::size_t a = 0; a < 3; ++a) {
      const Span span = span_of(corners, static_cast<int>(a), job.bits, range.first[a], range.last[a]);
      hn::Store(span.first, I(), first[a]);
      hn::Store(span.last, I(), last[a]);
    }
    const Edges edges = edges_of(corners, one);
    hn::Store(edges.det, F(), det);
    hn::Store(edges.cube, F(), cube);
    for (std::size_t i = 0; i < count; ++i) {
      TetExtent& out = extents[t - begin + i];
      out = {};
      if (first[0][i] > last[0][i] || first[1][i] > last[1][i] || first[2][i] > last[2][i]) continue;
      if (job.only &&
          !job.only.meets({first[0][i], first[1][i], first[2][i]}, {last[0][i], last[1][i], last[2][i]}))
        continue;
      const auto id = static_cast<std::uint32_t>(t + i);
      double sign = static_cast<double>(job.left_handed ? -det[i] : det[i]);
      if (!(std::abs(det[i]) >= kFlatTet * cube[i])) sign = posed_det(job, id);
      if (sign > 0) {
        out = {static_cast<std::uint16_t>((first[along][i] - range.first[along]) / band),
               static_cast<std::uint16_t>((last[along][i] - range.first[along]) / band)};
      } else {
        inverted[found++] = id;
      }
    }
  };
  for (std::size_t t = begin; t < end; t += TetPalettes::width) {
    const std::size_t run = t / TetPalettes::width, next = run + 2;
    if (next < job.palettes.runs())
      ask_for(job.posed.data(), job.palettes.rows(next), job.palettes.filled(next), 2);
    const Run posed(job.palettes, run, job.posed.data());
    for (std::size_t i = 0; i < std::min(TetPalettes::width, end - t); i += lanes)
      classify(posed.corners(i), t + i);
  }
  return found;
}

// What is left of a tet once a vector of them was set up; planar, a lane a tet.
struct Setup {
  HWY_ALIGN std::int32_t first[3][kMostLanes], count[3][kMostLanes];  // voxels of the box
  HWY_ALIGN float flat[kMostLanes];                                   // below zero: too flat for float32
  // Plane p holds the voxels on its side of x = at + by_y y + by_z z, counted from the box's first voxel:
  // those beyond where `side` is positive, else those before.
  HWY_ALIGN float at[4][kMostLanes], by_y[4][kMostLanes], by_z[4][kMostLanes], side[4][kMostLanes];
  // place = base + part + to * (x, y, z)
  HWY_ALIGN std::int32_t base[3][kMostLanes];
  HWY_ALIGN float part[3][kMostLanes], to[3][3][kMostLanes];
};

HWY_INLINE void set_plane(Setup& out, int p, const V3& n, const V3& origin, V beyond, V margin) {
  // A plane along x is steep, not infinite: 1e20 voxels away decides by the sign.
  const V least = hn::Set(F(), 1e-20F);
  const V slope = hn::IfThenElse(hn::Lt(hn::Abs(n.x), least), least, n.x);
  const V inverse = hn::Div(hn::Set(F(), 1.0F), slope);
  const V through = hn::Sub(hn::MulAdd(n.y, origin.y, hn::Mul(n.z, origin.z)), hn::Add(beyond, margin));
  hn::Store(hn::MulAdd(through, inverse, origin.x), F(), out.at[p]);
  hn::Store(hn::Neg(hn::Mul(n.y, inverse)), F(), out.by_y[p]);
  hn::Store(hn::Neg(hn::Mul(n.z, inverse)), F(), out.by_z[p]);
  hn::Store(slope, F(), out.side[p]);
}

HWY_INLINE void set_up(const DrawTets& job, const VoxelRange& range, const Corners& posed,
                       const Corners& rest, Setup& out) {
  const V one = hn::Set(F(), 1.0F / static_cast<float>(1 << job.bits));
  VI first[3];
  V3 origin;  // corner 0, from the first voxel
  V* const origin_of[3] = {&origin.x, &origin.y, &origin.z};
  for (std::size_t a = 0; a < 3; ++a) {
    const Span span = span_of(posed, static_cast<int>(a), job.bits, range.first[a], range.last[a]);
    first[a] = span.first;
    hn::Store(span.first, I(), out.first[a]);
    hn::Store(hn::Add(hn::Sub(span.last, span.first), hn::Set(I(), 1)), I(), out.count[a]);
    const VI from = hn::Sub(posed.x[0][a], hn::ShiftLeftSame(span.first, job.bits));
    *origin_of[a] = hn::Mul(hn::ConvertTo(F(), from), one);
  }
  const Edges edges = edges_of(posed, one);
  const V size = hn::Abs(edges.det);
  hn::Store(hn::Sub(size, hn::Mul(hn::Set(F(), kFlatTet), edges.cube)), F(), out.flat);
  // Inward, whichever way round the tet lies: barycentric coordinate c is n_c . (x - corner 0) / |det|.
  const V sign = hn::CopySign(hn::Set(F(), 1.0F), edges.det);
  const V3 n[3] = {times(edges.n1, sign), times(edges.n2, sign), times(edges.n3, sign)};
  const V3 n0 = {hn::Neg(hn::Add(n[0].x, hn::Add(n[1].x, n[2].x))),
                 hn::Neg(hn::Add(n[0].y, hn::Add(n[1].y, n[2].y))),
                 hn::Neg(hn::Add(n[0].z, hn::Add(n[1].z, n[2].z)))};
  const V margin = hn::Mul(hn::Set(F(), kMargin), edges.cube);
  set_plane(out, 0, n0, origin, size, margin);
  for (int p = 1; p < 4; ++p) set_plane(out, p, n[p - 1], origin, hn::Zero(F()), margin);

  const V inverse = hn::Div(hn::Set(F(), 1.0F), size);
  const VI mask = hn::Set(I(), (1 << job.bits) - 1);
  for (int a = 0; a < 3; ++a) {
    // The shift of corner 0 in whole voxels and a part, both exact.
    const VI shift = job.same_lattice ? hn::Sub(rest.x[0][a], posed.x[0][a]) : rest.x[0][a];
    const VI voxels = hn::ShiftRightSame(shift, job.bits);
    hn::Store(job.same_lattice ? hn::Add(voxels, first[a]) : voxels, I(), out.base[a]);
    V3 row{hn::Zero(F()), hn::Zero(F()), hn::Zero(F())};
    for (int c = 1; c < 4; ++c) {
      VI moved = hn::Sub(rest.x[c][a], rest.x[0][a]);
      if (job.same_lattice) moved = hn::Sub(moved, hn::Sub(posed.x[c][a], posed.x[0][a]));
      const V step = hn::Mul(hn::Mul(hn::ConvertTo(F(), moved), one), inverse);
      row.x = hn::MulAdd(step, n[c - 1].x, row.x);
      row.y = hn::MulAdd(step, n[c - 1].y, row.y);
      row.z = hn::MulAdd(step, n[c - 1].z, row.z);
    }
    const V part = hn::Mul(hn::ConvertTo(F(), hn::And(shift, mask)), one);
    hn::Store(hn::Sub(part, dot(row, origin)), F(), out.part[a]);
    // On one lattice the shift moves along with the voxel.
    const V own = hn::Set(F(), job.same_lattice ? 1.0F : 0.0F);
    hn::Store(a == 0 ? hn::Add(row.x, own) : row.x, F(), out.to[a][0]);
    hn::Store(a == 1 ? hn::Add(row.y, own) : row.y, F(), out.to[a][1]);
    hn::Store(a == 2 ? hn::Add(row.z, own) : row.z, F(), out.to[a][2]);
  }
}

// A vector of rows of a tet's box, cut.
struct Rows {
  HWY_ALIGN std::int32_t low[kMostLanes], high[kMostLanes];  // x from the box's first voxel
  HWY_ALIGN std::int32_t offset[kMostLanes];                 // of x = 0 in the posed grid
  HWY_ALIGN float part[3][kMostLanes];                       // of the place of x = 0
  HWY_ALIGN std::int32_t brick[kMostLanes];                  // brick (0, y, z), where only some are drawn
};

// Rows [row, row + lanes) of the box, y fastest.
HWY_INLINE void cut_rows(const DrawTets& job, const Setup& tet, std::size_t t, V y, V z, std::int32_t rows,
                         std::int32_t row, Rows& out) {
  const V far = hn::Set(F(), 1e30F);
  V from = hn::Zero(F()), to = hn::Set(F(), static_cast<float>(tet.count[0][t] - 1));
  for (int p = 0; p < 4; ++p) {
    const V x = hn::MulAdd(hn::Set(F(), tet.by_y[p][t]), y,
                           hn::MulAdd(hn::Set(F(), tet.by_z[p][t]), z, hn::Set(F(), tet.at[p][t])));
    const auto beyond = hn::Gt(hn::Set(F(), tet.side[p][t]), hn::Zero(F()));
    from = hn::Max(from, hn::IfThenElse(beyond, x, hn::Neg(far)));
    to = hn::Min(to, hn::IfThenElse(beyond, far, x));
  }
  // Beyond the box nothing is held, and nothing must overflow.
  from = hn::Min(from, hn::Set(F(), 1e6F));
  to = hn::Max(to, hn::Set(F(), -1.0F));
  const VI lane = hn::Iota(I(), row);
  const VI low = hn::ConvertTo(I(), hn::Ceil(from)), high = hn::ConvertTo(I(), hn::Floor(to));
  const auto there = hn::Lt(lane, hn::Set(I(), rows));
  hn::Store(low, I(), out.low);
  hn::Store(hn::IfThenElse(there, high, hn::Set(I(), -1)), I(), out.high);
  const VI j = hn::Add(hn::ConvertTo(I(), y), hn::Set(I(), tet.first[1][t]));
  const VI k = hn::Add(hn::ConvertTo(I(), z), hn::Set(I(), tet.first[2][t]));
  const VI line = hn::Add(j, hn::Mul(k, hn::Set(I(), job.size[1])));
  static_assert(Bricks::edge == 32);
  const std::array<std::int32_t, 3>& bricks = job.only.bricks.count;
  const VI row_of_bricks =
      hn::Add(hn::ShiftRight<5>(j), hn::Mul(hn::ShiftRight<5>(k), hn::Set(I(), bricks[1])));
  hn::Store(hn::Mul(row_of_bricks, hn::Set(I(), bricks[0])), I(), out.brick);
  hn::Store(hn::Add(hn::Mul(line, hn::Set(I(), job.size[0])), hn::Set(I(), tet.first[0][t])), I(),
            out.offset);
  for (int a = 0; a < 3; ++a) {
    hn::Store(hn::MulAdd(hn::Set(F(), tet.to[a][1][t]), y,
                         hn::MulAdd(hn::Set(F(), tet.to[a][2][t]), z, hn::Set(F(), tet.part[a][t]))),
              F(), out.part[a]);
  }
}

// Voxels of some bricks, one by one.
HWY_INLINE void put_rows(const DrawTets& job, const Rows& rows, const Setup& tet, std::size_t t,
                         VoxelBatch& batch, const BatchSink& sink) {
  const std::array<std::int32_t, 3> base{tet.base[0][t], tet.base[1][t], tet.base[2][t]};
  const std::array<float, 3> step{tet.to[0][0][t], tet.to[1][0][t], tet.to[2][0][t]};
  for (std::size_t r = 0; r < hn::Lanes(F()); ++r) {
    for (std::int32_t x = rows.low[r]; x <= rows.high[r]; ++x) {
      if (job.only.moved[rows.brick[r] + (tet.first[0][t] + x) / Bricks::edge] == 0) continue;
      if (batch.count == VoxelBatch::capacity) {
        sink.sample(sink.to, batch);
        batch.count = 0;
      }
      const std::size_t at = batch.count++;
      batch.offset[at] = static_cast<std::uint32_t>(rows.offset[r]) + static_cast<std::uint32_t>(x);
      for (std::size_t a = 0; a < 3; ++a) {
        batch.base[a][at] = base[a];
        batch.part[a][at] = rows.part[a][r] + step[a] * static_cast<float>(x);
      }
    }
  }
}

// The same where all bricks are drawn: one voxel of every row at a time, those that are held pushed together.
HWY_INLINE void put_all_rows(const Rows& rows, const Setup& tet, std::size_t t, VoxelBatch& batch,
                             const BatchSink& sink) {
  const hn::RebindToUnsigned<F> u;
  VI x = hn::Load(I(), rows.low);
  const VI last = hn::Load(I(), rows.high), first = hn::Load(I(), rows.offset);
  for (;; x = hn::Add(x, hn::Set(I(), 1))) {
    const auto held = hn::Not(hn::Gt(x, last));
    const std::size_t count = hn::CountTrue(I(), held);
    if (count == 0) return;
    if (batch.count + count > VoxelBatch::capacity) {
      sink.sample(sink.to, batch);
      batch.count = 0;
    }
    hn::StoreU(hn::Compress(hn::BitCast(u, hn::Add(first, x)), hn::RebindMask(u, held)), u,
               batch.offset.data() + batch.count);
    const V along = hn::ConvertTo(F(), x);
    for (std::size_t a = 0; a < 3; ++a) {
      const V part = hn::MulAdd(hn::Set(F(), tet.to[a][0][t]), along, hn::Load(F(), rows.part[a]));
      hn::StoreU(hn::Compress(part, hn::RebindMask(F(), held)), F(), batch.part[a].data() + batch.count);
      hn::StoreU(hn::Set(I(), tet.base[a][t]), I(), batch.base[a].data() + batch.count);
    }
    batch.count += count;
  }
}

void draw_box(const DrawTets& job, const Setup& tet, std::size_t t, VoxelBatch& batch,
              const BatchSink& sink) {
  const auto lanes = static_cast<std::int32_t>(hn::Lanes(F()));
  const std::int32_t ny = tet.count[1][t], nz = tet.count[2][t];
  Rows rows;
  const auto put = [&]() HWY_ATTR {
    if (job.only) {
      put_rows(job, rows, tet, t, batch, sink);
    } else {
      put_all_rows(rows, tet, t, batch, sink);
    }
  };
  if (ny < lanes) {
    const V inverse = hn::Set(F(), 1.0F / static_cast<float>(ny));
    for (std::int32_t row = 0; row < ny * nz; row += lanes) {
      const V lane = hn::ConvertTo(F(), hn::Iota(I(), row));
      const V z = hn::Floor(hn::Mul(hn::Add(lane, hn::Set(F(), 0.5F)), inverse));
      const V y = hn::Sub(lane, hn::Mul(z, hn::Set(F(), static_cast<float>(ny))));
      cut_rows(job, tet, t, y, z, ny * nz, row, rows);
      put();
    }
    return;
  }
  for (std::int32_t k = 0; k < nz; ++k) {
    for (std::int32_t row = 0; row < ny; row += lanes) {
      const V y = hn::ConvertTo(F(), hn::Iota(I(), row));
      cut_rows(job, tet, t, y, hn::Set(F(), static_cast<float>(k)), ny, row, rows);
      put();
    }
  }
}

HWY_INLINE void draw_one(const DrawTets& job, const VoxelRange& range, const Setup& setup, std::size_t t,
                         std::size_t id, VoxelBatch& batch, const BatchSink& sink) {
  if (setup.count[0][t] <= 0 || setup.count[1][t] <= 0 || setup.count[2][t] <= 0) return;
  if (setup.flat[t] >= 0) {
    draw_box(job, setup, t, batch, sink);
  } else {
    draw_flat_tet(job, range, static_cast<std::uint32_t>(id), batch, sink);
  }
}

void draw_tets(const DrawTets& job, const VoxelRange& range, std::span<const std::uint32_t> ids,
               VoxelBatch& batch, const BatchSink& sink) {
  const std::size_t lanes = hn::Lanes(F());
  Setup setup;
  for (std::size_t i = 0; i < ids.size(); i += lanes) {
    const std::size_t count = std::min(lanes, ids.size() - i);
    HWY_ALIGN std::int32_t id[kMostLanes];
    for (std::size_t l = 0; l < lanes; ++l)
      id[l] = static_cast<std::int32_t>(ids[i + std::min(l, count - 1)]);
    VI node[4];
    load_nodes(job.tets, hn::Load(I(), id), node);
    set_up(job, range, load_corners(job.posed.data(), node), load_corners(job.rest.data(), node), setup);
    for (std::size_t t = 0; t < count; ++t) draw_one(job, range, setup, t, ids[i + t], batch, sink);
  }
}

HWY_INLINE bool any_of(const std::uint8_t* wanted) {
  std::uint64_t eight[2];
  static_assert(sizeof eight == TetPalettes::width);
  std::memcpy(eight, wanted, sizeof eight);
  return (eight[0] | eight[1]) != 0;
}

void draw_runs(const DrawTets& job, const VoxelRange& range, std::size_t first,
               std::span<const std::uint8_t> wanted, VoxelBatch& batch, const BatchSink& sink) {
  constexpr std::size_t width = TetPalettes::width;
  const std::size_t lanes = hn::Lanes(F()), runs = wanted.size() / width;
  const TetPalettes& palettes = job.palettes;
  // What the next call will probably want, and what this one will.
  if (first >= runs) {
    for (const std::uint8_t* line = palettes.corners(first - runs); line < palettes.corners(first);
         line += 64)
      hwy::Prefetch(line);
  }
  for (std::size_t r = runs; r-- > 0;) {
    if (!any_of(&wanted[width * r])) continue;
    ask_for(job.posed.data(), palettes.rows(first + r), palettes.filled(first + r), 2);
    ask_for(job.rest.data(), palettes.rows(first + r), palettes.filled(first + r), 2);
  }
  Setup setup;
  for (std::size_t r = runs; r-- > 0;) {
    if (!any_of(&wanted[width * r])) continue;
    const Run posed(palettes, first + r, job.posed.data()), rest(palettes, first + r, job.rest.data());
    for (std::size_t i = width; i > 0;) {
      i -= lanes;
      set_up(job, range, posed.corners(i), rest.corners(i), setup);
      for (std::size_t t = lanes; t-- > 0;) {
        if (wanted[width * r + i + t] != 0)
          draw_one(job, range, setup, t, width * (first + r) + i + t, batch, sink);
      }
    }
  }
}

}  // namespace ecorche::runtime::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace ecorche::runtime::kernels {

HWY_EXPORT(classify_tets);
HWY_EXPORT(draw_tets);
HWY_EXPORT(draw_runs);

std::size_t classify_tets(const DrawTets& job, const VoxelRange& range, int axis, std::int32_t band,
                          std::size_t begin, std::size_t end, std::span<TetExtent> extents,
                          std::span<std::uint32_t> inverted) {
  return HWY_DYNAMIC_DISPATCH(classify_tets)(job, range, axis, band, begin, end, extents, inverted);
}

void draw_tets(const DrawTets& job, const VoxelRange& range, std::span<const std::uint32_t> ids,
               VoxelBatch& batch, const BatchSink& sink) {
  HWY_DYNAMIC_DISPATCH(draw_tets)(job, range, ids, batch, sink);
}

void draw_runs(const DrawTets& job, const VoxelRange& range, std::size_t first,
               std::span<const std::uint8_t> wanted, VoxelBatch& batch, const BatchSink& sink) {
  HWY_DYNAMIC_DISPATCH(draw_runs)(job, range, first, wanted, batch, sink);
}

}  // namespace ecorche::runtime::kernels
#endif
