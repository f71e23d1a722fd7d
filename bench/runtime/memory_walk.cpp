// SPDX-License-Identifier: Apache-2.0
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "bench/runtime/memory_walk.cpp"
#include <hwy/foreach_target.h>
// After foreach_target.h, as Highway asks.
#include "bench/runtime/memory_walk.hpp"
#include "runtime/skin/cell_nodes-inl.hpp"
#include "runtime/skin/sink-inl.hpp"

#ifndef ECORCHE_BENCH_MEMORY_WALK
#define ECORCHE_BENCH_MEMORY_WALK
namespace ecorche::bench {

/// The cells of one tissue whose last node lies in one slab, and where their vertices go.
struct WalkedCells {
  const runtime::VertexGroups& groups;
  std::size_t begin, end;
  const float* posed;
  runtime::VertexSink out;
};

/// A bone's vertices at rest, and where they go.
struct WalkedBone {
  const float* rest;
  const float* normals;  // null where none are wanted
  std::size_t begin, end;
  runtime::VertexSink out;
};

}  // namespace ecorche::bench
#endif

HWY_BEFORE_NAMESPACE();
namespace ecorche::runtime::HWY_NAMESPACE {

using bench::WalkedBone;
using bench::WalkedCells;
using Bytes = hn::CappedTag<std::uint8_t, 64>;

// All that was read, so that compilers leave none of it out.
struct Seen {
  hn::Vec<Bytes> bits;

  HWY_INLINE Seen() : bits(hn::Zero(Bytes())) {}
  template <class T>
  HWY_INLINE void read(const T* from, std::size_t count) {
    const auto* bytes = reinterpret_cast<const std::uint8_t*>(from);
    for (std::size_t i = 0; i + hn::Lanes(Bytes()) <= count * sizeof(T); i += hn::Lanes(Bytes()))
      bits = hn::Xor(bits, hn::LoadU(Bytes(), bytes + i));
  }
  template <class T>
  HWY_INLINE void write(T* to, std::size_t count) const {
    auto* bytes = reinterpret_cast<std::uint8_t*>(to);
    const std::size_t size = count * sizeof(T), lanes = hn::Lanes(Bytes());
    std::size_t i = 0;
    for (; i + lanes <= size; i += lanes) hn::StoreU(bits, Bytes(), bytes + i);
    for (; i < size; ++i) bytes[i] = static_cast<std::uint8_t>(i);
  }
  HWY_INLINE void write_rows(const VertexSink& out, std::size_t first, std::size_t count) const {
    if (out.positions != nullptr) write(out.positions + 3 * first, 3 * count);
    if (out.quantised != nullptr) write(out.quantised + 3 * first, 3 * count);
    if (out.normals != nullptr) write(out.normals + 3 * first, 3 * count);
  }
};

void walk_clusters(const NodeClusters& layout, std::size_t begin, std::size_t end, float* posed) {
  constexpr std::size_t size = NodeClusters::size;
  for (std::size_t c = begin; c < end; ++c) {
    if (c + kClustersAhead < end) ask_for_cluster<true>(layout, c + kClustersAhead);
    Seen seen;
    seen.read(&layout.rest[3 * size * c], 3 * size);
    seen.read(&layout.centre[3 * size * c], 3 * size);
    seen.read(&layout.weight[size * layout.begin[c]], size * (layout.begin[c + 1] - layout.begin[c]));
    seen.write(posed + 3 * size * c, 3 * size);
  }
}

void walk_cells(const WalkedCells& job) {
  constexpr std::size_t size = VertexGroups::size, ahead = kCellsAhead;
  const VertexGroups& groups = job.groups;
  const Sink sink(job.out);
  const hn::CappedTag<float, 4> row;
  const bool normals = job.out.normals != nullptr;
  for (std::size_t c = job.begin; c < job.end; ++c) {
    const VertexGroups::Cell& cell = groups.cells[c];
    if (c + ahead < job.end) {
      ask_for_cell(groups, c + ahead, normals);
      for (std::size_t g = groups.first_group(c + ahead); groups.in_order && g < groups.cells[c + ahead].end;
           ++g)
        sink.ask_for(groups.groups[g].first, size);
    }
    auto nodes = hn::Zero(row);
    for (std::size_t i = 0; i < cell.count; ++i)
      nodes = hn::Xor(nodes, hn::LoadU(row, job.posed + groups.rows[cell.palette + i]));
    HWY_ALIGN float xyz[16] = {};
    hn::Store(nodes, row, xyz);
    for (std::size_t g = groups.first_group(c); g < cell.end; ++g) {
      const VertexGroups::Group& group = groups.groups[g];
      Seen seen;
      seen.read(xyz, 16);
      seen.read(&groups.corners[size * g], size);
      if (group.step != 0) {
        seen.read(&groups.narrow[group.data], 3 * size);
      } else {
        seen.read(&groups.wide[group.data], 3 * size);
      }
      if (normals) seen.read(&groups.normal[2 * size * g], 2 * size);
      const std::size_t count = groups.group_vertices(group);
      if (groups.in_order) {
        seen.write_rows(job.out, group.first, count);
      } else {
        for (std::size_t i = 0; i < count; ++i) seen.write_rows(job.out, groups.vertex[group.first + i], 1);
      }
    }
  }
}

void walk_bone(const WalkedBone& job) {
  constexpr std::size_t some = 64;
  for (std::size_t v = job.begin; v < job.end; v += some) {
    const std::size_t count = std::min(job.end - v, some);
    Seen seen;
    seen.read(job.rest + 3 * v, 3 * count);
    if (job.normals != nullptr) seen.read(job.normals + 3 * v, 3 * count);
    seen.write_rows(job.out, v, count);
  }
}

}  // namespace ecorche::runtime::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE

#include <tbb/parallel_for.h>
#include <tbb/task_arena.h>

namespace ecorche::runtime {
HWY_EXPORT(walk_clusters);
HWY_EXPORT(walk_cells);
HWY_EXPORT(walk_bone);
}  // namespace ecorche::runtime

namespace ecorche::bench {
namespace {

using runtime::NodeClusters;
using runtime::VertexGroups;

constexpr std::size_t kSpansPerThread = 8;

template <class T>
T* data_of(std::vector<T>& rows) {
  return rows.empty() ? nullptr : rows.data();
}

runtime::VertexSink sink_of(runtime::PosedBody& frame, std::size_t tissue) {
  return {data_of(frame.tissues[tissue]), data_of(frame.quantised[tissue]), data_of(frame.normals[tissue]),
          frame.box};
}

// Those whose last node lies in `slab`: cells are sorted by it.
WalkedCells cells_of(const VertexGroups& groups, std::size_t slab, runtime::PosedBody& frame,
                     std::size_t tissue) {
  const auto bound = [&](std::size_t wanted) {
    const auto found = std::partition_point(groups.cells.begin(), groups.cells.end(), [&](const auto& cell) {
      return groups.last_slab(cell) < wanted;
    });
    return static_cast<std::size_t>(found - groups.cells.begin());
  };
  return {groups, bound(slab), bound(slab + 1), frame.scratch.lanes.data(), sink_of(frame, tissue)};
}

void walk_slab(const Model& model, const runtime::BodyParts& parts, std::size_t slab,
               runtime::PosedBody& frame) {
  constexpr std::size_t each = NodeClusters::slab / NodeClusters::size;
  const NodeClusters& clusters = parts.clusters();
  const std::size_t needed = (clusters.needed + NodeClusters::size - 1) / NodeClusters::size;
  HWY_DYNAMIC_DISPATCH(runtime::walk_clusters)
  (clusters, std::min(needed, each * slab), std::min(needed, each * (slab + 1)), frame.scratch.lanes.data());
  for (std::size_t t = 0; t < model.tissues.size(); ++t) {
    if (model.tissues[t].segment == Tissue::by_tets)
      HWY_DYNAMIC_DISPATCH(runtime::walk_cells)(cells_of(parts.groups(t), slab, frame, t));
  }
}

}  // namespace

void walk_memory(const Model& model, const runtime::BodyParts& parts, runtime::PosedBody& frame) {
  const std::size_t slabs = parts.clusters().slabs(),
                    threads = static_cast<std::size_t>(tbb::this_task_arena::max_concurrency());
  const tbb::blocked_range<std::size_t> all(0, slabs,
                                            std::max<std::size_t>(1, slabs / (kSpansPerThread * threads)));
  tbb::parallel_for(
      all,
      [&](const auto& range) {
        for (std::size_t slab = range.begin(); slab < range.end(); ++slab)
          walk_slab(model, parts, slab, frame);
      },
      tbb::simple_partitioner());
  tbb::parallel_for(std::size_t{0}, model.tissues.size(), [&](std::size_t t) {
    const Tissue& tissue = model.tissues[t];
    if (tissue.segment == Tissue::by_tets) return;
    const float* normals =
        frame.normals[t].empty() ? nullptr : tissue.V.data();  // as many bytes as they have
    HWY_DYNAMIC_DISPATCH(runtime::walk_bone)
    ({tissue.V.data(), normals, 0, static_cast<std::size_t>(tissue.V.rows()), sink_of(frame, t)});
  });
}

}  // namespace ecorche::bench
#endif
