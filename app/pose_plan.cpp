// SPDX-License-Identifier: Apache-2.0
#include "app/pose_plan.hpp"

#include <algorithm>

#include "app/relax_pose.hpp"
#include "app/unknown_name.hpp"
#include "app/usage_error.hpp"

namespace ecorche::app {
namespace {

// `all`, `none` or names -> rows of `items`, ascending.
template <class Items>
std::vector<std::uint32_t> rows_of(const Items& items, const std::vector<std::string>& names,
                                   const std::string& option) {
  std::vector<std::uint32_t> rows;
  for (const std::string& name : names) {
    if (name == "none" && names.size() == 1) return {};
    bool found = name == "all" && names.size() == 1;
    for (std::size_t i = 0; i < items.size(); ++i) {
      if (name != "all" && items[i].name != name) continue;
      rows.push_back(static_cast<std::uint32_t>(i));
      found = true;
    }
    if (!found) throw unknown_name(option, name, items);
  }
  std::sort(rows.begin(), rows.end());
  rows.erase(std::unique(rows.begin(), rows.end()), rows.end());
  return rows;
}

}  // namespace

void check_settings(const PoseSettings& settings) {
  if (settings.scan.wanted() == !settings.model.empty())
    usage_error("pose", settings.scan.wanted() ? "both MODEL and --scan are given" : "no model is given",
                "give a MODEL that preprocess made, or --scan SCAN...");
  check_dicom_options(settings.dicom,
                      settings.writes_dicom() || (settings.on_slices() && !settings.dicom.keep_identity),
                      "add --volume-format dicom");
  if (!settings.bridge && settings.deformer != "spheres")
    usage_error("--no-bridge", "tets open no gaps", "add --deformer spheres");
  if (settings.on_slices() && settings.deformer == "spheres")
    usage_error("--resample", "spheres fill the voxels of their own lattice", "leave out --deformer spheres");
  if (settings.on_slices() && settings.as_case)
    usage_error("--resample", "the images of a case have even voxels", "leave out --resample or --as-case");
  check_relaxing(settings);
  if (settings.as_case) {
    if (settings.chooses())
      usage_error("--as-case", "a case is whole", "leave out --tissues, --volumes, --tets and --field");
    if (settings.formats != PoseSettings{}.formats || settings.volume_format != PoseSettings{}.volume_format)
      usage_error("--as-case", "a case is written as STL and NRRD", "leave out --format and --volume-format");
    if (settings.deformer != "tets")
      usage_error("--as-case", "a case's surfaces and volumes follow the same tets", "leave out --deformer");
  }
}

Plan plan_of(const PoseSettings& settings, const Model& model) {
  if (settings.as_case) return {{}, {}, true, false, {}, {}};  // the case itself, and the tets beside it
  const std::vector<std::string> all{"all"};
  const bool everything = !settings.chooses();
  Plan plan;
  plan.tissues = rows_of(model.tissues, everything ? all : settings.tissues, "--tissues");
  plan.volumes = rows_of(model.volumes, everything ? all : settings.volumes, "--volumes");
  plan.tets = everything || settings.tets;
  plan.field = everything || settings.field;
  if (settings.on_slices() && plan.volumes.empty())
    usage_error("--resample", "no volume is written", "name some by --volumes");
  for (const std::uint32_t v : plan.volumes) {
    const std::string& name = model.volumes[v].name;
    if (plan.field && (name == "displacement" || name == "mask")) {
      usage_error("--field", "volume '" + name + "' would be written over by the displacement field",
                  "name the other volumes by --volumes");
    }
  }
  return plan;
}

}  // namespace ecorche::app
