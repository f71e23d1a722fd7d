// SPDX-License-Identifier: Apache-2.0
#include "app/scan/nameless_labels.hpp"

#include <algorithm>
#include <cmath>
#include <set>

#include "app/scan/dense_labels.hpp"
#include "app/scan/phantom_template.hpp"
#include "core/values/text.hpp"
#include "preprocess/scan/cut_bones.hpp"
#include "preprocess/scan/nameless.hpp"
#include "preprocess/scan/pieces.hpp"
#include "preprocess/scan/views.hpp"

namespace ecorche::app {
namespace {

using Kind = scan::LabelMeaning::Kind;

constexpr double kLeastScore = 0.4;     // else it is no part of a body
constexpr double kSurestByPlace = 0.9;  // a template is no eye
constexpr double kPart = 0.2;           // of a piece on the lesser side: it has bones of both
constexpr double kDoubtfulByPlace = 0.65;
constexpr double kAskedMl = 4;         // of a label that is no bone, and looks like one in the CT
constexpr std::size_t kAskedMost = 6;  // that are told with their places
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
  Namer(ScanLabels& labels, const ScanImage* ct, const ScanOptions& options, ScanCase& out,
        const Context& context)
      : labels_(labels),
        ct_(ct),
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
    std::map<std::int64_t, std::string> to_side;
    std::size_t bones = 0, others = 0;
    for (std::size_t l = 0; l < found.size(); ++l) {
      const scan::LabelMeaning& meaning = meant.of[l];
      bones += meaning.kind == Kind::bone || meaning.kind == Kind::bones ? 1 : 0;
      others += meaning.kind == Kind::other || meaning.kind == Kind::ambiguous ? 1 : 0;
      if (meaning.kind == Kind::bones) to_cut.push_back(found[l].id);
      if (meaning.kind == Kind::bone && two_sided(meaning)) to_side[found[l].id] = bone_name(meaning);
      say(found[l], meaning);
    }
    ask(found, meant);
    out_.notes.push_back(
        name_ + " has no names: " + std::to_string(bones) + " of its " + std::to_string(found.size()) +
        " labels are bones by shape and place, beside a template of " + text::number(meant.placed.scale, 2) +
        " times its size (agreement " + text::number(meant.score, 2) + ")" +
        (others > 0 ? "; " + std::to_string(others) + " are taken for tissues" : ""));
    out_.doubts.push_back(name_ +
                          ": its labels were named by shape and place: compare them with picture.png");
    if (!to_cut.empty() || !to_side.empty()) cut(to_cut, to_side, meant);
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
        out_.doubts.push_back(
            "label " + number + " at " + point_in_words(meaning.centre) + " may be a bone (" +
            bone_name(meaning) + ", " + text::number(kSurestByPlace * meaning.confidence, 2) +
            (meaning.too_short ? ", but it is far shorter than that" : "") + "): it is taken for a tissue");
        how = "by shape and place it may be a bone (" + bone_name(meaning) + ")";
        break;
      case Kind::bones:
      case Kind::other:
        break;
    }
    labels_.map.names[label.id] = name;
    labels_.guesses[label.id] = {how, sure};
  }

  // Large ones that are called no bone, yet look like one in the CT.
  void ask(const std::vector<scan::NamelessLabel>& found, const scan::LabelMeanings& meant) {
    if (ct_ == nullptr) return;
    const std::array<double, 3>& mm = layer_.grid.spacing;
    std::map<std::int64_t, std::size_t> row;
    std::set<std::int64_t> asked;
    for (std::size_t l = 0; l < found.size(); ++l) {
      const double ml = 1e-3 * mm[0] * mm[1] * mm[2] * static_cast<double>(found[l].voxels);
      if (meant.of[l].kind != Kind::other || ml < kAskedMl) continue;
      asked.insert(found[l].id);
      row[found[l].id] = l;
    }
    std::vector<std::int64_t> like = labels_like_bone(layer_, asked, *ct_);
    if (like.empty()) return;
    std::sort(like.begin(), like.end(),
              [&](auto a, auto b) { return found[row[a]].voxels > found[row[b]].voxels; });
    std::vector<std::string> told;
    for (std::size_t i = 0; i < std::min(like.size(), kAskedMost); ++i)
      told.push_back(std::to_string(like[i]) + " at " + point_in_words(meant.of[row[like[i]]].centre));
    const std::size_t more = like.size() - told.size();
    out_.doubts.push_back(name_ + ": " + (like.size() == 1 ? "label " : "labels ") + text::joined(told) +
                          (more > 0 ? " and " + std::to_string(more) + " more" : "") +
                          (like.size() == 1 ? " looks" : " look") + " like bone in " +
                          ct_->path.filename().string() + ", but by shape and place " +
                          (like.size() == 1 ? "it is none and is" : "they are none and are") +
                          " taken for tissues: name what is bone in a table of names");
  }

  std::string bone_name(const scan::LabelMeaning& meaning) const {
    const std::string& name = body_.bones[static_cast<std::size_t>(meaning.bone)].name;
    return meaning.both_sides ? scan::without_side(name) : name;
  }

  bool two_sided(const scan::LabelMeaning& meaning) const {
    const std::string& name = body_.bones[static_cast<std::size_t>(meaning.bone)].name;
    return meaning.both_sides && name != scan::without_side(name);
  }

  // The number of a bone that was parted.
  std::int64_t number_of(const std::string& name, const LabelGuess& guess) {
    for (const auto& [id, known] : labels_.map.names) {
      if (id > first_ && known == name) {
        labels_.guesses[id].confidence = std::min(labels_.guesses[id].confidence, guess.confidence);
        return id;
      }
    }
    const std::int64_t id = std::max(first_, labels_.map.names.rbegin()->first) + 1;
    labels_.map.names[id] = name;
    labels_.guesses[id] = guess;
    return id;
  }

  // By a watershed with the template's seeds: labels of several segments' bones, each part with a number of
  // its own, and labels of bones of both sides, whose pieces go to the side that most of them lies on.
  void cut(const std::vector<std::int64_t>& which, const std::map<std::int64_t, std::string>& to_side,
           const scan::LabelMeanings& meant) {
    first_ = labels_.map.names.rbegin()->first;
    Image numbers(layer_.grid, ScalarType::i32), sided(layer_.grid, ScalarType::u16);
    const auto to = numbers.scalars<std::int32_t>();
    const auto piece_of = sided.scalars<std::uint16_t>();
    std::vector<std::uint8_t> mask(to.size(), 0), all(to.size(), 0);
    std::map<std::int64_t, std::uint16_t> row;
    for (const auto& [id, name] : to_side) row.emplace(id, static_cast<std::uint16_t>(row.size() + 1));
    with_scalar_type(layer_.type, [&](auto zero) {
      const auto from = layer_.scalars<decltype(zero)>();
      for (std::size_t v = 0; v < from.size(); ++v) {
        const auto id = static_cast<std::int64_t>(+from[v]);
        to[v] = static_cast<std::int32_t>(id);
        mask[v] = std::find(which.begin(), which.end(), id) != which.end() ? 1 : 0;
        const auto own = row.find(id);
        if (own != row.end()) piece_of[v] = own->second;
        all[v] = mask[v] != 0 || own != row.end() ? 1 : 0;
      }
    });
    const scan::CutBones parts = scan::cut_bones(all, layer_.grid, body_, meant.placed, context_.quiet());
    give_pieces(sided, to_side, parts, to);
    if (which.empty()) {
      layer_ = std::move(numbers);
      return;
    }
    std::vector<std::int32_t> number(parts.bones.size(), 0);
    std::size_t left_out = 0;
    for (std::size_t v = 0; v < to.size(); ++v) {
      if (mask[v] == 0) continue;
      if (parts.of[v] == 0) {
        to[v] = 0;
        ++left_out;
        continue;
      }
      const std::size_t b = parts.of[v] - 1U;
      if (number[b] == 0)
        number[b] = static_cast<std::int32_t>(number_of(
            body_.bones[b].name, {"cut out of a label of several bones by a template, of whose bone " +
                                      share_in_words(parts.bones[b].agreement) + " agree",
                                  kSurestByPlace * parts.bones[b].agreement}));
      to[v] = number[b];
    }
    for (const std::int64_t id : which) {
      labels_.map.names.erase(id);
      labels_.guesses.erase(id);
    }
    layer_ = std::move(numbers);
    out_.parted = true;
    out_.doubts.push_back(name_ + ": label " + text::joined(numbers_of(which)) +
                          " covers bones of several segments: they are parted by a template, so that joints "
                          "may lie 2 to 3 cm off");
    if (left_out > 0)
      out_.notes.push_back(name_ + ": " + std::to_string(left_out) +
                           " voxels of that lie near no bone of the template, and are left out");
  }

  // Pieces of `sided`, row by row of `to_side`, become the left or the right one's in `to`.
  void give_pieces(const Image& sided, const std::map<std::int64_t, std::string>& to_side,
                   const scan::CutBones& parts, std::span<std::int32_t> to) {
    if (to_side.empty()) return;
    const scan::Pieces pieces =
        scan::find_pieces(sided, std::vector<std::uint8_t>(to_side.size() + 1, 1), context_.quiet());
    std::vector<std::array<std::size_t, 2>> on(pieces.pieces.size());
    const auto each = [&](const scan::Run& run, auto&& f) {
      const std::size_t at = layer_.grid.offset(run.begin, run.j, run.k);
      for (std::size_t v = at; v < at + static_cast<std::size_t>(run.end - run.begin); ++v) f(v);
    };
    const auto side_of = [&](std::size_t v) -> int {
      if (parts.of[v] == 0) return -1;
      const std::string& name = body_.bones[parts.of[v] - 1U].name;
      return name.ends_with("_left") ? 0 : name.ends_with("_right") ? 1 : -1;
    };
    for (const scan::Run& run : pieces.runs) {
      if (pieces.pieces[run.piece].id == 0) continue;
      each(run, [&](std::size_t v) {
        if (const int side = side_of(v); side >= 0) ++on[run.piece][static_cast<std::size_t>(side)];
      });
    }
    std::vector<std::array<std::int32_t, 2>> number;
    for (const auto& [id, name] : to_side) {
      const LabelGuess guess = labels_.guesses.at(id);
      number.push_back({static_cast<std::int32_t>(number_of(name + "_left", guess)),
                        static_cast<std::int32_t>(number_of(name + "_right", guess))});
    }
    for (const scan::Run& run : pieces.runs) {
      const std::size_t id = pieces.pieces[run.piece].id;
      if (id == 0) continue;
      const auto& [left, right] = on[run.piece];
      const double share =
          static_cast<double>(left) / static_cast<double>(std::max<std::size_t>(1, left + right));
      each(run, [&](std::size_t v) {
        int side = share > 0.5 ? 0 : 1;
        if (share > kPart && share < 1 - kPart && side_of(v) >= 0) side = side_of(v);  // both in one piece
        to[v] = number[id - 1][static_cast<std::size_t>(side)];
      });
    }
    for (const auto& [id, name] : to_side) {
      labels_.map.names.erase(id);
      labels_.guesses.erase(id);
    }
  }

  static std::vector<std::string> numbers_of(const std::vector<std::int64_t>& ids) {
    std::vector<std::string> out;
    out.reserve(ids.size());
    for (const std::int64_t id : ids) out.push_back(std::to_string(id));
    return out;
  }

  ScanLabels& labels_;
  const ScanImage* ct_;  // null where there is none
  Image& layer_;
  const ScanOptions& options_;
  ScanCase& out_;
  const Context& context_;
  scan::BodyTemplate body_;
  std::string name_;
  std::int64_t first_ = 0;  // numbers above are of what was parted
};

}  // namespace

void name_nameless(Scan& scan, const ScanOptions& options, ScanCase& out, const Context& context) {
  for (ScanLabels& labels : scan.labels) {
    if (!labels.map.names.empty()) continue;
    if (scan.labels.size() > 1)
      throw Error(ErrorKind::data, labels.path.string(),
                  "does not say what its labels mean, beside label maps that do", kGiveTable);
    const auto ct =
        std::find_if(scan.images.begin(), scan.images.end(), [](const ScanImage& i) { return i.ct; });
    Namer(labels, ct == scan.images.end() ? nullptr : &*ct, options, out, context).run();
  }
}

}  // namespace ecorche::app
