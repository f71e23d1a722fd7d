// SPDX-License-Identifier: Apache-2.0
#include "runtime/probe/probe.hpp"

#include <tbb/parallel_for.h>

#include <Eigen/LU>
#include <limits>
#include <string>

#include "runtime/volume/grid_affine.hpp"
#include "runtime/volume/sampler.hpp"

namespace ecorche::runtime {
namespace {

constexpr std::size_t kPointsPerTask = 128;
constexpr float kNowhere = std::numeric_limits<float>::quiet_NaN();

std::span<const float> numbers(const PointsF& points) {
  return {points.data(), static_cast<std::size_t>(points.size())};
}

using EdgeVectors = Eigen::Matrix3d;  // columns: from corner 0 to the others

EdgeVectors edges(const Tets& tets, std::span<const float> nodes, std::int32_t t) {
  EdgeVectors out;
  const Eigen::Vector3d from = corner_of(tets, nodes, t, 0);
  for (int c = 1; c < 4; ++c) out.col(c - 1) = corner_of(tets, nodes, t, c) - from;
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

}  // namespace

// From the nodes where points lie to those of the other side.
struct Probe::Way {
  FindTets here;
  std::span<const float> there, rest, posed;
  bool from_rest;
};

Probe::Probe(std::shared_ptr<const Model> model)
    : model_(std::move(model)), runs_(model_->tets), tissues_(*model_) {
  fit_boxes(runs_, numbers(model_->nodes), rest_);
}

void Probe::follow(std::span<const float> nodes, PosedTree& tree) const {
  tree.nodes.assign(nodes.begin(), nodes.end());
  fit_boxes(runs_, tree.nodes, tree.boxes);
}

void Probe::posed_to_rest(const PosedTree& tree, std::span<const float> points, const ProbeWants& wants,
                          Probed& out) const {
  const std::span<const float> rest = numbers(model_->nodes);
  run({{runs_, model_->tets, tree.nodes, tree.boxes}, rest, rest, tree.nodes, false}, points, wants, out);
}

void Probe::rest_to_posed(const PosedTree& tree, std::span<const float> points, const ProbeWants& wants,
                          Probed& out) const {
  const std::span<const float> rest = numbers(model_->nodes);
  run({{runs_, model_->tets, rest, rest_}, tree.nodes, rest, tree.nodes, true}, points, wants, out);
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
  const Tets& tets = model_->tets;
  tbb::parallel_for(tbb::blocked_range<std::size_t>(0, count, kPointsPerTask), [&](const auto& range) {
    for (std::size_t i = range.begin(); i < range.end(); ++i) {
      const std::array<float, 3> point{points[3 * i], points[3 * i + 1], points[3 * i + 2]};
      const TetPlace place = find_tet(way.here, point);
      const bool held = place.tet != TetPlace::none;
      out.tet[i] = place.tet;
      out.label[i] = held ? model_->tet_label[static_cast<std::size_t>(place.tet)] : TetMesh::soft;
      Eigen::Vector3d other = Eigen::Vector3d::Constant(kNowhere);
      if (held) {
        other.setZero();
        for (int c = 0; c < 4; ++c)
          other += place.barycentric[static_cast<std::size_t>(c)] * corner_of(tets, way.there, place.tet, c);
      }
      for (std::size_t c = 0; c < 4; ++c)
        out.barycentric[4 * i + c] = static_cast<float>(held ? place.barycentric[c] : 0);
      for (std::size_t c = 0; c < 3; ++c)
        out.points[3 * i + c] = static_cast<float>(other[static_cast<Eigen::Index>(c)]);
      if (wants.gradient) {
        Eigen::Map<Eigen::Matrix<float, 3, 3, Eigen::RowMajor>> F(&out.gradient[9 * i]);
        F.setConstant(kNowhere);
        if (held)
          F = (edges(tets, way.posed, place.tet) * edges(tets, way.rest, place.tet).inverse()).cast<float>();
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
