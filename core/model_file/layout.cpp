// SPDX-License-Identifier: Apache-2.0
#include "core/model_file/layout.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>

#include "core/model_file/figures.hpp"
#include "core/model_file/packed_field.hpp"

namespace ecorche::model_file {
namespace {

std::uint64_t count(Eigen::Index rows) {
  return static_cast<std::uint64_t>(rows);
}

// All elements of a row-major matrix.
template <class M>
std::span<const typename M::Scalar> elements(const M& matrix) {
  return {matrix.data(), static_cast<std::size_t>(matrix.size())};
}

// A column of a table: `member(row)` of every row.
template <class Rows, class F>
auto column(const Rows& rows, F&& member) {
  std::vector<std::decay_t<decltype(member(rows.front()))>> values;
  values.reserve(rows.size());
  for (const auto& row : rows) values.push_back(member(row));
  return values;
}

void add_mesh(Layout& out, const Model& model) {
  out.view("/VTKHDF/Points", elements(model.nodes), {count(model.nodes.rows()), 3});
  out.view("/VTKHDF/Connectivity", elements(model.tets), {count(model.tets.size())});
  out.view<std::uint16_t>("/VTKHDF/CellData/label", model.tet_label, {model.tet_label.size()});
  out.texts("/ecorche/labels/bone", model.bone_names);
  out.copy("/ecorche/labels/segment", model.bone_segment);
  out.view<std::uint16_t>("/ecorche/labels/contested", model.contested, {model.contested.size()});
}

void add_materials(Layout& out, const Materials& materials) {
  if (materials.empty()) return;
  const std::string at = "/ecorche/materials/";
  out.copy(at + "tissue", materials.tissue);
  out.copy(at + "young_kpa", materials.young_kpa);
  out.view<std::uint16_t>(at + "tet", materials.of_tet, {materials.of_tet.size()});
}

void add_segments(Layout& out, const std::vector<Segment>& segments) {
  const std::string at = "/ecorche/skeleton/";
  const auto code = [](auto value) { return static_cast<std::uint8_t>(value); };
  out.texts(at + "segment", column(segments, [](const Segment& s) { return s.name; }));
  out.copy(at + "parent", column(segments, [](const Segment& s) { return std::int32_t{s.parent}; }));
  out.texts(at + "joint", column(segments, [](const Segment& s) { return s.joint.name; }));
  out.copy(at + "kind", column(segments, [&](const Segment& s) { return code(s.joint.kind); }));
  out.copy(at + "rule", column(segments, [&](const Segment& s) { return code(s.joint.rule); }));
  out.texts(at + "center_bone", column(segments, [](const Segment& s) { return s.joint.center_bone; }));
  out.texts(at + "facing_bone", column(segments, [](const Segment& s) { return s.joint.facing_bone; }));
  out.texts(at + "limits_source", column(segments, [](const Segment& s) { return s.joint.limits_source; }));
  std::vector<double> centers, axes;
  for (const Segment& s : segments) {
    for (int r = 0; r < 3; ++r) {
      centers.push_back(s.joint.center[r]);
      for (int c = 0; c < 3; ++c) axes.push_back(s.joint.axes(r, c));
    }
  }
  out.copy(at + "center", centers, {segments.size(), 3});
  out.copy(at + "axes", axes, {segments.size(), 3, 3});
}

// Lists of varying length hang off the segments as tables with a column that says whose row it is.
void add_angles(Layout& out, const std::vector<Segment>& segments) {
  std::vector<std::int32_t> joint;
  std::vector<AngleAxis> angles;
  for (std::size_t s = 0; s < segments.size(); ++s) {
    for (const AngleAxis& angle : segments[s].joint.sequence) {
      joint.push_back(static_cast<std::int32_t>(s));
      angles.push_back(angle);
    }
  }
  const std::string at = "/ecorche/skeleton/angle_";
  out.copy(at + "joint", joint);
  out.texts(at + "name", column(angles, [](const AngleAxis& a) { return a.name; }));
  out.copy(at + "axis", column(angles, [](const AngleAxis& a) { return std::int32_t{a.axis}; }));
  out.copy(at + "sign", column(angles, [](const AngleAxis& a) { return a.sign; }));
  out.copy(at + "rest", column(angles, [](const AngleAxis& a) { return a.rest; }));
  out.copy(at + "min", column(angles, [](const AngleAxis& a) { return a.min; }));
  out.copy(at + "max", column(angles, [](const AngleAxis& a) { return a.max; }));
}

void add_couplings(Layout& out, const std::vector<Segment>& segments) {
  std::vector<std::int32_t> joint;
  std::vector<Coupling> couplings;
  for (std::size_t s = 0; s < segments.size(); ++s) {
    for (const Coupling& coupling : segments[s].joint.coupled) {
      joint.push_back(static_cast<std::int32_t>(s));
      couplings.push_back(coupling);
    }
  }
  const std::string at = "/ecorche/skeleton/coupling_";
  out.copy(at + "joint", joint);
  out.texts(at + "leader", column(couplings, [](const Coupling& c) { return c.joint; }));
  out.texts(at + "angle", column(couplings, [](const Coupling& c) { return c.angle; }));
  out.texts(at + "drives", column(couplings, [](const Coupling& c) { return c.drives; }));
  out.copy(at + "ratio", column(couplings, [](const Coupling& c) { return c.ratio; }));
}

void add_rig(Layout& out, const Rig& rig) {
  const std::vector<Segment>& segments = rig.skeleton.segments;
  out.texts("/ecorche/skeleton/name", {rig.skeleton.name});
  add_segments(out, segments);
  add_angles(out, segments);
  add_couplings(out, segments);
  std::vector<std::int32_t> segment;
  std::vector<std::string> alias;
  for (std::size_t s = 0; s < segments.size(); ++s) {
    segment.insert(segment.end(), segments[s].aliases.size(), static_cast<std::int32_t>(s));
    alias.insert(alias.end(), segments[s].aliases.begin(), segments[s].aliases.end());
  }
  out.copy("/ecorche/skeleton/alias_segment", segment);
  out.texts("/ecorche/skeleton/alias_name", alias);
  const std::string at = "/ecorche/skeleton/fit_";
  out.texts(at + "joint", column(rig.fits, [](const JointFit& f) { return f.joint; }));
  out.copy(at + "rule",
           column(rig.fits, [](const JointFit& f) { return static_cast<std::uint8_t>(f.rule); }));
  out.copy(at + "radius_mm", column(rig.fits, [](const JointFit& f) { return f.radius_mm; }));
  out.copy(at + "residual_mm", column(rig.fits, [](const JointFit& f) { return f.residual_mm; }));
  out.copy(at + "inlier_share", column(rig.fits, [](const JointFit& f) { return f.inlier_share; }));
  out.copy(at + "confidence", column(rig.fits, [](const JointFit& f) { return f.confidence; }));
  out.copy(at + "points", column(rig.fits, [](const JointFit& f) { return f.points; }));
}

void add_skinning(Layout& out, const Model& model) {
  const Weights& weights = model.weights;
  out.view<std::uint64_t>("/ecorche/weights/offsets", weights.offsets, {weights.offsets.size()});
  out.view<std::uint16_t>("/ecorche/weights/segment", weights.segment, {weights.segment.size()});
  out.view<float>("/ecorche/weights/weight", weights.weight, {weights.weight.size()});
  out.view("/ecorche/cor/centre", elements(model.cor.centre), {count(model.cor.centre.rows()), 3});
  out.view<std::uint8_t>("/ecorche/cor/has_centre", model.cor.has_centre, {model.cor.has_centre.size()});
  out.scalar("/ecorche/cor/sigma", model.cor.sigma);
}

void add_tissue(Layout& out, const Tissue& tissue, std::size_t index) {
  const std::string at = "/ecorche/tissues/" + tissue.name + "/";
  out.scalar(at + "index", static_cast<std::int32_t>(index));
  out.texts(at + "group", {std::string(group_name(tissue.group))});
  out.scalar(at + "segment", tissue.segment);
  out.view(at + "points", elements(tissue.V), {count(tissue.V.rows()), 3});
  out.view(at + "triangles", elements(tissue.F), {count(tissue.F.rows()), 3});
  out.view<std::int32_t>(at + "tet", tissue.tet, {tissue.tet.size()});
  out.view(at + "barycentric", elements(tissue.barycentric), {count(tissue.barycentric.rows()), 4});
}

void add_grid(Layout& out, const std::string& at, std::size_t index, const ImageGrid& grid) {
  out.scalar(at + "index", static_cast<std::int32_t>(index));
  out.copy(at + "size", std::vector<std::int32_t>(grid.size.begin(), grid.size.end()));
  out.copy(at + "origin", std::vector<double>(grid.origin.begin(), grid.origin.end()));
  out.copy(at + "spacing", std::vector<double>(grid.spacing.begin(), grid.spacing.end()));
  out.copy(at + "direction", std::vector<double>(grid.direction.begin(), grid.direction.end()), {3, 3});
}

void add_volume(Layout& out, const ModelVolume& volume, std::size_t index) {
  const std::string at = "/ecorche/volumes/" + volume.name + "/";
  const ImageGrid& grid = volume.image.grid;
  const auto along = [&](std::size_t axis) { return static_cast<std::uint64_t>(grid.size[axis]); };
  std::vector<std::uint64_t> shape{along(2), along(1), along(0)};  // slowest first
  if (volume.image.components > 1) shape.push_back(static_cast<std::uint64_t>(volume.image.components));
  std::vector<std::int64_t> ids;
  std::vector<std::string> names;
  for (const auto& [id, name] : volume.table) {
    ids.push_back(id);
    names.push_back(name);
  }
  add_grid(out, at, index, grid);
  out.scalar(at + "components", std::int32_t{volume.image.components});
  out.scalar(at + "background", volume.background);
  out.scalar(at + "labels", static_cast<std::uint8_t>(volume.labels));
  out.copy(at + "table_id", ids);
  out.texts(at + "table_name", names);
  out.raw(at + "voxels", element_type(volume.image.type), volume.image.bytes, shape);
}

void add_spheres(Layout& out, const VolumetricSkeleton& skeleton, std::size_t index) {
  const std::string at = "/ecorche/spheres/" + skeleton.name + "/";
  const auto rows = std::uint64_t{skeleton.size()};
  add_grid(out, at, index, skeleton.grid);
  out.scalar(at + "metric", static_cast<std::uint8_t>(skeleton.metric));
  out.scalar(at + "thinness", skeleton.thinness);
  const auto* first = reinterpret_cast<const std::uint16_t*>(skeleton.voxel.data());
  out.view<std::uint16_t>(at + "voxel", {first, 3 * skeleton.size()}, {rows, 3});
  out.view<std::uint32_t>(at + "distance", skeleton.distance, {rows});
  out.view<float>(at + "deficit", skeleton.deficit, {rows});
  out.view<std::int32_t>(at + "parent", skeleton.parent, {rows});
  out.view<std::int32_t>(at + "segment", skeleton.segment, {rows});
}

void add_field(Layout& out, const std::string& at, const std::vector<std::int16_t>& field, std::size_t modes,
               std::size_t rows) {
  const PackedField packed = pack(field, modes, rows);
  out.copy(at + "shift", packed.shift, {modes, PackedField::blocks(rows)});
  out.copy(at + "byte", packed.byte);
  out.copy(at + "word", packed.word);
}

void add_correction(Layout& out, const JointCorrection& correction, const std::string& joint,
                    std::size_t index) {
  const std::string at = "/ecorche/packed_correction/" + joint + "/";
  const auto modes = std::uint64_t{correction.scale.size()}, rows = std::uint64_t{correction.node.size()};
  out.scalar(at + "index", static_cast<std::int32_t>(index));
  out.view(at + "turn", elements(correction.turn), {count(correction.turn.rows()), 3});
  out.view(at + "mix", elements(correction.mix), {count(correction.mix.rows()), modes});
  out.view<float>(at + "scale", correction.scale, {modes});
  out.view<std::uint32_t>(at + "node", correction.node, {rows});
  add_field(out, at, correction.field, modes, rows);
}

void add_pose_correction(Layout& out, const PoseCorrection& correction, std::size_t index) {
  const std::string at = "/ecorche/packed_pose_correction/place_" + std::to_string(index + 1) + "/";
  const auto rows = std::uint64_t{correction.node.size()};
  out.scalar(at + "index", static_cast<std::int32_t>(index));
  out.texts(at + "pose", {correction.pose});
  out.view<std::int32_t>(at + "joint", correction.joint, {std::uint64_t{correction.joint.size()}});
  out.view(at + "turn", elements(correction.turn), {count(correction.turn.rows()), 3});
  out.scalar(at + "reach", correction.reach);
  out.scalar(at + "scale", correction.scale);
  out.view<std::uint32_t>(at + "node", correction.node, {rows});
  add_field(out, at, correction.field, 1, rows);
}

// Ranges of a model before 1.4 do not.
bool knows_contact(const std::vector<SafeRange>& ranges) {
  return !ranges.empty() && !std::isnan(ranges[0].skinned.contact);
}

void add_safe_ranges(Layout& out, const std::vector<SafeRange>& ranges) {
  if (ranges.empty()) return;
  const std::string at = "/ecorche/safe_range/";
  out.copy(at + "joint", column(ranges, [](const SafeRange& r) { return r.joint; }));
  out.copy(at + "angle", column(ranges, [](const SafeRange& r) { return r.angle; }));
  out.copy(at + "way", column(ranges, [](const SafeRange& r) { return r.way; }));
  out.copy(at + "looked", column(ranges, [](const SafeRange& r) { return r.looked; }));
  out.copy(at + "skinned_inverted", column(ranges, [](const SafeRange& r) { return r.skinned.inverted; }));
  out.copy(at + "skinned_volume", column(ranges, [](const SafeRange& r) { return r.skinned.volume; }));
  out.copy(at + "corrected_inverted",
           column(ranges, [](const SafeRange& r) { return r.corrected.inverted; }));
  out.copy(at + "corrected_volume", column(ranges, [](const SafeRange& r) { return r.corrected.volume; }));
  out.copy(at + "bones", column(ranges, [](const SafeRange& r) { return r.bones; }));
  if (!knows_contact(ranges)) return;
  out.copy(at + "skinned_contact", column(ranges, [](const SafeRange& r) { return r.skinned.contact; }));
  out.copy(at + "corrected_contact", column(ranges, [](const SafeRange& r) { return r.corrected.contact; }));
}

void add_provenance(Layout& out, const std::map<std::string, std::string>& provenance) {
  std::vector<std::string> keys, values;
  for (const auto& [key, value] : provenance) {
    keys.push_back(key);
    values.push_back(value);
  }
  out.texts("/ecorche/provenance/key", keys);
  out.texts("/ecorche/provenance/value", values);
}

}  // namespace

void Layout::texts(std::string path, const std::vector<std::string>& values) {
  std::size_t width = 1;
  for (const std::string& value : values) width = std::max(width, value.size());
  std::vector<std::byte> bytes(width * values.size());
  for (std::size_t i = 0; i < values.size(); ++i) {
    std::memcpy(bytes.data() + i * width, values[i].data(), values[i].size());
  }
  kept_.push_back(std::move(bytes));
  entries_.push_back({std::move(path), ElementType::text, {values.size()}, width, kept_.back()});
}

void Layout::raw(std::string path, ElementType type, std::span<const std::byte> bytes,
                 std::vector<std::uint64_t> shape) {
  entries_.push_back({std::move(path), type, std::move(shape), element_bytes(type), bytes});
}

Layout lay_out(const Model& model) {
  Layout out;
  out.texts("/ecorche/name", {model.name});
  add_rig(out, model.rig);
  add_mesh(out, model);
  add_skinning(out, model);
  for (std::size_t i = 0; i < model.tissues.size(); ++i) add_tissue(out, model.tissues[i], i);
  add_materials(out, model.materials);
  for (std::size_t i = 0; i < model.volumes.size(); ++i) add_volume(out, model.volumes[i], i);
  for (std::size_t i = 0; i < model.spheres.size(); ++i) add_spheres(out, model.spheres[i], i);
  for (std::size_t i = 0; i < model.corrections.size(); ++i) {
    const JointCorrection& correction = model.corrections[i];
    const auto joint = static_cast<std::size_t>(correction.joint);
    add_correction(out, correction, model.rig.skeleton.segments[joint].joint.name, i);
  }
  for (std::size_t i = 0; i < model.pose_corrections.size(); ++i)
    add_pose_correction(out, model.pose_corrections[i], i);
  add_safe_ranges(out, model.safe_ranges);
  for_each_figure(model.certificate, [&](std::string_view name, const auto& value) {
    out.scalar("/ecorche/quality/" + std::string(name), value);
  });
  add_provenance(out, model.provenance);
  return out;
}

std::int32_t minor_of(const Model& model) {
  if (!model.corrections.empty() || !model.pose_corrections.empty()) return 6;
  return !model.materials.empty() || knows_contact(model.safe_ranges) ? 4 : 3;
}

Layout lay_out_vtk(const Model& model) {
  Layout out;
  const auto tets = static_cast<std::int64_t>(model.tet_count());
  out.scalar("/VTKHDF/NumberOfPoints", static_cast<std::int64_t>(model.node_count()));
  out.scalar("/VTKHDF/NumberOfCells", tets);
  out.scalar("/VTKHDF/NumberOfConnectivityIds", 4 * tets);
  std::vector<std::int32_t> offsets;
  offsets.reserve(model.tet_count() + 1);
  for (std::int64_t t = 0; t <= tets; ++t) offsets.push_back(static_cast<std::int32_t>(4 * t));
  out.copy("/VTKHDF/Offsets", offsets);
  out.copy("/VTKHDF/Types", std::vector<std::uint8_t>(model.tet_count(), kVtkTetra));
  std::vector<std::uint16_t> segment;
  std::vector<float> weight;
  segment.reserve(model.node_count());
  weight.reserve(model.node_count());
  const Weights& weights = model.weights;
  for (std::size_t n = 0; n < model.node_count(); ++n) {
    const auto first = weights.weight.begin() + static_cast<std::ptrdiff_t>(weights.offsets[n]);
    const auto last = weights.weight.begin() + static_cast<std::ptrdiff_t>(weights.offsets[n + 1]);
    const auto heaviest = std::max_element(first, last);
    segment.push_back(weights.segment[static_cast<std::size_t>(heaviest - weights.weight.begin())]);
    weight.push_back(*heaviest);
  }
  out.copy("/VTKHDF/PointData/dominant_segment", segment);
  out.copy("/VTKHDF/PointData/dominant_weight", weight);
  return out;
}

}  // namespace ecorche::model_file
