// SPDX-License-Identifier: Apache-2.0
#include "runtime/settle/patch_volumes.hpp"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>

#include <ecorche/runtime/pose_quality.hpp>

namespace ecorche::runtime {
namespace {

using Eigen::Vector3d;

constexpr double kBulk = 100;  // of the price of a volume, against what shapes of as many tets cost

Vector3d node_at(std::span<const float> nodes, std::int32_t n) {
  return Eigen::Map<const Eigen::Vector3f>(&nodes[3 * static_cast<std::size_t>(n)]).cast<double>();
}

Vector3d vertex_at(const Model& model, const Tissue& tissue, std::size_t v, std::span<const float> nodes) {
  Vector3d p = Vector3d::Zero();
  for (int c = 0; c < 4; ++c)
    p += static_cast<double>(tissue.barycentric(static_cast<Eigen::Index>(v), c)) *
         node_at(nodes, model.tets(tissue.tet[v], c));
  return p;
}

double det(const Vector3d& a, const Vector3d& b, const Vector3d& c) {
  return a.cross(b).dot(c);
}

double enclosed(const Model& model, const Tissue& tissue, std::span<const float> nodes) {
  std::vector<Vector3d> at(tissue.tet.size());
  for (std::size_t v = 0; v < at.size(); ++v) at[v] = vertex_at(model, tissue, v, nodes);
  double sum = 0;
  for (Eigen::Index f = 0; f < tissue.F.rows(); ++f) {
    const auto corner = [&](int c) -> Vector3d {
      return at[static_cast<std::size_t>(tissue.F(f, c))] - at[0];
    };
    sum += det(corner(0), corner(1), corner(2));
  }
  return sum / 6;
}

}  // namespace

TissueVolumes::TissueVolumes(const Model& model, std::span<const float> nodes, double tolerance)
    : model_(model) {
  const std::vector<std::uint8_t> closed = closed_surfaces(model);
  for (std::size_t t = 0; t < model.tissues.size(); ++t)
    if (closed[t] != 0 && model.tissues[t].segment == Tissue::by_tets) rows_.push_back({t, 0, 0, 0});
  const std::vector<double> rest = at({model.nodes.data(), static_cast<std::size_t>(model.nodes.size())});
  const std::vector<double> skinned = at(nodes);
  for (std::size_t r = 0; r < rows_.size(); ++r) {
    const double most = std::abs(skinned[r] - rest[r]) + tolerance * std::abs(rest[r]);
    rows_[r] = {rows_[r].tissue, std::abs(rest[r]), rest[r] - most, rest[r] + most};
  }
  std::erase_if(rows_, [](const Row& row) { return row.rest == 0; });
}

std::vector<double> TissueVolumes::at(std::span<const float> nodes) const {
  std::vector<double> out(rows_.size());
  tbb::parallel_for(std::size_t{0}, out.size(), [&](std::size_t r) {
    out[r] = enclosed(model_, model_.tissues[rows_[r].tissue], nodes);
  });
  return out;
}

double TissueVolumes::beyond(std::size_t row, double volume) const {
  const Row& r = rows_[row];
  return std::max({0.0, r.low - volume, volume - r.high}) / r.rest;
}

PatchVolumes::PatchVolumes(const TissueVolumes& tissues, std::span<const std::int32_t> free,
                           std::span<const float> nodes, std::span<const double> now, double density) {
  const Model& model = tissues.model();
  std::vector<std::int32_t> local;
  for (std::size_t r = 0; r < tissues.rows().size(); ++r) {
    const TissueVolumes::Row& row = tissues.rows()[r];
    const Tissue& tissue = model.tissues[row.tissue];
    const auto moves = [&](std::int32_t v) {
      const auto tet = model.tets.row(tissue.tet[static_cast<std::size_t>(v)]);
      return std::any_of(tet.begin(), tet.end(),
                         [&](std::int32_t n) { return free[static_cast<std::size_t>(n)] >= 0; });
    };
    Part part;
    local.assign(tissue.tet.size(), -1);
    for (Eigen::Index f = 0; f < tissue.F.rows(); ++f) {
      if (!moves(tissue.F(f, 0)) && !moves(tissue.F(f, 1)) && !moves(tissue.F(f, 2))) continue;
      std::array<std::int32_t, 3> corners{};
      for (std::size_t c = 0; c < 3; ++c) {
        const auto v = static_cast<std::size_t>(tissue.F(f, static_cast<Eigen::Index>(c)));
        if (local[v] < 0) {
          local[v] = static_cast<std::int32_t>(part.vertices.size());
          Vertex vertex;
          for (std::size_t k = 0; k < 4; ++k) {
            const std::int32_t n = model.tets(tissue.tet[v], static_cast<Eigen::Index>(k));
            const auto share = static_cast<double>(
                tissue.barycentric(static_cast<Eigen::Index>(v), static_cast<Eigen::Index>(k)));
            vertex.row[k] = free[static_cast<std::size_t>(n)];
            vertex.share[k] = share;
            if (vertex.row[k] < 0) vertex.held += share * node_at(nodes, n);
          }
          part.vertices.push_back(vertex);
        }
        corners[c] = local[v];
      }
      part.triangles.push_back(corners);
    }
    if (part.triangles.empty()) continue;
    part.row = r;
    part.rest = row.rest;
    part.low = std::min(0.0, (row.low - now[r]) / row.rest);
    part.high = std::max(0.0, (row.high - now[r]) / row.rest);
    part.stiff = kBulk * row.rest * density;
    parts_.push_back(std::move(part));
  }
  if (parts_.empty()) return;
  Eigen::VectorXd x(3 * (1 + *std::max_element(free.begin(), free.end())));
  for (std::size_t n = 0; n < free.size(); ++n)
    if (free[n] >= 0) x.segment<3>(3 * free[n]) = node_at(nodes, static_cast<std::int32_t>(n));
  for (Eigen::Index i = 0; i < x.size(); i += 3)
    middle_ += x.segment<3>(i) * 3 / static_cast<double>(x.size());
  for (Part& part : parts_) part.before = volume(part, x);
}

void PatchVolumes::share_out(std::span<const std::size_t> patches) {
  for (Part& part : parts_) {
    part.low /= static_cast<double>(patches[part.row]);
    part.high /= static_cast<double>(patches[part.row]);
  }
}

std::vector<std::size_t> PatchVolumes::rows() const {
  std::vector<std::size_t> out;
  for (const Part& part : parts_) out.push_back(part.row);
  return out;
}

// Leaves the vertices in `placed_`, about the middle.
double PatchVolumes::volume(const Part& part, const Eigen::VectorXd& x) const {
  placed_.resize(part.vertices.size());
  for (std::size_t v = 0; v < placed_.size(); ++v) {
    const Vertex& vertex = part.vertices[v];
    Vector3d p = vertex.held - middle_;
    for (std::size_t k = 0; k < 4; ++k)
      if (vertex.row[k] >= 0) p += vertex.share[k] * x.segment<3>(3 * vertex.row[k]);
    placed_[v] = p;
  }
  double sum = 0;
  for (const auto& f : part.triangles)
    sum += det(placed_[static_cast<std::size_t>(f[0])], placed_[static_cast<std::size_t>(f[1])],
               placed_[static_cast<std::size_t>(f[2])]);
  return sum / 6;
}

// Of the vertices that `volume` placed: `price` times the volume's derivative.
void PatchVolumes::pull(const Part& part, double price, Eigen::VectorXd& gradient) const {
  pulls_.assign(part.vertices.size(), Vector3d::Zero());
  for (const auto& f : part.triangles)
    for (std::size_t c = 0; c < 3; ++c)
      pulls_[static_cast<std::size_t>(f[c])] += placed_[static_cast<std::size_t>(f[(c + 1) % 3])].cross(
          placed_[static_cast<std::size_t>(f[(c + 2) % 3])]);
  for (std::size_t v = 0; v < pulls_.size(); ++v)
    for (std::size_t k = 0; k < 4; ++k) {
      const Vertex& vertex = part.vertices[v];
      if (vertex.row[k] >= 0)
        gradient.segment<3>(3 * vertex.row[k]) += price / 6 * vertex.share[k] * pulls_[v];
    }
}

double PatchVolumes::operator()(const Eigen::VectorXd& x, Eigen::VectorXd& gradient) const {
  double sum = 0;
  for (const Part& part : parts_) {
    const double change = (volume(part, x) - part.before) / part.rest;
    const double low = std::max(0.0, part.price_low + part.stiff * (part.low - change));
    const double high = std::max(0.0, part.price_high + part.stiff * (change - part.high));
    sum += (low * low + high * high) / (2 * part.stiff);
    if (low > 0 || high > 0) pull(part, (high - low) / part.rest, gradient);
  }
  return sum;
}

double PatchVolumes::tighten(const Eigen::VectorXd& x) {
  double worst = 0;
  for (Part& part : parts_) {
    const double change = (volume(part, x) - part.before) / part.rest;
    part.price_low = std::max(0.0, part.price_low + part.stiff * (part.low - change));
    part.price_high = std::max(0.0, part.price_high + part.stiff * (change - part.high));
    worst = std::max({worst, part.low - change, change - part.high});
  }
  return worst;
}

}  // namespace ecorche::runtime
