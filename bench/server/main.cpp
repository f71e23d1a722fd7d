// SPDX-License-Identifier: Apache-2.0
// A server under load: bench_server ECORCHE MODEL.hdf [--seconds 30] [--soak-minutes 30] [--only ROW,...].
//
// Client and server share the machine. A latency is from a pose's sending to the arrival of its whole frame.
#include <sys/resource.h>

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <functional>
#include <random>
#include <set>
#include <sstream>

#include "bench/server/peers.hpp"
#include "bench/server/region.hpp"
#include "bench/server/served.hpp"
#include "bench/server/walker.hpp"
#include "core/values/error.hpp"

namespace ecorche::bench {
namespace {

struct Settings {
  std::string program, model;
  double seconds = 30, soak_minutes = 30;
  std::set<std::string> only;
};

constexpr double kWarmUp = 1;
const std::vector<std::string> kRoomy{"--max-connections", "4000", "--max-sessions", "200"};

void sleep_for(double seconds) {
  std::this_thread::sleep_for(std::chrono::duration<double>(seconds));
}

using Walkers = std::vector<std::unique_ptr<Walker>>;

void add(Walkers& walkers, const Served& served, const Asked& asked, int count, double warm_up = kWarmUp) {
  for (int i = 0; i < count; ++i)
    walkers.push_back(std::make_unique<Walker>(served.address(), asked, warm_up));
}

// All of them together; the slowest one's rate.
struct Sum {
  double p50 = 0, p99 = 0, slowest = 1e9, kilobytes = 0, decode_p50 = 0, posed_p50 = 0, encoded_p50 = 0;
  std::size_t vertices = 0;
  std::string error;
};

Sum finish(Walkers& walkers) {
  Sum sum;
  std::vector<double> ms, decode_ms, posed_ms, encoded_ms;
  for (const auto& walker : walkers) walker->finish();  // all stop before any is looked at
  for (const auto& walker : walkers) {
    const Arrived& arrived = walker->finish();
    if (!arrived.error.empty()) sum.error = arrived.error;
    ms.insert(ms.end(), arrived.ms.begin(), arrived.ms.end());
    decode_ms.insert(decode_ms.end(), arrived.decode_ms.begin(), arrived.decode_ms.end());
    posed_ms.insert(posed_ms.end(), arrived.posed_ms.begin(), arrived.posed_ms.end());
    encoded_ms.insert(encoded_ms.end(), arrived.encoded_ms.begin(), arrived.encoded_ms.end());
    sum.slowest = std::min(sum.slowest, arrived.per_second());
    sum.vertices = arrived.vertices;
    if (arrived.frames > 0)
      sum.kilobytes = static_cast<double>(arrived.bytes) / 1e3 / static_cast<double>(arrived.frames);
  }
  sum.p50 = quantile(ms, 0.5);
  sum.p99 = quantile(ms, 0.99);
  sum.decode_p50 = quantile(decode_ms, 0.5);
  sum.posed_p50 = quantile(posed_ms, 0.5);
  sum.encoded_p50 = quantile(encoded_ms, 0.5);
  return sum;
}

void print(const std::string& load, const Sum& sum, const Served& served, double cpu,
           const std::string& must) {
  std::printf("%-58s %8zu %9.1f %7.1f %8.2f %8.2f %7.0f %6.2f  %s\n", load.c_str(), sum.vertices,
              sum.kilobytes, sum.slowest, sum.p50, sum.p99, served.rss_mib(), cpu, must.c_str());
  std::printf("  in the server: posing p50 %.2f ms, encoding p50 %.2f ms\n", sum.posed_p50, sum.encoded_p50);
  if (!sum.error.empty()) std::printf("  ERROR: %s\n", sum.error.c_str());
  std::fflush(stdout);
}

Sum measure(const Settings& settings, const Served& served, const std::string& load, Walkers& walkers,
            const std::string& must) {
  sleep_for(kWarmUp);
  const double cpu = served.cpu_seconds();
  sleep_for(settings.seconds);
  const double used = (served.cpu_seconds() - cpu) / settings.seconds;
  const Sum sum = finish(walkers);
  print(load, sum, served, used, must);
  return sum;
}

void one_client(const Settings& settings, std::size_t vertices, v1::Encoding encoding,
                const std::string& name, const std::string& must) {
  const Served served(settings.program, settings.model, kRoomy);
  Walkers walkers;
  add(walkers, served,
      {.vertices = vertices,
       .encoding = encoding,
       .session = {},
       .rate = 90,
       .decode = encoding != v1::ENCODING_F32},
      1);
  const Sum sum = measure(settings, served, name, walkers, must);
  if (encoding != v1::ENCODING_F32) std::printf("  decoding in the client: p50 %.2f ms\n", sum.decode_p50);
}

void posers(const Settings& settings) {
  const Served served(settings.program, settings.model, kRoomy);
  Walkers walkers;
  add(walkers, served,
      {.vertices = 33'000, .encoding = v1::ENCODING_U16_DELTA, .session = {}, .rate = 90, .decode = false},
      64);
  measure(settings, served, "64 clients with their own poses, 33 k vertices, delta u16", walkers,
          "all at 90, p99 11");
}

void observers(const Settings& settings) {
  const Served served(settings.program, settings.model, kRoomy);
  Walkers walkers;
  Asked asked{.vertices = 100'000,
              .encoding = v1::ENCODING_U16_DELTA,
              .session = "shared",
              .rate = 90,
              .decode = false};
  add(walkers, served, asked, 1);
  sleep_for(0.3);
  asked.rate = 0;
  add(walkers, served, asked, 64);
  measure(settings, served, "64 observers of one pose, 100 k vertices, delta u16", walkers,
          "at least 90, encoded once");
}

// Whoever is served, alone and beside `others`.
void beside(const Settings& settings, const std::string& what,
            const std::function<std::unique_ptr<Peers>(const Served&)>& others, const std::string& must) {
  const Served served(settings.program, settings.model, kRoomy);
  const Asked asked{
      .vertices = 100'000, .encoding = v1::ENCODING_U16_DELTA, .session = {}, .rate = 90, .decode = false};
  Walkers alone;
  add(alone, served, asked, 4);
  measure(settings, served, "4 clients, 100 k vertices, alone", alone, "");
  Walkers together;
  add(together, served, asked, 4);
  const auto start = Clock::now();
  const std::unique_ptr<Peers> peers = others(served);
  double gone = -1, most = 0;
  std::thread watch([&] {
    while (gone < 0 && Clock::now() - start < std::chrono::seconds(static_cast<int>(settings.seconds) + 20)) {
      most = std::max(most, served.rss_mib());
      if (peers->gone()) gone = std::chrono::duration<double>(Clock::now() - start).count();
      sleep_for(0.05);
    }
  });
  measure(settings, served, "4 clients, 100 k vertices, beside " + what, together, must);
  watch.join();
  std::printf("  %s: gone after %.1f s, server's memory at most %.0f MiB\n", what.c_str(), gone, most);
}

// Clients that come and go, ten a second; some leave in the middle of a frame.
void soak(const Settings& settings) {
  const Served served(settings.program, settings.model, kRoomy);
  const Asked steady{.vertices = 100'000,
                     .encoding = v1::ENCODING_U16_DELTA,
                     .session = "steady",
                     .rate = 90,
                     .decode = true};
  Walkers walkers;
  add(walkers, served, steady, 1);
  std::mt19937 random(1);
  std::vector<std::pair<double, double>> memory;  // minutes, MiB
  std::uint64_t visits = 0, failures = 0;
  const double warm_up = std::min(2.0, settings.soak_minutes / 4);
  const auto start = Clock::now();
  const auto minutes = [&] { return std::chrono::duration<double>(Clock::now() - start).count() / 60; };
  std::size_t descriptors = served.descriptors(), most_descriptors = 0;
  std::vector<std::unique_ptr<Walker>> guests;
  while (minutes() < settings.soak_minutes) {
    const std::size_t sizes[] = {10'000, 33'000, 60'000};
    const v1::Encoding encodings[] = {v1::ENCODING_F32, v1::ENCODING_U16, v1::ENCODING_U16_DELTA};
    Asked guest{.vertices = sizes[random() % 3],
                .encoding = encodings[random() % 3],
                .session = {},
                .rate = 30,
                .decode = true};
    if (random() % 3 == 0)
      guest = {.vertices = 100'000,
               .encoding = v1::ENCODING_U16_DELTA,
               .session = "steady",
               .rate = 0,
               .decode = true};
    guests.push_back(std::make_unique<Walker>(served.address(), guest, 0));
    ++visits;
    sleep_for(0.1);
    if (guests.size() > 5) {
      if (!guests.front()->finish().error.empty()) ++failures;
      guests.erase(guests.begin());
    }
    most_descriptors = std::max(most_descriptors, served.descriptors());
    if (minutes() > warm_up && (memory.empty() || minutes() - memory.back().first > 0.05))
      memory.emplace_back(minutes(), served.rss_mib());
  }
  guests.clear();
  const Sum sum = finish(walkers);
  print("soak: 1 steady client; guests come and go, 10 a second", sum, served,
        served.cpu_seconds() / (60 * minutes()), "");
  sleep_for(1.5);
  // Least squares.
  double n = 0, sx = 0, sy = 0, sxx = 0, sxy = 0;
  for (const auto& [x, y] : memory) n += 1, sx += x, sy += y, sxx += x * x, sxy += x * y;
  const double slope = 60 * (n * sxy - sx * sy) / (n * sxx - sx * sx);
  std::printf(
      "  %llu guests, %llu failed; memory %.1f MiB, slope %.2f MiB an hour over %.1f min; descriptors %zu "
      "before, at most %zu, %zu after\n",
      static_cast<unsigned long long>(visits), static_cast<unsigned long long>(failures),
      memory.empty() ? 0 : memory.back().second, slope, settings.soak_minutes - warm_up, descriptors,
      most_descriptors, served.descriptors());
}

// Gagvani01's body lives at full resolution in a part of it.
void region(const Settings& settings) {
  for (const auto& [deformer, name] :
       {std::pair{v1::DEFORMER_SPHERES, "spheres"}, {v1::DEFORMER_TETS, "tets"}}) {
    const Served served(settings.program, settings.model);
    const RegionRate rate = region_rate(served, deformer, 256, settings.seconds);
    std::printf(
        "1 client, 256^3 voxels of the CT at full resolution, by %-8s %6.1f fps, p50 %.1f, p99 %.1f ms; "
        "posing p50 "
        "%.1f, refilling or drawing and encoding %.1f ms; %.0f ms of processor a frame; %.2f M voxels held; "
        "%.0f MiB%s\n",
        name, rate.per_second, rate.p50_ms, rate.p99_ms, rate.posed_ms, rate.encoded_ms, rate.cpu_ms,
        rate.held / 1e6, served.rss_mib(), deformer == v1::DEFORMER_SPHERES ? "  (must: 10 fps)" : "");
    std::fflush(stdout);
  }
}

int run(const Settings& settings) {
  rlimit files{};
  getrlimit(RLIMIT_NOFILE, &files);
  files.rlim_cur = files.rlim_max;
  setrlimit(RLIMIT_NOFILE, &files);
  std::printf("%-58s %8s %9s %7s %8s %8s %7s %6s  %s\n", "load", "vertices", "kB/frame", "fps", "p50 ms",
              "p99 ms", "MiB", "cores", "must");
  const auto chosen = [&](const char* row) { return settings.only.empty() || settings.only.contains(row); };
  if (chosen("body"))
    one_client(settings, 0, v1::ENCODING_U16_DELTA, "1 client, the whole body, delta u16, 90 Hz",
               "90 fps, p50 6, p99 11");
  if (chosen("f32"))
    one_client(settings, 0, v1::ENCODING_F32, "1 client, the whole body, float32, 90 Hz", "");
  if (chosen("organ"))
    one_client(settings, 100'000, v1::ENCODING_U16_DELTA, "1 client, 100 k vertices, delta u16",
               "p50 0.7, p99 3");
  if (chosen("posers")) posers(settings);
  if (chosen("observers")) observers(settings);
  if (chosen("stalled")) {
    beside(
        settings, "32 clients that stop reading",
        [](const Served& s) { return stalled_readers(s.address(), 32); }, "p99 within 20 %, gone in 10 s");
  }
  if (chosen("idle")) {
    beside(
        settings, "1000 idle connections",
        [](const Served& s) { return idle_connections(s.address(), 1000); }, "unaffected, gone by 5 s");
  }
  if (chosen("dripping")) {
    beside(
        settings, "1000 that send a byte a second",
        [](const Served& s) { return dripping_connections(s.address(), 1000); }, "unaffected, gone by 5 s");
  }
  if (chosen("region")) region(settings);
  if (chosen("soak")) soak(settings);
  return 0;
}

}  // namespace
}  // namespace ecorche::bench

int main(int argc, char** argv) {
  using namespace ecorche;
  bench::Settings settings;
  std::vector<std::string> words(argv + 1, argv + argc);
  for (std::size_t i = 2; i + 1 < words.size(); i += 2) {
    if (words[i] == "--seconds") settings.seconds = std::atof(words[i + 1].c_str());
    if (words[i] == "--soak-minutes") settings.soak_minutes = std::atof(words[i + 1].c_str());
    if (words[i] != "--only") continue;
    std::istringstream rows(words[i + 1]);
    for (std::string row; std::getline(rows, row, ',');) settings.only.insert(row);
  }
  if (words.size() < 2) {
    std::fprintf(stderr,
                 "usage: bench_server ECORCHE MODEL.hdf [--seconds 30] [--soak-minutes 30] [--only ROW,...]\n"
                 "rows: body f32 organ posers observers stalled idle dripping region soak\n");
    return 64;
  }
  settings.program = words[0];
  settings.model = words[1];
  try {
    return bench::run(settings);
  } catch (const Error& error) {
    std::fprintf(stderr, "error: %s\n", error.what());
    return 1;
  }
}
