// SPDX-License-Identifier: Apache-2.0
// What the header of an image file declares, read by ourselves before anything is allocated for it. ITK's
// reading of the header is a second opinion; voxels are ours alone: MetaIO takes a packed image that does not
// say its packed size for zeros, and niftilib mixes up `a.nii` and `a.nii.gz` side by side.
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <ecorche/files/budget.hpp>
#include <ecorche/values/image.hpp>
#include "io/image/nifti_form.hpp"

namespace ecorche::io {

/// Voxel bytes that a file may declare.
inline constexpr std::uint64_t largest_image_bytes = std::uint64_t{1} << 33;
/// Deflate cannot pack zeros tighter than about 1032 to 1.
inline constexpr std::uint64_t largest_inflation = 1100;
/// Volumes that may follow each other in time.
inline constexpr std::int64_t most_volumes = 10000;

struct ImageHeader {
  std::array<std::int32_t, 3> size{0, 0, 0};
  ScalarType type = ScalarType::u8;  ///< as it is read
  bool wide = false;                 ///< stored as i64, of which `type` is i32
  bool wide_unsigned = false;        ///< as u64
  int components = 1;
  int volumes = 1;                                   ///< in time; all else is said of one of them
  bool volumes_first = false;                        ///< they lie voxel by voxel: `components` are they
  bool may_be_volumes = false;                       ///< `components` are a list of anything
  std::uint64_t bytes_before = 0, bytes_behind = 0;  ///< of the volumes that are not read
  bool gzip = false;
  std::filesystem::path data_file;  ///< the file itself, or a plain name beside it
  std::uint64_t data_offset = 0;    ///< of the first voxel byte, or of the gzip stream, in `data_file`
  std::uint64_t stream_offset = 0;  ///< of the first voxel byte in what that stream inflates to
  std::optional<std::uint64_t> packed_bytes;  ///< as the header declares, where it does
  std::uint64_t skipped_lines = 0;  ///< lines of `data_file` from `data_offset` on that are no voxels
  std::uint64_t skipped_bytes = 0;  ///< bytes behind those lines that are no voxels; raw only
  bool at_end = false;              ///< raw voxels are the last bytes of `data_file`, whatever is before them
  bool swapped = false;             ///< voxels are in the other byte order
  std::optional<ImageGrid> grid;    ///< of NIfTI, and a NRRD that says its space: ITK 5.2 turns LAS wrongly

  // NIfTI only.
  bool second_version = false;  ///< ITK 5.2 does not read it
  bool planar = false;          ///< one volume a component
  bool scaled = false;          ///< stored integers become real values: slope * stored + intercept
  double slope = 1, intercept = 0;

  /// Bytes of one scalar as stored.
  std::size_t stored_bytes() const { return wide ? 8 : scalar_bytes(type); }
  /// Bytes of all voxels as stored; the parsers keep it at most `largest_image_bytes`.
  std::uint64_t voxel_bytes() const;
  /// With those of the volumes that are not read.
  std::uint64_t all_bytes() const { return bytes_before + voxel_bytes() + bytes_behind; }
};

/// The header of a `.nrrd` or `.nhdr`. `head` holds the file's beginning (the first MiB at least, or all of
/// it). Throws Error{data} for anything but a 3-D image, or several in time, raw or gzip, of a ScalarType, in
/// mm, in LPS, RAS, LAS or no space at all.
ImageHeader parse_nrrd_header(std::string_view head, const std::filesystem::path& path);

/// The free `key:=value` pairs of a NRRD's header, nothing of another format's. Throws Error{missing_input}
/// or Error{data}.
std::map<std::string, std::string> read_nrrd_keys(const std::filesystem::path& path);

/// The file's first MiB, or all of it. Throws Error{missing_input}.
std::string read_head(const std::filesystem::path& path);

/// The header of a `.mha` or `.mhd`.
ImageHeader parse_meta_header(std::string_view head, const std::filesystem::path& path);

/// The header of a `.nii`; of a `.nii.gz`, `head` is inflated already. Beyond what cannot be read anywhere
/// here, it refuses an image that does not say where it lies (neither qform nor sform), or says it in two
/// ways.
ImageHeader parse_nifti_header(std::string_view head, const std::filesystem::path& path, NiftiForm form);

/// Leaves of an image in time its volume `phase`, from 1; 0: the only one. Throws Error{data}, with how many
/// there are.
void choose_volume(ImageHeader& header, int phase, const std::filesystem::path& path);

/// Makes `data_offset` the byte where the voxels or their stream begin: behind skipped lines, before the end.
void place_data(ImageHeader& header);

/// Fills `image`, whose grid and type are set, from `stored` of the file that `header` was read from. Throws
/// Error{data} for 64-bit integers beyond 32 bits.
void read_voxels(const ImageHeader& header, const std::filesystem::path& path, std::vector<std::byte> stored,
                 Image& image);

/// Of several components the row `component`, from 0.
Image one_component(const Image& image, int component);

/// The voxels as they are stored, of a file that `check_payload` has passed: of a gzip stream no more than
/// its header declares is kept, nor anything set aside that it does not hold. Throws Error{io}, and
/// Error{data} for a stream that is damaged, or of another length than declared.
std::vector<std::byte> stored_voxels(const ImageHeader& header, const std::filesystem::path& path);

/// What a gzip stream at the beginning of `packed` inflates to, at most `limit` bytes of it. Throws
/// Error{data}.
std::string inflate_head(std::string_view packed, std::size_t limit, const std::filesystem::path& path);

/// Holds the declared bytes against the data file: its length where raw, what its length may inflate to where
/// gzip; and all that they take in memory against the budget of a file of that size. Throws Error{data}.
void check_payload(const ImageHeader& header, const std::filesystem::path& path,
                   const files::ReadLimits& limits);

}  // namespace ecorche::io
