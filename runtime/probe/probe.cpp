// SPDX-License-Identifier: Apache-2.0
#include <ecorche/runtime/probe.hpp>

#include <hwy/cache_control.h>
#include <tbb/parallel_for.h>
#include <tbb/task_arena.h>

#include <Eigen/LU>
#include <algorithm>
#include <limits>
#include <mutex>
#include <numeric>
#include <string>

#include <ecorche/runtime/rigid_copies.hpp>
#include "runtime/probe/space_order.hpp"
#include "runtime/probe/tissue_cells.hpp"
#include "runtime/probe/tissue_columns.hpp"
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

// One volume's values at rest points, as a posed volume would hold them: rounded to the volume's own type.
template <class T>
struct Values {
  const ModelVolume& volume;
  bool nearest;
  Sampler<T> sampler{volume.image.grid, volume.image.scalars<T>(),
                     static_cast<std::size_t>(volume.image.components), volume.background};

  // Voxels of points that were drawn at random lie far apart: all are asked for before the first is looked
  // at.
  void ask_for(const Eigen::Vector3d& x) const {
    const double half = nearest ? 0.5 : 0;
    const std::int32_t i = index_below(x.x() + half), j = index_below(x.y() + half),
                       k = index_below(x.z() + half);
    const std::int32_t next = nearest ? 0 : 1;
    if (!sampler.inside(i, j, k) || !sampler.inside(i, j + next, k + next)) return;
    for (std::int32_t w = 0; w <= next; ++w) {
      for (std::int32_t v = 0; v <= next; ++v) hwy::Prefetch(sampler.at(i, j + v, k + w));
    }
  }
  // `x`: #which, voxels; what is no number is beyond.
  void at(std::span<const Eigen::Vector3d> x, std::span<const std::uint32_t> which,
          std::vector<double>& out) const {
    for (const Eigen::Vector3d& each : x) ask_for(each);
    std::array<T, 4> few;
    std::vector<T> many(sampler.components > few.size() ? sampler.components : 0);
    T* value = many.empty() ? few.data() : many.data();
    for (std::size_t turn = 0; turn < x.size(); ++turn) {
      std::fill_n(value, sampler.components, to_scalar<T>(volume.background));
      nearest ? sampler.nearest(x[turn].x(), x[turn].y(), x[turn].z(), value)
              : sampler.trilinear(x[turn].x(), x[turn].y(), x[turn].z(), value);
      std::copy_n(value, sampler.components, &out[sampler.components * which[turn]]);
    }
  }
};

// Points that are asked one after the other then find the same nodes and tets in the caches.
void near_order(std::span<const float> points, const BoxNode& top, ProbeOrder& out) {
  constexpr unsigned fine = 9;     // cells of a 128th of the body
  constexpr std::size_t few = 32;  // are looked at together in any order
  if (points.size() <= 3 * few) {
    out.rows.resize(points.size() / 3);
    return std::iota(out.rows.begin(), out.rows.end(), 0U);
  }
  std::array<float, 3> low, high;
  for (std::size_t a = 0; a < 3; ++a) {
    low[a] = *std::min_element(top.low[a].begin(), top.low[a].end());
    high[a] = *std::max_element(top.high[a].begin(), top.high[a].end());
  }
  const SpaceOrder order(low, high);
  out.places.resize(points.size() / 3);
  tbb::parallel_for(tbb::blocked_range<std::size_t>(0, out.places.size(), 2048), [&](const auto& range) {
    for (std::size_t i = range.begin(); i < range.end(); ++i)
      out.places[i] = morton_place(order.cell(&points[3 * i])) >> fine;
  });
  SpaceOrder::sort(out.places, out.rows, out.other);
}

// Copied nodes come behind all others, and are given by rows of their own.
TetRuns runs_of(const Model& model, const RigidCopies& copies, std::span<const std::uint32_t> given) {
  const auto own = model.nodes.rows(), copied = static_cast<Eigen::Index>(copies.nodes());
  if (copied == 0) return {model.tets, model.nodes, given};
  PointsF nodes(own + copied, 3);
  nodes << model.nodes, Eigen::Map<const PointsF>(copies.rest().data(), copied, 3);
  std::vector<std::uint32_t> rows(given.begin(), given.end());
  if (given.empty()) {
    rows.resize(static_cast<std::size_t>(own));
    std::iota(rows.begin(), rows.end(), 0U);
  }
  for (std::size_t n = 0; n < copies.nodes(); ++n)
    rows.push_back(TetRuns::first_copied + static_cast<std::uint32_t>(n));
  return {DrawnTets(model.tets, copies, static_cast<std::int32_t>(own)), nodes, rows};
}

// From the nodes where points lie to those of the other side.
struct Way {
  FindTets here;
  const PaddedNodes &there, &rest, &posed;
  bool from_rest;

  // What is said of a point lies in places of its own: all of them are asked for before the first is said.
  void ask_for(const Model& model, const RigidCopies& copies, const TetPlace& place) const {
    if (place.tet == TetPlace::none) return;
    hwy::Prefetch(&model.tet_label[copies.own(static_cast<std::size_t>(place.tet))]);
    for (const std::uint32_t node : place.nodes) hwy::Prefetch(&there[std::size_t{TetRuns::stride} * node]);
  }
};

}  // namespace

struct Probe::Impl {
  std::shared_ptr<const Model> model;
  RigidCopies copies;
  TetRuns runs;
  PaddedNodes rest_nodes;
  mutable BoxTree rest;  // all of it fitted
  TissueColumns columns;
  mutable std::once_flag cells_made;
  mutable std::unique_ptr<const TissueCells> cells;  // made by the first who asks for tissues

  Impl(std::shared_ptr<const Model> of, std::span<const std::uint32_t> given)
      : model(std::move(of)), copies(*model, given), runs(runs_of(*model, copies, given)), columns(*model) {
    const std::span nodes(model->nodes.data(), static_cast<std::size_t>(model->nodes.size()));
    std::vector<float> rows(
        given.empty() ? 0 : 3 * (std::size_t{1} + *std::max_element(given.begin(), given.end())));
    for (std::size_t n = 0; n < given.size(); ++n)
      std::copy_n(&nodes[3 * n], 3, &rows[3 * std::size_t{given[n]}]);
    runtime::follow(runs, given.empty() ? nodes : std::span<const float>(rows), rest_nodes, rest,
                    copies.rest());
    fit_blocks({runs, rest_nodes, rest});
  }
  void run(const Way& way, std::span<const float> points, const ProbeOptions& wants, Probed& out) const;
};

Probe::Probe(std::shared_ptr<const Model> model, std::span<const std::uint32_t> given)
    : impl_(std::make_unique<const Impl>(std::move(model), given)) {}

Probe::~Probe() = default;

const Model& Probe::model() const {
  return *impl_->model;
}

HeldArrays Probe::arrays() const {
  HeldArrays out;
  impl_->copies.add_arrays(out);
  impl_->runs.add_arrays(out);
  impl_->columns.add_arrays(out);
  // At rest, where all is fitted.
  add_array(impl_->rest_nodes, out);
  add_array(impl_->rest.above, out);
  add_array(impl_->rest.lowest, out);
  add_array(impl_->rest.runs, out);
  return out;
}

void Probe::follow(std::span<const float> nodes, PosedTree& tree) const {
  tree.copied.resize(3 * impl_->copies.nodes());
  impl_->copies.place(nodes, tree.copied);
  runtime::follow(impl_->runs, nodes, tree.nodes, tree.boxes, tree.copied);
}

void Probe::fit(const PosedTree& tree) const {
  fit_blocks({impl_->runs, tree.nodes, tree.boxes});
}

void Probe::posed_to_rest(const PosedTree& tree, std::span<const float> points, const ProbeOptions& wants,
                          Probed& out) const {
  const PaddedNodes& rest = impl_->rest_nodes;
  impl_->run({{impl_->runs, tree.nodes, tree.boxes}, rest, rest, tree.nodes, false}, points, wants, out);
}

void Probe::rest_to_posed(const PosedTree& tree, std::span<const float> points, const ProbeOptions& wants,
                          Probed& out) const {
  const PaddedNodes& rest = impl_->rest_nodes;
  impl_->run({{impl_->runs, rest, impl_->rest}, tree.nodes, rest, tree.nodes, true}, points, wants, out);
}

void Probe::Impl::run(const Way& way, std::span<const float> points, const ProbeOptions& wants,
                      Probed& out) const {
  const std::size_t count = points.size() / 3;
  out.tet.resize(count);
  out.barycentric.resize(4 * count);
  out.points.resize(3 * count);
  out.label.resize(count);
  out.gradient.resize(wants.gradient ? 9 * count : 0);
  out.tissue.resize(wants.tissue ? count : 0);
  out.values.resize(wants.volumes.size());
  for (std::size_t v = 0; v < wants.volumes.size(); ++v) {
    const ProbeOptions::Volume& wanted = wants.volumes[v];
    if (wanted.row >= model->volumes.size())
      throw Error(ErrorKind::usage, "probe", "the model has no volume " + std::to_string(wanted.row),
                  "it has " + std::to_string(model->volumes.size()));
    out.values[v].resize(static_cast<std::size_t>(model->volumes[wanted.row].image.components) * count);
  }
  if (wants.tissue) {
    // A thread that waits here must not begin another probe: it would wait for itself.
    std::call_once(cells_made, [&] {
      tbb::this_task_arena::isolate([&] { cells = std::make_unique<const TissueCells>(columns); });
    });
  }
  near_order(points, way.here.tree.above.back(), out.order);
  const std::size_t tasks = (count + kPointsPerTask - 1) / kPointsPerTask;
  tbb::parallel_for(std::size_t{0}, tasks, [&](std::size_t task) {
    const std::size_t first = kPointsPerTask * task;
    const std::span which = std::span<const std::uint32_t>(out.order.rows)
                                .subspan(first, std::min(kPointsPerTask, count - first));
    std::array<TetPlace, kPointsPerTask> places;
    std::array<Eigen::Vector3d, kPointsPerTask> at_rest, voxel;
    kernels::find_tets(way.here, points, which, places);
    for (std::size_t turn = 0; turn < which.size(); ++turn) way.ask_for(*model, copies, places[turn]);
    for (std::size_t turn = 0; turn < which.size(); ++turn) {
      const std::size_t i = which[turn];
      const std::array<float, 3> point{points[3 * i], points[3 * i + 1], points[3 * i + 2]};
      const TetPlace& place = places[turn];
      const bool held = place.tet != TetPlace::none;
      const auto drawn = static_cast<std::size_t>(place.tet);
      out.tet[i] = held ? static_cast<std::int32_t>(copies.own(drawn)) : TetPlace::none;
      out.label[i] = held ? copies.label(drawn, model->tet_label) : TetMesh::soft;
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
      at_rest[turn] = way.from_rest
                          ? Eigen::Vector3d(static_cast<double>(point[0]), static_cast<double>(point[1]),
                                            static_cast<double>(point[2]))
                          : other;
      if (!held) at_rest[turn].setConstant(static_cast<double>(kNowhere));
      if (wants.tissue) {
        const Eigen::Vector3f at = at_rest[turn].cast<float>();
        out.tissue[i] = held ? cells->at({at.x(), at.y(), at.z()}) : TissueColumns::none;
      }
    }
    for (std::size_t v = 0; v < wants.volumes.size(); ++v) {
      const ModelVolume& volume = model->volumes[wants.volumes[v].row];
      const Affine index = to_index(volume.image.grid);
      for (std::size_t turn = 0; turn < which.size(); ++turn) voxel[turn] = index * at_rest[turn];
      with_scalar_type(volume.image.type, [&](auto zero) {
        const bool nearest = volume.labels || wants.volumes[v].sampling == Sampling::nearest;
        const std::span<const Eigen::Vector3d> all(voxel);
        Values<decltype(zero)>{volume, nearest}.at(all.first(which.size()), which, out.values[v]);
      });
    }
  });
}

}  // namespace ecorche::runtime
