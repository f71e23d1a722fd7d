// SPDX-License-Identifier: Apache-2.0
#include "io/case/structures.hpp"

#include <algorithm>
#include <array>
#include <map>

#include <ecorche/values/error.hpp>
#include "core/values/identifier.hpp"
#include "core/values/text.hpp"
#include "io/case/embedded.hpp"

namespace ecorche::io {
namespace {

using Words = std::vector<std::string>;
using Becomes = Structure::Becomes;

constexpr std::string_view kLeft = "7771000", kRight = "24028007";
// Types that say no more than that a segment is one; which, the region says: bone, tissue, structure,
// vertebra.
constexpr std::array<std::string_view, 5> kGeneric{"272673000", "85756007", "123037004", "51282000",
                                                   "91723000"};
constexpr std::array<std::string_view, 8> kLeftWords{"left",  "l",        "lt",  "lh",
                                                     "links", "sinister", "sin", "gauche"};
constexpr std::array<std::string_view, 8> kRightWords{"right",  "r",      "rt",  "rh",
                                                      "rechts", "dexter", "dex", "droite"};
// What tells a part of a structure, or nothing.
constexpr std::array<std::string_view, 32> kPartWords{
    "cortical", "cortex", "spongiosa", "trabecular", "cancellous", "medullary", "medulla", "cavity",
    "marrow",   "upper",  "lower",     "half",       "wall",       "contents",  "content", "proximal",
    "distal",   "shaft",  "head",      "structure",  "segment",    "label",     "mask",    "seg",
    "tissue",   "blood",  "glandular", "os",         "the",        "outer",     "inner",   "segmentation"};

struct Table {
  std::vector<Structure> all;
  std::map<std::string, std::size_t, std::less<>> by_name, by_other_name, by_code;
};

Structure parse_line(std::string_view line, Words& also) {
  std::array<std::string_view, 4> cell;
  for (std::string_view& c : cell) {
    const std::size_t bar = line.find('|');
    c = text::trim(line.substr(0, bar));
    line.remove_prefix(bar == line.npos ? line.size() : bar + 1);
  }
  Structure s;
  s.coarse = cell[0].starts_with('~');
  s.name = cell[0].substr(s.coarse ? 1 : 0);
  const auto target = text::words(cell[1]);
  const std::string_view kind = target.at(0);
  if (kind == "bone") {
    s.becomes = Becomes::bone;
    s.group = Group::bone;
    s.segment = target.at(1);
    s.sided = s.segment.ends_with("_*");
    if (s.sided) s.segment.resize(s.segment.size() - 2);
  } else if (kind == "background") {
    s.becomes = Becomes::background;
    s.group = group_from_name(target.at(1));
  } else if (kind == "body" || kind == "shell" || kind == "nothing") {
    s.becomes = kind == "body" ? Becomes::body : kind == "shell" ? Becomes::shell : Becomes::nothing;
  } else {
    s.group = group_from_name(kind);
  }
  s.code = cell[2];
  for (const std::string_view word : text::words(cell[3])) also.emplace_back(word);
  return s;
}

Table read_table() {
  Table table;
  std::string_view rest = embedded::structures;
  while (!rest.empty()) {
    const std::size_t end = std::min(rest.find('\n'), rest.size());
    const std::string_view line = text::trim(rest.substr(0, end));
    rest.remove_prefix(std::min(end + 1, rest.size()));
    if (line.empty() || line.front() == '#') continue;
    Words also;
    table.all.push_back(parse_line(line, also));
    const std::size_t at = table.all.size() - 1;
    table.by_name.emplace(table.all.back().name, at);
    if (!table.all.back().code.empty()) table.by_code.emplace(table.all.back().code, at);
    for (const std::string& word : also) table.by_other_name.emplace(word, at);
  }
  return table;
}

const Table& table() {
  static const Table once = read_table();
  return once;
}

template <class List>
bool among(const List& list, std::string_view word) {
  return std::find(list.begin(), list.end(), word) != list.end();
}

Words words_of(std::string_view name) {
  Words out;
  const std::string made = identifier_from(name, 256);
  for (std::size_t at = 0; at <= made.size();) {
    const std::size_t end = std::min(made.find('_', at), made.size());
    if (end > at) out.push_back(made.substr(at, end - at));
    at = end + 1;
  }
  return out;
}

// Takes words of a side out. Single letters mean one only at an end.
Side take_side(Words& words) {
  Side side = Side::both;
  bool several = false;
  Words kept;
  for (std::size_t i = 0; i < words.size(); ++i) {
    const bool at_end = i == 0 || i + 1 == words.size();
    const bool left = among(kLeftWords, words[i]), right = among(kRightWords, words[i]);
    if (words.size() == 1 || !(left || right) || (words[i].size() == 1 && !at_end)) {
      kept.push_back(words[i]);
      continue;
    }
    const Side said = left ? Side::left : Side::right;
    several = several || (side != Side::both && side != said);
    side = said;
  }
  words = std::move(kept);
  return several ? Side::both : side;
}

const Structure* find(const Words& words, double& confidence) {
  const std::string joined = text::joined(words, "_");
  const Table& t = table();
  if (const auto found = t.by_name.find(joined); found != t.by_name.end()) {
    confidence = 1;
    return &t.all[found->second];
  }
  if (const auto found = t.by_other_name.find(joined); found != t.by_other_name.end()) {
    confidence = 0.95;
    return &t.all[found->second];
  }
  return nullptr;
}

// Which words tell the group of a structure that is not in the table.
Group group_of(const Words& words) {
  static const std::map<std::string_view, Group> known{
      {"muscle", Group::muscle},         {"muscles", Group::muscle},
      {"musculus", Group::muscle},       {"flexor", Group::muscle},
      {"flexors", Group::muscle},        {"extensor", Group::muscle},
      {"extensors", Group::muscle},      {"vastus", Group::muscle},
      {"femoris", Group::muscle},        {"brachii", Group::muscle},
      {"gastrocnemius", Group::muscle},  {"soleus", Group::muscle},
      {"semitendinosus", Group::muscle}, {"semimembranosus", Group::muscle},
      {"gracilis", Group::muscle},       {"adductor", Group::muscle},
      {"adductors", Group::muscle},      {"peroneus", Group::muscle},
      {"popliteus", Group::muscle},      {"tibialis", Group::muscle},
      {"artery", Group::vessel},         {"arteries", Group::vessel},
      {"vein", Group::vessel},           {"veins", Group::vessel},
      {"vessel", Group::vessel},         {"vessels", Group::vessel},
      {"nerve", Group::nerve},           {"nerves", Group::nerve},
      {"cartilage", Group::cartilage},   {"cartilages", Group::cartilage},
      {"meniscus", Group::cartilage},    {"menisci", Group::cartilage},
      {"disc", Group::cartilage},        {"ligament", Group::ligament},
      {"ligaments", Group::ligament},    {"tendon", Group::ligament},
      {"tract", Group::ligament},        {"fat", Group::fat},
      {"adipose", Group::fat},           {"gland", Group::organ},
      {"glands", Group::organ},          {"lobe", Group::organ}};
  // The last that says something: a nerve's muscular branch is a nerve, a tendon of a muscle is a tendon.
  Group group = Group::other;
  for (const std::string& word : words) {
    const auto found = known.find(word);
    if (found == known.end()) continue;
    if (group == Group::other || group == Group::muscle || found->second == Group::ligament)
      group = found->second;
  }
  return group;
}

Recognised by_name(std::string_view name) {
  Recognised out;
  Words words = words_of(name);
  out.side = take_side(words);
  out.how = "name";
  if ((out.structure = find(words, out.confidence)) != nullptr) {
    if (out.confidence < 1) out.how = "another name of it";
    return out;
  }
  Words fewer;
  for (const std::string& word : words) {
    if (!among(kPartWords, word)) fewer.push_back(word);
  }
  if (fewer.size() < words.size() && (out.structure = find(fewer, out.confidence)) != nullptr) {
    out.confidence = 0.85;
    out.how = "name, as a part of it";
    return out;
  }
  for (const std::string_view last : {"muscle", "bone", "bones"}) {
    Words shorter = fewer;
    if (shorter.size() < 2 || shorter.back() != last) continue;
    shorter.pop_back();
    if ((out.structure = find(shorter, out.confidence)) == nullptr) continue;
    out.confidence = 0.85;
    out.how = "name without '" + std::string(last) + "'";
    return out;
  }
  // `patellar_ligament` is no patella: what a word of the name calls something else is that.
  const Group told = group_of(words);
  for (const Words* all : {&words, &fewer}) {
    for (std::size_t count = all->size(); count-- > 1;) {
      const Words begin(all->begin(), all->begin() + static_cast<std::ptrdiff_t>(count));
      if ((out.structure = find(begin, out.confidence)) == nullptr) continue;
      if (told != Group::other && told != out.structure->group) break;
      out.confidence = 0.6;
      out.how = "its name begins with '" + text::joined(begin, "_") + "'";
      return out;
    }
  }
  out.structure = nullptr;
  out.group = told;
  out.confidence = out.group == Group::other ? 0 : 0.5;
  out.how = out.group == Group::other ? "not known" : "a word of its name";
  return out;
}

Side side_of(const CodedName& modifier) {
  if (modifier.value == kLeft) return Side::left;
  if (modifier.value == kRight) return Side::right;
  const std::string meaning = text::lower(modifier.meaning);
  return meaning == "left" ? Side::left : meaning == "right" ? Side::right : Side::both;
}

Recognised by_code(const SegmentCodes& code) {
  Recognised out;
  const bool generic = code.type.value.empty() || among(kGeneric, code.type.value);
  const CodedName& what = generic && !code.region.value.empty() ? code.region : code.type;
  out.side = side_of(code.side);
  if (out.side == Side::both) out.side = side_of(code.region_side);
  const auto found = table().by_code.find(what.value);
  if (found != table().by_code.end()) {
    out.structure = &table().all[found->second];
    out.confidence = 1;
    out.how = "SNOMED " + what.value;
  } else if (!what.meaning.empty()) {
    const Side side = out.side;
    out = by_name(what.meaning);
    if (out.side == Side::both) out.side = side;
    out.how = "the meaning of its code, '" + what.meaning.substr(0, 64) + "'";
  }
  return out;
}

}  // namespace

const std::vector<Structure>& structures() {
  return table().all;
}

Recognised recognise(std::string_view name, const SegmentCodes* code) {
  Recognised named = by_name(name);
  if (code == nullptr) return named;
  Recognised coded = by_code(*code);
  if (coded.structure == nullptr) {
    if (named.side == Side::both) named.side = coded.side;
    return named;
  }
  if (coded.side == Side::both) coded.side = named.side;
  if (named.structure == nullptr || named.structure == coded.structure) return coded;
  // Codes are coarser than names (a phalanx of the hand or of the foot), and users rename what they edit.
  if (named.confidence >= 0.95) {
    if (named.side == Side::both) named.side = coded.side;
    named.how += "; its code says " + coded.structure->name;
    named.confidence = 0.9;
    return named;
  }
  return coded;
}

}  // namespace ecorche::io
