// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <fstream>
#include <sstream>

#include <ecorche/values/error.hpp>
#include <ecorche/values/volumetric_skeleton_check.hpp>
#include "core/files/atomic_file.hpp"
#include "core/values/text.hpp"
#include "io/surface/byte_reader.hpp"
#include "io/surface/volumetric_skeleton_file.hpp"

namespace ecorche::io {
namespace {

// Arrays as their tags in the XML, and their bytes behind it, each after its length (u64).
class Appended {
 public:
  template <class T>
  std::string tag(const char* type, const char* name, int components, const std::vector<T>& values) {
    std::ostringstream xml;
    xml << "<DataArray type=\"" << type << "\" Name=\"" << name << "\" NumberOfComponents=\"" << components
        << "\" format=\"appended\" offset=\"" << bytes_.size() << "\"/>\n";
    const std::uint64_t size = values.size() * sizeof(T);
    bytes_.append(reinterpret_cast<const char*>(&size), sizeof size);
    bytes_.append(reinterpret_cast<const char*>(values.data()), size);
    return xml.str();
  }
  const std::string& bytes() const { return bytes_; }

 private:
  std::string bytes_;
};

template <class Values>
std::string numbers(const char* type, const char* name, const Values& values) {
  std::string xml = std::string("<DataArray type=\"") + type + "\" Name=\"" + name + "\" NumberOfTuples=\"" +
                    std::to_string(values.size()) + "\" format=\"ascii\">";
  for (const double x : values) xml += text::shortest(x) + " ";
  return xml + "</DataArray>\n";
}

// Strings as VTK writes them: the number of every byte, 0 behind each.
std::string strings(const char* name, const std::vector<std::string>& values) {
  std::string xml = std::string("<Array type=\"String\" Name=\"") + name + "\" NumberOfTuples=\"" +
                    std::to_string(values.size()) + "\" format=\"ascii\">";
  for (const std::string& value : values) {
    for (const char c : value) xml += std::to_string(static_cast<unsigned char>(c)) + " ";
    xml += "0 ";
  }
  return xml + "</Array>\n";
}

void check(const std::filesystem::path& path, const VolumetricSkeletonFile& file) {
  if (path.extension() != ".vtp") {
    throw Error(ErrorKind::usage, path.string(), "a skeleton's name ends in .vtp",
                "name it " + path.stem().string() + ".vtp");
  }
  std::string defect = first_defect(file.skeleton);
  const auto& segment = file.skeleton.segment;
  if (defect.empty() && !segment.empty() && !file.segments.empty() &&
      *std::max_element(segment.begin(), segment.end()) >= std::ssize(file.segments))
    defect = "a voxel hangs on a segment without a name";
  if (defect.empty() && !file.joints.empty() && file.joints.size() != file.segments.size())
    defect = "not every segment has its joint";
  if (!defect.empty()) throw Error(ErrorKind::internal, path.string(), defect, "report how it was thinned");
}

std::string encode(const VolumetricSkeletonFile& file) {
  const VolumetricSkeleton& s = file.skeleton;
  std::vector<float> points;
  std::vector<std::uint16_t> ijk;
  std::vector<std::int32_t> ends, corners;
  points.reserve(3 * s.size());
  ijk.reserve(3 * s.size());
  for (const auto& v : s.voxel) {
    for (const double x : s.grid.point(v[0], v[1], v[2])) points.push_back(static_cast<float>(x));
    ijk.insert(ijk.end(), v.begin(), v.end());
  }
  for (std::size_t r = 0; r < s.parent.size(); ++r) {
    if (s.parent[r] < 0) continue;
    corners.push_back(static_cast<std::int32_t>(r));
    corners.push_back(s.parent[r]);
    ends.push_back(static_cast<std::int32_t>(corners.size()));
  }
  Appended appended;
  std::ostringstream xml;
  xml << "<?xml version=\"1.0\"?>\n<VTKFile type=\"PolyData\" version=\"1.0\" byte_order=\"LittleEndian\" "
         "header_type=\"UInt64\">\n<PolyData>\n<FieldData>\n"
      << numbers("Int32", "ecorche_volumetric_skeleton", std::array{1.0}) << strings("name", {s.name})
      << strings("SPACE", {"LPS"}) << numbers("Int32", "size", s.grid.size)
      << numbers("Float64", "origin", s.grid.origin) << numbers("Float64", "spacing", s.grid.spacing)
      << numbers("Float64", "direction", s.grid.direction)
      << strings("metric", {s.metric == DistanceMetric::euclidean ? "euclidean" : "chamfer345"})
      << numbers("Float64", "thinness", std::array{s.thinness})
      << numbers("UInt8", "tree", std::array{s.parent.empty() ? 0.0 : 1.0});
  if (!file.segments.empty()) xml << strings("segments", file.segments);
  if (!file.joints.empty()) {
    std::vector<double> places;
    for (const auto& joint : file.joints) places.insert(places.end(), joint.begin(), joint.end());
    xml << numbers("Float64", "joints", places);
  }
  xml << "</FieldData>\n<Piece NumberOfPoints=\"" << s.size() << "\" NumberOfVerts=\"0\" NumberOfLines=\""
      << ends.size() << "\" NumberOfStrips=\"0\" NumberOfPolys=\"0\">\n<PointData Scalars=\"deficit\">\n"
      << appended.tag("UInt16", "ijk", 3, ijk) << appended.tag("UInt32", "distance", 1, s.distance)
      << appended.tag("Float32", "deficit", 1, s.deficit);
  if (!s.segment.empty()) xml << appended.tag("Int32", "segment", 1, s.segment);
  xml << "</PointData>\n<Points>\n"
      << appended.tag("Float32", "Points", 3, points) << "</Points>\n<Lines>\n"
      << appended.tag("Int32", "connectivity", 1, corners) << appended.tag("Int32", "offsets", 1, ends)
      << "</Lines>\n</Piece>\n</PolyData>\n<AppendedData encoding=\"raw\">\n_";
  return xml.str() + appended.bytes() + "\n</AppendedData>\n</VTKFile>\n";
}

}  // namespace

void write_volumetric_skeleton(const std::filesystem::path& path, const VolumetricSkeletonFile& file) {
  check(path, file);
  files::write_text(path, encode(file));
}

}  // namespace ecorche::io
