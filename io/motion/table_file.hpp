// SPDX-License-Identifier: Apache-2.0
// Motion that is no skeleton's: tables of named angles (OpenSim) and of markers (TRC).
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "io/motion/clip_file.hpp"
#include "io/motion/frame_rows.hpp"

namespace ecorche::io {

/// Coordinates over time, `.mot` or `.sto` of OpenSim. What a column means its reader must know: angles are
/// degrees or radians as `in_degrees` says, lengths are metres. Frames are taken as evenly spaced.
class AngleFile {
 public:
  /// Throws Error{missing_input} and Error{data}: no `endheader`, no column `time`, columns twice, rows of
  /// another length than the columns, counts that lie, values that are not finite, times that do not ascend.
  explicit AngleFile(TextStream stream);

  const std::vector<std::string>& columns() const { return columns_; }  ///< without `time`
  bool in_degrees() const { return in_degrees_; }
  double frame_seconds() const { return frame_seconds_; }
  std::size_t frames() const { return rows_->frames(); }
  /// #columns values; good until the next call.
  std::span<const double> read(std::size_t frame) { return rows_->row(frame).subspan(1); }

 private:
  std::vector<std::string> columns_;
  bool in_degrees_ = false;
  double frame_seconds_ = 1;
  std::unique_ptr<FrameRows> rows_;
};

/// Markers over time, `.trc`.
class MarkerFile {
 public:
  /// `space`: default frame LSA, default unit the file's own. Throws Error{missing_input} and Error{data}: no
  /// TRC, markers twice, rows of another length, counts that lie, values that are not finite.
  explicit MarkerFile(TextStream stream, const MotionSpace& space = {});

  const std::vector<std::string>& markers() const { return markers_; }
  double frame_seconds() const { return frame_seconds_; }
  std::size_t frames() const { return rows_->frames(); }
  /// Places, LPS mm; NaN where the marker was not seen (an empty field).
  std::vector<Eigen::Vector3d> read(std::size_t frame);

 private:
  MotionSpace space_;
  std::vector<std::string> markers_;
  double frame_seconds_ = 1, unit_mm_ = 1;
  std::unique_ptr<FrameRows> rows_;
};

}  // namespace ecorche::io
