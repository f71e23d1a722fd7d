// SPDX-License-Identifier: Apache-2.0
#include "bench/server/fleet_model.hpp"

#include <algorithm>
#include <cmath>
#include <deque>
#include <optional>
#include <queue>
#include <random>

#include "bench/server/walking.hpp"

namespace ecorche::bench {
namespace {

constexpr double kUncounted = 1000;  // ms

class Machine {
 public:
  explicit Machine(const MachineLoad& load)
      : load_(load),
        random_(load.seed),
        sessions_(load.clients),
        processes_(static_cast<std::size_t>(load.processes)),
        slots_(static_cast<std::size_t>(load.cores)) {}

  Waited run() {
    const double period = 1000 / load_.rate, end = kUncounted + 1000 * load_.seconds;
    std::uniform_real_distribution<double> moment(0, period);
    for (std::size_t s = 0; s < sessions_.size(); ++s) push(moment(random_), Kind::pose, s);
    while (!events_.empty() && events_.top().at < end) {
      const Event event = events_.top();
      events_.pop();
      now_ = event.at;
      switch (event.kind) {
        case Kind::pose:
          push(now_ + period, Kind::pose, event.of);
          take_pose(event.of);
          break;
        case Kind::job:
          // Who was interrupted ends later: its event was put off.
          if (slots_[event.of].ends > now_)
            push(slots_[event.of].ends, Kind::job, event.of);
          else
            end_job(event.of);
          break;
        case Kind::sent:
          arrive(event.of);
          break;
      }
    }
    const double span = end - kUncounted;
    return {.p50 = quantile(waited_, 0.5) + load_.fixed_ms,
            .p99 = quantile(waited_, 0.99) + load_.fixed_ms,
            .shown = static_cast<double>(waited_.size()) / std::max<double>(1, static_cast<double>(poses_)),
            .cores = busy_ / span};
  }

 private:
  enum class Kind : std::uint8_t { pose, job, sent };
  struct Event {
    double at;
    Kind kind;
    std::size_t of;
    std::uint64_t order;
    bool operator<(const Event& other) const { return at != other.at ? at > other.at : order > other.order; }
  };
  struct Session {
    std::optional<double> slot;  // when its waiting pose was sent
    bool busy = false;
    std::deque<double> frames;  // of whose poses frames are on their way
  };
  struct Process {
    std::deque<std::size_t> ready;
    int working = 0;
    double io_free = 0;
  };
  struct Core {
    bool busy = false;
    std::size_t session = 0;
    double sent = 0, ends = 0;
  };

  std::size_t process_of(std::size_t session) const { return session % processes_.size(); }
  void push(double at, Kind kind, std::size_t of) { events_.push({at, kind, of, ++order_}); }

  void spend(double ms) {
    if (now_ >= kUncounted) busy_ += ms;
  }

  // Short work that is let in at once: it takes a core from a job, where none is idle.
  double interrupt(double& free_at, double ms) {
    const double begin = std::max(now_, free_at);
    free_at = begin + ms;
    spend(ms);
    if (std::all_of(slots_.begin(), slots_.end(), [](const Core& core) { return core.busy; }))
      slots_[std::uniform_int_distribution<std::size_t>(0, slots_.size() - 1)(random_)].ends += ms;
    return free_at;
  }

  void take_pose(std::size_t s) {
    if (now_ >= kUncounted) ++poses_;
    Session& session = sessions_[s];
    const bool waits = session.slot.has_value();
    session.slot = now_;
    if (session.busy || waits) return;
    processes_[process_of(s)].ready.push_back(s);
    start();
  }

  // Cores go to processes in turn, and within one to who has waited longest.
  void start() {
    for (std::size_t tries = 0; tries < processes_.size(); ++tries) {
      const auto idle =
          std::find_if(slots_.begin(), slots_.end(), [](const Core& core) { return !core.busy; });
      if (idle == slots_.end()) return;
      Process& process = processes_[(next_ + tries) % processes_.size()];
      if (process.ready.empty() || process.working >= load_.workers) continue;
      const std::size_t s = process.ready.front();
      process.ready.pop_front();
      ++process.working;
      const double ms =
          load_.work[std::uniform_int_distribution<std::size_t>(0, load_.work.size() - 1)(random_)];
      Session& session = sessions_[s];
      *idle = {.busy = true, .session = s, .sent = *session.slot, .ends = now_ + ms};
      session.slot.reset();
      session.busy = true;
      spend(ms);
      push(idle->ends, Kind::job, static_cast<std::size_t>(idle - slots_.begin()));
      next_ = (next_ + tries + 1) % processes_.size();
      tries = static_cast<std::size_t>(-1);  // from the beginning: another core may be idle
    }
  }

  void end_job(std::size_t core) {
    const std::size_t s = slots_[core].session;
    Process& process = processes_[process_of(s)];
    Session& session = sessions_[s];
    session.frames.push_back(slots_[core].sent);
    slots_[core].busy = false;
    --process.working;
    session.busy = false;
    if (session.slot) process.ready.push_back(s);
    start();
    push(interrupt(process.io_free, load_.io), Kind::sent, s);
  }

  void arrive(std::size_t s) {
    const double sent = sessions_[s].frames.front();
    sessions_[s].frames.pop_front();
    const double at = load_.client > 0 ? interrupt(client_free_, load_.client) : now_;
    if (sent >= kUncounted) waited_.push_back(at - sent);
  }

  const MachineLoad& load_;
  std::mt19937_64 random_;
  std::vector<Session> sessions_;
  std::vector<Process> processes_;
  std::vector<Core> slots_;
  std::priority_queue<Event> events_;
  std::vector<double> waited_;
  double now_ = 0, client_free_ = 0, busy_ = 0;
  std::uint64_t order_ = 0, poses_ = 0;
  std::size_t next_ = 0;
};

}  // namespace

Waited simulate(const MachineLoad& load) {
  return Machine(load).run();
}

}  // namespace ecorche::bench
