// SPDX-License-Identifier: Apache-2.0
// ecorche info MODEL: what a model holds.
#include <cstdio>
#include <filesystem>
#include <nlohmann/json.hpp>

#include <ecorche/model_file/model_file.hpp>
#include "app/certificate_report.hpp"
#include "app/cli.hpp"
#include "app/command.hpp"
#include "app/contacts_report.hpp"
#include "app/correction_report.hpp"
#include "app/joint_json.hpp"
#include "app/materials_report.hpp"
#include "app/pose_report.hpp"
#include "app/text_line.hpp"
#include "core/model_file/figures.hpp"
#include "core/values/text.hpp"

namespace ecorche::app {
namespace {

using Json = nlohmann::json;

constexpr const char* claims = "\nFor training and education, not for planning surgery.";

// Text of a file may be anything, but JSON is UTF-8.
Json valid(const Json& json) {
  return Json::parse(json.dump(-1, ' ', false, Json::error_handler_t::replace));
}

// Bytes on the disk by part: `/VTKHDF`, `/ecorche/weights`, ...
std::map<std::string, std::uint64_t> sizes(const std::string& path) {
  std::map<std::string, std::uint64_t> parts;
  for (const model_file::DatasetSummary& dataset : model_file::list(path)) {
    const std::size_t from = dataset.path.starts_with("/ecorche/") ? std::string("/ecorche/").size() : 1;
    parts[dataset.path.substr(0, dataset.path.find('/', from))] += dataset.bytes;
  }
  return parts;
}

Json to_json(const std::string& path, const Model& model) {
  Json out{{"name", model.name},
           {"bytes", std::filesystem::file_size(path)},
           {"nodes", model.node_count()},
           {"tets", model.tet_count()},
           {"segments", model.segment_count()},
           {"bones", model.bone_names.size()},
           {"weights", model.weights.weight.size()},
           {"sizes", sizes(path)},
           {"skeleton", model.rig.skeleton.name},
           {"rig", Json::array()},
           {"tissues", Json::array()},
           {"volumes", Json::array()},
           {"spheres", Json::array()},
           {"contacts", contacts_json(model)},
           {"cut_contacts", cut_contacts_json(model)},
           {"skin_caps", caps_json(model)},
           {"materials", materials_json(model, soft_tets_by_material(model))},
           {"corrections", corrections_json(model)},
           {"pose_corrections", pose_corrections_json(model)},
           {"safe_ranges", safe_ranges_json(model)},
           {"provenance", model.provenance}};
  out["identity"] = text::hex(model_file::identity(model));
  for (std::size_t row = 0; row < model.segment_count(); ++row)
    out["rig"].push_back(joint_json(model.rig, row));
  for (const Tissue& tissue : model.tissues) {
    const bool rigid = tissue.segment != Tissue::by_tets;
    out["tissues"].push_back(
        {{"name", tissue.name},
         {"group", group_name(tissue.group)},
         {"vertices", tissue.V.rows()},
         {"triangles", tissue.F.rows()},
         {"segment", rigid ? Json(model.rig.skeleton.segments[static_cast<std::size_t>(tissue.segment)].name)
                           : Json()}});
  }
  for (const ModelVolume& volume : model.volumes) {
    out["volumes"].push_back({{"name", volume.name},
                              {"size", volume.image.grid.size},
                              {"spacing_mm", volume.image.grid.spacing},
                              {"type", scalar_name(volume.image.type)},
                              {"components", volume.image.components},
                              {"background", volume.background},
                              {"labels", volume.labels},
                              {"names", volume.table.size()}});
  }
  for (const VolumetricSkeleton& skeleton : model.spheres) {
    out["spheres"].push_back({{"name", skeleton.name},
                              {"size", skeleton.grid.size},
                              {"voxel_mm", skeleton.grid.spacing[0]},
                              {"tp", skeleton.thinness},
                              {"voxels", skeleton.size()}});
  }
  model_file::for_each_figure(model.certificate, [&](std::string_view name, auto value) {
    out["certificate"][std::string(name)] = value;
  });
  return valid(out);
}

// Text of a file goes to a terminal: nothing in it may steer that terminal.
std::string printable(std::string text) {
  for (char& c : text) {
    if (static_cast<unsigned char>(c) < 0x20 || c == 0x7f) c = '?';
  }
  return text;
}

std::string printable_lines(const std::string& text) {
  std::string out;
  for (std::size_t at = 0; at < text.size(); at = text.find('\n', at) + 1)
    out += printable(text.substr(at, text.find('\n', at) - at)) + "\n";
  return out;
}

std::string range(const Json& angle) {
  const auto word = [](const Json& limit_deg) {
    char buffer[32];
    if (limit_deg.is_null()) return std::string("free");
    std::snprintf(buffer, sizeof buffer, "%.0f", limit_deg.get<double>());
    return std::string(buffer);
  };
  return printable(angle["name"].get<std::string>()) + " " + word(angle["min_deg"]) + ".." +
         word(angle["max_deg"]);
}

// The same facts as the JSON, as tables.
std::string info_text(const Json& info) {
  const auto text = [](const Json& value) { return printable(value.get<std::string>()); };
  const auto count = [](const Json& value) { return value.get<unsigned long long>(); };
  std::string out =
      text_line("%s: %llu nodes, %llu tets, %llu segments, %llu bones, %llu weights, %.1f MiB, identity %s",
                text(info["name"]).c_str(), count(info["nodes"]), count(info["tets"]),
                count(info["segments"]), count(info["bones"]), count(info["weights"]),
                info["bytes"].get<double>() / (1 << 20), text(info["identity"]).c_str());
  out += "\non disk, KiB\n";
  for (const auto& [part, bytes] : info["sizes"].items()) {
    out += text_line("  %-24s %12.1f", part.c_str(), bytes.get<double>() / 1024);
  }
  out += "\nrig " + text(info["skeleton"]) +
         ": segment, joint, kind, centre (mm LPS), fit residual (mm) and confidence, limits (deg)\n";
  for (const Json& row : info["rig"]) {
    const Json& c = row["center_mm"];
    std::string limits;
    for (const Json& angle : row["angles"]) limits += (limits.empty() ? "" : ", ") + range(angle);
    out += text_line("  %-20s %-20s %-10s %8.1f %8.1f %8.1f  %-10s %6.3f %4.2f  %s",
                     text(row["segment"]).c_str(), text(row["joint"]).c_str(), text(row["kind"]).c_str(),
                     c[0].get<double>(), c[1].get<double>(), c[2].get<double>(),
                     text(row["fit"]["rule"]).c_str(), row["fit"]["residual_mm"].get<double>(),
                     row["fit"]["confidence"].get<double>(), limits.c_str());
  }
  out += "\ntissues: name, group, vertices, triangles, follows\n";
  for (const Json& row : info["tissues"]) {
    out += text_line("  %-28s %-10s %10llu %10llu  %s", text(row["name"]).c_str(), text(row["group"]).c_str(),
                     count(row["vertices"]), count(row["triangles"]),
                     row["segment"].is_null() ? "the tets" : text(row["segment"]).c_str());
  }
  if (const std::string materials = materials_line(info["materials"]); !materials.empty())
    out += "\nYoung's moduli: " + printable(materials) + "\n";
  out += "\nvolumes: name, voxels, spacing (mm), type\n";
  for (const Json& row : info["volumes"]) {
    const Json &n = row["size"], &s = row["spacing_mm"];
    out +=
        text_line("  %-20s %5d x %5d x %5d  %.3f x %.3f x %.3f  %s%s", text(row["name"]).c_str(),
                  n[0].get<int>(), n[1].get<int>(), n[2].get<int>(), s[0].get<double>(), s[1].get<double>(),
                  s[2].get<double>(), text(row["type"]).c_str(), row["labels"].get<bool>() ? ", labels" : "");
  }
  if (!info["skin_caps"].empty())
    out += "\nthe skin's caps, where the scan's border cuts the body: no skin, and in no figure of a pose\n";
  for (const Json& cap : info["skin_caps"]) {
    const Json& at = cap["at_mm"];
    out += text_line("  %.0f cm2 about [%.0f, %.0f, %.0f] mm", cap["cm2"].get<double>(), at[0].get<double>(),
                     at[1].get<double>(), at[2].get<double>());
  }
  if (!info["cut_contacts"].empty()) out += "\n" + printable_lines(cut_contacts_text(info["cut_contacts"]));
  if (!info["contacts"].empty()) out += "\n" + printable_lines(contacts_text(info["contacts"]));
  out += printable_lines(pose_corrections_text(info["pose_corrections"]));
  out += printable_lines(correction_text(info["corrections"], info["safe_ranges"]));
  out += "\ncertificate\n";
  for (const auto& [name, value] : info["certificate"].items()) {
    out += text_line("  %-28s %s", name.c_str(), value.dump().c_str());
  }
  out += "\nprovenance\n";
  for (const auto& [key, value] : info["provenance"].items())
    out += "  " + printable(key) + ": " + text(value) + "\n";
  return out + claims;
}

}  // namespace

void declare_info(CLI::App& app, Program& program, Run& chosen) {
  auto* command = app.add_subcommand("info", "what a model holds: counts, sizes, rig, tissues, certificate");
  auto path = std::make_shared<std::string>();
  auto certificate = std::make_shared<bool>(false);
  command->add_option("model", *path, "the model, a .hdf file")->required();
  command->add_flag("--certificate", *certificate,
                    "only the certificate: every figure, its bound, and why that bound");
  command->callback([path, certificate, &program, &chosen] {
    chosen = [path, certificate, &program] {
      const Model model = model_file::read(*path, program.context("reading"));
      if (*certificate) {
        const preprocess::BodySize size = preprocess::body_size(model);
        program.result(
            certificate_text(model.certificate, size) + claims,
            valid({{"name", model.name}, {"certificate", certificate_json(model.certificate, size)}}));
        return 0;
      }
      const Json info = to_json(*path, model);
      program.result(info_text(info), info);
      return 0;
    };
  });
}

}  // namespace ecorche::app
