// SPDX-License-Identifier: Apache-2.0
// Ours, since assimp's reader works in float32 (up to 7e-5 degrees off on the CMU clips) and needs a guard
// that reads as strictly as this. The tests ask assimp for a second opinion on every rotation order.
#include "io/motion/bvh_parser.hpp"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <set>

#include "core/values/error.hpp"

namespace ecorche::io::bvh {
namespace {

constexpr std::size_t kMostJoints = 4096, kMostDepth = 256;
constexpr std::size_t kMostRotations = std::size_t{1} << 26;

class Parser {
 public:
  Parser(std::string_view text, const std::string& where) : text_(text), where_(where) {}

  File parse() {
    expect("HIERARCHY");
    expect("ROOT");
    hierarchy();
    expect("MOTION");
    motion();
    return std::move(file_);
  }

 private:
  [[noreturn]] void fail(std::string what, std::string mend = "export the motion again") const {
    throw Error(ErrorKind::data, where_ + ":" + std::to_string(line_), std::move(what), std::move(mend));
  }
  [[noreturn]] void unexpected(std::string_view expected, std::string_view word) const {
    fail("expected " + std::string(expected) +
         (word.empty() ? ", the file ends" : ", found '" + std::string(word.substr(0, 40)) + "'"));
  }
  static bool space(char c) { return c == ' ' || (c >= '\t' && c <= '\r'); }

  void skip_spaces() {
    while (at_ < text_.size() && space(text_[at_])) line_ += text_[at_++] == '\n';
  }
  std::string_view word() {
    skip_spaces();
    const std::size_t begin = at_;
    while (at_ < text_.size() && !space(text_[at_])) ++at_;
    return text_.substr(begin, at_ - begin);
  }
  void expect(std::string_view expected) {
    const std::string_view met = word();
    if (met != expected) unexpected("'" + std::string(expected) + "'", met);
  }
  double number() {
    std::string_view met = word();
    const std::string_view shown = met;
    if (met.starts_with('+')) met.remove_prefix(1);
    double value = 0;
    const auto [end, error] = std::from_chars(met.data(), met.data() + met.size(), value);
    if (met.empty() || error == std::errc::invalid_argument || end != met.data() + met.size())
      unexpected("a number", shown);
    // Out of range is either far too small, which is zero, or far too large.
    if (error == std::errc::result_out_of_range)
      value = met.find("e-") != met.npos || met.find("E-") != met.npos ? 0 : INFINITY;
    if (!(std::abs(value) <= 1e9))
      fail("the number " + std::string(shown.substr(0, 40)) + " is not finite or far too large");
    return value;
  }
  std::size_t count(std::size_t most) {
    const std::string_view met = word();
    std::size_t value = 0;
    const auto [end, error] = std::from_chars(met.data(), met.data() + met.size(), value);
    if (met.empty() || error != std::errc() || end != met.data() + met.size() || value > most) {
      unexpected("a number up to " + std::to_string(most), met);
    }
    return value;
  }
  // Names run to the end of their line: some tools put spaces in them.
  std::string name() {
    while (at_ < text_.size() && (text_[at_] == ' ' || text_[at_] == '\t')) ++at_;
    const std::size_t begin = at_;
    while (at_ < text_.size() && text_[at_] != '\n' && text_[at_] != '\r' && text_[at_] != '{') ++at_;
    std::string out(text_.substr(begin, at_ - begin));
    while (!out.empty() && space(out.back())) out.pop_back();
    if (out.empty() || out.size() > 256) fail("a joint has no name, or one of more than 256 letters");
    return out;
  }

  void add_joint(int parent) {
    if (file_.joints.size() >= kMostJoints) fail("more than " + std::to_string(kMostJoints) + " joints");
    FileJoint joint;
    joint.parent = parent;
    joint.name = name();
    if (!names_.insert(joint.name).second)
      fail("the joint '" + joint.name + "' stands twice", "give each joint its own name");
    expect("{");
    expect("OFFSET");
    for (double& x : joint.offset) x = number();
    expect("CHANNELS");
    joint.channels.resize(count(6));
    for (Channel& channel : joint.channels) channel = read_channel();
    auto sorted = joint.channels;
    std::sort(sorted.begin(), sorted.end());
    if (std::adjacent_find(sorted.begin(), sorted.end()) != sorted.end()) {
      fail("a channel of '" + joint.name + "' stands twice");
    }
    file_.channels += joint.channels.size();
    file_.joints.push_back(std::move(joint));
  }
  Channel read_channel() {
    constexpr std::array<std::string_view, 6> names{"xposition", "yposition", "zposition",
                                                    "xrotation", "yrotation", "zrotation"};
    const std::string_view met = word();
    std::string low(met.substr(0, 16));
    for (char& c : low) c = c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c;
    const auto found = std::find(names.begin(), names.end(), low);
    if (found == names.end()) unexpected("a channel such as Xrotation", met);
    return static_cast<Channel>(found - names.begin());
  }

  // After ROOT: the joints, without recursion.
  void hierarchy() {
    add_joint(-1);
    std::vector<int> open{0};
    while (!open.empty()) {
      const std::string_view met = word();
      if (met == "}") {
        open.pop_back();
      } else if (met == "JOINT") {
        if (open.size() >= kMostDepth) fail("joints nested deeper than " + std::to_string(kMostDepth));
        add_joint(open.back());
        open.push_back(static_cast<int>(file_.joints.size()) - 1);
      } else if (met == "End") {
        expect("Site");
        expect("{");
        expect("OFFSET");
        for (int k = 0; k < 3; ++k) number();
        expect("}");
      } else {
        unexpected("JOINT, End Site or '}'", met);
      }
    }
  }

  void motion() {
    expect("Frames:");
    file_.frames = count(kMostRotations);
    if (file_.frames == 0) fail("has no frame");
    if (file_.frames * file_.joints.size() > kMostRotations) {
      fail(std::to_string(file_.frames) + " frames of " + std::to_string(file_.joints.size()) +
               " joints are too many",
           "cut the motion: 2^26 rotations are the most");
    }
    expect("Frame");
    expect("Time:");
    file_.frame_seconds = number();
    if (!(file_.frame_seconds > 0)) fail("its frame time is not positive");
    if (file_.channels == 0) fail("no joint has a channel");
    // Every value takes two bytes at least: a count that lies cannot make this large.
    if (file_.frames > text_.size() / (2 * file_.channels) + 1) {
      fail("says " + std::to_string(file_.frames) + " frames, more than the file can hold");
    }
    file_.values.resize(file_.frames * file_.channels);
    for (double& value : file_.values) value = number();
    if (const std::string_view rest = word(); !rest.empty())
      unexpected("the file's end after the last frame", rest);
  }

  std::string_view text_;
  const std::string& where_;
  std::size_t at_ = 0;
  std::size_t line_ = 1;
  std::set<std::string> names_;
  File file_;
};

}  // namespace

File parse(std::string_view text, const std::string& where) {
  return Parser(text, where).parse();
}

}  // namespace ecorche::io::bvh
