// SPDX-License-Identifier: Apache-2.0
#include "app/contacts_report.hpp"

#include <nlohmann/json.hpp>

#include "preprocess/check/touching_limbs.hpp"
#include "preprocess/parting/cut_contacts.hpp"

namespace ecorche::app {

nlohmann::json contacts_json(const Model& model) {
  nlohmann::json out = nlohmann::json::array();
  const auto name = [&](int s) { return model.rig.skeleton.segments[static_cast<std::size_t>(s)].name; };
  for (const check::Touch& touch : check::touching_limbs(model)) {
    out.push_back({{"limb", name(touch.limb)},
                   {"touches", touch.other_limb >= 0 ? nlohmann::json(name(touch.other_limb)) : nullptr},
                   {"own", name(touch.own)},
                   {"other", name(touch.other)},
                   {"area_cm2", touch.area_mm2 / 100},
                   {"at", {touch.at.x(), touch.at.y(), touch.at.z()}},
                   {"text", check::describe(touch, model.rig.skeleton)},
                   {"mend", check::parting_advice(check::cube_mm(model.nodes, model.tets))}});
  }
  return out;
}

nlohmann::json cut_contacts_json(const Model& model) {
  nlohmann::json out = nlohmann::json::array();
  for (const parting::CutContact& contact : parting::cut_contacts(model)) {
    out.push_back(
        {{"limb", contact.limb},
         {"of", contact.other_limb.empty() ? nlohmann::json(nullptr) : nlohmann::json(contact.other_limb)},
         {"own", contact.own},
         {"other", contact.other},
         {"area_cm2", contact.cm2},
         {"confidence", contact.confidence},
         {"at", {contact.at.x(), contact.at.y(), contact.at.z()}},
         {"text", parting::describe(contact)}});
  }
  return out;
}

std::string cut_contacts_text(const nlohmann::json& contacts) {
  std::string out;
  for (const nlohmann::json& contact : contacts) out += contact["text"].get<std::string>() + "\n";
  return out;
}

std::string contacts_text(const nlohmann::json& contacts) {
  std::string out;
  for (const nlohmann::json& touch : contacts) out += "touching: " + touch["text"].get<std::string>() + "\n";
  if (!contacts.empty()) out += "(" + contacts.front()["mend"].get<std::string>() + ")\n";
  return out;
}

}  // namespace ecorche::app
