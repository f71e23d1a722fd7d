// SPDX-License-Identifier: Apache-2.0
#include "runtime/quality/shared_joint.hpp"

#include <utility>

namespace ecorche::runtime {
namespace {

constexpr double kOneJointMm = 50;  // a kneecap's axis and the knee's are closer, the two hips farther apart

}  // namespace

bool share_joint(const Skeleton& skeleton, std::int32_t a, std::int32_t b) {
  const auto segment = [&](std::int32_t s) -> const Segment& {
    return skeleton.segments[static_cast<std::size_t>(s)];
  };
  const auto close = [&](std::int32_t one, std::int32_t other) {
    return (segment(one).joint.center - segment(other).joint.center).norm() < kOneJointMm;
  };
  if (a < b) std::swap(a, b);  // parents come first: `b` does not hang on `a`
  const std::int32_t over = segment(a).parent;
  if (over == b) return true;
  if (segment(over).parent == b) return close(a, over);
  return over == segment(b).parent && close(a, b);
}

}  // namespace ecorche::runtime
