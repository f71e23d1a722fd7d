// SPDX-License-Identifier: Apache-2.0
#include "io/case/yaml_reader.hpp"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <numbers>

#include <ecorche/values/error.hpp>
#include "core/files/atomic_file.hpp"
#include "core/values/identifier.hpp"
#include "io/case/yaml_tree.hpp"

namespace ecorche::io::yaml {

struct Value::Document {
  std::string file;
  Node root;
};

namespace {

std::string_view kind_name(Kind kind) {
  switch (kind) {
    case Kind::null:
      return "nothing";
    case Kind::scalar:
      return "a plain value";
    case Kind::list:
      return "a list";
    case Kind::map:
      break;
  }
  return "a map";
}

std::string shown(std::string_view text) {
  return "'" + std::string(text.substr(0, 60)) + (text.size() > 60 ? "...'" : "'");
}

// Numbers as YAML writes them: from_chars, and a leading plus.
template <class T>
bool parse_number(std::string_view text, T& out) {
  if (text.starts_with('+')) text.remove_prefix(1);
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), out);
  return !text.empty() && error == std::errc() && end == text.data() + text.size();
}

// Letters to insert, drop, change or swap with their neighbour.
std::size_t edit_distance(std::string_view a, std::string_view b) {
  std::vector<std::size_t> before, last(b.size() + 1), row(b.size() + 1);
  for (std::size_t j = 0; j <= b.size(); ++j) last[j] = j;
  for (std::size_t i = 1; i <= a.size(); ++i) {
    row[0] = i;
    for (std::size_t j = 1; j <= b.size(); ++j) {
      row[j] = std::min({last[j] + 1, row[j - 1] + 1, last[j - 1] + (a[i - 1] != b[j - 1])});
      if (i > 1 && j > 1 && a[i - 1] == b[j - 2] && a[i - 2] == b[j - 1])
        row[j] = std::min(row[j], before[j - 2] + 1);
    }
    before = last;
    last = row;
  }
  return last[b.size()];
}

}  // namespace

std::string nearest(std::string_view word, std::span<const std::string> known) {
  std::string best;
  std::size_t least = std::max<std::size_t>(1, word.size() / 3) + 1;
  if (word.size() > 64) return best;
  for (const std::string& other : known) {
    if (other.size() > 64) continue;
    const std::size_t distance = edit_distance(word, other);
    if (distance < least) {
      least = distance;
      best = other;
    }
  }
  return best;
}

Value Value::parse(const std::string& text, const std::string& file) {
  auto document = std::make_shared<Document>(Document{file, parse_tree(text, file)});
  const Node* root = &document->root;
  return {std::move(document), root, ""};
}

Value Value::read(const std::filesystem::path& path) {
  return parse(files::read_text(path, largest_file), path.string());
}

std::string Value::where() const {
  return document_->file + ":" + std::to_string(node_->line) + (path_.empty() ? "" : ":" + path_);
}

void Value::fail(std::string what, std::string mend) const {
  constexpr std::size_t most = 300;  // a value may be as long as its file
  if (what.size() > most) what = what.substr(0, most) + "...";
  throw Error(ErrorKind::config, where(), std::move(what), std::move(mend));
}

void Value::fail_unknown(std::string_view what, std::string_view word, std::span<const std::string> known,
                         std::string_view why) const {
  std::string mend;
  if (const std::string near = nearest(word, known); !near.empty()) {
    mend = "did you mean '" + near + "'?";
  } else if (known.empty()) {
    mend = "none is known here";
  } else {
    mend = "use ";
    for (std::size_t i = 0; i < known.size() && i < 24; ++i) mend += (i ? ", " : "") + known[i];
    if (known.size() > 24) mend += ", ...";
    if (!why.empty()) mend += "; " + std::string(why);
  }
  fail("unknown " + std::string(what) + " " + shown(word), mend);
}

std::string Value::path_of(std::string_view key) const {
  const std::string shown_key(key.substr(0, 64));
  return path_.empty() ? shown_key : path_ + "." + shown_key;
}

void Value::expect(Kind kind, std::string_view example) const {
  if (node_->kind == kind) return;
  const std::string value =
      node_->kind == Kind::scalar ? shown(node_->scalar) : std::string(kind_name(node_->kind));
  fail("must be " + std::string(kind_name(kind)) + ", is " + value, "write it as " + std::string(example));
}

void Value::allow(std::span<const std::string_view> keys) const {
  expect(Kind::map, "{key: value}");
  for (const auto& [key, value] : pairs()) {
    if (std::find(keys.begin(), keys.end(), key) != keys.end()) continue;
    const std::vector<std::string> known(keys.begin(), keys.end());
    value.fail_unknown("key", key, known);
  }
}

std::optional<Value> Value::find(std::string_view key) const {
  expect(Kind::map, "{key: value}");
  const auto found = std::find(node_->keys.begin(), node_->keys.end(), key);
  if (found == node_->keys.end()) return std::nullopt;
  return child(node_->items[static_cast<std::size_t>(found - node_->keys.begin())], path_of(key));
}

Value Value::at(std::string_view key) const {
  if (auto value = find(key)) return *value;
  fail("lacks the key '" + std::string(key) + "'", "add it");
}

std::vector<std::pair<std::string, Value>> Value::pairs() const {
  expect(Kind::map, "{key: value}");
  std::vector<std::pair<std::string, Value>> out;
  for (std::size_t i = 0; i < node_->keys.size(); ++i) {
    out.emplace_back(node_->keys[i], child(node_->items[i], path_of(node_->keys[i])));
  }
  return out;
}

std::vector<Value> Value::items() const {
  expect(Kind::list, "[a, b, ...]");
  std::vector<Value> out;
  for (std::size_t i = 0; i < node_->items.size(); ++i) {
    out.push_back(child(node_->items[i], path_ + "[" + std::to_string(i) + "]"));
  }
  return out;
}

const std::string& Value::text() const {
  expect(Kind::scalar, "a word or a text in quotes");
  if (node_->scalar.empty()) fail("is empty", "write a word");
  return node_->scalar;
}

const std::string& Value::identifier() const {
  if (!is_identifier(text())) {
    fail(shown(node_->scalar) + " is no identifier", "use 1 to 64 of a-z, 0-9 and _");
  }
  return node_->scalar;
}

double Value::number() const {
  double value = 0;
  if (!parse_number(text(), value) || !std::isfinite(value)) {
    fail("must be a number, is " + shown(node_->scalar), "write a finite number");
  }
  return value;
}

std::int64_t Value::integer() const {
  std::int64_t value = 0;
  if (!parse_number(text(), value))
    fail("must be a whole number, is " + shown(node_->scalar), "write a whole number");
  return value;
}

double Value::degrees() const {
  number();  // the refusals
  // Extended precision, rounded once: what `write_degrees` writes comes back as the same double.
  long double value = 0;
  parse_number(std::string_view(node_->scalar), value);
  return static_cast<double>(value * (std::numbers::pi_v<long double> / 180));
}

void Value::read_numbers(std::span<double> out) const {
  expect(Kind::list, "a list of " + std::to_string(out.size()) + " numbers");
  if (node_->items.size() != out.size()) {
    fail("has " + std::to_string(node_->items.size()) + " values",
         "write " + std::to_string(out.size()) + " numbers");
  }
  const auto values = items();
  for (std::size_t i = 0; i < out.size(); ++i) out[i] = values[i].number();
}

}  // namespace ecorche::io::yaml
