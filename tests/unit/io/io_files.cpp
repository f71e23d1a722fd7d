// SPDX-License-Identifier: Apache-2.0
// What the Python tests drive: our readers and writers as a little command.
#include <algorithm>
#include <cstdio>
#include <fstream>
#include <nlohmann/json.hpp>

#include <ecorche/values/error.hpp>
#include "io/image/dicom_writer.hpp"
#include "io/image/image_file.hpp"
#include "io/image/segmentation.hpp"
#include "io/surface/surface_file.hpp"

namespace ecorche::io {
namespace {

// `qform`, `sform`, `series=UID`, `phase=N`.
ImageChoice choice_of(const std::vector<std::string>& words) {
  ImageChoice choice;
  for (const std::string& word : words) {
    if (word == "qform" || word == "sform")
      choice.form = word == "qform" ? NiftiForm::qform : NiftiForm::sform;
    if (word.starts_with("series=")) choice.series = word.substr(7);
    if (word.starts_with("phase=")) choice.phase = std::stoi(word.substr(6));
  }
  return choice;
}

nlohmann::json described(const Image& image) {
  return {{"size", image.grid.size},        {"type", scalar_name(image.type)},
          {"components", image.components}, {"origin", image.grid.point(0, 0, 0)},
          {"i", image.grid.point(1, 0, 0)}, {"j", image.grid.point(0, 1, 0)},
          {"k", image.grid.point(0, 0, 1)}};
}

void append(std::ofstream& to, const Image& image) {
  to.write(reinterpret_cast<const char*>(image.bytes.data()),
           static_cast<std::streamsize>(image.bytes.size()));
}

// The grid and what was said as JSON on stdout, the voxels as they lie in memory into a file.
void describe(const char* path, const char* raw, const std::vector<std::string>& words) {
  nlohmann::json notes = nlohmann::json::array();
  const files::ReadOptions options{{}, [&](std::string_view line) { notes.push_back(line); }};
  const bool labels = std::find(words.begin(), words.end(), "labels") != words.end();
  const Image image = labels ? read_label_image(path, options, choice_of(words))
                             : read_image(path, options, choice_of(words));
  std::ofstream to(raw, std::ios::binary);
  append(to, image);
  nlohmann::json out = described(image);
  out["notes"] = notes;
  std::printf("%s\n", out.dump().c_str());
}

nlohmann::json described(const CodedName& code) {
  return {code.scheme, code.value, code.meaning};
}

// The same of a segmentation, one layer behind the other.
void segments(const char* path, const char* raw, const std::vector<std::string>& words) {
  nlohmann::json notes = nlohmann::json::array();
  const files::ReadOptions options{{}, [&](std::string_view line) { notes.push_back(line); }};
  const Segmentation read = read_segmentation(path, options, choice_of(words));
  std::ofstream to(raw, std::ios::binary);
  for (const Image& layer : read.layers) append(to, layer);
  nlohmann::json out = described(read.layers.front());
  out["notes"] = notes;
  out["layers"] = read.layers.size();
  for (const auto& [id, name] : read.names) out["names"][std::to_string(id)] = name;
  for (const auto& [id, codes] : read.codes)
    out["codes"][std::to_string(id)] = {codes.label, described(codes.category), described(codes.type),
                                        described(codes.side)};
  for (const LabelOverlap& one : read.overlaps)
    out["overlaps"].push_back({one.first, one.second, one.voxels});
  std::printf("%s\n", out.dump().c_str());
}

// An image as a DICOM series, or a segmentation as a DICOM SEG, as `pose` writes them: `source=DIR`, `keep`.
void write_dicom(const std::filesystem::path& from, const std::filesystem::path& to,
                 const std::vector<std::string>& words) {
  DicomFacts facts;
  facts.patient = "ECORCHE-1";
  facts.pose = "pose";
  facts.words = "arms_up";
  facts.derivation = "Posed";
  facts.program = "1.0";
  for (const std::string& word : words) {
    if (word.starts_with("source=")) facts.origin = read_dicom_origin(word.substr(7), {}, {});
    if (word == "keep") facts.keep_identity = true;
  }
  if (to.extension() == ".dcm") {
    write_dicom_segmentation(to, read_segmentation(from), "labels", facts);
  } else {
    const files::ReadOptions note{
        {}, [](std::string_view line) { std::printf("%s\n", std::string(line).c_str()); }};
    write_dicom_series(to, read_image(from), "ct", facts, note);
  }
}

// A row of cubes, six tets each around a diagonal, in three regions, in every format.
void tets(const std::filesystem::path& folder) {
  constexpr int cubes = 9;
  PointsF V(4 * (cubes + 1), 3);
  for (Eigen::Index i = 0; i < V.rows(); ++i)
    V.row(i) << 1.1F * static_cast<float>(i / 4), 1.3F * static_cast<float>(i % 4 / 2),
        0.7F * static_cast<float>(i % 2);
  Tets T(6 * cubes, 4);
  TetRegions regions{{}, {"soft", "femur_right", "9th_rib"}};
  constexpr int around[7]{4, 5, 1, 3, 2, 6, 4};  // the corners between 0 and 7, one edge after the other
  for (int t = 0; t < T.rows(); ++t) {
    const int base = 4 * (t / 6);
    T.row(t) << base, base + around[t % 6], base + around[t % 6 + 1], base + 7;
    if (tet_det(V.row(T(t, 0)), V.row(T(t, 1)), V.row(T(t, 2)), V.row(T(t, 3))) < 0)
      std::swap(T(t, 1), T(t, 2));
    regions.label.push_back(static_cast<std::uint16_t>(t % 7 == 0 ? 2 : t / 40));
  }
  for (const char* name : {"a.vtu", "a.msh", "a.ele", "a.inp", "a.mcnp.inp"})
    write_tets(folder / name, V, T, {}, {{"label", 1, {regions.label.begin(), regions.label.end()}}},
               regions);
  nlohmann::json out{
      {"points", nlohmann::json::array()}, {"tets", nlohmann::json::array()}, {"labels", regions.label}};
  for (Eigen::Index i = 0; i < V.rows(); ++i) out["points"].push_back({V(i, 0), V(i, 1), V(i, 2)});
  for (Eigen::Index t = 0; t < T.rows(); ++t) out["tets"].push_back({T(t, 0), T(t, 1), T(t, 2), T(t, 3)});
  std::printf("%s\n", out.dump().c_str());
}

int run(int argc, char** argv) {
  const std::string what = argc > 3 ? argv[1] : "";
  if (what == "describe") {
    describe(argv[2], argv[3], {argv + 4, argv + argc});
  } else if (what == "segments") {
    segments(argv[2], argv[3], {argv + 4, argv + argc});
  } else if (what == "write_dicom") {
    write_dicom(argv[2], argv[3], {argv + 4, argv + argc});
  } else if (what == "copy") {
    write_image(argv[3], read_image(argv[2]));
  } else if (what == "tets") {
    tets(argv[2]);
  } else {
    std::fprintf(stderr,
                 "usage: io_files describe IMAGE RAW | segments IMAGE RAW | write_dicom IMAGE TO | copy "
                 "IMAGE IMAGE | tets FOLDER .\n");
    return 64;
  }
  return 0;
}

}  // namespace
}  // namespace ecorche::io

int main(int argc, char** argv) {
  try {
    return ecorche::io::run(argc, argv);
  } catch (const ecorche::Error& error) {
    std::fprintf(stderr, "error: %s\n", error.what());
    return ecorche::exit_code(error.kind());
  }
}
