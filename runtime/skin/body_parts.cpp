// SPDX-License-Identifier: Apache-2.0
#include "runtime/skin/body_parts.hpp"

#include <tbb/enumerable_thread_specific.h>
#include <tbb/parallel_for.h>
#include <tbb/task_arena.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <bit>
#include <cmath>
#include <functional>
#include <utility>

#include "runtime/skin/skin_clusters.hpp"

namespace ecorche::runtime {
namespace {

constexpr std::size_t kBoneVerticesPerBlock = 2048;  // a multiple of any vector
// Of the mask of clusters.
constexpr std::size_t kWordsPerSlab = NodeClusters::slab / NodeClusters::size / 64;
static_assert(kWordsPerSlab * 64 * NodeClusters::size == NodeClusters::slab);
constexpr std::size_t kSpansPerThread = 8;     // few, since cells reach across their ends
constexpr std::size_t kWorthThreads = 20'000;  // vertices or nodes; fewer are done before a thread wakes

// Each on one thread.
template <class Each>
void for_tissues(const Model& model, Each&& each) {
  std::size_t vertices = 0;
  for (const Tissue& tissue : model.tissues) vertices += static_cast<std::size_t>(tissue.V.rows());
  if (vertices < kWorthThreads) {
    for (std::size_t t = 0; t < model.tissues.size(); ++t) each(t);
  } else {
    tbb::parallel_for(std::size_t{0}, model.tissues.size(), each);
  }
}

std::span<const float> floats(const PointsF& points) {
  return {points.data(), static_cast<std::size_t>(points.size())};
}

std::vector<TissueNodes> nodes_of_tissues(const Model& model) {
  std::vector<TissueNodes> out(model.tissues.size());
  tbb::enumerable_thread_specific<NodesOfTissues> nodes(std::cref(model));
  for_tissues(model, [&](std::size_t t) {
    if (!model.tissues[t].tet.empty()) out[t] = nodes.local().of(model.tissues[t]);
  });
  return out;
}

// Nodes of one kind hold up the same tissues; of kind 0, none.
std::vector<std::uint32_t> kinds_of_nodes(const Model& model, const std::vector<TissueNodes>& hold) {
  std::vector<std::uint32_t> kind(model.node_count(), 0);
  std::uint32_t kinds = 0;
  std::vector<std::uint32_t> with;  // by kind: the same and this tissue
  for (const TissueNodes& of_tissue : hold) {
    with.assign(kinds + 1, 0);
    for (const std::uint32_t node : of_tissue.nodes) {
      std::uint32_t& more = with[kind[node]];
      if (more == 0) more = ++kinds;
      kind[node] = more;
    }
  }
  return kind;
}

float diagonal(const PointsF& points) {
  return (points.colwise().maxCoeff() - points.colwise().minCoeff()).norm();
}

auto kernel_of(Skinning skinning) {
  switch (skinning) {
    case Skinning::lbs:
      return kernels::lbs;
    case Skinning::dqs:
      return kernels::dqs;
    case Skinning::cor:
      break;
  }
  return kernels::cor;
}

template <class T>
T* data_or_null(std::vector<T>& rows) {
  return rows.empty() ? nullptr : rows.data();
}

}  // namespace

BodyParts::BodyParts(const Model& model) : BodyParts(model, nodes_of_tissues(model)) {}

BodyParts::BodyParts(const Model& model, std::vector<TissueNodes> hold)
    : clusters_(cluster_nodes(model, kinds_of_nodes(model, hold))),
      corrections_(model, clusters_),
      tissues_(model.tissues.size()),
      origin_(middle_of(floats(model.nodes))),
      reach_(std::max(1.0F, diagonal(model.nodes))) {
  for_tissues(model, [&](std::size_t t) {
    const Tissue& tissue = model.tissues[t];
    Part& part = tissues_[t];
    if (tissue.segment != Tissue::by_tets) {
      part.origin = middle_of(floats(tissue.V));
      part.normals = rest_normals(tissue);
      return;
    }
    part.groups = group_vertices(model, tissue, std::exchange(hold[t], {}), clusters_.lane);
    part.mask.assign((clusters_.clusters() + 63) / 64, 0);
    for (const std::uint32_t row : part.groups.rows) {
      const std::size_t cluster = row / (3 * NodeClusters::size);
      part.mask[cluster / 64] |= std::uint64_t{1} << cluster % 64;
    }
  });
  std::vector<std::vector<Run>> of_slab(clusters_.slabs());
  for (std::uint32_t t = 0; t < tissues_.size(); ++t) {
    if (model.tissues[t].segment != Tissue::by_tets) {
      add_bone(t, static_cast<std::size_t>(model.tissues[t].V.rows()));
    } else {
      add_runs(t, of_slab);
    }
  }
  first_run_.push_back(0);
  for (const std::vector<Run>& runs : of_slab) {
    runs_.insert(runs_.end(), runs.begin(), runs.end());
    first_run_.push_back(static_cast<std::uint32_t>(runs_.size()));
  }
}

void BodyParts::add_bone(std::uint32_t tissue, std::size_t vertices) {
  tissues_[tissue].first = static_cast<std::uint32_t>(bones_.size());
  for (std::size_t i = 0; i < vertices; i += kBoneVerticesPerBlock) {
    bones_.push_back({tissue, static_cast<std::uint32_t>(i),
                      static_cast<std::uint32_t>(std::min(vertices, i + kBoneVerticesPerBlock))});
  }
  tissues_[tissue].end = static_cast<std::uint32_t>(bones_.size());
}

void BodyParts::add_runs(std::uint32_t tissue, std::vector<std::vector<Run>>& of_slab) {
  const VertexGroups& groups = tissues_[tissue].groups;
  for (std::uint32_t c = 0, end = 0; c < groups.cells.size(); c = end) {
    const std::size_t slab = groups.last_slab(groups.cells[c]);
    Run run{tissue, c, c, static_cast<std::uint32_t>(slab), ~0U, 0};
    for (end = c; end < groups.cells.size() && groups.last_slab(groups.cells[end]) == slab; ++end) {
      run.from = std::min(run.from, static_cast<std::uint32_t>(groups.first_slab(groups.cells[end])));
    }
    run.end = end;
    const std::size_t first = groups.first_group(c), count = groups.cells[end - 1].end - first;
    for (const VertexGroups::Group& group : std::span(groups.groups).subspan(first, count)) {
      run.first = std::min(run.first, group.first);
      run.last = std::max(run.last, static_cast<std::uint32_t>(group.first + groups.group_vertices(group)));
    }
    if (!groups.in_order || run.last - run.first > 2 * VertexGroups::size * count) run.first = run.last = 0;
    of_slab[slab].push_back(run);
  }
}

void BodyParts::make_scratch(PosedBody::Scratch& scratch) const {
  scratch.lanes.assign(lane_floats(), 0.0F);
  scratch.mask.resize(kWordsPerSlab * clusters_.slabs());
  scratch.asked.resize(tissues_.size());
  scratch.begun.resize(clusters_.slabs());
  scratch.late.reserve(runs_.size());
  scratch.bones.reserve(bones_.size());
  scratch.modes.assign(corrections_.modes(), 0.0F);
}

void BodyParts::add_arrays(HeldArrays& out) const {
  const auto add = [&](const auto&... arrays) { (add_array(arrays, out), ...); };
  add(clusters_.node, clusters_.lane, clusters_.rest, clusters_.centre, clusters_.begin, clusters_.palette,
      clusters_.weight, corrections_.fields(), bones_, runs_);
  for (const Part& part : tissues_) {
    const VertexGroups& groups = part.groups;
    add(groups.cells, groups.groups, groups.vertex, groups.rows, groups.corners, groups.narrow, groups.wide,
        groups.normal, part.normals, part.mask);
  }
}

// What is to be done for a frame, as all its threads read it.
struct BodyParts::Frame {
  const Model& model;
  const SkinClusters& job;
  void (*skin)(const SkinClusters&, std::size_t, std::size_t);
  PosedBody& out;

  VertexSink sink(std::size_t tissue) const {
    return {data_or_null(out.tissues[tissue]), data_or_null(out.quantised[tissue]),
            data_or_null(out.normals[tissue]), out.box};
  }
};

void BodyParts::choose(std::span<const std::uint32_t> tissues, NodesOf nodes,
                       PosedBody::Scratch& scratch) const {
  std::fill(scratch.mask.begin(), scratch.mask.end(), std::uint64_t{0});
  if (nodes != NodesOf::tissues) {
    const std::size_t whole = clusters_.clusters() / 64, rest = clusters_.clusters() % 64;
    std::fill_n(scratch.mask.begin(), whole, ~std::uint64_t{0});
    if (rest != 0) scratch.mask[whole] = (std::uint64_t{1} << rest) - 1;
  }
  std::fill(scratch.asked.begin(), scratch.asked.end(), std::uint8_t{0});
  scratch.bones.clear();
  for (const std::uint32_t t : tissues) {
    const Part& part = tissues_[t];
    scratch.asked[t] = 1;
    for (std::size_t w = 0; w < part.mask.size(); ++w) scratch.mask[w] |= part.mask[w];
    for (std::uint32_t b = part.first; b < part.end; ++b) scratch.bones.push_back(b);
  }
}

void BodyParts::pose_slab(const Frame& frame, std::size_t slab, std::size_t begun) const {
  PosedBody::Scratch& scratch = frame.out.scratch;
  scratch.begun[slab] = static_cast<std::uint32_t>(begun);
  std::array<std::uint32_t, 64 * kWordsPerSlab> clusters;
  std::size_t count = 0;
  for (std::size_t word = kWordsPerSlab * slab; word < kWordsPerSlab * (slab + 1); ++word) {
    for (std::uint64_t bits = scratch.mask[word]; bits != 0; bits &= bits - 1) {
      clusters[count++] =
          static_cast<std::uint32_t>(64 * word) + static_cast<std::uint32_t>(std::countr_zero(bits));
    }
  }
  if (count == 0) return;
  SkinClusters job = frame.job;
  job.clusters = std::span(clusters).first(count);
  frame.skin(job, 0, count);
  if (!job.nodes.empty()) kernels::hand_on(job, 0, count);
  for (std::uint32_t r = first_run_[slab]; r < first_run_[slab + 1]; ++r) {
    if (scratch.asked[runs_[r].tissue] != 0) move_cells(frame, runs_[r], begun, false);
  }
}

// Those that reach no further down than `begun`, or, late, those that do.
void BodyParts::move_cells(const Frame& frame, const Run& run, std::size_t begun, bool late) const {
  const VertexGroups& groups = tissues_[run.tissue].groups;
  const TissueVertices job{groups, frame.out.scratch.lanes, frame.sink(run.tissue), run.first, run.last};
  if (!late && run.from >= begun) return kernels::tissue(job, run.begin, run.end);
  const auto wanted = [&](std::uint32_t c) { return (groups.first_slab(groups.cells[c]) < begun) == late; };
  for (std::uint32_t c = run.begin, end = 0; c < run.end; c = end + 1) {
    for (end = c; end < run.end && wanted(end);) ++end;
    if (end > c) kernels::tissue(job, c, end);
  }
}

void BodyParts::move_bone(const Frame& frame, const Block& block) const {
  const Tissue& tissue = frame.model.tissues[block.tissue];
  const Part& part = tissues_[block.tissue];
  const RigidTransform& motion = frame.out.segments[static_cast<std::size_t>(tissue.segment)];
  const RootMotion carried = make_motions({&motion, 1}, part.origin, {});
  kernels::bone({floats(tissue.V), floats(part.normals), carried, frame.sink(block.tissue)}, block.begin,
                block.end);
}

void BodyParts::pose(const Model& model, Skinning skinning, std::span<const std::uint32_t> tissues,
                     NodesOf nodes, PosedBody& out) const {
  PosedBody::Scratch& scratch = out.scratch;
  choose(tissues, nodes, scratch);
  corrections_.weigh(out.pose, scratch.modes);
  const RootMotion root = make_motions(out.segments, origin_, scratch.motions);
  for (std::size_t c = 0; c < 3; ++c) {
    out.box.low[c] = static_cast<float>(static_cast<double>(origin_[c] - reach_) + root.shift[c]);
  }
  out.box.step = box_step();
  const SkinClusters job{clusters_,
                         scratch.motions,
                         root,
                         {},
                         std::span(scratch.lanes).first(3 * clusters_.node.size()),
                         nodes == NodesOf::body ? std::span<float>(out.nodes) : std::span<float>(),
                         corrections_.modes() > 0 ? &corrections_ : nullptr,
                         scratch.modes};
  const Frame frame{model, job, kernel_of(skinning), out};

  // Threads take spans of slabs, then blocks of bones. What reaches from a span into one before it waits
  // until both are there. The last span is taken first, so that this is so whichever thread is how quick.
  std::size_t work = 0;
  for (const std::uint64_t bits : scratch.mask)
    work += NodeClusters::size * static_cast<std::size_t>(std::popcount(bits));
  for (const std::uint32_t t : tissues) work += static_cast<std::size_t>(model.tissues[t].V.rows());
  const std::size_t threads =
      work < kWorthThreads ? 1 : static_cast<std::size_t>(tbb::this_task_arena::max_concurrency());
  const std::size_t slabs = clusters_.slabs();
  const std::size_t span = std::max<std::size_t>(1, slabs / (kSpansPerThread * threads));
  const std::size_t spans = (slabs + span - 1) / span;
  const auto pose_span = [&](std::size_t first, std::size_t end) {
    for (std::size_t slab = first; slab < end; ++slab) pose_slab(frame, slab, first);
  };
  if (threads == 1) {
    pose_span(0, slabs);
    for (const std::uint32_t bone : scratch.bones) move_bone(frame, bones_[bone]);
    return;
  }
  std::atomic<std::size_t> next{0};
  const auto take_part = [&](std::size_t) {
    for (std::size_t i = next++; i < spans + scratch.bones.size(); i = next++) {
      if (i < spans) {
        const std::size_t first = (spans - 1 - i) * span;
        pose_span(first, std::min(slabs, first + span));
      } else {
        move_bone(frame, bones_[scratch.bones[i - spans]]);
      }
    }
  };
  tbb::parallel_for(std::size_t{0}, threads, take_part, tbb::simple_partitioner());

  scratch.late.clear();
  for (std::size_t slab = 0; slab < slabs; ++slab) {
    for (std::uint32_t r = first_run_[slab]; r < first_run_[slab + 1]; ++r) {
      if (scratch.asked[runs_[r].tissue] != 0 && runs_[r].from < scratch.begun[slab])
        scratch.late.push_back(r);
    }
  }
  tbb::parallel_for(std::size_t{0}, scratch.late.size(), [&](std::size_t i) {
    const Run& run = runs_[scratch.late[i]];
    const std::size_t slab =
        tissues_[run.tissue].groups.last_slab(tissues_[run.tissue].groups.cells[run.begin]);
    move_cells(frame, run, scratch.begun[slab], true);
  });
}

}  // namespace ecorche::runtime
