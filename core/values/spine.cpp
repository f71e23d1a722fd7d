// SPDX-License-Identifier: Apache-2.0
#include "core/values/spine.hpp"

#include <algorithm>
#include <array>
#include <utility>
#include <vector>

#include "core/values/degrees.hpp"

namespace ecorche::spine {
namespace {

constexpr std::string_view kSource =
    "White and Panjabi, Clinical Biomechanics of the Spine (1990): all of the level's bending forth and "
    "back, "
    "either way from where it was scanned";

constexpr std::array<Level, 25> kLevels{{
    {"vertebra_l5", "l5_s1", "lumbar", "lumbar", 17, 3, 1},
    {"vertebra_l4", "l4_l5", "lumbar", "lumbar", 16, 6, 2},
    {"vertebra_l3", "l3_l4", "lumbar", "lumbar", 15, 8, 2},
    {"vertebra_l2", "l2_l3", "lumbar", "lumbar", 14, 6, 2},
    {"vertebra_l1", "l1_l2", "lumbar", "lumbar", 12, 6, 2},
    {"vertebra_t12", "t12_l1", "thorax", "thorax", 12, 8, 2},
    {"vertebra_t11", "t11_t12", "thorax", "thorax", 12, 9, 2},
    {"vertebra_t10", "t10_t11", "thorax", "thorax", 9, 7, 2},
    {"vertebra_t9", "t9_t10", "thorax", "thorax", 6, 6, 4},
    {"vertebra_t8", "t8_t9", "thorax", "thorax", 6, 6, 6},
    {"vertebra_t7", "t7_t8", "thorax", "thorax", 6, 6, 7},
    {"vertebra_t6", "t6_t7", "thorax", "thorax", 5, 6, 7},
    {"vertebra_t5", "t5_t6", "thorax", "thorax", 4, 6, 8},
    {"vertebra_t4", "t4_t5", "thorax", "thorax", 4, 6, 8},
    {"vertebra_t3", "t3_t4", "thorax", "thorax", 4, 5, 8},
    {"vertebra_t2", "t2_t3", "thorax", "thorax", 4, 6, 8},
    {"vertebra_t1", "t1_t2", "thorax", "thorax", 4, 5, 9},
    {"vertebra_c7", "c7_t1", "neck", "neck", 9, 4, 2},
    {"vertebra_c6", "c6_c7", "neck", "neck", 17, 7, 6},
    {"vertebra_c5", "c5_c6", "neck", "neck", 20, 8, 7},
    {"vertebra_c4", "c4_c5", "neck", "neck", 20, 11, 7},
    {"vertebra_c3", "c3_c4", "neck", "neck", 15, 11, 7},
    {"vertebra_c2", "c2_c3", "neck", "neck", 10, 10, 3},
    {"vertebra_c1", "c1_c2", "neck", "head", 20, 5, 40},
    {"head", "c0_c1", "head", "head", 25, 5, 5},
}};

// A segment of `human` whose joint leads, and the segment that has the joint once the spine is split.
constexpr std::array<std::pair<std::string_view, std::string_view>, 4> kLeaders{
    {{"lumbar", "lumbar_spine"},
     {"thorax", "thoracic_spine"},
     {"neck", "cervical_spine"},
     {"head", "upper_cervical_spine"}}};

constexpr std::string_view kThorax = "thorax", kCageOn = "vertebra_t6", kSternumOn = "vertebra_t4",
                           kLowestOfNeck = "vertebra_c7";

std::string_view leader_of(std::string_view whole) {
  const auto found = std::find_if(kLeaders.begin(), kLeaders.end(),
                                  [&](const auto& leader) { return leader.first == whole; });
  return found == kLeaders.end() ? std::string_view() : found->second;
}

using Turns = std::array<double, 3>;  // degrees: flexion, lateral bending, rotation

Turns turns_of(const Level& level) {
  return {level.flexion, level.lateral_bending, level.rotation};
}

// Of all levels that one joint leads, together.
Turns all_led_by(std::string_view whole) {
  Turns sum{};
  for (const Level& level : kLevels) {
    for (std::size_t a = 0; a < 3 && level.led_by == whole; ++a) sum[a] += turns_of(level)[a];
  }
  return sum;
}

// What each level turns, its own and that of absent ones, by the rows of kLevels.
std::array<Turns, kLevels.size()> taken_over(const std::set<std::string>& present) {
  std::array<Turns, kLevels.size()> out{};
  for (const auto& [whole, leader] : kLeaders) {
    std::vector<std::size_t> there;
    for (std::size_t l = 0; l < kLevels.size(); ++l) {
      if (kLevels[l].led_by == whole && present.contains(std::string(kLevels[l].segment))) there.push_back(l);
    }
    for (std::size_t l = 0; l < kLevels.size() && !there.empty(); ++l) {
      if (kLevels[l].led_by != whole) continue;
      const auto above = std::lower_bound(there.begin(), there.end(), l);
      const std::size_t to = above == there.end() ? there.back() : *above;
      for (std::size_t a = 0; a < 3; ++a) out[to][a] += turns_of(kLevels[l])[a];
    }
  }
  return out;
}

std::vector<AngleAxis> sequence() {
  return {{.name = "flexion", .axis = 0},
          {.name = "lateral_bending", .axis = 1},
          {.name = "rotation", .axis = 2}};
}

class Split {
 public:
  Split(const Skeleton& human, const std::set<std::string>& present, Ribs ribs)
      : human_(human), present_(present), ribs_(ribs), turns_(taken_over(present)) {}

  Skeleton run() {
    out_.name = human_.name;
    add(human_.segments.at(0), -1);
    for (const auto& [whole, leader] : kLeaders) add_leader(std::string(whole), std::string(leader));
    add_levels();
    for (const Segment& segment : human_.segments) {
      if (segment.parent < 0 || !leader_of(segment.name).empty()) continue;
      add(segment, place_of(human_.segments[static_cast<std::size_t>(segment.parent)].name));
    }
    return std::move(out_);
  }

 private:
  bool there(std::string_view segment) const { return present_.contains(std::string(segment)); }

  void add(Segment segment, int parent) {
    segment.parent = parent;
    out_.segments.push_back(std::move(segment));
  }

  void add_leader(const std::string& whole, const std::string& leader) {
    const int row = human_.find_segment(whole);
    if (row <= 0) return;
    Segment segment = human_.segments[static_cast<std::size_t>(row)];
    const Segment& parent = human_.segments[static_cast<std::size_t>(segment.parent)];
    const std::string_view above = leader_of(parent.name);
    segment.name = leader;
    segment.boneless = true;
    add(std::move(segment), out_.find_segment(above.empty() ? parent.name : std::string(above)));
  }

  // What hangs on a segment of `human`, on its split spine.
  int place_of(const std::string& segment) const {
    if (leader_of(segment).empty()) return out_.find_segment(segment);
    const int own = out_.find_segment(segment);  // the thorax, or the head
    return own >= 0 ? own : highest_of(segment);
  }

  // The highest level of a part of the spine, or of what is below it.
  int highest_of(std::string_view part) const {
    int row = 0;
    for (const Level& level : kLevels) {
      if (const int at = out_.find_segment(level.segment); at >= 0) row = at;
      if (&level == &kLevels.back() || (level.part == part && (&level + 1)->part != part)) break;
    }
    return row;
  }

  void add_levels() {
    int below = 0;
    for (std::size_t l = 0; l < kLevels.size(); ++l) {
      const Level& level = kLevels[l];
      if (level.segment == kLowestOfNeck && there(kThorax)) below = add_thorax(below);
      if (!there(level.segment)) continue;
      Segment segment;
      segment.name = level.segment;
      segment.joint = joint_of(level, turns_[l]);
      add(std::move(segment), below);
      below = static_cast<int>(out_.segments.size()) - 1;
    }
  }

  // The row that the neck hangs on: `below`, or the thorax where it has no vertebra.
  int add_thorax(int below) {
    Segment segment;
    segment.name = kThorax;
    segment.joint.rule = CenterRule::facing;
    segment.joint.sequence = sequence();
    const bool alone = none_led_by(kThorax);
    if (alone) {
      segment.joint.name = "t12_l1";
      follow(kThorax, all_led_by(kThorax), segment.joint);
    } else {
      segment.joint.name = ribs_ == Ribs::cage ? "costovertebral" : "sternocostal";
      segment.joint.kind = JointKind::fixed;
    }
    add(std::move(segment), alone ? below : ridden_on());
    return alone ? static_cast<int>(out_.segments.size()) - 1 : below;
  }

  // The level that the thorax rides on, else the next one below it, else the next above.
  int ridden_on() const {
    const std::string_view wanted = ribs_ == Ribs::cage ? kCageOn : kSternumOn;
    int row = -1;
    bool passed = false;
    for (const Level& level : kLevels) {
      const int at = out_.find_segment(level.segment);
      if (at >= 0 && (!passed || row < 0)) row = at;
      passed = passed || level.segment == wanted;
    }
    return row;
  }

  Joint joint_of(const Level& level, const Turns& turns) const {
    Joint joint;
    joint.name = level.joint;
    joint.rule = CenterRule::facing;
    joint.sequence = sequence();
    joint.limits_source = kSource;
    for (std::size_t a = 0; a < 3; ++a) {
      joint.sequence[a].max = turns[a] / degrees_per_radian;
      joint.sequence[a].min = -joint.sequence[a].max;
    }
    follow(level.led_by, turns, joint);
    // An atlas without the neck below it: it turns for all of that, too.
    if (level.part != level.led_by && none_led_by(level.part))
      follow(level.part, all_led_by(level.part), joint);
    return joint;
  }

  bool none_led_by(std::string_view part) const {
    return std::none_of(kLevels.begin(), kLevels.end(),
                        [&](const Level& level) { return level.led_by == part && there(level.segment); });
  }

  // Each angle by its share of the one of the same name, as far as that goes; after another's, as far again.
  void follow(std::string_view whole, const Turns& turns, Joint& joint) const {
    const int row = human_.find_segment(whole);
    if (row <= 0) return;
    const Joint& leader = human_.segments[static_cast<std::size_t>(row)].joint;
    const Turns all = all_led_by(whole);
    const bool another = !joint.coupled.empty();
    for (std::size_t a = 0; a < 3; ++a) {
      AngleAxis& own = joint.sequence[a];
      const double share = turns[a] / all[a];
      joint.coupled.push_back({leader.name, own.name, own.name, share});
      const auto led = std::find_if(leader.sequence.begin(), leader.sequence.end(),
                                    [&](const AngleAxis& angle) { return angle.name == own.name; });
      if (led == leader.sequence.end() || share == 0) continue;
      const double low = share * (led->min - led->rest), high = share * (led->max - led->rest);
      own.min = another ? own.min + low : std::min(own.min, low);
      own.max = another ? own.max + high : std::max(own.max, high);
    }
  }

  const Skeleton& human_;
  const std::set<std::string>& present_;
  Ribs ribs_;
  std::array<Turns, kLevels.size()> turns_;
  Skeleton out_;
};

}  // namespace

std::span<const Level> levels() {
  return kLevels;
}

const Level* find_level(std::string_view segment) {
  const auto found =
      std::find_if(kLevels.begin(), kLevels.end(), [&](const Level& l) { return l.segment == segment; });
  return found == kLevels.end() ? nullptr : &*found;
}

std::string whole_segment(const std::string& segment) {
  const Level* level = find_level(segment);
  return level == nullptr ? segment : std::string(level->part);
}

Skeleton split(const Skeleton& human, const std::set<std::string>& present, Ribs ribs) {
  return Split(human, present, ribs).run();
}

}  // namespace ecorche::spine
