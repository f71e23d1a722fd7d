// SPDX-License-Identifier: Apache-2.0
#include "preprocess/thin/tree.hpp"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <sstream>
#include <tuple>

namespace ecorche::thin {
namespace {

using Row = std::uint32_t;
constexpr Row kNobody = std::numeric_limits<Row>::max();

struct Edge {
  double weight = std::numeric_limits<double>::infinity();
  Row low = kNobody, high = kNobody;

  bool operator<(const Edge& other) const {
    return std::tie(weight, low, high) < std::tie(other.weight, other.low, other.high);
  }
};

// Skeletal voxels by the grid's rows, and the rows of the grid around one, the nearest first.
class Neighbourhood {
 public:
  explicit Neighbourhood(const VolumetricSkeleton& skeleton) : s_(skeleton) {
    const auto ny = static_cast<std::size_t>(s_.grid.size[1]), nz = static_cast<std::size_t>(s_.grid.size[2]);
    first_.assign(ny * nz + 1, 0);
    for (const auto& v : s_.voxel) ++first_[v[2] * ny + v[1] + 1];
    for (std::size_t r = 1; r < first_.size(); ++r) first_[r] += first_[r - 1];
  }
  void set_reach(int reach) {
    lines_.clear();
    const int most_j = std::min(reach, s_.grid.size[1] - 1), most_k = std::min(reach, s_.grid.size[2] - 1);
    for (int k = -most_k; k <= most_k; ++k) {
      for (int j = -most_j; j <= most_j; ++j) {
        const int square = j * j + k * k;
        if (square <= reach * reach)
          lines_.push_back({square, j, k, static_cast<int>(std::sqrt(reach * reach - square))});
      }
    }
    std::sort(lines_.begin(), lines_.end());
  }
  // Calls `f(row)` for every other voxel within reach; lines whose least step no longer counts are left out.
  template <class F, class Counts>
  void each(std::size_t at, Counts&& counts, F&& f) const {
    const auto& v = s_.voxel[at];
    for (const auto& [square, dj, dk, half] : lines_) {
      if (!counts(square)) return;
      const int j = v[1] + dj, k = v[2] + dk;
      if (j < 0 || k < 0 || j >= s_.grid.size[1] || k >= s_.grid.size[2]) continue;
      const std::size_t line = static_cast<std::size_t>(k) * static_cast<std::size_t>(s_.grid.size[1]) +
                               static_cast<std::size_t>(j);
      const auto end = s_.voxel.begin() + first_[line + 1];
      auto it = std::lower_bound(s_.voxel.begin() + first_[line], end, v[0] - half,
                                 [](const auto& u, int i) { return u[0] < i; });
      for (; it != end && (*it)[0] <= v[0] + half; ++it) {
        const auto row = static_cast<std::size_t>(it - s_.voxel.begin());
        if (row != at) f(row);
      }
    }
  }

 private:
  struct Line {
    int square, j, k, half;
    bool operator<(const Line& o) const { return std::tie(square, k, j) < std::tie(o.square, o.k, o.j); }
  };
  const VolumetricSkeleton& s_;
  std::vector<Row> first_;  // of each row of the grid
  std::vector<Line> lines_;
};

class Forest {
 public:
  Forest(const VolumetricSkeleton& skeleton, double alpha)
      : s_(skeleton),
        alpha_(alpha),
        around_(skeleton),
        component_(skeleton.size()),
        voxels_(skeleton.size(), 1) {
    for (std::size_t r = 0; r < component_.size(); ++r) component_[r] = static_cast<Row>(r);
    count_ = component_.size();
  }

  // Adds every edge of the minimum spanning forest over `reach`. Only components other than the largest look
  // for edges where `skip_largest`: each edge out of the largest is seen from its other end.
  void grow(int reach, bool skip_largest, const Context& context) {
    around_.set_reach(reach);
    std::vector<std::uint8_t> done(s_.size(), 0);  // nothing of another component within reach, for ever
    while (count_ > 1) {
      context.check_stop();
      const Row largest = skip_largest ? largest_component() : kNobody;
      const std::vector<Edge> best = look(largest, done);
      std::vector<Edge> of_component(s_.size());
      for (std::size_t r = 0; r < best.size(); ++r) {
        Edge& edge = of_component[component_[r]];
        if (best[r] < edge) edge = best[r];
      }
      bool grown = false;
      for (const Edge& edge : of_component) grown = (edge.low != kNobody && join(edge)) || grown;
      if (!grown) return;
      for (std::size_t r = 0; r < component_.size(); ++r) component_[r] = root(component_[r]);
    }
  }

  std::size_t count() const { return count_; }
  const std::vector<Edge>& edges() const { return edges_; }

 private:
  std::vector<Edge> look(Row largest, std::vector<std::uint8_t>& done) const {
    std::vector<Edge> best(s_.size());
    tbb::parallel_for(tbb::blocked_range<std::size_t>(0, s_.size(), 256), [&](const auto& range) {
      for (std::size_t r = range.begin(); r < range.end(); ++r) {
        if (done[r] != 0 || component_[r] == largest) continue;
        const auto counts = [&](int square) { return alpha_ * std::sqrt(square) <= best[r].weight; };
        around_.each(r, counts, [&](std::size_t other) {
          if (component_[other] == component_[r]) return;
          const Edge edge{edge_weight(s_, std::min(r, other), std::max(r, other), alpha_),
                          static_cast<Row>(std::min(r, other)), static_cast<Row>(std::max(r, other))};
          best[r] = std::min(best[r], edge);
        });
        if (best[r].low == kNobody) done[r] = 1;
      }
    });
    return best;
  }
  Row root(Row r) {
    while (component_[r] != r) r = component_[r] = component_[component_[r]];
    return r;
  }
  bool join(const Edge& edge) {
    const Row a = root(edge.low), b = root(edge.high);
    if (a == b) return false;  // both ends chose this edge
    component_[std::max(a, b)] = std::min(a, b);
    voxels_[std::min(a, b)] += voxels_[std::max(a, b)];
    edges_.push_back(edge);
    --count_;
    return true;
  }
  Row largest_component() const {
    Row largest = 0;
    for (std::size_t r = 0; r < component_.size(); ++r) {
      if (component_[r] == r && (component_[largest] != largest || voxels_[r] > voxels_[largest]))
        largest = static_cast<Row>(r);
    }
    return largest;
  }

  const VolumetricSkeleton& s_;
  double alpha_;
  Neighbourhood around_;
  std::vector<Row> component_;  // its first row; between joins a way up to it
  std::vector<Row> voxels_;     // of the component, at its first row
  std::vector<Edge> edges_;
  std::size_t count_;
};

// Hangs every tree on its deepest voxel.
std::vector<std::int32_t> hang(const VolumetricSkeleton& s, const std::vector<Edge>& edges) {
  std::vector<Row> first(s.size() + 1, 0), neighbour(2 * edges.size());
  for (const Edge& e : edges) ++first[e.low + 1], ++first[e.high + 1];
  for (std::size_t r = 1; r < first.size(); ++r) first[r] += first[r - 1];
  std::vector<Row> fill(first.begin(), first.end() - 1);
  for (const Edge& e : edges) neighbour[fill[e.low]++] = e.high, neighbour[fill[e.high]++] = e.low;

  std::vector<Row> by_depth(s.size());
  for (std::size_t r = 0; r < by_depth.size(); ++r) by_depth[r] = static_cast<Row>(r);
  std::stable_sort(by_depth.begin(), by_depth.end(),
                   [&](Row a, Row b) { return s.distance[a] > s.distance[b]; });
  constexpr std::int32_t unseen = -2;
  std::vector<std::int32_t> parent(s.size(), unseen);
  std::vector<Row> open;
  for (const Row top : by_depth) {
    if (parent[top] != unseen) continue;
    parent[top] = VolumetricSkeleton::none;
    open.assign(1, top);
    while (!open.empty()) {
      const Row r = open.back();
      open.pop_back();
      for (Row n = first[r]; n < first[r + 1]; ++n) {
        if (parent[neighbour[n]] != unseen) continue;
        parent[neighbour[n]] = static_cast<std::int32_t>(r);
        open.push_back(neighbour[n]);
      }
    }
  }
  return parent;
}

void check(const TreeOptions& o) {
  std::ostringstream what;
  if (!(o.alpha >= TreeOptions::least_alpha && o.alpha <= TreeOptions::most_alpha)) {
    what << o.alpha << " is not within " << TreeOptions::least_alpha << " to " << TreeOptions::most_alpha;
    throw Error(ErrorKind::usage, "--alpha", what.str(), "leave it out for 0.825");
  }
  if (o.reach < TreeOptions::least_reach || o.reach > TreeOptions::most_reach) {
    what << o.reach << " is not within " << TreeOptions::least_reach << " to " << TreeOptions::most_reach;
    throw Error(ErrorKind::usage, "--reach", what.str(), "leave it out for 3");
  }
}

}  // namespace

double length(DistanceMetric metric, std::uint32_t distance) {
  return metric == DistanceMetric::euclidean ? std::sqrt(static_cast<double>(distance)) : distance / 3.0;
}

double edge_weight(const VolumetricSkeleton& s, std::size_t a, std::size_t b, double alpha) {
  double square = 0;
  for (std::size_t c = 0; c < 3; ++c) {
    const double d = static_cast<double>(s.voxel[a][c]) - static_cast<double>(s.voxel[b][c]);
    square += d * d;
  }
  const double change = length(s.metric, s.distance[a]) - length(s.metric, s.distance[b]);
  return alpha * std::sqrt(square) + (1 - alpha) * std::abs(change);
}

std::vector<std::int32_t> spanning_tree(const VolumetricSkeleton& skeleton, const TreeOptions& options,
                                        const Context& context) {
  check(options);
  Forest forest(skeleton, options.alpha);
  forest.grow(options.reach, false, context);
  const auto& n = skeleton.grid.size;
  const int far = n[0] + n[1] + n[2];
  for (int reach = options.reach; options.connect && forest.count() > 1 && reach < far;) {
    reach = std::min(far, 2 * reach);
    forest.grow(reach, true, context);
  }
  context.report(1);
  return hang(skeleton, forest.edges());
}

std::size_t component_count(const std::vector<std::int32_t>& parent) {
  return static_cast<std::size_t>(std::count(parent.begin(), parent.end(), VolumetricSkeleton::none));
}

std::vector<std::int32_t> parents_first(const std::vector<std::int32_t>& parent) {
  // Children counted down from the leaves give children first.
  std::vector<std::int32_t> children(parent.size(), 0), order;
  for (const std::int32_t p : parent) {
    if (p >= 0) ++children[static_cast<std::size_t>(p)];
  }
  order.reserve(parent.size());
  for (std::size_t r = 0; r < parent.size(); ++r) {
    if (children[r] == 0) order.push_back(static_cast<std::int32_t>(r));
  }
  for (std::size_t at = 0; at < order.size(); ++at) {
    const std::int32_t p = parent[static_cast<std::size_t>(order[at])];
    if (p >= 0 && --children[static_cast<std::size_t>(p)] == 0) order.push_back(p);
  }
  std::reverse(order.begin(), order.end());
  return order;
}

}  // namespace ecorche::thin
