// SPDX-License-Identifier: Apache-2.0
#include "app/slice_choice.hpp"

#include <algorithm>

#include "app/usage_error.hpp"
#include "core/files/look.hpp"
#include "io/image/dicom.hpp"
#include "io/image/dicom_image.hpp"
#include "io/image/mask_folder.hpp"

namespace ecorche::app {
namespace {

namespace fs = std::filesystem;

// What of a scan has the slices: a DICOM series, else the first image.
fs::path with_slices(const std::vector<fs::path>& scan, const files::ReadOptions& options) {
  for (const fs::path& path : scan)
    if (io::is_dicom(path) && io::holds_slices(path, options)) return path;
  for (const fs::path& path : scan) {
    if (files::is_folder(path)) {
      const std::vector<fs::path> images = io::images_within(path);
      if (!images.empty()) return images.front();
    } else if (io::is_image_name(path)) {
      return path;
    }
  }
  return scan.front();
}

}  // namespace

std::optional<io::ScanSlices> chosen_slices(const PoseSettings& settings) {
  if (!settings.on_slices()) return std::nullopt;
  const files::ReadOptions options{settings.frames.motion.limits, {}};
  const bool named = !settings.dicom.source.empty();
  if (!named && !settings.scan.wanted())
    usage_error("--resample", "a model does not know the slices of its scan",
                "name the scan: --dicom-source DIR");
  io::ScanSlices out =
      named ? io::read_scan_slices(settings.dicom.source, options, {.series = settings.dicom.series})
            : io::read_scan_slices(with_slices(settings.scan.scan.scan, options), options,
                                   settings.scan.scan.choice);
  if (!settings.writes_dicom() && !out.even())
    usage_error("--resample", "the scan's slices are at uneven distances, or lean, which only DICOM can say",
                "add --volume-format dicom");
  return out;
}

}  // namespace ecorche::app
