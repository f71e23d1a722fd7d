// SPDX-License-Identifier: Apache-2.0
#include <igl/dqs.h>
#include <igl/lbs_matrix.h>

#include <Eigen/Geometry>

#include "bench/runtime/peers.hpp"

namespace ecorche::bench {
namespace {

using Quaternions = std::vector<Eigen::Quaterniond, Eigen::aligned_allocator<Eigen::Quaterniond>>;

class Igl : public SkinningPeer {
 public:
  explicit Igl(const HungPoints& points)
      : V_(rows(points), 3), W_(Eigen::MatrixXd::Zero(rows(points), segments(points))) {
    for (std::size_t p = 0; p < points.points(); ++p) {
      const auto row = static_cast<Eigen::Index>(p);
      for (std::size_t c = 0; c < 3; ++c)
        V_(row, static_cast<Eigen::Index>(c)) = static_cast<double>(points.at[3 * p + c]);
      for (std::size_t e = points.begin[p]; e < points.begin[p + 1]; ++e)
        W_(row, points.segment[e]) += static_cast<double>(points.weight[e]);
    }
  }
  std::array<double, 3> at(std::size_t point) const override {
    const auto row = static_cast<Eigen::Index>(point);
    return {U_(row, 0), U_(row, 1), U_(row, 2)};
  }

 protected:
  static Eigen::Index rows(const HungPoints& points) { return static_cast<Eigen::Index>(points.points()); }
  static Eigen::Index segments(const HungPoints& points) {
    return static_cast<Eigen::Index>(points.segments);
  }
  static Eigen::Quaterniond turn(const Motion& m) { return {m.turn[0], m.turn[1], m.turn[2], m.turn[3]}; }

  Eigen::MatrixXd V_, W_, U_;
};

class Lbs final : public Igl {
 public:
  explicit Lbs(const HungPoints& points) : Igl(points), T_(4 * segments(points), 3) {
    name = "libigl " ECORCHE_LIBIGL_VERSION " lbs_matrix";
    igl::lbs_matrix(V_, W_, M_);
    W_.resize(0, 0);
  }
  void pose(std::span<const Motion> motions) override {
    for (std::size_t s = 0; s < motions.size(); ++s) {
      const auto row = static_cast<Eigen::Index>(4 * s);
      T_.block<3, 3>(row, 0) = turn(motions[s]).toRotationMatrix().transpose();
      T_.row(row + 3) = Eigen::Map<const Eigen::RowVector3d>(motions[s].shift.data());
    }
    U_.noalias() = M_ * T_;
  }

 private:
  Eigen::MatrixXd M_, T_;
};

class Dqs final : public Igl {
 public:
  Dqs(const HungPoints& points, std::size_t on)
      : Igl(points), turns_(points.segments), shifts_(points.segments) {
    name = "libigl " ECORCHE_LIBIGL_VERSION " dqs";
    dqs = true;
    threads = on;
  }
  void pose(std::span<const Motion> motions) override {
    for (std::size_t s = 0; s < motions.size(); ++s) {
      turns_[s] = turn(motions[s]);
      shifts_[s] = Eigen::Map<const Eigen::Vector3d>(motions[s].shift.data());
    }
    igl::dqs(V_, W_, turns_, shifts_, U_);
  }

 private:
  Quaternions turns_;
  std::vector<Eigen::Vector3d> shifts_;
};

}  // namespace

void add_igl(const HungPoints& points, Peers& out) {
  out.push_back(std::make_unique<Lbs>(points));
  out.push_back(std::make_unique<Dqs>(points, igl::default_num_threads()));
}

}  // namespace ecorche::bench
