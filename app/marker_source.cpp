// SPDX-License-Identifier: Apache-2.0
#include "app/marker_source.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <optional>

#include <ecorche/values/error.hpp>
#include "core/kinematics/marker_fit.hpp"
#include "io/case/motion_map.hpp"
#include "io/motion/table_file.hpp"

namespace ecorche::app {
namespace {

using Eigen::Vector3d;

constexpr double kWrongMarkerSize = 1.5;  // times the patient

class MarkerSource final : public MotionSource {
 public:
  MarkerSource(const Program& program, const MotionChoice& choice, const Rig& rig)
      : rig_(rig), file_(io::TextStream::open(choice.file), motion_space(choice)) {
    reference = "the scan";
    io::MotionMap map;
    if (!choice.map.empty()) map = io::read_motion_map(choice.map, rig);
    std::size_t unknown = 0;
    for (std::size_t m = 0; m < file_.markers().size(); ++m) {
      const std::string& name = file_.markers()[m];
      const auto found = map.markers.find(name);
      const int joint = rig.skeleton.find_joint(name);
      if (found != map.markers.end()) {
        add(m, found->second.row, found->second.point);
      } else if (joint >= 0) {
        const auto row = static_cast<std::size_t>(joint);
        add(m, row, rig.skeleton.segments[row].joint.center);
      } else {
        ++unknown;
      }
    }
    if (markers_.size() < 3)
      throw Error(ErrorKind::data, choice.file.string(),
                  std::to_string(markers_.size()) + " of its " + std::to_string(file_.markers().size()) +
                      " markers have a place on the body",
                  "say where three or more are by --map FILE");
    if (unknown > 0)
      program.note("warning: " + choice.file.string() + ": " + std::to_string(unknown) +
                   " markers have no place on the body (say it by --map FILE)");
    check_size(choice);
  }

  std::size_t frames() const override { return file_.frames(); }
  double frame_seconds() const override { return file_.frame_seconds(); }

  Pose at(std::size_t frame) override {
    if (!last_ || frame < last_->first) last_.reset();
    for (std::size_t f = last_ ? last_->first + 1 : 0; f <= frame; ++f) {
      const kinematics::IkResult fit =
          kinematics::fit_markers(rig_, markers_, seen(f), last_ ? &last_->second : nullptr);
      last_.emplace(f, fit.pose);
    }
    return last_->second;
  }

 private:
  void add(std::size_t column, std::size_t row, const Vector3d& point) {
    columns_.push_back(column);
    markers_.push_back({row, point});
  }

  std::vector<Vector3d> seen(std::size_t frame) {
    const std::vector<Vector3d> all = file_.read(frame);
    std::vector<Vector3d> out;
    for (const std::size_t column : columns_) out.push_back(scale_ * all[column]);
    return out;
  }

  // By the spread of the markers in the first frame; a body that bends has a smaller one, but not by half.
  void check_size(const MotionChoice& choice) {
    const std::vector<Vector3d> first = seen(0);
    double on_body = 0, in_file = 0;
    for (std::size_t a = 0; a < first.size(); ++a) {
      for (std::size_t b = 0; b < a; ++b) {
        if (!first[a].allFinite() || !first[b].allFinite()) continue;
        on_body += (markers_[a].point - markers_[b].point).norm();
        in_file += (first[a] - first[b]).norm();
      }
    }
    const double ratio = in_file / on_body;
    if (!std::isfinite(ratio) || ratio == 0)
      throw Error(ErrorKind::data, choice.file.string(), "too few markers are seen in its first frame",
                  "cut the motion to where they are seen");
    if (choice.unit == "body") {
      scale_ = 1 / ratio;
      return;
    }
    if (ratio < kWrongMarkerSize && ratio > 1 / kWrongMarkerSize) return;
    char size[64];
    std::snprintf(size, sizeof size, "%.3g times as far apart as on the patient", ratio);
    throw Error(ErrorKind::data, choice.file.string(), std::string("its markers are ") + size,
                "say the unit by --motion-unit, or fit them to the patient by --motion-unit body");
  }

  const Rig& rig_;
  io::MarkerFile file_;
  std::vector<std::size_t> columns_;
  std::vector<kinematics::MarkerOnBody> markers_;
  double scale_ = 1;
  std::optional<std::pair<std::size_t, Pose>> last_;
};

}  // namespace

std::unique_ptr<MotionSource> open_markers(const Program& program, const MotionChoice& choice,
                                           const Rig& rig) {
  return std::make_unique<MarkerSource>(program, choice, rig);
}

}  // namespace ecorche::app
