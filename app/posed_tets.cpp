// SPDX-License-Identifier: Apache-2.0
#include "app/posed_tets.hpp"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <numeric>
#include <string>

#include <ecorche/values/error.hpp>
#include "core/files/look.hpp"
#include "io/surface/surface_file.hpp"

namespace ecorche::app {
namespace {

namespace fs = std::filesystem;

const io::GridArray* scalars(const std::vector<io::GridArray>& arrays, std::string_view name) {
  const auto found = std::find_if(arrays.begin(), arrays.end(), [&](const io::GridArray& array) {
    return array.name == name && array.components == 1;
  });
  return found == arrays.end() ? nullptr : &*found;
}

// A segment stands for all of its bones. Tets in another order than pose writes them, or what is no segment,
// tell nothing.
runtime::RigidCopies copies_of(const std::vector<io::GridArray>& of_tets, const PosedTets& body) {
  constexpr float most = 65535;
  const io::GridArray *label = scalars(of_tets, "label"), *segment = scalars(of_tets, kTetSegment);
  if (label == nullptr || segment == nullptr) return {};
  const std::vector<float>& of = segment->values;
  const auto is_number = [](float value) {
    return value >= 0 && value <= most && value == std::floor(value);
  };
  if (!std::all_of(of.begin(), of.end(), is_number)) return {};
  const auto bones = std::find(label->values.begin(), label->values.end(), 0.0F) - label->values.begin();
  const auto rigid = std::find(of.begin(), of.end(), 0.0F) - of.begin();
  const bool in_order =
      bones <= rigid && std::all_of(of.begin() + rigid, of.end(), [](float s) { return s == 0; });
  if (!in_order || rigid == bones) return {};
  std::vector<std::uint16_t> own(of.size(), TetMesh::soft), contested;
  std::transform(of.begin(), of.begin() + bones, own.begin(),
                 [](float s) { return static_cast<std::uint16_t>(s); });
  std::transform(of.begin() + bones, of.begin() + rigid, std::back_inserter(contested),
                 [](float s) { return static_cast<std::uint16_t>(s); });
  std::vector<std::int32_t> segments(static_cast<std::size_t>(*std::max_element(of.begin(), of.end())));
  std::iota(segments.begin(), segments.end(), 0);
  return {body.tets, body.rest, own, contested, segments};
}

}  // namespace

std::vector<float> segment_of_tets(const Model& model) {
  std::vector<float> out(model.tet_label.size());
  const auto segment = [&](std::uint16_t label) {
    return static_cast<float>(model.bone_segment[label - 1U] + 1);
  };
  std::size_t t = 0;
  for (; t < out.size() && model.tet_label[t] != TetMesh::soft; ++t) out[t] = segment(model.tet_label[t]);
  for (const std::uint16_t label : model.contested) out[t++] = segment(label);
  return out;
}

PosedTets read_posed_tets(const fs::path& file) {
  if (!files::is_there(file))
    throw Error(ErrorKind::missing_input, file.string(), "is not there, and the way back is in it",
                "give a folder that pose wrote with its tets: --tets, or all of it");
  io::TetFile read = io::read_tets(file);
  const auto moved = std::find_if(
      read.point_data.begin(), read.point_data.end(),
      [](const io::GridArray& array) { return array.name == "displacement" && array.components == 3; });
  if (moved == read.point_data.end()) {
    throw Error(ErrorKind::data, file.string(),
                "its nodes carry no displacement, so nothing says where they came from",
                "give the body.vtu that ecorche pose wrote");
  }
  PosedTets out;
  out.rest = read.V - Eigen::Map<const PointsF>(moved->values.data(), read.V.rows(), 3);
  // Rounded, a sliver may lose its volume; many that have none are not the rest of this body.
  Eigen::Index flat = 0;
  for (Eigen::Index t = 0; t < read.T.rows(); ++t) {
    const auto corner = [&](int c) { return out.rest.row(read.T(t, c)); };
    flat += tet_det(corner(0), corner(1), corner(2), corner(3)) > 0 ? 0 : 1;
  }
  if (1000 * flat > read.T.rows()) {
    throw Error(ErrorKind::data, file.string(),
                std::to_string(flat) + " of its " + std::to_string(read.T.rows()) +
                    " tets have no volume at rest: the displacement is not theirs",
                "give the body.vtu that ecorche pose wrote");
  }
  out.posed = std::move(read.V);
  out.tets = std::move(read.T);
  out.copies = copies_of(read.cell_data, out);
  return out;
}

}  // namespace ecorche::app
