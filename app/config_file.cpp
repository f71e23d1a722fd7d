// SPDX-License-Identifier: Apache-2.0
#include "app/config_file.hpp"

#include <algorithm>
#include <set>
#include <string_view>
#include <utility>
#include <vector>

#include "app/cli.hpp"
#include "app/nan_value.hpp"
#include "io/case/yaml_reader.hpp"

namespace ecorche::app {
namespace {

using io::yaml::Value;

// About the command line or the file itself.
const std::set<std::string> kNoKeys{"help", "config", "check-config"};

std::string key_of(std::string name) {
  std::replace(name.begin(), name.end(), '-', '_');
  return name;
}

// Every option that a file may set, by its key.
std::vector<std::pair<std::string, CLI::Option*>> keys_of(CLI::App& command) {
  std::vector<std::pair<std::string, CLI::Option*>> keys;
  for (CLI::Option* option : command.get_options()) {
    const std::string name = option->get_positional() ? option->get_name() : option->get_lnames().front();
    if (!kNoKeys.contains(name)) keys.emplace_back(key_of(name), option);
  }
  // Of the whole program's, the one that is no matter of how it was called.
  if (CLI::App* const program = command.get_parent())
    if (CLI::Option* const threads = program->get_option_no_throw("--threads"))
      keys.emplace_back("threads", threads);
  return keys;
}

bool is_flag(const CLI::Option& option) {
  return option.get_items_expected_max() == 0;
}

bool read_flag(const Value& value) {
  if (value.text() == "true") return true;
  if (value.text() != "false")
    value.fail("'" + value.text() + "' is neither true nor false", "write one of the two");
  return false;
}

std::vector<std::string> texts_of(const Value& value, const CLI::Option& option) {
  if (value.kind() != io::yaml::Kind::list) return {value.text()};
  if (option.get_items_expected_max() <= 1) value.fail("a list, where one value belongs", "give one value");
  std::vector<std::string> texts;
  for (const Value& item : value.items()) texts.push_back(item.text());
  if (texts.empty()) value.fail("an empty list", "leave the key out, or give values");
  return texts;
}

void take_value(const Value& value, CLI::Option& option) {
  for (std::string& text : texts_of(value, option)) option.add_result(std::move(text));
  try {
    option.run_callback();
  } catch (const CLI::ParseError& error) {
    value.fail(error.what(), "see --help");
  }
  if (const std::string* nan = nan_value(option)) value.fail("'" + *nan + "' is no number", "see --help");
}

}  // namespace

void take_config(CLI::App& command, const std::string& path) {
  const Value file = Value::read(path);
  const auto keys = keys_of(command);
  std::vector<std::string_view> known;
  known.reserve(keys.size());
  for (const auto& [key, option] : keys) known.emplace_back(key);
  file.allow(known);

  const auto said = [](const CLI::Option* option) { return option->count() > 0; };
  std::set<const CLI::Option*> by_command_line;
  for (const auto& [key, option] : keys)
    if (said(option)) by_command_line.insert(option);
  const auto goes_before = [&](const CLI::Option* option) { return by_command_line.contains(option); };

  for (const auto& [key, option] : keys) {
    const auto value = file.find(key);
    if (!value || goes_before(option)) continue;
    if (is_flag(*option) && !read_flag(*value)) continue;
    const auto excludes = option->get_excludes();
    if (std::any_of(excludes.begin(), excludes.end(), goes_before)) continue;
    const auto other = std::find_if(excludes.begin(), excludes.end(), said);
    if (other != excludes.end())
      value->fail("goes not together with " + key_of((*other)->get_lnames().front()),
                  "leave one of them out");
    take_value(*value, *option);
  }
}

}  // namespace ecorche::app
