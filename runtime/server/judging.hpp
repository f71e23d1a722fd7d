// SPDX-License-Identifier: Apache-2.0
// The quality of poses, measured beside the stream.
#pragma once

#include <deque>
#include <memory>
#include <utility>
#include <vector>

#include <ecorche/runtime/pose_quality.hpp>
#include "runtime/server/asio.hpp"
#include "runtime/server/body_pool.hpp"
#include "runtime/server/pose_job.hpp"
#include "runtime/server/workers.hpp"

namespace ecorche::server {

class Session;

/// Sessions take turns: one pose is judged at a time, and after it nothing for `pause` times as long as it
/// took of a processor, so that judging costs less than a tenth of one however many watch. It has a thread of
/// its own that gives way to whoever makes a frame. On the I/O thread.
class Judging {
 public:
  static constexpr int pause = 10;

  explicit Judging(net::io_context& io);

  /// The session has a pose that was not judged; its turn comes.
  void ask(const std::shared_ptr<Session>& session);
  /// Has the turn's work done; it must not throw.
  void submit(Job work) { aside_.submit(std::move(work)); }
  /// The turn took so much of a processor.
  void done(Clock::duration cost);
  /// No more turns.
  void stop();

 private:
  void next();

  net::steady_timer timer_;
  std::deque<std::weak_ptr<Session>> waiting_;
  bool busy_ = false;     ///< a turn is taken
  bool resting_ = false;  ///< the timer runs
  bool stopped_ = false;
  Workers aside_;
};

/// What one turn judges: the pose, for every subscription of tissues.
struct JudgeJob {
  struct Row {
    std::uint32_t subscription = 0;
    std::vector<std::uint32_t> tissues;
    std::shared_ptr<const v1::PoseQuality> quality;  ///< the result; null where it could not be measured
  };
  std::shared_ptr<const ServedModel> model;
  PoseRequest request;
  runtime::QualityThresholds thresholds;
  std::vector<Row> rows;
  Clock::duration cost{};  ///< the result's, of a processor
};

/// The pose with the body's root as it was scanned, all nodes and the positions of `tissues` (ascending);
/// null for a pose that is none. Throws bad_alloc.
BodyPool::Lease pose_still(const ServedModel& model, const PoseRequest& request,
                           const std::vector<std::uint32_t>& tissues);

/// Poses and measures, on the calling thread alone: the other cores are for frames. Throws nothing.
void run(JudgeJob& job);

bool judged_by(const v1::PoseQuality& quality, const runtime::QualityThresholds& thresholds);

/// As far as the wire tells them.
runtime::QualityThresholds thresholds_of(const v1::PoseQuality& quality);

/// `pose`: the sequence number that was judged.
v1::PoseQuality describe(const runtime::PoseQuality& quality, const std::vector<std::uint32_t>& tissues,
                         std::uint64_t pose);

}  // namespace ecorche::server
