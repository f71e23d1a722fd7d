// SPDX-License-Identifier: Apache-2.0
#include "runtime/server/session/job_reporter.hpp"

#include <algorithm>

#include "runtime/server/schedule/post_back.hpp"

namespace ecorche::server {

JobReporter::JobReporter(net::io_context& io, std::shared_ptr<JobListener> listener,
                         std::shared_ptr<const Skipped> skipped, const PoseJob& job)
    : io_(io),
      listener_(std::move(listener)),
      skipped_(std::move(skipped)),
      shown_(std::make_shared<const ShownPose>(
          ShownPose{.request = job.request, .number = job.number, .volumes = job.volumes})),
      waits_(std::any_of(job.subscriptions.begin(), job.subscriptions.end(),
                         [](const Subscription& s) { return !s.streams.empty() && s.levels != 0; })) {}

void JobReporter::outcome(PoseOutcome outcome) {
  if (!skipped_) return;
  until_memory([&] { outcome_ = std::make_shared<const PoseOutcome>(std::move(outcome)); });
  if (!waits_ || !outcome_->status.ok()) report_outcome();
}

void JobReporter::probe(const std::shared_ptr<ProbeFrame>& frame) {
  report_outcome();
  post_back(io_, [listener = listener_, made = frame] { listener->probe_made(made); });
}

void JobReporter::frame(PosedFrame frame) {
  post_back(io_, [listener = listener_, outcome = std::exchange(outcome_, nullptr), skipped = skipped_,
                  shown = shown_, frame = std::move(frame)] {
    if (outcome) listener->pose_made(*outcome, *skipped, *shown);
    listener->frame_made(frame);
  });
}

void JobReporter::report_outcome() {
  if (!outcome_) return;
  post_back(io_, [listener = listener_, outcome = std::exchange(outcome_, nullptr), skipped = skipped_,
                  shown = shown_] { listener->pose_made(*outcome, *skipped, *shown); });
}

void JobReporter::end(Status status) {
  status_ = std::move(status);
  report_outcome();
}

}  // namespace ecorche::server
