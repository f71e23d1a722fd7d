// SPDX-License-Identifier: Apache-2.0
// What became of each participant of a cohort, and who differs from the others.
#pragma once

#include <filesystem>
#include <limits>
#include <string>
#include <vector>

namespace ecorche::app::report {

/// One posed body, or one frame of a motion.
struct PosedRow {
  std::string pose;
  bool pass = false;
  double inverted_mm3 = 0, inverted_share = 0, volume_change = 0, unsigned_volume_change = 0, min_det_f = 0;
  double warnings = 0;  ///< how many
  std::string worst;    ///< the first of them
};

/// A pose of the library that has none of the body's joints.
struct LeftOutPose {
  std::string pose, why;
};

struct Participant {
  enum class State : unsigned char {
    pass,        ///< every pose keeps its limits
    warn,        ///< some pose does not, or it can take none
    failed,      ///< it has no model, or not every pose
    unfinished,  ///< nobody has run it to its end
  };
  std::string name;
  State state = State::unfinished;
  std::string step, fault, where, what, mend;  ///< where it failed; `fault` is `data` or `machine`
  int exit_code = 0;
  bool repaired = false;
  std::vector<std::pair<std::string, double>> figures;  ///< of the model, by name
  std::string least_joint;                              ///< the joint that is surest of least
  std::vector<std::string> warnings;                    ///< of the preparation
  std::vector<PosedRow> poses;
  std::vector<LeftOutPose> left_out;
  /// Of the preparation, measured: another run has others. NaN where it is not known.
  double seconds = std::numeric_limits<double>::quiet_NaN(), peak_mib = seconds;
  std::string picture;  ///< the bytes of a PNG; empty: none

  /// A figure of the model, or NaN.
  double figure(const std::string& of) const;
};

/// `pass`, `warn`, `failed` or `unfinished`.
const char* state_name(Participant::State state);

/// Reads FOLDER/status.json, its times and its picture. Without a status.json it is unfinished. Throws
/// Error{data} where what is there was not written by a cohort, Error{io}.
Participant read_participant(const std::filesystem::path& folder);

/// A figure of everybody.
struct Figure {
  std::string name;   ///< as the table calls it: `tets`, `sitting.volume_change`
  std::string title;  ///< as people do
  std::string unit;
  double per = 1;                          ///< of the value, in that unit
  std::vector<double> of;                  ///< by participant; NaN: it has none
  double median = 0, spread = 0;           ///< of those that have one; spread: as a standard deviation
  std::vector<std::size_t> outliers = {};  ///< participants, the farthest first
};

/// Preparation, tets, weights, joints, and each pose's inverted volume and volume change. An outlier lies
/// more than 3.5 spreads from the median, where a spread is 1.4826 times the median absolute deviation, or,
/// where that is zero, 1.2533 times the mean one (IglewiczHoaglin93); of fewer than five nobody is one.
std::vector<Figure> figures_of(const std::vector<Participant>& cohort);

/// A row for each participant, a column for each figure; what is not known is `n/a`, as BIDS has it.
std::string to_tsv(const std::vector<Participant>& cohort, const std::vector<Figure>& figures);

/// The same, with every pose, every warning and the outliers.
std::string to_json(const std::vector<Participant>& cohort, const std::vector<Figure>& figures);

}  // namespace ecorche::app::report
