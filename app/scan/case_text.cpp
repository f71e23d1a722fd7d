// SPDX-License-Identifier: Apache-2.0
#include "app/scan/case_text.hpp"

#include <algorithm>
#include <cctype>

#include "core/values/text.hpp"
#include "core/values/utf8.hpp"
#include "io/case/yaml_text.hpp"

namespace ecorche::app {
namespace {

using io::yaml::write_text;
using Role = ScanEntry::Role;

// A word of a shell's line.
std::string shell_word(const std::string& word) {
  const bool plain = !word.empty() && std::all_of(word.begin(), word.end(), [](unsigned char c) {
    return std::isalnum(c) != 0 || c > 0x7f ||
           std::string_view("/._-+=:,@%").find(static_cast<char>(c)) != std::string_view::npos;
  });
  if (plain) return word;
  std::string out = "'";
  for (const char c : word) out += c == '\'' ? "'\\''" : std::string(1, c);
  return out + "'";
}

std::string comments(const char* title, const std::vector<std::string>& lines) {
  if (lines.empty()) return {};
  std::string out = std::string("#\n# ") + title + "\n";
  for (const std::string& line : lines) out += "#   " + text::one_line(line) + "\n";
  return out;
}

std::string sure(const ScanEntry& entry) {
  std::string out = "  # " + text::number(entry.confidence, 2) + ": " + text::one_line(entry.how);
  if (!entry.cut.empty()) out += "; cut by the " + text::joined(entry.cut, " and ") + " border";
  return out + "\n";
}

// How bones and tissues name label `id`: a word of digits would mean the label of that number.
std::string label_word(std::size_t id, const std::string& name) {
  return name.find_first_not_of("0123456789") == name.npos ? std::to_string(id) : write_text(name);
}

}  // namespace

NextCommands next_commands(const std::filesystem::path& folder) {
  std::filesystem::path clean = folder.lexically_normal();
  if (clean.filename().empty()) clean = clean.parent_path();
  const std::string last = clean.filename().string(), word = shell_word(clean.string());
  const bool named = !last.empty() && last != "." && last != "..";
  return {"ecorche check " + word, "ecorche preprocess " + word + " -o " +
                                       shell_word(named ? clean.string() + ".hdf" : "patient.hdf")};
}

std::string case_text(const ScanCase& scan, const std::string& name, const std::filesystem::path& folder,
                      const std::vector<std::string>& from, const std::vector<CaseVolumeFile>& volumes) {
  const NextCommands next = next_commands(folder);
  std::string out = "# Written by `ecorche new` from " + text::one_line(text::joined(from)) + ".\n" +
                    "# Behind each line stands how sure it is, from 0 to 1, and why. picture.png shows it. "
                    "Change what you know\n"
                    "# better (docs/reference/case.md), then:\n#   " +
                    text::one_line(next.check) + "\n#   " + text::one_line(next.preprocess) + "\n";
  out += comments("To be looked at:", scan.doubts);
  out += comments("Also:", scan.notes);
  out += "name: " + write_text(name) + "\n";
  if (scan.parted)
    out += "# human, of bones that a template parted: its joints are as sure as those were right before.\n";
  out += std::string("skeleton: ") + (scan.parted ? "human_parted" : "human") + "\n";
  if (scan.spine == "vertebrae") out += "spine: vertebrae  # a joint at each level\n";
  if (scan.ribs == "vertebrae") out += "ribs: vertebrae   # each moves with its vertebra\n";
  out += "labels:\n  file: labels.nrrd\n  table:\n";
  for (std::size_t e = 0; e < scan.entries.size(); ++e) {
    if (scan.entries[e].voxels > 0)
      out += "    " + std::to_string(e + 1) + ": " + write_text(scan.entries[e].name) + "\n";
  }
  out += "# " + text::number(scan.skin.confidence, 2) + ": " + text::one_line(scan.skin.how) + "\n";
  if (!scan.skin.caps.empty()) {
    out += "# The image ends within the body, where the skin is cut flat. These caps are no skin:\n";
    for (const std::string& cap : scan.skin.caps) out += "#   " + text::one_line(cap) + "\n";
  }
  out += scan.skin.close_mm > 0 ? "skin: {labels: all, close_mm: " + text::number(scan.skin.close_mm) + "}\n"
                                : "skin: {labels: all}\n";
  out += "bones:\n";
  std::string tissues;
  for (std::size_t e = 0; e < scan.entries.size(); ++e) {
    const ScanEntry& entry = scan.entries[e];
    if (entry.role == Role::body || !entry.drawn || entry.voxels == 0) continue;
    const std::string begin =
        "  - {name: " + write_text(entry.name) + ", labels: [" + label_word(e + 1, entry.name) + "], ";
    if (entry.role == Role::bone) {
      out += begin + "segment: " + entry.segment + "}" + sure(entry);
    } else {
      tissues += begin + "group: " + std::string(group_name(entry.group)) + "}" + sure(entry);
    }
  }
  if (!tissues.empty()) out += "tissues:\n" + tissues;
  if (!volumes.empty()) out += "volumes:\n";
  for (const CaseVolumeFile& volume : volumes)
    out += "  - {name: " + volume.name + ", file: " + write_text(volume.file) +
           ", background: " + io::yaml::write_number(volume.background) + "}\n";
  return out;
}

}  // namespace ecorche::app
