// SPDX-License-Identifier: Apache-2.0
// `ecorche pose`: offline posing, from a pose file or frames of a motion clip, into files.
#include <filesystem>
#include <memory>
#include <nlohmann/json.hpp>

#include <ecorche/io/case_file.hpp>
#include <ecorche/model_file/model_file.hpp>
#include <ecorche/runtime/pose_quality.hpp>
#include <ecorche/runtime/volume_poser.hpp>
#include "app/bridge_option.hpp"
#include "app/cli.hpp"
#include "app/command.hpp"
#include "app/frame_writer.hpp"
#include "app/measured_pose.hpp"
#include "app/pose_frames.hpp"
#include "app/pose_plan.hpp"
#include "app/pose_report.hpp"
#include "app/posed_case.hpp"
#include "app/posed_dicom.hpp"
#include "app/posed_folder.hpp"
#include "app/relax_pose.hpp"
#include "app/slice_choice.hpp"
#include "core/values/text.hpp"
#include "runtime/spheres/pose_volume.hpp"

namespace ecorche::app {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

constexpr double kPaperThinness = 0.48;  // of the spheres of a scan

// Of one pose.
io::DicomFacts facts_of(io::DicomFacts facts, const PoseSettings& settings, const Frame& frame,
                        const Rig& rig) {
  facts.pose = io::pose_to_yaml(frame.pose, rig) + settings.skinning + settings.deformer +
               (settings.unfold ? "unfolded" : "") + (settings.settle ? "settled" : "");
  facts.words = frame.name.empty() ? fs::path(settings.frames.pose).stem().string() : frame.name;
  return facts;
}

// `given`: the poses, where they were read already, on the same rig.
int pose_model(const Program& program, const PoseSettings& settings,
               const std::optional<io::ScanSlices>& slices, std::vector<Frame> given, json result) {
  const auto model = std::make_shared<const Model>(model_file::read(settings.model, program.context("read")));
  Plan plan = plan_of(settings, *model);
  plan.slices = slices;
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

  if (plan.slices) dicom.positions = plan.slices->positions;

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
  const std::optional<io::ScanSlices> slices = chosen_slices(settings);
  if (!settings.scan.wanted())
    return pose_model(program, settings, slices, {}, {{"model", settings.model.string()}});
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
                      return pose_model(program, settings, slices, std::move(frames), {{"scan", scan}});
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
  command
      ->add_option(
          "--volumes", s->volumes,
          "volumes to write: all, none, or names with commas between; beside each lies its mask, NAME-mask: "
          "1 where a value is of the scan, 0 where it is background")
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
  command
      ->add_option("--resample", s->resample,
                   "onto which slices volumes are brought: even (voxels at right angles and even distances, "
                   "as the model holds them; --grid says how many) or slices (those of the scan, where they "
                   "lay: of --dicom-source, else of --scan)")
      ->check(CLI::IsMember({"even", "slices"}))
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
