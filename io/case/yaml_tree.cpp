// SPDX-License-Identifier: Apache-2.0
// yaml-cpp's events into our own tree: its Node would expand aliases (a few lines can become billions of
// nodes), lets the second of two equal keys win, and forgets where a key stood.
#include "io/case/yaml_tree.hpp"

#include <yaml-cpp/eventhandler.h>
#include <yaml-cpp/yaml.h>

#include <set>
#include <sstream>

#include <ecorche/values/error.hpp>

namespace ecorche::io::yaml {
namespace {

class TreeBuilder final : public YAML::EventHandler {
 public:
  explicit TreeBuilder(const std::string& file) : file_(file) {}

  void OnDocumentStart(const YAML::Mark&) override {}
  void OnDocumentEnd() override {}
  void OnNull(const YAML::Mark& mark, YAML::anchor_t anchor) override { add(Kind::null, mark, anchor); }
  void OnAlias(const YAML::Mark&, YAML::anchor_t) override {}  // its anchor came before, and was refused
  void OnScalar(const YAML::Mark& mark, const std::string& tag, YAML::anchor_t anchor,
                const std::string& value) override {
    check_tag(mark, tag);
    if (awaits_key()) {
      check(mark, anchor);
      take_key(mark, value);
      return;
    }
    // An unquoted nothing is a null to yaml-cpp only where the value is absent; the words for it are ours to
    // know.
    const bool null = tag == "?" && (value == "~" || value == "null");
    Node& node = add(null ? Kind::null : Kind::scalar, mark, anchor);
    if (!null) node.scalar = value;
  }
  void OnSequenceStart(const YAML::Mark& mark, const std::string& tag, YAML::anchor_t anchor,
                       YAML::EmitterStyle::value) override {
    check_tag(mark, tag);
    open(Kind::list, mark, anchor);
  }
  void OnSequenceEnd() override { close(); }
  void OnMapStart(const YAML::Mark& mark, const std::string& tag, YAML::anchor_t anchor,
                  YAML::EmitterStyle::value) override {
    check_tag(mark, tag);
    open(Kind::map, mark, anchor);
  }
  void OnMapEnd() override { close(); }

  Node take() { return std::move(root_); }

 private:
  // A list or map that is being filled. It lives in its parent's vector, which grows only while it is not
  // open.
  struct Open {
    Node* node;
    bool has_key = false;
    std::set<std::string> seen = {};
  };

  [[noreturn]] void fail(const YAML::Mark& mark, std::string what, std::string mend) const {
    throw Error(ErrorKind::config, file_ + ":" + std::to_string(mark.line + 1), std::move(what),
                std::move(mend));
  }
  void check(const YAML::Mark& mark, YAML::anchor_t anchor) {
    if (anchor != YAML::NullAnchor) fail(mark, "an anchor (&name)", "write the value out");
    if (++nodes_ > most_nodes) fail(mark, "more than a million values", "this file is not what it should be");
  }
  void check_tag(const YAML::Mark& mark, const std::string& tag) const {
    if (!tag.empty() && tag != "?" && tag != "!") fail(mark, "a tag (" + tag + ")", "leave it out");
  }
  bool awaits_key() const {
    return !open_.empty() && open_.back().node->kind == Kind::map && !open_.back().has_key;
  }
  void take_key(const YAML::Mark& mark, const std::string& key) {
    if (!open_.back().seen.insert(key).second) {
      fail(mark, "the key '" + key + "' stands twice", "keep one of them");
    }
    Node& map = *open_.back().node;
    map.keys.push_back(key);
    map.items.emplace_back().line = mark.line + 1;
    open_.back().has_key = true;
  }
  Node& add(Kind kind, const YAML::Mark& mark, YAML::anchor_t anchor) {
    check(mark, anchor);
    if (awaits_key())
      fail(mark, "a key that is no plain word", "keys are words; is a { or [ before this line not closed?");
    Node* node = &root_;
    bool under_key = false;
    if (!open_.empty()) {
      Open& top = open_.back();
      under_key = top.node->kind == Kind::map;
      node = under_key ? &top.node->items.back() : &top.node->items.emplace_back();
      top.has_key = false;
    }
    node->kind = kind;
    if (!under_key) node->line = mark.line + 1;  // else the line of its key
    return *node;
  }
  void open(Kind kind, const YAML::Mark& mark, YAML::anchor_t anchor) {
    if (open_.size() >= most_depth) fail(mark, "nested deeper than 64", "this file is not what it should be");
    Node& node = add(kind, mark, anchor);
    open_.push_back({&node});
  }
  void close() { open_.pop_back(); }

  const std::string& file_;
  Node root_;
  std::vector<Open> open_;
  std::size_t nodes_ = 0;
};

}  // namespace

Node parse_tree(const std::string& text, const std::string& file) {
  TreeBuilder builder(file);
  try {
    std::istringstream stream(text);
    YAML::Parser parser(stream);
    if (!parser.HandleNextDocument(builder))
      throw Error(ErrorKind::config, file, "is empty", "see docs/reference/case.md");
    TreeBuilder second(file);
    if (parser.HandleNextDocument(second)) {
      throw Error(ErrorKind::config, file, "holds more than one document", "keep one, without '---'");
    }
  } catch (const YAML::Exception& error) {
    const std::string line = error.mark.is_null() ? "" : ":" + std::to_string(error.mark.line + 1);
    throw Error(ErrorKind::config, file + line, "is no YAML: " + error.msg, "mend the line");
  }
  return builder.take();
}

}  // namespace ecorche::io::yaml
