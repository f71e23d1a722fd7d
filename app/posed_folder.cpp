// SPDX-License-Identifier: Apache-2.0
#include "app/posed_folder.hpp"

#include <algorithm>
#include <map>
#include <nlohmann/json.hpp>
#include <set>

#include <ecorche/io/case_file.hpp>
#include "core/files/atomic_file.hpp"
#include "core/files/look.hpp"
#include "io/case/digest.hpp"
#include "io/surface/surface_file.hpp"
#include "io/surface/tied_surfaces.hpp"

namespace ecorche::app {
namespace {

namespace fs = std::filesystem;

const std::set<std::string> kImageEndings{".nrrd", ".mha", ".gz"};

// What of `target` an earlier pose wrote, all of it; refuses what it did not.
std::vector<fs::path> old_files(const fs::path& target, const fs::path& stage) {
  std::vector<fs::path> found;
  for (fs::path& file : files::files_within(target)) {
    if (*file.begin() != stage.filename()) found.push_back(std::move(file));
  }
  if (found.empty()) return found;
  const std::optional<PosedManifest> manifest = read_manifest(target);
  for (const fs::path& file : found) {
    if (manifest && (file == kManifest || manifest->find(file.generic_string()) != nullptr)) continue;
    throw Error(ErrorKind::cannot_create, target.string(),
                "holds " + file.string() + ", which is of no posed body here",
                "name another folder, or take away what is in it");
  }
  return found;
}

// What a file is, by its name.
class Naming {
 public:
  Naming(const Model& model, bool field) : model_(model), field_(field) {}

  PosedFile of(const fs::path& file) const {
    PosedFile out{file.generic_string(), PosedKind::other, "", 0, 0, {}};
    const std::string name = file.filename().string(), stem = name.substr(0, name.find('.')),
                      ending = file.extension().string();
    if (name == kPoseFile) out.kind = PosedKind::pose;
    if (name == "quality.json") out.kind = PosedKind::quality;
    if (name == kTets) {
      out.kind = PosedKind::tets;
      out.labels.emplace(TetMesh::soft, "soft");
      for (const std::string& bone : model_.bone_names) out.labels.emplace(out.labels.size(), bone);
    }
    if (name == kScanSurfaces) out.kind = PosedKind::scan;
    if (const Tissue* tissue = io::writes_surface(file) ? tissue_of(stem) : nullptr) {
      out.kind = PosedKind::surface;
      out.of = tissue->name;
    }
    if (ending == ".dcm") return of_dicom(file, std::move(out));
    if (!kImageEndings.contains(ending)) return out;
    if (const std::string shown = masked(stem); !shown.empty()) {
      out.kind = PosedKind::mask;
      out.of = shown;
    } else if (field_ && (stem == "displacement" || stem == "mask")) {
      out.kind = PosedKind::field;
    } else if (const ModelVolume* volume = named(model_.volumes, stem)) {
      out.kind = volume->labels ? PosedKind::labels : PosedKind::image;
      out.of = stem;
      out.labels = volume->table;
    }
    return out;
  }

 private:
  // `labels.dcm`, and the slices in `ct.dicom`.
  PosedFile of_dicom(const fs::path& file, PosedFile out) const {
    const std::string stem = (file.has_parent_path() ? file.parent_path() : file).stem().string();
    if (const std::string shown = masked(stem); !shown.empty()) {
      out.kind = PosedKind::mask;
      out.of = shown;
      return out;
    }
    const ModelVolume* volume = named(model_.volumes, stem);
    out.kind = file.has_parent_path() ? PosedKind::image : PosedKind::labels;
    out.of = stem;
    for (const ModelVolume& one : model_.volumes) {
      if (one.labels && out.kind == PosedKind::labels) out.labels.insert(one.table.begin(), one.table.end());
    }
    if (volume == nullptr && out.kind == PosedKind::image) out.kind = PosedKind::other;
    return out;
  }
  // The volume whose mask is called so; empty: none.
  std::string masked(const std::string& stem) const {
    if (!stem.ends_with(kMaskEnding)) return {};
    const std::string volume = stem.substr(0, stem.size() - kMaskEnding.size());
    return named(model_.volumes, volume) == nullptr ? std::string() : volume;
  }
  template <class T>
  static const T* named(const std::vector<T>& items, const std::string& name) {
    const auto found =
        std::find_if(items.begin(), items.end(), [&](const T& one) { return one.name == name; });
    return found == items.end() ? nullptr : &*found;
  }
  // A case's skin lies in skin.stl, whatever its name.
  const Tissue* tissue_of(const std::string& stem) const {
    const Tissue* found = named(model_.tissues, stem);
    return found == nullptr && stem == "skin" ? model_.tissues.data() : found;
  }

  const Model& model_;
  bool field_;
};

PosedSurface surface_of(const Model& model, const Tissue& tissue, const runtime::PosedBody& body) {
  PosedSurface out{tissue.name,
                   tissue.group,
                   static_cast<std::uint64_t>(tissue.V.rows()),
                   static_cast<std::uint64_t>(tissue.F.rows()),
                   "",
                   {}};
  if (tissue.segment == Tissue::by_tets) return out;
  const auto segment = static_cast<std::size_t>(tissue.segment);
  out.segment = model.rig.skeleton.segments[segment].name;
  out.motion = body.segments[segment];
  return out;
}

// `tissues` one behind the other.
io::TiedSurfaces tied(const std::vector<const Tissue*>& tissues) {
  io::TiedSurfaces out;
  Eigen::Index vertices = 0, triangles = 0;
  for (const Tissue* tissue : tissues) {
    vertices += tissue->V.rows();
    triangles += tissue->F.rows();
  }
  out.V.resize(vertices, 3);
  out.F.resize(triangles, 3);
  out.share.setZero(vertices, 4);
  out.tet.assign(static_cast<std::size_t>(vertices), -1);
  vertices = triangles = 0;
  for (const Tissue* tissue : tissues) {
    out.V.middleRows(vertices, tissue->V.rows()) = tissue->V;
    out.F.middleRows(triangles, tissue->F.rows()) = tissue->F.array() + static_cast<std::int32_t>(vertices);
    if (tissue->segment == Tissue::by_tets) {
      out.share.middleRows(vertices, tissue->V.rows()) = tissue->barycentric;
      std::copy(tissue->tet.begin(), tissue->tet.end(), out.tet.begin() + vertices);
    }
    vertices += tissue->V.rows();
    triangles += tissue->F.rows();
  }
  return out;
}

}  // namespace

PosedFolder::PosedFolder(const fs::path& target)
    : staged_(target, std::string(kManifest)),
      old_(files::is_there(staged_.target()) ? old_files(staged_.target(), staged_.stage())
                                             : std::vector<fs::path>()) {}

std::vector<std::string> PosedFolder::finish(const Model& model, const runtime::PosedBody& body,
                                             const Pose& asked, const PosedAs& as, const Context& context) {
  const fs::path& stage = staged_.stage();
  std::vector<std::string> added{std::string(kPoseFile)};
  files::write_text(stage / kPoseFile, io::pose_to_yaml(asked, model.rig));
  PosedManifest manifest{model.name, as.identity, as.skinning, as.deformer, as.unfolded, as.settled, {}, {}};
  const Naming naming(model, as.field);
  std::set<std::string> written;
  for (const fs::path& file : files::files_within(stage)) {
    manifest.files.push_back(naming.of(file));
    if (manifest.files.back().kind == PosedKind::surface) written.insert(manifest.files.back().of);
  }
  std::vector<const Tissue*> tissues;
  for (const Tissue& tissue : model.tissues) {
    if (!written.contains(tissue.name)) continue;
    tissues.push_back(&tissue);
    manifest.surfaces.push_back(surface_of(model, tissue, body));
  }
  if (!tissues.empty() && manifest.find(std::string(kTets)) != nullptr) {
    context.check_stop();
    io::write_tied_surfaces(stage / kScanSurfaces, tied(tissues));
    manifest.files.push_back(naming.of(kScanSurfaces));
    added.emplace_back(kScanSurfaces);
  }
  std::sort(manifest.files.begin(), manifest.files.end(),
            [](const PosedFile& a, const PosedFile& b) { return a.file < b.file; });
  for (PosedFile& file : manifest.files) {
    file.bytes = fs::file_size(stage / file.file);
    file.digest = io::file_digest(stage / file.file, context);
  }
  files::write_text(stage / kManifest, to_json(manifest));
  added.emplace_back(kManifest);
  context.check_stop();
  staged_.commit(old_);
  return added;
}

void check_folder_of_a_body(const fs::path& folder) {
  const PosedFolder probe(folder);
}

void check_folder_of_frames(const fs::path& folder) {
  if (!files::is_there(folder / kManifest)) return;
  throw Error(ErrorKind::cannot_create, folder.string(), "is the folder of one posed body, not of frames",
              "name another folder");
}

}  // namespace ecorche::app
