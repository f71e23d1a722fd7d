// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <functional>

#include <ecorche/model_file/model_file.hpp>
#include "core/model_file/correction_reader.hpp"
#include "core/model_file/figures.hpp"
#include "core/model_file/guard.hpp"
#include "core/model_file/in_turn.hpp"
#include "core/model_file/invariants.hpp"
#include "core/model_file/layout.hpp"
#include "core/model_file/source.hpp"

namespace ecorche::model_file {
namespace {

// An enumeration stored as its number; `last` is its largest.
template <class E>
std::vector<E> read_codes(const Source& source, const std::string& path, std::uint64_t rows, E last) {
  std::vector<E> values;
  for (const std::uint8_t code : source.vector<std::uint8_t>(path, {rows})) {
    if (code > static_cast<std::uint8_t>(last)) source.refuse(path, std::to_string(code) + " has no meaning");
    values.push_back(static_cast<E>(code));
  }
  return values;
}

// The rows of a table that hangs off the segments: which segment each belongs to, in order.
std::vector<std::size_t> read_owners(const Source& source, const std::string& path, std::size_t segments) {
  std::vector<std::size_t> owners;
  for (const std::int32_t owner : source.vector<std::int32_t>(path)) {
    const auto row = static_cast<std::size_t>(owner);
    if (owner < 0 || row >= segments) source.refuse(path, std::to_string(owner) + " is not a segment");
    if (!owners.empty() && row < owners.back()) source.refuse(path, "is not sorted");
    owners.push_back(row);
  }
  return owners;
}

std::vector<Segment> read_segments(const Source& source) {
  const std::string at = "/ecorche/skeleton/";
  const std::vector<std::string> names = source.texts(at + "segment");
  const std::uint64_t n = names.size();
  const auto parents = source.vector<std::int32_t>(at + "parent", {n});
  const auto joints = source.texts(at + "joint", {n});
  const auto kinds = read_codes(source, at + "kind", n, JointKind::free);
  const auto rules = read_codes(source, at + "rule", n, CenterRule::facing);
  const auto center_bones = source.texts(at + "center_bone", {n});
  const auto facing_bones = source.texts(at + "facing_bone", {n});
  const auto sources = source.texts(at + "limits_source", {n});
  const auto centers = source.vector<double>(at + "center", {n, 3});
  const auto axes = source.vector<double>(at + "axes", {n, 3, 3});
  std::vector<Segment> segments(n);
  for (std::size_t s = 0; s < n; ++s) {
    segments[s].name = names[s];
    segments[s].parent = parents[s];
    Joint& joint = segments[s].joint;
    joint.name = joints[s];
    joint.kind = kinds[s];
    joint.rule = rules[s];
    joint.center = Eigen::Map<const Eigen::Vector3d>(&centers[3 * s]);
    joint.center_bone = center_bones[s];
    joint.facing_bone = facing_bones[s];
    joint.axes = Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(&axes[9 * s]);
    joint.limits_source = sources[s];
  }
  return segments;
}

void read_angles(const Source& source, std::vector<Segment>& segments) {
  const std::string at = "/ecorche/skeleton/angle_";
  const auto owners = read_owners(source, at + "joint", segments.size());
  const std::uint64_t n = owners.size();
  const auto names = source.texts(at + "name", {n});
  const auto axes = source.vector<std::int32_t>(at + "axis", {n});
  const auto signs = source.vector<double>(at + "sign", {n});
  const auto rests = source.vector<double>(at + "rest", {n});
  const auto mins = source.vector<double>(at + "min", {n});
  const auto maxs = source.vector<double>(at + "max", {n});
  for (std::size_t i = 0; i < n; ++i) {
    segments[owners[i]].joint.sequence.push_back({names[i], axes[i], signs[i], rests[i], mins[i], maxs[i]});
  }
}

void read_couplings(const Source& source, std::vector<Segment>& segments) {
  const std::string at = "/ecorche/skeleton/coupling_";
  const auto owners = read_owners(source, at + "joint", segments.size());
  const std::uint64_t n = owners.size();
  const auto leaders = source.texts(at + "leader", {n});
  const auto angles = source.texts(at + "angle", {n});
  const auto drives = source.texts(at + "drives", {n});
  const auto ratios = source.vector<double>(at + "ratio", {n});
  for (std::size_t i = 0; i < n; ++i) {
    segments[owners[i]].joint.coupled.push_back({leaders[i], angles[i], drives[i], ratios[i]});
  }
}

std::vector<JointFit> read_fits(const Source& source) {
  const std::string at = "/ecorche/skeleton/fit_";
  const auto joints = source.texts(at + "joint");
  const std::uint64_t n = joints.size();
  const auto rules = read_codes(source, at + "rule", n, CenterRule::facing);
  const auto radii = source.vector<double>(at + "radius_mm", {n});
  const auto residuals = source.vector<double>(at + "residual_mm", {n});
  const auto shares = source.vector<double>(at + "inlier_share", {n});
  const auto points = source.vector<std::int32_t>(at + "points", {n});
  // Older models say nothing of it: the inlier share stands for it.
  const bool says = source.catalogue().datasets.contains(at + "confidence");
  const auto confidences = says ? source.vector<double>(at + "confidence", {n}) : shares;
  std::vector<JointFit> fits;
  for (std::size_t i = 0; i < n; ++i) {
    fits.push_back({joints[i], rules[i], radii[i], residuals[i], shares[i], points[i], confidences[i]});
  }
  return fits;
}

Rig read_rig(const Source& source) {
  Rig rig;
  rig.skeleton.name = source.text("/ecorche/skeleton/name");
  std::vector<Segment>& segments = rig.skeleton.segments;
  segments = read_segments(source);
  read_angles(source, segments);
  read_couplings(source, segments);
  const auto owners = read_owners(source, "/ecorche/skeleton/alias_segment", segments.size());
  const auto aliases = source.texts("/ecorche/skeleton/alias_name", {owners.size()});
  for (std::size_t i = 0; i < owners.size(); ++i) segments[owners[i]].aliases.push_back(aliases[i]);
  rig.fits = read_fits(source);
  return rig;
}

// What only VTKHDF readers use must say the same as what ecorche reads.
void check_vtk(const Source& source, const Model& model) {
  const auto same = [&](const std::string& path, std::uint64_t count) {
    const auto stored = source.scalar<std::int64_t>(path);
    if (stored < 0 || static_cast<std::uint64_t>(stored) != count) {
      source.refuse(path, "is " + std::to_string(stored) + ", not " + std::to_string(count));
    }
  };
  const std::uint64_t tets = model.tet_count();
  same("/VTKHDF/NumberOfPoints", model.node_count());
  same("/VTKHDF/NumberOfCells", tets);
  same("/VTKHDF/NumberOfConnectivityIds", 4 * tets);
  // Looked at while they pass; a digest that differs is told first.
  const auto offsets_good = [&] {
    std::size_t bad = tets + 1;
    source.scan<std::int32_t>("/VTKHDF/Offsets", {tets + 1}, [&](std::size_t row, auto offsets) {
      for (std::size_t i = 0; i < offsets.size(); ++i)
        if (offsets[i] != static_cast<std::int64_t>(4 * (row + i))) bad = std::min(bad, row + i);
    });
    if (bad <= tets)
      source.refuse("/VTKHDF/Offsets", "row " + std::to_string(bad) + " is not " + std::to_string(4 * bad));
  };
  const auto types_good = [&] {
    bool good = true;
    source.scan<std::uint8_t>("/VTKHDF/Types", {tets}, [&](std::size_t, auto types) {
      good &= std::all_of(types.begin(), types.end(), [](std::uint8_t type) { return type == kVtkTetra; });
    });
    if (!good) source.refuse("/VTKHDF/Types", "holds a cell that is not a tetrahedron");
  };
  run_as_in_turn({offsets_good, types_good});
}

Tissue read_tissue(const Source& source, const std::string& name) {
  const std::string at = "/ecorche/tissues/" + name + "/";
  Tissue tissue;
  tissue.name = name;
  const std::string group = source.text(at + "group");
  try {
    tissue.group = group_from_name(group);
  } catch (const Error&) {
    source.refuse(at + "group", "'" + group + "' is not a group");
  }
  tissue.segment = source.scalar<std::int32_t>(at + "segment");
  tissue.V = source.matrix<PointsF>(at + "points");
  tissue.F = source.matrix<Triangles>(at + "triangles");
  tissue.tet = source.vector<std::int32_t>(at + "tet");
  tissue.barycentric = source.matrix<decltype(tissue.barycentric)>(at + "barycentric");
  return tissue;
}

ScalarType scalar_type(const Source& source, const std::string& path, ElementType stored) {
  for (const ScalarType type : {ScalarType::u8, ScalarType::i8, ScalarType::u16, ScalarType::i16,
                                ScalarType::u32, ScalarType::i32, ScalarType::f32, ScalarType::f64}) {
    if (element_type(type) == stored) return type;
  }
  source.refuse(path, std::string(element_name(stored)) + " is not a type of voxels");
}

template <std::size_t N, class T>
std::array<T, N> read_array(const Source& source, const std::string& path, const Source::Shape& shape) {
  std::array<T, N> values{};
  const std::vector<T> stored = source.vector<T>(path, shape);
  std::copy(stored.begin(), stored.end(), values.begin());
  return values;
}

ImageGrid read_grid(const Source& source, const std::string& at) {
  ImageGrid grid;
  grid.size = read_array<3, std::int32_t>(source, at + "size", {3});
  grid.origin = read_array<3, double>(source, at + "origin", {3});
  grid.spacing = read_array<3, double>(source, at + "spacing", {3});
  grid.direction = read_array<9, double>(source, at + "direction", {3, 3});
  return grid;
}

ModelVolume read_volume(const Source& source, const std::string& name) {
  const std::string at = "/ecorche/volumes/" + name + "/";
  ModelVolume volume;
  volume.name = name;
  const ImageGrid& grid = volume.image.grid = read_grid(source, at);
  volume.image.components = source.scalar<std::int32_t>(at + "components");
  volume.background = source.scalar<double>(at + "background");
  const auto labels = source.scalar<std::uint8_t>(at + "labels");
  if (labels > 1) source.refuse(at + "labels", "is neither 0 nor 1");
  volume.labels = labels == 1;
  const auto ids = source.vector<std::int64_t>(at + "table_id");
  const auto names = source.texts(at + "table_name", {ids.size()});
  for (std::size_t i = 0; i < ids.size(); ++i) {
    if (!volume.table.emplace(ids[i], names[i]).second) {
      source.refuse(at + "table_id", std::to_string(ids[i]) + " stands twice");
    }
  }
  const std::string voxels = at + "voxels";
  Source::Shape shape;
  for (const std::size_t axis : {2, 1, 0}) shape.push_back(static_cast<std::uint64_t>(grid.size[axis]));
  if (volume.image.components > 1) shape.push_back(static_cast<std::uint64_t>(volume.image.components));
  volume.image.type = scalar_type(source, voxels, source.find(voxels).type);
  const StoredDataset& dataset = source.find(voxels, element_type(volume.image.type), shape);
  volume.image.bytes = source.values<std::byte>(voxels, dataset);
  return volume;
}

VolumetricSkeleton read_spheres(const Source& source, const std::string& name) {
  const std::string at = "/ecorche/spheres/" + name + "/";
  VolumetricSkeleton skeleton;
  skeleton.name = name;
  skeleton.grid = read_grid(source, at);
  skeleton.metric = read_codes(source, at + "metric", 1, DistanceMetric::chamfer345).front();
  skeleton.thinness = source.scalar<double>(at + "thinness");
  const auto voxels = source.vector<std::uint16_t>(at + "voxel", {Source::any, 3});
  const std::uint64_t rows = voxels.size() / 3;
  skeleton.voxel.resize(rows);
  for (std::size_t r = 0; r < rows; ++r)
    skeleton.voxel[r] = {voxels[3 * r], voxels[3 * r + 1], voxels[3 * r + 2]};
  skeleton.distance = source.vector<std::uint32_t>(at + "distance", {rows});
  skeleton.deficit = source.vector<float>(at + "deficit", {rows});
  skeleton.parent = source.vector<std::int32_t>(at + "parent", {rows});
  skeleton.segment = source.vector<std::int32_t>(at + "segment", {rows});
  return skeleton;
}

// The large arrays; files of hundreds of megabytes are read by several threads at once.
void read_arrays(const Source& source, Model& model) {
  std::vector<std::function<void()>> parts;
  const auto part = [&](auto read) { parts.emplace_back(std::move(read)); };
  const auto all = [&](const std::string& group, auto& rows, auto read) {
    const std::vector<std::string> names = source.ordered_members(group);
    rows.resize(names.size());
    for (std::size_t i = 0; i < names.size(); ++i)
      part([&source, &row = rows[i], name = names[i], read] { row = read(source, name); });
  };
  all("/ecorche/volumes", model.volumes, read_volume);  // the largest first: whoever is done takes the rest
  part([&] { model.nodes = source.matrix<PointsF>("/VTKHDF/Points"); });
  part([&] { model.tets = source.matrix<Tets>("/VTKHDF/Connectivity", true); });
  part([&] { model.tet_label = source.vector<std::uint16_t>("/VTKHDF/CellData/label"); });
  part([&] { model.weights.offsets = source.vector<std::uint64_t>("/ecorche/weights/offsets"); });
  part([&] { model.weights.segment = source.vector<std::uint16_t>("/ecorche/weights/segment"); });
  part([&] { model.weights.weight = source.vector<float>("/ecorche/weights/weight"); });
  part([&] { model.cor.centre = source.matrix<PointsF>("/ecorche/cor/centre"); });
  part([&] { model.cor.has_centre = source.vector<std::uint8_t>("/ecorche/cor/has_centre"); });
  if (source.catalogue().groups.contains("/ecorche/materials")) {
    const std::string at = "/ecorche/materials/";
    model.materials.tissue = source.vector<std::int32_t>(at + "tissue");
    model.materials.young_kpa = source.vector<double>(at + "young_kpa", {model.materials.tissue.size()});
    part([&] { model.materials.of_tet = source.vector<std::uint16_t>("/ecorche/materials/tet"); });
  }
  all("/ecorche/tissues", model.tissues, read_tissue);
  all("/ecorche/spheres", model.spheres, read_spheres);
  // Before 1.6 fields were not packed.
  const auto packed = [&](const std::string& name) {
    const std::string group = "/ecorche/packed_" + name;
    return source.catalogue().groups.contains(group) ? group : "/ecorche/" + name;
  };
  const std::string of_joints = packed("correction"), of_poses = packed("pose_correction");
  all(of_joints, model.corrections,
      [of_joints, &skeleton = model.rig.skeleton](const Source& from, const std::string& joint) {
        return read_correction(from, skeleton, of_joints, joint);
      });
  all(of_poses, model.pose_corrections, [of_poses](const Source& from, const std::string& place) {
    return read_pose_correction(from, of_poses, place);
  });
  run_as_in_turn(parts);
}

constexpr std::int32_t kOfRigidBones = 2;  // the minor version that brought contested tets and their figures

// What older versions did not write.
bool lacks(const Source& source, const std::string& path) {
  return source.catalogue().minor < kOfRigidBones && !source.catalogue().datasets.contains(path);
}

// Older models lack some of the figures: no number stands for a measure of theirs, so that it keeps no bound.
void read_certificate(const Source& source, Certificate& certificate) {
  for_each_figure(certificate, [&](std::string_view name, auto& value) {
    using Figure = std::decay_t<decltype(value)>;
    const std::string path = "/ecorche/quality/" + std::string(name);
    value = lacks(source, path) ? std::numeric_limits<Figure>::quiet_NaN() : source.scalar<Figure>(path);
  });
}

Model read_model(const Source& source) {
  Model model;
  model.name = source.text("/ecorche/name");
  model.rig = read_rig(source);
  model.bone_names = source.texts("/ecorche/labels/bone");
  model.bone_segment = source.vector<std::int32_t>("/ecorche/labels/segment");
  if (!lacks(source, "/ecorche/labels/contested"))
    model.contested = source.vector<std::uint16_t>("/ecorche/labels/contested");
  model.cor.sigma = source.scalar<double>("/ecorche/cor/sigma");
  read_arrays(source, model);
  model.safe_ranges = read_safe_ranges(source);
  check_vtk(source, model);
  read_certificate(source, model.certificate);
  const auto keys = source.texts("/ecorche/provenance/key");
  const auto values = source.texts("/ecorche/provenance/value", {keys.size()});
  for (std::size_t i = 0; i < keys.size(); ++i) {
    if (!model.provenance.emplace(keys[i], values[i]).second) {
      source.refuse("/ecorche/provenance/key", "'" + keys[i] + "' stands twice");
    }
  }
  return model;
}

}  // namespace

Model read(const std::filesystem::path& path, const Context& context) {
  const Catalogue catalogue = inspect(path);
  Model model = read_model(Source(catalogue, context));
  check_invariants(model, catalogue.file.name(), ErrorKind::data, context);
  context.report(1);
  return model;
}

std::vector<DigestCheck> check_digests(const std::filesystem::path& path, const Context& context) {
  const Catalogue catalogue = inspect(path);
  const Source source(catalogue, context);
  std::vector<DigestCheck> checks;
  for (const auto& [name, dataset] : catalogue.datasets) {
    if (!name.starts_with("/ecorche/digests/")) checks.push_back({name, source.digest_is_good(name)});
  }
  return checks;
}

std::vector<DatasetSummary> list(const std::filesystem::path& path) {
  const Catalogue catalogue = inspect(path);
  std::vector<DatasetSummary> all;
  for (const auto& [name, dataset] : catalogue.datasets) {
    all.push_back({name, std::string(element_name(dataset.type)), dataset.shape, dataset.bytes});
  }
  return all;
}

}  // namespace ecorche::model_file
