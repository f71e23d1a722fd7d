// SPDX-License-Identifier: Apache-2.0
#include "io/image/label_json.hpp"

#include <charconv>
#include <nlohmann/json.hpp>
#include <optional>

#include "core/files/atomic_file.hpp"
#include "io/image/header_fields.hpp"

namespace ecorche::io {
namespace {

using nlohmann::json;
constexpr std::size_t kLargestJson = std::size_t{4} << 20;
constexpr int kDeepest = 16;

std::optional<std::int64_t> whole(const std::string& word) {
  std::int64_t value = 0;
  const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), value);
  if (word.empty() || error != std::errc() || end != word.data() + word.size()) return std::nullopt;
  return value;
}

// A code as a word, a number, or an object that has it under one of its usual keys.
std::string code_in(const json& value) {
  if (value.is_string()) return value.get<std::string>();
  if (value.is_number_unsigned()) return std::to_string(value.get<std::uint64_t>());
  for (const char* key : {"code", "Code", "value", "CodeValue"}) {
    if (value.is_object() && value.contains(key)) return code_in(value[key]);
  }
  return {};
}

void add(JsonLabels& out, std::int64_t id, const json& value) {
  if (id == 0) return;
  if (value.is_string()) {
    out.names.emplace(id, value.get<std::string>());
  } else if (value.is_object() && value.contains("name") && value["name"].is_string()) {
    out.names.emplace(id, value["name"].get<std::string>());
    if (!value.contains("SNOMED")) return;
    const std::string code = code_in(value["SNOMED"]);
    if (whole(code)) out.codes[id].type = {"SCT", code, ""};
  }
}

}  // namespace

JsonLabels read_label_json(const std::filesystem::path& path) {
  const std::string text = files::read_text(path, kLargestJson);
  const auto bounded = [](int depth, json::parse_event_t, json&) {
    return depth <= kDeepest;  // what lies deeper is dropped
  };
  const json file = json::parse(text, bounded, false);
  if (file.is_discarded() || !file.is_object())
    fields::refuse(path, "is no JSON of labels",
                   "give MOOSE's organ_indices.json, or {\"1\": \"femur_left\"}");
  const json* table = &file;
  for (const char* key : {"organ_indices", "labels"}) {
    if (file.contains(key) && file[key].is_object()) table = &file[key];
  }
  JsonLabels out;
  for (const auto& [key, value] : table->items()) {
    if (const auto id = whole(key)) {
      add(out, *id, value);
    } else if (value.is_number_integer()) {  // nnU-Net has them the other way round
      add(out, value.get<std::int64_t>(), json(key));
    }
  }
  if (out.names.empty())
    fields::refuse(path, "names no label", "give MOOSE's organ_indices.json, or {\"1\": \"femur_left\"}");
  return out;
}

}  // namespace ecorche::io
