// SPDX-License-Identifier: Apache-2.0
// A server under load: bench_server ECORCHE MODEL.hdf [--seconds 30] [--soak-minutes 30] [--only ROW,...];
// the soak only where it is named.
//
// Client and server share the machine; all clients are one thread of this program, which holds some of the
// frames against offline posing. A latency is from a pose's sending to the arrival of its whole frame; p50
// and p99 are over the row's time. Rates are of the slowest client.
#include <sys/resource.h>

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <functional>
#include <memory>
#include <set>
#include <sstream>

#include <ecorche/model_file/model_file.hpp>
#include <ecorche/values/error.hpp>
#include "bench/server/attacks.hpp"
#include "bench/server/crowd.hpp"
#include "bench/server/deltas.hpp"
#include "bench/server/door.hpp"
#include "bench/server/peers.hpp"
#include "bench/server/ready.hpp"
#include "bench/server/region.hpp"
#include "bench/server/served.hpp"
#include "bench/server/soak.hpp"
#include "bench/server/walking.hpp"
#include "bench/server/watcher.hpp"
#include "bench/server/wire.hpp"
#include "bench/table.hpp"

namespace ecorche::bench {
namespace {

struct Settings {
  std::string program, model, peers;
  double seconds = 30, soak_minutes = 30;
  std::uint64_t check_each = 450;  // every 5 s of a client's frames, and its keyframes
  std::set<std::string> only;
  std::shared_ptr<const Model> truth;
};

constexpr double kWarmUp = 4;  // until the levels of detail are made
constexpr double kComing = 1;  // so long peers that have just come are counted by themselves
const std::vector<std::string> kRoomy{"--max-connections", "4000", "--max-sessions", "400"};

// All clients together; the slowest one's rate.
struct Sum {
  Arrived all;
  double slowest = 1e9;
  std::size_t vertices = 0;

  double p50() const { return quantile(all.ms, 0.5); }
  double p99() const { return quantile(all.ms, 0.99); }
};

Sum sum_of(const Crowd& crowd, std::size_t first, std::size_t end) {
  Sum sum;
  for (std::size_t i = first; i < end; ++i) {
    const Arrived& arrived = crowd.arrived(i);
    sum.all.add(arrived);
    sum.slowest = std::min(sum.slowest, static_cast<double>(arrived.frames) / crowd.seconds());
    sum.vertices = crowd.vertices(i);
  }
  return sum;
}

// The table of loads, and what is to be said below it.
struct Loads {
  const Table table{{{"load", 62},
                     {"vertices", 8},
                     {"kB/frame", 8},
                     {"fps"},
                     {"p50 ms"},
                     {"p99 ms"},
                     {"wanted", -24},
                     {"MiB"},
                     {"cores"},
                     {"poses/s"},
                     {"never seen"},
                     {"posing p50 ms"},
                     {"encoding p50 ms"},
                     {"quality's age, poses, p50"},
                     {"p99"},
                     {"without"},
                     {"held against offline"},
                     {"wrong"},
                     {"server ms/frame"},
                     {"clients ms/frame"}}};
  std::vector<std::string> notes;
};

struct Spent {
  double cores = 0, server_ms = 0, clients_ms = 0;  // of processor; the last two a frame
};

void add(Loads& loads, const std::string& load, const Sum& sum, const Served& served, const Spent& spent,
         double posed, const std::string& wanted) {
  const Arrived& all = sum.all;
  const double kilobytes =
      static_cast<double>(all.bytes) / 1e3 / std::max(1.0, static_cast<double>(all.frames));
  loads.table.row({load,
                   std::to_string(sum.vertices),
                   fixed(kilobytes, 1),
                   fixed(sum.slowest, 1),
                   fixed(sum.p50(), 2),
                   fixed(sum.p99(), 2),
                   wanted,
                   fixed(served.rss_mib(), 0),
                   fixed(spent.cores, 2),
                   fixed(posed, 1),
                   std::to_string(all.unseen),
                   fixed(quantile(all.posed_ms, 0.5), 2),
                   fixed(quantile(all.encoded_ms, 0.5), 2),
                   fixed(quantile(all.judged_ago, 0.5), 0),
                   fixed(quantile(all.judged_ago, 0.99), 0),
                   std::to_string(all.unjudged),
                   std::to_string(all.checked),
                   std::to_string(all.wrong),
                   fixed(spent.server_ms, 3),
                   fixed(spent.clients_ms, 3)});
  if (!all.error.empty()) loads.notes.push_back("ERROR: " + load + ": " + all.error);
  if (sum.slowest == 0) loads.notes.push_back("ERROR: " + load + ": a client had no frame");
}

// The clients [first, end) for the row's time, after a warm-up; warm already beside `peers`, as long as some
// of them are there.
Sum measure(const Settings& settings, Loads& loads, const Served& served, const std::string& load,
            Crowd& crowd, std::size_t first, std::size_t end, const std::string& wanted,
            const std::function<void()>& tick = {}, const Peers* peers = nullptr, double seconds = 0) {
  if (seconds == 0) seconds = settings.seconds;
  if (!peers) crowd.run(kWarmUp, tick);
  crowd.begin();
  const double server = served.cpu_seconds(), clients = cpu_seconds();
  do {
    crowd.run(peers ? 0.1 : seconds, tick);
  } while (peers && !peers->gone() && crowd.seconds() < seconds);
  const double spent[] = {served.cpu_seconds() - server, cpu_seconds() - clients};
  crowd.check();
  Sum sum = sum_of(crowd, first, end);
  const auto frames = static_cast<double>(sum_of(crowd, 0, end).all.frames);
  add(loads, load, sum, served,
      {spent[0] / crowd.seconds(), 1e3 * spent[0] / frames, 1e3 * spent[1] / frames}, crowd.posed(), wanted);
  return sum;
}

// `count` clients that each pose.
void posing(const Settings& settings, Loads& loads, const std::string& load, std::size_t vertices,
            v1::Encoding encoding, int count, const std::string& wanted) {
  const Served served(settings.program, settings.model, kRoomy);
  Crowd crowd(served.address(), settings.truth);
  const ClientOptions options{.vertices = vertices,
                              .encoding = encoding,
                              .session = {},
                              .rate = 90,
                              .check_each = settings.check_each};
  for (int i = 0; i < count; ++i) crowd.join(options);
  measure(settings, loads, served, load, crowd, 0, static_cast<std::size_t>(count), wanted);
}

void observers(const Settings& settings, Loads& loads) {
  const Served served(settings.program, settings.model, kRoomy);
  Crowd crowd(served.address(), settings.truth);
  ClientOptions options{.vertices = 100'000,
                        .encoding = v1::ENCODING_U16_DELTA,
                        .session = "shared",
                        .rate = 90,
                        .check_each = settings.check_each};
  crowd.join(options);
  crowd.run(0.3);
  options.rate = 0;
  for (int i = 0; i < 64; ++i) {
    // Keeping keyframes of all, which come at one moment, would take as long as serving them.
    options.check_each = i % 8 == 0 ? settings.check_each : 0;
    crowd.join(options);
  }
  measure(settings, loads, served, "64 observers of one pose, 100 k vertices, delta u16", crowd, 1, 65,
          "at least 90, encoded once");
}

// Whoever is served, alone and beside `others`, who come to the same server, and first to a door that does
// nothing for them but send `bytes`.
void beside(const Settings& settings, Loads& loads, const std::string& what,
            const std::function<std::unique_ptr<Peers>(const wire::Address&)>& others, std::size_t bytes,
            const std::string& wanted) {
  const Served served(settings.program, settings.model, kRoomy);
  Crowd crowd(served.address(), settings.truth);
  const ClientOptions options{.vertices = 100'000,
                              .encoding = v1::ENCODING_U16_DELTA,
                              .session = {},
                              .rate = 90,
                              .check_each = settings.check_each};
  for (int i = 0; i < 4; ++i) crowd.join(options);
  const Sum alone = measure(settings, loads, served, "4 clients, 100 k vertices, alone", crowd, 0, 4, "");
  {
    const Door door(bytes);
    const std::unique_ptr<Peers> elsewhere = others(door.address());
    measure(settings, loads, served, "4 clients, 100 k vertices, as they come elsewhere: " + what, crowd, 0,
            4, "", {}, elsewhere.get(), kComing);
  }
  const double before = served.rss_mib();
  const std::unique_ptr<Peers> peers = others(served.address());
  double most = 0;
  const auto look = [&] { most = std::max(most, served.rss_mib()); };
  Sum there = measure(settings, loads, served, "4 clients, 100 k vertices, as they come: " + what, crowd, 0,
                      4, "", look, peers.get(), kComing);
  there.all.add(measure(settings, loads, served, "4 clients, 100 k vertices, beside " + what, crowd, 0, 4,
                        wanted, look, peers.get())
                    .all);
  const double together = crowd.seconds();
  Sum row = there;
  const double left = settings.seconds - kComing - crowd.seconds();
  if (left > 0) {
    crowd.begin();
    crowd.run(left);
    row.all.add(sum_of(crowd, 0, 4).all);
  }
  loads.notes.push_back(what + ": " + (peers->gone() ? "all gone" : "NOT ALL GONE") + " after " +
                        fixed(peers->longest(), 2) +
                        " s at most, each from its own beginning, counted beside for " + fixed(together, 1) +
                        " s; server's memory " + fixed(before, 0) + " MiB before, " + fixed(most, 0) +
                        " at most; p99 of all frames while they came and were there " +
                        fixed(there.p99(), 2) + " ms, over " + fixed(settings.seconds, 0) +
                        " s from their coming " + fixed(row.p99(), 2) + ", alone " + fixed(alone.p99(), 2));
}

// One who poses, alone and beside somebody who watches a volume of the same session.
void volume(const Settings& settings, Loads& loads) {
  const Served served(settings.program, settings.model);
  Crowd crowd(served.address(), settings.truth);
  crowd.join({.vertices = 100'000,
              .encoding = v1::ENCODING_U16_DELTA,
              .session = "shared",
              .rate = 90,
              .on_the_spot = true,
              .check_each = settings.check_each});
  measure(settings, loads, served, "1 client, 100 k vertices, alone", crowd, 0, 1, "");
  v1::VolumeSelection whole, bricks;
  whole.set_compressed(true);
  bricks.set_changed_bricks(true);
  for (const auto& [what, selection] : {std::pair{std::string("a plane of the CT"), middle_plane(served)},
                                        {"the whole CT, its changed bricks", bricks},
                                        {"the whole CT, compressed", whole}}) {
    Watcher watcher(served, "shared", selection);
    measure(settings, loads, served, "1 client, 100 k vertices, beside " + what, crowd, 0, 1, "as alone");
    watcher.stop();
    const auto seen = static_cast<double>(watcher.frames());
    loads.notes.push_back(what + ": " + fixed(seen / (crowd.seconds() + kWarmUp), 1) +
                          " frames a second of " +
                          fixed(1e-6 * static_cast<double>(watcher.bytes()) / std::max(1.0, seen), 2) +
                          " MB" + (watcher.error().empty() ? "" : "; ERROR: " + watcher.error()));
  }
}

// Gagvani01's body lives at full resolution in a part of it.
void region(const Settings& settings) {
  const Table table({{"256^3 voxels of the CT at full resolution", 42},
                     {"fps"},
                     {"p50 ms"},
                     {"p99 ms"},
                     {"wanted", -7},
                     {"posing p50 ms"},
                     {"refilling or drawing, and encoding p50 ms"},
                     {"processor ms/frame"},
                     {"million voxels held"},
                     {"MiB"}});
  for (const auto& [deformer, name] :
       {std::pair{v1::DEFORMER_SPHERES, "spheres"}, {v1::DEFORMER_TETS, "tets"}}) {
    const Served served(settings.program, settings.model);
    const RegionRate rate = region_rate(served, deformer, 256, settings.seconds);
    table.row({std::string("1 client, by ") + name, fixed(rate.per_second, 1), fixed(rate.p50_ms, 1),
               fixed(rate.p99_ms, 1), deformer == v1::DEFORMER_SPHERES ? "10 fps" : "",
               fixed(rate.posed_ms, 1), fixed(rate.encoded_ms, 1), fixed(rate.cpu_ms, 0),
               fixed(rate.held / 1e6, 2), fixed(served.rss_mib(), 0)});
  }
}

std::size_t vertices_of(const Model& model) {
  std::size_t out = 0;
  for (const Tissue& tissue : model.tissues) out += static_cast<std::size_t>(tissue.V.rows());
  return out;
}

constexpr const char* kLoads[] = {"body",    "f32",  "organ",    "posers", "observers",
                                  "stalled", "idle", "dripping", "volume", "clients"};

void run_loads(const Settings& settings, Loads& loads, const std::function<bool(const char*)>& chosen) {
  if (chosen("body"))
    posing(settings, loads, "1 client, the whole body, delta u16, 90 Hz", 0, v1::ENCODING_U16_DELTA, 1,
           "90 fps, p50 6, p99 11");
  if (chosen("f32"))
    posing(settings, loads, "1 client, the whole body, float32, 90 Hz", 0, v1::ENCODING_F32, 1, "");
  if (chosen("organ"))
    posing(settings, loads, "1 client, 100 k vertices, delta u16", 100'000, v1::ENCODING_U16_DELTA, 1,
           "p50 0.7, p99 3");
  if (chosen("posers"))
    posing(settings, loads, "64 clients with their own poses, 33 k vertices, delta u16", 33'000,
           v1::ENCODING_U16_DELTA, 64, "all at 90, p99 11");
  if (chosen("clients")) {
    for (const int count : {1, 8, 64, 256})
      posing(settings, loads, std::to_string(count) + " posing for themselves, 33 k vertices, delta u16",
             33'000, v1::ENCODING_U16_DELTA, count, "");
  }
  if (chosen("observers")) observers(settings, loads);
  if (chosen("stalled")) {
    const std::size_t body = sizeof(float) * 3 * vertices_of(*settings.truth);
    beside(
        settings, loads, "32 clients that stop reading",
        [](const wire::Address& to) { return stalled_readers(to, 32); }, body,
        "p99 within 20 %, gone in 10 s");
  }
  if (chosen("idle")) {
    beside(
        settings, loads, "1000 idle connections",
        [](const wire::Address& to) { return idle_connections(to, 1000); }, 0, "unaffected, gone by 5 s");
  }
  if (chosen("dripping")) {
    beside(
        settings, loads, "1000 that send a byte a second",
        [](const wire::Address& to) { return dripping_connections(to, 1000); }, 0, "unaffected, gone by 5 s");
  }
  if (chosen("volume")) volume(settings, loads);
}

int run(const Settings& settings) {
  rlimit files{};
  getrlimit(RLIMIT_NOFILE, &files);
  files.rlim_cur = files.rlim_max;
  setrlimit(RLIMIT_NOFILE, &files);
  const auto chosen = [&](const char* row) { return settings.only.empty() || settings.only.contains(row); };
  if (chosen("ready")) ready(settings.program, settings.model);
  if (chosen("deltas")) deltas(settings.truth);
  if (std::any_of(std::begin(kLoads), std::end(kLoads), chosen)) {
    Loads all;
    run_loads(settings, all, chosen);
    print_notes(all.notes);
  }
  if (chosen("attacks")) attacks(settings.program, settings.model, settings.seconds);
  if (chosen("wire")) same_frame(settings.program, settings.model, settings.peers, settings.seconds);
  if (chosen("region")) region(settings);
  if (!settings.only.contains("soak")) return 0;  // half an hour: only by its name
  return soak(settings.program, settings.model, settings.truth, settings.soak_minutes) ? 0 : 1;
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
                 "rows: ready deltas body f32 organ posers observers stalled idle dripping attacks volume "
                 "wire region soak\n");
    return 64;
  }
  settings.program = words[0];
  settings.model = words[1];
  settings.peers = (std::filesystem::path(argv[0]).parent_path() / "bench_grpc").string();
  try {
    settings.truth = std::make_shared<const Model>(model_file::read(settings.model, Context{}));
    return bench::run(settings);
  } catch (const Error& error) {
    std::fprintf(stderr, "%s\n", error.what());
    return exit_code(error.kind());
  }
}
