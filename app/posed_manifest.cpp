// SPDX-License-Identifier: Apache-2.0
#include "app/posed_manifest.hpp"

#include <algorithm>
#include <array>
#include <charconv>
#include <cstdio>
#include <nlohmann/json.hpp>

#include "core/files/atomic_file.hpp"
#include "core/values/text.hpp"
#include "io/case/digest.hpp"

namespace ecorche::app {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

constexpr std::array<std::string_view, 10> kFileKinds{"surface", "image",   "labels", "tets", "scan",
                                                      "pose",    "quality", "field",  "mask", "other"};

template <class T>
T number_from(const std::string& text, int base) {
  T number = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), number, base);
  if (error != std::errc() || end != text.data() + text.size()) throw std::invalid_argument(text);
  return number;
}

json to_json(const PosedSurface& surface) {
  json out{{"tissue", surface.tissue},
           {"group", group_name(surface.group)},
           {"vertices", surface.vertices},
           {"triangles", surface.triangles},
           {"carried_by", surface.segment.empty() ? "tets" : "segment"}};
  if (surface.segment.empty()) return out;
  const Eigen::Quaterniond& q = surface.motion.q;
  const Eigen::Vector3d& t = surface.motion.t;
  out["segment"] = surface.segment;
  out["rotation"] = {q.w(), q.x(), q.y(), q.z()};
  out["translation_mm"] = {t.x(), t.y(), t.z()};
  return out;
}

PosedSurface surface_from(const json& from) {
  PosedSurface out;
  out.tissue = from.at("tissue");
  out.group = group_from_name(from.at("group").get<std::string>());
  out.vertices = from.at("vertices");
  out.triangles = from.at("triangles");
  if (from.at("carried_by") == "tets") return out;
  out.segment = from.at("segment");
  const auto q = from.at("rotation").get<std::array<double, 4>>();
  const auto t = from.at("translation_mm").get<std::array<double, 3>>();
  out.motion = {{q[0], q[1], q[2], q[3]}, {t[0], t[1], t[2]}};
  if (!(std::abs(out.motion.q.norm() - 1) < 1e-6)) throw std::invalid_argument("rotation");
  return out;
}

PosedFile file_from(const json& from) {
  const std::string kind = from.at("is");
  const auto found = std::find(kFileKinds.begin(), kFileKinds.end(), kind);
  if (found == kFileKinds.end()) throw std::invalid_argument(kind);
  PosedFile out{from.at("file"),  static_cast<PosedKind>(found - kFileKinds.begin()), from.value("of", ""),
                from.at("bytes"), number_from<std::uint64_t>(from.at("xxh64"), 16),   {}};
  const json labels = from.value("labels", json::object());
  for (const auto& [value, name] : labels.items())
    out.labels.emplace(number_from<std::int64_t>(value, 10), name);
  return out;
}

PosedManifest manifest_from(const json& from) {
  if (from.at("ecorche_posed") != 1) throw std::invalid_argument("version");
  PosedManifest out;
  out.model = from.at("model").at("name");
  out.identity = number_from<std::uint64_t>(from.at("model").at("identity"), 16);
  out.skinning = from.at("skinning");
  out.deformer = from.at("deformer");
  out.unfolded = from.at("unfolded");
  out.settled = from.value("settled", false);
  for (const json& surface : from.at("surfaces")) out.surfaces.push_back(surface_from(surface));
  for (const json& file : from.at("files")) out.files.push_back(file_from(file));
  return out;
}

}  // namespace

std::string_view kind_name(PosedKind kind) {
  return kFileKinds[static_cast<std::size_t>(kind)];
}

const PosedFile* PosedManifest::find(const std::string& file) const {
  const auto found =
      std::find_if(files.begin(), files.end(), [&](const PosedFile& one) { return one.file == file; });
  return found == files.end() ? nullptr : &*found;
}

std::string to_json(const PosedManifest& manifest) {
  json surfaces = json::array(), files = json::array();
  for (const PosedSurface& surface : manifest.surfaces) surfaces.push_back(to_json(surface));
  for (const PosedFile& file : manifest.files) {
    files.push_back({{"file", file.file},
                     {"is", kind_name(file.kind)},
                     {"bytes", file.bytes},
                     {"xxh64", text::hex(file.digest)}});
    if (!file.of.empty()) files.back()["of"] = file.of;
    for (const auto& [value, name] : file.labels) files.back()["labels"][std::to_string(value)] = name;
  }
  json out{{"ecorche_posed", 1},
           {"model", {{"name", manifest.model}, {"identity", text::hex(manifest.identity)}}},
           {"pose", kPoseFile},
           {"skinning", manifest.skinning},
           {"deformer", manifest.deformer},
           {"unfolded", manifest.unfolded},
           {"surfaces", std::move(surfaces)},
           {"files", std::move(files)}};
  if (manifest.settled) out["settled"] = true;
  return out.dump(2) + "\n";
}

std::optional<PosedManifest> read_manifest(const fs::path& folder) {
  const fs::path file = folder / kManifest;
  std::error_code ignored;
  if (!fs::exists(file, ignored)) return std::nullopt;
  const std::string text = files::read_text(file);
  try {
    return manifest_from(json::parse(text));
  } catch (const json::exception&) {  // told below
  } catch (const std::invalid_argument&) {
  } catch (const Error&) {  // an unknown group
  }
  throw Error(ErrorKind::data, file.string(), "is not a manifest that pose wrote",
              "pose again into a new folder");
}

bool is_as_written(const fs::path& folder, const PosedFile& file, const Context& context) {
  std::error_code error;
  const fs::path path = folder / file.file;
  return fs::file_size(path, error) == file.bytes && !error && io::file_digest(path, context) == file.digest;
}

}  // namespace ecorche::app
