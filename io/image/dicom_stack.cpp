// SPDX-License-Identifier: Apache-2.0
#include "io/image/dicom_stack.hpp"

#include <algorithm>
#include <cmath>
#include <map>

#include "core/values/text.hpp"
#include "io/image/header_fields.hpp"

namespace ecorche::io::dicom {
namespace {

using fields::refuse;
namespace fs = std::filesystem;

constexpr std::size_t kMostStacks = 1000, kListed = 12;
constexpr double kSameWay = 1e-3;  // difference of unit vectors: 0.06 degrees

bool alike(const Slice& a, const Slice& b) {
  for (std::size_t k = 0; k < 3; ++k) {
    if (std::abs(a.right[k] - b.right[k]) > kSameWay || std::abs(a.down[k] - b.down[k]) > kSameWay)
      return false;
  }
  for (std::size_t k = 0; k < 2; ++k) {
    if (std::abs(a.spacing[k] - b.spacing[k]) > 1e-4 * a.spacing[k]) return false;
  }
  return a.file->pixels == b.file->pixels && a.stack == b.stack && a.file->localizer == b.file->localizer;
}

std::string described(const Stack& stack) {
  const SliceFile& file = *stack.slices.front().file;
  return stack.name + (file.description.empty() ? "" : " '" + file.description.substr(0, 64) + "'") + " " +
         file.modality + " " + std::to_string(file.pixels.columns) + " x " +
         std::to_string(file.pixels.rows) + " x " + std::to_string(stack.slices.size());
}

std::string listed(const std::vector<Stack>& stacks) {
  std::string out;
  for (std::size_t i = 0; i < std::min(stacks.size(), kListed); ++i)
    out += (i > 0 ? "; " : "") + described(stacks[i]);
  if (stacks.size() > kListed) out += "; and " + std::to_string(stacks.size() - kListed) + " more";
  return out;
}

bool is_meant(const Stack& stack, const std::string& series) {
  const SliceFile& file = *stack.slices.front().file;
  return stack.name == series || file.series == series || file.description == series ||
         stack.name.ends_with("." + series);
}

}  // namespace

std::vector<Stack> stacks_of(std::vector<Slice> slices, const fs::path& path) {
  std::map<std::string, std::vector<Stack>> series;
  std::size_t count = 0;
  for (Slice& slice : slices) {
    std::vector<Stack>& stacks = series[slice.file->series];
    const auto known = std::find_if(stacks.begin(), stacks.end(),
                                    [&](const Stack& one) { return alike(one.slices.front(), slice); });
    if (known != stacks.end()) {
      known->slices.push_back(std::move(slice));
      continue;
    }
    if (++count > kMostStacks) refuse(path, "holds more than 1000 series", "name a smaller folder");
    Stack fresh{slice.file->series, {}};
    fresh.slices.push_back(std::move(slice));
    stacks.push_back(std::move(fresh));
  }
  std::vector<Stack> out;
  for (auto& [uid, stacks] : series) {
    // The largest is the one that is meant by the series' own name.
    std::stable_sort(stacks.begin(), stacks.end(),
                     [](const Stack& a, const Stack& b) { return a.slices.size() > b.slices.size(); });
    for (std::size_t i = 0; i < stacks.size(); ++i) {
      if (i > 0) stacks[i].name += "/" + std::to_string(i + 1);
      out.push_back(std::move(stacks[i]));
    }
  }
  return out;
}

Stack chosen_stack(std::vector<Stack> stacks, const std::string& series, const fs::path& path) {
  const std::string all = listed(stacks);
  const std::string how = "take one by --series, in a case by series:, with its UID or description";
  const auto drop = [&](auto&& unwanted) {
    stacks.erase(std::remove_if(stacks.begin(), stacks.end(), unwanted), stacks.end());
  };
  if (!series.empty()) {
    const auto exact =
        std::find_if(stacks.begin(), stacks.end(), [&](const Stack& one) { return one.name == series; });
    if (exact != stacks.end()) return std::move(*exact);
    drop([&](const Stack& one) { return !is_meant(one, series); });
    if (stacks.empty()) refuse(path, "has no series '" + series.substr(0, 64) + "', but " + all, how);
  }
  if (std::any_of(stacks.begin(), stacks.end(),
                  [](const Stack& one) { return !one.slices.front().file->localizer; }))
    drop([](const Stack& one) { return one.slices.front().file->localizer; });
  if (stacks.size() > 1)
    refuse(path, "holds " + std::to_string(stacks.size()) + " series: " + listed(stacks), how);
  return std::move(stacks.front());
}

}  // namespace ecorche::io::dicom
