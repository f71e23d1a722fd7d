// SPDX-License-Identifier: Apache-2.0
// `ecorche pose`: offline posing, from a pose file or frames of a motion clip, into files.
#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>

#include <ecorche/io/case_file.hpp>
#include <ecorche/model_file/model_file.hpp>
#include <ecorche/runtime/pose_quality.hpp>
#include <ecorche/runtime/resample.hpp>
#include <ecorche/runtime/skin_caps.hpp>
#include <ecorche/runtime/volume_poser.hpp>
#include "app/bridge_option.hpp"
#include "app/cli.hpp"
#include "app/command.hpp"
#include "app/measured_pose.hpp"
#include "app/pose_frames.hpp"
#include "app/pose_plan.hpp"
#include "app/pose_report.hpp"
#include "app/posed_case.hpp"
#include "app/posed_dicom.hpp"
#include "app/posed_folder.hpp"
#include "app/posed_tets.hpp"
#include "app/relax_pose.hpp"
#include "app/tet_regions.hpp"
#include "core/files/atomic_file.hpp"
#include "core/values/text.hpp"
#include "io/image/image_file.hpp"
#include "io/surface/surface_file.hpp"
#include "runtime/spheres/pose_volume.hpp"

namespace ecorche::app {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

constexpr double kPaperThinness = 0.48;  // of the spheres of a scan

runtime::Sampling sampling_of(const PoseSettings& settings) {
  return settings.sampling == "nearest" ? runtime::Sampling::nearest : runtime::Sampling::trilinear;
}

// Writes one posed body. Every file is checked for a stop request before it is begun.
class FrameWriter {
 public:
  FrameWriter(const PoseSettings& settings, const Plan& plan, const runtime::VolumePoser& poser,
              const runtime::PosedBody& body, const std::vector<float>& det_f, fs::path stage,
              fs::path folder, const Context& context)
      : settings_(settings),
        plan_(plan),
        poser_(poser),
        model_(poser.model()),
        body_(body),
        det_f_(det_f),
        stage_(std::move(stage)),
        folder_(std::move(folder)),
        context_(context) {}

  /// Volumes become DICOM.
  void use_dicom(const Program& program, io::DicomFacts facts) {
    dicom_.emplace(program, std::move(facts), [this](const std::string& name) { return next(name); });
  }

  json write(const json& quality) {
    for (const std::uint32_t row : plan_.tissues) write_tissue(row);
    if (plan_.tets || plan_.field) write_tets();
    if (dicom_) {
      for (const std::uint32_t row : plan_.volumes)
        dicom_->add(model_.volumes[row], posed(model_.volumes[row]));
      dicom_->finish();
    } else {
      for (const std::uint32_t row : plan_.volumes)
        io::write_image(next(model_.volumes[row].name + "." + settings_.volume_format),
                        posed(model_.volumes[row]));
    }
    if (plan_.field) write_field();
    if (quality.contains("fem")) files::write_text(next("fem.json"), quality["fem"].dump(2) + "\n");
    files::write_text(next("quality.json"), quality.dump(2) + "\n");
    return written_;
  }

 private:
  // The path of the next file, named in the result.
  fs::path next(const std::string& name) {
    context_.check_stop();
    const std::size_t files = plan_.tissues.size() * settings_.formats.size() + plan_.volumes.size() +
                              (plan_.tets ? settings_.tet_formats.size() : 0) + (plan_.field ? 3 : 0) +
                              (settings_.by_fem() ? 2 : 1);
    context_.report(static_cast<double>(written_.size()) / static_cast<double>(files));
    written_.push_back((folder_ / name).string());
    return stage_ / name;
  }

  void write_tissue(std::uint32_t row) {
    const std::vector<float>& posed = body_.tissues[row];
    io::NamedSurface named{model_.tissues[row].name, model_.tissues[row].group, {}};
    SurfaceMesh& mesh = named.mesh;
    mesh.V = Eigen::Map<const PointsF>(posed.data(), static_cast<Eigen::Index>(posed.size() / 3), 3)
                 .cast<double>();
    mesh.F = model_.tissues[row].F;
    for (const std::string& format : settings_.formats) {
      const fs::path file = next(named.name + "." + format);
      if (format == "glb") {
        io::write_surfaces(file, without_caps(named, row));  // with the tissue's name and material
      } else {
        io::write_surface(file, mesh);
      }
    }
  }

  // A skin that its scan's border cuts in two: the skin, and its caps.
  std::vector<io::NamedSurface> without_caps(const io::NamedSurface& whole, std::uint32_t row) const {
    const Tissue& tissue = model_.tissues[row];
    const std::vector<std::uint8_t> caps =
        row == 0 ? runtime::cap_faces(tissue, runtime::skin_caps(model_)) : std::vector<std::uint8_t>{};
    if (std::find(caps.begin(), caps.end(), 1) == caps.end()) return {whole};
    std::vector<io::NamedSurface> out{{whole.name, whole.group, {whole.mesh.V, {}}},
                                      {whole.name + "_cap", Group::other, {whole.mesh.V, {}}}};
    const auto count = static_cast<Eigen::Index>(std::count(caps.begin(), caps.end(), 1));
    out[0].mesh.F.resize(tissue.F.rows() - count, 3);
    out[1].mesh.F.resize(count, 3);
    std::array<Eigen::Index, 2> at{0, 0};
    for (Eigen::Index f = 0; f < tissue.F.rows(); ++f) {
      const std::size_t part = caps[static_cast<std::size_t>(f)];
      out[part].mesh.F.row(at[part]++) = tissue.F.row(f);
    }
    return out;
  }

  // The posed tets, with the way of every node from rest: the forward displacement field.
  void write_tets() {
    const PointsF posed = Eigen::Map<const PointsF>(body_.nodes.data(), model_.nodes.rows(), 3);
    const PointsF moved = posed - model_.nodes;
    const auto write = [&](const std::string& ending) {
      io::write_tets(next("body." + ending), posed, model_.tets,
                     {{"displacement", 3, {moved.data(), moved.data() + moved.size()}}},
                     {{"label", 1, {model_.tet_label.begin(), model_.tet_label.end()}},
                      {std::string(kTetSegment), 1, segment_of_tets(model_)},
                      {"det_f", 1, det_f_}},
                     tet_regions(model_));
      if (ending == "ele") written_.push_back((folder_ / "body.node").string());
    };
    bool field_written = !plan_.field;  // body.vtu carries the way from rest to posed
    if (plan_.tets) {
      for (const std::string& format : settings_.tet_formats) {
        write(format == "mcnp" ? "mcnp.inp" : format);
        field_written = field_written || format == "vtu";
      }
    }
    if (!field_written) write("vtu");
  }

  ImageGrid grid_for(const ImageGrid& rest) const {
    return settings_.grid == "rest" ? rest : runtime::grow_to(rest, body_.nodes);
  }

  Image posed(const ModelVolume& volume) const {
    const auto balls = plan_.balls.find(volume.name);
    return balls == plan_.balls.end() ? drawn(volume) : refilled(volume, balls->second);
  }

  Image drawn(const ModelVolume& volume) const {
    Image posed;
    runtime::VolumePoser::Scratch scratch;
    poser_.pose(body_.nodes, volume, sampling_of(settings_), grid_for(volume.image.grid), posed, scratch,
                context_);
    return posed;
  }

  Image refilled(const ModelVolume& volume, const runtime::VolumeBalls& balls) const {
    const runtime::BallSet set = balls.at(body_.segments);
    const runtime::LatticeBox box =
        settings_.grid == "rest" ? runtime::LatticeBox{{0, 0, 0}, set.lattice.size} : runtime::grown_box(set);
    return runtime::refill(set, box, volume.image, volume.background,
                           runtime::sampling_for(volume, sampling_of(settings_)), context_);
  }

  void write_field() {
    runtime::InverseMap map;
    runtime::locate(model_, body_.nodes, grid_for(field_grid()), map, context_);
    const auto field = runtime::inverse_displacement(model_, body_.nodes, map);
    io::write_image(next("displacement." + settings_.field_format()), field.vectors);
    io::write_image(next("mask." + settings_.field_format()), field.mask);
  }

  // The first volume's lattice; without volumes one around the rest body of at most about 4 million cubic
  // voxels.
  ImageGrid field_grid() const {
    if (!model_.volumes.empty()) return model_.volumes.front().image.grid;
    const Eigen::Vector3d low = model_.nodes.colwise().minCoeff().transpose().cast<double>();
    const Eigen::Vector3d high = model_.nodes.colwise().maxCoeff().transpose().cast<double>();
    const double edge = std::max(0.5, std::ceil(2 * std::cbrt((high - low).prod() / 4e6)) / 2);
    ImageGrid grid;
    for (std::size_t a = 0; a < 3; ++a) {
      const auto axis = static_cast<Eigen::Index>(a);
      grid.origin[a] = low[axis];
      grid.spacing[a] = edge;
      grid.size[a] = static_cast<std::int32_t>(std::ceil((high[axis] - low[axis]) / edge)) + 1;
    }
    return grid;
  }

  const PoseSettings& settings_;
  const Plan& plan_;
  const runtime::VolumePoser& poser_;
  const Model& model_;
  const runtime::PosedBody& body_;
  const std::vector<float>& det_f_;  // of every tet
  fs::path stage_, folder_;          // where to write, and what that becomes
  const Context& context_;
  json written_ = json::array();
  std::optional<PosedDicom> dicom_;
};

// Of one pose.
io::DicomFacts facts_of(io::DicomFacts facts, const PoseSettings& settings, const Frame& frame,
                        const Rig& rig) {
  facts.pose = io::pose_to_yaml(frame.pose, rig) + settings.skinning + settings.deformer +
               (settings.unfold ? "unfolded" : "") + (settings.settle ? "settled" : "");
  facts.words = frame.name.empty() ? fs::path(settings.frames.pose).stem().string() : frame.name;
  return facts;
}

// `given`: the poses, where they were read already, on the same rig.
int pose_model(const Program& program, const PoseSettings& settings, std::vector<Frame> given, json result) {
  const auto model = std::make_shared<const Model>(model_file::read(settings.model, program.context("read")));
  Plan plan = plan_of(settings, *model);
  if (settings.deformer == "spheres" && model->spheres.empty())
    throw Error(ErrorKind::config, settings.model.string(), "it holds no spheres",
                "preprocess it with spheres, or deform by tets");
  for (const std::uint32_t row : plan.volumes) {
    const ModelVolume& volume = model->volumes[row];
    if (settings.deformer == "spheres")
      plan.balls.try_emplace(volume.name, *model, volume, settings.bridge, program.context("seams"));
  }
  const std::vector<Frame> frames =
      given.empty() ? read_frames(program, settings.frames, model->rig) : std::move(given);
  (frames.front().name.empty() ? check_folder_of_a_body : check_folder_of_frames)(settings.output);
  const std::uint64_t identity = model_file::identity(*model);
  const runtime::BodyPoser poser(model);
  const runtime::VolumePoser volumes(model);
  const runtime::Skinning skinning =
      runtime::skinning_from_name(settings.by_fem() ? "cor" : settings.skinning);
  MeasuredPose posed(poser);
  PoseRelaxer relaxer(settings, *model);
  io::DicomFacts dicom;
  if (settings.writes_dicom())
    dicom = dicom_facts(program, settings.dicom, "ECORCHE-" + text::hex(identity),
                        "Posed by ecorche: the values of the scan, moved with the body's tissues (" +
                            settings.sampling + "). For training and education.");

  result["ok"] = true;
  result["skinning"] = settings.skinning;
  std::string text;
  for (const Frame& frame : frames) {
    const Context context = program.context(frame.name.empty() ? "pose" : frame.name);
    // Quality looks at every tissue, whichever are written.
    const Status status = posed.run(frame.pose, skinning);
    if (!status.ok()) throw Error(ErrorKind::data, "pose " + frame.name, status.message, "mend the motion");
    const json relaxed = relaxer.run(posed, context);
    const runtime::PosedBody& body = posed.body();
    const std::vector<float> det_f = runtime::tet_det_f(*model, posed.still().nodes);
    json quality =
        quality_json(*model, body, posed.measure(), det_f,
                     {skinning, settings.settle || settings.by_fem(), settings.deformer == "tets"});
    add_relaxed(relaxed, quality);
    if (!frame.missed.empty()) {
      quality["verdict"] = "warn";
      quality["warnings"].insert(quality["warnings"].begin(), frame.missed.begin(), frame.missed.end());
    }
    if (quality["verdict"] == "warn") program.warn();
    const fs::path folder = frame.name.empty() ? settings.output : settings.output / frame.name;
    PosedFolder target(folder);
    if (settings.as_case)
      io::write_case(target.stage(),
                     posed_case(volumes, body, {sampling_of(settings), settings.grid == "posed"}, context),
                     context);
    FrameWriter writer(settings, plan, volumes, body, det_f, target.stage(), folder, context);
    if (settings.writes_dicom()) writer.use_dicom(program, facts_of(dicom, settings, frame, model->rig));
    json written = writer.write(quality);
    if (settings.as_case) written.push_back((folder / "case.yaml").string());
    const PosedAs as{identity,        settings.skinning, settings.deformer,
                     settings.unfold, settings.settle,   plan.field};
    for (const std::string& added : target.finish(*model, body, frame.pose, as, context))
      written.push_back((folder / added).string());
    result["frames"].push_back({{"name", frame.name},
                                {"folder", folder.string()},
                                {"files", std::move(written)},
                                {"quality", quality}});
    if (!frame.ik.is_null()) result["frames"].back()["ik"] = frame.ik;
    if (!frame.missed.empty()) result["ok"] = false;
    text += line_of(result["frames"].back());
  }
  program.result(text, result);
  return 0;
}

}  // namespace

int run_pose(const Program& program, PoseSettings& settings) {
  check_settings(settings);
  if (!settings.scan.wanted()) return pose_model(program, settings, {}, {{"model", settings.model.string()}});
  // What would fail only after minutes of work is refused first.
  check_frames(settings.frames);
  if (settings.frames.motion.file.empty()) check_folder_of_a_body(settings.output);
  if (settings.deformer == "spheres") settings.scan.prepare.spheres_tp = kPaperThinness;
  std::vector<Frame> frames;
  return pose_scan(program, settings.scan,
                   {settings.output, settings.frames.motion.limits,
                    [&](const Rig& rig) {
                      frames = read_frames(program, settings.frames, rig);
                      if (!frames.front().name.empty()) check_folder_of_frames(settings.output);
                    },
                    [&](const fs::path& model, const json& scan) {
                      settings.model = model;
                      return pose_model(program, settings, std::move(frames), {{"scan", scan}});
                    }});
}

void declare_pose(CLI::App& app, Program& program, Run& chosen) {
  const auto s = std::make_shared<PoseSettings>();
  CLI::App* command = app.add_subcommand(
      "pose", "pose a model offline: meshes, volumes, tets, displacement fields, quality.json");
  command->add_option("MODEL", s->model, "a model that preprocess made");
  command
      ->add_option("-o,--output", s->output,
                   "folder of the posed body: it appears whole; an earlier one in it gives way, anything "
                   "else is refused")
      ->required();
  add_frame_options(*command, s->frames);
  add_scan_posing(*command, s->scan);
  command
      ->add_option(
          "--skinning", s->skinning,
          "how segments blend: cor (neither collapses nor bulges, folds most), dqs (bulges, folds least) "
          "or lbs (collapses); fem solves for balance instead (ecorche fem tells more)")
      ->check(CLI::IsMember({"cor", "dqs", "lbs", "fem"}))
      ->capture_default_str();
  const char* choice =
      "What is not named is not written; without --tissues, --volumes, --tets and --field "
      "everything is.";
  command->footer(choice);
  command
      ->add_option("--deformer", s->deformer,
                   "how volumes follow: tets, or spheres (the model's volumetric skeleton, refilled)")
      ->check(CLI::IsMember({"tets", "spheres"}))
      ->capture_default_str();
  add_relaxing(*command, *s);
  add_bridge_option(*command, s->bridge);
  command->add_option("--tissues", s->tissues, "tissues to write: all, none, or names with commas between")
      ->delimiter(',');
  command
      ->add_option(
          "--format", s->formats,
          "of the tissues, a file each: stl, obj, ply, off, vtp, glb (with name and colour), or several")
      ->delimiter(',')
      ->check(CLI::IsMember({"stl", "obj", "ply", "off", "vtp", "glb"}))
      ->capture_default_str();
  command->add_option("--volumes", s->volumes, "volumes to write: all, none, or names with commas between")
      ->delimiter(',');
  command
      ->add_option("--volume-format", s->volume_format,
                   "of volumes and fields: nrrd, mha or nii.gz; dicom: a CT series each, labels as DICOM SEG")
      ->check(CLI::IsMember({"nrrd", "mha", "nii.gz", "dicom"}))
      ->capture_default_str();
  add_dicom_options(*command, s->dicom);
  command
      ->add_option("--sampling", s->sampling, "of volumes: nearest or trilinear; labels are always nearest")
      ->check(CLI::IsMember({"nearest", "trilinear"}))
      ->capture_default_str();
  command
      ->add_option("--grid", s->grid, "of volumes: posed (the rest lattice grown to the posed body) or rest")
      ->check(CLI::IsMember({"posed", "rest"}))
      ->capture_default_str();
  command->add_flag("--tets", s->tets, "write the posed tets; body.vtu holds displacement, label and det F");
  command
      ->add_option(
          "--tet-format", s->tet_formats,
          "of the tets: vtu, msh (Gmsh), ele (TetGen), inp (Abaqus), mcnp (checked, in cm), or several")
      ->delimiter(',')
      ->check(CLI::IsMember({"vtu", "msh", "ele", "inp", "mcnp"}))
      ->capture_default_str();
  command->add_flag(
      "--field", s->field,
      "write the displacement field: rest to posed on the nodes of body.vtu, posed to rest as an "
      "image with a mask");
  command->add_flag(
      "--as-case", s->as_case,
      "write the posed patient as a new case, ready for preprocess: surfaces, label map, volumes, "
      "skeleton in its new rest pose; and body.vtu");
  command->callback([&program, &chosen, s] { chosen = [&program, s] { return run_pose(program, *s); }; });
}

}  // namespace ecorche::app
