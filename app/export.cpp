// SPDX-License-Identifier: Apache-2.0
// `ecorche export`: a model in the formats of other programs: its rest tets, or its rig with a motion.
#include <cstdio>
#include <filesystem>
#include <memory>
#include <nlohmann/json.hpp>

#include <ecorche/model_file/model_file.hpp>
#include "app/balls_of_file.hpp"
#include "app/cli.hpp"
#include "app/command.hpp"
#include "app/export_rig.hpp"
#include "app/tet_regions.hpp"

namespace ecorche::app {
namespace {

struct ExportSettings {
  std::filesystem::path model;
  std::vector<std::filesystem::path> outputs;
  RigChoice rig;
  bool weights = false;
};

// The skinning weights of every segment, dense: an array each.
std::vector<io::GridArray> weight_arrays(const Model& model) {
  std::vector<io::GridArray> arrays;
  for (const Segment& segment : model.rig.skeleton.segments)
    arrays.push_back({"weight_" + segment.name, 1, std::vector<float>(model.node_count(), 0)});
  for (std::size_t node = 0; node < model.node_count(); ++node) {
    for (auto i = model.weights.offsets[node]; i < model.weights.offsets[node + 1]; ++i)
      arrays[model.weights.segment[i]].values[node] = static_cast<float>(model.weights.weight[i]);
  }
  return arrays;
}

std::string export_text(const nlohmann::json& rig) {
  char text[256] = "";
  if (rig.contains("truncation_mm"))
    std::snprintf(text, sizeof text,
                  "; four influences a vertex instead of all: %.3f mm rms, %.3f mm at worst (LBS)",
                  rig["truncation_mm"]["rms"].get<double>(), rig["truncation_mm"]["worst"].get<double>());
  std::string out = rig["file"].get<std::string>() + ": " + rig["joints"].dump() + " joints, " +
                    rig["frames"].dump() + " frames";
  if (rig["frames_clamped"] != 0)
    out += ", in " + rig["frames_clamped"].dump() + " of them joints were held at their limits";
  if (rig.contains("unit")) {
    out += "; lengths in " + rig["unit"].get<std::string>() +
           ", which a BVH does not say: tell the program that reads it (Blender takes metres: --bvh-unit m)";
  }
  return out + text;
}

// A model, or a skeleton file as one that has nothing but its rig.
Model read(const Program& program, const ExportSettings& settings) {
  if (settings.model.extension() != ".yaml")
    return model_file::read(settings.model, program.context("reading"));
  for (const std::filesystem::path& output : settings.outputs) {
    if (!is_rig_file(output))
      throw Error(ErrorKind::usage, output.string(), "a skeleton has no tets",
                  "name a .glb or .bvh, or give a model");
  }
  Model model;
  model.rig = read_placed_rig(settings.model);
  return model;
}

int run(const Program& program, const ExportSettings& settings) {
  const Model model = read(program, settings);
  const io::TetRegions regions = tet_regions(model);
  const Context context = program.context("writing");
  const std::vector<io::GridArray> weights =
      settings.weights ? weight_arrays(model) : std::vector<io::GridArray>{};
  nlohmann::json written = nlohmann::json::array(), rigs = nlohmann::json::array();
  std::string text;
  for (const std::filesystem::path& output : settings.outputs) {
    context.check_stop();
    if (is_rig_file(output)) {
      rigs.push_back(export_rig(program, model, settings.rig, output));
      written.push_back(output.string());
      text += (text.empty() ? "" : "\n") + export_text(rigs.back());
      continue;
    }
    io::write_tets(output, model.nodes, model.tets, weights,
                   {{"label", 1, {model.tet_label.begin(), model.tet_label.end()}}}, regions);
    written.push_back(output.string());
    text += (text.empty() ? "" : "\n") + output.string();
    context.report(static_cast<double>(written.size()) / static_cast<double>(settings.outputs.size()));
  }
  program.result(text, {{"nodes", model.node_count()},
                        {"tets", model.tet_count()},
                        {"regions", regions.names},
                        {"rigs", rigs},
                        {"written", written}});
  return 0;
}

}  // namespace

void declare_export(CLI::App& app, Program& program, Run& chosen) {
  auto* command = app.add_subcommand(
      "export", "a model for other programs: its rest tets with their regions, or its rig with a motion");
  auto s = std::make_shared<ExportSettings>();
  command
      ->add_option("model", s->model, "a model (.hdf), or a skeleton file (.yaml) whose rig alone is written")
      ->required();
  command
      ->add_option(
          "-o,--output", s->outputs,
          "files to write: .vtu, .msh (Gmsh), .ele with .node (TetGen), .inp (Abaqus), .mcnp.inp "
          "(MCNP6, in cm, "
          "refuses degenerate tets), .glb (tissues skinned by four influences, with the motion), .bvh")
      ->required();
  command->add_flag("--weights", s->weights,
                    "put the skinning weights of every segment into a .vtu, an array each");
  add_motion_options(*command, s->rig.motion);
  command->add_option("--bvh-unit", s->rig.bvh_unit, "of lengths in a .bvh")
      ->check(CLI::IsMember({"mm", "cm", "m", "in"}))
      ->capture_default_str();
  command->add_option("--tissues", s->rig.tissues, "of a .glb: names with commas between, all by default")
      ->delimiter(',');
  command->callback([&program, &chosen, s] { chosen = [&program, s] { return run(program, *s); }; });
}

}  // namespace ecorche::app
