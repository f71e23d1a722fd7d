// SPDX-License-Identifier: Apache-2.0
#include "io/motion/asf_parser.hpp"

#include <algorithm>
#include <array>
#include <map>
#include <numbers>
#include <optional>

#include "core/values/text.hpp"

namespace ecorche::io::asf {
namespace {

using Eigen::Quaterniond;
using Eigen::Vector3d;

constexpr std::size_t kMostBones = 4096;
constexpr double kInch = 25.4;

// What is written before the bones' tree is known.
struct Drawn {
  Vector3d direction = Vector3d::Zero();
  double length = 0;
  std::array<double, 3> axis{0, 0, 0};
  std::string axis_order = "xyz";
  std::vector<Freedom> freedoms;
};

class AsfParser {
 public:
  explicit AsfParser(TextStream& stream) : in_(stream) {}

  File parse() {
    while (!in_.peek().empty()) section();
    if (!tree_) in_.fail("has no :hierarchy");
    return std::move(file_);
  }

 private:
  bool at_section() { return in_.peek().empty() || in_.peek().front() == ':'; }

  void section() {
    const std::string name = text::lower(in_.word());
    if (name.starts_with('#')) return skip_line();
    if (name == ":units") {
      units();
    } else if (name == ":root") {
      root();
    } else if (name == ":bonedata") {
      while (!at_section()) bone();
    } else if (name == ":hierarchy") {
      hierarchy();
    } else if (name == ":version" || name == ":name") {
      skip_line();
    } else if (name == ":documentation" || name == ":skin") {
      while (!at_section()) skip_line();
    } else {
      in_.unexpected("a section such as :bonedata", name);
    }
  }

  void skip_line() {
    bool more = true;
    in_.line(more);
  }

  void units() {
    double length = 1;
    bool degrees = true;
    while (!at_section()) {
      const std::string key = text::lower(in_.word());
      if (key == "length") {
        length = in_.number();
        if (!(length > 0)) in_.fail("its unit of length is not positive");
      } else if (key == "angle") {
        const std::string unit = text::lower(in_.word());
        if (unit != "deg" && unit != "rad") in_.unexpected("deg or rad", unit);
        degrees = unit == "deg";
      } else {
        in_.word();
      }
    }
    file_.unit_mm = kInch / length;
    file_.radians = degrees ? std::numbers::pi / 180 : 1;
  }

  Freedom freedom(std::string_view word) {
    constexpr std::array<std::string_view, 7> names{"rx", "ry", "rz", "tx", "ty", "tz", "l"};
    const std::string name = text::lower(word);
    const auto found = std::find(names.begin(), names.end(), name);
    if (found == names.end()) in_.unexpected("a degree of freedom such as rx", word);
    return static_cast<Freedom>(found - names.begin());
  }

  void add_freedom(std::vector<Freedom>& freedoms, std::string_view word) {
    freedoms.push_back(freedom(word));
    if (std::count(freedoms.begin(), freedoms.end(), freedoms.back()) > 1)
      in_.fail("the degree of freedom '" + std::string(word.substr(0, 40)) + "' stands twice");
  }

  std::string axis_order() {
    std::string order = text::lower(in_.word());
    std::string sorted = order;
    std::sort(sorted.begin(), sorted.end());
    if (sorted != "xyz") in_.unexpected("an order of axes such as XYZ", order);
    return order;
  }

  void root() {
    if (!file_.bones.empty()) in_.fail("has two roots");
    file_.bones.emplace_back().name = "root";
    names_["root"] = 0;
    while (!at_section()) {
      const std::string key = text::lower(in_.word());
      if (key == "order") {
        for (int k = 0; k < 6; ++k) add_freedom(file_.bones[0].freedoms, std::string(in_.word()));
      } else if (key == "axis") {
        axis_order();
      } else if (key == "position") {
        for (int k = 0; k < 3; ++k) in_.number();
      } else if (key == "orientation") {
        for (int k = 0; k < 3; ++k) {
          if (in_.number() != 0)
            in_.fail("its root is turned at rest, which is not read", "export with orientation 0 0 0");
        }
      } else {
        in_.unexpected("order, axis, position or orientation", key);
      }
    }
  }

  void bone() {
    in_.expect("begin");
    Drawn drawn;
    std::string name;
    for (std::string key = text::lower(in_.word()); key != "end"; key = text::lower(in_.word())) {
      if (key == "id") {
        in_.word();
      } else if (key == "name") {
        name = in_.word();
      } else if (key == "direction") {
        for (int k = 0; k < 3; ++k) drawn.direction[k] = in_.number();
      } else if (key == "length") {
        drawn.length = in_.number();
      } else if (key == "axis") {
        for (double& angle : drawn.axis) angle = in_.number();
        drawn.axis_order = axis_order();
      } else if (key == "dof") {
        while (is_freedom(in_.peek())) add_freedom(drawn.freedoms, std::string(in_.word()));
      } else if (key == "limits") {
        // As Vicon draws them; the patient's own limits count.
        while (in_.peek().starts_with('(')) skip_line();
      } else if (key == "bodymass" || key == "cofmass") {
        skip_line();
      } else {
        in_.unexpected("a bone's direction, length, axis, dof, limits or end", key);
      }
    }
    if (name.empty()) in_.fail("a bone has no name");
    if (names_.count(name) != 0 || !drawn_.emplace(name, std::move(drawn)).second)
      in_.fail("the bone '" + name + "' stands twice", "give each bone its own name");
    if (drawn_.size() >= kMostBones) in_.fail("more than " + std::to_string(kMostBones) + " bones");
  }

  static bool is_freedom(std::string_view word) {
    const std::string w = text::lower(word);
    return w == "l" || (w.size() == 2 && (w[0] == 'r' || w[0] == 't') && w[1] >= 'x' && w[1] <= 'z');
  }

  // Lines `parent child child ...`; a parent must be known, so that parents come first and no circle closes.
  void hierarchy() {
    if (file_.bones.empty()) in_.fail("has no :root before its :hierarchy");
    if (file_.radians == 0) in_.fail("has no :units before its :hierarchy");
    tree_ = true;
    in_.expect("begin");
    skip_line();
    for (;;) {
      if (in_.peek().empty()) in_.unexpected("end", "");
      bool more = true;
      const std::vector<std::string> words = in_.words(more);
      if (words.empty()) continue;
      if (words[0] == "end") return;
      const auto parent = names_.find(words[0]);
      if (parent == names_.end())
        in_.fail("'" + words[0].substr(0, 40) + "' has children before it has a parent");
      for (std::size_t i = 1; i < words.size(); ++i) add(words[i], parent->second);
    }
  }

  void add(const std::string& name, int parent) {
    const auto found = drawn_.find(name);
    if (found == drawn_.end()) in_.fail("the bone '" + name.substr(0, 40) + "' is not in :bonedata");
    if (names_.count(name) != 0) in_.fail("the bone '" + name + "' has two parents");
    const Drawn& drawn = found->second;
    Bone bone;
    bone.name = name;
    bone.parent = parent;
    if (drawn.length != 0) {
      const double norm = drawn.direction.norm();
      if (!(norm > 0)) in_.fail("the bone '" + name + "' has a length and no direction");
      bone.offset = drawn.length / norm * drawn.direction;
    }
    std::vector<Freedom> order;
    std::array<double, 3> angles{0, 0, 0};
    for (std::size_t k = 0; k < 3; ++k) {
      order.push_back(drawn.axis_order[k] - 'x');
      angles[k] = drawn.axis[static_cast<std::size_t>(order.back())];
    }
    bone.axis = turn_of(order, angles.data(), file_.radians);
    bone.freedoms = drawn.freedoms;
    names_[name] = static_cast<int>(file_.bones.size());
    file_.bones.push_back(std::move(bone));
  }

  TextStream& in_;
  File file_;
  std::map<std::string, int> names_;
  std::map<std::string, Drawn> drawn_;
  bool tree_ = false;
};

}  // namespace

File parse(TextStream& stream) {
  return AsfParser(stream).parse();
}

Quaterniond turn_of(const std::vector<Freedom>& freedoms, const double* values, double radians) {
  Quaterniond out = Quaterniond::Identity();
  for (std::size_t i = 0; i < freedoms.size(); ++i) {
    if (freedoms[i] > 2) continue;
    out = Quaterniond(Eigen::AngleAxisd(values[i] * radians, Vector3d::Unit(freedoms[i]))) * out;
  }
  return out.normalized();
}

}  // namespace ecorche::io::asf
