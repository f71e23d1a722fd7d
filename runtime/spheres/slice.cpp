// SPDX-License-Identifier: Apache-2.0
#include "runtime/spheres/slice.hpp"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include <ecorche/values/error.hpp>
#include "runtime/spheres/fixed_ball.hpp"
#include "runtime/spheres/lookup.hpp"
#include "runtime/spheres/place_batch.hpp"

namespace ecorche::runtime {
namespace {

// Pixels along a block's edge, at first and at last: in between, blocks are halved.
constexpr std::int32_t kFirst = 64, kLast = 8;
constexpr double kSnap = 1e-9;
// Of distances in sixteenths of a voxel: what rounding may do to them.
constexpr double kMargin = 1e-3;

// A ball as a pixel sees it, in sixteenths of a voxel.
struct Seen {
  Vec3 centre;
  double limit, radius;
  std::int32_t row;
  bool bridge;
};

double distance(const Vec3& a, const Vec3& b) {
  return std::hypot(a[0] - b[0], a[1] - b[1], a[2] - b[2]);
}

// Index of the lattice of the pixel at (i, j); whole numbers where it lies on a voxel's centre.
class Plane {
 public:
  Plane(const ImageGrid& plane, const ImageGrid& lattice) : map_(to_index(lattice) * to_space(plane)) {}

  Vec3 operator()(double i, double j) const {
    const Eigen::Vector3d q = map_ * Eigen::Vector3d(i, j, 0);
    Vec3 out{q[0], q[1], q[2]};
    for (double& x : out) {
      if (std::abs(x - std::round(x)) < kSnap) x = std::round(x);
    }
    return out;
  }

 private:
  Affine map_;
};

Vec3 in_sixteenths(const Vec3& p) {
  return {16 * p[0], 16 * p[1], 16 * p[2]};
}

// Pixels from (i, j), `edge` each way or up to the plane's end.
struct Block {
  std::int32_t i, j, width, height;
};

template <class T>
class Slicer {
 public:
  Slicer(const BallSet& set, const Image& volume, double background, bool nearest, Image& out)
      : set_(set),
        plane_(out.grid, set.lattice),
        sampler_{volume.grid, volume.scalars<T>(), static_cast<std::size_t>(volume.components), background},
        to_volume_(set.lattice, volume.grid),
        nearest_(nearest),
        job_{volume, background, out},
        out_(out),
        pixels_(out.scalars<T>()) {
    std::fill(pixels_.begin(), pixels_.end(), to_scalar<T>(background));
    balls_.reserve(set.balls.size());
    for (std::size_t b = 0; b < set.balls.size(); ++b) {
      check(set.balls[b], b);
      const std::int32_t limit = limit_of(set.balls[b].radius2);
      if (limit <= 0) continue;
      Seen seen{{},
                static_cast<double>(limit),
                std::sqrt(static_cast<double>(limit)),
                static_cast<std::int32_t>(b),
                static_cast<std::int32_t>(b) >= set.bridges_from};
      for (std::size_t a = 0; a < 3; ++a)
        seen.centre[a] = static_cast<double>(sixteenths(set.balls[b].centre[a]));
      balls_.push_back(seen);
    }
  }

  void run(const Context& context) {
    const std::int32_t across = (out_.grid.size[0] + kFirst - 1) / kFirst,
                       down = (out_.grid.size[1] + kFirst - 1) / kFirst;
    tbb::parallel_for(0, across * down, [&](std::int32_t block) {
      if (context.stop.stop_requested()) return;
      halve(balls_, kFirst, kFirst * (block % across), kFirst * (block / across));
    });
    context.check_stop();
  }

 private:
  // Those of `balls` that may own a pixel of the block, in their order.
  std::vector<Seen> narrow(const std::vector<Seen>& balls, const Block& block) const {
    const Vec3 corner = in_sixteenths(plane_(block.i, block.j)),
               middle = in_sixteenths(
                   plane_(block.i + 0.5 * (block.width - 1), block.j + 0.5 * (block.height - 1)));
    const double half = distance(corner, middle) + kMargin;
    double bound = std::numeric_limits<double>::infinity();
    std::vector<Seen> out;
    for (const Seen& ball : balls) {
      const double far = distance(ball.centre, middle);
      if (far - half >= ball.radius) continue;
      out.push_back(ball);
      // It holds the whole block, so that an owner is no farther.
      if (far + half < ball.radius) bound = std::min(bound, far + half + behind(ball));
    }
    std::erase_if(
        out, [&](const Seen& ball) { return distance(ball.centre, middle) - half + behind(ball) > bound; });
    return out;
  }

  void halve(const std::vector<Seen>& balls, std::int32_t edge, std::int32_t i, std::int32_t j) {
    const Block block{i, j, std::min(edge, out_.grid.size[0] - i), std::min(edge, out_.grid.size[1] - j)};
    if (block.width < 1 || block.height < 1) return;
    const std::vector<Seen> near = narrow(balls, block);
    if (near.empty()) return;
    if (edge == kLast) return draw(near, block);
    for (int quarter = 0; quarter < 4; ++quarter)
      halve(near, edge / 2, i + edge / 2 * (quarter & 1), j + edge / 2 * (quarter >> 1));
  }

  // More than any distance, and any square of one: bridges own what is left.
  static double behind(const Seen& ball) { return ball.bridge ? 0x1p40 : 0; }

  // The first of the balls, in their order, that hold the place and are as near as any.
  static const Seen* owner_of(const std::vector<Seen>& balls, const Vec3& fixed) {
    const Seen* owner = nullptr;
    double least = std::numeric_limits<double>::infinity();
    for (const Seen& ball : balls) {
      double far2 = behind(ball);
      for (std::size_t a = 0; a < 3; ++a) far2 += (fixed[a] - ball.centre[a]) * (fixed[a] - ball.centre[a]);
      if (far2 < ball.limit + behind(ball) && far2 < least) {
        least = far2;
        owner = &ball;
      }
    }
    return owner;
  }

  void draw(const std::vector<Seen>& balls, const Block& block) {
    PlaceBatch batch(sink_for(job_, Sampling::trilinear));
    for (std::int32_t j = block.j; j < block.j + block.height; ++j) {
      for (std::int32_t i = block.i; i < block.i + block.width; ++i) {
        const Vec3 at = plane_(i, j);
        const Seen* owner = owner_of(balls, in_sixteenths(at));
        if (!owner) continue;
        const Ball& ball = set_.balls[static_cast<std::size_t>(owner->row)];
        const Vec3& c = ball.centre;
        const Vec3 rest = to_volume_(rest_place(set_, ball, at[0] - c[0], at[1] - c[1], at[2] - c[2]));
        const std::size_t offset = out_.grid.offset(i, j, 0);
        if (nearest_) {
          sampler_.nearest(rest[0], rest[1], rest[2], &pixels_[sampler_.components * offset]);
        } else {
          batch.add(offset, rest);
        }
      }
    }
    batch.flush();
  }

  const BallSet& set_;
  Plane plane_;
  Sampler<T> sampler_;
  ToVolume to_volume_;
  bool nearest_;
  SampleJob job_;
  Image& out_;
  std::span<T> pixels_;
  std::vector<Seen> balls_;
};

}  // namespace

void refill_slice(const BallSet& set, const Image& volume, double background, Sampling sampling, Image& out,
                  const Context& context) {
  if (out.grid.size[2] != 1 || out.type != volume.type || out.components != volume.components)
    throw Error(ErrorKind::internal, "refill", "the result is no plane of the volume", "this is a bug");
  with_scalar_type(volume.type, [&](auto zero) {
    Slicer<decltype(zero)>(set, volume, background, sampling == Sampling::nearest, out).run(context);
  });
}

}  // namespace ecorche::runtime
