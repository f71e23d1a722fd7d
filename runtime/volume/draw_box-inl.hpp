// SPDX-License-Identifier: Apache-2.0
// A tet of many voxels: a vector of voxel rows of its box is cut by its four planes. Included once per
// instruction set.
#if defined(ECORCHE_RUNTIME_VOLUME_DRAW_BOX_INL) == defined(HWY_TARGET_TOGGLE)
#ifdef ECORCHE_RUNTIME_VOLUME_DRAW_BOX_INL
#undef ECORCHE_RUNTIME_VOLUME_DRAW_BOX_INL
#else
#define ECORCHE_RUNTIME_VOLUME_DRAW_BOX_INL
#endif

#include "runtime/volume/tet_setup-inl.hpp"

HWY_BEFORE_NAMESPACE();
namespace ecorche::runtime::HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

// Planar, a lane a tet. Plane p holds the voxels on its side of x = at + by_y y + by_z z, counted from the
// box's first voxel: those beyond where `side` is positive, else those before.
struct Planes {
  HWY_ALIGN float at[4][kMostLanes], by_y[4][kMostLanes], by_z[4][kMostLanes], side[4][kMostLanes];
};

HWY_INLINE void set_plane(Planes& out, int p, const V3& n, const V3& origin, V beyond, V margin) {
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

HWY_INLINE void set_planes(const PosedTets& tets, Planes& out) {
  const V3(&n)[3] = tets.n;
  const V3 n0 = {hn::Neg(hn::Add(n[0].x, hn::Add(n[1].x, n[2].x))),
                 hn::Neg(hn::Add(n[0].y, hn::Add(n[1].y, n[2].y))),
                 hn::Neg(hn::Add(n[0].z, hn::Add(n[1].z, n[2].z)))};
  const V margin = hn::Mul(hn::Set(F(), kMargin), tets.reach);
  set_plane(out, 0, n0, tets.origin, tets.size, margin);
  for (int p = 1; p < 4; ++p) set_plane(out, p, n[p - 1], tets.origin, hn::Zero(F()), margin);
}

// A vector of rows of a tet's box, cut.
struct Rows {
  HWY_ALIGN std::int32_t low[kMostLanes], high[kMostLanes];  // x from the box's first voxel
  HWY_ALIGN std::int32_t offset[kMostLanes];                 // of x = 0 in the posed grid
  HWY_ALIGN float part[3][kMostLanes];                       // of the place of x = 0
  HWY_ALIGN std::int32_t brick[kMostLanes];                  // brick (0, y, z), where only some are drawn
};

// Rows [row, row + lanes) of the box, y fastest.
HWY_INLINE void cut_rows(const DrawTets& job, const Setup& tet, const Planes& planes, std::size_t t, V y, V z,
                         std::int32_t rows, std::int32_t row, Rows& out) {
  const V far = hn::Set(F(), 1e30F);
  V from = hn::Zero(F()), to = hn::Set(F(), static_cast<float>(tet.count[0][t] - 1));
  for (int p = 0; p < 4; ++p) {
    const V x = hn::MulAdd(hn::Set(F(), planes.by_y[p][t]), y,
                           hn::MulAdd(hn::Set(F(), planes.by_z[p][t]), z, hn::Set(F(), planes.at[p][t])));
    const auto beyond = hn::Gt(hn::Set(F(), planes.side[p][t]), hn::Zero(F()));
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

HWY_INLINE void draw_box(const DrawTets& job, const Setup& tet, const Planes& planes, std::size_t t,
                         VoxelBatch& batch, const BatchSink& sink) {
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
      cut_rows(job, tet, planes, t, y, z, ny * nz, row, rows);
      put();
    }
    return;
  }
  for (std::int32_t k = 0; k < nz; ++k) {
    for (std::int32_t row = 0; row < ny; row += lanes) {
      const V y = hn::ConvertTo(F(), hn::Iota(I(), row));
      cut_rows(job, tet, planes, t, y, hn::Set(F(), static_cast<float>(k)), ny, row, rows);
      put();
    }
  }
}

}  // namespace ecorche::runtime::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();
#endif
