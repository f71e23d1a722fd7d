// SPDX-License-Identifier: Apache-2.0
// `ecorche refill`: a volume from its volumetric skeleton, posed, changed or both (Gagvani01 5-6).
#include <chrono>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>

#include "app/balls_of_file.hpp"
#include "app/bridge_option.hpp"
#include "app/cli.hpp"
#include "app/command.hpp"
#include "app/pose_frames.hpp"
#include "app/posed_dicom.hpp"
#include "app/read_budget.hpp"
#include "app/usage_error.hpp"
#include "core/files/atomic_file.hpp"
#include "core/values/text.hpp"
#include "io/case/digest.hpp"
#include "io/image/image_file.hpp"
#include "io/surface/surface_file.hpp"
#include "io/surface/volumetric_skeleton_file.hpp"
#include "runtime/spheres/coverage.hpp"
#include "runtime/spheres/effects.hpp"
#include "runtime/spheres/morph.hpp"
#include "runtime/spheres/pose_volume.hpp"
#include "runtime/spheres/preview.hpp"
#include "runtime/spheres/refill.hpp"
#include "runtime/spheres/seams.hpp"

namespace ecorche::app {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

struct RefillSettings {
  fs::path skeleton, volume, output, rig, object;
  io::ImageChoice choice;  // of `volume`
  DicomSettings dicom;
  FrameChoice frames;
  std::vector<double> region;
  double voxel_mm = 0;
  double background = 0;
  std::string sampling = "trilinear";
  double bulge = 0, explode = 0, time = 1;
  bool melt = false, back = false, bridge = true;
  std::vector<std::string> morph;

  bool writes_dicom() const { return output.extension() == ".dicom"; }
  bool poses() const { return !frames.pose.empty() || !frames.motion.file.empty(); }
  runtime::Sampling how() const {
    return sampling == "nearest" ? runtime::Sampling::nearest : runtime::Sampling::trilinear;
  }
};

void check(const RefillSettings& s) {
  check_dicom_options(s.dicom, s.writes_dicom(), "name the output NAME.dicom");
  const bool rigged = !s.rig.empty() || s.skeleton.extension() == ".hdf";
  if (s.poses() && !rigged)
    usage_error("--rig", "a pose needs a rig", "add --rig SKELETON.yaml or MODEL.hdf");
  if (!s.rig.empty() && !s.poses())
    usage_error("--rig", "nothing is posed", "add --pose FILE or --motion CLIP --frames A:B");
  if (s.back && !s.poses()) usage_error("--back", "no pose to come back from", "add --rig and --pose");
  if (s.bulge != 0 && !rigged) usage_error("--bulge", "joints are needed", "add --rig and --pose");
  if (io::writes_surface(s.output) && (!s.region.empty() || !s.volume.empty()))
    usage_error("--output", "a preview shows no values", "leave out VOLUME and --region, or name an image");
  if (!s.morph.empty() && (s.volume.empty() || s.poses() || !s.region.empty() || s.voxel_mm > 0))
    usage_error("--morph", "two objects at rest become each other",
                "give VOLUME, and neither a pose, a region nor --voxel");
  for (std::size_t a = 0; a + 3 < s.region.size(); ++a) {
    if (!(s.region[a] <= s.region[a + 3]))
      usage_error("--region", "its low corner is not the low one", "give X0,Y0,Z0,X1,Y1,Z1");
  }
}

// A frame's own file: OUT itself, or OUT_frame_0012 where there are several.
fs::path output_of(const RefillSettings& s, const Frame& frame) {
  if (frame.name.empty()) return s.output;
  // `.nii.gz` is one ending.
  std::string name = s.output.filename().string();
  const std::size_t dot = name.find('.');
  return s.output.parent_path() / (name.substr(0, dot) + "_" + frame.name + name.substr(dot));
}

void apply_effects(const RefillSettings& s, const Rig& rig, runtime::BallSet& set) {
  if (s.bulge != 0) runtime::bulge(set, rig.skeleton, runtime::bulges_of(set, rig.skeleton, s.bulge), s.time);
  if (s.melt) runtime::melt(set, s.time);
  if (s.explode != 0) runtime::explode(set, s.time, s.explode);
}

std::size_t count_object(const fs::path& path, const files::ReadOptions& options) {
  const Image image = io::read_image(path, options);
  std::size_t held = 0;
  with_scalar_type(image.type, [&](auto zero) {
    for (const auto v : image.scalars<decltype(zero)>()) held += v != 0;
  });
  return held;
}

double seconds_since(std::chrono::steady_clock::time_point start) {
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

// An image as the name of its file says.
class Output {
 public:
  Output(const Program& program, const RefillSettings& s) : program_(program) {
    if (!s.writes_dicom()) return;
    DicomSettings from = s.dicom;
    std::error_code ignored;
    if (from.source.empty() && fs::is_directory(s.volume, ignored)) from = {s.volume, s.choice.series, false};
    facts_ = dicom_facts(program, from, "ECORCHE-" + text::hex(io::file_digest(s.skeleton, {})),
                         "Filled again around its volumetric skeleton by ecorche refill. For training and "
                         "education.");
    facts_->words = "refilled";
  }
  void write(const fs::path& path, const Image& image) const {
    facts_ ? io::write_dicom_series(path, image, path.stem().string(), *facts_, reading(program_, {}))
           : io::write_image(path, image);
  }

 private:
  const Program& program_;
  std::optional<io::DicomFacts> facts_;
};

// What one frame wrote.
json write_frame(const RefillSettings& s, const runtime::BallSet& set, const Image& volume,
                 const fs::path& path, const Output& output, const Context& context) {
  const auto start = std::chrono::steady_clock::now();
  json out{{"file", path.string()}, {"balls", set.balls.size()}};
  if (io::writes_surface(s.output)) {
    const SurfaceMesh mesh = runtime::preview(set);
    out["seconds"] = seconds_since(start);
    out["triangles"] = mesh.F.rows();
    io::write_surface(path, mesh);
    return out;
  }
  std::optional<runtime::Region> region;
  if (!s.region.empty())
    region = {{s.region[0], s.region[1], s.region[2]}, {s.region[3], s.region[4], s.region[5]}};
  const runtime::LatticeBox box = runtime::box_for(set, region);
  if (grid_of(set.lattice, box).voxels() > (std::size_t{1} << 31))
    usage_error("--region", "it holds more than 2^31 voxels", "make it smaller");
  const Image image = volume.bytes.empty()
                          ? runtime::covered(set, box, context)
                          : runtime::refill(set, box, volume, s.background, s.how(), context);
  out["seconds"] = seconds_since(start);
  out["size"] = image.grid.size;
  out["held_voxels"] = runtime::covered_voxels(set, box, context);
  output.write(path, image);
  return out;
}

json run_morph(const RefillSettings& s, const VolumetricSkeleton& skeleton, const Image& volume,
               const Image& target, const Output& output, const Context& context) {
  const VolumetricSkeleton other = read_skeleton_and_rig(s.morph[0], {}).first;
  const runtime::BallSet from = runtime::balls_at_rest(skeleton, skeleton.grid);
  const runtime::BallSet to = runtime::balls_at_rest(other, other.grid);
  const auto start = std::chrono::steady_clock::now();
  const Image image = runtime::morph({from, volume}, {to, target}, s.time, s.background, s.how(), context);
  json out{{"file", s.output.string()},
           {"balls", from.balls.size() + to.balls.size()},
           {"size", image.grid.size},
           {"seconds", seconds_since(start)}};
  output.write(s.output, image);
  return out;
}

// Reconstruction loss: what the object has and no ball at rest holds.
json loss(const RefillSettings& s, const VolumetricSkeleton& skeleton, const files::ReadOptions& options,
          const Context& context) {
  const std::size_t object = count_object(s.object, options);
  const runtime::BallSet rest = runtime::balls_at_rest(skeleton, skeleton.grid);
  const auto start = std::chrono::steady_clock::now();
  const std::size_t held = runtime::covered_voxels(rest, {{0, 0, 0}, skeleton.grid.size}, context);
  if (held > object)
    throw Error(
        ErrorKind::data, s.object.string(),
        "the balls hold " + std::to_string(held) + " voxels of an object of " + std::to_string(object),
        "name the mask that was thinned, on its own voxels");
  return {{"object_voxels", object},
          {"held_voxels", held},
          {"loss_percent",
           object > 0 ? 100.0 * static_cast<double>(object - held) / static_cast<double>(object) : 0.0},
          {"seconds", seconds_since(start)}};
}

std::string refill_text(const json& result) {
  std::string text;
  char line[400];
  for (const json& f : result["frames"]) {
    std::snprintf(line, sizeof line, "%s: %zu balls, filled in %.3f s", f["file"].get<std::string>().c_str(),
                  f["balls"].get<std::size_t>(), f["seconds"].get<double>());
    text += (text.empty() ? "" : "\n") + std::string(line);
    if (f.contains("held_voxels"))
      text += ", " + std::to_string(f["held_voxels"].get<std::size_t>()) + " voxels held";
    if (f.contains("triangles"))
      text += ", " + std::to_string(f["triangles"].get<std::size_t>()) + " triangles";
  }
  std::snprintf(line, sizeof line, "\n%.3f s in all, with reading and writing",
                result["seconds"].get<double>());
  text += line;
  if (result.contains("loss")) {
    std::snprintf(line, sizeof line, "\nloss: %.4f %% of %zu object voxels lie in no ball",
                  result["loss"]["loss_percent"].get<double>(),
                  result["loss"]["object_voxels"].get<std::size_t>());
    text += line;
  }
  return text;
}

// The volume's own lattice, so that what is posed and brought back lies where it lay; see posed_lattice.
ImageGrid lattice_for(const RefillSettings& s, const VolumetricSkeleton& skeleton, const Image& volume) {
  if (s.voxel_mm > 0) return runtime::lattice_of(skeleton, s.voxel_mm);
  if (volume.bytes.empty()) return skeleton.grid;
  ModelVolume shown;
  shown.image.grid = volume.grid;
  return runtime::posed_lattice(skeleton, shown);
}

int run(const Program& program, const RefillSettings& s) {
  const auto start = std::chrono::steady_clock::now();
  check(s);
  { const files::AtomicFile probe(s.output); }
  const auto [skeleton, rig] = read_skeleton_and_rig(s.skeleton, s.rig);
  if (skeleton.size() == 0)
    throw Error(ErrorKind::data, s.skeleton.string(), "it has no voxel", "thin at a lower TP");
  const files::ReadOptions options = reading(program, s.frames.motion.limits);
  const Output output(program, s);
  const Image volume = s.volume.empty() ? Image() : io::read_image(s.volume, options, s.choice);
  json result{{"ok", true}, {"frames", json::array()}};
  if (!s.object.empty()) result["loss"] = loss(s, skeleton, options, program.context("loss"));
  if (!s.morph.empty()) {
    result["frames"].push_back(run_morph(s, skeleton, volume, io::read_image(s.morph[1], options), output,
                                         program.context("morph")));
  } else {
    const ImageGrid lattice = lattice_for(s, skeleton, volume);
    runtime::Seams seams;
    // On the way back nothing is open: at rest every voxel lies in a ball of the body.
    if (s.bridge && s.poses() && !s.back)
      seams = runtime::seams_of(runtime::balls_at_rest(skeleton, lattice), skeleton.segment, rig.skeleton,
                                program.context("seams"));
    const std::vector<Frame> frames = s.poses() ? read_frames(program, s.frames, rig) : std::vector<Frame>(1);
    note_missed(program, frames);
    for (const Frame& frame : frames) {
      std::size_t clamped = 0;
      runtime::BallSet set = s.poses() ? posed_balls(skeleton, lattice, rig, frame.pose, seams, clamped)
                                       : runtime::balls_at_rest(skeleton, lattice);
      if (clamped > 0) program.note("note: limits held back " + std::to_string(clamped) + " joint(s)");
      apply_effects(s, rig, set);
      if (s.back) set = runtime::way_back(set);
      result["frames"].push_back(
          write_frame(s, set, volume, output_of(s, frame), output, program.context("refill")));
    }
  }
  result["seconds"] = seconds_since(start);
  program.result(refill_text(result), result);
  return 0;
}

}  // namespace

void declare_refill(CLI::App& app, Program& program, Run& chosen) {
  const auto s = std::make_shared<RefillSettings>();
  CLI::App* command = app.add_subcommand(
      "refill", "fill a volume again around its volumetric skeleton: posed, changed, or at rest");
  command
      ->add_option("SKELETON", s->skeleton,
                   "a skeleton that thin made (.vtp), or a model that holds spheres (.hdf)")
      ->required();
  command->add_option("VOLUME", s->volume, "the values to fill with; without it: 1 in every ball");
  command
      ->add_option("-o,--output", s->output,
                   "an image (.nrrd .mha .nii.gz, or a folder of CT slices, .dicom), or a surface (.glb .vtp "
                   ".stl ...) of a few spheres to preview")
      ->required();
  add_image_choice(*command, s->choice);
  add_dicom_options(*command, s->dicom);
  command->add_option("--rig", s->rig,
                      "the rig that the skeleton hangs on: a skeleton file (.yaml) or a model (.hdf)");
  add_frame_options(*command, s->frames);
  command
      ->add_option("--region", s->region, "X0,Y0,Z0,X1,Y1,Z1, LPS mm: fill this box of the posed space only")
      ->delimiter(',')
      ->expected(6);
  command
      ->add_option(
          "--voxel", s->voxel_mm,
          "edge of the posed voxels, mm (default: the volume's where they are cubic, else the skeleton's)")
      ->check(CLI::Range(0.01, 100.0));
  command->add_option("--background", s->background, "value where nothing is")->capture_default_str();
  command->add_option("--sampling", s->sampling, "nearest (labels) or trilinear")
      ->check(CLI::IsMember({"nearest", "trilinear"}))
      ->capture_default_str();
  command
      ->add_option(
          "--bulge", s->bulge,
          "balls at joints grow by this share (negative: shrink); the new shell shows the ball's rim")
      ->check(CLI::Range(-0.99, 10.0));
  add_bridge_option(*command, s->bridge);
  command->add_flag("--melt", s->melt, "small balls go first; at time 1 none is left");
  command
      ->add_option("--explode", s->explode,
                   "balls move apart, by this share of their distance from the middle")
      ->check(CLI::Range(0.0, 100.0));
  command->add_option("--morph", s->morph, "SKELETON VOLUME of what this object becomes")->expected(2);
  command->add_flag("--back", s->back,
                    "VOLUME is posed: bring it back to rest, by the same balls the other way");
  command->add_option("--time", s->time, "how far an effect has gone, 0 to 1")
      ->check(CLI::Range(0.0, 1.0))
      ->capture_default_str();
  command->add_option("--object", s->object,
                      "the mask that was thinned: says what share of it no ball holds");
  command->callback([&program, &chosen, s] { chosen = [&program, s] { return run(program, *s); }; });
}

}  // namespace ecorche::app
