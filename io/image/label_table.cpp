// SPDX-License-Identifier: Apache-2.0
#include "io/image/label_table.hpp"

#include <algorithm>
#include <charconv>
#include <optional>
#include <set>
#include <vector>

#include "core/files/atomic_file.hpp"
#include "core/values/identifier.hpp"
#include "core/values/text.hpp"
#include "io/image/header_fields.hpp"
#include "io/image/label_json.hpp"

namespace ecorche::io {
namespace {

using Path = std::filesystem::path;

constexpr std::size_t kLargestTable = std::size_t{16} << 20;

std::optional<std::int64_t> whole(std::string_view word) {
  std::int64_t value = 0;
  const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), value);
  if (word.empty() || error != std::errc() || end != word.data() + word.size()) return std::nullopt;
  return value;
}

class TableReader {
 public:
  explicit TableReader(const Path& path) : path_(path), text_(files::read_text(path, kLargestTable)) {
    if (text_.find('\0') != text_.npos) fields::refuse(path_, "is no text", "give a table of labels");
    if (text_.starts_with("\xef\xbb\xbf")) text_.erase(0, 3);
  }

  LabelNames read() {
    const std::string ending = text::lower(path_.extension().string());
    if (ending == ".tsv") {
      read_tsv();
    } else if (ending == ".ctbl" || ending == ".txt" || ending == ".label") {
      for (std::string_view line; next(line);) {
        line = text::trim(line);
        if (line.empty() || line.front() == '#') continue;
        const bool quoted = line.back() == '"' && line.find('"') != line.size() - 1;
        quoted ? read_snap(line) : read_slicer(line);
      }
    } else {
      fields::refuse(path_, "'" + ending + "' tables cannot be read",
                     "use .ctbl, .tsv, .json, or .txt as ITK-SNAP writes it");
    }
    if (names_.empty()) fields::refuse(path_, "names no label", "give a table of labels");
    names_.erase(0);
    return make_identifiers(names_);
  }

 private:
  bool next(std::string_view& line) {
    if (at_ >= text_.size()) return false;
    const std::size_t end = std::min(text_.find('\n', at_), text_.size());
    line = std::string_view(text_).substr(at_, end - at_);
    if (line.ends_with('\r')) line.remove_suffix(1);
    at_ = end + 1;
    ++number_;
    return true;
  }
  [[noreturn]] void fail(std::string what, std::string mend) const {
    throw Error(ErrorKind::data, path_.string() + ":" + std::to_string(number_), std::move(what),
                std::move(mend));
  }
  void add(std::string_view id, std::string_view name) {
    const auto number = whole(id);
    if (!number) fail("'" + std::string(id.substr(0, 40)) + "' is no label id", "ids are whole numbers");
    if (!names_.emplace(*number, name).second) fail("label " + std::string(id) + " stands twice", "keep one");
  }
  void check_numbers(const std::vector<std::string_view>& words, std::size_t from, std::size_t to,
                     const char* expected) const {
    for (std::size_t i = from; i < to; ++i) {
      double value = 0;
      const auto [end, error] = std::from_chars(words[i].data(), words[i].data() + words[i].size(), value);
      if (error != std::errc() || end != words[i].data() + words[i].size())
        fail("'" + std::string(words[i].substr(0, 40)) + "' is no colour", expected);
    }
  }

  // id r g b a visible mesh "name"
  void read_snap(std::string_view line) {
    constexpr const char* expected = "a line is: id r g b a visible mesh \"name\"";
    const std::size_t quote = line.find('"');
    const auto words = text::words(line.substr(0, quote));
    if (words.size() != 7) fail("has " + std::to_string(words.size()) + " numbers before its name", expected);
    check_numbers(words, 1, 7, expected);
    add(words[0], line.substr(quote + 1, line.size() - quote - 2));
  }

  // id name r g b a; a name may hold spaces.
  void read_slicer(std::string_view line) {
    constexpr const char* expected = "a line is: id name r g b a";
    const auto words = text::words(line);
    if (words.size() < 6) fail("has " + std::to_string(words.size()) + " columns", expected);
    check_numbers(words, words.size() - 4, words.size(), expected);
    const std::string_view first = words[1], last = words[words.size() - 5];
    add(words[0],
        std::string_view(first.data(), static_cast<std::size_t>(last.data() + last.size() - first.data())));
  }

  static std::vector<std::string_view> cells(std::string_view line) {
    std::vector<std::string_view> out;
    while (true) {
      const std::size_t tab = line.find('\t');
      out.push_back(text::trim(line.substr(0, tab)));
      if (tab == line.npos) return out;
      line.remove_prefix(tab + 1);
    }
  }

  void read_tsv() {
    std::string_view line;
    if (!next(line)) fields::refuse(path_, "is empty", "give a table of labels");
    const auto heads = cells(line);
    const auto column = [&](std::initializer_list<std::string_view> known) {
      for (std::size_t c = 0; c < heads.size(); ++c) {
        const std::string head = text::lower(heads[c]);
        if (std::find(known.begin(), known.end(), head) != known.end()) return c;
      }
      fail("has no column '" + std::string(*known.begin()) + "'",
           "its first line names the columns, with tabs between");
    };
    const std::size_t id = column({"index", "id", "label", "value"}),
                      name = column({"name", "structure", "abbreviation"});
    while (next(line)) {
      if (text::trim(line).empty()) continue;
      const auto row = cells(line);
      if (row.size() <= std::max(id, name))
        fail("has " + std::to_string(row.size()) + " columns", "one for every head");
      add(row[id], row[name]);
    }
  }

  const Path& path_;
  std::string text_;
  std::size_t at_ = 0, number_ = 0;
  std::map<std::int64_t, std::string> names_;
};

}  // namespace

LabelNames make_identifiers(const std::map<std::int64_t, std::string>& names) {
  LabelNames out;
  std::set<std::string> taken;
  for (const auto& [id, name] : names) {
    std::string made = identifier_from(name);
    const std::string number =
        (id < 0 ? "minus_" : "") + std::to_string(id < 0 ? -(id + 1) + 1ULL : static_cast<std::uint64_t>(id));
    if (made.empty()) made = "label_" + number;
    if (taken.contains(made)) {
      made.resize(std::min(made.size(), longest_identifier - number.size() - 1));
      made += "_" + number;
    }
    // Whoever names things so that even this is taken gets the bare id.
    if (taken.contains(made)) made = "label_" + number;
    for (int again = 2; taken.contains(made); ++again) made = "label_" + number + "_" + std::to_string(again);
    taken.insert(made);
    out.emplace(id, std::move(made));
  }
  return out;
}

LabelNames read_label_table(const Path& path) {
  if (text::lower(path.extension().string()) == ".json") return make_identifiers(read_label_json(path).names);
  return TableReader(path).read();
}

}  // namespace ecorche::io
