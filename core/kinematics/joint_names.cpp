// SPDX-License-Identifier: Apache-2.0
#include "core/kinematics/joint_names.hpp"

#include <algorithm>
#include <cctype>
#include <utility>

#include "core/values/text.hpp"

namespace ecorche::kinematics {
namespace {

// A row a joint, plain names. `<` and `>` stand for the side: left/right, l/r.
constexpr std::string_view kTrunk[] = {
    "hips hip pelvis root ccbasehip bip01 bip01pelvis",
    "lowerback lowerspine spinelumbar lumbar lumbarspine spine01 ccbasewaist bip01spine torso",
    "spine upperback midspine ccbasespine01 bip01spine1 spine02 chest",
    "spine1 thorax upperchest spinethoracic thoracicspine ccbasespine02 bip01spine2 spine2 spine03",
    "neck lowerneck ccbasenecktwist01 bip01neck neck01",
    "neck1 upperneck ccbasenecktwist02",
    "head ccbasehead bip01head skull",
    "jaw ccbasejawroot mandible",
};

// {full, letter, short prefix of Character Creator and others}
constexpr std::string_view kLimbs[] = {
    "{F}shoulder {L}clavicle clavicle{L} {F}clavicle clavicle{F} shouldergirdle{F} girdle{F} "
    "ccbase{L}clavicle "
    "bip01{L}clavicle scapula{L} scapula{F}",
    "{F}arm {F}upperarm upperarm{F} upperarm{L} {L}humerus humerus{L} humerus{F} {L}upperarm "
    "ccbase{L}upperarm "
    "bip01{L}upperarm",
    "{F}forearm {F}lowerarm forearm{F} lowerarm{L} {L}radius radius{L} radius{F} {L}forearm ccbase{L}forearm "
    "bip01{L}forearm",
    "{F}hand hand{F} hand{L} {L}hand {L}wrist ccbase{L}hand bip01{L}hand {F}wrist",
    "{F}upleg {F}upperleg thigh{F} thigh{L} {L}femur femur{L} femur{F} {F}thigh {L}thigh ccbase{L}thigh "
    "bip01{L}thigh",
    "{F}leg {F}lowerleg shank{F} calf{L} {L}tibia tibia{L} tibia{F} {F}shin {L}calf ccbase{L}calf "
    "bip01{L}calf "
    "{F}knee",
    "{F}foot foot{F} foot{L} {L}foot ccbase{L}foot bip01{L}foot {F}ankle talus{L} calcn{L}",
    "{F}toebase {F}toes toes{F} toes{L} {L}toes ball{L} ccbase{L}toebase bip01{L}toe0 {F}toe",
};

std::vector<std::string> split(std::string_view row, std::string_view full, std::string_view letter) {
  std::vector<std::string> out;
  std::string word;
  for (std::size_t i = 0; i <= row.size(); ++i) {
    if (i == row.size() || row[i] == ' ') {
      if (!word.empty()) out.push_back(word);
      word.clear();
    } else if (row[i] == '{') {
      word += row[i + 1] == 'F' ? full : letter;
      i += 2;
    } else {
      word += row[i];
    }
  }
  return out;
}

const std::vector<std::vector<std::string>>& rows() {
  static const std::vector<std::vector<std::string>> all = [] {
    std::vector<std::vector<std::string>> out;
    for (const std::string_view row : kTrunk) out.push_back(split(row, "", ""));
    for (const std::string_view row : kLimbs) {
      out.push_back(split(row, "left", "l"));
      out.push_back(split(row, "right", "r"));
    }
    return out;
  }();
  return all;
}

}  // namespace

std::string plain_name(std::string_view name) {
  const std::size_t colon = name.rfind(':');
  if (colon != std::string_view::npos) name.remove_prefix(colon + 1);
  std::string out;
  for (const char c : name) {
    if (c != ' ' && c != '_' && c != '-') out += text::lower(c);
  }
  return out;
}

std::vector<std::string> plain_names(const std::vector<std::string>& joints) {
  constexpr std::pair<std::string_view, std::string_view> limb[] = {
      {"collar", "shoulder"}, {"shoulder", "arm"}, {"elbow", "forearm"}, {"wrist", "hand"},
      {"hip", "upleg"},       {"knee", "leg"},     {"ankle", "foot"},    {"toe", "toebase"}};
  constexpr std::pair<std::string_view, std::string_view> trunk[] = {
      {"chest", "spine"}, {"chest2", "spine1"}, {"lowerneck", "neck"}, {"neck", "neck1"}};
  std::vector<std::string> out;
  for (const std::string& joint : joints) out.push_back(plain_name(joint));
  if (std::find(out.begin(), out.end(), "leftcollar") == out.end() &&
      std::find(out.begin(), out.end(), "rightcollar") == out.end())
    return out;
  const bool two_necks = std::find(out.begin(), out.end(), "lowerneck") != out.end();
  for (std::string& name : out) {
    for (const auto& [from, to] : trunk) {
      if (name != from || (from == "neck" && !two_necks)) continue;
      name = to;
      break;
    }
    for (const std::string_view side : {"left", "right"}) {
      if (!name.starts_with(side)) continue;
      for (const auto& [from, to] : limb) {
        if (name.substr(side.size()) != from) continue;
        name = std::string(side) + std::string(to);
        break;
      }
    }
  }
  return out;
}

std::vector<std::string> synonyms(const std::vector<std::string>& names) {
  std::vector<std::string> own, out;
  for (const std::string& name : names) own.push_back(plain_name(name));
  for (const std::string& name : own) {
    for (const std::vector<std::string>& row : rows()) {
      if (std::find(row.begin(), row.end(), name) == row.end()) continue;
      for (const std::string& other : row) {
        const bool known = std::find(own.begin(), own.end(), other) != own.end() ||
                           std::find(out.begin(), out.end(), other) != out.end();
        if (!known) out.push_back(other);
      }
    }
  }
  return out;
}

}  // namespace ecorche::kinematics
