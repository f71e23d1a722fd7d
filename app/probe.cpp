// SPDX-License-Identifier: Apache-2.0
// `ecorche probe`: points of a posed body back to the scan, or of the scan into the posed body, with what is
// there.
#include <charconv>
#include <cmath>
#include <filesystem>
#include <memory>
#include <nlohmann/json.hpp>

#include <ecorche/kinematics/forward.hpp>
#include <ecorche/model_file/model_file.hpp>
#include <ecorche/runtime/body_poser.hpp>
#include <ecorche/runtime/probe.hpp>
#include "app/cli.hpp"
#include "app/command.hpp"
#include "app/point_table.hpp"
#include "app/pose_frames.hpp"
#include "app/unknown_name.hpp"
#include "core/files/atomic_file.hpp"

namespace ecorche::app {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

struct ProbeSettings {
  fs::path model, points, output;
  std::string pose, skinning = "cor", direction = "posed-to-rest", sampling = "trilinear";
  std::vector<std::string> volumes{"all"};
  bool gradient = false;
};

runtime::ProbeOptions wants_of(const ProbeSettings& settings, const Model& model) {
  runtime::ProbeOptions wants{.gradient = settings.gradient, .tissue = true};
  const auto sampling =
      settings.sampling == "nearest" ? runtime::Sampling::nearest : runtime::Sampling::trilinear;
  const bool all = settings.volumes == std::vector<std::string>{"all"};
  const std::vector<std::string> none{"none"};
  for (std::uint32_t v = 0; all && v < model.volumes.size(); ++v) wants.volumes.push_back({v, sampling});
  if (all || settings.volumes == none) return wants;
  for (const std::string& name : settings.volumes) {
    std::uint32_t v = 0;
    while (v < model.volumes.size() && model.volumes[v].name != name) ++v;
    if (v == model.volumes.size()) throw unknown_name("--volumes", name, model.volumes);
    wants.volumes.push_back({v, sampling});
  }
  return wants;
}

Pose pose_of(const Program& program, const ProbeSettings& settings, const Model& model) {
  if (settings.pose.empty()) return Pose::rest(model.segment_count());
  FrameChoice choice;
  choice.pose = settings.pose;
  return read_frames(program, choice, model.rig).front().pose;
}

// The decimal that a float32 is written as; nothing for what is no number.
json number(float value) {
  if (!std::isfinite(value)) return {};
  char text[32];
  const char* const end = std::to_chars(text, text + sizeof text, value).ptr;
  double decimal = 0;
  std::from_chars(text, end, decimal);
  return decimal;
}

json columns_of(const runtime::ProbeOptions& wants, const Model& model) {
  json out{"x", "y", "z", "to_x", "to_y", "to_z", "tet", "part", "tissue"};
  for (const auto& wanted : wants.volumes) {
    const ModelVolume& volume = model.volumes[wanted.row];
    for (int c = 0; c < volume.image.components; ++c)
      out.push_back(volume.image.components == 1 ? volume.name : volume.name + "_" + std::to_string(c));
    if (!volume.table.empty()) out.push_back(volume.name + "_name");
  }
  for (const char* entry : {"f_xx", "f_xy", "f_xz", "f_yx", "f_yy", "f_yz", "f_zx", "f_zy", "f_zz"}) {
    if (wants.gradient) out.push_back(entry);
  }
  return out;
}

json row_of(std::size_t i, std::span<const float> points, const runtime::Probed& probed,
            const runtime::ProbeOptions& wants, const Model& model) {
  const bool held = probed.tet[i] != runtime::TetPlace::none;
  json row;
  for (std::size_t c = 0; c < 3; ++c) row.push_back(number(points[3 * i + c]));
  for (std::size_t c = 0; c < 3; ++c) row.push_back(number(probed.points[3 * i + c]));
  row.push_back(held ? json(probed.tet[i]) : json());
  const std::uint16_t label = probed.label[i];
  row.push_back(!held                    ? json()
                : label == TetMesh::soft ? json("soft")
                                         : json(model.bone_names[static_cast<std::size_t>(label) - 1]));
  const std::int32_t tissue = probed.tissue[i];
  row.push_back(tissue < 0 ? json() : json(model.tissues[static_cast<std::size_t>(tissue)].name));
  for (std::size_t v = 0; v < wants.volumes.size(); ++v) {
    const ModelVolume& volume = model.volumes[wants.volumes[v].row];
    const auto components = static_cast<std::size_t>(volume.image.components);
    for (std::size_t c = 0; c < components; ++c)
      row.push_back(held ? json(probed.values[v][components * i + c]) : json());
    if (volume.table.empty()) continue;
    const auto name = volume.table.find(static_cast<std::int64_t>(probed.values[v][components * i]));
    row.push_back(held && name != volume.table.end() ? json(name->second) : json());
  }
  for (std::size_t e = 0; wants.gradient && e < 9; ++e) row.push_back(number(probed.gradient[9 * i + e]));
  return row;
}

// Each of 3 * #P, where the motion takes it.
std::vector<float> moved(const RigidTransform& motion, std::vector<float> points) {
  for (std::size_t i = 0; i + 2 < points.size(); i += 3) {
    Eigen::Map<Eigen::Vector3f> p(&points[i]);
    p = (motion * p.cast<double>()).cast<float>();
  }
  return points;
}

// The body is probed with its root as scanned, where float32 is fine, whatever the root does to it.
runtime::Probed probed_at(const runtime::BodyPoser& poser, const Pose& pose, const ProbeSettings& settings,
                          const std::vector<float>& points, const runtime::ProbeOptions& wants) {
  runtime::PosedBody body = poser.make_frame();
  const auto [code, what] = poser.run(pose, runtime::skinning_from_name(settings.skinning), {}, body,
                                      runtime::NodesOf::body, runtime::Root::still);
  if (code != StatusCode::ok) throw Error(ErrorKind::data, "pose", what, "mend the pose");
  const RigidTransform root = kinematics::forward(poser.model().rig, body.pose)[0];
  const runtime::Probe probe(poser.shared_model());
  runtime::Probe::PosedTree tree;
  probe.follow(body.nodes, tree);
  runtime::Probed probed;
  if (settings.direction == "posed-to-rest") {
    probe.posed_to_rest(tree, moved(root.inverse(), points), wants, probed);
  } else {
    probe.rest_to_posed(tree, points, wants, probed);
    probed.points = moved(root, std::move(probed.points));
  }
  using Gradient = Eigen::Matrix<float, 3, 3, Eigen::RowMajor>;
  for (std::size_t i = 0; i < probed.gradient.size(); i += 9) {
    Eigen::Map<Gradient> F(&probed.gradient[i]);
    F = (root.q.toRotationMatrix() * F.cast<double>()).cast<float>();
  }
  return probed;
}

int run(const Program& program, const ProbeSettings& settings) {
  const std::vector<float> points = read_points(settings.points);
  const auto model = std::make_shared<const Model>(model_file::read(settings.model, program.context("read")));
  const runtime::ProbeOptions wants = wants_of(settings, *model);
  const Pose pose = pose_of(program, settings, *model);
  const runtime::BodyPoser poser(model);
  const runtime::Probed probed = probed_at(poser, pose, settings, points, wants);

  const json columns = columns_of(wants, *model);
  json rows = json::array();
  std::size_t inside = 0;
  for (std::size_t i = 0; i < probed.tet.size(); ++i) {
    inside += probed.tet[i] != runtime::TetPlace::none;
    rows.push_back(row_of(i, points, probed, wants, *model));
  }
  json result{{"ok", true}, {"points", probed.tet.size()}, {"inside", inside}};
  if (settings.output.empty()) {
    const std::string table = program.json ? "" : csv_of(columns, rows);
    result["columns"] = columns;
    result["rows"] = std::move(rows);
    program.result(table, result);
    return 0;
  }
  files::write_text(settings.output, csv_of(columns, rows));
  result["file"] = settings.output.string();
  program.result(settings.output.string() + ": " + std::to_string(inside) + " of " +
                     std::to_string(probed.tet.size()) + " points lie in the body\n",
                 result);
  return 0;
}

}  // namespace

void declare_probe(CLI::App& app, Program& program, Run& chosen) {
  const auto s = std::make_shared<ProbeSettings>();
  CLI::App* command =
      app.add_subcommand("probe", "points through a posed body: where they were or went, and what is there");
  command->add_option("MODEL", s->model, "a model that preprocess made")->required();
  command->add_option("--points", s->points, "points, a CSV file with columns x, y, z: LPS, mm")->required();
  command->add_option("-o,--output", s->output, "the CSV file to write; without it the table is printed");
  command->add_option("--pose", s->pose, "a pose file, or lib:NAME; without it the body stays as scanned");
  command->add_option("--skinning", s->skinning, "how segments blend: cor, dqs or lbs")
      ->check(CLI::IsMember({"cor", "dqs", "lbs"}))
      ->capture_default_str();
  command
      ->add_option("--direction", s->direction,
                   "posed-to-rest: the points lie in the posed body; rest-to-posed: in the scan")
      ->check(CLI::IsMember({"posed-to-rest", "rest-to-posed"}))
      ->capture_default_str();
  command->add_option("--volumes", s->volumes, "volumes to sample: all, none, or names with commas between")
      ->delimiter(',')
      ->capture_default_str();
  command
      ->add_option("--sampling", s->sampling, "of volumes: nearest or trilinear; labels are always nearest")
      ->check(CLI::IsMember({"nearest", "trilinear"}))
      ->capture_default_str();
  command->add_flag("--gradient", s->gradient, "add the deformation gradient F from rest to posed");
  command->callback([&program, &chosen, s] { chosen = [&program, s] { return run(program, *s); }; });
}

}  // namespace ecorche::app
