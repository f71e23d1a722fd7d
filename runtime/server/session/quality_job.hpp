// SPDX-License-Identifier: Apache-2.0
// The quality of poses, measured beside the stream.
#pragma once

#include <memory>
#include <utility>
#include <vector>

#include <ecorche/runtime/pose_quality.hpp>
#include "runtime/server/net/asio.hpp"
#include "runtime/server/session/body_pool.hpp"
#include "runtime/server/session/pose_job.hpp"

namespace ecorche::server {

/// After a pose is judged, none is for so many times as long as that took of a processor: judging costs less
/// than a tenth of one, however many watch.
constexpr int kQualityPause = 10;

/// A pose to be judged, for every subscription of tissues.
struct QualityJob {
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
void run(QualityJob& job);

bool judged_by(const v1::PoseQuality& quality, const runtime::QualityThresholds& thresholds);

/// As far as the wire tells them.
runtime::QualityThresholds thresholds_of(const v1::PoseQuality& quality);

/// `pose`: the sequence number that was judged.
v1::PoseQuality describe(const runtime::PoseQuality& quality, const std::vector<std::uint32_t>& tissues,
                         std::uint64_t pose);

}  // namespace ecorche::server
