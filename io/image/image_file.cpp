// SPDX-License-Identifier: Apache-2.0
#include "io/image/image_file.hpp"

#include <algorithm>
#include <cmath>
#include <fstream>

#include <ecorche/values/error.hpp>
#include "core/files/atomic_file.hpp"
#include "core/files/look.hpp"
#include "core/values/text.hpp"
#include "io/image/dicom.hpp"
#include "io/image/dicom_image.hpp"
#include "io/image/header.hpp"
#include "io/image/header_fields.hpp"
#include "io/image/itk_images.hpp"
#include "io/image/non_finite.hpp"
#include "io/image/packed_nifti.hpp"
#include "io/image/packed_nrrd.hpp"
#include "io/image/right_angles.hpp"
#include "io/image/unsheared.hpp"
#include "io/image/whole_labels.hpp"

namespace ecorche::io {
namespace {

using fields::refuse;
using itk_images::Format;
using Path = std::filesystem::path;

constexpr std::size_t kLargestHeader = std::size_t{1} << 20;
constexpr double kItkDegrees = 1e-6;  // what float32 rounds

bool ends_with(const Path& path, std::string_view ending) {
  return text::lower(path.filename().string()).ends_with(ending);
}

// A `.nii`, or a `.nii.gz` whose stream holds one.
ImageHeader parse_nifti(const std::string& head, const Path& path, NiftiForm form) {
  if (!ends_with(path, ".gz")) {
    if (head.starts_with("\x1f\x8b")) refuse(path, "is packed by gzip", "name it .nii.gz");
    return parse_nifti_header(head, path, form);
  }
  ImageHeader header = parse_nifti_header(inflate_head(head, 4096, path), path, form);
  header.gzip = true;
  header.stream_offset = header.data_offset;
  header.data_offset = 0;
  return header;
}

// Without a second opinion. Scaled integers become float, as ITK has it.
Image as_declared(const ImageHeader& declared) {
  Image image;
  image.type = declared.scaled && declared.type != ScalarType::f64 ? ScalarType::f32 : declared.type;
  image.components = declared.components;
  image.grid.size = declared.size;
  return image;
}

// Two readers, one header: where they disagree, neither is believed.
void check_agreement(const ImageHeader& declared, const Image& seen, const Path& path) {
  const bool real = seen.type == ScalarType::f32 || seen.type == ScalarType::f64;
  if (declared.size == seen.grid.size && declared.components == seen.components &&
      (declared.scaled ? real : declared.type == seen.type))
    return;
  refuse(path, "its header can be read in two ways", "write the image again");
}

void check_grid(ImageGrid& grid, const Path& path, const files::ReadOptions& options) {
  for (const double spacing : grid.spacing) {
    if (!(spacing > 0 && spacing < 1e6))
      refuse(path, "its spacing is " + std::to_string(spacing), "it must be positive, mm");
  }
  for (const double origin : grid.origin) {
    if (!(std::abs(origin) < 1e9))
      refuse(path, "its origin is " + std::to_string(origin), "it must be finite, mm");
  }
  make_right_angled(grid, path, options);
}

// ITK's second opinion; where the axes of the file are a little off, which it refuses, there is none.
Image opinion(const ImageHeader& declared, const Path& path, Format format, bool skewed) {
  if (declared.second_version || declared.volumes > 1) return as_declared(declared);
  try {
    return itk_images::read_header(path, format);
  } catch (const Error&) {
    if (!skewed) throw;
    return as_declared(declared);
  }
}

// As the file has it. With `in_time`, which tells whether it holds volumes in time, a phase is theirs alone.
Image read_stored(const Path& path, const files::ReadOptions& options, ImageChoice choice, bool labels,
                  bool* in_time = nullptr) {
  if (is_dicom(path)) {
    if (choice.form != NiftiForm::either)
      refuse(path, "has neither qform nor sform: it is no NIfTI", "leave out form");
    return read_dicom(path, options, choice, labels);
  }
  std::error_code ignored;
  if (std::filesystem::is_directory(path, ignored))
    refuse(path, "is a folder without DICOM files, no image", "name a .nrrd, .mha or .nii.gz");
  if (!choice.series.empty()) refuse(path, "is no DICOM, which alone has series", "leave out series");
  Format format = Format::nrrd;
  if (ends_with(path, ".mha") || ends_with(path, ".mhd")) {
    format = Format::meta;
  } else if (ends_with(path, ".nii") || ends_with(path, ".nii.gz")) {
    format = Format::nifti;
  } else if (!ends_with(path, ".nrrd") && !ends_with(path, ".nhdr")) {
    refuse(path, "'" + path.extension().string() + "' images cannot be read",
           "convert it to .nrrd, .mha or .nii.gz");
  }
  if (choice.form != NiftiForm::either && format != Format::nifti)
    refuse(path, "has neither qform nor sform: it is no NIfTI", "leave out form");
  const std::string head = read_head(path);
  ImageHeader declared = format == Format::nrrd   ? parse_nrrd_header(head, path)
                         : format == Format::meta ? parse_meta_header(head, path)
                                                  : parse_nifti(head, path, choice.form);
  if (in_time != nullptr) {
    *in_time = declared.volumes > 1 || declared.may_be_volumes;
    if (!*in_time) choice.phase = 0;
  }
  choose_volume(declared, choice.phase, path);
  const bool skewed = declared.grid && degrees_off(*declared.grid) > kItkDegrees;
  if (declared.grid) check_grid(*declared.grid, path, options);
  place_data(declared);
  check_payload(declared, path, options.limits);
  std::vector<std::byte> stored = stored_voxels(declared, path);
  Image image = opinion(declared, path, format, skewed);
  check_agreement(declared, image, path);
  if (declared.grid) {
    image.grid = *declared.grid;
  } else {
    check_grid(image.grid, path, options);
  }
  read_voxels(declared, path, std::move(stored), image);
  return declared.volumes_first ? one_component(image, choice.phase - 1) : image;
}

}  // namespace

std::string read_head(const Path& path) {
  std::ifstream file(path, std::ios::binary);
  if (!file || files::is_folder(path)) {
    throw Error(ErrorKind::missing_input, path.string(), "cannot be opened", "check the path and its rights");
  }
  std::string head(kLargestHeader, '\0');
  file.read(head.data(), static_cast<std::streamsize>(head.size()));
  head.resize(static_cast<std::size_t>(file.gcount()));
  return head;
}

Image read_image(const Path& path, const files::ReadOptions& options, const ImageChoice& choice) {
  Image image = read_stored(path, options, choice, false);
  replace_non_finite(image, path, options);
  make_unsheared(image, VoxelKind::grey, path, options);
  return image;
}

Image read_label_image(const Path& path, const files::ReadOptions& options, const ImageChoice& choice) {
  Image image = whole_labels(read_stored(path, options, choice, true), path);
  make_unsheared(image, VoxelKind::labels, path, options);
  return image;
}

Image read_stored_image(const Path& path, const files::ReadOptions& options, int phase, bool& in_time) {
  ImageChoice choice;
  choice.phase = phase;
  return read_stored(path, options, choice, false, &in_time);
}

void write_image(const Path& path, const Image& image, bool compress) {
  Format format = Format::nrrd;
  if (ends_with(path, ".mha")) {
    format = Format::meta;
  } else if (ends_with(path, ".nii.gz") || ends_with(path, ".nii")) {
    format = Format::nifti;
  } else if (!ends_with(path, ".nrrd")) {
    throw Error(ErrorKind::usage, path.string(), "cannot write '" + path.extension().string() + "' images",
                "use .nrrd, .mha or .nii.gz");
  }
  const std::size_t expected =
      image.grid.voxels() * static_cast<std::size_t>(image.components) * scalar_bytes(image.type);
  if (image.bytes.size() != expected || expected == 0) {
    throw Error(ErrorKind::internal, path.string(),
                "the image has " + std::to_string(image.bytes.size()) + " bytes, its grid takes " +
                    std::to_string(expected),
                "report this");
  }
  files::AtomicFile file(path);
  try {
    const auto& size = image.grid.size;
    const bool solid = std::all_of(size.begin(), size.end(), [](int n) { return n > 1 && n < 1 << 15; });
    if (format == Format::nrrd && compress) {
      write_packed_nrrd(file.temporary(), image);
    } else if (ends_with(path, ".nii.gz") && compress && solid) {
      write_packed_nifti(file.temporary(), image);
    } else {
      itk_images::write(file.temporary(), format, image, compress);
    }
  } catch (const Error& error) {  // by the name that the user knows
    throw Error(error.kind(), path.string(), error.problem(), error.mend());
  }
  file.commit();
}

}  // namespace ecorche::io
