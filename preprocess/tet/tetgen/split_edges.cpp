// SPDX-License-Identifier: Apache-2.0
#include "preprocess/tet/tetgen/split_edges.hpp"

#include <algorithm>
#include <map>
#include <queue>
#include <tuple>
#include <utility>

namespace ecorche::tet {
namespace {

using Edge = std::pair<int, int>;  // lower vertex first

Edge edge(int a, int b) {
  return {std::min(a, b), std::max(a, b)};
}

class Splitter {
 public:
  explicit Splitter(Complex& complex) : complex_(complex) {
    for (std::size_t t = 0; t < complex_.triangles.size(); ++t) tie(t);
  }

  /// Halves the longest edge; false where none is longer than `longest`.
  bool split(double longest) {
    if (waiting_.empty() || std::get<0>(waiting_.top()) <= longest * longest) return false;
    const auto [squared, lower, upper] = waiting_.top();
    waiting_.pop();
    const Edge parent{-lower, -upper};
    const auto found = around_.find(parent);
    if (found == around_.end()) return true;  // its triangles were halved at another edge since
    const std::vector<std::size_t> triangles = std::move(found->second);
    around_.erase(found);
    const int middle = add_middle(parent);
    for (const std::size_t t : triangles) halve(t, parent, middle);
    return true;
  }

 private:
  std::array<double, 3> at(int v) const {
    const double* p = &complex_.points[3 * static_cast<std::size_t>(v)];
    return {p[0], p[1], p[2]};
  }

  int add_middle(const Edge& parent) {
    const auto a = at(parent.first), b = at(parent.second);
    for (std::size_t k = 0; k < 3; ++k) complex_.points.push_back(0.5 * (a[k] + b[k]));
    return static_cast<int>(complex_.vertices()) - 1;
  }

  void halve(std::size_t t, const Edge& parent, int middle) {
    untie(t, parent);
    std::array<int, 3> first = complex_.triangles[t], second = first;
    for (int& v : first) v = v == parent.second ? middle : v;
    for (int& v : second) v = v == parent.first ? middle : v;
    complex_.triangles[t] = first;
    complex_.triangles.push_back(second);
    tie(t);
    tie(complex_.triangles.size() - 1);
  }

  void tie(std::size_t t) {
    const std::array<int, 3>& v = complex_.triangles[t];
    for (std::size_t k = 0; k < 3; ++k) {
      const Edge e = edge(v[k], v[(k + 1) % 3]);
      std::vector<std::size_t>& triangles = around_[e];
      triangles.push_back(t);
      if (triangles.size() > 1) continue;
      const auto a = at(e.first), b = at(e.second);
      double squared = 0;
      for (std::size_t axis = 0; axis < 3; ++axis) squared += (b[axis] - a[axis]) * (b[axis] - a[axis]);
      waiting_.emplace(squared, -e.first, -e.second);
    }
  }

  void untie(std::size_t t, const Edge& but) {
    const std::array<int, 3>& v = complex_.triangles[t];
    for (std::size_t k = 0; k < 3; ++k) {
      const Edge e = edge(v[k], v[(k + 1) % 3]);
      if (e == but) continue;
      const auto found = around_.find(e);
      std::erase(found->second, t);
      if (found->second.empty()) around_.erase(found);
    }
  }

  Complex& complex_;
  std::map<Edge, std::vector<std::size_t>> around_;
  std::priority_queue<std::tuple<double, int, int>> waiting_;  // squared length, minus the vertices
};

}  // namespace

void split_long_edges(Complex& complex, double longest, std::size_t most) {
  Splitter splitter(complex);
  while (complex.vertices() < most && splitter.split(longest)) {
  }
}

}  // namespace ecorche::tet
