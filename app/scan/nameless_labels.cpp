// SPDX-License-Identifier: Apache-2.0
#include "app/scan/nameless_labels.hpp"

#include <algorithm>
#include <cmath>

#include "app/scan/phantom_template.hpp"
#include "core/values/text.hpp"
#include "preprocess/scan/cut_bones.hpp"
#include "preprocess/scan/nameless.hpp"
#include "preprocess/scan/views.hpp"

namespace ecorche::app {
namespace {

using Kind = scan::LabelMeaning::Kind;

constexpr double kLeastScore = 0.3;     // else it is no part of a body
constexpr double kSurestByPlace = 0.9;  // a template is no eye
constexpr double kDoubtfulByPlace = 0.65;
constexpr const char* kGiveTable =
    "give a table with it: .json, .tsv, .ctbl or .txt (docs/reference/case.md, Labels)";

std::string point_in_words(const Eigen::Vector3d& p) {
  return "[" + text::number(p[0], 4) + ", " + text::number(p[1], 4) + ", " + text::number(p[2], 4) + "]";
}

std::string share_in_words(double share) {
  return std::to_string(std::lround(100 * share)) + " %";
}

class Namer {
 public:
  Namer(ScanLabels& labels, const ScanOptions& options, ScanCase& out, const Context& context)
      : labels_(labels),
        layer_(labels.map.layers.front()),
        options_(options),
        out_(out),
        context_(context),
        body_(phantom_template()),
        name_(labels.path.filename().string()) {}

  void run() {
    const std::vector<scan::NamelessLabel> found = scan::label_points(layer_, context_.quiet());
    const scan::LabelMeanings meant =
        scan::know_labels(body_, found, layer_.grid, options_.side, context_.quiet());
    if (meant.score < kLeastScore)
      throw Error(
          ErrorKind::data, labels_.path.string(),
          "does not say what its labels mean, and by shape and place they are no bones that are known",
          std::string(kGiveTable) + "; where one limb alone was scanned, say --side left or right");
    labels_.names_from = "shape and place";
    std::vector<std::int64_t> to_cut;
    std::size_t bones = 0, others = 0;
    for (std::size_t l = 0; l < found.size(); ++l) {
      const scan::LabelMeaning& meaning = meant.of[l];
      bones += meaning.kind == Kind::bone || meaning.kind == Kind::bones ? 1 : 0;
      others += meaning.kind == Kind::other || meaning.kind == Kind::ambiguous ? 1 : 0;
      if (meaning.kind == Kind::bones) to_cut.push_back(found[l].id);
      say(found[l], meaning);
    }
    out_.notes.push_back(
        name_ + " has no names: " + std::to_string(bones) + " of its " + std::to_string(found.size()) +
        " labels are bones by shape and place, beside a template of " + text::number(meant.placed.scale, 2) +
        " times its size (agreement " + text::number(meant.score, 2) + ")" +
        (others > 0 ? "; " + std::to_string(others) + " are taken for tissues" : ""));
    out_.doubts.push_back(name_ +
                          ": its labels were named by shape and place: compare them with picture.png");
    if (!to_cut.empty()) cut(to_cut, meant);
  }

 private:
  void say(const scan::NamelessLabel& label, const scan::LabelMeaning& meaning) {
    const std::string number = std::to_string(label.id);
    std::string name = "label_" + number, how = "no bone, by shape and place";
    double sure = 0;
    switch (meaning.kind) {
      case Kind::body:
      case Kind::shell:
        name = meaning.kind == Kind::body ? "body" : "skin";
        how = "label " + number + ": " + share_in_words(meaning.confidence) + " of the outside is its own";
        sure = kSurestByPlace;
        break;
      case Kind::bone: {
        name = bone_name(meaning);
        sure = kSurestByPlace * meaning.confidence;
        how = "label " + number + ": by shape and place, " + share_in_words(meaning.on_bones) +
              " of it at the template's";
        if (sure < kDoubtfulByPlace)
          out_.doubts.push_back("label " + number + " at " + point_in_words(meaning.centre) +
                                " was taken for " + name + " (" + text::number(sure, 2) +
                                "): see picture.png");
        break;
      }
      case Kind::ambiguous:
        out_.doubts.push_back("label " + number + " at " + point_in_words(meaning.centre) +
                              " may be a bone (" + bone_name(meaning) + ", " +
                              text::number(kSurestByPlace * meaning.confidence, 2) +
                              "): it is taken for a tissue");
        how = "by shape and place it may be a bone (" + bone_name(meaning) + ")";
        break;
      case Kind::bones:
      case Kind::other:
        break;
    }
    labels_.map.names[label.id] = name;
    labels_.guesses[label.id] = {how, sure};
  }

  std::string bone_name(const scan::LabelMeaning& meaning) const {
    const std::string& name = body_.bones[static_cast<std::size_t>(meaning.bone)].name;
    return meaning.both_sides ? scan::without_side(name) : name;
  }

  // What covers bones of several segments, by a watershed; each part gets a number of its own.
  void cut(const std::vector<std::int64_t>& which, const scan::LabelMeanings& meant) {
    Image numbers(layer_.grid, ScalarType::i32);
    const auto to = numbers.scalars<std::int32_t>();
    std::vector<std::uint8_t> mask(to.size(), 0);
    with_scalar_type(layer_.type, [&](auto zero) {
      const auto from = layer_.scalars<decltype(zero)>();
      for (std::size_t v = 0; v < from.size(); ++v) {
        to[v] = static_cast<std::int32_t>(from[v]);
        mask[v] = std::find(which.begin(), which.end(), static_cast<std::int64_t>(from[v])) != which.end();
      }
    });
    const scan::CutBones parts = scan::cut_bones(mask, layer_.grid, body_, meant.placed, context_.quiet());
    const std::int64_t first = labels_.map.names.rbegin()->first;
    std::size_t left_out = 0;
    for (std::size_t v = 0; v < to.size(); ++v) {
      if (mask[v] == 0) continue;
      to[v] = parts.of[v] == 0 ? 0 : static_cast<std::int32_t>(first + parts.of[v]);
      left_out += parts.of[v] == 0 ? 1 : 0;
    }
    for (std::size_t b = 0; b < parts.bones.size(); ++b) {
      if (parts.bones[b].voxels == 0) continue;
      const std::int64_t id = first + static_cast<std::int64_t>(b) + 1;
      labels_.map.names[id] = body_.bones[b].name;
      labels_.guesses[id] = {"cut out of a label of several bones by a template, of whose bone " +
                                 share_in_words(parts.bones[b].agreement) + " agree",
                             kSurestByPlace * parts.bones[b].agreement};
    }
    for (const std::int64_t id : which) {
      labels_.map.names.erase(id);
      labels_.guesses.erase(id);
    }
    layer_ = std::move(numbers);
    out_.doubts.push_back(name_ + ": label " + text::joined(numbers_of(which)) +
                          " covers bones of several segments: they are parted by a template, so that joints "
                          "may lie 2 to 3 cm off");
    if (left_out > 0)
      out_.notes.push_back(name_ + ": " + std::to_string(left_out) +
                           " voxels of that lie near no bone of the template, and are left out");
  }

  static std::vector<std::string> numbers_of(const std::vector<std::int64_t>& ids) {
    std::vector<std::string> out;
    for (const std::int64_t id : ids) out.push_back(std::to_string(id));
    return out;
  }

  ScanLabels& labels_;
  Image& layer_;
  const ScanOptions& options_;
  ScanCase& out_;
  const Context& context_;
  scan::BodyTemplate body_;
  std::string name_;
};

}  // namespace

void name_by_place(ScanLabels& labels, const ScanOptions& options, ScanCase& out, const Context& context) {
  Namer(labels, options, out, context).run();
}

}  // namespace ecorche::app
