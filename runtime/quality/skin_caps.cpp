// SPDX-License-Identifier: Apache-2.0
#include <ecorche/runtime/skin_caps.hpp>

#include <Eigen/Geometry>
#include <algorithm>
#include <sstream>

namespace ecorche::runtime {
namespace {

constexpr double kFlat = 0.8;  // cosine of a cap's triangles and its plane

}  // namespace

std::vector<SkinCap> skin_caps(const Model& model) {
  std::vector<SkinCap> out;
  const auto found = model.provenance.find("skin_caps");
  if (found == model.provenance.end()) return out;
  std::istringstream lines(found->second);
  for (std::string line; std::getline(lines, line, ';');) {
    std::istringstream numbers(line);
    SkinCap cap;
    for (int a = 0; a < 3; ++a) numbers >> cap.at[a];
    for (int a = 0; a < 3; ++a) numbers >> cap.out[a];
    numbers >> cap.within_mm >> cap.cm2;
    if (numbers && cap.at.allFinite() && cap.out.allFinite()) out.push_back(cap);
  }
  return out;
}

std::vector<std::uint8_t> cap_faces(const Tissue& skin, const std::vector<SkinCap>& caps) {
  std::vector<std::uint8_t> out;
  if (caps.empty()) return out;
  out.assign(static_cast<std::size_t>(skin.F.rows()), 0);
  for (Eigen::Index f = 0; f < skin.F.rows(); ++f) {
    const auto corner = [&](int c) -> Eigen::Vector3d {
      return skin.V.row(skin.F(f, c)).cast<double>().transpose();
    };
    const Eigen::Vector3d normal = (corner(1) - corner(0)).cross(corner(2) - corner(0)).normalized();
    for (const SkinCap& cap : caps) {
      bool there = normal.dot(cap.out) > kFlat;
      for (int c = 0; c < 3; ++c)
        there = there && std::abs((corner(c) - cap.at).dot(cap.out)) <= cap.within_mm;
      if (there) out[static_cast<std::size_t>(f)] = 1;
    }
  }
  return out;
}

std::vector<std::uint8_t> cap_tets(const Model& model) {
  std::vector<std::uint8_t> out;
  const std::vector<SkinCap> caps = skin_caps(model);
  if (caps.empty() || model.tissues.empty()) return out;
  const Tissue& skin = model.tissues.front();
  if (skin.segment != Tissue::by_tets) return out;
  const std::vector<std::uint8_t> faces = cap_faces(skin, caps);
  out.assign(model.tet_count(), 0);
  for (std::size_t f = 0; f < faces.size(); ++f) {
    for (int c = 0; faces[f] != 0 && c < 3; ++c) {
      const auto v = static_cast<std::size_t>(skin.F(static_cast<Eigen::Index>(f), c));
      out[static_cast<std::size_t>(skin.tet[v])] = 1;
    }
  }
  return out;
}

}  // namespace ecorche::runtime
