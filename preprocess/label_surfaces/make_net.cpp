// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <unordered_map>

#include "preprocess/label_surfaces/net_cells.hpp"
#include "preprocess/label_surfaces/surface_net.hpp"

namespace ecorche::label_surfaces {
namespace {

using Cell = std::array<std::int32_t, 3>;
using Eigen::Vector3d;

class NetMaker {
 public:
  NetMaker(const Mask& mask, const Context& context) : mask_(mask), context_(context) {
    for (std::size_t a = 0; a < 3; ++a) cells_[a] = mask.size[a] - 1;
    for (Layer& layer : layers_) {
      layer.bits.resize(static_cast<std::size_t>(cells_[0]) * static_cast<std::size_t>(cells_[1]));
      layer.first.resize(layer.bits.size());
    }
  }

  SurfaceNet run() {
    for (int k = 0; k < cells_[2]; ++k) {
      context_.check_stop();
      Layer& layer = layers_[static_cast<std::size_t>(k & 1)];
      for (int j = 0; j < cells_[1]; ++j) {
        const std::size_t row = at(0, j);
        const std::uint8_t* v[4];
        for (int c = 0; c < 4; ++c) v[c] = &mask_.inside[mask_.offset(0, j + (c & 1), k + (c >> 1))];
        const auto column = [&](int i) {  // bits 0, 2, 4, 6: the corners with this i
          return static_cast<unsigned>(v[0][i] | v[1][i] << 2 | v[2][i] << 4 | v[3][i] << 6);
        };
        unsigned next = column(0);
        for (int i = 0; i < cells_[0]; ++i) {
          const unsigned here = next;
          next = column(i + 1);
          const unsigned bits = here | next << 1;
          layer.bits[row + static_cast<std::size_t>(i)] = static_cast<std::uint8_t>(bits);
          if (bits != 0 && bits != 255) visit({i, j, k}, bits);
        }
      }
    }
    return std::move(net_);
  }

 private:
  // Two layers of cells: what quads need of the one before.
  struct Layer {
    std::vector<std::uint8_t> bits;
    std::vector<std::int32_t> first;  // vertex of the cell's first loop
  };
  std::size_t at(int i, int j) const {
    return static_cast<std::size_t>(i) + static_cast<std::size_t>(cells_[0]) * static_cast<std::size_t>(j);
  }
  const Layer& layer(int k) const { return layers_[static_cast<std::size_t>(k & 1)]; }
  unsigned bits(const Cell& c) const { return layer(c[2]).bits[at(c[0], c[1])]; }
  const CellLoops& loops(const Cell& c) const { return cell_loops()[bits(c)]; }
  std::int32_t vertex(const Cell& c, int edge) const {
    return layer(c[2]).first[at(c[0], c[1])] + loops(c).of_edge[static_cast<std::size_t>(edge)];
  }

  std::int32_t add(const Vector3d& p, const SurfaceNet::Home& home) {
    net_.vertices.push_back(p);
    net_.homes.push_back(home);
    return static_cast<std::int32_t>(net_.vertices.size()) - 1;
  }

  static Vector3d middle(const Cell& cell, int edge) {
    const auto& ends = kEdgeCorners[static_cast<std::size_t>(edge)];
    Vector3d p(cell[0], cell[1], cell[2]);
    for (int a = 0; a < 3; ++a) p[a] += 0.5 * ((ends[0] >> a & 1) + (ends[1] >> a & 1));
    return p;
  }

  void visit(const Cell& cell, unsigned inside) {
    const CellLoops& passed = cell_loops()[inside];
    layers_[static_cast<std::size_t>(cell[2] & 1)].first[at(cell[0], cell[1])] =
        static_cast<std::int32_t>(net_.vertices.size());
    for (std::size_t l = 0; l < passed.count; ++l) {
      Vector3d sum = Vector3d::Zero();
      int crossings = 0;
      for (int e = 0; e < 12; ++e) {
        if ((passed.edges[l] >> e & 1) == 0) continue;
        sum += middle(cell, e);
        ++crossings;
      }
      add(sum / crossings, {cell, passed.edges[l], static_cast<std::uint16_t>(passed.count == 1 ? 1 : 0)});
    }
    // Each crossed edge is the first of its axis in exactly one cell; the other cells round it came before.
    for (int axis = 0; axis < 3; ++axis) {
      const bool in = (inside & 1U) != 0;
      if (((inside >> (1 << axis) & 1U) != 0) != in) round(cell, axis, in);
    }
  }

  /// The polygon round the first edge of `cell` along `axis`.
  void round(const Cell& cell, int axis, bool in) {
    const int u = (axis + 1) % 3, v = (axis + 2) % 3;
    constexpr int ring[4][2] = {{0, 0}, {1, 0}, {1, 1}, {0, 1}};  // steps back along u and v
    std::array<Cell, 4> cells;
    std::array<std::int32_t, 4> quad{};
    for (std::size_t n = 0; n < 4; ++n) {
      cells[n] = cell;
      cells[n][static_cast<std::size_t>(u)] -= ring[n][0];
      cells[n][static_cast<std::size_t>(v)] -= ring[n][1];
      const int from = ring[n][0] << u | ring[n][1] << v;
      quad[n] = vertex(cells[n], edge_between(from, from | 1 << axis));
    }
    std::array<std::int32_t, 8> polygon{};
    std::size_t corners = 0;
    for (std::size_t n = 0; n < 4; ++n) {
      polygon[corners++] = quad[n];
      // From ring[n] to ring[n + 1] the step is along u for n = 0, 2 and along v for n = 1, 3.
      const int across = n % 2 == 0 ? u : v;
      const Cell& low = n == 0 || n == 1 ? cells[n + 1] : cells[n];
      const Cell& high = n == 0 || n == 1 ? cells[n] : cells[(n + 1) % 4];
      const bool twice =
          (loops(low).pinched >> (2 * across + 1) & 1) != 0 && (loops(high).pinched >> (2 * across) & 1) != 0;
      if (twice) polygon[corners++] = shared_edge(high, across, cell, axis, in);
    }
    if (!in) std::reverse(polygon.begin(), polygon.begin() + static_cast<std::ptrdiff_t>(corners));
    if (corners == 4) {
      net_.quads.push_back({polygon[0], polygon[1], polygon[2], polygon[3]});
      return;
    }
    const std::uint16_t only_edge = static_cast<std::uint16_t>(1U << edge_between(0, 1 << axis));
    const std::int32_t hub = add(middle(cell, edge_between(0, 1 << axis)), {cell, only_edge, 0});
    for (std::size_t n = 0; n < corners; ++n)
      net_.triangles.push_back({hub, polygon[n], polygon[(n + 1) % corners]});
  }

  /// The vertex in the middle of the net's edge that passes the low face of `high` along `across`, round the
  /// outside end of the edge of `cell` along `axis`.
  std::int32_t shared_edge(const Cell& high, int across, const Cell& cell, int axis, bool in) {
    Cell end = cell;  // the outside voxel
    if (in) end[static_cast<std::size_t>(axis)] += 1;
    int corner = 0;  // of `high`
    for (int a = 0; a < 3; ++a)
      corner |= (end[static_cast<std::size_t>(a)] - high[static_cast<std::size_t>(a)]) << a;
    const std::size_t face =
        3 * (static_cast<std::size_t>(high[0]) +
             static_cast<std::size_t>(cells_[0]) *
                 (static_cast<std::size_t>(high[1]) +
                  static_cast<std::size_t>(cells_[1]) * static_cast<std::size_t>(high[2]))) +
        static_cast<std::size_t>(across);
    const auto [found, fresh] = on_faces_.emplace(8 * face + static_cast<std::size_t>(corner), 0);
    if (fresh) {
      Vector3d sum = Vector3d::Zero();
      std::uint16_t edges = 0;
      for (int a = 0; a < 3; ++a) {
        if (a == across) continue;
        const int edge = edge_between(corner, corner ^ 1 << a);
        sum += middle(high, edge);
        edges = static_cast<std::uint16_t>(edges | 1U << edge);
      }
      found->second = add(sum / 2, {high, edges, 0});
    }
    return found->second;
  }

  const Mask& mask_;
  const Context& context_;
  Cell cells_{};
  std::array<Layer, 2> layers_;
  std::unordered_map<std::size_t, std::int32_t> on_faces_;
  SurfaceNet net_;
};

}  // namespace

SurfaceNet make_net(const Mask& mask, const Context& context) {
  return NetMaker(mask, context).run();
}

}  // namespace ecorche::label_surfaces
