// SPDX-License-Identifier: Apache-2.0
#include "bench/server/soak.hpp"

#include <algorithm>
#include <ctime>
#include <deque>
#include <map>
#include <random>
#include <vector>

#include "bench/server/crowd.hpp"
#include "bench/server/served.hpp"
#include "bench/server/walking.hpp"
#include "bench/table.hpp"

namespace ecorche::bench {
namespace {

constexpr double kSteep = 1;  // MiB an hour
constexpr double kLong = 60;  // minutes: over less a slope says nothing

double median(std::vector<double> of) {
  const auto middle = of.begin() + static_cast<std::ptrdiff_t>(of.size() / 2);
  std::nth_element(of.begin(), middle, of.end());
  return *middle;
}

// MiB an hour of (minutes, MiB): the median of the slopes between the medians of every two minutes (Theil
// 1950, Sen 1968). A model that is read beside the one that is served lasts for a second, and tens of MiB: a
// fit of least squares goes by when that happened to be.
double slope_of(const std::vector<std::pair<double, double>>& memory) {
  std::map<int, std::vector<double>> minutes;
  for (const auto& [minute, mib] : memory) minutes[static_cast<int>(minute)].push_back(mib);
  std::vector<std::pair<int, double>> at;
  at.reserve(minutes.size());
  for (auto& [minute, mib] : minutes) at.emplace_back(minute, median(std::move(mib)));
  std::vector<double> slopes;
  for (std::size_t i = 0; i < at.size(); ++i)
    for (std::size_t j = i + 1; j < at.size(); ++j)
      slopes.push_back(60 * (at[j].second - at[i].second) / (at[j].first - at[i].first));
  return slopes.empty() ? 0 : median(std::move(slopes));
}

ClientOptions guest_of(std::mt19937& random) {
  if (random() % 3 == 0)
    return {.vertices = 100'000,
            .encoding = v1::ENCODING_U16_DELTA,
            .session = "steady",
            .rate = 0,
            .check_each = 16};
  constexpr std::size_t sizes[] = {10'000, 33'000, 60'000};
  constexpr v1::Encoding encodings[] = {v1::ENCODING_F32, v1::ENCODING_U16, v1::ENCODING_U16_DELTA};
  return {.vertices = sizes[random() % 3],
          .encoding = encodings[random() % 3],
          .session = {},
          .rate = 30,
          .check_each = 16};
}

struct Guest {
  std::size_t number;
  Clock::time_point goes;
};

}  // namespace

bool soak(const std::string& program, const std::string& model, const std::shared_ptr<const Model>& truth,
          double minutes) {
  // Unnamed sessions wait for their clients to come back: no longer than a guest's stay here.
  const Served served(program, model,
                      {"--max-connections", "4000", "--max-sessions", "200", "--linger-seconds", "5"});
  const Table table({{"minute", 8},
                     {"MiB"},
                     {"descriptors"},
                     {"guests"},
                     {"the one that stays: fps"},
                     {"p50 ms"},
                     {"p99 ms"}});
  std::vector<std::string> errors;
  std::mt19937 random(1);
  std::vector<std::pair<double, double>> memory;
  std::uint64_t visits = 0, frames = 0, checked = 0, wrong = 0, failed = 0;
  const double warm_up = std::min(2.0, minutes / 4);
  const auto start = Clock::now();
  const auto now_minutes = [&] { return std::chrono::duration<double>(Clock::now() - start).count() / 60; };
  const std::size_t before = served.descriptors();
  std::size_t most = 0;
  double said = 0;
  {
    Crowd crowd(served.address(), truth);
    crowd.join({.vertices = 100'000,
                .encoding = v1::ENCODING_U16_DELTA,
                .session = "steady",
                .rate = 90,
                .check_each = 90});
    std::deque<Guest> guests;
    const auto note = [&](std::size_t number) {
      const Arrived& arrived = crowd.arrived(number);
      frames += arrived.frames;
      checked += arrived.checked;
      wrong += arrived.wrong;
      if (!arrived.error.empty()) {
        if (++failed <= 5) errors.push_back("a client failed: " + arrived.error);
      }
      crowd.leave(number);
    };
    while (now_minutes() < minutes) {
      crowd.run(0.1, [] {});
      crowd.check();
      const auto now = Clock::now();
      guests.push_back(
          {crowd.join(guest_of(random)), now + std::chrono::milliseconds(500 + random() % 1500)});
      ++visits;
      for (auto guest = guests.begin(); guest != guests.end();) {
        if (guest->goes > now) {
          ++guest;
          continue;
        }
        note(guest->number);
        guest = guests.erase(guest);
      }
      most = std::max(most, served.descriptors());
      if (now_minutes() > warm_up && (memory.empty() || now_minutes() - memory.back().first > 0.05))
        memory.emplace_back(now_minutes(), served.rss_mib());
      if (now_minutes() - said < 1) continue;
      said = now_minutes();
      const Arrived& own = crowd.arrived(0);
      table.row({fixed(said, 1), fixed(served.rss_mib(), 1), std::to_string(served.descriptors()),
                 std::to_string(visits), fixed(static_cast<double>(own.frames) / crowd.seconds(), 1),
                 fixed(quantile(own.ms, 0.5), 2), fixed(quantile(own.ms, 0.99), 2)});
      frames += own.frames;
      checked += own.checked;
      wrong += own.wrong;
      crowd.begin();
    }
    for (const Guest& guest : guests) note(guest.number);
    note(0);
  }
  struct timespec pause {
    2, 0
  };
  nanosleep(&pause, nullptr);
  const std::size_t after = served.descriptors();
  const std::vector<std::pair<double, double>> later(
      memory.begin() + static_cast<std::ptrdiff_t>(memory.size() / 2), memory.end());
  const double slope = slope_of(later);
  const bool held_to = minutes >= 2 * kLong;
  if (!errors.empty()) print_notes(errors);
  const Table whole({{"soak of " + fixed(minutes, 1) + " minutes", 56}, {"here", 8}, {"wanted"}});
  whole.row({"guests", std::to_string(visits), ""});
  whole.row({"failed", std::to_string(failed), "0"});
  whole.row({"frames", std::to_string(frames), ""});
  whole.row({"held against offline posing", std::to_string(checked), ""});
  whole.row({"wrong", std::to_string(wrong), "0"});
  whole.row({"memory at the end, MiB", fixed(memory.empty() ? 0 : memory.back().second, 1), ""});
  whole.row({"its slope over " + fixed(minutes - warm_up, 1) + " minutes, MiB an hour",
             fixed(slope_of(memory), 2), ""});
  whole.row({"over the second half of them", fixed(slope, 2),
             held_to ? "below " + fixed(kSteep, 0) : "below 1, once it is an hour"});
  whole.row({"descriptors before", std::to_string(before), ""});
  whole.row({"at most", std::to_string(most), ""});
  whole.row({"after", std::to_string(after), "as before"});
  whole.row({"cores", fixed(served.cpu_seconds() / (60 * now_minutes()), 2), ""});
  return failed == 0 && wrong == 0 && checked > 0 && after <= before && (slope < kSteep || !held_to);
}

}  // namespace ecorche::bench
