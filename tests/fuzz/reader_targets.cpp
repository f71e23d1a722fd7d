// SPDX-License-Identifier: Apache-2.0
// The readers of surfaces, tets, images and our own YAML, each held to its budget: what it allocates is
// measured.
#include <algorithm>
#include <cstdio>
#include <initializer_list>
#include <string>

#include <ecorche/io/case_file.hpp>
#include <ecorche/values/error.hpp>
#include <ecorche/values/volumetric_skeleton_check.hpp>
#include "app/point_table.hpp"
#include "app/posed_manifest.hpp"
#include "io/case/attachment_file.hpp"
#include "io/case/case_rules.hpp"
#include "io/case/ik_file.hpp"
#include "io/case/motion_map.hpp"
#include "io/case/pose_sequence.hpp"
#include "io/image/image_file.hpp"
#include "io/image/label_json.hpp"
#include "io/image/label_table.hpp"
#include "io/image/segmentation.hpp"
#include "io/surface/gltf.hpp"
#include "io/surface/obj.hpp"
#include "io/surface/off.hpp"
#include "io/surface/ply.hpp"
#include "io/surface/stl.hpp"
#include "io/surface/tied_surfaces.hpp"
#include "io/surface/volumetric_skeleton_file.hpp"
#include "io/surface/vtk_legacy.hpp"
#include "io/surface/vtp.hpp"
#include "io/surface/vtu.hpp"
#include "tests/fuzz/peak_bytes.hpp"
#include "tests/fuzz/place.hpp"
#include "tests/fuzz/promises.hpp"
#include "tests/fuzz/targets.hpp"
#include "tests/support/toy_model.hpp"

namespace ecorche::fuzz {
namespace {

// Small, so that a file of a few kilobytes that takes what it has no right to stands out.
constexpr files::ReadLimits kLimits{.base = 1 << 18, .image_base = 1 << 18, .per_byte = 64};
// What no budget counts: words, trees of names; and of an image its first MiB, the blocks of streams and of
// zlib, and the same once more in ITK.
constexpr std::uint64_t kBeside = 1 << 16, kBesideImage = 3 << 20;
// A tree of YAML has no budget of its own: a value of one letter and a comma is a node of a hundred bytes, in
// a list that doubles, and a token of yaml-cpp.
constexpr std::uint64_t kPerByteOfText = 1024;

void look_at(const SurfaceMesh& mesh) {
  must(mesh.F.rows() > 0 && mesh.V.allFinite(), "a surface has triangles, and points that are finite");
  must(mesh.F.minCoeff() >= 0 && mesh.F.maxCoeff() < mesh.V.rows(), "corners are points");
}

void look_at(const io::TetFile& tets) {
  must(tets.T.rows() > 0 && tets.V.allFinite(), "a grid has tets, and points that are finite");
  must(tets.T.minCoeff() >= 0 && tets.T.maxCoeff() < tets.V.rows(), "corners are points");
  for (const io::GridArray& array : tets.point_data) {
    must(array.values.size() == static_cast<std::size_t>(tets.V.rows() * array.components),
         "an array has a row for each point");
  }
}

void look_at(const Image& image) {
  const std::size_t voxel = scalar_bytes(image.type) * static_cast<std::size_t>(image.components);
  must(image.grid.voxels() > 0 && image.bytes.size() == image.grid.voxels() * voxel, "a voxel has its bytes");
}

void look_at(const io::VolumetricSkeletonFile& file) {
  must(first_defect(file.skeleton).empty(), "a skeleton has no defect");
}

void look_at(const io::TiedSurfaces& surfaces) {
  must(surfaces.V.allFinite() && surfaces.share.allFinite(), "points and shares are finite");
  must(surfaces.F.size() == 0 || (surfaces.F.minCoeff() >= 0 && surfaces.F.maxCoeff() < surfaces.V.rows()),
       "corners are points");
  must(surfaces.tet.size() == static_cast<std::size_t>(surfaces.V.rows()), "a vertex has a tet");
}

// With what the cases and pose files of the corpora name.
const Place& place() {
  static const Place place;
  static const bool filled = [] {
    place.put("a.obj", "v 0 0 0\nv 40 0 0\nv 0 40 0\nv 0 0 40\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n");
    place.put("s.yaml",
              "ecorche_skeleton: 1\nname: s\nsegments:\n  b: {joint: {name: r, center: [0, 0, 0]}}\n");
    place.put("p.yaml", "ecorche_pose: 1\nskeleton: toy\n");
    Image labels({.size = {4, 4, 4}, .spacing = {10, 10, 10}}, ScalarType::u8);
    for (std::size_t i = 0; i < labels.bytes.size(); ++i) labels.bytes[i] = static_cast<std::byte>(i % 5);
    io::write_image(place / "l.nrrd", labels);
    return true;
  }();
  (void)filled;
  return place;
}

const Rig& rig() {
  static const Rig rig = test::toy_model().rig;
  return rig;
}

// gzip is told by the ending of the name.
std::filesystem::path put_nifti(const std::string& text) {
  return place().put(text.starts_with("\x1f\x8b") ? "a.nii.gz" : "a.nii", text);
}

std::filesystem::path put_labels(const std::string& text) {
  return place().put(text.starts_with("NRRD")       ? "l.seg.nrrd"
                     : text.starts_with("\x1f\x8b") ? "l.nii.gz"
                                                    : "l.nii",
                     text);
}

std::filesystem::path put_table(const std::string& text) {
  return place().put(text.starts_with("index") ? "l.tsv" : "l.txt", text);
}

template <class Read>
void read_within(std::uint64_t allowed, std::initializer_list<ErrorKind> kinds, Read&& read) {
  const auto told = [&] {
    try {
      read();
    } catch (const Error& error) {
      if (std::find(kinds.begin(), kinds.end(), error.kind()) == kinds.end()) must(false, error.what());
    }
  };
  // What is made once and kept is no input's fault.
  [[maybe_unused]] static const bool warm = (told(), true);
  const std::int64_t peak = peak_bytes(told);
  if (peak <= static_cast<std::int64_t>(allowed)) return;
  std::fprintf(stderr, "took %lld bytes, may take %llu\n", static_cast<long long>(peak),
               static_cast<unsigned long long>(allowed));
  must(false, "memory stays within the budget");
}

}  // namespace

// A reader of `text`, within `limits`, that may refuse by these kinds of error and no other way.
#define ECORCHE_READER(name, beside, per_byte, expression, ...)                                       \
  void name(Bytes bytes) {                                                                            \
    const std::string text(reinterpret_cast<const char*>(bytes.data()), bytes.size());                \
    [[maybe_unused]] constexpr files::ReadLimits limits = kLimits;                                    \
    read_within((beside) + limits.base + (per_byte)*text.size(), {__VA_ARGS__}, [&] { expression; }); \
  }

#define ECORCHE_SURFACE(name, expression) \
  ECORCHE_READER(name, kBeside, kLimits.per_byte, look_at(expression), ErrorKind::data)
#define ECORCHE_IMAGE(name, path)                                                                   \
  ECORCHE_READER(name, kBesideImage, kLimits.per_byte, look_at(io::read_image(path, {limits, {}})), \
                 ErrorKind::data, ErrorKind::missing_input)
#define ECORCHE_YAML(name, beside, expression)                                                         \
  ECORCHE_READER(name, beside, kPerByteOfText, (void)(expression), ErrorKind::config, ErrorKind::data, \
                 ErrorKind::missing_input, ErrorKind::usage)

ECORCHE_SURFACE(stl, io::stl::decode(text, "fuzzed", limits))
ECORCHE_SURFACE(obj, io::obj::decode(text, "fuzzed", limits))
ECORCHE_SURFACE(ply, io::ply::decode(text, "fuzzed", limits))
ECORCHE_SURFACE(off, io::off::decode(text, "fuzzed", limits))
ECORCHE_SURFACE(vtk, io::vtk_legacy::decode(text, "fuzzed", limits))
ECORCHE_SURFACE(vtp, io::vtp::decode(text, "fuzzed", limits).mesh)
ECORCHE_SURFACE(vtu, io::vtu::decode(text, "fuzzed", limits))
ECORCHE_SURFACE(gltf_mesh,
                io::gltf::decode(text, place() / (text.starts_with("glTF") ? "a.glb" : "a.gltf"), limits))
ECORCHE_IMAGE(nrrd, place().put("a.nrrd", text))
ECORCHE_IMAGE(mha, place().put("a.mha", text))
ECORCHE_IMAGE(nifti, put_nifti(text))
ECORCHE_IMAGE(dicom, place().put("a.dcm", text))
ECORCHE_READER(dicom_segmentation, kBesideImage, kLimits.per_byte,
               look_at(io::read_segmentation(place().put("s.dcm", text), {limits, {}}).layers.at(0)),
               ErrorKind::data, ErrorKind::missing_input)
// By the ending of the name, which the first bytes choose: labels' names lie in headers and extensions, too.
ECORCHE_READER(named_labels, kBesideImage, kLimits.per_byte,
               look_at(io::read_segmentation(put_labels(text), {limits, {}}).layers.at(0)), ErrorKind::data,
               ErrorKind::missing_input)
ECORCHE_READER(label_table, kBeside, kPerByteOfText, (void)io::read_label_table(put_table(text)),
               ErrorKind::data)
ECORCHE_READER(label_json, kBeside, kPerByteOfText,
               (void)io::read_label_json(place().put("labels.json", text)), ErrorKind::data)
ECORCHE_SURFACE(volumetric_skeleton, io::decode_volumetric_skeleton(text, "fuzzed", limits))
ECORCHE_SURFACE(tied_surfaces, io::read_tied_surfaces(place().put("scan.vtp", text), limits))
ECORCHE_READER(point_table, kBeside, kPerByteOfText,
               (void)app::read_named_points(place().put("points.csv", text)), ErrorKind::data)
ECORCHE_READER(posed_manifest, kBeside, kPerByteOfText,
               (void)app::read_manifest(place().put("posed.json", text).parent_path()), ErrorKind::data)
ECORCHE_YAML(pose_sequence_yaml, kBeside, io::read_pose_sequence(place().put("sequence.yaml", text), rig()))
ECORCHE_YAML(regions_yaml, kBeside, io::read_regions_file(place().put("regions.yaml", text), {}))
ECORCHE_YAML(case_yaml, kBesideImage, io::read_case(place().put("case.yaml", text), {{}, {}, limits}, {}))
ECORCHE_YAML(skeleton_yaml, kBeside, io::read_skeleton(place().put("skeleton.yaml", text)))
ECORCHE_YAML(pose_yaml, kBeside, io::read_pose(place().put("pose.yaml", text), rig()))
ECORCHE_YAML(ik_yaml, kBeside, io::read_ik(place().put("ik.yaml", text), rig()))
ECORCHE_YAML(motion_map_yaml, kBeside, io::read_motion_map(place().put("map.yaml", text), rig()))
ECORCHE_YAML(attachment_yaml, kBeside,
             io::read_attachment(place().put("attachment.yaml", text), rig().skeleton))

}  // namespace ecorche::fuzz
