// SPDX-License-Identifier: Apache-2.0
// `ecorche fem`: `ecorche pose --skinning fem` with all that can be said of the elements.
#include <memory>

#include "app/cli.hpp"
#include "app/command.hpp"
#include "app/pose_plan.hpp"
#include "preprocess/fem/material.hpp"

namespace ecorche::app {

void declare_fem(CLI::App& app, Program& program, Run& chosen) {
  const auto s = std::make_shared<PoseSettings>();
  s->skinning = "fem";
  CLI::App* command = app.add_subcommand(
      "fem", "pose a model by finite elements: the reference for skinning, with fem.json beside it");
  command->add_option("MODEL", s->model, "a model that preprocess made")->required();
  command
      ->add_option("-o,--output", s->output,
                   "folder of the posed body: it appears whole; an earlier one in it gives way, anything "
                   "else is refused")
      ->required();
  add_frame_options(*command, s->frames);
  command
      ->add_option(
          "--element", s->fem.element,
          "p1 (linear tets, for whole bodies), p2 (quadratic) or p2p0 (quadratic, volume kept on the "
          "mean of each tet: what is trusted)")
      ->check(CLI::IsMember({"p1", "p2", "p2p0"}))
      ->capture_default_str();
  const auto materials = fem::material_names();
  command
      ->add_option(
          "--material", s->fem.material,
          "stable_neo_hookean, or corotational (linear but for its rotations, as in Sujar 2018: it does "
          "not converge past some 90 degrees)")
      ->check(CLI::IsMember(std::vector<std::string>(materials.begin(), materials.end())))
      ->capture_default_str();
  command
      ->add_option("--poisson", s->fem.poisson,
                   "Poisson's ratio, 0 to 0.499: without it 0.45, and 0.49 with p2p0")
      ->check(CLI::Range(0.0, 0.499));
  command->add_flag(
      "!--one-start", s->fem.two_starts,
      "solve from the skinned body alone, not also from rest: half of the time, and never more than a "
      "warning");
  command->add_option("--tissues", s->tissues, "tissues to write: all, none, or names with commas between")
      ->delimiter(',');
  command->add_option("--volumes", s->volumes, "volumes to write: all, none, or names with commas between")
      ->delimiter(',');
  command->add_flag("--tets", s->tets, "write the posed tets; body.vtu holds displacement, label and det F");
  command->footer(
      "All flesh is equally stiff unless the case gives stiffness_kpa, and glued to the bones, without "
      "gravity "
      "or contact.\n"
      "What is not named is not written; without --tissues, --volumes and --tets everything is.");
  command->callback([&program, &chosen, s] { chosen = [&program, s] { return run_pose(program, *s); }; });
}

}  // namespace ecorche::app
