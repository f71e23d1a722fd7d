// SPDX-License-Identifier: Apache-2.0
#include "io/surface/tet_formats.hpp"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <cstring>
#include <numbers>

#include <ecorche/values/error.hpp>

namespace ecorche::io::tet_formats {
namespace {

constexpr std::size_t kListed = 10, kPerLine = 16;

class Text {
 public:
  Text& operator<<(std::string_view text) {
    out_ += text;
    return *this;
  }
  template <class T>
  requires std::is_arithmetic_v<T> Text& operator<<(T value) {
    char digits[32];
    out_.append(digits, std::to_chars(digits, digits + sizeof digits, value).ptr);
    return *this;
  }
  std::string take() { return std::move(out_); }

 private:
  std::string out_;
};

std::uint16_t label_of(const TetRegions& regions, Eigen::Index t) {
  return regions.label.empty() ? std::uint16_t{0} : regions.label[static_cast<std::size_t>(t)];
}

// What each tet is in: without regions, all of them in one.
const std::string& name_of(const TetRegions& regions, std::size_t label) {
  static const std::string body = "body";
  return regions.label.empty() ? body : regions.names[label];
}

// The labels that occur, ascending.
std::vector<std::size_t> labels_present(const Tets& T, const TetRegions& regions) {
  std::vector<char> seen(std::max<std::size_t>(regions.names.size(), 1), 0);
  for (Eigen::Index t = 0; t < T.rows(); ++t) seen[label_of(regions, t)] = 1;
  std::vector<std::size_t> out;
  for (std::size_t label = 0; label < seen.size(); ++label) {
    if (seen[label] != 0) out.push_back(label);
  }
  return out;
}

double least_dihedral(const std::array<Eigen::Vector3d, 4>& p) {
  double greatest_cosine = -1;
  constexpr int edges[6][4]{{0, 1, 2, 3}, {0, 2, 1, 3}, {0, 3, 1, 2},
                            {1, 2, 0, 3}, {1, 3, 0, 2}, {2, 3, 0, 1}};
  for (const auto& e : edges) {
    const Eigen::Vector3d a = p[static_cast<std::size_t>(e[0])];
    const Eigen::Vector3d axis = (p[static_cast<std::size_t>(e[1])] - a).normalized();
    const auto across = [&](int corner) {
      const Eigen::Vector3d to = p[static_cast<std::size_t>(corner)] - a;
      return Eigen::Vector3d((to - to.dot(axis) * axis).normalized());
    };
    greatest_cosine = std::max(greatest_cosine, across(e[2]).dot(across(e[3])));
  }
  return std::acos(std::clamp(greatest_cosine, -1.0, 1.0)) * 180 / std::numbers::pi;
}

void append_nodes(Text& text, const PointsF& V, float scale) {
  for (Eigen::Index i = 0; i < V.rows(); ++i) {
    text << i + 1 << ", " << scale * V(i, 0) << ", " << scale * V(i, 1) << ", " << scale * V(i, 2) << "\n";
  }
}

void append_elements(Text& text, const Tets& T) {
  for (Eigen::Index t = 0; t < T.rows(); ++t) {
    text << t + 1;
    for (int c = 0; c < 4; ++c) text << ", " << T(t, c) + 1;
    text << "\n";
  }
}

// Sixteen numbers a line, as Abaqus allows.
void append_set(Text& text, const Tets& T, const TetRegions& regions, std::size_t label) {
  std::size_t on_line = 0;
  for (Eigen::Index t = 0; t < T.rows(); ++t) {
    if (label_of(regions, t) != label) continue;
    if (on_line > 0) text << (on_line % kPerLine == 0 ? ",\n" : ", ");
    text << t + 1;
    ++on_line;
  }
  text << "\n";
}

std::string set_name(const std::string& name) {
  return name.empty() || (name[0] >= '0' && name[0] <= '9') || name[0] == '_' ? "r_" + name : name;
}

template <class T>
void append_raw(std::string& out, const T& value) {
  out.append(reinterpret_cast<const char*>(&value), sizeof value);
}

}  // namespace

void check_tets(const PointsF& V, const Tets& T, const TetRegions& regions) {
  for (Eigen::Index i = 0; i < T.size(); ++i) {
    const std::int32_t v = T.data()[i];
    if (v < 0 || v >= V.rows()) {
      throw Error(ErrorKind::internal, "mesh",
                  "row " + std::to_string(i / 4) + " uses vertex " + std::to_string(v), "report this");
    }
  }
  if (regions.label.empty()) return;
  const auto rows = static_cast<std::size_t>(T.rows());
  const std::uint16_t most = regions.label.size() == rows && rows > 0
                                 ? *std::max_element(regions.label.begin(), regions.label.end())
                                 : 0;
  if (regions.label.size() != rows || most >= regions.names.size()) {
    throw Error(ErrorKind::internal, "regions",
                std::to_string(regions.label.size()) + " labels up to " + std::to_string(most) + " for " +
                    std::to_string(rows) + " tets and " + std::to_string(regions.names.size()) + " names",
                "report this");
  }
}

void refuse_degenerate(const PointsF& V, const Tets& T, const std::string& where) {
  std::size_t count = 0;
  std::string list;
  for (Eigen::Index t = 0; t < T.rows(); ++t) {
    std::array<Eigen::Vector3d, 4> p;
    for (int c = 0; c < 4; ++c) p[static_cast<std::size_t>(c)] = V.row(T(t, c)).cast<double>().transpose();
    const double volume = (p[1] - p[0]).cross(p[2] - p[0]).dot(p[3] - p[0]) / 6;
    const double angle = least_dihedral(p);
    if (volume >= least_volume_mm3 && angle >= least_dihedral_deg) continue;
    if (++count > kListed) continue;
    const Eigen::Vector3d centre = (p[0] + p[1] + p[2] + p[3]) / 4;
    char line[160];
    std::snprintf(line, sizeof line, "%s%lld (%.4g mm3, %.3g deg, at %.1f %.1f %.1f)", count > 1 ? ", " : "",
                  static_cast<long long>(t + 1), volume, angle, centre.x(), centre.y(), centre.z());
    list += line;
  }
  if (count == 0) return;
  char bounds[80];
  std::snprintf(bounds, sizeof bounds, " below %g mm3 or %g deg: ", least_volume_mm3, least_dihedral_deg);
  throw Error(ErrorKind::refused, where,
              std::to_string(count) + " of " + std::to_string(T.rows()) + " tets are" + bounds + list +
                  (count > kListed ? ", ..." : ""),
              "pose less, or preprocess with another mesher or voxel");
}

std::string encode_msh(const PointsF& V, const Tets& T, const TetRegions& regions) {
  std::string out = "$MeshFormat\n2.2 1 8\n";
  append_raw(out, std::int32_t{1});
  const std::vector<std::size_t> present = labels_present(T, regions);
  out += "\n$EndMeshFormat\n$PhysicalNames\n" + std::to_string(present.size()) + "\n";
  for (const std::size_t label : present)
    out += "3 " + std::to_string(label + 1) + " \"" + name_of(regions, label) + "\"\n";
  out += "$EndPhysicalNames\n$Nodes\n" + std::to_string(V.rows()) + "\n";
  for (Eigen::Index i = 0; i < V.rows(); ++i) {
    append_raw(out, static_cast<std::int32_t>(i + 1));
    for (int k = 0; k < 3; ++k) append_raw(out, static_cast<double>(V(i, k)));
  }
  out += "\n$EndNodes\n$Elements\n" + std::to_string(T.rows()) + "\n";
  // One block: all are tets (type 4) with two tags, physical and elementary.
  if (T.rows() > 0) append_raw(out, std::array<std::int32_t, 3>{4, static_cast<std::int32_t>(T.rows()), 2});
  for (Eigen::Index t = 0; t < T.rows(); ++t) {
    const std::int32_t tag = label_of(regions, t) + 1;
    append_raw(out, std::array<std::int32_t, 7>{static_cast<std::int32_t>(t + 1), tag, tag, T(t, 0) + 1,
                                                T(t, 1) + 1, T(t, 2) + 1, T(t, 3) + 1});
  }
  return out + "\n$EndElements\n";
}

std::string encode_node(const PointsF& V) {
  Text text;
  text << "# ecorche, LPS, mm\n" << V.rows() << " 3 0 0\n";
  for (Eigen::Index i = 0; i < V.rows(); ++i)
    text << i + 1 << " " << V(i, 0) << " " << V(i, 1) << " " << V(i, 2) << "\n";
  return text.take();
}

std::string encode_ele(const Tets& T, const TetRegions& regions) {
  Text text;
  text << "# ecorche\n";
  for (const std::size_t label : labels_present(T, regions))
    text << "# region " << label << " " << name_of(regions, label) << "\n";
  text << T.rows() << " 4 1\n";
  for (Eigen::Index t = 0; t < T.rows(); ++t) {
    text << t + 1;
    for (int c = 0; c < 4; ++c) text << " " << T(t, c) + 1;
    text << " " << label_of(regions, t) << "\n";
  }
  return text.take();
}

std::string encode_abaqus(const PointsF& V, const Tets& T, const TetRegions& regions) {
  Text text;
  text << "*HEADING\necorche, patient LPS, mm\n*NODE\n";
  append_nodes(text, V, 1);
  text << "*ELEMENT, TYPE=C3D4\n";
  append_elements(text, T);
  for (const std::size_t label : labels_present(T, regions)) {
    text << "*ELSET, ELSET=" << set_name(name_of(regions, label)) << "\n";
    append_set(text, T, regions, label);
  }
  return text.take();
}

std::string encode_mcnp(const PointsF& V, const Tets& T, const TetRegions& regions) {
  const std::vector<std::size_t> present = labels_present(T, regions);
  const auto number = [](std::size_t i) {
    char digits[24];
    std::snprintf(digits, sizeof digits, "%03zu", i + 1);
    return std::string(digits);
  };
  Text text;
  text << "*Heading\n** ecorche, patient LPS, centimetres\n";
  for (std::size_t i = 0; i < present.size(); ++i)
    text << "** material " << i + 1 << ": " << name_of(regions, present[i]) << "\n";
  text << "*Part, name=Part-body_1\n*Node\n";
  append_nodes(text, V, 0.1F);
  text << "*Element, type=C3D4\n";
  append_elements(text, T);
  for (std::size_t i = 0; i < present.size(); ++i) {
    text << "*Elset, elset=Set-material_tally_" << number(i) << "\n";
    append_set(text, T, regions, present[i]);
  }
  const auto material = [&](std::size_t i) {
    return "Material-" + name_of(regions, present[i]) + "_" + number(i);
  };
  for (std::size_t i = 0; i < present.size(); ++i) {
    text << "*Solid Section, elset=Set-material_tally_" << number(i) << ", material=" << material(i)
         << "\n,\n";
  }
  text << "*End Part\n*Assembly, name=Assembly\n*Instance, name=Part-body_1-1, part=Part-body_1\n*End "
          "Instance\n"
       << "*End Assembly\n";
  for (std::size_t i = 0; i < present.size(); ++i) text << "*Material, name=" << material(i) << "\n";
  return text.take();
}

}  // namespace ecorche::io::tet_formats
