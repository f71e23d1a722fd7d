// SPDX-License-Identifier: Apache-2.0
// One order for every mesh: what follows reads nodes and tets that are near in space near in memory.
#include <tbb/parallel_for.h>
#include <tbb/parallel_reduce.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <numeric>
#include <string>
#include <vector>

#include "preprocess/tet/mesher.hpp"

namespace ecorche::tet {
namespace {

std::uint64_t spread(std::uint64_t x) {  // 21 bits to every third bit
  x &= 0x1fffff;
  x = (x | x << 32) & 0x1f00000000ffffULL;
  x = (x | x << 16) & 0x1f0000ff0000ffULL;
  x = (x | x << 8) & 0x100f00f00f00f00fULL;
  x = (x | x << 4) & 0x10c30c30c30c30c3ULL;
  return (x | x << 2) & 0x1249249249249249ULL;
}

/// Places along a Morton curve through a cube of 2^21 cells a side.
class Curve {
 public:
  explicit Curve(const Eigen::AlignedBox3d& box) : low_(box.min()) {
    const double extent = box.isEmpty() ? 0 : box.sizes().maxCoeff();
    if (extent > 0) scale_ = ((1 << 21) - 1) / extent;
  }
  std::uint64_t operator()(const Eigen::Vector3d& p) const {
    const auto cell = [&](Eigen::Index axis) {
      return static_cast<std::uint64_t>((p[axis] - low_[axis]) * scale_);
    };
    return spread(cell(0)) | spread(cell(1)) << 1 | spread(cell(2)) << 2;
  }

 private:
  Eigen::Vector3d low_;
  double scale_ = 1;
};

using Quad = std::array<std::int32_t, 4>;

/// The same tet with its lowest node first and the others in one of three orders: the turn is kept.
Quad turned(Quad t) {
  std::size_t first = static_cast<std::size_t>(std::min_element(t.begin(), t.end()) - t.begin());
  if (first != 0) {  // two swaps: an even permutation
    std::swap(t[0], t[first]);
    std::swap(t[first == 1 ? 2 : 1], t[first == 3 ? 2 : 3]);
  }
  while (t[1] > t[2] || t[1] > t[3]) std::rotate(t.begin() + 1, t.begin() + 2, t.end());
  return t;
}

constexpr int kBucketBits = 18;  // of the 63 of a place: neighbourhoods of some hundred tets in large meshes
constexpr std::size_t kGrain = 1 << 14;

/// The numbers of all items in the order of their places; `before(a, b)` orders those of equal place. Sorted
/// in buckets of the curve, side by side.
template <class Before>
std::vector<std::int32_t> along_curve(const std::vector<std::uint64_t>& places, const Before& before) {
  struct Item {
    std::uint64_t place;
    std::int32_t number;
  };
  const auto bucket = [](std::uint64_t place) {
    return static_cast<std::size_t>(place >> (63 - kBucketBits));
  };
  std::vector<std::size_t> first((std::size_t{1} << kBucketBits) + 1, 0);
  for (const std::uint64_t place : places) ++first[bucket(place) + 1];
  std::partial_sum(first.begin(), first.end(), first.begin());
  std::vector<Item> items(places.size());
  std::vector<std::size_t> next(first.begin(), first.end() - 1);
  for (std::size_t n = 0; n < places.size(); ++n)
    items[next[bucket(places[n])]++] = {places[n], static_cast<std::int32_t>(n)};
  tbb::parallel_for(std::size_t{0}, next.size(), [&](std::size_t b) {
    std::sort(items.begin() + static_cast<std::ptrdiff_t>(first[b]),
              items.begin() + static_cast<std::ptrdiff_t>(first[b + 1]), [&](const Item& x, const Item& y) {
                return x.place != y.place ? x.place < y.place : before(x.number, y.number);
              });
  });
  std::vector<std::int32_t> numbers(items.size());
  for (std::size_t n = 0; n < items.size(); ++n) numbers[n] = items[n].number;
  return numbers;
}

/// `body(row)` for all rows below `count`, side by side.
template <class Body>
void for_rows(std::size_t count, const Body& body) {
  tbb::parallel_for(tbb::blocked_range<std::size_t>(0, count, kGrain),
                    [&](const tbb::blocked_range<std::size_t>& rows) {
                      for (std::size_t row = rows.begin(); row < rows.end(); ++row)
                        body(static_cast<Eigen::Index>(row));
                    });
}

/// Sorts nodes along the curve, merges those of equal coordinates and drops those without a tet.
void renumber_nodes(TetMesh& mesh) {
  const auto n = static_cast<std::size_t>(mesh.V.rows());
  std::vector<std::uint8_t> marked(n, 0);
  for (Eigen::Index t = 0; t < mesh.T.rows(); ++t)
    for (Eigen::Index c = 0; c < 4; ++c) marked[static_cast<std::size_t>(mesh.T(t, c))] = 1;
  Eigen::AlignedBox3d box;
  std::vector<std::int32_t> used;
  for (std::size_t v = 0; v < n; ++v) {
    if (marked[v] == 0) continue;
    used.push_back(static_cast<std::int32_t>(v));
    box.extend(mesh.V.row(used.back()).transpose());
  }
  const Curve curve(box);
  std::vector<std::uint64_t> places(used.size());
  for_rows(used.size(), [&](Eigen::Index u) {
    const auto at = static_cast<std::size_t>(u);
    places[at] = curve(mesh.V.row(used[at]).transpose());
  });
  const auto point = [&](std::int32_t u) { return mesh.V.row(used[static_cast<std::size_t>(u)]); };
  const auto before = [&](std::int32_t a, std::int32_t b) {
    for (Eigen::Index axis = 0; axis < 3; ++axis)
      if (point(a)[axis] != point(b)[axis]) return point(a)[axis] < point(b)[axis];
    return false;
  };
  const std::vector<std::int32_t> order = along_curve(places, before);
  std::vector<std::int32_t> renamed(n, -1);
  Points V(static_cast<Eigen::Index>(order.size()), 3);
  std::int32_t count = 0;
  for (std::size_t i = 0; i < order.size(); ++i) {
    if (i == 0 || point(order[i - 1]) != point(order[i])) V.row(count++) = point(order[i]);
    renamed[static_cast<std::size_t>(used[static_cast<std::size_t>(order[i])])] = count - 1;
  }
  V.conservativeResize(count, 3);
  mesh.V.swap(V);
  for_rows(static_cast<std::size_t>(mesh.T.rows()), [&](Eigen::Index t) {
    for (Eigen::Index c = 0; c < 4; ++c) mesh.T(t, c) = renamed[static_cast<std::size_t>(mesh.T(t, c))];
  });
}

void sort_tets(TetMesh& mesh) {
  const auto n = static_cast<std::size_t>(mesh.T.rows());
  Eigen::AlignedBox3d box;  // every node is used
  for (Eigen::Index v = 0; v < mesh.V.rows(); ++v) box.extend(mesh.V.row(v).transpose());
  const Curve curve(box);
  std::vector<Quad> tets(n);
  std::vector<std::uint64_t> places(n);
  for_rows(n, [&](Eigen::Index row) {
    const auto t = static_cast<std::size_t>(row);
    const Quad q = turned({mesh.T(row, 0), mesh.T(row, 1), mesh.T(row, 2), mesh.T(row, 3)});
    const Eigen::Vector3d centre =
        0.25 * (mesh.V.row(q[0]) + mesh.V.row(q[1]) + mesh.V.row(q[2]) + mesh.V.row(q[3])).transpose();
    tets[t] = q;
    places[t] = curve(centre);
  });
  const std::vector<std::int32_t> order = along_curve(places, [&](std::int32_t a, std::int32_t b) {
    return tets[static_cast<std::size_t>(a)] < tets[static_cast<std::size_t>(b)];
  });
  std::vector<std::uint16_t> label(n);
  for_rows(n, [&](Eigen::Index row) {
    const auto from = static_cast<std::size_t>(order[static_cast<std::size_t>(row)]);
    for (std::size_t c = 0; c < 4; ++c) mesh.T(row, static_cast<Eigen::Index>(c)) = tets[from][c];
    label[static_cast<std::size_t>(row)] = mesh.label[from];
  });
  mesh.label.swap(label);
}

void check(const TetMesh& mesh) {
  if (static_cast<std::size_t>(mesh.T.rows()) != mesh.label.size())
    throw Error(ErrorKind::internal, "tets", "labels do not match tets",
                "this is a bug: report it with the case");
  if (mesh.T.size() > 0 && (mesh.T.minCoeff() < 0 || mesh.T.maxCoeff() >= mesh.V.rows()))
    throw Error(ErrorKind::internal, "tets", "a tet names a node that is not there",
                "this is a bug: report it with the case");
}

void check_volumes(const TetMesh& mesh) {
  const auto first_flat = tbb::parallel_reduce(
      tbb::blocked_range<Eigen::Index>(0, mesh.T.rows(), kGrain), mesh.T.rows(),
      [&](const tbb::blocked_range<Eigen::Index>& rows, Eigen::Index least) {
        for (Eigen::Index t = rows.begin(); t < std::min(rows.end(), least); ++t)
          if (!(tet_det(mesh.V.row(mesh.T(t, 0)), mesh.V.row(mesh.T(t, 1)), mesh.V.row(mesh.T(t, 2)),
                        mesh.V.row(mesh.T(t, 3))) > 0))
            least = t;
        return least;
      },
      [](Eigen::Index a, Eigen::Index b) { return std::min(a, b); });
  if (first_flat == mesh.T.rows()) return;
  const auto a = mesh.V.row(mesh.T(first_flat, 0));
  throw Error(ErrorKind::internal, "tets",
              "a tet near (" + std::to_string(a[0]) + ", " + std::to_string(a[1]) + ", " +
                  std::to_string(a[2]) + ") mm is flat or inverted in single precision",
              "choose another mesher or another voxel size, and report it");
}

}  // namespace

void canonicalize(TetMesh& mesh) {
  check(mesh);
  mesh.V = mesh.V.cast<float>().cast<double>().eval();
  renumber_nodes(mesh);
  sort_tets(mesh);
  check_volumes(mesh);
}

}  // namespace ecorche::tet
