// SPDX-License-Identifier: Apache-2.0
// What a job on a worker tells the I/O thread.
#pragma once

#include <cstdint>
#include <memory>
#include <utility>

#include "runtime/server/net/asio.hpp"
#include "runtime/server/session/pose_job.hpp"
#include "runtime/server/session/pose_slot.hpp"

namespace ecorche::server {

/// Who hears of jobs, on the I/O thread.
class JobListener {
 public:
  virtual ~JobListener() = default;
  /// A new pose was made, or could not be.
  virtual void pose_made(const PoseOutcome& outcome, const Skipped& skipped, const ShownPose& shown) = 0;
  virtual void probe_made(const std::shared_ptr<ProbeFrame>& frame) = 0;
  virtual void frame_made(const PosedFrame& frame) = 0;
  virtual void volumes_made(const Status& status) = 0;
};

/// Reports of one pose job, from the worker to the listener, which it keeps. The outcome waits for the first
/// mesh: the I/O thread wakes once for both, and they leave in one write. Whoever lets go of it last must be
/// the I/O thread.
class JobReporter {
 public:
  /// `skipped`: before a new pose; null: the job shows the present one again, whose outcome is known.
  JobReporter(net::io_context& io, std::shared_ptr<JobListener> listener,
              std::shared_ptr<const Skipped> skipped, const PoseJob& job);

  /// PoseJob::on_outcome, on_probe and on_frame.
  void outcome(PoseOutcome outcome);
  void probe(const std::shared_ptr<ProbeFrame>& frame);
  void frame(PosedFrame frame);
  /// The job is over: of a pose without frames the outcome goes now.
  void end(Status status);
  /// Of the job, once it is over.
  const Status& status() const { return status_; }

 private:
  void report_outcome();

  net::io_context& io_;
  std::shared_ptr<JobListener> listener_;
  std::shared_ptr<const Skipped> skipped_;
  std::shared_ptr<const ShownPose> shown_;
  bool waits_;  // for a mesh
  std::shared_ptr<const PoseOutcome> outcome_;
  Status status_;
};

}  // namespace ecorche::server
