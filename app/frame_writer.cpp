// SPDX-License-Identifier: Apache-2.0
#include "app/frame_writer.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include <ecorche/runtime/resample.hpp>
#include <ecorche/runtime/skin_caps.hpp>
#include "app/posed_manifest.hpp"
#include "app/posed_tets.hpp"
#include "app/tet_regions.hpp"
#include "core/files/atomic_file.hpp"
#include "io/image/image_file.hpp"

namespace ecorche::app {

namespace fs = std::filesystem;
using nlohmann::json;

json FrameWriter::write(const json& quality) {
  for (const std::uint32_t row : plan_.tissues) write_tissue(row);
  if (plan_.tets || plan_.field) write_tets();
  write_volumes();
  if (plan_.field) write_field();
  if (quality.contains("fem")) files::write_text(next("fem.json"), quality["fem"].dump(2) + "\n");
  files::write_text(next("quality.json"), quality.dump(2) + "\n");
  return written_;
}

fs::path FrameWriter::next(const std::string& name) {
  context_.check_stop();
  const std::size_t files = plan_.tissues.size() * settings_.formats.size() + 2 * plan_.volumes.size() +
                            (plan_.tets ? settings_.tet_formats.size() : 0) + (plan_.field ? 3 : 0) +
                            (settings_.by_fem() ? 2 : 1);
  context_.report(static_cast<double>(written_.size()) / static_cast<double>(files));
  written_.push_back((folder_ / name).string());
  return stage_ / name;
}

void FrameWriter::write_tissue(std::uint32_t row) {
  const std::vector<float>& posed = body_.tissues[row];
  io::NamedSurface named{model_.tissues[row].name, model_.tissues[row].group, {}};
  SurfaceMesh& mesh = named.mesh;
  mesh.V =
      Eigen::Map<const PointsF>(posed.data(), static_cast<Eigen::Index>(posed.size() / 3), 3).cast<double>();
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

std::vector<io::NamedSurface> FrameWriter::without_caps(const io::NamedSurface& whole,
                                                        std::uint32_t row) const {
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

void FrameWriter::write_tets() {
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

void FrameWriter::write_volumes() {
  for (const std::uint32_t row : plan_.volumes) {
    const ModelVolume& volume = model_.volumes[row];
    if (dicom_) {
      dicom_->add(volume, images_.of(volume));
    } else {
      io::write_image(next(volume.name + "." + settings_.volume_format), images_.of(volume));
    }
  }
  if (dicom_) dicom_->finish();
  for (const std::uint32_t row : plan_.volumes) write_mask(model_.volumes[row], "");
  if (!settings_.as_case) return;
  for (const ModelVolume& volume : model_.volumes) write_mask(volume, "volumes/");  // the case wrote them
}

void FrameWriter::write_mask(const ModelVolume& volume, const std::string& folder) {
  if (plan_.slices && dicom_)  // which no other format can place
    return dicom_->write_mask(volume.name + std::string(kMaskEnding), images_.mask(volume));
  io::write_image(next(folder + volume.name + std::string(kMaskEnding) + "." + settings_.field_format()),
                  images_.mask(volume));
}

void FrameWriter::write_field() {
  runtime::InverseMap map;
  runtime::locate(model_, body_.nodes, images_.grid_for(field_grid()), map, context_);
  const auto field = runtime::inverse_displacement(model_, body_.nodes, map);
  io::write_image(next("displacement." + settings_.field_format()), field.vectors);
  io::write_image(next("mask." + settings_.field_format()), field.mask);
}

ImageGrid FrameWriter::field_grid() const {
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

}  // namespace ecorche::app
