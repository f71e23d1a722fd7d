// SPDX-License-Identifier: Apache-2.0
// `posed.json`: what a posed folder is of, and what each of its files is (docs/reference/posed_folder.md).
#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include <ecorche/values/case.hpp>
#include <ecorche/values/context.hpp>
#include <ecorche/values/transform.hpp>

namespace ecorche::app {

inline constexpr std::string_view kManifest = "posed.json";
/// Names that no tissue and no volume can have.
inline constexpr std::string_view kPoseFile = "pose.yaml", kScanSurfaces = "scan-surfaces.vtp",
                                  kTets = "body.vtu";
/// Of a posed volume's name, of the mask beside it; no volume has such a name.
inline constexpr std::string_view kMaskEnding = "-mask";

/// A tissue of the model, and how it was carried: by tets, or rigidly with a segment.
struct PosedSurface {
  std::string tissue;
  Group group = Group::other;
  std::uint64_t vertices = 0, triangles = 0;
  std::string segment;    ///< empty: by tets
  RigidTransform motion;  ///< of that segment, from the scan
};

/// What a file of a posed folder is.
enum class PosedKind : std::uint8_t { surface, image, labels, tets, scan, pose, quality, field, mask, other };
std::string_view kind_name(PosedKind kind);

struct PosedFile {
  std::string file;  ///< below the folder, with slashes
  PosedKind kind = PosedKind::other;
  std::string of;                              ///< the tissue or volume; empty for others
  std::uint64_t bytes = 0, digest = 0;         ///< XXH64
  std::map<std::int64_t, std::string> labels;  ///< of labels and tets: what each value stands for
};

struct PosedManifest {
  std::string model;
  std::uint64_t identity = 0;  ///< model_file::identity
  std::string skinning, deformer;
  bool unfolded = false, settled = false;
  std::vector<PosedSurface> surfaces;  ///< in the order of kScanSurfaces
  std::vector<PosedFile> files;        ///< all but the manifest, sorted by name

  const PosedFile* find(const std::string& file) const;
};

std::string to_json(const PosedManifest& manifest);

/// The manifest of `folder`; nothing where there is none. Throws Error{data} for one that cannot be read.
std::optional<PosedManifest> read_manifest(const std::filesystem::path& folder);

/// Whether `folder`/`file` is as pose wrote it.
bool is_as_written(const std::filesystem::path& folder, const PosedFile& file, const Context& context);

}  // namespace ecorche::app
