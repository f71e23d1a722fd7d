// SPDX-License-Identifier: Apache-2.0
// `ecorche thin`: a sampled volume in, its volumetric skeleton out (Gagvani01 3-4).
#include "preprocess/thin/thinning.hpp"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <nlohmann/json.hpp>
#include <sstream>

#include "app/cli.hpp"
#include "app/command.hpp"
#include "app/hang_skeleton.hpp"
#include "app/read_budget.hpp"
#include "app/step_clock.hpp"
#include "app/usage_error.hpp"
#include "core/files/atomic_file.hpp"
#include "io/image/image_file.hpp"
#include "io/surface/volumetric_skeleton_file.hpp"
#include "preprocess/thin/isotropic.hpp"

namespace ecorche::app {
namespace {

namespace fs = std::filesystem;

struct ThinSettings {
  fs::path input, output;
  std::string threshold;
  thin::Segmentation segmentation;
  int boundary = 6;
  std::optional<double> isotropic_mm;
  std::string metric = "euclidean";
  // What the paper poses with: a third of a percent of a body's voxels.
  double thinness = 0.48;
  fs::path distance_map;
  HangSettings hang;
  files::ReadLimits limits;
  io::ImageChoice choice;
  std::vector<std::string> for_images;  // options that were given and have no meaning for a skeleton
};

std::optional<double> bound(const std::string& word, const std::string& all) {
  if (word.empty()) return std::nullopt;
  double value = 0;
  const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), value);
  if (error != std::errc() || end != word.data() + word.size() || !std::isfinite(value))
    usage_error("--threshold", "'" + all + "' is not LOW:HIGH", "as 300:1500, 300: or :1500");
  return value;
}

// LOW:HIGH, either of which may be left out.
void read_threshold(const std::string& text, thin::Segmentation& how) {
  if (text.empty()) return;
  const std::size_t colon = text.find(':');
  if (colon == text.npos || text.size() == 1)
    usage_error("--threshold", "'" + text + "' is not LOW:HIGH", "as 300:1500, 300: or :1500");
  how.low = bound(text.substr(0, colon), text);
  how.high = bound(text.substr(colon + 1), text);
}

bool is_skeleton(const fs::path& path) {
  return path.extension() == ".vtp";
}

// The image with cubes for voxels, which is told where it had others.
Image isotropic(const Program& program, const ThinSettings& settings, Image image, nlohmann::json& report) {
  const auto& old = image.grid;
  if (!settings.isotropic_mm) {
    if (thin::is_isotropic(old)) return image;
    std::ostringstream what;
    what << "voxels of " << old.spacing[0] << " x " << old.spacing[1] << " x " << old.spacing[2]
         << " mm are not isotropic";
    usage_error("--isotropic", what.str(), "resample them: --isotropic 0 for the finest edge, or give mm");
  }
  const bool grey = !settings.threshold.empty();
  Image out = thin::to_isotropic(image, settings.segmentation.component, *settings.isotropic_mm,
                                 grey ? thin::Sampling::trilinear : thin::Sampling::nearest,
                                 program.context("resampling"));
  std::ostringstream said;
  said << "resampled " << (grey ? "trilinearly" : "to the nearest") << " from " << old.size[0] << " x "
       << old.size[1] << " x " << old.size[2] << " to " << out.grid.size[0] << " x " << out.grid.size[1]
       << " x " << out.grid.size[2] << " voxels of " << out.grid.spacing[0] << " mm";
  program.note(said.str());
  report["resampled"] = {{"sampling", grey ? "trilinear" : "nearest"}, {"from_size", old.size}};
  return out;
}

// Distances in mm on the image's own voxels, whatever their edges.
int write_distances(const Program& program, const Image& image, const thin::Segmentation& how,
                    const fs::path& path) {
  const thin::Mask mask = thin::segment(image, how, program.context("segmenting"));
  const thin::Field<double> squares = thin::squared_distance_mm(mask, program.context("distance map"));
  Image map(image.grid, ScalarType::f32);
  std::transform(squares.data(), squares.data() + squares.size(), map.scalars<float>().begin(),
                 [](double square) { return static_cast<float>(std::sqrt(square)); });
  io::write_image(path, map);
  return 0;
}

// Without a choice of values the object is all that is not 0: said, since it may not be what was meant.
void note_object(const Program& program, const thin::Mask& mask) {
  const auto object = std::count(mask.inside.begin(), mask.inside.end(), 1);
  std::ostringstream said;
  said.precision(3);
  said << "the object is every value but 0, "
       << 100.0 * static_cast<double>(object) / static_cast<double>(mask.inside.size())
       << " % of the image; --threshold or --labels choose others";
  program.note(said.str());
}

// A fresh skeleton of an image, and the object that it is of.
VolumetricSkeleton from_image(const Program& program, const ThinSettings& settings, thin::Mask& mask,
                              StepClock& clock, nlohmann::json& report) {
  thin::Segmentation how = settings.segmentation;
  read_threshold(settings.threshold, how);
  how.boundary = settings.boundary == 6 ? thin::Boundary::faces_6 : thin::Boundary::all_26;
  Image image = clock.time("read", [&] {
    return io::read_image(settings.input, reading(program, settings.limits), settings.choice);
  });
  if (!settings.distance_map.empty())
    clock.time("distance_map", [&] { return write_distances(program, image, how, settings.distance_map); });
  const int components = image.components;
  image = clock.time("resample", [&] { return isotropic(program, settings, std::move(image), report); });
  if (image.components < components) how.component = 0;  // resampling has taken the one
  const bool largest = std::exchange(how.largest, false);
  mask = clock.time("segment", [&] { return thin::segment(image, how, program.context("segmenting")); });
  if (settings.threshold.empty() && settings.segmentation.labels.empty()) note_object(program, mask);
  image = {};
  const thin::Pieces found =
      clock.time("pieces", [&] { return thin::pieces(mask, how.boundary, program.context("pieces")); });
  if (largest && found.count > 1) {
    mask = clock.time("largest",
                      [&] { return largest_piece(mask, how.boundary, program.context("largest piece")); });
  } else if (found.count > 1) {
    program.note("the object is in " + std::to_string(found.count) + " pieces; --largest keeps the largest");
  }
  const std::size_t object = largest ? found.largest_voxels : found.voxels;
  const DistanceMetric metric =
      settings.metric == "euclidean" ? DistanceMetric::euclidean : DistanceMetric::chamfer345;
  const thin::DistanceMap map =
      clock.time("distance", [&] { return thin::distance_map(mask, metric, program.context("distance")); });
  VolumetricSkeleton skeleton = clock.time(
      "thinning", [&] { return thin::thin(map, mask.grid, settings.thinness, program.context("thinning")); });
  report["voxels"] = {{"image", mask.grid.voxels()},
                      {"object", object},
                      {"pieces", found.count},
                      {"largest_piece", found.largest_voxels}};
  report["share_percent"] = 100.0 * static_cast<double>(skeleton.size()) / static_cast<double>(object);
  return skeleton;
}

int run(const Program& program, const ThinSettings& settings) {
  if (settings.output.extension() != ".vtp")
    usage_error("--output", "'" + settings.output.string() + "' does not end in .vtp", "name it so");
  { const files::AtomicFile probe(settings.output); }
  check_hang_options(settings.hang);
  nlohmann::json report;
  StepClock clock;
  thin::Mask mask;
  io::VolumetricSkeletonFile file;
  if (is_skeleton(settings.input)) {
    if (!settings.for_images.empty())
      usage_error(settings.for_images[0].c_str(), "has no meaning for a skeleton", "thin the image again");
    file = clock.time("read", [&] { return io::read_volumetric_skeleton(settings.input, settings.limits); });
    file.skeleton = clock.time("thinning", [&] { return thin::thinner(file.skeleton, settings.thinness); });
  } else {
    file.skeleton = from_image(program, settings, mask, clock, report);
    file.skeleton.name = settings.output.stem().string();
  }
  if (file.skeleton.size() == 0) {
    throw Error(ErrorKind::data, settings.input.string(), "no voxel is left at this thinness",
                "choose a lower --tp");
  }
  hang(program, settings.hang, mask, file, clock, report);
  clock.time("write", [&] { return io::write_volumetric_skeleton(settings.output, file), 0; });
  const VolumetricSkeleton& s = file.skeleton;
  report["skeletal"] = s.size();
  report["tp"] = s.thinness;
  report["metric"] = s.metric == DistanceMetric::euclidean ? "euclidean" : "chamfer345";
  report["size"] = s.grid.size;
  report["voxel_mm"] = s.grid.spacing[0];
  report["seconds"] = clock.json();
  std::ostringstream text;
  text << settings.output.string() << ": " << s.size() << " skeletal voxels at TP " << s.thinness;
  if (report.contains("share_percent")) {
    text << ", " << report["share_percent"].get<double>() << " % of " << report["voxels"]["object"] << " in "
         << report["voxels"]["pieces"] << " piece(s)";
  }
  if (report.contains("tree")) {
    text << "\ntree of " << report["tree"]["edges"] << " edges in " << report["tree"]["components"]
         << " component(s)";
  }
  if (report.contains("attached")) {
    text << "\nattached: " << report["attached"]["first_pass"] << " to a bone that they see, "
         << report["attached"]["second_pass"] << " along the tree";
  }
  for (const auto& [step, seconds] : clock.seconds()) {
    char line[80];
    std::snprintf(line, sizeof line, "\n%-12s %8.3f s", step, seconds);
    text << line;
  }
  program.result(text.str(), report);
  return 0;
}

}  // namespace

void declare_thin(CLI::App& app, Program& program, Run& chosen) {
  const auto s = std::make_shared<ThinSettings>();
  CLI::App* command = app.add_subcommand("thin", "thin a sampled volume to its volumetric skeleton");
  command
      ->add_option("IMAGE", s->input, "an image, or a skeleton (.vtp), out of which a thinner one is taken")
      ->required();
  command->add_option("-o,--output", s->output, "the skeleton to write, ending in .vtp")->required();
  add_read_budget(*command, s->limits);
  add_image_choice(*command, s->choice);
  command->add_option("--threshold", s->threshold,
                      "LOW:HIGH, values of the object with both ends; one may be left out");
  command
      ->add_option("--labels", s->segmentation.labels,
                   "or these values exactly (without either: every value but 0)")
      ->delimiter(',');
  command->add_option("--component", s->segmentation.component, "which of a voxel's values, from 0")
      ->check(CLI::NonNegativeNumber)
      ->capture_default_str();
  command->add_flag("--largest", s->segmentation.largest, "keep the largest piece only");
  command
      ->add_option("--boundary", s->boundary,
                   "6 or 26: where background makes a boundary; pieces are joined by the other")
      ->check(CLI::IsMember({6, 26}))
      ->capture_default_str();
  command->add_option("--isotropic", s->isotropic_mm,
                      "resample to cubes of this edge, mm; 0: the finest spacing. Labels to the nearest, "
                      "thresholded values trilinearly");
  command->add_option("--distance-map", s->distance_map,
                      "also write each object voxel's distance to the background, mm, on the image's own "
                      "voxels (.nrrd, .mha, .nii.gz)");
  command->add_option("--metric", s->metric, "euclidean (exact) or chamfer345 (<3,4,5>)")
      ->check(CLI::IsMember({"euclidean", "chamfer345"}))
      ->capture_default_str();
  command->add_option("--tp", s->thinness, "thinness, voxels: -2 keeps every voxel, 2 none")
      ->check(CLI::Range(thin::least_thinness, thin::most_thinness))
      ->capture_default_str();
  add_hang_options(*command, s->hang);
  command->callback([&program, &chosen, s, command] {
    for (const char* option :
         {"--threshold", "--labels", "--component", "--largest", "--boundary", "--isotropic", "--metric",
          "--distance-map", "--skeleton", "--model", "--picks"}) {
      if (command->count(option) > 0) s->for_images.emplace_back(option);
    }
    chosen = [&program, s] { return run(program, *s); };
  });
}

}  // namespace ecorche::app
