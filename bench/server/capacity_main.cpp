// SPDX-License-Identifier: Apache-2.0
// How many clients a machine holds: bench_capacity ECORCHE MODEL.hdf [--rate 90] [--vertices 0] [--seconds 5]
// [--bound-ms 11] [--cores 16] [--clients 10000].
//
// Finds how many posing and how many watching clients fit until one frame in a hundred takes longer than the
// bound, or frames are left out; prints the law behind that; holds a simulation with the measured times of
// service against the measured points, of one and of two processes; and has it say how many machines of so
// many cores so many clients need.
#include <sys/resource.h>
#include <unistd.h>

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <functional>
#include <iterator>
#include <limits>
#include <map>
#include <memory>
#include <numeric>
#include <thread>
#include <utility>

#include <ecorche/values/error.hpp>
#include "bench/server/crowd.hpp"
#include "bench/server/fleet_model.hpp"
#include "bench/server/served.hpp"
#include "bench/server/walking.hpp"
#include "bench/table.hpp"

namespace ecorche::bench {
namespace {

constexpr double kWarmUp = 1;
constexpr double kIoUse = 0.5;
constexpr double kWhole = 0.95;  // of the poses must be shown
const std::vector<std::string> kRoomy{"--max-connections", "20000", "--max-sessions",     "20000",
                                      "--peer-share",      "1",     "--max-queued-bytes", "4000000000"};

struct Settings {
  std::string program, model;
  double rate = 90, seconds = 5, bound_ms = 11;
  std::size_t vertices = 0, fleet_clients = 10000;
  int fleet_cores = 16;
};

struct Load {
  std::size_t posers = 1, watchers = 0;  ///< the watchers all look at the first poser's session
  int processes = 1;
};

struct Measured {
  Load load;
  double p50 = 0, p99 = 0, shown = 0, cores = 0, server_ms = 0, clients_ms = 0, kilobytes = 0;
  std::size_t vertices = 0;
  std::vector<double> work = {};  ///< of workers, ms a frame
};

// One process and its clients, on a thread of their own.
struct Part {
  Part(const Settings& settings, std::size_t posers, std::size_t watchers, int threads)
      : served(settings.program, settings.model, options(threads)) {
    crowd = std::make_unique<Crowd>(served.address(), nullptr);
    for (std::size_t i = 0; i < posers; ++i)
      crowd->join({.vertices = settings.vertices, .session = i == 0 ? "first" : "", .rate = settings.rate});
    for (std::size_t i = 0; i < watchers; ++i)
      crowd->join({.vertices = settings.vertices, .session = "first", .rate = 0});
  }
  static std::vector<std::string> options(int threads) {
    std::vector<std::string> words = kRoomy;
    words.insert(words.end(), {"--threads", std::to_string(threads)});
    return words;
  }

  Served served;
  std::unique_ptr<Crowd> crowd;
};

int cores_here() {
  return static_cast<int>(sysconf(_SC_NPROCESSORS_ONLN));
}

Measured measure(const Settings& settings, const Load& load) {
  const auto n = static_cast<std::size_t>(load.processes);
  std::vector<std::unique_ptr<Part>> parts;
  parts.reserve(n);
  for (std::size_t p = 0; p < n; ++p)
    parts.push_back(std::make_unique<Part>(settings, (load.posers + n - 1 - p) / n,
                                           p == 0 ? load.watchers : 0, cores_here()));
  const auto run_all = [&](double seconds) {
    std::vector<std::thread> threads;
    threads.reserve(parts.size());
    for (const auto& part : parts) threads.emplace_back([&part, seconds] { part->crowd->run(seconds); });
    for (std::thread& thread : threads) thread.join();
  };
  run_all(kWarmUp);
  double server = 0;
  for (const auto& part : parts) {
    part->crowd->begin();
    server -= part->served.cpu_seconds();
  }
  const double clients = cpu_seconds();
  run_all(settings.seconds);
  Measured out{.load = load};
  Arrived all;
  double sent = 0, seen = 0;
  for (std::size_t p = 0; p < n; ++p) {
    server += parts[p]->served.cpu_seconds();
    const std::size_t posers = (load.posers + n - 1 - p) / n, watchers = p == 0 ? load.watchers : 0;
    for (std::size_t i = 0; i < posers + watchers; ++i) {
      const Arrived& one = parts[p]->crowd->arrived(i);
      if (!one.error.empty()) throw Error(ErrorKind::temporary, "bench", one.error, "see the server");
      all.add(one);
      const double due = settings.rate * parts[p]->crowd->seconds();
      sent += due;
      seen += std::min(due, static_cast<double>(one.frames));
    }
    out.vertices = parts[p]->crowd->vertices(0);
  }
  const double frames = std::max(1.0, static_cast<double>(all.frames));
  out.p50 = quantile(all.ms, 0.5);
  out.p99 = quantile(all.ms, 0.99);
  out.shown = seen / sent;
  out.cores = server / settings.seconds;
  out.server_ms = 1e3 * server / frames;
  out.clients_ms = 1e3 * (cpu_seconds() - clients) / frames;
  out.kilobytes = static_cast<double>(all.bytes) / 1e3 / frames;
  out.work.reserve(all.posed_ms.size());
  for (std::size_t i = 0; i < all.posed_ms.size(); ++i)
    out.work.push_back(all.posed_ms[i] + all.encoded_ms[i]);
  return out;
}

bool holds(const Settings& settings, const Measured& point) {
  return point.p99 <= settings.bound_ms && point.shown >= kWhole;
}

// The most clients that hold, to an eighth, by doubling twice and halving; `load_of`: that many of them.
// Every point is printed.
Measured find_most(const Settings& settings, const std::function<Load(std::size_t)>& load_of,
                   const std::function<void(const Measured&)>& show) {
  // Once more where it does not hold: what the machine does else is over by then.
  const auto at = [&](std::size_t count) {
    Measured point = measure(settings, load_of(count));
    if (!holds(settings, point)) point = measure(settings, load_of(count));
    show(point);
    return point;
  };
  Measured best = at(1);
  std::size_t good = 1, bad = 4;
  if (!holds(settings, best)) return best;
  for (;; bad *= 4) {
    Measured point = at(bad);
    if (!holds(settings, point)) break;
    good = bad;
    best = std::move(point);
  }
  while (bad - good > std::max<std::size_t>(1, good / 8)) {
    const std::size_t middle = (good + bad) / 2;
    Measured point = at(middle);
    if (holds(settings, point)) {
      good = middle;
      best = std::move(point);
    } else {
      bad = middle;
    }
  }
  return best;
}

double mean(const std::vector<double>& values) {
  return values.empty()
             ? 0
             : std::accumulate(values.begin(), values.end(), 0.0) / static_cast<double>(values.size());
}

// Processor of a frame at a load: what it costs by itself, and its part of what is done as often whatever the
// load: the more clients, the more frames a thread makes each time it wakes.
struct Cost {
  double own = 0, shared = 0;  // ms
  double of(double clients) const { return own + shared / clients; }
};

// Least squares of relative errors, over points of at least an eighth of `full` clients.
Cost cost_of(const std::vector<Measured>& points, std::size_t full, double Measured::*ms) {
  Eigen::Matrix2d squares = Eigen::Matrix2d::Zero();
  Eigen::Vector2d right = Eigen::Vector2d::Zero();
  double least = std::numeric_limits<double>::infinity();
  for (const Measured& point : points) {
    if (8 * point.load.posers < full || point.shown < kWhole) continue;
    const Eigen::Vector2d row = Eigen::Vector2d(1, 1 / static_cast<double>(point.load.posers)) / point.*ms;
    squares += row * row.transpose();
    right += row;
    least = std::min(least, point.*ms);
  }
  const Eigen::Vector2d found = squares.fullPivLu().solve(right);
  // One point alone, or noise: the same at every load.
  return found[0] > 0 && found[1] > 0 ? Cost{found[0], found[1]} : Cost{least, 0};
}

// What the simulation is told of this machine. Of a worker's times, of the fullest point that holds, the
// longest twentieth is left out: those waited for a core.
struct Machine {
  MachineLoad load;
  Cost server, client;

  MachineLoad with(std::size_t clients, int processes) const {
    MachineLoad out = load;
    out.clients = clients;
    out.processes = processes;
    const auto all = static_cast<double>(clients);
    out.io = std::max(0.005, server.of(all / processes) - mean(load.work));
    out.client = client.of(all);
    return out;
  }
};

Machine learn(const Settings& settings, const std::vector<Measured>& points, const Measured& full) {
  Machine out;
  out.load.cores = out.load.workers = cores_here();
  out.load.rate = settings.rate;
  out.load.seconds = settings.seconds;
  const double longest = quantile(full.work, 0.95);
  std::copy_if(full.work.begin(), full.work.end(), std::back_inserter(out.load.work),
               [&](double ms) { return ms <= longest; });
  out.server = cost_of(points, full.load.posers, &Measured::server_ms);
  out.client = cost_of(points, full.load.posers, &Measured::clients_ms);
  const MachineLoad there = out.with(full.load.posers, 1);
  out.load.fixed_ms = std::max(
      0.0, std::min(points.front().p50, full.p50) - quantile(there.work, 0.5) - there.io - there.client);
  return out;
}

void hold_against(const Settings& settings, const Machine& machine, std::size_t most) {
  const Table table({{"posing clients", 14},
                     {"processes"},
                     {"p50 ms"},
                     {"simulated"},
                     {"p99 ms"},
                     {"simulated"},
                     {"shown"},
                     {"simulated"},
                     {"cores, server"},
                     {"of all, simulated"}});
  for (const int processes : {1, 2}) {
    std::vector<std::size_t> counts{std::max<std::size_t>(2, most / 2), std::max<std::size_t>(2, most),
                                    most + std::max<std::size_t>(1, most / 2)};
    for (const std::size_t count : counts) {
      const Measured there = measure(settings, {.posers = count, .processes = processes});
      const Waited here = simulate(machine.with(count, processes));
      table.row({std::to_string(count), std::to_string(processes), fixed(there.p50, 2), fixed(here.p50, 2),
                 fixed(there.p99, 2), fixed(here.p99, 2), fixed(there.shown, 2), fixed(here.shown, 2),
                 fixed(there.cores, 2), fixed(here.cores, 2)});
    }
  }
}

// Sessions are dealt to servers by a hash of their names: one server has more than its part.
std::vector<std::size_t> dealt(std::size_t clients, std::size_t servers) {
  std::vector<std::size_t> of(servers, 0);
  for (std::size_t i = 0; i < clients; ++i)
    ++of[std::hash<std::string>()("session_" + std::to_string(i)) % servers];
  return of;
}

void plan_fleet(const Settings& settings, const Machine& machine) {
  const Table table({{std::to_string(settings.fleet_clients) + " clients, servers", 24},
                     {"cores each"},
                     {"processes each"},
                     {"fullest server's clients"},
                     {"its p50 ms"},
                     {"its p99 ms"},
                     {"its cores busy"},
                     {"shown"}});
  const double work = static_cast<double>(settings.fleet_clients) * settings.rate * machine.server.own / 1000;
  std::size_t before = 0;
  for (const double use : {1.0, 0.9, 0.8, 0.7, 0.6, 0.5, 0.4}) {
    const auto servers = static_cast<std::size_t>(std::ceil(work / (use * settings.fleet_cores)));
    if (std::exchange(before, servers) == servers) continue;
    const auto of = dealt(settings.fleet_clients, servers);
    const std::size_t fullest = *std::max_element(of.begin(), of.end());
    // One I/O thread is to be idle for half of its time.
    const double io =
        static_cast<double>(fullest) * settings.rate * (machine.server.own - mean(machine.load.work)) / 1000;
    const int processes = std::clamp(static_cast<int>(std::ceil(io / kIoUse)), 1, settings.fleet_cores);
    MachineLoad load = machine.with(fullest, processes);
    load.cores = settings.fleet_cores;
    load.workers = std::max(1, settings.fleet_cores / processes);
    load.client = 0;
    load.seconds = 3;
    const Waited waited = simulate(load);
    // The short work of I/O threads is let in beyond what the cores have: too few servers.
    if (waited.cores > settings.fleet_cores) continue;
    const bool any = waited.shown > 0;
    table.row({std::to_string(servers), std::to_string(settings.fleet_cores), std::to_string(processes),
               std::to_string(fullest), any ? fixed(waited.p50, 2) : "", any ? fixed(waited.p99, 2) : "",
               fixed(waited.cores, 1), fixed(waited.shown, 2)});
  }
}

/// False where not even one client holds.
bool run(const Settings& settings) {
  const Table table({{"clients", -28},
                     {"vertices", 8},
                     {"kB/frame", 8},
                     {"p50 ms"},
                     {"p99 ms"},
                     {"shown"},
                     {"cores"},
                     {"server ms/frame"},
                     {"clients ms/frame"},
                     {"holds", -5}});
  std::vector<Measured> points;  // of clients that pose, the first alone
  const auto show = [&](const Measured& point) {
    if (point.load.watchers == 0) points.push_back(point);
    std::string what = std::to_string(point.load.posers) + " posing";
    if (point.load.watchers > 0) what += ", " + std::to_string(point.load.watchers) + " watching";
    table.row({what, std::to_string(point.vertices), fixed(point.kilobytes, 1), fixed(point.p50, 2),
               fixed(point.p99, 2), fixed(point.shown, 2), fixed(point.cores, 2), fixed(point.server_ms, 3),
               fixed(point.clients_ms, 3), holds(settings, point) ? "yes" : "no"});
    std::fflush(stdout);
  };
  const Measured posing = find_most(
      settings, [](std::size_t count) { return Load{.posers = count}; }, show);
  if (!holds(settings, posing)) {
    std::printf(
        "\nOne posing client alone takes %.1f ms, one frame in a hundred, more than %.0f: there is no law (a "
        "smaller model, fewer --vertices, or a machine that does nothing else).\n",
        posing.p99, settings.bound_ms);
    return false;
  }
  const Measured watching = find_most(
      settings, [](std::size_t count) { return Load{.posers = 1, .watchers = count}; }, show);
  const double share = posing.cores / cores_here();
  std::printf(
      "\n%d cores, clients among them, hold %zu posing clients of %zu vertices at %.0f Hz, or one and %zu "
      "that watch it, until p99 passes %.0f ms.\n\n"
      "The law: posing clients = %.2f x cores / (%.0f Hz x %.5f s), each %.2f MB/s; the server has %.0f %% "
      "of the cores when it is full. One that watches costs\n"
      "%.5f s a frame.\n",
      cores_here(), posing.load.posers, posing.vertices, settings.rate, watching.load.watchers,
      settings.bound_ms, share, settings.rate, posing.server_ms / 1e3, posing.kilobytes * settings.rate / 1e3,
      100 * share, watching.server_ms / 1e3);
  const Machine machine = learn(settings, points, posing);
  std::printf(
      "\nA simulation beside measured points, with these times: work %.3f ms a frame; with it, I/O and all "
      "else %.3f ms and "
      "%.2f ms shared by a process' clients; the\nclients' own %.3f ms and %.2f ms shared; on the way %.2f "
      "ms.\n",
      mean(machine.load.work), machine.server.own, machine.server.shared, machine.client.own,
      machine.client.shared, machine.load.fixed_ms);
  hold_against(settings, machine, posing.load.posers);
  std::printf("\nThe same for a fleet, clients elsewhere, sessions dealt by hash:\n");
  plan_fleet(settings, machine);
  return true;
}

}  // namespace
}  // namespace ecorche::bench

int main(int argc, char** argv) {
  using namespace ecorche;
  bench::Settings settings;
  const std::vector<std::string> words(argv + 1, argv + argc);
  if (words.size() < 2) {
    std::fprintf(stderr,
                 "usage: bench_capacity ECORCHE MODEL.hdf [--rate 90] [--vertices 0] [--seconds 5] "
                 "[--bound-ms 11] [--cores 16] [--clients 10000]\n");
    return 64;
  }
  settings.program = words[0];
  settings.model = words[1];
  for (std::size_t i = 2; i + 1 < words.size(); i += 2) {
    const double number = std::atof(words[i + 1].c_str());
    if (words[i] == "--rate") settings.rate = number;
    if (words[i] == "--vertices") settings.vertices = static_cast<std::size_t>(number);
    if (words[i] == "--seconds") settings.seconds = number;
    if (words[i] == "--bound-ms") settings.bound_ms = number;
    if (words[i] == "--cores") settings.fleet_cores = static_cast<int>(number);
    if (words[i] == "--clients") settings.fleet_clients = static_cast<std::size_t>(number);
  }
  rlimit files{};
  getrlimit(RLIMIT_NOFILE, &files);
  files.rlim_cur = files.rlim_max;
  setrlimit(RLIMIT_NOFILE, &files);
  try {
    return bench::run(settings) ? 0 : 1;
  } catch (const Error& error) {
    std::fprintf(stderr, "%s\n", error.what());
    return exit_code(error.kind());
  }
}
