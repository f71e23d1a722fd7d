// SPDX-License-Identifier: Apache-2.0
#include "app/relax_pose.hpp"

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "app/cli.hpp"
#include "app/fem_pose.hpp"
#include "app/usage_error.hpp"
#include "runtime/settle/settle_flesh.hpp"

namespace ecorche::app {

using nlohmann::json;

void add_relaxing(CLI::App& command, PoseSettings& settings) {
  command.add_flag("--unfold", settings.unfold,
                   "relax around inverted tets, as far as no tissue loses volume for it; those squeezed by "
                   "bones remain");
  command.add_flag("--settle", settings.settle,
                   "bring the flesh near to the balance that ecorche fem solves for, in seconds (3 million "
                   "tets: two minutes); bones stay");
}

void check_relaxing(const PoseSettings& settings) {
  if (settings.by_fem()) {
    if (settings.deformer != "tets")
      usage_error("--skinning fem", "finite elements are tets", "leave out --deformer");
    if (settings.unfold) usage_error("--skinning fem", "it refuses folds by itself", "leave out --unfold");
    if (settings.settle) usage_error("--skinning fem", "it is settled to the end", "leave out --settle");
    check_fem(settings.fem);
  }
  if (!settings.settle) return;
  if (settings.unfold) usage_error("--settle", "it presses folds out by itself", "leave out --unfold");
  if (settings.deformer != "tets") usage_error("--settle", "it moves tets", "leave out --deformer");
}

json PoseRelaxer::run(MeasuredPose& posed, const Context& context) {
  json out = json::object();
  if (settings_.unfold) out["unfolded"] = posed.unfold(context);
  if (settings_.by_fem()) out["fem"] = pose_by_fem(settings_.fem, posed, context);
  if (settings_.settle) {
    if (!settler_) settler_ = std::make_unique<const runtime::FleshSettler>(model_, context.quiet());
    out["settled"] = posed.settle(*settler_, context);
  }
  return out;
}

void add_relaxed(const json& done, json& quality) {
  if (done.contains("fem")) add_fem(done["fem"], quality);
  for (const char* what : {"unfolded", "settled"})
    if (done.contains(what)) quality[what] = done[what];
}

std::string settled_line(const json& quality) {
  if (!quality.contains("settled")) return {};
  const json& settled = quality["settled"];
  return fmt::format("  settled: {} steps, energy {:.0f} to {:.0f} mm^3, nodes moved by up to {:.1f} mm\n",
                     settled["steps"].get<int>(), settled["energy_before_mm3"].get<double>(),
                     settled["energy_after_mm3"].get<double>(), settled["largest_move_mm"].get<double>());
}

}  // namespace ecorche::app
