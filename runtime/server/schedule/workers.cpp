// SPDX-License-Identifier: Apache-2.0
#include "runtime/server/schedule/workers.hpp"

#include <algorithm>
#include <chrono>
#include <utility>

#include "core/platform/thread_priority.hpp"

namespace ecorche::server {

Workers::Workers(int threads, std::function<void(const Job&)> within) : within_(std::move(within)) {
  for (int i = 0; i < threads; ++i) threads_.emplace_back([this] { work(); });
}

Workers::~Workers() {
  {
    const std::lock_guard lock(mutex_);
    stopping_ = true;
  }
  wake_.notify_all();
  for (std::thread& thread : threads_) thread.join();
}

void Workers::submit(Job job, std::shared_ptr<Account> by) {
  {
    const std::lock_guard lock(mutex_);
    if (by) by->at_least(least_);
    jobs_.push_back({std::move(job), std::move(by)});
  }
  wake_.notify_one();
}

void Workers::drain() {
  std::unique_lock lock(mutex_);
  idle_.wait(lock, [this] { return jobs_.empty() && running_ == 0; });
}

// There is one.
Workers::Waiting Workers::next() {
  const auto first = std::min_element(jobs_.begin(), jobs_.end(), [](const Waiting& a, const Waiting& b) {
    if (!a.by || !b.by) return !a.by && b.by;
    return a.by->used() < b.by->used();
  });
  Waiting taken = std::move(*first);
  jobs_.erase(first);
  if (taken.by) least_ = std::max(least_, taken.by->used());
  return taken;
}

void Workers::work() {
  while (true) {
    Waiting taken;
    {
      std::unique_lock lock(mutex_);
      wake_.wait(lock, [this] { return stopping_ || !jobs_.empty(); });
      if (jobs_.empty()) return;
      taken = next();
      ++running_;
    }
    const auto begun = std::chrono::steady_clock::now();
    within_(taken.job);
    if (taken.by)
      taken.by->use(std::chrono::duration<double>(std::chrono::steady_clock::now() - begun).count());
    taken = {};  // what it holds goes before anyone hears that it ended
    {
      const std::lock_guard lock(mutex_);
      --running_;
    }
    idle_.notify_all();
  }
}

// Not to the least: who waits for a lock of this thread's then waits for all others.
void giving_way(const Job& job) {
  thread_local const bool lowered = platform::set_thread_priority(platform::Priority::low);
  static_cast<void>(lowered);  // where it may not, it does not
  job();
}

namespace {

// To what wakes, a core that runs only such a thread is an idle one; with another priority it is not, and
// what wakes may wait for as long as a turn takes (3 ms).
void become_last() {
  thread_local const bool lowered = platform::set_thread_priority(platform::Priority::idle);
  static_cast<void>(lowered);
}

}  // namespace

void last_of_all(const Job& job) {
  become_last();
  job();
}

void LastInArena::on_scheduler_entry(bool /*worker*/) {
  become_last();
}

bool going_soon() {
  return platform::set_thread_priority(platform::Priority::prompt);
}

bool going_first() {
  return platform::set_thread_priority(platform::Priority::real_time);
}

}  // namespace ecorche::server
