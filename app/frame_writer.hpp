// SPDX-License-Identifier: Apache-2.0
// The files of one posed body.
#pragma once

#include <filesystem>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "app/posed_dicom.hpp"
#include "app/posed_images.hpp"
#include "io/surface/surface_file.hpp"

namespace ecorche::app {

/// Writes them. Every file is checked for a stop request before it is begun.
class FrameWriter {
 public:
  /// Keeps all of them; `det_f` is of every tet. Files go into `stage`, which becomes `folder`.
  FrameWriter(const PoseSettings& settings, const Plan& plan, const runtime::VolumePoser& poser,
              const runtime::PosedBody& body, const std::vector<float>& det_f, std::filesystem::path stage,
              std::filesystem::path folder, const Context& context)
      : settings_(settings),
        plan_(plan),
        model_(poser.model()),
        body_(body),
        det_f_(det_f),
        stage_(std::move(stage)),
        folder_(std::move(folder)),
        context_(context),
        images_(settings, plan, poser, body, context) {}

  /// Volumes become DICOM.
  void use_dicom(const Program& program, io::DicomFacts facts) {
    dicom_.emplace(program, std::move(facts), [this](const std::string& name) { return next(name); });
  }

  /// What was written, by the names in `folder`.
  nlohmann::json write(const nlohmann::json& quality);

 private:
  // The path of the next file, named in the result.
  std::filesystem::path next(const std::string& name);
  void write_tissue(std::uint32_t row);
  // A skin that its scan's border cuts in two: the skin, and its caps.
  std::vector<io::NamedSurface> without_caps(const io::NamedSurface& whole, std::uint32_t row) const;
  // The posed tets, with the way of every node from rest: the forward displacement field.
  void write_tets();
  void write_volumes();
  void write_mask(const ModelVolume& volume, const std::string& folder);
  void write_field();
  // The first volume's lattice; without volumes one around the rest body of at most about 4 million cubic
  // voxels.
  ImageGrid field_grid() const;

  const PoseSettings& settings_;
  const Plan& plan_;
  const Model& model_;
  const runtime::PosedBody& body_;
  const std::vector<float>& det_f_;
  std::filesystem::path stage_, folder_;
  const Context& context_;
  PosedImages images_;
  nlohmann::json written_ = nlohmann::json::array();
  std::optional<PosedDicom> dicom_;
};

}  // namespace ecorche::app
