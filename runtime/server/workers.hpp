// SPDX-License-Identifier: Apache-2.0
// The threads that pose, so that the I/O thread never does.
#pragma once

#include <condition_variable>
#include <deque>
#include <functional>
#include <mutex>
#include <thread>
#include <vector>

namespace ecorche::server {

using Job = std::function<void()>;

/// Runs jobs in the order they come, `threads` at a time. The hand-over is one mutex: what was written before
/// submit() is seen by the job. The destructor finishes every job submitted.
class Workers {
 public:
  /// `within` calls its argument, e.g. inside the app's TBB arena.
  Workers(int threads, std::function<void(const Job&)> within);
  ~Workers();
  Workers(const Workers&) = delete;
  Workers& operator=(const Workers&) = delete;

  std::size_t threads() const { return threads_.size(); }
  /// Jobs must not throw.
  void submit(Job job);
  /// Waits until no job is queued or running.
  void drain();

 private:
  void work();

  std::function<void(const Job&)> within_;
  std::mutex mutex_;
  std::condition_variable wake_;
  std::condition_variable idle_;
  std::deque<Job> jobs_;
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

/// The calling thread runs at once where it wakes, whatever else does (on Linux: SCHED_RR, priority 1;
/// threads that it starts do not inherit it). For a thread that sleeps most of the time. False where the
/// system does not let it, which asks for CAP_SYS_NICE or an RLIMIT_RTPRIO of 1.
bool going_first();

}  // namespace ecorche::server
