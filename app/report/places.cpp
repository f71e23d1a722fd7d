// SPDX-License-Identifier: Apache-2.0
#include "app/report/places.hpp"

#include <algorithm>
#include <map>
#include <string_view>

#include "app/report/html.hpp"
#include "app/report/view.hpp"
#include "core/values/identifier.hpp"

namespace ecorche::app::report {
namespace {

constexpr Colour kPlaceGround{250, 250, 248}, kSkin{206, 196, 186}, kBone{236, 228, 208}, kFound{214, 72, 48};
constexpr Colour kGreen{46, 140, 78}, kYellow{214, 150, 20}, kRed{200, 40, 40};
constexpr double kAbout = 80;            // mm shown about what is named
constexpr std::size_t kMostRings = 200;  // of vertices in no tet
constexpr float kOutside = -1e-3F;       // of a barycentric coordinate

const Tissue* find_tissue(const Model& model, std::string_view name) {
  const auto at = std::find_if(model.tissues.begin(), model.tissues.end(),
                               [&](const Tissue& tissue) { return tissue.name == name; });
  return at != model.tissues.end() ? &*at : nullptr;
}

const Joint& joint_named(const Model& model, const std::string& name) {
  return model.rig.skeleton.segments[static_cast<std::size_t>(model.rig.skeleton.find_joint(name))].joint;
}

void draw_body(Scene& scene, const Model& model, const std::vector<const Tissue*>& but) {
  const auto left_out = [&](const Tissue& tissue) {
    return std::find(but.begin(), but.end(), &tissue) != but.end();
  };
  for (const Tissue& tissue : model.tissues) {
    if (tissue.group == Group::skin && !left_out(tissue)) scene.shadow(tissue.V, tissue.F, kSkin, 0.45);
  }
  for (const Tissue& tissue : model.tissues) {
    if (tissue.group == Group::bone && !left_out(tissue)) scene.surface(tissue.V, tissue.F, kBone);
  }
}

Colour of_confidence(double confidence) {
  return confidence >= 0.8 ? kGreen : confidence >= 0.5 ? kYellow : kRed;
}

}  // namespace

Box box_of(const Model& model) {
  if (model.node_count() == 0) return {Eigen::Vector3d::Zero(), Eigen::Vector3d::Zero()};
  return {model.nodes.colwise().minCoeff().transpose().cast<double>(),
          model.nodes.colwise().maxCoeff().transpose().cast<double>()};
}

std::vector<WarningGroup> grouped(const Model& model, const std::vector<std::string>& warnings) {
  const auto once = [](std::vector<std::string>& names, const std::string& name) {
    if (std::find(names.begin(), names.end(), name) == names.end()) names.push_back(name);
  };
  std::vector<WarningGroup> groups;
  std::map<std::string, std::size_t> row;  // of a warning without its names
  for (const std::string& warning : warnings) {
    WarningGroup found{warning, {}, {}, 0};
    std::string pattern;
    for (std::size_t i = 0; i < warning.size();) {
      std::size_t end = i;
      while (end < warning.size() && in_identifier(warning[end])) ++end;
      const std::string word = warning.substr(i, std::max<std::size_t>(1, end - i));
      i += word.size();
      if (model.rig.skeleton.find_joint(word) >= 0) {
        found.joints.push_back(word);
      } else if (find_tissue(model, word) != nullptr) {
        found.tissues.push_back(word);
      } else {
        pattern += word;
        continue;
      }
      pattern += '\0';  // a name; no text holds one
    }
    const auto [at, fresh] = row.try_emplace(pattern, groups.size());
    if (fresh) groups.push_back({warning, {}, {}, 0});
    WarningGroup& group = groups[at->second];
    ++group.count;
    for (const std::string& name : found.joints) once(group.joints, name);
    for (const std::string& name : found.tissues) once(group.tissues, name);
  }
  return groups;
}

Place place_of(const Model& model, const WarningGroup& group) {
  std::vector<const Tissue*> tissues;
  for (const std::string& name : group.tissues) tissues.push_back(find_tissue(model, name));
  Box box{Eigen::Vector3d::Constant(1e30), Eigen::Vector3d::Constant(-1e30)};
  const auto hold = [&](const Eigen::Vector3d& low, const Eigen::Vector3d& high) {
    box.low = box.low.cwiseMin(low);
    box.high = box.high.cwiseMax(high);
  };
  for (const std::string& name : group.joints) {
    const Eigen::Vector3d& at = joint_named(model, name).center;
    hold(at, at);
  }
  for (const Tissue* tissue : tissues) {
    if (tissue->V.rows() == 0) continue;
    hold(tissue->V.colwise().minCoeff().transpose().cast<double>(),
         tissue->V.colwise().maxCoeff().transpose().cast<double>());
  }
  const Eigen::Vector3d about = Eigen::Vector3d::Constant(kAbout);
  Scene scene(View::coronal().of(box.low - about, box.high + about, 360), kPlaceGround);
  draw_body(scene, model, tissues);
  for (const Tissue* tissue : tissues) {
    if (tissue->group == Group::skin) {
      scene.shadow(tissue->V, tissue->F, kFound, 0.5);
    } else {
      scene.surface(tissue->V, tissue->F, kFound);
    }
  }
  std::size_t rings = 0;
  for (const Tissue* tissue : tissues) {
    for (Eigen::Index v = 0; v < tissue->barycentric.rows() && rings < kMostRings; ++v) {
      if (tissue->barycentric.row(v).minCoeff() > kOutside) continue;
      scene.mark(tissue->V.row(v).transpose().cast<double>(), 3, kRed);
      ++rings;
    }
  }
  for (const std::string& name : group.joints) scene.mark(joint_named(model, name).center, 7, kRed);
  const double wide = (box.high[0] - box.low[0] + 2 * kAbout) / 10;
  return {
      text("from the front, %.0f cm wide%s", wide, rings > 0 ? "; rings: vertices that lie in no tet" : ""),
      scene.picture()};
}

namespace {

struct Ring {
  Eigen::Vector3d at;
  double confidence;
};

// The bones from two sides, with a ring about each place, coloured by its confidence.
std::vector<Place> ring_pictures(const Model& model, const std::vector<Ring>& rings, double radius,
                                 int pixels) {
  const Box box = box_of(model);
  std::vector<Place> out;
  for (const auto& [caption, view] :
       {std::pair{"from the front", View::coronal()}, {"from the left", View::sagittal()}}) {
    Scene scene(view.of(box.low, box.high, pixels), kPlaceGround);
    draw_body(scene, model, {});
    for (const Ring& ring : rings) scene.mark(ring.at, radius, of_confidence(ring.confidence));
    out.push_back({caption, scene.picture()});
  }
  return out;
}

}  // namespace

std::vector<Place> rig_pictures(const Model& model, int pixels) {
  std::vector<Ring> rings;
  for (std::size_t s = 0; s < model.segment_count(); ++s)
    rings.push_back({model.rig.skeleton.segments[s].joint.center, model.rig.fits[s].confidence});
  return ring_pictures(model, rings, 5, pixels);
}

std::vector<Place> contact_pictures(const Model& model, const std::vector<parting::CutContact>& contacts,
                                    int pixels) {
  std::vector<Ring> rings;
  rings.reserve(contacts.size());
  for (const parting::CutContact& contact : contacts) rings.push_back({contact.at, contact.confidence});
  return ring_pictures(model, rings, 9, pixels);
}

}  // namespace ecorche::app::report
