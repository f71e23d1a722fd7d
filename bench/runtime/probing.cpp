// SPDX-License-Identifier: Apache-2.0
#include "bench/runtime/probing.hpp"

#include <random>
#include <vector>

#include <ecorche/runtime/probe.hpp>

namespace ecorche::bench {
namespace {

// In tets that are drawn at random, somewhere inside: in no order.
void draw_points(const Model& model, std::span<const float> nodes, std::size_t count,
                 std::vector<float>& rest, std::vector<float>& posed) {
  std::mt19937 random(7);
  std::uniform_int_distribution<std::size_t> which(0, model.tet_count() - 1);
  std::exponential_distribution<float> share(1);
  for (std::size_t i = 0; i < count; ++i) {
    const auto t = static_cast<Eigen::Index>(which(random));
    float b[4], sum = 0;
    for (float& x : b) sum += x = share(random);
    for (int a = 0; a < 3; ++a) {
      float before = 0, after = 0;
      for (int c = 0; c < 4; ++c) {
        before += b[c] / sum * model.nodes(model.tets(t, c), a);
        after +=
            b[c] / sum * nodes[3 * static_cast<std::size_t>(model.tets(t, c)) + static_cast<std::size_t>(a)];
      }
      rest.push_back(before);
      posed.push_back(after);
    }
  }
}

}  // namespace

void time_probe(const Table& table, const std::shared_ptr<const Model>& model, std::span<const float> nodes,
                int threads) {
  const runtime::Probe probe(model);
  std::vector<float> rest, posed;
  draw_points(*model, nodes, 10000, rest, posed);
  runtime::Probe::PosedTree tree;
  runtime::Probed out;
  runtime::ProbeOptions wants{.gradient = true};
  for (std::uint32_t v = 0; v < model->volumes.size(); ++v) wants.volumes.push_back({v});
  line(table, "probe: a new pose", threads, time(30, [&](int) { probe.follow(nodes, tree); }));
  line(table, "probe: a new pose and one point", threads, time(30, [&](int f) {
         probe.follow(nodes, tree);
         probe.posed_to_rest(tree, std::span(posed).subspan(3 * static_cast<std::size_t>(f), 3), wants, out);
       }));
  line(table, "probe: 10 000 points back, where they were", threads,
       time(30, [&](int) { probe.posed_to_rest(tree, posed, {}, out); }));
  line(table, "probe: 10 000 back, F and volumes", threads,
       time(30, [&](int) { probe.posed_to_rest(tree, posed, wants, out); }));
  line(table, "probe: new pose, 10 000 back, F and volumes", threads, time(30, [&](int) {
         probe.follow(nodes, tree);
         probe.posed_to_rest(tree, posed, wants, out);
       }));
  line(table, "probe: 10 000 points there, where they went", threads,
       time(30, [&](int) { probe.rest_to_posed(tree, rest, {}, out); }));
  wants.tissue = true;
  line(table, "probe: 10 000 back, F, volumes and tissues", threads,
       time(30, [&](int) { probe.posed_to_rest(tree, posed, wants, out); }));
  line(table, "probe: 10 000 points there, all of it", threads,
       time(30, [&](int) { probe.rest_to_posed(tree, rest, wants, out); }));
}

}  // namespace ecorche::bench
