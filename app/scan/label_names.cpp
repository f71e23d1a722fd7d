// SPDX-License-Identifier: Apache-2.0
#include "app/scan/label_names.hpp"

#include <algorithm>
#include <set>

#include "core/values/identifier.hpp"

namespace ecorche::app {
namespace {

using io::Structure;
using Becomes = Structure::Becomes;

int rank_of(const Structure* s) {
  if (s == nullptr) return 3;
  switch (s->becomes) {
    case Becomes::bone:
      return s->coarse ? 2 : 1;
    case Becomes::tissue:
      return s->coarse ? 4 : 3;
    case Becomes::background:
      return 5;
    case Becomes::body:
      return 8;
    case Becomes::shell:
    case Becomes::nothing:
      break;
  }
  return 9;
}

std::string with_side(const std::string& name, Side side) {
  return side == Side::both ? name : name + (side == Side::left ? "_left" : "_right");
}

struct Label {
  std::size_t map = 0;
  std::int64_t id = 0;
  std::string name;
  std::size_t voxels = 0;
  io::Recognised meaning;
};

// How many voxels each id has, over all layers.
std::map<std::int64_t, std::size_t> counts(const io::Segmentation& map) {
  std::map<std::int64_t, std::size_t> out;
  for (const Image& layer : map.layers) {
    with_scalar_type(layer.type, [&](auto zero) {
      using T = decltype(zero);
      const auto voxels = layer.scalars<T>();
      for (std::size_t v = 0; v < voxels.size();) {
        const T value = voxels[v];
        const std::size_t begin = v;
        while (v < voxels.size() && voxels[v] == value) ++v;
        if (value != T{}) out[static_cast<std::int64_t>(value)] += v - begin;
      }
    });
  }
  return out;
}

std::vector<Label> all_labels(const Scan& scan) {
  std::vector<Label> out;
  for (std::size_t m = 0; m < scan.labels.size(); ++m) {
    const io::Segmentation& map = scan.labels[m].map;
    for (const auto& [id, count] : counts(map)) {
      Label label{m, id, {}, count, {}};
      const auto name = map.names.find(id);
      label.name = name != map.names.end() ? name->second : "label_" + std::to_string(id);
      const auto code = map.codes.find(id);
      label.meaning = io::recognise(label.name, code != map.codes.end() ? &code->second : nullptr);
      if (const auto guess = scan.labels[m].guesses.find(id); guess != scan.labels[m].guesses.end()) {
        label.meaning.how = guess->second.how;
        label.meaning.confidence = std::min(label.meaning.confidence, guess->second.confidence);
      }
      out.push_back(std::move(label));
    }
  }
  return out;
}

}  // namespace

LabelNames name_labels(const Scan& scan) {
  const std::vector<Label> labels = all_labels(scan);
  std::set<const Structure*> sided;  // limb bones that some map has with sides
  bool mandible = false;
  for (const Label& label : labels) {
    if (label.meaning.structure == nullptr) continue;
    if (label.meaning.side != Side::both) sided.insert(label.meaning.structure);
    mandible = mandible || label.meaning.structure->name == "mandible";
  }
  LabelNames out;
  out.of_map.resize(scan.labels.size());
  out.fate_of.resize(scan.labels.size());
  std::map<std::string, std::size_t> at;  // of each name
  std::vector<std::size_t> first_map;     // of each entry
  std::set<std::string> taken;
  for (const Label& label : labels) {
    const Structure* s = label.meaning.structure;
    LabelFate fate{scan.labels[label.map].path.filename().string(),
                   label.name,
                   label.voxels,
                   {},
                   label.meaning.how,
                   label.meaning.confidence};
    std::size_t entry = LabelNames::no_entry;
    const std::string name =
        s != nullptr ? with_side(s->name, label.meaning.side) : identifier_from(label.name, 56);
    if (s != nullptr && s->becomes == Becomes::nothing) {
      fate.became = "left out: no part of the patient";
    } else if (s != nullptr && s->sided && label.meaning.side == Side::both && sided.contains(s) &&
               std::any_of(labels.begin(), labels.end(), [&](const Label& o) {
                 return o.meaning.structure == s && o.meaning.side != Side::both && o.map != label.map;
               })) {
      fate.became = "left out: another label map has it with sides";
    } else if (const auto known = at.find(name); known != at.end() && first_map[known->second] != label.map &&
                                                 (s == nullptr || s->becomes != Becomes::body)) {
      fate.became =
          "left out: " + scan.labels[first_map[known->second]].path.filename().string() + " comes first";
    } else {
      if (known == at.end()) {
        Named named;
        named.name = name.empty() || name == "skin" ? "label_" + std::to_string(label.id) : name;
        if (s != nullptr && s->becomes == Becomes::shell) named.name = "skin_shell";
        if (!taken.insert(named.name).second) named.name += "_" + std::to_string(out.named.size() + 1);
        taken.insert(named.name);
        named.structure = s;
        named.side = label.meaning.side;
        named.group = s != nullptr ? s->group : label.meaning.group;
        named.how = label.meaning.how;
        named.confidence = label.meaning.confidence;
        named.rank = rank_of(s);
        entry = out.named.size();
        at.emplace(name, entry);
        first_map.push_back(label.map);
        out.named.push_back(std::move(named));
      } else {
        entry = known->second;
        out.named[entry].confidence = std::min(out.named[entry].confidence, label.meaning.confidence);
      }
    }
    out.of_map[label.map].emplace(label.id, entry);
    out.fate_of[label.map].emplace(label.id, out.fates.size());
    out.fates.push_back(std::move(fate));
  }
  // Teeth move with the jaw where there is one.
  if (!mandible) {
    static const Structure upper = [] {
      const auto found = std::find_if(io::structures().begin(), io::structures().end(),
                                      [](const Structure& s) { return s.name == "teeth_upper"; });
      return *found;
    }();
    for (Named& named : out.named) {
      if (named.structure != nullptr && named.structure->name == "teeth_lower") named.structure = &upper;
    }
  }
  return out;
}

}  // namespace ecorche::app
