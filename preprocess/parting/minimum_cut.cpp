// SPDX-License-Identifier: Apache-2.0
#include "preprocess/parting/minimum_cut.hpp"

#include <algorithm>
#include <boost/graph/boykov_kolmogorov_max_flow.hpp>
#include <boost/graph/compressed_sparse_row_graph.hpp>
#include <boost/iterator/counting_iterator.hpp>
#include <boost/iterator/transform_iterator.hpp>
#include <cmath>
#include <numeric>
#include <utility>

namespace ecorche::parting {
namespace {

// Numbers of vertices and arcs in 32 bits: an arc takes 12 bytes, a quarter of what it takes in an adjacency
// list.
using Graph = boost::compressed_sparse_row_graph<boost::directedS, boost::no_property, boost::no_property,
                                                 boost::no_property, std::uint32_t, std::uint32_t>;
using Vertex = boost::graph_traits<Graph>::vertex_descriptor;
using Arc = boost::graph_traits<Graph>::edge_descriptor;

// What an arc can still carry. Kept in 32 bits, told in 64, in which the flow is summed.
struct Left {
  using key_type = Arc;
  using value_type = std::int64_t;
  using reference = std::int64_t;
  using category = boost::read_write_property_map_tag;
  std::uint32_t* of;
};
std::int64_t get(const Left& left, const Arc& arc) {
  return left.of[arc.idx];
}
void put(const Left& left, const Arc& arc, std::int64_t value) {
  left.of[arc.idx] = static_cast<std::uint32_t>(value);
}

// The same arc the other way.
struct Back {
  using key_type = Arc;
  using value_type = Arc;
  using reference = Arc;
  using category = boost::readable_property_map_tag;
  const Graph* graph;
  const std::uint32_t* of;
};
Arc get(const Back& back, const Arc& arc) {
  return {target(arc, *back.graph), back.of[arc.idx]};
}

// Arcs as they were gathered: those of a vertex lie side by side.
struct Arcs {
  std::vector<Vertex> from, to;
  std::vector<std::uint32_t> left, back;

  explicit Arcs(std::size_t count) : from(count), to(count), left(count), back(count) {}
  void add(std::uint32_t here, Vertex a, Vertex b, std::uint32_t can_carry, std::uint32_t reverse) {
    from[here] = a;
    to[here] = b;
    left[here] = can_carry;
    back[here] = reverse;
  }
  Graph graph(Vertex vertices) const {
    const auto ends = [this](std::size_t arc) { return std::pair{from[arc], to[arc]}; };
    const auto arc = [&](std::size_t at) {
      return boost::make_transform_iterator(boost::counting_iterator(at), ends);
    };
    return {boost::edges_are_sorted, arc(0), arc(to.size()), vertices, static_cast<std::uint32_t>(to.size())};
  }
};

}  // namespace

std::uint32_t CutGraph::more(std::uint32_t than, double cost) {
  return static_cast<std::uint32_t>(std::min<std::int64_t>(than + std::llround(cost * 1024), kMost));
}

std::vector<std::uint8_t> CutGraph::inside() const {
  const std::size_t count = inner_.size();
  const auto source = static_cast<Vertex>(count), sink = static_cast<Vertex>(count + 1);
  // Calls what(from, to, there, back) for each pair of arcs.
  const auto each_pair = [&](const auto& what) {
    for (const Tie& tie : ties_)
      what(static_cast<Vertex>(tie.a), static_cast<Vertex>(tie.b), tie.cost, tie.cost);
    for (Vertex v = 0; v < count; ++v) {
      if (inner_[v] > 0) what(source, v, inner_[v], 0U);
      if (outer_[v] > 0) what(v, sink, outer_[v], 0U);
    }
  };
  std::vector<std::uint32_t> place(count + 3, 0);  // where the arcs of each vertex begin
  each_pair([&](Vertex from, Vertex to, std::uint32_t, std::uint32_t) {
    ++place[from + 1];
    ++place[to + 1];
  });
  std::partial_sum(place.begin(), place.end(), place.begin());
  Arcs arcs(place.back());
  each_pair([&](Vertex from, Vertex to, std::uint32_t there, std::uint32_t home) {
    const std::uint32_t forth = place[from]++, reverse = place[to]++;
    arcs.add(forth, from, to, there, reverse);
    arcs.add(reverse, to, from, home, forth);
  });
  const Graph graph = arcs.graph(sink + 1);
  arcs.from = {};
  arcs.to = {};

  std::vector<Arc> before(count + 2);
  std::vector<boost::default_color_type> colour(count + 2);
  std::vector<std::uint32_t> distance(count + 2);
  const Left left{arcs.left.data()};
  boost::boykov_kolmogorov_max_flow(graph, left, left, Back{&graph, arcs.back.data()}, before.data(),
                                    colour.data(), distance.data(), boost::get(boost::vertex_index, graph),
                                    source, sink);
  std::vector<std::uint8_t> out(count);
  for (std::size_t v = 0; v < count; ++v) out[v] = colour[v] == boost::black_color;
  return out;
}

}  // namespace ecorche::parting
