// SPDX-License-Identifier: Apache-2.0
#include "preprocess/thin/chamfer.hpp"

#include <algorithm>
#include <limits>
#include <vector>

namespace ecorche::thin {
namespace {

// Sums that would overflow are no better than what is there.
template <class T>
T plus(T value, unsigned step) {
  const unsigned sum = value + step;
  return static_cast<T>(std::min<unsigned>(sum, std::numeric_limits<T>::max()));
}

// One pass, in memory order or against it. `before(row)` are the rows that the pass has been through around
// a row: in this slice the one behind, in the slice behind all three.
template <class T>
class Pass {
 public:
  Pass(const Mask& mask, Field<T>& values, bool forward)
      : mask_(mask),
        values_(values),
        n_(mask.grid.size),
        forward_(forward),
        outside_(static_cast<std::size_t>(n_[0]) + 2, T{0}),
        rows_(4, outside_),
        best_(outside_) {}

  void run(const Context& context) {
    const int step = forward_ ? 1 : -1;
    const int first_k = forward_ ? 0 : n_[2] - 1, first_j = forward_ ? 0 : n_[1] - 1;
    for (int c = 0, k = first_k; c < n_[2]; ++c, k += step) {
      context.check_stop();
      for (int r = 0, j = first_j; r < n_[1]; ++r, j += step) row(j, k, step);
    }
  }

 private:
  std::size_t offset(int j, int k) const {
    return (static_cast<std::size_t>(k) * static_cast<std::size_t>(n_[1]) + static_cast<std::size_t>(j)) *
           static_cast<std::size_t>(n_[0]);
  }
  // A row with the background beyond both of its ends.
  const T* fetch(int j, int k, std::size_t slot) {
    if (j < 0 || k < 0 || j >= n_[1] || k >= n_[2]) return outside_.data();
    std::copy_n(values_.data() + offset(j, k), n_[0], rows_[slot].begin() + 1);
    return rows_[slot].data();
  }
  void row(int j, int k, int step) {
    const std::size_t begin = offset(j, k);
    const std::uint8_t* const inside = mask_.inside.data() + begin;
    T* const out = values_.data() + begin;
    const auto nx = static_cast<std::size_t>(n_[0]);
    const T* const same = fetch(j - step, k, 0);      // a face behind
    const T* const centre = fetch(j, k - step, 1);    // a face behind
    const T* const near = fetch(j - 1, k - step, 2);  // an edge behind
    const T* const far = fetch(j + 1, k - step, 3);
    for (std::size_t i = 0; i < nx; ++i) {
      const T faces = std::min(same[i + 1], centre[i + 1]);
      const T edges = std::min({same[i], same[i + 2], centre[i], centre[i + 2], near[i + 1], far[i + 1]});
      const T corners = std::min({near[i], near[i + 2], far[i], far[i + 2]});
      best_[i] = std::min({plus(faces, 3), plus(edges, 4), plus(corners, 5)});
    }
    const auto settle = [&](std::size_t i, T last) {
      T value = std::min(best_[i], plus(last, 3));
      if (!forward_) value = std::min(value, out[i]);
      return out[i] = inside[i] != 0 ? value : T{0};
    };
    T last = 0;  // the background beyond the row's end
    if (forward_) {
      for (std::size_t i = 0; i < nx; ++i) last = settle(i, last);
    } else {
      for (std::size_t i = nx; i-- > 0;) last = settle(i, last);
    }
  }

  const Mask& mask_;
  Field<T>& values_;
  std::array<std::int32_t, 3> n_;
  bool forward_;
  std::vector<T> outside_;
  std::vector<std::vector<T>> rows_;
  std::vector<T> best_;
};

}  // namespace

template <class T>
Field<T> chamfer(const Mask& mask, const Context& context) {
  Field<T> values(mask.grid.voxels());
  Pass<T>(mask, values, true).run(context);
  Pass<T>(mask, values, false).run(context);
  return values;
}

template Field<std::uint8_t> chamfer(const Mask&, const Context&);
template Field<std::uint16_t> chamfer(const Mask&, const Context&);

}  // namespace ecorche::thin
