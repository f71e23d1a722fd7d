// SPDX-License-Identifier: Apache-2.0
#include "app/fem_pose.hpp"

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "app/materials_report.hpp"
#include "app/usage_error.hpp"
#include "preprocess/fem/reference.hpp"

namespace ecorche::app {
namespace {

using nlohmann::json;

json warning(const char* kind, std::string what, std::string mend) {
  return {{"kind", kind}, {"what", std::move(what)}, {"mend", std::move(mend)}};
}

json contact_warning(const fem::SelfContact& contact) {
  json out = warning("fem_contact",
                     fmt::format("the flesh runs through itself at {} nodes, {:.1f} mm deep: finite elements "
                                 "know no contact here",
                                 contact.nodes, contact.depth_mm),
                     "turn the joints less: the range of this solution ends where skin touches skin");
  const Eigen::Vector3d& at = contact.deepest;
  out["at_mm"] = {at.x(), at.y(), at.z()};
  return out;
}

/// What keeps the solution from being believed.
json warnings_of(const fem::Reference& solved, bool two_starts) {
  json out = json::array();
  if (!solved.converged()) {
    const std::string way = two_starts
                                ? fmt::format("from rest they come {:.0f} % of the way", 100 * solved.reached)
                                : "the skinned body led nowhere";
    out.push_back(warning("fem_no_solution",
                          "finite elements do not converge: " + way + "; the body is left as skinned",
                          "turn the joints less: this is beyond the range of a solution without contact"));
    if (solved.contact.nodes > 0) out.push_back(contact_warning(solved.contact));
    return out;
  }
  if (solved.inverted())
    out.push_back(
        warning("fem_inverted",
                fmt::format("finite elements end with {} tets inside out", solved.newton.total.inverted_tets),
                "turn the joints less, or prepare the model with more tets (--max-tets)"));
  if (!two_starts) {
    out.push_back(warning("fem_one_start", "finite elements were solved from one start alone",
                          "leave out --one-start"));
  } else if (!solved.same_from_two_starts()) {
    out.push_back(
        warning("fem_two_solutions",
                solved.compared
                    ? fmt::format("two starts of finite elements end {:.1f} mm apart, more than {:.1f} mm: "
                                  "there is more than "
                                  "one balance",
                                  solved.between_starts_mm, fem::kSameMm)
                    : fmt::format("finite elements find a balance from one start alone ({})", solved.from),
                "turn the joints less: flesh that creases has no single shape"));
  }
  if (solved.contact.nodes > 0) out.push_back(contact_warning(solved.contact));
  return out;
}

}  // namespace

double poisson_of(const FemSettings& settings) {
  return settings.poisson.value_or(settings.element == "p2p0" ? 0.49 : 0.45);
}

void check_fem(const FemSettings& settings) {
  if (settings.element == "p2p0" && settings.material == "corotational")
    usage_error("--material corotational", "its volume term is none that p2p0 could take a mean of",
                "use --element p1 or p2, or --material stable_neo_hookean");
}

json pose_by_fem(const FemSettings& settings, MeasuredPose& posed, const Context& context) {
  const Model& model = posed.poser().model();
  fem::ReferenceOptions options;
  options.element = fem::element_from_name(settings.element);
  options.material = settings.material;
  options.poisson = poisson_of(settings);
  options.two_starts = settings.two_starts;
  Pose pose = posed.still().pose;
  pose.root_translation.setZero();
  pose.rotation[0].setIdentity();
  const fem::Reference solved = fem::solve_pose(model, pose, posed.still().nodes, options, context);
  if (solved.converged()) {
    const PointsF nodes = solved.nodes.cast<float>();
    posed.replace({nodes.data(), nodes.data() + nodes.size()}, solved.solved);
  }
  const fem::Seconds& seconds = solved.newton.seconds;
  return {{"verdict", solved.trusted() ? "pass" : "warn"},
          {"materials", materials_json(model, solved.material_tets)},
          {"element", settings.element},
          {"material", settings.material},
          {"poisson", options.poisson},
          {"tets", solved.tets},
          {"free_nodes", solved.free_nodes},
          {"left_out",
           {{"on_bones", solved.on_bones},
            {"between_bones", solved.between},
            {"floating", solved.floating},
            {"of_soft_tets", solved.soft_tets}}},
          {"converged", solved.converged()},
          {"start", solved.from},
          {"settling_steps", solved.newton.settling_steps},
          {"iterations", solved.newton.iterations},
          {"factors", solved.newton.factors},
          {"residual", solved.newton.residual},
          {"last_step_mm", solved.newton.step_mm},
          {"energy_mm3", solved.newton.total.energy},
          {"inverted_tets", solved.newton.total.inverted_tets},
          {"crushed_tets", solved.newton.total.crushed_tets},
          {"squeezed_by_bones", solved.squeezed},
          {"volume_change", solved.posed_mm3 / solved.rest_mm3 - 1},
          {"to_cor",
           {{"nodes", solved.to_skinned.nodes},
            {"moved_mm", fem::kMovedMm},
            {"mean_mm", solved.to_skinned.mean_mm},
            {"p95_mm", solved.to_skinned.p95_mm},
            {"max_mm", solved.to_skinned.max_mm}}},
          {"two_starts",
           {{"distance_mm", solved.compared ? json(solved.between_starts_mm) : json()},
            {"threshold_mm", fem::kSameMm},
            {"skinned", solved.skinned_good},
            {"rest", solved.rest_good},
            {"rest_reached", solved.reached},
            {"rest_steps", solved.steps},
            {"rest_refused", solved.refused}}},
          {"contact_nodes", solved.contact.nodes},
          {"contact_depth_mm", solved.contact.depth_mm},
          {"seconds",
           {{"build", solved.seconds_build},
            {"skinned_start", solved.seconds_skinned},
            {"rest_start", solved.seconds_rest},
            {"of_solution",
             {{"settle", seconds.settle},
              {"assemble", seconds.assemble},
              {"factor", seconds.factor},
              {"solve", seconds.solve},
              {"energy", seconds.energy}}}}},
          {"warnings", warnings_of(solved, options.two_starts)},
          {"purpose", "training and education, not planning of surgery"}};
}

void add_fem(const json& fem, json& quality) {
  quality["fem"] = fem;
  if (fem["verdict"] == "pass") return;
  quality["verdict"] = "warn";
  quality["warnings"].insert(quality["warnings"].begin(), fem["warnings"].begin(), fem["warnings"].end());
}

std::string fem_line(const json& fem) {
  const json &to_cor = fem["to_cor"], &distance = fem["two_starts"]["distance_mm"];
  std::string out = fmt::format(
      "  finite elements: {}, {} at {:g}, {} tets, {} iterations, residual {:.0e}, volume {:+.2f} %; from "
      "cor {:.1f} mm (mean), "
      "{:.1f} (95 %), {:.1f} (most); two starts {}\n",
      fem["verdict"].get<std::string>(), fem["element"].get<std::string>(), fem["poisson"].get<double>(),
      fem["tets"].get<std::size_t>(), fem["iterations"].get<int>(), fem["residual"].get<double>(),
      100 * fem["volume_change"].get<double>(), to_cor["mean_mm"].get<double>(),
      to_cor["p95_mm"].get<double>(), to_cor["max_mm"].get<double>(),
      distance.is_null() ? std::string("not compared")
                         : fmt::format("{:.1e} mm apart", distance.get<double>()));
  if (const std::string materials = materials_line(fem["materials"]); !materials.empty())
    out += "  Young's moduli: " + materials + "\n";
  return out;
}

}  // namespace ecorche::app
