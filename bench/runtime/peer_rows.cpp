// SPDX-License-Identifier: Apache-2.0
#include "bench/runtime/peer_rows.hpp"

#include <tbb/global_control.h>
#include <tbb/task_arena.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <string>

#include <ecorche/runtime/resample.hpp>

namespace ecorche::bench {
namespace {

constexpr float kSmallest = 1e-4F;  // as node_clusters.hpp keeps them
constexpr int kFrames = 20;
[[maybe_unused]] constexpr std::size_t kBlenderFrames = 8;  // where there is a Blender

HungPoints hung_points(const Model& model, const runtime::NodeClusters& clusters) {
  HungPoints out;
  out.segments = model.segment_count();
  out.begin.push_back(0);
  std::vector<std::pair<float, std::uint16_t>> row;
  for (std::size_t lane = 0; lane < clusters.needed; ++lane) {
    const std::size_t node = clusters.node[lane];
    for (int c = 0; c < 3; ++c) out.at.push_back(model.nodes(static_cast<Eigen::Index>(node), c));
    row.clear();
    float sum = 0;
    for (auto e = model.weights.offsets[node]; e < model.weights.offsets[node + 1]; ++e) {
      if (model.weights.weight[e] < kSmallest) continue;
      row.emplace_back(model.weights.weight[e], model.weights.segment[e]);
      sum += model.weights.weight[e];
    }
    std::sort(row.begin(), row.end(), std::greater<>());
    for (const auto& [weight, segment] : row) {
      out.weight.push_back(weight / sum);
      out.segment.push_back(segment);
    }
    out.begin.push_back(static_cast<std::uint32_t>(out.weight.size()));
  }
  return out;
}

std::vector<Motion> motions_of(const std::vector<RigidTransform>& frame) {
  std::vector<Motion> out;
  for (const RigidTransform& m : frame)
    out.push_back({{m.q.w(), m.q.x(), m.q.y(), m.q.z()}, {m.t.x(), m.t.y(), m.t.z()}});
  return out;
}

double worst_apart(const SkinningPeer& peer, std::span<const float> posed, std::size_t points) {
  double worst = 0;
  for (std::size_t p = 0; p < points; ++p) {
    const std::array<double, 3> at = peer.at(p);
    double squared = 0;
    for (std::size_t c = 0; c < 3; ++c) squared += std::pow(at[c] - static_cast<double>(posed[3 * p + c]), 2);
    worst = std::max(worst, squared);
  }
  return std::sqrt(worst);
}

Table table_of_peers() {
  return Table({{"peer", 48},
                {"threads"},
                {"median ms", 9},
                {"best", 9},
                {"worst", 9},
                {"ours ms", 8},
                {"ours faster"},
                {"apart", -20}});
}

void row(const Table& table, const std::string& name, std::size_t threads, const Figure& figure, double ours,
         const std::string& apart) {
  table.row({name, std::to_string(threads), fixed(figure.median, 3), fixed(figure.best, 3),
             fixed(figure.worst, 3), fixed(ours, 3), fixed(figure.median / ours, 1) + " x", apart});
}

}  // namespace

void skinning_peers(const OurSkinning& ours) {
  const HungPoints points = hung_points(ours.model, ours.clusters);
  std::vector<std::vector<Motion>> frames;
  for (const auto& frame : ours.frames) frames.push_back(motions_of(frame));
  std::printf("\nPeers on the %zu nodes that tissues need, %.2f weights each\n", points.points(),
              static_cast<double>(points.weight.size()) / static_cast<double>(points.points()));
  std::vector<std::string> absent;
  Peers peers;
#ifdef ECORCHE_PEER_OZZ
  add_ozz(points, ours.copies, peers);
  add_ozz_native(points, ours.copies, peers);
#else
  absent.emplace_back("ozz-animation (ECORCHE_OZZ_DIR)");
#endif
#ifdef ECORCHE_PEER_IGL
  add_igl(points, peers);
#else
  absent.emplace_back("libigl (ECORCHE_LIBIGL_DIR)");
#endif
#ifdef ECORCHE_PEER_VTK
  add_vtk(points, peers);
#else
  absent.emplace_back("VTK");
#endif
  const Table table = table_of_peers();
  for (const auto& peer : peers) {
    const auto skinning = peer->dqs ? runtime::Skinning::dqs : runtime::Skinning::lbs;
    const Figure figure = time(kFrames, [&](int f) { peer->pose(frames[static_cast<std::size_t>(f)]); });
    const Figure mine = ours.time(skinning, static_cast<int>(peer->threads));
    peer->pose(frames[7]);
    row(table, peer->name, peer->threads, figure, mine.median,
        "at most " + fixed(worst_apart(*peer, ours.posed(skinning, 7), points.points()), 3) + " mm");
  }
#ifdef ECORCHE_BLENDER
  std::vector<std::string> notes =
      armature_by_blender(ECORCHE_BLENDER, ECORCHE_BLENDER_SCRIPT, points,
                          std::span(frames).first(std::min(kBlenderFrames, frames.size())));
  for (const auto skinning : {runtime::Skinning::lbs, runtime::Skinning::dqs}) {
    notes.push_back("ours beside Blender, " + std::string(runtime::skinning_name(skinning)) + ": 2 threads " +
                    fixed(ours.time(skinning, 2).median, 3) + " ms");
  }
  const std::span<const float> last =
      ours.posed(runtime::Skinning::lbs, static_cast<int>(std::min(kBlenderFrames, frames.size())) - 1);
  notes.push_back("ours, LBS: the first point ends at " + fixed(static_cast<double>(last[0]), 2) + " " +
                  fixed(static_cast<double>(last[1]), 2) + " " + fixed(static_cast<double>(last[2]), 2));
#else
  std::vector<std::string> notes;
  absent.emplace_back("Blender");
#endif
  for (const std::string& name : absent) notes.push_back("not here: " + name);
  print_notes(notes);
}

void volume_peers(const Model& model, std::span<const float> nodes, const ModelVolume& volume,
                  const Image& posed, double ours) {
  const ImageGrid& grid = posed.grid;
  runtime::InverseMap map;
  runtime::locate(model, nodes, grid, map);
  const runtime::DisplacementField field = runtime::inverse_displacement(model, nodes, map);
  const std::span<const float> vectors = field.vectors.scalars<float>();
  const PosedGrid job{grid.size,
                      grid.spacing,
                      grid.origin,
                      volume.image.scalars<std::uint8_t>(),
                      {model.nodes.data(), static_cast<std::size_t>(model.nodes.size())},
                      nodes,
                      {model.tets.data(), static_cast<std::size_t>(model.tets.size())},
                      vectors};
  std::printf("\nPeers on a volume of %d x %d x %d, 8 bit; ours inverts and samples, trilinear\n",
              grid.size[0], grid.size[1], grid.size[2]);
  const Table table = table_of_peers();
  std::vector<std::string> notes;
#ifdef ECORCHE_PEER_VTK
  const VtkProbed probed = probe_by_vtk(job);
  row(table, probed.name + ", the rest places alone", 2, {probed.ms, probed.ms, probed.ms}, ours,
      "see below");
  std::size_t held = 0, other = 0, apart = 0;
  for (std::size_t v = 0; v < map.tet.size(); ++v) {
    const bool mine = map.tet[v] != runtime::InverseMap::none;
    held += mine ? 1 : 0;
    if (mine != (probed.held[v] != 0)) {
      ++other;
    } else if (mine) {
      const std::array<double, 3> at =
          grid.point(static_cast<double>(v % static_cast<std::size_t>(grid.size[0])),
                     static_cast<double>(v / static_cast<std::size_t>(grid.size[0]) %
                                         static_cast<std::size_t>(grid.size[1])),
                     static_cast<double>(v / static_cast<std::size_t>(grid.size[0]) /
                                         static_cast<std::size_t>(grid.size[1])));
      double worst = 0;
      for (std::size_t c = 0; c < 3; ++c) {
        worst = std::max(worst, std::abs(at[c] + static_cast<double>(vectors[3 * v + c]) -
                                         static_cast<double>(probed.rest[3 * v + c])) /
                                    grid.spacing[c]);
      }
      apart += worst > 0.05 ? 1 : 0;
    }
  }
  notes.push_back(probed.name + ": of " + std::to_string(held) + " voxels within, " + std::to_string(other) +
                  " are outside for one of the two, " + std::to_string(apart) +
                  " lie more than 0.05 voxel apart (folds)");
#else
  notes.emplace_back("not here: VTK");
#endif
#ifdef ECORCHE_PEER_ITK
  const ItkWarped warped = warp_by_itk(job);
  std::size_t differ = 0;
  const std::span<const std::uint8_t> mine = posed.scalars<std::uint8_t>();
  for (std::size_t v = 0; v < warped.values.size(); ++v) {
    differ += map.tet[v] != runtime::InverseMap::none && std::abs(warped.values[v] - mine[v]) > 1 ? 1 : 0;
  }
  row(table, warped.name, 2, {warped.ms, warped.ms, warped.ms}, ours,
      std::to_string(differ) + " voxels by more than 1");
#else
  notes.emplace_back("not here: ITK");
#endif
  print_notes(notes);
}

}  // namespace ecorche::bench
