// SPDX-License-Identifier: Apache-2.0
// What `ecorche pose` was asked to write.
#pragma once

#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include <ecorche/values/model.hpp>
#include "app/fem_pose.hpp"
#include "app/pose_frames.hpp"
#include "app/posed_dicom.hpp"
#include "app/scan/posed_scan.hpp"
#include "io/image/scan_slices.hpp"
#include "runtime/spheres/pose_volume.hpp"

namespace ecorche::app {

// As the command line says it.
struct PoseSettings {
  std::filesystem::path model, output;
  ScanPosing scan;  // instead of a model
  FrameChoice frames;
  std::string skinning = "cor";
  FemSettings fem;  // where skinning is `fem`
  std::vector<std::string> tissues, volumes;
  std::vector<std::string> formats{"stl"};
  std::string volume_format = "nrrd";
  std::string sampling = "trilinear";
  std::string grid = "posed";
  std::string resample = "even";
  std::string deformer = "tets";
  bool tets = false, field = false, as_case = false, bridge = true;
  bool unfold = false, settle = false;
  std::vector<std::string> tet_formats{"vtu"};
  DicomSettings dicom;

  bool by_fem() const { return skinning == "fem"; }
  bool on_slices() const { return resample == "slices"; }
  bool writes_dicom() const { return volume_format == "dicom"; }
  // Of fields, which no CT can hold.
  std::string field_format() const { return writes_dicom() ? "nrrd" : volume_format; }
  bool chooses() const { return !tissues.empty() || !volumes.empty() || tets || field; }
};

// What to write, in rows of the model.
struct Plan {
  std::vector<std::uint32_t> tissues, volumes;
  bool tets = false, field = false;
  std::map<std::string, runtime::VolumeBalls> balls;  // of volumes that are refilled, by name
  std::optional<io::ScanSlices> slices;               // on which volumes are written
};

/// `ecorche pose`, or `ecorche fem` where that filled the settings. Returns the exit code.
int run_pose(const Program& program, PoseSettings& settings);

/// Refuses what contradicts itself, whatever the model. Throws Error{usage}.
void check_settings(const PoseSettings& settings);

/// What is not named is not written; naming nothing writes everything. Throws Error{usage}.
Plan plan_of(const PoseSettings& settings, const Model& model);

}  // namespace ecorche::app
