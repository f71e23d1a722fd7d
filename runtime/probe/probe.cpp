// SPDX-License-Identifier: Apache-2.0
#include "runtime/probe/probe.hpp"

#include <hwy/cache_control.h>
#include <tbb/parallel_for.h>

#include <Eigen/LU>
#include <algorithm>
#include <limits>
#include <string>

#include "runtime/probe/space_order.hpp"
#include "runtime/volume/grid_affine.hpp"
#include "runtime/volume/sampler.hpp"

namespace ecorche::runtime {
namespace {

constexpr std::size_t kPointsPerTask = 256;
constexpr float kNowhere = std::numeric_limits<float>::quiet_NaN();

using EdgeVectors = Eigen::Matrix3d;  // columns: from corner 0 to the others

Eigen::Vector3d corner(const PaddedNodes& nodes, const TetPlace& place, std::size_t c) {
  return Eigen::Map<const Eigen::Vector3f>(&nodes[std::size_t{TetRuns::stride} * place.nodes[c]])
      .cast<double>();
}

EdgeVectors edges(const PaddedNodes& nodes, const TetPlace& place) {
  EdgeVectors out;
  const Eigen::Vector3d from = corner(nodes, place, 0);
  for (std::size_t c = 1; c < 4; ++c)
    out.col(static_cast<Eigen::Index>(c - 1)) = corner(nodes, place, c) - from;
  return out;
}

// One volume's values at rest points.
struct Values {
  const ModelVolume& volume;
  Affine index;
  bool nearest;
  std::vector<double>& out;

  void at(std::size_t i, bool held, const Eigen::Vector3d& rest) const {
    with_scalar_type(volume.image.type, [&](auto zero) {
      using T = decltype(zero);
      const auto components = static_cast<std::size_t>(volume.image.components);
      // As a posed volume would hold it: rounded to the volume's own type.
      std::array<T, 4> few;
      std::vector<T> many(components > few.size() ? components : 0);
      T* value = many.empty() ? few.data() : many.data();
      std::fill_n(value, components, to_scalar<T>(volume.background));
      if (held) {
        const Sampler<T> sampler{volume.image.grid, volume.image.scalars<T>(), components, volume.background};
        const Eigen::Vector3d x = index * rest;
        nearest ? sampler.nearest(x.x(), x.y(), x.z(), value) : sampler.trilinear(x.x(), x.y(), x.z(), value);
      }
      for (std::size_t c = 0; c < components; ++c) out[components * i + c] = static_cast<double>(value[c]);
    });
  }
};

// Points that are asked one after the other then find the same nodes and tets in the caches.
std::vector<std::uint32_t> near_order(std::span<const float> points, const BoxNode& top) {
  std::array<float, 3> low, high;
  for (std::size_t a = 0; a < 3; ++a) {
    low[a] = *std::min_element(top.low[a].begin(), top.low[a].end());
    high[a] = *std::max_element(top.high[a].begin(), top.high[a].end());
  }
  const SpaceOrder order(low, high);
  std::vector<std::uint32_t> places(points.size() / 3);
  for (std::size_t i = 0; i < places.size(); ++i) places[i] = morton_place(order.cell(&points[3 * i]));
  return SpaceOrder::sorted(places);
}

}  // namespace

// From the nodes where points lie to those of the other side.
struct Probe::Way {
  FindTets here;
  const PaddedNodes &there, &rest, &posed;
  bool from_rest;

  // What is said of a point lies in places of its own: all of them are asked for before the first is said.
  void ask_for(const Model& model, const TetPlace& place) const {
    if (place.tet == TetPlace::none) return;
    hwy::Prefetch(&model.tet_label[static_cast<std::size_t>(place.tet)]);
    for (const std::uint32_t node : place.nodes) hwy::Prefetch(&there[std::size_t{TetRuns::stride} * node]);
  }
};

Probe::Probe(std::shared_ptr<const Model> model)
    : model_(std::move(model)), runs_(model_->tets, model_->nodes), tissues_(*model_) {
  pad_nodes({model_->nodes.data(), static_cast<std::size_t>(model_->nodes.size())}, rest_nodes_);
  fit_boxes(runs_, rest_nodes_, rest_);
}

void Probe::follow(std::span<const float> nodes, PosedTree& tree) const {
  pad_nodes(nodes, tree.nodes);
  fit_boxes(runs_, tree.nodes, tree.boxes);
}

void Probe::posed_to_rest(const PosedTree& tree, std::span<const float> points, const ProbeWants& wants,
                          Probed& out) const {
  run({{runs_, tree.nodes, tree.boxes}, rest_nodes_, rest_nodes_, tree.nodes, false}, points, wants, out);
}

void Probe::rest_to_posed(const PosedTree& tree, std::span<const float> points, const ProbeWants& wants,
                          Probed& out) const {
  run({{runs_, rest_nodes_, rest_}, tree.nodes, rest_nodes_, tree.nodes, true}, points, wants, out);
}

void Probe::run(const Way& way, std::span<const float> points, const ProbeWants& wants, Probed& out) const {
  const std::size_t count = points.size() / 3;
  out.tet.resize(count);
  out.barycentric.resize(4 * count);
  out.points.resize(3 * count);
  out.label.resize(count);
  out.gradient.resize(wants.gradient ? 9 * count : 0);
  out.tissue.resize(wants.tissue ? count : 0);
  out.values.resize(wants.volumes.size());
  std::vector<Values> volumes;
  for (std::size_t v = 0; v < wants.volumes.size(); ++v) {
    const ProbeWants::Volume& wanted = wants.volumes[v];
    if (wanted.row >= model_->volumes.size())
      throw Error(ErrorKind::usage, "probe", "the model has no volume " + std::to_string(wanted.row),
                  "it has " + std::to_string(model_->volumes.size()));
    const ModelVolume& volume = model_->volumes[wanted.row];
    out.values[v].resize(static_cast<std::size_t>(volume.image.components) * count);
    volumes.push_back({volume, to_index(volume.image.grid),
                       volume.labels || wanted.sampling == Sampling::nearest, out.values[v]});
  }
  const std::vector<std::uint32_t> order = near_order(points, way.here.tree.back());
  const std::size_t tasks = (count + kPointsPerTask - 1) / kPointsPerTask;
  tbb::parallel_for(std::size_t{0}, tasks, [&](std::size_t task) {
    const std::size_t first = kPointsPerTask * task;
    const std::span which =
        std::span<const std::uint32_t>(order).subspan(first, std::min(kPointsPerTask, count - first));
    std::array<TetPlace, kPointsPerTask> places;
    kernels::find_tets(way.here, points, which, places);
    for (std::size_t turn = 0; turn < which.size(); ++turn) way.ask_for(*model_, places[turn]);
    for (std::size_t turn = 0; turn < which.size(); ++turn) {
      const std::size_t i = which[turn];
      const std::array<float, 3> point{points[3 * i], points[3 * i + 1], points[3 * i + 2]};
      const TetPlace& place = places[turn];
      const bool held = place.tet != TetPlace::none;
      out.tet[i] = place.tet;
      out.label[i] = held ? model_->tet_label[static_cast<std::size_t>(place.tet)] : TetMesh::soft;
      Eigen::Vector3d other = Eigen::Vector3d::Constant(kNowhere);
      if (held) {
        other.setZero();
        for (std::size_t c = 0; c < 4; ++c) other += place.barycentric[c] * corner(way.there, place, c);
      }
      for (std::size_t c = 0; c < 4; ++c)
        out.barycentric[4 * i + c] = static_cast<float>(held ? place.barycentric[c] : 0);
      for (std::size_t c = 0; c < 3; ++c)
        out.points[3 * i + c] = static_cast<float>(other[static_cast<Eigen::Index>(c)]);
      if (wants.gradient) {
        Eigen::Map<Eigen::Matrix<float, 3, 3, Eigen::RowMajor>> F(&out.gradient[9 * i]);
        F.setConstant(kNowhere);
        if (held) F = (edges(way.posed, place) * edges(way.rest, place).inverse()).cast<float>();
      }
      const Eigen::Vector3d rest =
          way.from_rest ? Eigen::Vector3d(static_cast<double>(point[0]), static_cast<double>(point[1]),
                                          static_cast<double>(point[2]))
                        : other;
      if (wants.tissue) {
        const Eigen::Vector3f at = rest.cast<float>();
        out.tissue[i] = held ? tissues_.at({at.x(), at.y(), at.z()}) : TissueColumns::none;
      }
      for (const Values& values : volumes) values.at(i, held, rest);
    }
  });
}

}  // namespace ecorche::runtime
