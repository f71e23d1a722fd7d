// SPDX-License-Identifier: Apache-2.0
// What a session's volumes show: the newest pose, as fast as they are made, beside the meshes of newer ones.
#pragma once

#include <functional>
#include <memory>
#include <stop_token>

#include "runtime/server/schedule/executor.hpp"
#include "runtime/server/session/frame_planner.hpp"
#include "runtime/server/session/job_pacer.hpp"
#include "runtime/server/session/job_reporter.hpp"

namespace ecorche::server {

/// Volumes have a job of their own, and planes of them another. On the I/O thread.
class VolumeJobs {
 public:
  /// `resume`: start() has something to do.
  VolumeJobs(net::io_context& io, Executor& executor, const MemoryBudget& memory, SubscriptionTable& table,
             FramePlanner& planner, double jobs_per_second, const std::function<void()>& resume);

  bool busy() const { return volumes_.pacer.busy() || planes_.pacer.busy(); }

  /// What a job begins with.
  struct Start {
    std::shared_ptr<JobListener> listener;               ///< kept until it is over
    std::function<std::shared_ptr<PoseJob>()> make_job;  ///< of the present pose
    std::shared_ptr<Account> account;
    Clock::time_point now;
    bool rests = false;  ///< nothing else is made
  };
  /// Begins what is due, and may begin now.
  void start(const Start& how);
  /// Jobs under way end early, and no more begin.
  void stop();
  /// Ends those early that nobody watches any more.
  void stop_unwatched();

 private:
  struct Kind {
    StreamKinds kinds;
    Service service;
    JobPacer pacer;
    std::stop_source stop{std::nostopstate};  ///< of the job
  };
  void start(Kind& kind, const Start& how);
  void submit(Kind& kind, Service service, const Start& how, std::shared_ptr<PoseJob> job);
  void done(Kind& kind, bool posed, const Status& status);

  net::io_context& io_;
  Executor& executor_;
  const MemoryBudget& memory_;
  SubscriptionTable& table_;
  FramePlanner& planner_;
  Kind volumes_, planes_;
  bool stopped_ = false;
};

}  // namespace ecorche::server
