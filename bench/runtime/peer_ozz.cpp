// SPDX-License-Identifier: Apache-2.0
#include <ozz/base/maths/simd_math.h>
#include <ozz/geometry/runtime/skinning_job.h>

#include <algorithm>

#include "bench/runtime/peers.hpp"

namespace ecorche::bench {
namespace {

constexpr std::size_t kInfluences = 4;

class Ozz final : public SkinningPeer {
 public:
  Ozz(const HungPoints& points, std::size_t copies) : matrices_(points.segments), bodies_(copies) {
    name = "ozz-animation";
#ifdef __AVX2__
    name += " for this CPU";
#endif
    name += ", " ECORCHE_OZZ_VERSION ", SkinningJob of 4 weights";
    Body body;
    body.rest = points.at;
    body.posed.resize(points.at.size());
    for (std::size_t p = 0; p < points.points(); ++p) {
      const std::size_t first = points.begin[p],
                        held = std::min<std::size_t>(kInfluences, points.begin[p + 1] - first);
      float sum = 0;
      for (std::size_t i = 0; i < held; ++i) sum += points.weight[first + i];
      for (std::size_t i = 0; i < kInfluences; ++i) {
        body.joints.push_back(points.segment[first + std::min(i, held - 1)]);
        // The last one is what is left of 1.
        if (i + 1 < kInfluences) body.weights.push_back(i < held ? points.weight[first + i] / sum : 0);
      }
    }
    std::fill(bodies_.begin(), bodies_.end(), body);
  }

  void pose(std::span<const Motion> motions) override {
    for (std::size_t s = 0; s < motions.size(); ++s) matrices_[s] = matrix(motions[s]);
    now_ = (now_ + 1) % bodies_.size();
    Body& body = bodies_[now_];
    ozz::geometry::SkinningJob job;
    job.vertex_count = static_cast<int>(body.rest.size() / 3);
    job.influences_count = static_cast<int>(kInfluences);
    job.joint_matrices = {matrices_.data(), matrices_.size()};
    job.joint_indices = {body.joints.data(), body.joints.size()};
    job.joint_indices_stride = kInfluences * sizeof(std::uint16_t);
    job.joint_weights = {body.weights.data(), body.weights.size()};
    job.joint_weights_stride = (kInfluences - 1) * sizeof(float);
    job.in_positions = {body.rest.data(), body.rest.size()};
    job.out_positions = {body.posed.data(), body.posed.size()};
    job.in_positions_stride = job.out_positions_stride = 3 * sizeof(float);
    if (!job.Run()) std::abort();
  }

  std::array<double, 3> at(std::size_t point) const override {
    const float* x = &bodies_[now_].posed[3 * point];
    return {x[0], x[1], x[2]};
  }

 private:
  struct Body {
    std::vector<float> rest, posed, weights;
    std::vector<std::uint16_t> joints;
  };

  static ozz::math::Float4x4 matrix(const Motion& motion) {
    const auto [w, x, y, z] = motion.turn;
    const auto column = [](double a, double b, double c, double d) {
      return ozz::math::simd_float4::Load(static_cast<float>(a), static_cast<float>(b), static_cast<float>(c),
                                          static_cast<float>(d));
    };
    return {{column(1 - 2 * (y * y + z * z), 2 * (x * y + w * z), 2 * (x * z - w * y), 0),
             column(2 * (x * y - w * z), 1 - 2 * (x * x + z * z), 2 * (y * z + w * x), 0),
             column(2 * (x * z + w * y), 2 * (y * z - w * x), 1 - 2 * (x * x + y * y), 0),
             column(motion.shift[0], motion.shift[1], motion.shift[2], 1)}};
  }

  std::vector<ozz::math::Float4x4> matrices_;
  std::vector<Body> bodies_;
  std::size_t now_ = 0;
};

}  // namespace

void ECORCHE_ADD_OZZ(const HungPoints& points, std::size_t copies, Peers& out) {
  out.push_back(std::make_unique<Ozz>(points, copies));
}

}  // namespace ecorche::bench
