// SPDX-License-Identifier: Apache-2.0
// `ecorche radiograph`: the picture that an X-ray source and a detector would make of a posed body.
#include <chrono>
#include <cmath>
#include <filesystem>
#include <memory>
#include <nlohmann/json.hpp>

#include <ecorche/kinematics/forward.hpp>
#include <ecorche/model_file/model_file.hpp>
#include <ecorche/runtime/radiograph_scan.hpp>
#include <ecorche/version.hpp>
#include "app/cli.hpp"
#include "app/command.hpp"
#include "app/pose_frames.hpp"
#include "app/radiograph_setup.hpp"
#include "app/unknown_name.hpp"
#include "app/usage_error.hpp"
#include "core/values/degrees.hpp"
#include "core/values/text.hpp"
#include "io/image/grey_picture.hpp"
#include "io/image/image_file.hpp"
#include "io/image/radiograph_dicom.hpp"

namespace ecorche::app {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;
using runtime::Exposure;

struct RadiographSettings {
  fs::path model, output;
  std::string pose, skinning = "cor", volume, scale = "log";
  SetupOptions setup;
  double kev = runtime::Attenuation::usual_kev;
  std::vector<double> window;  // empty: from 0 to the largest integral
  bool surfaces = false;
};

enum class Kind { png, dicom, integrals };

Kind kind_of(const fs::path& path) {
  const std::string name = text::lower(path.filename().string());
  if (name.ends_with(".png")) return Kind::png;
  if (name.ends_with(".dcm")) return Kind::dicom;
  if (name.ends_with(".nrrd") || name.ends_with(".mha") || name.ends_with(".nii.gz")) return Kind::integrals;
  usage_error(path.string(), "no picture is written as '" + path.extension().string() + "'",
              "use .png, .dcm, or for line integrals .nrrd, .mha or .nii.gz");
}

void check(const RadiographSettings& settings) {
  const Kind kind = kind_of(settings.output);
  if (settings.surfaces && !settings.volume.empty())
    usage_error("--surfaces", "it does nothing beside --volume", "leave out one of them");
  if (kind == Kind::integrals && (!settings.window.empty() || settings.scale != "log"))
    usage_error(settings.output.string(), "line integrals have no --scale and no --window",
                "leave them out, or write .png or .dcm");
  if (!settings.window.empty() &&
      !(settings.window.size() == 2 && settings.window[0] >= 0 && settings.window[0] < settings.window[1]))
    usage_error("--window", "no two ascending numbers from 0 on",
                "give the integrals of black and white, as 1,7");
}

// Null: the body has no scan, or is not to be seen by it.
const ModelVolume* volume_of(const RadiographSettings& settings, const Model& model) {
  if (settings.surfaces) return nullptr;
  if (settings.volume.empty()) return runtime::scan_of(model);
  for (const ModelVolume& volume : model.volumes) {
    if (volume.name != settings.volume) continue;
    if (volume.labels)
      usage_error("--volume", "'" + volume.name + "' holds labels, not Hounsfield units",
                  "name a CT, or use --surfaces");
    return &volume;
  }
  throw unknown_name("--volume", settings.volume, model.volumes);
}

Pose pose_of(const Program& program, const RadiographSettings& settings, const Model& model) {
  if (settings.pose.empty()) return Pose::rest(model.segment_count());
  FrameChoice choice;
  choice.pose = settings.pose;
  return read_frames(program, choice, model.rig).front().pose;
}

struct Traced {
  std::vector<float> integrals;
  json times;  // ms
};

double tenths(double ms) {
  return std::round(10 * ms) / 10;
}

Traced trace(const Program& program, const RadiographSettings& settings, const ModelVolume* volume,
             const std::shared_ptr<const Model>& model, const runtime::PosedBody& body,
             const runtime::XRaySetup& setup) {
  const runtime::Attenuation attenuation(settings.kev);
  const Context context = program.context("radiograph");
  if (volume == nullptr) {
    const auto start = std::chrono::steady_clock::now();
    Traced out{runtime::line_integrals(*model, body, attenuation, setup, context), {}};
    const std::chrono::duration<double, std::milli> took = std::chrono::steady_clock::now() - start;
    out.times["trace"] = tenths(took.count());
    return out;
  }
  const runtime::VolumePoser poser(model);
  runtime::ScanScratch scratch;
  Traced out{runtime::line_integrals(poser, body.nodes, *volume, attenuation, setup, scratch, context), {}};
  out.times = {{"pose_volume", tenths(scratch.times.pose_volume)},
               {"attenuation", tenths(scratch.times.attenuation)},
               {"trace", tenths(scratch.times.trace)}};
  return out;
}

std::array<double, 3> array_of(const Eigen::Vector3d& v) {
  return {v.x(), v.y(), v.z()};
}

// One slice, whose axes are the detector's rows, its columns, and their normal.
Image integral_image(const runtime::Detector& detector, const std::vector<float>& integrals) {
  ImageGrid grid;
  grid.size = {detector.pixels[0], detector.pixels[1], 1};
  const auto [width, height] = detector.pixel_mm();
  grid.spacing = {width, height, 1};
  grid.origin = array_of(detector.point(0, 0));
  const Eigen::Vector3d normal = detector.right.cross(detector.down);
  for (std::size_t r = 0; r < 3; ++r) {
    const auto row = static_cast<Eigen::Index>(r);
    grid.direction[3 * r] = detector.right[row];
    grid.direction[3 * r + 1] = detector.down[row];
    grid.direction[3 * r + 2] = normal[row];
  }
  Image out(grid, ScalarType::f32);
  std::copy(integrals.begin(), integrals.end(), out.scalars<float>().begin());
  return out;
}

std::string view_letters(const std::optional<runtime::Beam>& beam) {
  if (!beam || beam->turn != 0) return "";
  switch (beam->view) {
    case runtime::View::ap:
      return "AP";
    case runtime::View::pa:
      return "PA";
    case runtime::View::lateral_left:
      return "LL";
    case runtime::View::lateral_right:
      break;
  }
  return "RL";
}

io::RadiographFacts facts_of(const RadiographSettings& settings, const Model& model,
                             const ModelVolume* volume, const runtime::ChosenSetup& setup,
                             const Exposure& exposure) {
  io::RadiographFacts facts;
  facts.patient = "ECORCHE-" + text::hex(model_file::identity(model));
  facts.view = view_letters(setup.beam);
  facts.series =
      (facts.view.empty() ? "" : facts.view + " ") + setup.target +
      (settings.pose.empty() ? ", as scanned" : ", " + fs::path(settings.pose).filename().string());
  facts.log = exposure.scale == Exposure::Scale::log;
  const std::string low = text::number(exposure.low, 6), high = text::number(exposure.high, 6);
  facts.derivation =
      "Digitally reconstructed from " +
      (volume == nullptr ? "the posed surfaces" : "the posed volume '" + volume->name + "'") + " at " +
      text::number(settings.kev, 6) + " keV without scatter or noise. Grey 0 to 65535 is " +
      (facts.log ? "the line integral of attenuation from " + low + " to " + high
                 : "the share of photons that comes through from exp(-" + low + ") to exp(-" + high + ")") +
      ". For training and education.";
  facts.program = ECORCHE_VERSION;
  facts.right = array_of(setup.still.detector.right);
  facts.down = array_of(setup.still.detector.down);
  facts.source_to_detector = setup.here.source_to_detector();
  facts.source_to_patient = setup.source_to_target;
  return facts;
}

json setup_json(const runtime::ChosenSetup& setup) {
  const runtime::Detector& detector = setup.here.detector;
  json out{{"source", array_of(setup.here.source)},
           {"detector",
            {{"centre", array_of(detector.centre)},
             {"right", array_of(detector.right)},
             {"down", array_of(detector.down)},
             {"size_mm", detector.size_mm},
             {"pixels", detector.pixels}}},
           {"source_to_detector_mm", setup.here.source_to_detector()},
           {"source_to_target_mm", setup.source_to_target}};
  if (setup.beam) out["view"] = runtime::view_name(setup.beam->view);
  if (setup.beam && setup.beam->turn != 0) out["turn_deg"] = setup.beam->turn * degrees_per_radian;
  return out;
}

int run(const Program& program, const RadiographSettings& settings) {
  check(settings);
  const runtime::SetupChoice choice = choice_of(settings.setup);
  const auto model = std::make_shared<const Model>(model_file::read(settings.model, program.context("read")));
  const ModelVolume* volume = volume_of(settings, *model);
  const Pose pose = pose_of(program, settings, *model);
  const runtime::BodyPoser poser(model);
  // With its root as scanned, where float32 is fine; source and detector are brought there instead.
  runtime::PosedBody body = poser.make_frame();
  const auto [code, what] =
      poser.run(pose, runtime::skinning_from_name(settings.skinning),
                volume == nullptr ? poser.all_tissues() : std::span<const std::uint32_t>(), body,
                runtime::NodesOf::body, runtime::Root::still);
  if (code != StatusCode::ok) throw Error(ErrorKind::data, "pose", what, "mend the pose");
  const RigidTransform root = kinematics::forward(model->rig, body.pose)[0];
  const runtime::ChosenSetup setup = chosen_setup(choice, *model, body, root);
  Traced traced = trace(program, settings, volume, model, body, setup.still);

  Exposure exposure;
  exposure.scale = settings.scale == "log" ? Exposure::Scale::log : Exposure::Scale::linear;
  if (!settings.window.empty()) {
    exposure.low = settings.window[0];
    exposure.high = settings.window[1];
  }
  exposure = runtime::fitted(exposure, traced.integrals);
  const Kind kind = kind_of(settings.output);
  const runtime::Detector& detector = setup.here.detector;
  if (kind == Kind::integrals) {
    io::write_image(settings.output, integral_image(detector, traced.integrals));
  } else {
    const std::vector<std::uint16_t> grey = runtime::expose(traced.integrals, exposure);
    const io::GreyPicture picture{detector.pixels[0], detector.pixels[1], detector.pixel_mm(), grey};
    if (kind == Kind::png) {
      io::write_png(settings.output, picture);
    } else {
      io::write_radiograph_dicom(settings.output, picture,
                                 facts_of(settings, *model, volume, setup, exposure));
    }
  }

  const float most = *std::max_element(traced.integrals.begin(), traced.integrals.end());
  if (most <= 0)
    program.note("warning: " + settings.output.string() +
                 ": nothing stands between source and detector (choose another --target or a larger --size)");
  json result{{"ok", true},
              {"file", settings.output.string()},
              {"of", volume == nullptr ? json("surfaces") : json(volume->name)},
              {"energy_kev", settings.kev},
              {"largest_integral", most},
              {"setup", setup_json(setup)},
              {"milliseconds", traced.times}};
  if (kind != Kind::integrals)
    result["exposure"] = {{"scale", settings.scale}, {"window", {exposure.low, exposure.high}}};
  program.result(settings.output.string() + ": " + std::to_string(detector.pixels[0]) + " x " +
                     std::to_string(detector.pixels[1]) + " pixels through " +
                     (volume == nullptr ? std::string("the surfaces") : volume->name) +
                     ", line integrals up to " + text::number(most) + "\n",
                 result);
  return 0;
}

}  // namespace

void declare_radiograph(CLI::App& app, Program& program, Run& chosen) {
  const auto s = std::make_shared<RadiographSettings>();
  CLI::App* command = app.add_subcommand(
      "radiograph", "the picture that an X-ray source and detector would make of a posed body");
  command->add_option("MODEL", s->model, "a model that preprocess made")->required();
  command
      ->add_option(
          "-o,--output", s->output,
          "the picture: .png or .dcm (16 bits); .nrrd, .mha or .nii.gz: line integrals of attenuation")
      ->required();
  command->add_option("--pose", s->pose, "a pose file, or lib:NAME; without it the body stays as scanned");
  command->add_option("--skinning", s->skinning, "how segments blend: cor, dqs or lbs")
      ->check(CLI::IsMember({"cor", "dqs", "lbs"}))
      ->capture_default_str();
  add_setup_options(*command, s->setup);
  command->add_option(
      "--volume", s->volume,
      "the volume that is seen, in Hounsfield units; without it the first one around which lies "
      "air, and where there is none the surfaces");
  command->add_flag("--surfaces", s->surfaces,
                    "see the closed surfaces instead, each as dense as tissue of its group");
  command
      ->add_option("--energy", s->kev, "of the photons, keV, 20 to 150: about half of a tube's peak voltage")
      ->capture_default_str();
  command
      ->add_option(
          "--scale", s->scale,
          "of grey values: log (they grow with the line integral) or linear (they fall with the share "
          "of photons that comes through)")
      ->check(CLI::IsMember({"log", "linear"}))
      ->capture_default_str();
  command
      ->add_option("--window", s->window,
                   "line integrals that are black and white, as 1,7; without it 0 and the largest")
      ->delimiter(',')
      ->expected(2);
  command->callback([&program, &chosen, s] { chosen = [&program, s] { return run(program, *s); }; });
}

}  // namespace ecorche::app
