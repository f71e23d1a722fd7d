// SPDX-License-Identifier: Apache-2.0
#include "runtime/spheres/morph.hpp"

#include <tbb/enumerable_thread_specific.h>

#include <algorithm>
#include <cmath>

#include <ecorche/values/error.hpp>
#include "runtime/spheres/lookup.hpp"
#include "runtime/spheres/place_batch.hpp"
#include "runtime/spheres/places.hpp"
#include "runtime/volume/sampler.hpp"

namespace ecorche::runtime {
namespace {

// Centres in the object's own box, each axis from 0 to 1.
std::vector<Vec3> shares_of(const BallSet& set) {
  Vec3 low = set.balls.front().centre, high = low;
  for (const Ball& ball : set.balls) {
    for (std::size_t a = 0; a < 3; ++a) {
      low[a] = std::min(low[a], ball.centre[a]);
      high[a] = std::max(high[a], ball.centre[a]);
    }
  }
  std::vector<Vec3> out;
  for (const Ball& ball : set.balls) {
    Vec3 share{};
    for (std::size_t a = 0; a < 3; ++a)
      share[a] = high[a] > low[a] ? (ball.centre[a] - low[a]) / (high[a] - low[a]) : 0.5;
    out.push_back(share);
  }
  return out;
}

struct Pair {
  std::size_t from, to;
};

std::vector<Pair> pairs_of(const BallSet& from, const BallSet& to, double time) {
  const Places a(shares_of(from)), b(shares_of(to));
  std::vector<Pair> out;
  for (std::size_t i = 0; i < from.balls.size(); ++i) out.push_back({i, b.nearest(a[i])});
  for (std::size_t j = 0; j < to.balls.size(); ++j) out.push_back({a.nearest(b[j]), j});
  // Of two as near the lower row owns: in the order of the object that is nearer in time.
  std::sort(out.begin(), out.end(), [time](const Pair& p, const Pair& q) {
    return time < 0.5 ? std::pair(p.from, p.to) < std::pair(q.from, q.to)
                      : std::pair(p.to, p.from) < std::pair(q.to, q.from);
  });
  return out;
}

// The balls of `to` in the lattice of `from`.
BallSet in_lattice(const BallSet& to, const ImageGrid& lattice) {
  if (to.lattice == lattice) return to;
  BallSet out = to;
  const Affine move = to_index(lattice) * to_space(to.lattice);
  const double scale = to.lattice.spacing[0] / lattice.spacing[0];
  for (Ball& ball : out.balls) {
    const Eigen::Vector3d c = move * Eigen::Vector3d(ball.centre[0], ball.centre[1], ball.centre[2]);
    ball.centre = {c.x(), c.y(), c.z()};
    ball.radius2 *= scale * scale;
  }
  return out;
}

// What one object shows at an offset, in voxels of the shared lattice, from a ball's centre.
template <class T>
class Side {
 public:
  Side(const MorphSide& side, const BallSet& shared, double background)
      : set_(side.balls),
        shared_(shared),
        to_volume_(side.balls.lattice, side.volume.grid),
        own_((to_index(side.balls.lattice) * to_space(shared.lattice)).linear),
        same_(side.balls.lattice == shared.lattice),
        sampler_{side.volume.grid, side.volume.scalars<T>(), static_cast<std::size_t>(side.volume.components),
                 background} {}

  // Index of the volume.
  Vec3 place(std::size_t row, const Ball& shown, const Vec3& offset) const {
    Ball ball = set_.balls[row];
    Eigen::Vector3d way(offset[0], offset[1], offset[2]);
    if (!same_) way = own_ * way;
    // As for a bulge: shown larger than it is, a ball shows its rim beyond it.
    ball.radius2 = shown.radius2 > shared_.balls[row].radius2 ? 2 * ball.rest_radius2 : ball.rest_radius2;
    return to_volume_(rest_place(set_, ball, way[0], way[1], way[2]));
  }

  void at(std::size_t row, const Ball& shown, const Vec3& offset, bool nearest, T* out) const {
    const Vec3 p = place(row, shown, offset);
    nearest ? sampler_.nearest(p[0], p[1], p[2], out) : sampler_.trilinear(p[0], p[1], p[2], out);
  }

 private:
  const BallSet &set_, &shared_;  // in its own lattice and in the shared one
  ToVolume to_volume_;
  Eigen::Matrix3d own_;
  bool same_;
  Sampler<T> sampler_;
};

// One of the two alone, trilinearly, as refill() does.
template <class T>
void fill_end(const std::vector<Pair>& pairs, const BallSet& between, const LatticeBox& box,
              const Side<T>& side, std::size_t Pair::*row, const SampleJob& job, const Context& context) {
  tbb::enumerable_thread_specific<PlaceBatch> batches(sink_for(job, Sampling::trilinear));
  for_tiles(between, box, context, [&](const Tile& tile) {
    PlaceBatch& batch = batches.local();
    tile.for_owned([&](std::int32_t i, std::int32_t j, std::int32_t k, std::int32_t owner) {
      const Ball& shown = between.balls[static_cast<std::size_t>(owner)];
      const Vec3& c = shown.centre;
      const Vec3 offset{box.first[0] + i - c[0], box.first[1] + j - c[1], box.first[2] + k - c[2]};
      batch.add(job.posed.grid.offset(i, j, k),
                side.place(pairs[static_cast<std::size_t>(owner)].*row, shown, offset));
    });
  });
  for (PlaceBatch& batch : batches) batch.flush();
}

template <class T>
void fill(const std::vector<Pair>& pairs, const BallSet& between, const LatticeBox& box, const Side<T>& first,
          const Side<T>& second, double time, T empty, bool nearest, Image& out, const Context& context) {
  const auto components = static_cast<std::size_t>(out.components);
  const std::span<T> voxels = out.scalars<T>();
  std::fill(voxels.begin(), voxels.end(), empty);
  for_tiles(between, box, context, [&](const Tile& tile) {
    std::vector<T> one(components), two(components);
    tile.for_owned([&](std::int32_t i, std::int32_t j, std::int32_t k, std::int32_t owner) {
      const Pair& pair = pairs[static_cast<std::size_t>(owner)];
      const Ball& shown = between.balls[static_cast<std::size_t>(owner)];
      const Vec3& c = shown.centre;
      const Vec3 offset{box.first[0] + i - c[0], box.first[1] + j - c[1], box.first[2] + k - c[2]};
      std::fill(one.begin(), one.end(), empty);
      std::fill(two.begin(), two.end(), empty);
      if (!nearest || time < 0.5) first.at(pair.from, shown, offset, nearest, one.data());
      if (!nearest || time >= 0.5) second.at(pair.to, shown, offset, nearest, two.data());
      T* voxel = &voxels[components * out.grid.offset(i, j, k)];
      for (std::size_t n = 0; n < components; ++n) {
        voxel[n] =
            nearest
                ? (time < 0.5 ? one[n] : two[n])
                : to_scalar<T>((1 - time) * static_cast<double>(one[n]) + time * static_cast<double>(two[n]));
      }
    });
  });
}

void check(const MorphSide& from, const MorphSide& to, double time) {
  const auto bad = [](const char* what, const char* mend) {
    throw Error(ErrorKind::usage, "morph", what, mend);
  };
  if (!(time >= 0 && time <= 1)) bad("the time is not within 0 and 1", "choose one that is");
  if (from.volume.type != to.volume.type || from.volume.components != to.volume.components)
    bad("the volumes differ in the kind of their values", "convert one of them");
  if (from.balls.balls.empty() || to.balls.balls.empty())
    throw Error(ErrorKind::data, "morph", "a skeleton has no voxel", "thin at a lower TP");
}

}  // namespace

Image morph(const MorphSide& from, const MorphSide& to, double time, double background, Sampling sampling,
            const Context& context) {
  check(from, to, time);
  const BallSet target = in_lattice(to.balls, from.balls.lattice);
  const std::vector<Pair> pairs = pairs_of(from.balls, target, time);
  BallSet between;
  between.lattice = from.balls.lattice;
  between.back = {{1, 0, 0, 0, 1, 0, 0, 0, 1}};
  const auto blend = [time](double a, double b) {
    return time == 0 ? a : time == 1 ? b : (1 - time) * a + time * b;
  };
  for (const Pair& pair : pairs) {
    const Ball &a = from.balls.balls[pair.from], &b = target.balls[pair.to];
    Ball ball = a;
    for (std::size_t c = 0; c < 3; ++c) ball.centre[c] = blend(a.centre[c], b.centre[c]);
    const double radius = blend(std::sqrt(a.radius2), std::sqrt(b.radius2));
    ball.radius2 = time == 0 ? a.radius2 : time == 1 ? b.radius2 : radius * radius;
    ball.motion = 0;
    between.balls.push_back(ball);
  }
  const LatticeBox box = grown_box(between);
  Image out(grid_of(between.lattice, box), from.volume.type, from.volume.components);
  with_scalar_type(out.type, [&](auto zero) {
    using T = decltype(zero);
    const Side<T> first(from, from.balls, background), second(to, target, background);
    const bool nearest = sampling == Sampling::nearest, start = time == 0;
    if (nearest || (time > 0 && time < 1))
      return fill<T>(pairs, between, box, first, second, time, to_scalar<T>(background), nearest, out,
                     context);
    const std::span<T> voxels = out.scalars<T>();
    std::fill(voxels.begin(), voxels.end(), to_scalar<T>(background));
    fill_end(pairs, between, box, start ? first : second, start ? &Pair::from : &Pair::to,
             {start ? from.volume : to.volume, background, out}, context);
  });
  return out;
}

}  // namespace ecorche::runtime
