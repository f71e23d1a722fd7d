// SPDX-License-Identifier: Apache-2.0
// The threads that pose, so that the I/O thread never does.
#pragma once

#include <tbb/task_arena.h>
#include <tbb/task_scheduler_observer.h>

#include <atomic>
#include <condition_variable>
#include <deque>
#include <functional>
#include <memory>
#include <mutex>
#include <thread>
#include <utility>
#include <vector>

namespace ecorche::server {

using Job = std::function<void()>;

/// For whom jobs are done: whoever had less time of a thread comes first. A part, such as a client, of a
/// whole, such as all clients of its address: wholes have equal shares, and so have the parts of each.
class Account {
 public:
  explicit Account(std::shared_ptr<Account> of = nullptr) : of_(std::move(of)) {}

  /// Seconds, of itself and of what it is a part of.
  std::pair<double, double> used() const {
    const double own = used_.load(std::memory_order_relaxed);
    return {of_ ? of_->used_.load(std::memory_order_relaxed) : own, own};
  }
  void use(double seconds) {
    add(used_, seconds);
    if (of_) add(of_->used_, seconds);
  }
  /// Who comes, or comes again, has no more to get than those who stayed.
  void at_least(const std::pair<double, double>& used) {
    raise(used_, used.second);
    if (of_) raise(of_->used_, used.first);
  }

 private:
  static void add(std::atomic<double>& to, double seconds) {
    double was = to.load(std::memory_order_relaxed);
    while (!to.compare_exchange_weak(was, was + seconds, std::memory_order_relaxed)) {
    }
  }
  static void raise(std::atomic<double>& to, double least) {
    double was = to.load(std::memory_order_relaxed);
    while (was < least && !to.compare_exchange_weak(was, least, std::memory_order_relaxed)) {
    }
  }

  std::shared_ptr<Account> of_;
  std::atomic<double> used_ = 0;
};

/// Runs jobs `threads` at a time: first those without an account in the order they come, then those of the
/// account that had the least (start-time fair queueing, with the time that jobs took: Goyal et al. 1996). So
/// the first job of a newcomer waits for none of those who keep the threads busy, but for what has begun. The
/// hand-over is one mutex: what was written before submit() is seen by the job. The destructor finishes every
/// job submitted.
class Workers {
 public:
  /// `within` calls its argument, e.g. inside the app's TBB arena.
  Workers(int threads, std::function<void(const Job&)> within);
  ~Workers();
  Workers(const Workers&) = delete;
  Workers& operator=(const Workers&) = delete;

  std::size_t threads() const { return threads_.size(); }
  /// Jobs must not throw.
  void submit(Job job, std::shared_ptr<Account> by = nullptr);
  /// Waits until no job is queued or running.
  void drain();

 private:
  struct Waiting {
    Job job;
    std::shared_ptr<Account> by;
  };
  void work();
  Waiting next();

  std::function<void(const Job&)> within_;
  std::mutex mutex_;
  std::condition_variable wake_;
  std::condition_variable idle_;
  std::deque<Waiting> jobs_;
  std::pair<double, double> least_{};  ///< of the account whose job began last
  int running_ = 0;
  bool stopping_ = false;
  std::vector<std::thread> threads_;
};

/// Calls `job` on a thread that gives way to whoever makes a frame, from its first job on (on Linux;
/// elsewhere it does not). For Workers of their own.
void giving_way(const Job& job);

/// As giving_way, but runs only where a core would else be idle: a thread that wakes takes its core at once.
/// For what nobody waits for, and what takes no locks that others want for long.
void last_of_all(const Job& job);

/// From when it is made, every thread that enters the arena is as one of last_of_all, and stays so: what
/// wakes elsewhere, to answer or to ask, takes a core at once. Not beside what keeps all cores busy.
class LastInArena : public tbb::task_scheduler_observer {
 public:
  explicit LastInArena(tbb::task_arena& arena) : tbb::task_scheduler_observer(arena) { observe(true); }
  ~LastInArena() override { observe(false); }
  void on_scheduler_entry(bool worker) override;
};

/// The calling thread asks for short turns: where it wakes, what computes in longer ones gives way to it
/// (Linux 6.12 and later; elsewhere nothing changes). For a thread that sleeps most of the time.
bool going_soon();

/// The calling thread runs at once where it wakes, whatever else does (on Linux: SCHED_RR, priority 1;
/// threads that it starts do not inherit it). For a thread that sleeps most of the time. False where the
/// system does not let it, which asks for CAP_SYS_NICE or an RLIMIT_RTPRIO of 1.
bool going_first();

}  // namespace ecorche::server
