// SPDX-License-Identifier: Apache-2.0
// `ecorche deformers`: the same volume posed by tets and by spheres, side by side.
#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <functional>
#include <memory>
#include <nlohmann/json.hpp>

#include <ecorche/model_file/model_file.hpp>
#include <ecorche/runtime/body_poser.hpp>
#include "app/bridge_option.hpp"
#include "app/cli.hpp"
#include "app/command.hpp"
#include "app/pose_frames.hpp"
#include "app/unknown_name.hpp"
#include "core/files/atomic_file.hpp"
#include "io/image/image_file.hpp"
#include "runtime/spheres/pose_volume.hpp"

namespace ecorche::app {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

struct DeformersSettings {
  fs::path model, output;
  FrameChoice frames;
  std::string volume, sampling = "nearest", skinning = "cor";
  bool bridge = true;
};

double seconds_of(const std::function<void()>& work) {
  const auto start = std::chrono::steady_clock::now();
  work();
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

// The grid of both on one lattice: the smallest box around the two.
ImageGrid joined(const ImageGrid& a, const ImageGrid& b) {
  const auto at = a.index(b.origin);
  ImageGrid out = a;
  std::array<std::int32_t, 3> first{};
  for (std::size_t i = 0; i < 3; ++i) {
    const auto shift = static_cast<std::int32_t>(std::lround(at[i]));
    first[i] = std::min(0, shift);
    out.size[i] = std::max(a.size[i], shift + b.size[i]) - first[i];
  }
  out.origin = a.point(first[0], first[1], first[2]);
  return out;
}

// `image` on a larger grid of its lattice; the rest as `fill`, one voxel's bytes.
Image grown(const Image& image, const ImageGrid& grid, std::span<const std::byte> fill) {
  Image out(grid, image.type, image.components);
  const std::size_t voxel = fill.size();
  for (std::size_t b = 0; b < out.bytes.size(); ++b) out.bytes[b] = fill[b % voxel];
  const auto at = grid.index(image.grid.origin);
  const auto shift = [&](std::size_t a) { return static_cast<int>(std::lround(at[a])); };
  const std::size_t row = voxel * static_cast<std::size_t>(image.grid.size[0]);
  for (int k = 0; k < image.grid.size[2]; ++k) {
    for (int j = 0; j < image.grid.size[1]; ++j) {
      std::memcpy(&out.bytes[voxel * grid.offset(shift(0), j + shift(1), k + shift(2))],
                  &image.bytes[voxel * image.grid.offset(0, j, k)], row);
    }
  }
  return out;
}

// u8: where something lies, by what is not background.
Image held_in(const Image& image, std::span<const std::byte> background) {
  Image out(image.grid, ScalarType::u8);
  const auto held = out.scalars<std::uint8_t>();
  for (std::size_t v = 0; v < held.size(); ++v)
    held[v] = std::memcmp(&image.bytes[v * background.size()], background.data(), background.size()) != 0;
  return out;
}

// A voxel of the object whose six neighbours are too.
bool inner(const Image& mask, int i, int j, int k) {
  const auto& size = mask.grid.size;
  if (i < 1 || j < 1 || k < 1 || i + 1 >= size[0] || j + 1 >= size[1] || k + 1 >= size[2]) return false;
  const auto at = [&](int x, int y, int z) {
    return mask.scalars<std::uint8_t>()[mask.grid.offset(x, y, z)] != 0;
  };
  return at(i - 1, j, k) && at(i + 1, j, k) && at(i, j - 1, k) && at(i, j + 1, k) && at(i, j, k - 1) &&
         at(i, j, k + 1);
}

struct Differences {
  std::size_t object = 0, differ = 0, inside = 0;
  Image colours;  // u8: 0 nothing, 1 the same, 2 differs on the boundary, 3 differs within
};

// Of the voxels that either holds; boundary where either has its own there.
Differences compare(const Image& a, const Image& b, std::span<const std::byte> background) {
  const Image in_a = held_in(a, background), in_b = held_in(b, background);
  Differences out{0, 0, 0, Image(a.grid, ScalarType::u8)};
  const auto colour = out.colours.scalars<std::uint8_t>();
  for (int k = 0; k < a.grid.size[2]; ++k) {
    for (int j = 0; j < a.grid.size[1]; ++j) {
      for (int i = 0; i < a.grid.size[0]; ++i) {
        const std::size_t v = a.grid.offset(i, j, k);
        if (in_a.scalars<std::uint8_t>()[v] == 0 && in_b.scalars<std::uint8_t>()[v] == 0) continue;
        ++out.object;
        colour[v] = 1;
        if (std::memcmp(&a.bytes[v * background.size()], &b.bytes[v * background.size()],
                        background.size()) == 0)
          continue;
        ++out.differ;
        const bool within = inner(in_a, i, j, k) && inner(in_b, i, j, k);
        out.inside += within;
        colour[v] = within ? 3 : 2;
      }
    }
  }
  return out;
}

// One voxel of background as the volume's type holds it.
std::vector<std::byte> background_bytes(const ModelVolume& volume) {
  std::vector<std::byte> out(scalar_bytes(volume.image.type) *
                             static_cast<std::size_t>(volume.image.components));
  with_scalar_type(volume.image.type, [&](auto zero) {
    const auto value = static_cast<decltype(zero)>(volume.background);
    for (std::size_t at = 0; at < out.size(); at += sizeof value) std::memcpy(&out[at], &value, sizeof value);
  });
  return out;
}

json compare_frame(const DeformersSettings& s, const runtime::BodyPoser& poser, const ModelVolume& volume,
                   const runtime::VolumeBalls& balls, const Frame& frame, const Context& context) {
  const Model& model = poser.model();
  runtime::PosedBody body = poser.make_frame();
  const runtime::Sampling how = runtime::sampling_for(
      volume, s.sampling == "nearest" ? runtime::Sampling::nearest : runtime::Sampling::trilinear);
  const double skin = seconds_of([&] {
    const Status status = poser.run(frame.pose, runtime::skinning_from_name(s.skinning), {}, body);
    if (!status.ok()) throw Error(ErrorKind::data, "pose " + frame.name, status.message, "mend the motion");
  });
  context.check_stop();
  Image by_tets, by_spheres;
  std::size_t tets_mib = 0, spheres_mib = 0;
  constexpr std::size_t kMib = std::size_t{1} << 20;
  const double tets = seconds_of([&] {
    runtime::InverseMap map;
    runtime::locate(model, body.nodes, runtime::grow_to(volume.image.grid, body.nodes), map, context);
    by_tets = runtime::resample(model, body.nodes, map, volume, how);
    tets_mib =
        (map.tet.size() * sizeof map.tet[0] + by_tets.bytes.size() + body.nodes.size() * sizeof(float)) /
        kMib;
  });
  const double spheres = seconds_of([&] {
    const runtime::BallSet set = balls.at(body.segments);
    by_spheres = runtime::refill(set, runtime::grown_box(set), volume.image, volume.background, how, context);
    spheres_mib = (set.balls.size() * (sizeof set.balls[0] + 48) + by_spheres.bytes.size()) / kMib;
  });
  const std::vector<std::byte> background = background_bytes(volume);
  const ImageGrid grid = joined(by_tets.grid, by_spheres.grid);
  const Image a = grown(by_tets, grid, background), b = grown(by_spheres, grid, background);
  const Differences d = compare(a, b, background);
  if (!s.output.empty()) {
    const fs::path folder = frame.name.empty() ? s.output : s.output / frame.name;
    files::make_folder(folder);
    io::write_image(folder / "tets.nrrd", a);
    io::write_image(folder / "spheres.nrrd", b);
    io::write_image(folder / "difference.nrrd", d.colours);
  }
  return {{"name", frame.name},
          {"object_voxels", d.object},
          {"differ", d.differ},
          {"differ_inner", d.inside},
          {"differ_boundary", d.differ - d.inside},
          {"tets", {{"seconds", skin + tets}, {"mib", tets_mib}}},
          {"spheres", {{"seconds", spheres}, {"mib", spheres_mib}}}};
}

std::string differences_text(const json& frames) {
  std::string text;
  char line[300];
  for (const json& f : frames) {
    const double share = 100.0 / std::max(f["object_voxels"].get<double>(), 1.0);
    std::snprintf(line, sizeof line,
                  "%s%s%.3f %% of %zu voxels differ: %.3f %% on the boundary, %.3f %% within; tets %.3f s, "
                  "%zu MiB; spheres %.3f s, %zu MiB\n",
                  f["name"].get<std::string>().c_str(), f["name"].get<std::string>().empty() ? "" : ": ",
                  share * f["differ"].get<double>(), f["object_voxels"].get<std::size_t>(),
                  share * f["differ_boundary"].get<double>(), share * f["differ_inner"].get<double>(),
                  f["tets"]["seconds"].get<double>(), f["tets"]["mib"].get<std::size_t>(),
                  f["spheres"]["seconds"].get<double>(), f["spheres"]["mib"].get<std::size_t>());
    text += line;
  }
  return text;
}

int run(const Program& program, const DeformersSettings& s) {
  const auto model = std::make_shared<const Model>(model_file::read(s.model, program.context("read")));
  const auto volume = std::find_if(model->volumes.begin(), model->volumes.end(),
                                   [&](const ModelVolume& v) { return v.name == s.volume; });
  if (volume == model->volumes.end()) throw unknown_name("--volume", s.volume, model->volumes);
  const VolumetricSkeleton& spheres = runtime::spheres_for(*model, *volume);
  if (!(runtime::posed_lattice(spheres, *volume) == volume->image.grid))
    throw Error(ErrorKind::usage, "--volume",
                "its voxels are not cubic, so the two do not pose it on one lattice", "resample it");
  const std::vector<Frame> frames = read_frames(program, s.frames, model->rig);
  note_missed(program, frames);
  const runtime::BodyPoser poser(model);
  const runtime::VolumeBalls balls(*model, *volume, s.bridge, program.context("seams"));
  json rows = json::array();
  for (const Frame& frame : frames)
    rows.push_back(compare_frame(s, poser, *volume, balls, frame, program.context("pose")));
  program.result(differences_text(rows), {{"ok", true},
                                          {"volume", s.volume},
                                          {"balls", spheres.size()},
                                          {"tets", model->tet_count()},
                                          {"frames", rows}});
  return 0;
}

}  // namespace

void declare_deformers(CLI::App& app, Program& program, Run& chosen) {
  const auto s = std::make_shared<DeformersSettings>();
  CLI::App* command =
      app.add_subcommand("deformers", "pose a volume by tets and by spheres, and say where they differ");
  command->add_option("MODEL", s->model, "a model that holds spheres")->required();
  command->add_option("--volume", s->volume, "which of its volumes")->required();
  command->add_option(
      "-o,--output", s->output,
      "folder for tets.nrrd, spheres.nrrd and difference.nrrd (1 same, 2 differs on the boundary, 3 within)");
  add_frame_options(*command, s->frames);
  add_bridge_option(*command, s->bridge);
  command->add_option("--sampling", s->sampling, "nearest or trilinear; labels are always nearest")
      ->check(CLI::IsMember({"nearest", "trilinear"}))
      ->capture_default_str();
  command->add_option("--skinning", s->skinning, "of the tets: cor, dqs or lbs")
      ->check(CLI::IsMember({"cor", "dqs", "lbs"}))
      ->capture_default_str();
  command->callback([&program, &chosen, s] { chosen = [&program, s] { return run(program, *s); }; });
}

}  // namespace ecorche::app
