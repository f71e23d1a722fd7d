// SPDX-License-Identifier: Apache-2.0
#include "bench/server/deltas.hpp"

#include <algorithm>
#include <chrono>
#include <cstdlib>
#include <span>
#include <vector>

#include <ecorche/runtime/body_poser.hpp>
#include "bench/server/walking.hpp"
#include "bench/table.hpp"
#include "proto/delta.hpp"

namespace ecorche::bench {
namespace {

using Clock = std::chrono::steady_clock;

constexpr double kSeconds = 0.25;  // of the walk, between keyframe and frame
constexpr int kRuns = 31;
constexpr std::size_t kInCaches =
    20 * wire::delta::block_vertices;  // 60 kB of keyframe, as much of the frame

// The numbers of every tissue, one behind another.
std::vector<std::uint16_t> body_at(const runtime::BodyPoser& poser, double seconds) {
  runtime::PosedBody body = poser.make_frame({.positions = false, .quantised = true});
  if (!poser.run(walking(poser.model().rig, seconds), runtime::Skinning::cor, poser.all_tissues(), body).ok())
    std::abort();  // a walk is a pose
  std::vector<std::uint16_t> all;
  for (const auto& tissue : body.quantised) all.insert(all.end(), tissue.begin(), tissue.end());
  return all;
}

// Milliseconds per million vertices, median; every run does its work `times` over.
template <class Work>
double median(std::size_t vertices, int times, Work&& work) {
  std::vector<double> ms;
  for (int run = 0; run < kRuns; ++run) {
    const auto start = Clock::now();
    for (int i = 0; i < times; ++i) work();
    ms.push_back(1e3 * std::chrono::duration<double>(Clock::now() - start).count() / times);
  }
  return 1e6 * quantile(ms, 0.5) / static_cast<double>(vertices);
}

void row(const Table& table, const char* what, std::span<const std::uint16_t> key,
         std::span<const std::uint16_t> now, int times) {
  const std::size_t vertices = key.size() / 3;
  wire::DeltaKey prepared(vertices);
  prepared.prepare(key, 0, prepared.blocks());
  std::vector<std::byte> bytes(wire::delta::most_bytes(prepared.blocks()));
  std::size_t size = 0;
  const double encode =
      median(vertices, times, [&] { size = prepared.encode(now, 0, prepared.blocks(), bytes).bytes; });
  std::vector<std::uint16_t> out(key.size());
  bool good = true;
  const double decode = median(vertices, times, [&] {
    good = wire::decode_delta(std::span(bytes).first(size), key, out).ok() && good;
  });
  good = good && std::equal(out.begin(), out.end(), now.begin());
  table.row({what, std::to_string(vertices), fixed(encode, 2), fixed(decode, 2),
             fixed(static_cast<double>(sizeof(float) * key.size()) / static_cast<double>(size), 1),
             good ? "0" : "WRONG"});
}

}  // namespace

void deltas(const std::shared_ptr<const Model>& model) {
  const runtime::BodyPoser poser(model);
  const std::vector<std::uint16_t> key = body_at(poser, 0), now = body_at(poser, kSeconds);
  const Table table({{"deltas, one thread", 20},
                     {"vertices", 8},
                     {"encoded, ms a million (wanted: 0.6)"},
                     {"decoded"},
                     {"times smaller than float32 (wanted: 5)"},
                     {"wrong"}});
  const std::size_t few = 3 * std::min(kInCaches, key.size() / 3);
  row(table, "in the caches", std::span(key).first(few), std::span(now).first(few), 50);
  row(table, "the whole body", key, now, 1);
}

}  // namespace ecorche::bench
