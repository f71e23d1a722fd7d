// SPDX-License-Identifier: Apache-2.0
#include "phantom/isosurface.hpp"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <string>
#include <utility>
#include <vector>

namespace ecorche::phantom {

namespace {

constexpr std::array<double, 4> kPulls{0.6, 0.6, 0.4, 0};  // the last pass only puts vertices on the surface
constexpr double kFolded = -0.2;                           // cosine between a triangle and its lattice edge
constexpr int kUnfoldings = 8;
constexpr int kBlock = 8;  // samples along an edge of the blocks that are skipped or filled together

/// Corner c of a cell has offsets (c & 1, c >> 1 & 1, c >> 2). Edge e = 4 * axis + (which of four, by the
/// other axes).
constexpr std::array<std::array<int, 2>, 12> kEdges{{{0, 1},
                                                     {2, 3},
                                                     {4, 5},
                                                     {6, 7},  // along x, at (y, z) bits
                                                     {0, 2},
                                                     {1, 3},
                                                     {4, 6},
                                                     {5, 7},  // along y, at (x, z) bits
                                                     {0, 4},
                                                     {1, 5},
                                                     {2, 6},
                                                     {3, 7}}};  // along z, at (x, y) bits
constexpr std::array<std::array<int, 4>, 6> kFaces{{{0, 2, 6, 4},
                                                    {1, 3, 7, 5},
                                                    {0, 1, 5, 4},
                                                    {2, 3, 7, 6},
                                                    {0, 1, 3, 2},
                                                    {4, 5, 7, 6}}};  // corners in a ring

int edge_between(int a, int b) {
  for (int e = 0; e < 12; ++e) {
    const auto& edge = kEdges[static_cast<std::size_t>(e)];
    if ((edge[0] == a && edge[1] == b) || (edge[0] == b && edge[1] == a)) return e;
  }
  return -1;
}

/// The sheets of surface in a cell: which sheet crosses each edge (-1: none).
struct Sheets {
  int count = 0;
  std::array<std::int8_t, 12> of_edge{};
};

Sheets sheets_of(unsigned inside) {
  const auto in = [&](int corner) { return (inside >> corner & 1U) != 0; };
  std::array<int, 12> root{};
  for (int e = 0; e < 12; ++e) root[static_cast<std::size_t>(e)] = e;
  for (const auto& face : kFaces) {  // the crossed edges of a face belong to one sheet
    int first = -1;
    for (std::size_t i = 0; i < 4; ++i) {
      const int a = face[i], b = face[(i + 1) % 4];
      if (in(a) == in(b)) continue;
      const int e = edge_between(a, b);
      if (first < 0) {
        first = e;
        continue;
      }
      const int from = root[static_cast<std::size_t>(e)], to = root[static_cast<std::size_t>(first)];
      std::replace(root.begin(), root.end(), from, to);
    }
  }
  Sheets sheets;
  sheets.of_edge.fill(-1);
  std::array<int, 12> number{};
  number.fill(-1);
  for (std::size_t e = 0; e < 12; ++e) {
    if (in(kEdges[e][0]) == in(kEdges[e][1])) continue;
    int& n = number[static_cast<std::size_t>(root[e])];
    if (n < 0) n = sheets.count++;
    sheets.of_edge[e] = static_cast<std::int8_t>(n);
  }
  return sheets;
}

const std::array<Sheets, 256>& sheet_table() {
  static const std::array<Sheets, 256> table = [] {
    std::array<Sheets, 256> t;
    for (unsigned i = 0; i < 256; ++i) t[i] = sheets_of(i);
    return t;
  }();
  return table;
}

using Cell = std::array<std::int32_t, 3>;

/// Four vertices round a crossed lattice edge, counter-clockwise seen from outside.
struct Quad {
  std::array<std::int32_t, 4> v;
  Vec out;  ///< along the lattice edge, from its inside to its outside end
};

class SurfaceNets {
 public:
  SurfaceNets(const Shape& shape, double spacing, const Context& context)
      : shape_(shape), h_(spacing), context_(context) {
    // The odd shift keeps lattice planes off the round numbers at which shapes have their planes of symmetry.
    for (int a = 0; a < 3; ++a) {
      origin_[a] = (std::floor(shape.box().lo[a] / h_) - 2.0 - 0.3719) * h_;
      n_[static_cast<std::size_t>(a)] =
          static_cast<std::int32_t>(std::ceil((shape.box().hi[a] - origin_[a]) / h_)) + 4;
    }
  }

  SurfaceMesh run() {
    sample();
    find_cells();
    make_unambiguous();
    place_vertices();
    make_quads();
    context_.check_stop();
    net_ = vertices_;
    for (const double pull : kPulls) relax(pull);
    unfold();
    return triangulate();
  }

 private:
  std::size_t at(int i, int j, int k) const {
    return static_cast<std::size_t>(i) +
           static_cast<std::size_t>(n_[0]) *
               (static_cast<std::size_t>(j) + static_cast<std::size_t>(n_[1]) * static_cast<std::size_t>(k));
  }
  std::size_t corner(const Cell& c, int corner) const {
    return at(c[0] + (corner & 1), c[1] + (corner >> 1 & 1), c[2] + (corner >> 2));
  }
  Vec point(double i, double j, double k) const { return origin_ + h_ * Vec(i, j, k); }
  unsigned inside(const Cell& c) const {
    unsigned bits = 0;
    for (int q = 0; q < 8; ++q) bits |= (value_[corner(c, q)] < 0 ? 1U : 0U) << q;
    return bits;
  }

  /// Values on all samples; far from the surface only their sign is meant.
  void sample() {
    value_.assign(at(0, 0, n_[2]), 1.0F);
    const int bx = (n_[0] + kBlock - 1) / kBlock, by = (n_[1] + kBlock - 1) / kBlock,
              bz = (n_[2] + kBlock - 1) / kBlock;
    tbb::parallel_for(0, bx * by * bz, [&](int block) {
      if (context_.stop.stop_requested()) return;
      const Cell lo{block % bx * kBlock, block / bx % by * kBlock, block / (bx * by) * kBlock};
      fill(lo, kBlock);
    });
    context_.check_stop();
  }

  void fill(const Cell& lo, int edge) {
    if (lo[0] >= n_[0] || lo[1] >= n_[1] || lo[2] >= n_[2]) return;
    const double middle = (edge - 1) / 2.0;
    const double d = shape_.distance(point(lo[0] + middle, lo[1] + middle, lo[2] + middle));
    const bool far = std::abs(d) > Shape::lipschitz * std::sqrt(3.0) * h_ * middle;
    if (!far && edge > 2) {
      const int half = edge / 2;
      for (int q = 0; q < 8; ++q)
        fill({lo[0] + (q & 1) * half, lo[1] + (q >> 1 & 1) * half, lo[2] + (q >> 2) * half}, half);
      return;
    }
    for (int k = lo[2]; k < std::min(lo[2] + edge, n_[2]); ++k) {
      for (int j = lo[1]; j < std::min(lo[1] + edge, n_[1]); ++j) {
        for (int i = lo[0]; i < std::min(lo[0] + edge, n_[0]); ++i) {
          value_[at(i, j, k)] = static_cast<float>(far ? d : shape_.distance(point(i, j, k)));
        }
      }
    }
  }

  void find_cells() {
    std::vector<std::vector<Cell>> layers(static_cast<std::size_t>(n_[2] - 1));
    tbb::parallel_for(0, n_[2] - 1, [&](int k) {
      for (int j = 0; j + 1 < n_[1]; ++j) {
        for (int i = 0; i + 1 < n_[0]; ++i) {
          const unsigned bits = inside({i, j, k});
          if (bits != 0 && bits != 255) layers[static_cast<std::size_t>(k)].push_back({i, j, k});
        }
      }
    });
    for (const auto& layer : layers) cells_.insert(cells_.end(), layer.begin(), layer.end());
    if (cells_.empty())
      throw Error(ErrorKind::internal, "phantom", "a shape has no surface at spacing " + std::to_string(h_),
                  "use a finer lattice");
  }

  /// Fills outside samples in until no lattice square has its inside corners on a diagonal. Only ever fills:
  /// it ends.
  void make_unambiguous() {
    std::vector<Cell> work = cells_;
    bool filled = false;
    while (!work.empty()) {
      std::vector<Cell> touched;
      for (const Cell& cell : work) {
        for (const auto& face : kFaces) {
          std::array<std::size_t, 4> v{};
          for (std::size_t i = 0; i < 4; ++i) v[i] = corner(cell, face[i]);
          const auto in = [&](std::size_t i) { return value_[v[i]] < 0; };
          if (in(0) != in(2) || in(1) != in(3) || in(0) == in(1)) continue;
          const std::size_t a = in(0) ? 1 : 0, b = a + 2;  // the two outside corners
          const std::size_t chosen = value_[v[a]] <= value_[v[b]] ? a : b;
          value_[v[chosen]] = -1e-3F * static_cast<float>(h_);
          filled = true;
          const int q = face[chosen];
          for (int n = 0; n < 8; ++n) {
            touched.push_back({cell[0] + (q & 1) - (n & 1), cell[1] + (q >> 1 & 1) - (n >> 1 & 1),
                               cell[2] + (q >> 2) - (n >> 2)});
          }
        }
      }
      work = std::move(touched);
    }
    if (!filled) return;
    cells_.clear();
    find_cells();
  }

  /// One vertex per sheet of a cell: the mean of the sheet's crossings with the cell's edges.
  void place_vertices() {
    first_.assign(value_.size(), -1);
    for (const Cell& cell : cells_) {
      const Sheets& sheets = sheet_table()[inside(cell)];
      first_[corner(cell, 0)] = static_cast<std::int32_t>(vertices_.size());
      for (int sheet = 0; sheet < sheets.count; ++sheet) {
        Vec sum = Vec::Zero();
        int crossings = 0;
        for (std::size_t e = 0; e < 12; ++e) {
          if (sheets.of_edge[e] != sheet) continue;
          const int a = kEdges[e][0], b = kEdges[e][1];
          const double va = value_[corner(cell, a)], vb = value_[corner(cell, b)];
          const double t = va / (va - vb);
          const Vec pa(a & 1, a >> 1 & 1, a >> 2), pb(b & 1, b >> 1 & 1, b >> 2);
          sum += pa + t * (pb - pa);
          ++crossings;
        }
        sum /= crossings;
        vertices_.push_back(point(cell[0] + sum[0], cell[1] + sum[1], cell[2] + sum[2]));
        home_.push_back(point(cell[0] + 0.5, cell[1] + 0.5, cell[2] + 0.5));
      }
    }
  }

  std::int32_t vertex_at(const Cell& cell, int edge) const {
    const Sheets& sheets = sheet_table()[inside(cell)];
    return first_[corner(cell, 0)] + sheets.of_edge[static_cast<std::size_t>(edge)];
  }

  /// A quad around every crossed lattice edge; each is the first edge of its axis in exactly one cell.
  void make_quads() {
    for (const Cell& c : cells_) {
      const bool in = value_[corner(c, 0)] < 0;
      for (int axis = 0; axis < 3; ++axis) {
        if ((value_[corner(c, 1 << axis)] < 0) == in) continue;
        const int u = (axis + 1) % 3, v = (axis + 2) % 3;
        std::array<std::int32_t, 4> quad{};
        constexpr int ring[4][2] = {
            {0, 0}, {1, 0}, {1, 1}, {0, 1}};  // steps back along u and v, clockwise about the axis
        for (std::size_t i = 0; i < 4; ++i) {
          Cell cell = c;
          cell[static_cast<std::size_t>(u)] -= ring[i][0];
          cell[static_cast<std::size_t>(v)] -= ring[i][1];
          const int from = ring[i][0] << u | ring[i][1] << v;
          quad[i] = vertex_at(cell, edge_between(from, from | 1 << axis));
        }
        if (!in) std::swap(quad[1], quad[3]);
        quads_.push_back({quad, (in ? 1.0 : -1.0) * Vec::Unit(axis)});
      }
    }
  }

  /// Slides vertices by `pull` of the way to their neighbours' mean, then back onto the surface.
  void relax(double pull) {
    std::vector<Vec> sum(vertices_.size(), Vec::Zero());
    std::vector<int> count(vertices_.size(), 0);
    for (const Quad& quad : quads_) {
      for (std::size_t i = 0; i < 4; ++i) {
        const auto a = static_cast<std::size_t>(quad.v[i]), b = static_cast<std::size_t>(quad.v[(i + 1) % 4]);
        sum[a] += vertices_[b];
        ++count[a];
      }
    }
    tbb::parallel_for(tbb::blocked_range<std::size_t>(0, vertices_.size(), 256), [&](const auto& range) {
      for (std::size_t v = range.begin(); v < range.end(); ++v) {
        const Vec step = sum[v] / count[v] - vertices_[v];
        vertices_[v] = project(v, vertices_[v] + pull * step);
      }
    });
    context_.check_stop();
  }

  /// A Newton step to the surface, no further than the vertex's own neighbourhood.
  Vec project(std::size_t v, const Vec& p) const {
    const Shape::Sample at = shape_.sample(p, 0.01 * h_);
    const Vec q = p - std::clamp(at.distance, -0.5 * h_, 0.5 * h_) * at.normal;
    const Vec reach = Vec::Constant(0.7 * h_);
    return q.cwiseMax(home_[v] - reach).cwiseMin(home_[v] + reach);
  }

  /// The cosine between the way out and the worse triangle of a quad cut from its corner `s` to `s + 2`.
  double facing(const Quad& quad, std::size_t s) const {
    const auto p = [&](std::size_t i) -> const Vec& {
      return vertices_[static_cast<std::size_t>(quad.v[i % 4])];
    };
    const Vec a = (p(s + 1) - p(s)).cross(p(s + 2) - p(s)), b = (p(s + 2) - p(s)).cross(p(s + 3) - p(s));
    return std::min(a.dot(quad.out) / (a.norm() + 1e-30), b.dot(quad.out) / (b.norm() + 1e-30));
  }

  /// Where to cut a quad: along its shorter diagonal, unless that folds it over.
  std::size_t cut(const Quad& quad) const {
    const auto p = [&](std::size_t i) -> const Vec& {
      return vertices_[static_cast<std::size_t>(quad.v[i])];
    };
    const std::size_t shorter = (p(0) - p(2)).squaredNorm() <= (p(1) - p(3)).squaredNorm() ? 0 : 1;
    return facing(quad, shorter) > kFolded || facing(quad, 1 - shorter) < facing(quad, shorter) ? shorter
                                                                                                : 1 - shorter;
  }

  /// On creases finer than the lattice, sliding can fold the surface over. A quad that faces against its
  /// lattice edge gets its corners moved back towards the net's own positions, where no quad is folded.
  void unfold() {
    for (int pass = 0; pass < kUnfoldings; ++pass) {
      std::vector<char> marked(vertices_.size(), 0);
      bool folded = false;
      for (const Quad& quad : quads_) {
        if (facing(quad, cut(quad)) > kFolded) continue;
        folded = true;
        for (const std::int32_t v : quad.v) marked[static_cast<std::size_t>(v)] = 1;
      }
      if (!folded) return;
      for (std::size_t v = 0; v < vertices_.size(); ++v) {
        if (marked[v] != 0) vertices_[v] = (vertices_[v] + net_[v]) / 2;
      }
    }
  }

  SurfaceMesh triangulate() const {
    SurfaceMesh mesh;
    mesh.V.resize(static_cast<Eigen::Index>(vertices_.size()), 3);
    for (std::size_t v = 0; v < vertices_.size(); ++v) {
      mesh.V.row(static_cast<Eigen::Index>(v)) = vertices_[v].transpose();
    }
    mesh.F.resize(static_cast<Eigen::Index>(2 * quads_.size()), 3);
    Eigen::Index f = 0;
    for (const Quad& quad : quads_) {
      const std::size_t s = cut(quad);
      mesh.F.row(f++) << quad.v[s], quad.v[s + 1], quad.v[s + 2];
      mesh.F.row(f++) << quad.v[s], quad.v[s + 2], quad.v[(s + 3) % 4];
    }
    return mesh;
  }

  const Shape& shape_;
  double h_;
  const Context& context_;
  Vec origin_;
  std::array<std::int32_t, 3> n_{};
  std::vector<float> value_;
  std::vector<Cell> cells_;
  std::vector<std::int32_t> first_;  // of each cell, by its first corner: its first vertex
  std::vector<Vec> vertices_;
  std::vector<Vec> home_;  // the middle of each vertex's cell
  std::vector<Vec> net_;   // where each vertex began
  std::vector<Quad> quads_;
};

}  // namespace

SurfaceMesh isosurface(const Shape& shape, double spacing, const Context& context) {
  return SurfaceNets(shape, spacing, context).run();
}

}  // namespace ecorche::phantom
