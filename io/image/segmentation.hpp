// SPDX-License-Identifier: Apache-2.0
// Segmentations that name their own segments, in layers where they overlap: 3D Slicer's NRRD, DICOM SEG.
#pragma once

#include <filesystem>
#include <optional>
#include <vector>

#include <ecorche/values/image.hpp>
#include "core/files/read_options.hpp"
#include "io/image/image_choice.hpp"
#include "io/image/label_table.hpp"
#include "io/image/segment_codes.hpp"

namespace ecorche::io {

/// A label map and what its file says of the ids.
struct Segmentation {
  /// One a layer, all of one grid, one component each: whoever is in several segments has an id in each
  /// layer.
  std::vector<Image> layers;
  LabelNames names;  ///< empty where the file names no segment
  /// Of DICOM SEG, whose segments keep their numbers as ids, and of a `.seg.nrrd` with terminology.
  std::map<std::int64_t, SegmentCodes> codes = {};
  /// Which share voxels. Nothing is lost: each segment lies whole in the first layer where it has room, in
  /// the file's order, so that of two that overlap the earlier one lies in the earlier layer. Whoever wants
  /// one map takes the first layer that is not 0.
  std::vector<LabelOverlap> overlaps = {};
};

/// Reads any image that `read_image` reads as labels, and DICOM SEG (dicom_segmentation.hpp). Of a NRRD with
/// `Segment0_Name`, ... the segments are named (by `make_identifiers`) and coded (terminology.hpp), and
/// components are layers; of a NIfTI its header extension names them (nifti_names.hpp). Where two segments of
/// different layers share a value, all are numbered anew from 1 in the file's order (u16), and values of no
/// segment are dropped: an id means one thing. Throws Error{missing_input} or Error{data}: voxels that are no
/// whole numbers, several components that are no layers, a segment whose layer is not there.
Segmentation read_segmentation(const std::filesystem::path& path, const files::ReadOptions& options = {},
                               const ImageChoice& choice = {});

/// The same of an image that `read_label_image` has read from that file, or that `whole_labels` has made of
/// what `read_stored_image` read.
Segmentation segmentation_of(Image image, const std::filesystem::path& path);

/// Writes a `.seg.nrrd` that names its segments (those ids of `names` that a layer holds), one component a
/// layer; atomically. Layers are of one grid and type. Throws Error{usage} for another ending,
/// Error{cannot_create}, Error{io}.
void write_segmentation(const std::filesystem::path& path, const Segmentation& segmentation);

}  // namespace ecorche::io
