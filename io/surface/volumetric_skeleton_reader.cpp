// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>

#include <ecorche/values/volumetric_skeleton_check.hpp>
#include "core/files/atomic_file.hpp"
#include "core/values/text.hpp"
#include "io/surface/volumetric_skeleton_file.hpp"
#include "io/surface/vtk_xml.hpp"

namespace ecorche::io {
namespace {

constexpr std::size_t kLargestSkeletonFile = std::size_t{1} << 33;
constexpr std::uint64_t kMostNames = 65536;
constexpr double kFarthestJoint = 1e6;  // mm
constexpr double kOffVoxel = 0.01;      // of a voxel: points are float32

class SkeletonReader {
 public:
  SkeletonReader(std::string_view bytes, const std::string& where, const files::ReadLimits& limits)
      : where_(where),
        budget_(bytes.size(), limits, where),
        document_(vtk_xml::parse(bytes, "PolyData", {"Points", "PointData", "Lines"},
                                 "save it as XML PolyData (.vtp)", budget_)) {}

  VolumetricSkeletonFile read() {
    if (const auto version = field("ecorche_volumetric_skeleton", 1); version[0] != 1)
      refuse("is of version " + text::shortest(version[0]), "this program reads version 1");
    if (document_.pieces.size() != 1) refuse("has " + std::to_string(document_.pieces.size()) + " pieces");
    read_fields();
    read_voxels();
    read_tree();
    if (const std::string defect = first_defect(out_.skeleton); !defect.empty()) refuse(defect);
    check_points();
    return std::move(out_);
  }

 private:
  [[noreturn]] void refuse(std::string what, std::string mend = "write the skeleton again") const {
    bytes::refuse(where_, std::move(what), std::move(mend));
  }

  const vtk_xml::DataArray& field_array(const std::string& name) const {
    const auto found = document_.fields.find(name);
    if (found == document_.fields.end())
      refuse("has no field '" + name + "'", "is it a skeleton that 'ecorche thin' wrote?");
    return found->second;
  }
  std::vector<double> field(const std::string& name, std::size_t count) const {
    std::vector<double> values = vtp::reals(field_array(name), document_.storage, count, where_);
    if (values.size() != count)
      refuse("its field '" + name + "' has not " + std::to_string(count) + " values");
    return values;
  }
  // The strings of a field, without their NULs.
  std::vector<std::string> words(const std::string& name, std::uint64_t most) const {
    const std::string all = vtk_xml::letters(field_array(name), document_.storage, most * 256, where_);
    std::vector<std::string> out;
    for (std::size_t at = 0; at < all.size();) {
      const std::size_t end = all.find('\0', at);
      if (end == all.npos || out.size() == most)
        refuse("its field '" + name + "' is not of " + std::to_string(most) + " strings at most");
      out.push_back(all.substr(at, end - at));
      at = end + 1;
    }
    return out;
  }
  std::string word(const std::string& name) const {
    const auto all = words(name, 1);
    return all.empty() ? std::string() : all[0];
  }

  template <std::size_t N>
  std::array<double, N> numbers(const std::string& name) const {
    const std::vector<double> values = field(name, N);
    std::array<double, N> out{};
    std::copy(values.begin(), values.end(), out.begin());
    return out;
  }

  void read_fields() {
    VolumetricSkeleton& s = out_.skeleton;
    s.name = word("name");
    for (std::size_t a = 0; a < 3; ++a) {
      const double n = numbers<3>("size")[a];
      if (!(n >= 1 && n <= 65535) || n != std::floor(n))
        refuse("its field 'size' holds " + text::shortest(n));
      s.grid.size[a] = static_cast<std::int32_t>(n);
    }
    s.grid.origin = numbers<3>("origin");
    s.grid.spacing = numbers<3>("spacing");
    s.grid.direction = numbers<9>("direction");
    s.thinness = field("thinness", 1)[0];
    const std::string metric = word("metric");
    if (metric != "euclidean" && metric != "chamfer345")
      refuse("its metric is '" + metric.substr(0, 40) + "'");
    s.metric = metric == "euclidean" ? DistanceMetric::euclidean : DistanceMetric::chamfer345;
    if (document_.fields.contains("segments")) out_.segments = words("segments", kMostNames);
    if (document_.fields.contains("joints")) read_joints();
  }

  void read_joints() {
    const std::vector<double> places = field("joints", 3 * out_.segments.size());
    for (std::size_t at = 0; at < places.size(); at += 3) {
      const std::array<double, 3> joint{places[at], places[at + 1], places[at + 2]};
      for (const double x : joint) {
        if (!(std::abs(x) <= kFarthestJoint)) refuse("its field 'joints' holds " + text::shortest(x));
      }
      out_.joints.push_back(joint);
    }
  }

  const vtk_xml::Piece& piece() const { return document_.pieces[0]; }

  // A point array of whole numbers within `least` and `most`.
  template <class T>
  std::vector<T> point_array(const std::string& name, std::uint64_t components, std::int64_t least,
                             std::int64_t most) const {
    const vtk_xml::DataArray* array = piece().find("PointData", name);
    if (array == nullptr) refuse("has no point array '" + name + "'");
    const auto values = vtp::wholes(*array, document_.storage, components * rows_, where_);
    check_length(name, values.size(), components);
    std::vector<T> out;
    out.reserve(values.size());
    for (const std::int64_t value : values) {
      if (value < least || value > most) refuse("its array '" + name + "' holds " + std::to_string(value));
      out.push_back(static_cast<T>(value));
    }
    return out;
  }
  void check_length(const std::string& name, std::size_t found, std::uint64_t components) const {
    if (found == components * rows_) return;
    refuse("its array '" + name + "' has " + std::to_string(found) + " values for " + std::to_string(rows_) +
           " voxels");
  }

  void read_voxels() {
    VolumetricSkeleton& s = out_.skeleton;
    rows_ = vtk_xml::count_of(piece(), "NumberOfPoints", document_, where_);
    budget_.spend_points(rows_);
    const auto ijk = point_array<std::uint16_t>("ijk", 3, 0, 65535);
    s.voxel.resize(rows_);
    for (std::size_t r = 0; r < rows_; ++r) s.voxel[r] = {ijk[3 * r], ijk[3 * r + 1], ijk[3 * r + 2]};
    s.distance = point_array<std::uint32_t>("distance", 1, 1, 0xffffffff);
    const vtk_xml::DataArray* deficit = piece().find("PointData", "deficit");
    if (deficit == nullptr) refuse("has no point array 'deficit'");
    const auto values = vtp::reals(*deficit, document_.storage, rows_, where_);
    check_length("deficit", values.size(), 1);
    for (const double x : values) {
      if (!(std::abs(x) < 1e6)) refuse("its array 'deficit' holds " + text::shortest(x));
      s.deficit.push_back(static_cast<float>(x));
    }
    if (piece().find("PointData", "segment") == nullptr) return;
    const auto most = out_.segments.empty() ? std::int64_t{65535} : std::ssize(out_.segments) - 1;
    s.segment = point_array<std::int32_t>("segment", 1, VolumetricSkeleton::none, most);
  }

  std::vector<std::int64_t> line_array(const std::string& name, std::uint64_t count) const {
    const vtk_xml::DataArray* array = piece().find("Lines", name);
    if (array == nullptr) refuse("its lines have no array '" + name + "'");
    auto values = vtp::wholes(*array, document_.storage, count, where_);
    if (values.size() != count)
      refuse("its lines' array '" + name + "' has not " + std::to_string(count) + " values");
    return values;
  }

  void read_tree() {
    const std::uint64_t lines = vtk_xml::count_of(piece(), "NumberOfLines", document_, where_);
    const double tree = field("tree", 1)[0];
    if (tree != 0 && tree != 1) refuse("its field 'tree' is neither 0 nor 1");
    if (tree == 0 && lines > 0) refuse("has lines, but says that it has no tree");
    if (tree == 0) return;
    std::vector<std::int32_t>& parent = out_.skeleton.parent;
    parent.assign(rows_, VolumetricSkeleton::none);
    if (lines == 0) return;
    const auto ends = line_array("offsets", lines), corners = line_array("connectivity", 2 * lines);
    const auto rows = static_cast<std::int64_t>(rows_);
    for (std::size_t l = 0; l < lines; ++l) {
      const std::int64_t child = corners[2 * l], to = corners[2 * l + 1];
      if (ends[l] != static_cast<std::int64_t>(2 * l + 2) || child < 0 || to < 0 || child >= rows ||
          to >= rows)
        refuse("its line " + std::to_string(l) + " does not join two voxels");
      if (parent[static_cast<std::size_t>(child)] != VolumetricSkeleton::none)
        refuse("voxel " + std::to_string(child) + " has two parents");
      parent[static_cast<std::size_t>(child)] = static_cast<std::int32_t>(to);
    }
  }

  void check_points() const {
    const VolumetricSkeleton& s = out_.skeleton;
    const vtk_xml::DataArray* array = piece().find("Points", "");
    const auto x =
        array == nullptr ? std::vector<double>() : vtp::reals(*array, document_.storage, 3 * rows_, where_);
    check_length("Points", x.size(), 3);
    for (std::size_t r = 0; r < rows_; ++r) {
      const auto& v = s.voxel[r];
      const auto p = s.grid.point(v[0], v[1], v[2]);
      for (std::size_t a = 0; a < 3; ++a) {
        if (!(std::abs(x[3 * r + a] - p[a]) <= kOffVoxel * s.grid.spacing[a] + 1e-6 * std::abs(p[a])))
          refuse("point " + std::to_string(r) + " is not where its 'ijk' says",
                 "points must not be moved here");
      }
    }
  }

  const std::string& where_;
  files::Budget budget_;
  vtk_xml::Document document_;
  std::uint64_t rows_ = 0;
  VolumetricSkeletonFile out_;
};

}  // namespace

VolumetricSkeletonFile decode_volumetric_skeleton(std::string_view bytes, const std::string& where,
                                                  const files::ReadLimits& limits) {
  return SkeletonReader(bytes, where, limits).read();
}

VolumetricSkeletonFile read_volumetric_skeleton(const std::filesystem::path& path,
                                                const files::ReadLimits& limits) {
  return decode_volumetric_skeleton(files::read_text(path, kLargestSkeletonFile), path.string(), limits);
}

}  // namespace ecorche::io
