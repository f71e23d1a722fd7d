// SPDX-License-Identifier: Apache-2.0
#include "preprocess/parting/minimum_cut.hpp"

#include <boost/graph/adjacency_list.hpp>
#include <boost/graph/boykov_kolmogorov_max_flow.hpp>
#include <cmath>

namespace ecorche::parting {
namespace {

using Traits = boost::adjacency_list_traits<boost::vecS, boost::vecS, boost::directedS>;

struct EdgeFlow {
  std::int64_t capacity = 0, left = 0;
  Traits::edge_descriptor back = {};
};
struct VertexState {
  boost::default_color_type color = {};
  std::int64_t distance = 0;
  Traits::edge_descriptor predecessor = {};
};
using Graph = boost::adjacency_list<boost::vecS, boost::vecS, boost::directedS, VertexState, EdgeFlow>;

std::int64_t whole(double cost) {
  return std::llround(cost * 1024);
}

void join(Graph& graph, std::size_t a, std::size_t b, std::int64_t there, std::int64_t back) {
  const auto forth = boost::add_edge(a, b, EdgeFlow{there, 0, {}}, graph).first;
  const auto home = boost::add_edge(b, a, EdgeFlow{back, 0, {}}, graph).first;
  graph[forth].back = home;
  graph[home].back = forth;
}

}  // namespace

std::vector<std::uint8_t> CutGraph::inside() const {
  const std::size_t count = inner_.size(), source = count, sink = count + 1;
  Graph graph(count + 2);
  for (const Tie& tie : ties_) {
    const std::int64_t cost = whole(tie.cost);
    if (cost > 0) join(graph, static_cast<std::size_t>(tie.a), static_cast<std::size_t>(tie.b), cost, cost);
  }
  for (std::size_t v = 0; v < count; ++v) {
    if (const std::int64_t cost = whole(inner_[v]); cost > 0) join(graph, source, v, cost, 0);
    if (const std::int64_t cost = whole(outer_[v]); cost > 0) join(graph, v, sink, cost, 0);
  }
  boost::boykov_kolmogorov_max_flow(
      graph, boost::get(&EdgeFlow::capacity, graph), boost::get(&EdgeFlow::left, graph),
      boost::get(&EdgeFlow::back, graph), boost::get(&VertexState::predecessor, graph),
      boost::get(&VertexState::color, graph), boost::get(&VertexState::distance, graph),
      boost::get(boost::vertex_index, graph), source, sink);
  std::vector<std::uint8_t> out(count);
  for (std::size_t v = 0; v < count; ++v) out[v] = graph[v].color == boost::black_color;
  return out;
}

}  // namespace ecorche::parting
