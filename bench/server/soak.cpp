// SPDX-License-Identifier: Apache-2.0
#include "bench/server/soak.hpp"

#include <algorithm>
#include <cstdio>
#include <ctime>
#include <deque>
#include <random>
#include <vector>

#include "bench/server/crowd.hpp"
#include "bench/server/served.hpp"
#include "bench/server/walking.hpp"

namespace ecorche::bench {
namespace {

// MiB an hour of (minutes, MiB).
double slope_of(const std::vector<std::pair<double, double>>& memory) {
  double n = 0, sx = 0, sy = 0, sxx = 0, sxy = 0;
  for (const auto& [x, y] : memory) n += 1, sx += x, sy += y, sxx += x * x, sxy += x * y;
  return 60 * (n * sxy - sx * sy) / (n * sxx - sx * sx);
}

Asked guest_of(std::mt19937& random) {
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
        if (++failed <= 5) std::printf("  a client failed: %s\n", arrived.error.c_str());
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
      std::printf(
          "  %5.1f min: %.1f MiB, %zu descriptors, %llu guests; the one that stays: %.1f fps, p50 %.2f, p99 "
          "%.2f ms\n",
          said, served.rss_mib(), served.descriptors(), static_cast<unsigned long long>(visits),
          static_cast<double>(own.frames) / crowd.seconds(), quantile(own.ms, 0.5), quantile(own.ms, 0.99));
      std::fflush(stdout);
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
      memory.begin() + static_cast<std::ptrdiff_t>(memory.size() / 3), memory.end());
  std::printf(
      "soak of %.1f min: %llu guests, %llu failed; %llu frames, %llu held against offline posing, %llu "
      "wrong; memory %.1f MiB, "
      "slope %.2f MiB an hour over %.1f min, %.2f over the last two thirds (must: under 1 over 30 min); "
      "descriptors %zu before, %zu at "
      "most, %zu after; %.2f "
      "cores\n",
      minutes, static_cast<unsigned long long>(visits), static_cast<unsigned long long>(failed),
      static_cast<unsigned long long>(frames), static_cast<unsigned long long>(checked),
      static_cast<unsigned long long>(wrong), memory.empty() ? 0 : memory.back().second, slope_of(memory),
      minutes - warm_up, slope_of(later), before, most, after, served.cpu_seconds() / (60 * now_minutes()));
  return failed == 0 && wrong == 0 && checked > 0 && after <= before;
}

}  // namespace ecorche::bench
