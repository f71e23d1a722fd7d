// SPDX-License-Identifier: Apache-2.0
// `ecorche phantom`: the built-in synthetic patient, as an ordinary case.
#include "phantom/phantom.hpp"

#include <fmt/format.h>

#include <filesystem>
#include <map>
#include <memory>
#include <nlohmann/json.hpp>

#include <ecorche/io/case_file.hpp>
#include "app/cli.hpp"
#include "app/command.hpp"
#include "app/phantom_scan.hpp"
#include "core/files/atomic_file.hpp"
#include "core/files/look.hpp"
#include "core/files/staged_folder.hpp"
#include "io/motion/bvh.hpp"

namespace ecorche::app {

namespace {

struct PhantomSettings {
  std::filesystem::path folder;
  std::string size = "standard";
  std::uint64_t seed = 1;
  double voxel_mm = 0;
  bool bar = false;
  bool vary = false;
  std::string scan;  // empty: a case
};

phantom::Size size_of(const PhantomSettings& settings) {
  return settings.size == "small"   ? phantom::Size::small
         : settings.size == "paper" ? phantom::Size::paper
                                    : phantom::Size::standard;
}

/// Refuses what is not ours to overwrite: a file, or a folder of something else.
void check_target(const std::filesystem::path& folder) {
  namespace fs = std::filesystem;
  if (!files::is_there(folder)) return;
  if (!files::is_folder(folder)) {
    throw Error(ErrorKind::cannot_create, folder.string(), "is a file", "name a folder with -o");
  }
  if (!fs::is_empty(folder) && !files::is_there(folder / "truth.yaml")) {
    throw Error(ErrorKind::cannot_create, folder.string(), "holds files, but no phantom",
                "name a new or empty folder with -o");
  }
}

int run(const Program& program, const PhantomSettings& settings) {
  check_target(settings.folder);
  { const files::StagedFolder probe(settings.folder, "truth.yaml"); }  // refused now, not after the drawing
  const phantom::Variety variety = settings.vary ? phantom::Variety::population : phantom::Variety::plain;
  const phantom::Phantom made = settings.bar
                                    ? phantom::make_bar(size_of(settings), program.context("bar"))
                                    : phantom::make(size_of(settings), settings.seed,
                                                    program.context("phantom"), settings.voxel_mm, variety);
  const Case& patient = made.patient;
  if (!settings.scan.empty()) {
    write_phantom_scan(settings.folder, settings.scan, patient, program.context("write"));
    files::write_text(settings.folder / "truth.yaml", io::skeleton_to_yaml(made.truth));
    program.result(settings.folder.string() + ": a CT and its segmentation, as " + settings.scan + " has it",
                   {{"folder", settings.folder.string()}, {"form", settings.scan}});
    return 0;
  }
  io::write_case(settings.folder, patient, program.context("write"));
  if (!made.clips.empty()) files::make_folder(settings.folder / "motion");
  for (const Clip& clip : made.clips) io::write_bvh(settings.folder / "motion" / (clip.name + ".bvh"), clip);
  // Last: its presence marks the folder as ours, and as whole.
  files::write_text(settings.folder / "truth.yaml", io::skeleton_to_yaml(made.truth));

  Eigen::Index vertices = patient.skin.V.rows(), triangles = patient.skin.F.rows();
  for (const CaseBone& bone : patient.bones)
    vertices += bone.surface.V.rows(), triangles += bone.surface.F.rows();
  std::map<std::string, int> groups;
  for (const CaseTissue& tissue : patient.tissues) {
    vertices += tissue.surface.V.rows(), triangles += tissue.surface.F.rows();
    ++groups[std::string(group_name(tissue.group))];
  }
  nlohmann::json object{{"case", (settings.folder / "case.yaml").string()},
                        {"segments", made.truth.segments.size()},
                        {"bones", patient.bones.size()},
                        {"tissues", groups},
                        {"vertices", vertices},
                        {"triangles", triangles},
                        {"clips", made.clips.size()}};
  std::string text = fmt::format("{}: {} segments, {} bones", (settings.folder / "case.yaml").string(),
                                 made.truth.segments.size(), patient.bones.size());
  for (const auto& [group, count] : groups)
    text += fmt::format(", {} {}{}", count, group, count == 1 ? "" : "s");
  text += fmt::format("; {} vertices, {} triangles", vertices, triangles);
  if (!patient.volumes.empty()) {
    const ImageGrid& grid = patient.volumes.front().image.grid;
    object["image"] = {{"size", grid.size}, {"spacing", grid.spacing}};
    text += fmt::format("; image {} x {} x {} at {} mm", grid.size[0], grid.size[1], grid.size[2],
                        grid.spacing[0]);
  }
  program.result(text, object);
  return 0;
}

}  // namespace

void declare_phantom(CLI::App& app, Program& program, Run& chosen) {
  const auto settings = std::make_shared<PhantomSettings>();
  CLI::App* command = app.add_subcommand("phantom", "write the built-in synthetic patient as a case");
  command->add_option("-o,--output", settings->folder, "folder of the case")->required();
  command
      ->add_option("--size", settings->size,
                   "small (tests), standard (demo) or paper (Sujar18's largest model)")
      ->check(CLI::IsMember({"small", "standard", "paper"}))
      ->capture_default_str();
  command->add_option("--seed", settings->seed, "draws the body's proportions and the noise of the CT")
      ->capture_default_str();
  CLI::Option* vary = command->add_flag("--vary", settings->vary,
                                        "let --seed draw from a population: 1.53 to 1.90 m tall, long and "
                                        "short limbs, lean and fat, some without a "
                                        "kidney, a spleen, a patella, the bones of a hand or of the toes");
  CLI::Option* voxel = command
                           ->add_option("--voxel", settings->voxel_mm,
                                        "edge of the scan's voxels, mm (default: 6, 4 or 2.5, by the size)")
                           ->check(CLI::Range(0.5, 20.0));
  command
      ->add_option(
          "--scan", settings->scan,
          "write what a hospital has instead of a case: the CT, and its segmentation as a program writes it")
      ->check(CLI::IsMember(std::vector<std::string>(std::begin(scan_forms), std::end(scan_forms))));
  command->add_flag("--bar", settings->bar, "the bar of Sujar18 figure 7 instead of a patient")
      ->excludes(voxel)
      ->excludes(vary)
      ->excludes("--scan");
  command->callback(
      [&program, &chosen, settings] { chosen = [&program, settings] { return run(program, *settings); }; });
}

}  // namespace ecorche::app
