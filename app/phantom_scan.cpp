// SPDX-License-Identifier: Apache-2.0
#include "app/phantom_scan.hpp"

#include <algorithm>
#include <nlohmann/json.hpp>

#include <ecorche/version.hpp>
#include "core/files/atomic_file.hpp"
#include "io/case/structures.hpp"
#include "io/image/dicom_writer.hpp"
#include "io/image/image_file.hpp"
#include "io/image/nifti_names.hpp"
#include "io/image/segmentation.hpp"
#include "phantom/classes.hpp"

namespace ecorche::app {
namespace {

namespace fs = std::filesystem;
using phantom::ClassMap;

Image mask_of(const Image& labels, std::int64_t id) {
  Image out(labels.grid, ScalarType::u8);
  const auto from = labels.scalars<std::uint8_t>();
  std::transform(from.begin(), from.end(), out.scalars<std::uint8_t>().begin(),
                 [&](std::uint8_t v) { return static_cast<std::uint8_t>(id < 0 ? v != 0 : v == id); });
  return out;
}

// Each class is written, also those that are empty; of the body its union and its shell as well.
void write_masks(const fs::path& folder, const ClassMap& map) {
  files::make_folder(folder);
  for (const auto& [id, name] : map.names)
    io::write_image(folder / (name + ".nii.gz"), mask_of(map.image, id));
  if (map.task != "body") return;
  Image body = mask_of(map.image, -1);
  io::write_image(folder / "body.nii.gz", body);
  // The shell: voxels with a face to the outside.
  const Image whole = body;
  const auto in = whole.scalars<std::uint8_t>();
  const auto shell = body.scalars<std::uint8_t>();
  const ImageGrid& g = body.grid;
  for (int k = 1; k + 1 < g.size[2]; ++k) {
    for (int j = 1; j + 1 < g.size[1]; ++j) {
      for (int i = 1; i + 1 < g.size[0]; ++i) {
        const bool inside = in[g.offset(i - 1, j, k)] != 0 && in[g.offset(i + 1, j, k)] != 0 &&
                            in[g.offset(i, j - 1, k)] != 0 && in[g.offset(i, j + 1, k)] != 0 &&
                            in[g.offset(i, j, k - 1)] != 0 && in[g.offset(i, j, k + 1)] != 0;
        if (inside) shell[g.offset(i, j, k)] = 0;
      }
    }
  }
  io::write_image(folder / "skin.nii.gz", body);
}

// The SNOMED code of a class, as the programs' own tables have it.
io::SegmentCodes codes_of(const std::string& name) {
  const io::Recognised known = io::recognise(name);
  io::SegmentCodes out;
  if (known.structure == nullptr || known.structure->code.empty()) return out;
  out.category = {"SCT", "123037004", "Anatomical Structure"};
  out.type = {"SCT", known.structure->code, known.structure->name};
  if (known.side == Side::left) out.side = {"SCT", "7771000", "Left"};
  if (known.side == Side::right) out.side = {"SCT", "24028007", "Right"};
  return out;
}

void write_moose(const fs::path& folder, const ClassMap& map) {
  files::make_folder(folder);
  io::write_image(folder / (map.task + "_segmentation_phantom.nii.gz"), map.image);
  nlohmann::json indices = nlohmann::json::object();
  for (const auto& [id, name] : map.names)
    indices[std::to_string(id)] = {{"name", name}, {"SNOMED", {{"code", codes_of(name).type.value}}}};
  files::write_text(folder / (map.task + "_organ_indices.json"),
                    nlohmann::json{{"organ_indices", indices}}.dump(4));
}

// One segmentation of everything, the body in a layer of its own, since it overlaps with the rest.
io::Segmentation in_one(const std::vector<ClassMap>& maps) {
  io::Segmentation out;
  const ImageGrid& grid = maps.front().image.grid;
  out.layers = {Image(grid, ScalarType::u16), Image(grid, ScalarType::u16)};
  std::uint16_t next = 1;
  for (const ClassMap& map : maps) {
    const auto to = out.layers[map.task == "body" ? 1 : 0].scalars<std::uint16_t>();
    std::map<std::uint8_t, std::uint16_t> ids;
    for (const auto& [id, name] : map.names) {
      if (map.task == "craniofacial_structures" && name == "skull") continue;
      ids.emplace(static_cast<std::uint8_t>(id), next);
      out.names.emplace(next, name);
      if (io::SegmentCodes codes = codes_of(name); !codes.type.empty())
        out.codes.emplace(next, std::move(codes));
      ++next;
    }
    const auto from = map.image.scalars<std::uint8_t>();
    for (std::size_t v = 0; v < from.size(); ++v) {
      if (const auto id = ids.find(from[v]); id != ids.end()) to[v] = id->second;
    }
  }
  return out;
}

// The CT as a series, and the segmentation of it; both in one frame of reference.
void write_dicom(const fs::path& folder, const std::vector<ClassMap>& maps, const Image& ct) {
  io::DicomFacts facts;
  facts.patient = "PHANTOM";
  facts.pose = facts.words = "scan";
  facts.derivation = "The built-in phantom of ecorche: no patient. For training and education.";
  facts.program = ECORCHE_VERSION;
  io::write_dicom_series(folder / "ct", ct, "ct", facts);
  io::write_dicom_segmentation(folder / "segmentation.dcm", in_one(maps), "segmentation", facts);
}

}  // namespace

void write_phantom_scan(const fs::path& folder, const std::string& form, const Case& patient,
                        const Context& context) {
  const bool moose = form == "moose", slicer = form == "slicer", dicom = form == "dicom";
  const std::vector<ClassMap> maps = phantom::segmented_by(
      moose ? phantom::Segmenter::moose : phantom::Segmenter::totalsegmentator, patient.labels.value());
  files::make_folder(folder);
  std::size_t done = 0;
  for (const ClassMap& map : maps) {
    if (slicer || dicom) break;
    if (moose) {
      write_moose(folder / "segmentations", map);
    } else if (form == "totalsegmentator") {
      write_masks(folder / map.task, map);
    } else {
      io::write_named_nifti(folder / (map.task + ".nii.gz"), map.image, map.names);
    }
    context.report(static_cast<double>(++done) / static_cast<double>(maps.size()));
  }
  const Image& ct = patient.volumes.front().image;
  if (dicom) return write_dicom(folder, maps, ct);
  if (slicer) io::write_segmentation(folder / "segmentation.seg.nrrd", in_one(maps));
  io::write_image(folder / (slicer ? "ct.nrrd" : "ct.nii.gz"), ct);
}

}  // namespace ecorche::app
