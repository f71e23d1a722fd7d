// SPDX-License-Identifier: Apache-2.0
// `ecorche unpose`: what was posed, or drawn on the posed body, back to how the patient was scanned.
#include <algorithm>
#include <filesystem>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <set>

#include <ecorche/model_file/model_file.hpp>
#include "app/cli.hpp"
#include "app/command.hpp"
#include "app/images_back.hpp"
#include "app/posed_tets.hpp"
#include "app/surfaces_back.hpp"
#include "app/unpose_report.hpp"
#include "core/files/atomic_file.hpp"
#include "core/files/look.hpp"
#include "core/files/staged_folder.hpp"
#include "io/image/dicom.hpp"
#include "io/image/image_file.hpp"
#include "io/image/segmentation.hpp"
#include "io/surface/surface_file.hpp"
#include "preprocess/mapping/bind.hpp"
#include "preprocess/mapping/carry_back.hpp"
#include "preprocess/mapping/most_squeezed.hpp"

namespace ecorche::app {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

struct UnposeSettings {
  fs::path posed, output, model;
  std::vector<fs::path> files;
  std::vector<std::string> labels;
  std::string sampling = "trilinear";
};

const std::set<std::string> kImages{".nrrd", ".mha", ".gz"};

bool is_body(const fs::path& file) {
  return io::writes_surface(file) || kImages.contains(file.extension().string()) || io::is_dicom(file);
}

// `labels`, `labels_2`, ... and what the user names.
bool is_labels(const std::string& name, const UnposeSettings& settings) {
  return name == "labels" || name.starts_with("labels_") ||
         std::find(settings.labels.begin(), settings.labels.end(), name) != settings.labels.end();
}

std::string name_of(const fs::path& file) {
  const std::string name = file.filename().string();
  return name.substr(0, name.find('.'));
}

// What was DICOM comes back as NRRD: on the way its frame of reference has changed twice.
fs::path back_name(const fs::path& file) {
  fs::path name = file.filename();
  if (!io::is_dicom(file)) return name;
  return name.stem().string() + (name.extension() == ".dcm" ? ".seg.nrrd" : ".nrrd");
}

// A file that is to come back.
struct Item {
  fs::path from, to;
  const PosedFile* known = nullptr;  // as pose wrote it; else drawn on the posed body
};

// What `root` says of itself, held against what lies there.
class Source {
 public:
  Source(const Program& program, const UnposeSettings& settings)
      : settings_(settings),
        context_(program.context("check")),
        tets_(files::is_folder(settings.posed) ? settings.posed / kTets : settings.posed),
        root_(tets_.parent_path().empty() ? fs::path(".") : tets_.parent_path()),
        manifest_(read_manifest(root_)) {
    if (manifest_ && tets_.filename() == kTets && files::is_there(tets_)) check(std::string(kTets));
  }

  const fs::path& tets() const { return tets_; }
  const fs::path& root() const { return root_; }
  const PosedManifest* manifest() const { return manifest_ ? &*manifest_ : nullptr; }

  std::vector<Item> items() const { return settings_.files.empty() ? found() : named(); }

 private:
  // Named ones may lie anywhere and be anything.
  std::vector<Item> named() const {
    std::vector<Item> out;
    for (const fs::path& file : settings_.files) {
      if (!is_body(file))
        throw Error(ErrorKind::usage, file.string(),
                    "is neither a surface nor an image that can be carried back",
                    "give .stl, .obj, .ply, .off, .vtp, .glb, .nrrd, .mha, .nii.gz or DICOM");
      std::error_code ignored;
      const fs::path below = fs::relative(file, root_, ignored);
      const PosedFile* known = manifest_ ? manifest_->find(below.generic_string()) : nullptr;
      if (known != nullptr && !is_as_written(root_, *known, context_)) known = nullptr;
      out.push_back({file, settings_.output / back_name(file), known});
    }
    return out;
  }

  // All of the posed body, which must be whole and its own.
  std::vector<Item> found() const {
    if (!manifest_)
      throw Error(ErrorKind::data, root_.string(),
                  "holds no " + std::string(kManifest) + ", so nothing says what its files are",
                  "pose again into a new folder, or name the files that are to come back");
    for (const fs::path& file : files::files_within(root_)) {
      if (is_body(root_ / file) && manifest_->find(file.generic_string()) == nullptr)
        throw Error(ErrorKind::data, (root_ / file).string(), "is not of this posed body",
                    "move it elsewhere, or name it to bring it back with what lies around it");
    }
    std::vector<Item> out;
    for (const PosedFile& file : manifest_->files) {
      check(file.file);
      const bool image = file.kind == PosedKind::image || file.kind == PosedKind::labels;
      if (!image && file.kind != PosedKind::surface) continue;
      if (image && manifest_->deformer != "tets")
        throw Error(ErrorKind::data, (root_ / file.file).string(), "was filled by " + manifest_->deformer,
                    "bring it back by ecorche refill --back, and name the other files here");
      // All slices of one series lie in one folder, and come back as one image.
      const fs::path name(file.file),
          whole = name.parent_path().extension() == ".dicom" ? name.parent_path() : name;
      if (!out.empty() && out.back().from == root_ / whole) continue;
      out.push_back(
          {root_ / whole, settings_.output / whole.parent_path() / back_name(root_ / whole), &file});
    }
    return out;
  }

  void check(const std::string& name) const {
    const PosedFile* file = manifest_->find(name);
    const fs::path path = root_ / name;
    std::error_code ignored;
    if (!fs::exists(path, ignored))
      throw Error(ErrorKind::missing_input, path.string(), "is missing from this posed body",
                  "pose again, or name the files that are to come back");
    if (file == nullptr || !is_as_written(root_, *file, context_))
      throw Error(ErrorKind::data, path.string(),
                  "is not as pose wrote it: it was altered, or is of another pose",
                  name == kTets ? "pose again into a new folder"
                                : "pose again, or name it to bring it back with what lies around it");
  }

  const UnposeSettings& settings_;
  Context context_;
  fs::path tets_, root_;
  std::optional<PosedManifest> manifest_;
};

class WayBack {
 public:
  WayBack(const UnposeSettings& settings, const Source& source, const Model* model, const Context& context)
      : settings_(settings),
        source_(source),
        model_(model),
        context_(context),
        body_(read_posed_tets(source.tets())),
        images_(body_, context) {}

  void bring(const Item& item) {
    files::make_folder(item.to.parent_path());
    if (!io::writes_surface(item.from)) {
      image(item);
    } else if (item.known != nullptr && item.known->kind == PosedKind::surface) {
      known_surface(item);
    } else {
      drawn_surface(item);
    }
    report_.files.push_back(item.to);
  }

  // Writes what marks the vertices in folds.
  UnposeReport& finish() {
    if (!folds_.empty()) {
      files::write_text(settings_.output / "folds.csv", "file,vertex,x_mm,y_mm,z_mm\n" + folds_);
      report_.files.push_back(settings_.output / "folds.csv");
    }
    return report_;
  }

 private:
  void known_surface(const Item& item) {
    if (!surfaces_) surfaces_ = std::make_unique<SurfacesBack>(source_.root(), *source_.manifest(), body_);
    const SurfacesBack::Returned back =
        surfaces_->bring(item.known->of, read_lps_surface(item.from), item.from.string(), context_);
    write(item.to, back.mesh, back.folded);
    report_.surfaces.push_back(back.trip);
  }

  // By the tets that hold its vertices, or are nearest.
  void drawn_surface(const Item& item) {
    if (!locator_) locator_ = std::make_unique<mapping::Locator>(body_.posed, body_.tets);
    SurfaceMesh mesh = read_lps_surface(item.from);
    mapping::Binding held = locator_->bind(mesh.V, context_);
    mapping::bind_to_most_squeezed(mesh.V, body_.rest, body_.posed, body_.tets, held, context_);
    std::vector<std::uint8_t> folded(held.tet.size());
    for (Eigen::Index v = 0; v < mesh.V.rows(); ++v) {
      const std::int32_t tet = held.tet[static_cast<std::size_t>(v)];
      Eigen::RowVector3d at = Eigen::RowVector3d::Zero();
      for (int c = 0; c < 4; ++c) {
        at += static_cast<double>(held.barycentric(v, c)) * body_.rest.row(body_.tets(tet, c)).cast<double>();
      }
      mesh.V.row(v) = at;
      const bool fold = mapping::is_folded({body_.rest, body_.posed, body_.tets}, tet);
      folded[static_cast<std::size_t>(v)] = fold ? 1 : 0;
      report_.drawn.folded += fold ? 1 : 0;
    }
    report_.drawn.vertices += held.tet.size();
    report_.drawn.outside += held.outside;
    report_.drawn.max_outside_mm = std::max(report_.drawn.max_outside_mm, held.max_outside_mm);
    write(item.to, mesh, folded);
  }

  // A .vtp holds the mark itself; for all formats the folded vertices stand in folds.csv.
  void write(const fs::path& to, const SurfaceMesh& mesh, const std::vector<std::uint8_t>& folded) {
    io::write_surface(to, mesh, {{"folded", 1, {folded.begin(), folded.end()}}});
    char line[120];
    for (std::size_t v = 0; v < folded.size(); ++v) {
      if (folded[v] == 0) continue;
      const auto x = mesh.V.row(static_cast<Eigen::Index>(v));
      std::snprintf(line, sizeof line, ",%zu,%.4f,%.4f,%.4f\n", v, x[0], x[1], x[2]);
      folds_ += to.lexically_relative(settings_.output).generic_string() + line;
    }
  }

  void image(const Item& item) {
    if (item.to.filename().string().ends_with(".seg.nrrd") && io::is_dicom(item.from)) return segments(item);
    const std::string name = name_of(item.from);
    const bool labels = is_labels(name, settings_) ||
                        (item.known != nullptr &&
                         (item.known->kind == PosedKind::labels || item.known->kind == PosedKind::mask));
    const Image back = images_.bring(
        io::read_image(item.from), labels,
        settings_.sampling == "nearest" ? runtime::Sampling::nearest : runtime::Sampling::trilinear);
    io::write_image(item.to, back);
    const runtime::VoxelTrip trip = images_.trip();
    ImageTrip told{item.to,      mask_for(back.grid, trip), trip.voxels, trip.elsewhere,
                   trip.mean_mm, trip.mean_voxels,          trip.max_mm, {}};
    if (model_ != nullptr && item.known != nullptr) {
      const auto volume = std::find_if(model_->volumes.begin(), model_->volumes.end(),
                                       [&](const ModelVolume& one) { return one.name == item.known->of; });
      if (volume != model_->volumes.end() && volume->image.type == back.type &&
          volume->image.components == back.components)
        told.against_scan = held_against(*model_, *volume, back);
    }
    report_.images.push_back(std::move(told));
  }

  // Of a DICOM SEG, layer by layer.
  void segments(const Item& item) {
    io::Segmentation read = io::read_segmentation(item.from);
    for (Image& layer : read.layers) layer = images_.bring(layer, true, runtime::Sampling::nearest);
    io::write_segmentation(item.to, read);
    const runtime::VoxelTrip trip = images_.trip();
    report_.images.push_back({item.to,
                              mask_for(read.layers.front().grid, trip),
                              trip.voxels,
                              trip.elsewhere,
                              trip.mean_mm,
                              trip.mean_voxels,
                              trip.max_mm,
                              {}});
  }

  // One for each lattice.
  fs::path mask_for(const ImageGrid& grid, const runtime::VoxelTrip& trip) {
    const auto known =
        std::find_if(masks_.begin(), masks_.end(), [&](const auto& one) { return one.first == grid; });
    if (known != masks_.end()) return known->second;
    const std::string number = masks_.empty() ? "" : "-" + std::to_string(masks_.size() + 1);
    fs::path file = settings_.output / ("folds-mask" + number + ".nrrd");
    io::write_image(file, ImagesBack::mask(grid, trip));
    report_.files.push_back(file);
    masks_.emplace_back(grid, file);
    return file;
  }

  const UnposeSettings& settings_;
  const Source& source_;
  const Model* model_;
  const Context& context_;
  PosedTets body_;
  ImagesBack images_;
  std::unique_ptr<SurfacesBack> surfaces_;
  std::unique_ptr<mapping::Locator> locator_;
  UnposeReport report_;
  std::string folds_;
  std::vector<std::pair<ImageGrid, fs::path>> masks_;
};

// The model that was posed.
Model read_scan(const Program& program, const UnposeSettings& settings, const Source& source) {
  Model model = model_file::read(settings.model, program.context("read"));
  if (source.manifest() == nullptr || model_file::identity(model) != source.manifest()->identity)
    throw Error(ErrorKind::data, settings.model.string(), "is not the model that was posed",
                "give that one, or leave out --model");
  return model;
}

int run(const Program& program, const UnposeSettings& settings) {
  const Source source(program, settings);
  std::error_code ignored;
  if (fs::equivalent(settings.output, source.root(), ignored))
    throw Error(ErrorKind::usage, "--output", "is the posed folder, which would be written over",
                "name another folder");
  std::optional<Model> model;
  if (!settings.model.empty()) model = read_scan(program, settings, source);
  const Context context = program.context("unpose");
  WayBack back(settings, source, model ? &*model : nullptr, context);
  const std::vector<Item> items = source.items();
  files::make_folder(settings.output);
  std::size_t done = 0;
  for (const Item& item : items) {
    context.check_stop();
    back.bring(item);
    context.report(static_cast<double>(++done) / static_cast<double>(items.size()));
  }
  const UnposeReport& report = back.finish();
  program.result(text_of(report), json_of(report));
  return 0;
}

}  // namespace

void declare_unpose(CLI::App& app, Program& program, Run& chosen) {
  const auto s = std::make_shared<UnposeSettings>();
  CLI::App* command = app.add_subcommand(
      "unpose", "bring what was posed, or drawn on the posed body, back to the scan: surfaces and images");
  command->add_option("POSED", s->posed, "a folder that pose wrote, with its body.vtu; or that file")
      ->required();
  command->add_option("FILES", s->files,
                      "surfaces and images in the posed body; without any, all that POSED holds of it");
  command->add_option("-o,--output", s->output, "folder to write into, made where absent")->required();
  command->add_option("--model", s->model,
                      "the model that was posed: images that come back are held against its own");
  command->add_option("--sampling", s->sampling, "of images: nearest or trilinear; labels are always nearest")
      ->check(CLI::IsMember({"nearest", "trilinear"}))
      ->capture_default_str();
  command
      ->add_option(
          "--labels", s->labels,
          "images that hold labels, by name with commas between; those called labels and labels_* do")
      ->delimiter(',');
  command->callback([&program, &chosen, s] { chosen = [&program, s] { return run(program, *s); }; });
}

}  // namespace ecorche::app
