// SPDX-License-Identifier: Apache-2.0
// A small checked YAML reader that knows file, line and key path of everything it hands out, so that every
// mistake is told as `case.yaml:12:bones[3].segment: WHAT (HOW TO MEND)`.
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <initializer_list>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <Eigen/Core>

namespace ecorche::io::yaml {

inline constexpr std::size_t largest_file = std::size_t{16} << 20;
inline constexpr std::size_t most_nodes = 1'000'000;
inline constexpr std::size_t most_depth = 64;

enum class Kind : std::uint8_t { null, scalar, list, map };

/// One node of the tree as parsed.
struct Node {
  Kind kind = Kind::null;
  int line = 0;  ///< from 1
  std::string scalar;
  std::vector<std::string> keys;  ///< of a map, in file order
  std::vector<Node> items;        ///< of a list, or the values of a map
};

/// A node with its place. Cheap to copy; keeps the whole tree alive. Every member that reads throws
/// Error{config}.
class Value {
 public:
  /// Parses `text`: one document without anchors, aliases or keys given twice, within the bounds above.
  static Value parse(const std::string& text, const std::string& file);
  /// Reads and parses a file. Throws Error{missing_input} when it cannot be opened.
  static Value read(const std::filesystem::path& path);

  Kind kind() const { return node_->kind; }
  int line() const { return node_->line; }
  const std::string& path() const { return path_; }
  /// `file:line:path`, as errors begin.
  std::string where() const;

  /// Refuses what is not a map with only these keys, suggesting the nearest for a misspelt one.
  void allow(std::span<const std::string_view> keys) const;
  /// The value under `key`; refuses its absence.
  Value at(std::string_view key) const;
  /// The value under `key`, or nothing. Refuses what is not a map.
  std::optional<Value> find(std::string_view key) const;
  /// A map's keys and values in file order.
  std::vector<std::pair<std::string, Value>> pairs() const;
  /// A list's items.
  std::vector<Value> items() const;

  const std::string& text() const;        ///< a scalar, not empty
  const std::string& identifier() const;  ///< [a-z0-9_]{1,64}
  double number() const;                  ///< finite
  std::int64_t integer() const;
  double degrees() const;  ///< in radians, rounded once
  template <std::size_t N>
  std::array<double, N> numbers() const {
    std::array<double, N> out{};
    read_numbers(out);
    return out;
  }

  [[noreturn]] void fail(std::string what, std::string mend) const;
  /// Fails for an unknown word among `known`: suggests the nearest, or lists them, with why it may be
  /// missing.
  [[noreturn]] void fail_unknown(std::string_view what, std::string_view word,
                                 std::span<const std::string> known, std::string_view why = {}) const;

 private:
  struct Document;
  Value(std::shared_ptr<const Document> document, const Node* node, std::string path)
      : document_(std::move(document)), node_(node), path_(std::move(path)) {}
  Value child(const Node& node, std::string path) const { return {document_, &node, std::move(path)}; }
  std::string path_of(std::string_view key) const;
  void expect(Kind kind, std::string_view example) const;
  void read_numbers(std::span<double> out) const;

  std::shared_ptr<const Document> document_;
  const Node* node_;
  std::string path_;
};

/// Three numbers.
inline Eigen::Vector3d vector(const Value& value) {
  const auto [x, y, z] = value.numbers<3>();
  return {x, y, z};
}

/// The word of `known` nearest to `word`, or empty where none is near.
std::string nearest(std::string_view word, std::span<const std::string> known);

}  // namespace ecorche::io::yaml
