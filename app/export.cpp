// SPDX-License-Identifier: Apache-2.0
// `ecorche export`: the rest tets of a model in the formats of other programs.
#include <filesystem>
#include <memory>

#include "app/command.hpp"
#include "app/tet_regions.hpp"
#include "core/model_file/model_file.hpp"

namespace ecorche::app {
namespace {

struct Settings {
  std::filesystem::path model;
  std::vector<std::filesystem::path> outputs;
};

int run(const Program& program, const Settings& settings) {
  const Model model = model_file::read(settings.model, program.context("reading"));
  const io::TetRegions regions = tet_regions(model);
  const Context context = program.context("writing");
  nlohmann::json written = nlohmann::json::array();
  std::string text;
  for (const std::filesystem::path& output : settings.outputs) {
    context.check_stop();
    io::write_tets(output, model.nodes, model.tets, {},
                   {{"label", 1, {model.tet_label.begin(), model.tet_label.end()}}}, regions);
    written.push_back(output.string());
    text += (text.empty() ? "" : "\n") + output.string();
    context.report(static_cast<double>(written.size()) / static_cast<double>(settings.outputs.size()));
  }
  program.result(text, {{"nodes", model.node_count()},
                        {"tets", model.tet_count()},
                        {"regions", regions.names},
                        {"written", written}});
  return 0;
}

}  // namespace

void declare_export(CLI::App& app, Program& program, Run& chosen) {
  auto* command =
      app.add_subcommand("export", "the rest tets of a model for other programs, with its regions");
  auto s = std::make_shared<Settings>();
  command->add_option("model", s->model, "the model, a .hdf file")->required();
  command
      ->add_option("-o,--output", s->outputs,
                   "files to write: .vtu, .msh (Gmsh), .ele with .node (TetGen), .inp (Abaqus), .mcnp.inp "
                   "(MCNP6, in cm, "
                   "refuses degenerate tets)")
      ->required();
  command->callback([&program, &chosen, s] { chosen = [&program, s] { return run(program, *s); }; });
}

}  // namespace ecorche::app
