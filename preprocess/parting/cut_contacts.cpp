// SPDX-License-Identifier: Apache-2.0
#include "preprocess/parting/cut_contacts.hpp"

#include <array>
#include <cstdio>
#include <sstream>

#include "core/values/text.hpp"

namespace ecorche::parting {
namespace {

constexpr std::string_view kTrunk = "-";
constexpr double kLeastTold = 50;  // mm2: below it only tets bridged air

}  // namespace

std::string cut_contacts_text(const std::vector<Contact>& contacts, const Skeleton& skeleton) {
  const auto name = [&](int s) {
    return s < 0 ? std::string(kTrunk) : skeleton.segments[static_cast<std::size_t>(s)].name;
  };
  std::string out;
  for (const Contact& contact : contacts) {
    if (contact.area_mm2 < kLeastTold) continue;
    out += out.empty() ? "" : ";";
    for (const int s : {contact.limb, contact.other_limb, contact.own, contact.other}) out += name(s) + " ";
    out += text::number(contact.area_mm2 / 100, 4) + " " + text::number(contact.confidence, 3);
    for (int a = 0; a < 3; ++a) out += " " + text::number(contact.at[a], 6);
  }
  return out;
}

std::vector<CutContact> cut_contacts(const Model& model) {
  std::vector<CutContact> out;
  const auto found = model.provenance.find("cut_contacts");
  if (found == model.provenance.end()) return out;
  std::istringstream lines(found->second);
  for (std::string line; std::getline(lines, line, ';');) {
    std::istringstream words(line);
    CutContact contact;
    words >> contact.limb >> contact.other_limb >> contact.own >> contact.other >> contact.cm2 >>
        contact.confidence;
    for (int a = 0; a < 3; ++a) words >> contact.at[a];
    if (!words || !contact.at.allFinite()) continue;
    if (contact.other_limb == kTrunk) contact.other_limb.clear();
    out.push_back(contact);
  }
  return out;
}

std::string describe(const CutContact& contact) {
  std::array<char, 160> figures{};
  std::snprintf(figures.data(), figures.size(), ", at [%.1f, %.1f, %.1f], confidence %.0f %%", contact.at[0],
                contact.at[1], contact.at[2], 100 * contact.confidence);
  return contact.limb + " was cut free of " +
         (contact.other_limb.empty() ? "the trunk" : contact.other_limb) + ": " +
         text::number(contact.cm2, 3) + " cm2, most of " + contact.own + " and " + contact.other +
         figures.data();
}

}  // namespace ecorche::parting
