// SPDX-License-Identifier: Apache-2.0
#include "app/unpose_report.hpp"

#include <algorithm>
#include <cstdio>
#include <nlohmann/json.hpp>

namespace ecorche::app {
namespace {

using nlohmann::json;

// Of all surfaces that went rigidly, or by tets.
struct Sums {
  std::uint64_t surfaces = 0, vertices = 0, folded = 0;
  double sum_mm = 0, max_mm = 0;

  double mean_mm() const { return vertices == 0 ? 0 : sum_mm / static_cast<double>(vertices); }
};

Sums sums_of(const UnposeReport& report, bool rigid) {
  Sums out;
  for (const SurfaceTrip& trip : report.surfaces) {
    if (trip.rigid != rigid) continue;
    ++out.surfaces;
    out.vertices += trip.vertices;
    out.folded += trip.folded;
    out.sum_mm += trip.sum_mm;
    out.max_mm = std::max(out.max_mm, trip.max_mm);
  }
  return out;
}

double share(std::uint64_t part, std::uint64_t all) {
  return all == 0 ? 0 : static_cast<double>(part) / static_cast<double>(all);
}

json sums_json(const Sums& sums) {
  return {{"surfaces", sums.surfaces},
          {"vertices", sums.vertices},
          {"mean_mm", sums.mean_mm()},
          {"max_mm", sums.max_mm}};
}

template <class... T>
std::string printed(const char* format, T... values) {
  char line[400];
  std::snprintf(line, sizeof line, format, values...);
  return line;
}

}  // namespace

std::string text_of(const UnposeReport& report) {
  const Sums rigid = sums_of(report, true), soft = sums_of(report, false);
  std::string out = printed("%zu files\n", report.files.size());
  if (rigid.surfaces > 0)
    out += printed("%llu rigid surfaces: back within %.3g mm\n",
                   static_cast<unsigned long long>(rigid.surfaces), rigid.max_mm);
  if (soft.surfaces > 0)
    out += printed(
        "%llu soft surfaces: back within %.3g mm on average, %.2g at most; %llu of %llu vertices lie in "
        "folds%s\n",
        static_cast<unsigned long long>(soft.surfaces), soft.mean_mm(), soft.max_mm,
        static_cast<unsigned long long>(soft.folded), static_cast<unsigned long long>(soft.vertices),
        soft.folded > 0 ? " (folds.csv)" : "");
  if (report.drawn.vertices > 0)
    out += printed("%llu drawn vertices: %llu outside of the body, %.3g mm at most; %llu in folds%s\n",
                   static_cast<unsigned long long>(report.drawn.vertices),
                   static_cast<unsigned long long>(report.drawn.outside), report.drawn.max_outside_mm,
                   static_cast<unsigned long long>(report.drawn.folded),
                   report.drawn.folded > 0 ? " (folds.csv)" : "");
  for (const ImageTrip& image : report.images) {
    out +=
        printed("%s: voxels from %.2g voxel away on average, %.3g %% of the body's from another place (%s)",
                image.file.filename().c_str(), image.mean_voxels, 100 * share(image.elsewhere, image.voxels),
                image.mask.filename().c_str());
    if (!image.against_scan.is_null())
      out +=
          printed("; %.3g %% differ from the scan", 100 * image.against_scan["differ_share"].get<double>());
    out += "\n";
  }
  return out;
}

json json_of(const UnposeReport& report) {
  const Sums rigid = sums_of(report, true), soft = sums_of(report, false);
  json folded = json::array(), images = json::array(), files = json::array();
  for (const SurfaceTrip& trip : report.surfaces) {
    if (trip.folded == 0) continue;
    folded.push_back({{"tissue", trip.tissue},
                      {"group", group_name(trip.group)},
                      {"vertices", trip.vertices},
                      {"folded", trip.folded},
                      {"mean_mm", trip.folded_sum_mm / static_cast<double>(trip.folded)},
                      {"max_mm", trip.folded_max_mm}});
  }
  for (const ImageTrip& image : report.images) {
    images.push_back({{"file", image.file.string()},
                      {"mask", image.mask.string()},
                      {"voxels", image.voxels},
                      {"mean_mm", image.mean_mm},
                      {"mean_voxels", image.mean_voxels},
                      {"max_mm", image.max_mm},
                      {"elsewhere", image.elsewhere},
                      {"elsewhere_share", share(image.elsewhere, image.voxels)}});
    if (!image.against_scan.is_null()) images.back()["against_scan"] = image.against_scan;
  }
  for (const std::filesystem::path& file : report.files) files.push_back(file.string());
  json of_soft = sums_json(soft);
  of_soft["folded"] = soft.folded;
  of_soft["folded_share"] = share(soft.folded, soft.vertices);
  return {{"ok", true},
          {"files", std::move(files)},
          {"round_trip",
           {{"rigid", sums_json(rigid)},
            {"soft", std::move(of_soft)},
            {"folded", std::move(folded)},
            {"drawn",
             {{"vertices", report.drawn.vertices},
              {"outside", report.drawn.outside},
              {"max_outside_mm", report.drawn.max_outside_mm},
              {"folded", report.drawn.folded}}},
            {"images", std::move(images)}}}};
}

}  // namespace ecorche::app
