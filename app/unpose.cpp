// SPDX-License-Identifier: Apache-2.0
// `ecorche unpose`: what was posed, or drawn on the posed body, back to how the patient was scanned.
#include <algorithm>
#include <filesystem>
#include <memory>
#include <optional>
#include <set>

#include "app/command.hpp"
#include "core/files/atomic_file.hpp"
#include "io/image/image_file.hpp"
#include "io/surface/surface_file.hpp"
#include "preprocess/mapping/bind.hpp"
#include "preprocess/mapping/round_trip.hpp"
#include "runtime/volume/grid_affine.hpp"
#include "runtime/volume/resample.hpp"

namespace ecorche::app {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

struct Settings {
  fs::path posed, output;
  std::vector<fs::path> files;
  std::vector<std::string> labels;
  std::string sampling = "trilinear";
};

constexpr std::string_view kTets = "body.vtu";
const std::set<std::string> kSurfaces{".stl", ".obj", ".ply", ".off", ".vtp", ".glb"};
const std::set<std::string> kImages{".nrrd", ".mha", ".gz"};

// The posed tets and their rest.
struct PosedTets {
  PointsF rest, posed;
  Tets tets;

  runtime::Deformation way_back() const { return {tets, numbers(posed), numbers(rest)}; }
  runtime::Deformation way_there() const { return way_back().back(); }

 private:
  static std::span<const float> numbers(const PointsF& points) {
    return {points.data(), static_cast<std::size_t>(points.size())};
  }
};

PosedTets read_posed(const fs::path& file) {
  io::TetFile read = io::read_tets(file);
  const auto moved = std::find_if(
      read.point_data.begin(), read.point_data.end(),
      [](const io::GridArray& array) { return array.name == "displacement" && array.components == 3; });
  if (moved == read.point_data.end()) {
    throw Error(ErrorKind::data, file.string(),
                "its nodes carry no displacement, so nothing says where they came from",
                "give the body.vtu that ecorche pose wrote");
  }
  PosedTets out;
  out.rest = read.V - Eigen::Map<const PointsF>(moved->values.data(), read.V.rows(), 3);
  // Rounded, a sliver may lose its volume; many that have none are not the rest of this body.
  Eigen::Index flat = 0;
  for (Eigen::Index t = 0; t < read.T.rows(); ++t) {
    const auto corner = [&](int c) { return out.rest.row(read.T(t, c)); };
    flat += tet_det(corner(0), corner(1), corner(2), corner(3)) > 0 ? 0 : 1;
  }
  if (1000 * flat > read.T.rows()) {
    throw Error(ErrorKind::data, file.string(),
                std::to_string(flat) + " of its " + std::to_string(read.T.rows()) +
                    " tets have no volume at rest: the displacement is not theirs",
                "give the body.vtu that ecorche pose wrote");
  }
  out.posed = std::move(read.V);
  out.tets = std::move(read.T);
  return out;
}

// `labels`, `labels_2`, ... and what the user names.
bool is_labels(const std::string& name, const Settings& settings) {
  return name == "labels" || name.starts_with("labels_") ||
         std::find(settings.labels.begin(), settings.labels.end(), name) != settings.labels.end();
}

std::string name_of(const fs::path& file) {
  const std::string name = file.filename().string();
  return name.substr(0, name.find('.'));
}

// Everything that `pose` writes and that lies in the posed body, in the order of names.
std::vector<fs::path> files_under(const fs::path& folder) {
  std::vector<fs::path> out;
  for (const auto& entry : fs::recursive_directory_iterator(folder)) {
    const fs::path& path = entry.path();
    const bool field = name_of(path) == "displacement" || name_of(path) == "mask";  // of pose --field
    const std::string ending = path.extension().string();
    if (entry.is_regular_file() && !field && (kSurfaces.contains(ending) || kImages.contains(ending)))
      out.push_back(path);
  }
  std::sort(out.begin(), out.end());
  return out;
}

double first_value(const Image& image, std::size_t voxel) {
  return with_scalar_type(image.type, [&](auto zero) {
    const auto row = voxel * static_cast<std::size_t>(image.components);
    return static_cast<double>(image.scalars<decltype(zero)>()[row]);
  });
}

class WayBack {
 public:
  WayBack(const Settings& settings, PosedTets body, const Context& context)
      : settings_(settings), body_(std::move(body)), context_(context) {}

  void surface(const fs::path& from, const fs::path& to) {
    if (!locator_) locator_ = std::make_unique<mapping::Locator>(body_.posed, body_.tets);
    SurfaceMesh mesh = io::read_surface(from);
    mapping::Binding held = locator_->bind(mesh.V, context_);
    mapping::bind_to_most_squeezed(mesh.V, body_.rest, body_.posed, body_.tets, held, context_);
    for (Eigen::Index v = 0; v < mesh.V.rows(); ++v) {
      Eigen::RowVector3d at = Eigen::RowVector3d::Zero();
      for (int c = 0; c < 4; ++c) {
        const std::int32_t node = body_.tets(held.tet[static_cast<std::size_t>(v)], c);
        at += static_cast<double>(held.barycentric(v, c)) * body_.rest.row(node).cast<double>();
      }
      mesh.V.row(v) = at;
    }
    io::write_surface(to, mesh);
  }

  void image(const fs::path& from, const fs::path& to) {
    ModelVolume volume;
    volume.name = name_of(from);
    volume.image = io::read_image(from);
    if (!voxels_) voxels_ = volume.image.grid;
    volume.labels = is_labels(volume.name, settings_);
    volume.background = background_of(volume.image);
    const runtime::Deformation back = body_.way_back();
    const ImageGrid grid = runtime::lattice_over(volume.image.grid, back.posed);
    if (!(back_.grid == grid)) runtime::locate(back, grid, back_, context_);
    const bool nearest = settings_.sampling == "nearest";
    io::write_image(to,
                    runtime::resample(back, back_, volume,
                                      nearest ? runtime::Sampling::nearest : runtime::Sampling::trilinear));
  }

  // In voxels of the first image that was brought back too.
  mapping::RoundTrip round_trip() const {
    const Eigen::Matrix3d to_voxels =
        voxels_ ? runtime::to_index(*voxels_).linear : Eigen::Matrix3d(Eigen::Matrix3d::Identity());
    return mapping::round_trip(body_.rest, body_.posed, body_.tets, context_, to_voxels);
  }
  bool has_voxels() const { return voxels_.has_value(); }

 private:
  // What the posed image holds where the body is not; 0 where the body fills it.
  double background_of(const Image& image) {
    if (!(there_.grid == image.grid)) runtime::locate(body_.way_there(), image.grid, there_, context_);
    const auto empty = std::find(there_.tet.begin(), there_.tet.end(), runtime::InverseMap::none);
    return empty == there_.tet.end()
               ? 0
               : first_value(image, static_cast<std::size_t>(empty - there_.tet.begin()));
  }

  const Settings& settings_;
  PosedTets body_;
  const Context& context_;
  runtime::InverseMap there_, back_;
  std::unique_ptr<mapping::Locator> locator_;
  std::optional<ImageGrid> voxels_;
};

int run(const Program& program, const Settings& settings) {
  const bool folder = fs::is_directory(settings.posed);
  const fs::path tets = folder ? settings.posed / kTets : settings.posed;
  const fs::path root = tets.parent_path();
  const std::vector<fs::path> files = settings.files.empty() ? files_under(root) : settings.files;
  for (const fs::path& file : files) {
    if (!kSurfaces.contains(file.extension().string()) && !kImages.contains(file.extension().string()))
      throw Error(ErrorKind::usage, file.string(),
                  "is neither a surface nor an image that can be carried back",
                  "give .stl, .obj, .ply, .off, .vtp, .glb, .nrrd, .mha or .nii.gz");
  }
  const Context context = program.context("unpose");
  PosedTets body = read_posed(tets);
  WayBack back(settings, std::move(body), context);
  files::make_folder(settings.output);
  json written = json::array();
  for (const fs::path& file : files) {
    context.check_stop();
    // Named ones may lie anywhere; found ones keep their folders.
    const fs::path to =
        settings.output / (settings.files.empty() ? fs::relative(file, root) : file.filename());
    files::make_folder(to.parent_path());
    if (kSurfaces.contains(file.extension().string())) {
      back.surface(file, to);
    } else {
      back.image(file, to);
    }
    written.push_back(to.string());
    context.report(static_cast<double>(written.size()) / static_cast<double>(files.size()));
  }
  const mapping::RoundTrip trip = back.round_trip();
  char line[200];
  std::snprintf(
      line, sizeof line,
      "%zu files; points come back within %.2g mm on average, %.3g %% of the body lay under another part",
      files.size(), trip.mean_mm, 100 * trip.elsewhere_share);
  json found{{"points", trip.points},
             {"mean_mm", trip.mean_mm},
             {"max_mm", trip.max_mm},
             {"elsewhere_share", trip.elsewhere_share}};
  if (back.has_voxels()) found["mean_voxels"] = trip.mean_voxels;
  program.result(line, {{"ok", true}, {"files", written}, {"round_trip", std::move(found)}});
  return 0;
}

}  // namespace

void declare_unpose(CLI::App& app, Program& program, Run& chosen) {
  const auto s = std::make_shared<Settings>();
  CLI::App* command = app.add_subcommand(
      "unpose", "bring what was posed, or drawn on the posed body, back to the scan: surfaces and images");
  command->add_option("POSED", s->posed, "a folder that pose wrote, with its body.vtu; or that file")
      ->required();
  command->add_option("FILES", s->files,
                      "surfaces and images in the posed body; without any, all that lie under POSED");
  command->add_option("-o,--output", s->output, "folder to write into, made where absent")->required();
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
