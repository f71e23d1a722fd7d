// SPDX-License-Identifier: Apache-2.0
#include "preprocess/scan/nameless.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "preprocess/scan/fit_segments.hpp"
#include "preprocess/scan/label_shape.hpp"
#include "preprocess/scan/template_cloud.hpp"
#include "preprocess/scan/views.hpp"

namespace ecorche::scan {
namespace {

constexpr double kAtTemplate = 14;  // mm: at a bone of the template
constexpr double kBone = 0.7;
constexpr double kClaim = 0.08;  // bones' points that are its own, over those that its size lets one expect
// What is taken for bone, while the template comes nearer.
struct Step {
  double near = 0, on = 0, claim = 0;
};
constexpr Step kSteps[] = {
    {20, 0.7, 0}, {18, 0.7, 0.03}, {16, 0.7, 0.05}, {16, 0.7, 0.05}, {kAtTemplate, kBone, kClaim}};
constexpr double kFitReach = 30;    // mm, at first
constexpr double kCandidate = 0.5;  // share that lies at bones
constexpr double kEnclosed = 0.6;   // share of its faces at bones: marrow
constexpr double kMarrow = 0.8;     // share of it that lies at bones
constexpr double kLimbFar = 60;     // mm: limbs that are held otherwise lie nearer than this
constexpr double kNearFar = 0.5;    // share of a label that does
constexpr double kUncovered = 0.3;  // share of a bone of the template that is not there yet
constexpr double kTooLarge = 4;     // times the template's bones
constexpr double kGrowReach = 60;
constexpr double kOfOne = 0.65;     // share of one segment: the rest is the template's error
constexpr double kBothSides = 0.2;  // share on the lesser side
constexpr int kRefineRounds = 13, kGrowFrom = 2, kGrowTo = 9;
constexpr Eigen::Index kSampled = 600;  // points of a label that are looked at
constexpr Eigen::Index kFitPoints = 9000;
constexpr double kFound = 0.5;                 // share of a bone of the template that is there
constexpr double kGood = 0.4;                  // score: no other place is tried
constexpr double kThick = 20, kRibThick = 12;  // mm: twice the volume over the surface
constexpr double kSpans = 0.3;  // share of several segments' bones that a label of them all holds
constexpr double kAtBone = 0.25,
                 kSureOn =
                     0.85;  // share of faces at bones, and of it at the template's: one of a bone's parts
constexpr double kTemplateSpacing = 9;  // mm, of the template's points

// What each label is, beside the template where it lies now: by whose points are nearest to its own.
class LabelClassifier {
 public:
  LabelClassifier(const BodyTemplate& body, const std::vector<NamelessLabel>& labels, const ImageGrid& grid,
                  const Placed& placed, const TooShort& too_short)
      : body_(body),
        labels_(labels),
        grid_(grid),
        placed_(placed),
        too_short_(too_short),
        clouds_(segment_clouds(body, placed.in_play)),
        on_(labels.size()),
        short_on_(labels.size()),
        sum_(labels.size(), 0),
        all_(labels.size(), 0),
        claim_(labels.size(), 0) {}

  void run(std::vector<LabelMeaning>& out, const Step& step) {
    near_ = step.near;
    last_ = step.claim >= kClaim;
    for (std::size_t l = 0; l < labels_.size(); ++l) lay(l, out[l]);
    claim(out);
    for (std::size_t l = 0; l < labels_.size(); ++l) out[l].claim = claim_[l];
    for (std::size_t l = 0; l < labels_.size(); ++l) {
      if (free(out[l]) && out[l].on_bones >= step.on && claim_[l] >= step.claim) decide(l, out[l]);
    }
    // What bone encloses is of it; what only lies at it may be.
    std::vector<std::size_t> marrow;
    for (std::size_t l = 0; l < labels_.size(); ++l) {
      if (!free(out[l]) || bone(out[l]) || out[l].on_bones + short_share(l) < kMarrow) continue;
      const double at = enclosed(l, out);
      if (at >= kEnclosed || (last_ && at >= kAtBone && out[l].on_bones >= kSureOn)) marrow.push_back(l);
    }
    for (const std::size_t l : marrow) {
      take_short(l, out[l]);  // a part of a bone is no longer than it is
      decide(l, out[l]);
      if (out[l].kind == LabelMeaning::Kind::bones) out[l].kind = LabelMeaning::Kind::other;  // a cord
    }
    for (std::size_t l = 0; l < labels_.size(); ++l) {
      LabelMeaning& meaning = out[l];
      if (!free(meaning) || bone(meaning)) continue;
      if (meaning.on_bones >= kBone - 0.1 && claim_[l] >= 0.5 * kClaim) {
        decide(l, meaning);
        if (!bone(meaning)) continue;
        meaning.kind = LabelMeaning::Kind::ambiguous;
        meaning.confidence *= 0.5;
      } else if (last_ && meaning.on_bones + short_share(l) >= kBone && claim_[l] >= kClaim) {
        take_short(l, meaning);
        decide(l, meaning);
        meaning.kind = bone(meaning) ? LabelMeaning::Kind::ambiguous : LabelMeaning::Kind::other;
        meaning.too_short = true;
        meaning.confidence *= 0.5;
      }
    }
  }

  /// How much of the template in view is bone, times how much of that bone lies at it.
  double score(const std::vector<LabelMeaning>& out) const {
    double own = 0, all = 0;
    for (std::size_t l = 0; l < labels_.size(); ++l) {
      if (!bone(out[l])) continue;
      own += sum_[l];
      all += all_[l];
    }
    if (all == 0) return 0;
    double found = 0, looked = 0;
    for (std::size_t b = 0; b < body_.bones.size(); ++b) {
      looked += placed_.in_play[static_cast<std::size_t>(body_.bones[b].segment)];
      found += seen_[b] > 0 && there_[b] > kFound * seen_[b] ? 1 : 0;
    }
    return own / all * covered_ * (0.5 + 0.5 * found / std::max(1.0, looked));
  }

  /// Labels that may be bones which are not there yet: near those of the template, and no larger than they.
  std::vector<std::size_t> further(const std::vector<LabelMeaning>& out) const {
    std::vector<std::size_t> found;
    std::vector<std::uint8_t> missing;
    for (std::size_t b = 0; b < body_.bones.size(); ++b) {
      const double seen = b < seen_.size() ? seen_[b] : 0, there = b < there_.size() ? there_[b] : 0;
      missing.push_back(seen > 0 && there < kUncovered * seen ? 1 : 0);
    }
    const double each = std::pow(kLabelCubes / (kTemplateSpacing * placed_.scale), 3);
    for (std::size_t l = 0; l < labels_.size(); ++l) {
      if (!free(out[l]) || bone(out[l])) continue;
      const Points& points = labels_[l].points;
      std::map<std::size_t, double> at;
      double near = 0;
      const Eigen::Index step = std::max<Eigen::Index>(1, points.rows() / 200);
      for (Eigen::Index p = 0; p < points.rows(); p += step) {
        const NearestBone one = nearest_bone(clouds_, placed_.segments, points.row(p).transpose(), kLimbFar);
        if (one.segment < 0) continue;
        const auto b = static_cast<std::size_t>(
            clouds_[static_cast<std::size_t>(one.segment)].bone[static_cast<std::size_t>(one.point)]);
        if (missing[b] != 0 && !too_short(l, static_cast<int>(b))) at[b] += 1, near += 1;
      }
      if (near * static_cast<double>(step) < kNearFar * static_cast<double>(points.rows())) continue;
      double size = 0;
      for (const auto& [b, count] : at) size += static_cast<double>(body_.bones[b].points.rows());
      if (each * static_cast<double>(points.rows()) < kTooLarge * size) found.push_back(l);
    }
    return found;
  }

  static bool bone(const LabelMeaning& m) {
    return m.kind == LabelMeaning::Kind::bone || m.kind == LabelMeaning::Kind::bones;
  }

 private:
  static bool free(const LabelMeaning& m) {
    return m.kind != LabelMeaning::Kind::body && m.kind != LabelMeaning::Kind::shell;
  }

  void lay(std::size_t l, LabelMeaning& out) {
    const Points& points = labels_[l].points;
    out.centre = points.colwise().mean().transpose();
    if (!free(out)) return;
    out.kind = LabelMeaning::Kind::other;
    double near = 0, asked = 0;
    const Eigen::Index step = std::max<Eigen::Index>(1, points.rows() / kSampled);
    for (Eigen::Index p = 0; p < points.rows(); p += step) {
      asked += 1;
      const NearestBone found = nearest_bone(clouds_, placed_.segments, points.row(p).transpose(), near_);
      if (found.segment < 0) continue;
      const int b =
          clouds_[static_cast<std::size_t>(found.segment)].bone[static_cast<std::size_t>(found.point)];
      const bool other = too_short(l, b);
      near += other ? 0 : 1;
      ++(other ? short_on_ : on_)[l][b];
    }
    out.too_short = false;
    out.on_bones = near / asked;
    sum_[l] = near;
    all_[l] = asked;
  }

  bool too_short(std::size_t l, int b) const { return too_short_(l, b, placed_.scale); }

  // Of a label, what lies at bones for which it is too short.
  double short_share(std::size_t l) const {
    double sum = 0;
    for (const auto& [b, count] : short_on_[l]) sum += count;
    return sum / std::max(1.0, all_[l]);
  }

  // Even a bone for which it is too short is no other label's where it lies nearer.
  bool vies(std::size_t l, const LabelMeaning& m) const { return m.on_bones + short_share(l) >= kCandidate; }

  // That counts, too.
  void take_short(std::size_t l, LabelMeaning& out) {
    for (const auto& [b, count] : short_on_[l]) on_[l][b] += count, sum_[l] += count;
    short_on_[l].clear();
    out.on_bones = sum_[l] / std::max(1.0, all_[l]);
  }

  // Which of the candidates is nearest to each of the template's points.
  void claim(const std::vector<LabelMeaning>& out) {
    std::vector<std::size_t> of;
    Eigen::Index count = 0;
    for (std::size_t l = 0; l < labels_.size(); ++l)
      count += free(out[l]) && vies(l, out[l]) ? labels_[l].points.rows() : 0;
    if (count == 0) return;
    Points all(count, 3);
    Eigen::Index row = 0;
    for (std::size_t l = 0; l < labels_.size(); ++l) {
      if (!free(out[l]) || !vies(l, out[l])) continue;
      const Points& points = labels_[l].points;
      all.middleRows(row, points.rows()) = points;
      row += points.rows();
      of.insert(of.end(), static_cast<std::size_t>(points.rows()), l);
    }
    std::vector<std::int32_t> rows(of.size());
    std::iota(rows.begin(), rows.end(), 0);
    const geometry::NearestPoint nearest(all, rows);
    double seen = 0, covered = 0;
    seen_.assign(body_.bones.size(), 0);
    there_ = seen_;
    for (std::size_t s = 0; s < clouds_.size(); ++s) {
      for (Eigen::Index p = 0; p < clouds_[s].points.rows(); ++p) {
        const Eigen::Vector3d at = placed_.segments[s](clouds_[s].points.row(p).transpose());
        if (!in_view(grid_, at)) continue;
        double square = 0;
        const std::int32_t found = nearest.find(at, square);
        const std::size_t l = of[static_cast<std::size_t>(found)];
        const auto b = static_cast<std::size_t>(clouds_[s].bone[static_cast<std::size_t>(p)]);
        seen += 1;
        seen_[b] += 1;
        if (square >= near_ * near_) continue;
        claim_[l] += 1;
        if (too_short(l, static_cast<int>(b))) continue;
        covered += out[l].on_bones >= kBone ? 1 : 0;
        there_[b] += out[l].on_bones >= kBone ? 1 : 0;
      }
    }
    claims_ = claim_;
    covered_ = seen > 0 ? covered / seen : 0;
    const double each = std::pow(kLabelCubes / (kTemplateSpacing * placed_.scale), 3);
    for (std::size_t l = 0; l < labels_.size(); ++l)
      claim_[l] /= each * static_cast<double>(labels_[l].points.rows());
  }

  double enclosed(std::size_t l, const std::vector<LabelMeaning>& out) const {
    std::size_t all = labels_[l].outside, bones = 0;
    for (const auto& [other, faces] : labels_[l].at) {
      all += faces;
      bones += bone(out[other]) ? faces : 0;
    }
    return all == 0 ? 0 : static_cast<double>(bones) / static_cast<double>(all);
  }

  // Whether it holds much of the bones at which it lies: a cord beside them does not.
  bool holds(std::size_t l) const {
    double seen = 0;
    for (const auto& [bone, count] : on_[l]) {
      if (static_cast<double>(count) > 0.05 * sum_[l]) seen += seen_[static_cast<std::size_t>(bone)];
    }
    return claims_[l] > kSpans * seen;
  }

  // Whose bone it is.
  void decide(std::size_t l, LabelMeaning& out) {
    std::map<std::string, double> by_segment, by_bone;
    std::map<int, double> by_side;
    for (const auto& [bone, count] : on_[l]) {
      const TemplateBone& b = body_.bones[static_cast<std::size_t>(bone)];
      const std::string& segment = body_.segments[static_cast<std::size_t>(b.segment)].name;
      const auto n = static_cast<double>(count);
      by_segment[without_side(segment)] += n;
      by_bone[without_side(b.name)] += n;
      by_side[segment.ends_with("_left") ? 1 : segment.ends_with("_right") ? -1 : 0] += n;
    }
    const auto most = [](const auto& counts) {
      return std::max_element(counts.begin(), counts.end(),
                              [](const auto& a, const auto& b) { return a.second < b.second; });
    };
    const auto segment = most(by_segment);
    const double share = segment->second / sum_[l];
    out.kind = share >= kOfOne ? LabelMeaning::Kind::bone : LabelMeaning::Kind::bones;
    const bool thin = segment->first == "thorax" || segment->first == "girdle";
    if (labels_[l].thickness > (thin ? kRibThick : kThick)) out.kind = LabelMeaning::Kind::other;
    if (last_ && out.kind == LabelMeaning::Kind::bones && !holds(l)) out.kind = LabelMeaning::Kind::other;
    double best = -1;
    for (const auto& [bone, count] : on_[l]) {
      const TemplateBone& b = body_.bones[static_cast<std::size_t>(bone)];
      if (without_side(body_.segments[static_cast<std::size_t>(b.segment)].name) != segment->first) continue;
      if (static_cast<double>(count) > best) best = static_cast<double>(count), out.bone = bone;
    }
    out.both_sides = std::min(by_side[1], by_side[-1]) > kBothSides * sum_[l];
    out.confidence = out.on_bones * std::min(1.0, share / 0.9);
  }

  const BodyTemplate& body_;
  const std::vector<NamelessLabel>& labels_;
  const ImageGrid& grid_;
  const Placed& placed_;
  const TooShort& too_short_;
  std::vector<SegmentCloud> clouds_;
  // Of each label: points at each of the template's bones, and at those for which it is too short.
  std::vector<std::map<int, int>> on_, short_on_;
  std::vector<double> sum_, all_;  // ... at any, and of all that were asked
  std::vector<double> claim_, claims_;
  std::vector<double> seen_, there_;  // of each of the template's bones: its points in view, at a label
  double covered_ = 0, near_ = kAtTemplate;
  bool last_ = false;  // the template lies where it will
};

std::vector<std::size_t> bones_of(const std::vector<LabelMeaning>& of) {
  std::vector<std::size_t> out;
  for (std::size_t l = 0; l < of.size(); ++l) {
    if (LabelClassifier::bone(of[l])) out.push_back(l);
  }
  return out;
}

// Of a body as a whole no upper arm was found.
bool no_upper_arm(const BodyTemplate& body, const LabelMeanings& found) {
  return !one_limb(found.placed.view) &&
         std::none_of(found.of.begin(), found.of.end(), [&](const LabelMeaning& m) {
           return LabelClassifier::bone(m) && m.bone >= 0 &&
                  of_upper_arm(body, body.bones[static_cast<std::size_t>(m.bone)]);
         });
}

// Classified and fitted in turn, until the bones stay the same; the best of all rounds' becomes `out`.
void refine(const BodyTemplate& body, const std::vector<NamelessLabel>& labels, const ImageGrid& grid,
            const TooShort& too_short, Placed placed, LabelMeanings& out, const Context& context) {
  const std::vector<SegmentCloud> clouds = segment_clouds(body, placed.in_play);
  std::vector<std::size_t> last;
  for (int round = 0; round <= kRefineRounds; ++round) {
    LabelClassifier classifier(body, labels, grid, placed, too_short);
    LabelMeanings now{placed, 0, out.of};
    classifier.run(now.of,
                   kSteps[std::min<std::size_t>(static_cast<std::size_t>(round), std::size(kSteps) - 1)]);
    now.score = classifier.score(now.of);
    std::vector<std::size_t> bones = bones_of(now.of);
    const bool grow = round >= kGrowFrom && round <= kGrowTo;
    const std::size_t sure = bones.size();
    if (grow) {
      for (const std::size_t l : classifier.further(now.of)) bones.push_back(l);
    }
    const bool strict = round + 1 >= static_cast<int>(std::size(kSteps));
    if (strict && now.score > out.score) out = now;
    if ((strict && bones == last) || bones.empty() || round == kRefineRounds) break;
    fit_segments(body, clouds, points_of(labels, bones, kFitPoints), grid,
                 {size_of_last(clouds, placed.segments), bones.size() > sure ? kGrowReach : kFitReach},
                 placed.segments, context.quiet());
    last = std::move(bones);
  }
}

}  // namespace

LabelMeanings know_labels(const BodyTemplate& body, const std::vector<NamelessLabel>& labels,
                          const ImageGrid& whole, Side side, const Context& context) {
  LabelMeanings out;
  out.of.resize(labels.size());
  find_bodies(labels, out.of);
  std::vector<NamelessLabel> within;
  std::vector<std::size_t> row;
  for (std::size_t l = 0; l < labels.size(); ++l) {
    if (out.of[l].kind != LabelMeaning::Kind::other) continue;
    within.push_back(labels[l]);
    row.push_back(l);
  }
  if (within.empty()) return out;
  const ImageGrid grid = part_with_labels(within, whole);
  std::vector<RoughPlace> places = rough_places(body, within, grid, side, context.quiet());
  context.report(0.4);
  const TooShort too_short(body, labels, whole);
  for (std::size_t i = 0; i < places.size() && out.score < kGood; ++i) {
    RoughPlace& rough = places[i];
    for (std::size_t& l : rough.likely) l = row[l];
    for (const View view : {rough.view, View::arms_up}) {
      if (view != rough.view && (rough.view != View::body || i > 0)) continue;
      LabelMeanings from;
      from.of = out.of;
      refine(body, labels, grid, too_short, laid(body, rough.place, view), from, context);
      if (from.score > out.score) out = std::move(from);
    }
    // The trunk lies well, and arms held the other way may, too.
    const Placed other = with_other_arms(body, out.placed);
    if (no_upper_arm(body, out) && upper_arm_in_view(body, other, grid)) {
      LabelMeanings from;
      from.of = out.of;
      refine(body, labels, grid, too_short, other, from, context);
      if (from.score > out.score) out = std::move(from);
    }
    context.report(0.4 + 0.6 * static_cast<double>(i + 1) / static_cast<double>(places.size()));
  }
  return out;
}

}  // namespace ecorche::scan
