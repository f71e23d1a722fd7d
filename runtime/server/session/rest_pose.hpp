// SPDX-License-Identifier: Apache-2.0
// What is known of a model's rest pose, in which most sessions begin: made once for all of them.
#pragma once

#include <deque>
#include <memory>
#include <mutex>
#include <utility>
#include <vector>

#include <ecorche/v1/envelope.pb.h>
#include <ecorche/runtime/pose_quality.hpp>
#include "runtime/server/resources/payload_pool.hpp"

namespace ecorche::server {

/// Of pose 0 of every session, which no client sends. Any number of threads may ask and tell. `tissues`: rows
/// of Model::tissues, ascending. What is told of tissues for which there is something already changes
/// nothing.
class RestPose {
 public:
  /// So many selections of tissues are remembered; the oldest goes.
  static constexpr std::size_t most = 16;

  using Quality = std::shared_ptr<const v1::PoseQuality>;
  /// By these thresholds; null where it is not known.
  Quality quality(const std::vector<std::uint32_t>& tissues,
                  const runtime::QualityThresholds& thresholds) const;
  void know(const std::vector<std::uint32_t>& tissues, Quality quality);

  /// For as long as some frame shows them; else null.
  std::shared_ptr<const Positions> positions(const std::vector<std::uint32_t>& tissues) const;
  void know(const std::vector<std::uint32_t>& tissues, const std::shared_ptr<const Positions>& positions);

 private:
  template <class What>
  using Rows = std::deque<std::pair<std::vector<std::uint32_t>, What>>;

  mutable std::mutex mutex_;
  Rows<Quality> qualities_;
  Rows<std::weak_ptr<const Positions>> positions_;
};

}  // namespace ecorche::server
