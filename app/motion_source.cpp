// SPDX-License-Identifier: Apache-2.0
#include "app/motion_source.hpp"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstdio>

#include <ecorche/values/error.hpp>
#include "app/cli.hpp"
#include "app/marker_source.hpp"
#include "app/read_budget.hpp"
#include "app/usage_error.hpp"
#include "core/values/degrees.hpp"
#include "core/values/text.hpp"
#include "io/case/frame.hpp"
#include "io/case/motion_map.hpp"
#include "io/case/pose_sequence.hpp"
#include "io/motion/clip_file.hpp"
#include "io/motion/table_file.hpp"

namespace ecorche::app {
namespace {

// Times the patient. Statures of adults from the 1st percentile of women (1.48 m) to the 99th of men (1.92 m,
// ANSUR II: Gordon et al. 2014) differ by 1.3; an inch taken for a centimetre by 2.54.
constexpr double kStrangeSize = 1.4, kWrongSize = 20;
constexpr double kFits = 1.25;
constexpr double kNoBody = 120 / degrees_per_radian;  // a limb that points so far off is in no zero pose
constexpr double kNoted = 5 / degrees_per_radian;     // of an alignment, else any two bodies differ so
constexpr std::size_t kTried = 64;                    // frames in which a reference and bends are looked for

std::string degrees(double radians) {
  return std::to_string(std::lround(radians * degrees_per_radian));
}

// The first names of a long list.
std::string some(const std::vector<std::string>& names) {
  std::string out;
  for (std::size_t i = 0; i < names.size() && i < 6; ++i) out += (i == 0 ? "" : ", ") + names[i];
  return names.size() > 6 ? out + " and " + std::to_string(names.size() - 6) + " more" : out;
}

std::optional<std::size_t> whole(std::string_view text) {
  std::size_t value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (text.empty() || error != std::errc() || end != text.data() + text.size()) return std::nullopt;
  return value;
}

std::optional<double> decimal(std::string_view text) {
  double value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || end != text.data() + text.size() || !(value >= 0) || value > 1e6)
    return std::nullopt;
  return value;
}

[[noreturn]] void no_reference(const std::string& word) {
  usage_error("--motion-rest", "'" + word + "' is no reference",
              "use auto, zero, clip, FRAME, SECONDSs or CLIP:FRAME");
}

kinematics::ClipFrame frame_of(io::ClipFile& clip, std::size_t frame) {
  kinematics::ClipFrame out;
  out.rotation.resize(clip.head().joints.size());
  clip.read(frame, out.root_position, out.rotation);
  return out;
}

// A clip of joints, retargeted.
class ClipSource final : public MotionSource {
 public:
  ClipSource(const Program& program, const MotionChoice& choice, const Rig& rig)
      : rig_(rig),
        path_(choice.file.string()),
        clip_(io::open_clip(choice.file, motion_space(choice), choice.asf)) {
    kinematics::NameMap names;
    if (!choice.map.empty()) names = io::read_motion_map(choice.map, rig).joints;
    match_ = kinematics::match(rig, clip_->head(), names);
    if (!match_.unused_joints.empty())
      program.note("warning: " + path_ + ": " + some(match_.unused_joints) +
                   " moves nothing of this model (assign it by --map FILE)");
    find_bends();
    align(choice);
    note_alignment(program);
    check_size(program, choice);
  }

  std::size_t frames() const override { return clip_->frames(); }
  double frame_seconds() const override { return clip_->head().frame_seconds; }
  Pose at(std::size_t frame) override {
    return kinematics::pose_at(rig_, clip_->head(), match_, frame_of(*clip_, frame));
  }
  const kinematics::Retarget* retarget() const override { return &match_; }

 private:
  // Frames over the whole clip, few enough to be read before it plays.
  std::size_t tried_step() const { return std::max<std::size_t>(1, clip_->frames() / kTried); }

  void find_bends() {
    std::vector<kinematics::ClipFrame> frames;
    for (std::size_t f = 0; f < clip_->frames(); f += tried_step()) frames.push_back(frame_of(*clip_, f));
    kinematics::find_bends(rig_, clip_->head(), frames, match_);
  }

  void align(const MotionChoice& choice) {
    reference = "the zero pose";
    if (choice.rest == "zero") return;
    if (choice.rest == "auto") {
      // Then the zero pose is no pose of a body.
      if (match_.limbs.worst > kNoBody) align_over_clip();
      return;
    }
    if (choice.rest == "clip") return align_over_clip();
    if (choice.rest.ends_with('s')) {
      const auto seconds = decimal(std::string_view(choice.rest).substr(0, choice.rest.size() - 1));
      if (!seconds) no_reference(choice.rest);
      return align_at(*clip_, static_cast<std::size_t>(std::lround(*seconds / clip_->head().frame_seconds)),
                      choice.rest);
    }
    const std::size_t colon = choice.rest.rfind(':');
    const auto frame = whole(colon == std::string::npos ? choice.rest : choice.rest.substr(colon + 1));
    if (!frame) no_reference(choice.rest);
    if (colon == std::string::npos) return align_at(*clip_, *frame, "frame " + std::to_string(*frame));
    const auto other = io::open_clip(choice.rest.substr(0, colon), motion_space(choice), choice.asf);
    // The same joints in another order, or with others beside them, are found by their names.
    const Clip& head = clip_->head();
    kinematics::ClipFrame named;
    if (*frame >= other->frames())
      usage_error("--motion-rest", "the clip has " + std::to_string(other->frames()) + " frames",
                  "count from 0");
    const kinematics::ClipFrame read = frame_of(*other, *frame);
    const kinematics::ClipPlaces places = kinematics::places(other->head(), read);
    named.root_position = read.root_position;
    std::vector<Eigen::Quaterniond> global(head.joints.size(), Eigen::Quaterniond::Identity());
    for (std::size_t j = 0; j < head.joints.size(); ++j) {
      const auto parent = head.joints[j].parent;
      const Eigen::Quaterniond above =
          parent < 0 ? Eigen::Quaterniond::Identity() : global[static_cast<std::size_t>(parent)];
      global[j] = above;
      for (std::size_t k = 0; k < other->head().joints.size(); ++k) {
        if (other->head().joints[k].name == head.joints[j].name) global[j] = places.turn[k];
      }
      named.rotation.push_back((above.conjugate() * global[j]).normalized());
    }
    kinematics::align_at(rig_, head, std::span(&named, 1), match_);
    reference = choice.rest;
  }

  void align_at(io::ClipFile& clip, std::size_t frame, const std::string& name) {
    if (frame >= clip.frames())
      usage_error("--motion-rest", "the clip has frames 0 to " + std::to_string(clip.frames() - 1),
                  "name one of them");
    const kinematics::ClipFrame read = frame_of(clip, frame);
    kinematics::align_at(rig_, clip_->head(), std::span(&read, 1), match_);
    reference = name;
  }

  // At frames over the whole clip, that which is nearest to the scan's pose first.
  void align_over_clip() {
    std::vector<kinematics::ClipFrame> frames;
    std::size_t best = 0;
    double least = std::numeric_limits<double>::infinity();
    for (std::size_t f = 0; f < clip_->frames(); f += tried_step()) {
      frames.push_back(frame_of(*clip_, f));
      const auto places = kinematics::places(clip_->head(), frames.back());
      const auto limbs = kinematics::check_limbs(rig_, places, match_.clip_joint);
      if (limbs.rms >= least) continue;
      least = limbs.rms;
      best = f;
    }
    std::swap(frames[0], frames[best / tried_step()]);
    kinematics::align_at(rig_, clip_->head(), frames, match_);
    reference = "the clip, most of all at frame " + std::to_string(best);
  }

  // Where the reference is not the scan's pose.
  void note_alignment(const Program& program) const {
    for (std::size_t s = 0; s < match_.rest_turn.size(); ++s) {
      const int parent = rig_.skeleton.segments[s].parent;
      if (parent < 0) continue;
      const double angle =
          match_.rest_turn[s].angularDistance(match_.rest_turn[static_cast<std::size_t>(parent)]);
      if (angle < kNoted) continue;
      program.note("note: in " + (reference == "the zero pose" ? "the clip's zero pose" : reference) + " " +
                   rig_.skeleton.segments[s].name + " is turned by " + degrees(angle) +
                   " degrees from the scan's; aligned");
    }
  }

  void check_size(const Program& program, const MotionChoice& choice) {
    const double figure = match_.limbs.figure;
    if (match_.limbs.limbs == 0) return;
    if (choice.unit == "body") {
      match_.scale = 1 / figure;
      return;
    }
    const std::string size = text::number(figure) + " times as long as the patient's";
    if (figure > kWrongSize || figure < 1 / kWrongSize) {
      throw Error(ErrorKind::data, path_, "the limbs of its figure are " + size + ": its unit is another",
                  "say it by --motion-unit, or fit it to the patient by --motion-unit body");
    }
    if (figure > kStrangeSize || figure < 1 / kStrangeSize)
      program.note("warning: " + path_ + ": the limbs of its figure are " + size + read_in(choice) +
                   other_unit(choice, figure) + ": --motion-unit body would fit them to the patient");
  }

  // Millimetres of the unit that it was read in, where that is not the file's own.
  double unit_read_in(const MotionChoice& choice) const {
    if (const auto given = motion_space(choice).unit_mm) return *given;
    return choice.file.extension() == ".bvh" ? 10 : 0;
  }
  std::string read_in(const MotionChoice& choice) const {
    if (!choice.unit.empty()) return ", read in " + choice.unit;
    return unit_read_in(choice) > 0 ? ", read in cm" : "";
  }
  // The usual unit that makes the figure the patient's.
  std::string other_unit(const MotionChoice& choice, double figure) const {
    const double used = unit_read_in(choice);
    for (const char* name : {"mm", "cm", "in", "m"}) {
      const double made = used > 0 ? figure * *io::unit_from_name(name) / used : 0;
      if (made < kFits && made > 1 / kFits)
        return ": --motion-unit " + std::string(name) + " would make that " + text::number(made);
    }
    return "";
  }

  const Rig& rig_;
  std::string path_;
  std::unique_ptr<io::ClipFile> clip_;
  kinematics::Retarget match_;
};

// OpenSim's coordinates on the rig's own angles.
class AngleSource final : public MotionSource {
 public:
  AngleSource(const Program& program, const MotionChoice& choice, const Rig& rig)
      : rig_(rig), file_(io::TextStream::open(choice.file)) {
    if (!choice.unit.empty() || !choice.frame.empty() || !choice.asf.empty())
      usage_error("--motion",
                  choice.file.string() + " is a table of angles: it has no unit, frame or skeleton",
                  "leave out --motion-unit, --motion-frame and --asf");
    reference = "the anatomical zero";
    io::MotionMap map = io::opensim_map(rig);
    if (!choice.map.empty()) {
      for (auto& [column, shares] : io::read_motion_map(choice.map, rig).angles) map.angles[column] = shares;
    }
    std::vector<std::string> unused;
    std::size_t used = 0;
    for (std::size_t c = 0; c < file_.columns().size(); ++c) {
      const std::string& name = file_.columns()[c];
      const auto root = std::find(kRoot.begin(), kRoot.end(), name);
      root_.push_back(root == kRoot.end() ? -1 : static_cast<int>(root - kRoot.begin()));
      const auto found = map.angles.find(name);
      shares_.push_back(found == map.angles.end() ? std::vector<io::AngleShare>() : found->second);
      if (shares_.back().empty() && root_.back() < 0) unused.push_back(name);
      used += shares_.back().empty() ? 0 : 1;
    }
    if (used == 0)
      throw Error(ErrorKind::data, choice.file.string(),
                  "none of its columns (" + some(file_.columns()) + ") is an angle of this model",
                  "say by --map FILE what they mean");
    if (!unused.empty())
      program.note("warning: " + choice.file.string() + ": " + some(unused) +
                   " moves nothing of this model (assign it by --map FILE)");
    // The pelvis of OpenSim stands in the ground's frame: its way is told from the first frame.
    const auto first = file_.read(0);
    for (std::size_t c = 0; c < root_.size(); ++c) {
      if (root_[c] >= 0) home_[static_cast<std::size_t>(root_[c])] = first[c];
    }
  }

  std::size_t frames() const override { return file_.frames(); }
  double frame_seconds() const override { return file_.frame_seconds(); }

  Pose at(std::size_t frame) override {
    const auto row = file_.read(frame);
    const double unit = file_.in_degrees() ? 1 / degrees_per_radian : 1;
    std::array<double, 6> root{0, 0, 0, 0, 0, 0};
    std::vector<kinematics::AngleValue> values;
    for (std::size_t c = 0; c < row.size(); ++c) {
      if (root_[c] >= 0) root[static_cast<std::size_t>(root_[c])] = row[c];
      for (const io::AngleShare& share : shares_[c])
        values.push_back({share.angle, share.scale * unit * row[c]});
    }
    Pose pose = kinematics::pose_of(rig_.skeleton, values);
    // OpenSim: x Anterior, y Superior, z Right; the pelvis turns about z, then x, then y.
    const io::MotionSpace space{*io::axes_from_code("ASR"), 1000.0};
    const auto about = [&](std::size_t k, int axis) {
      return Eigen::Quaterniond(Eigen::AngleAxisd(unit * root[k], Eigen::Vector3d::Unit(axis)));
    };
    const Eigen::Quaterniond turn = space.turn(about(3, 2) * about(4, 0) * about(5, 1));
    const Eigen::Vector3d v = rig_.skeleton.segments[0].joint.axes.transpose() * turn.vec();
    pose.rotation[0] = Eigen::Quaterniond(turn.w(), v.x(), v.y(), v.z());
    pose.root_translation =
        *space.unit_mm * space.direction({root[0] - home_[0], root[1] - home_[1], root[2] - home_[2]});
    return pose;
  }

 private:
  static constexpr std::array<std::string_view, 6> kRoot{"pelvis_tx",   "pelvis_ty",   "pelvis_tz",
                                                         "pelvis_tilt", "pelvis_list", "pelvis_rotation"};
  const Rig& rig_;
  io::AngleFile file_;
  std::vector<int> root_;
  std::vector<std::vector<io::AngleShare>> shares_;
  std::array<double, 6> home_{0, 0, 0, 0, 0, 0};
};

class SequenceSource final : public MotionSource {
 public:
  SequenceSource(const Program& program, const MotionChoice& choice, const Rig& rig)
      : sequence_(io::read_pose_sequence(choice.file, rig)) {
    reference = "the scan";
    if (!sequence_.left_out.empty())
      program.note("warning: the model has no " + some(sequence_.left_out) + " (these stay as scanned)");
  }
  std::size_t frames() const override { return sequence_.frames(); }
  double frame_seconds() const override { return sequence_.frame_seconds; }
  Pose at(std::size_t frame) override { return sequence_.at(frame); }

 private:
  io::PoseSequence sequence_;
};

}  // namespace

io::MotionSpace motion_space(const MotionChoice& choice) {
  io::MotionSpace space;
  space.limits = choice.limits;
  if (!choice.frame.empty()) {
    const auto axes = io::axes_from_code(choice.frame);
    if (!axes)
      usage_error("--motion-frame", "'" + choice.frame + "' names no axes",
                  "use three letters such as LSA or RAS");
    space.axes = *axes;
  }
  if (!choice.unit.empty() && choice.unit != "body") {
    space.unit_mm = io::unit_from_name(choice.unit);
    if (!space.unit_mm)
      usage_error("--motion-unit", "'" + choice.unit + "' is no unit",
                  "use um, mm, cm, m, in, millimetres a unit such as 56.44, or body");
  }
  return space;
}

void add_motion_options(CLI::App& command, MotionChoice& choice, bool with_file) {
  if (with_file)
    command.add_option("--motion", choice.file,
                       "a motion: .bvh, .amc, .gltf, .glb, .mot, .trc, or a pose sequence .yaml");
  command.add_option(
      "--motion-unit", choice.unit,
      "length of one unit of the clip: um, mm, cm, m, in, millimetres, or body (its figure as long as "
      "the patient); default: the file's own, cm for .bvh");
  command.add_option("--motion-frame", choice.frame,
                     "axes of the clip: three letters, default LSA (y up, facing z)");
  command
      .add_option(
          "--motion-rest", choice.rest,
          "the clip's pose that is held against the scan: zero, clip (its frames in the mean, those near "
          "the scan most of all), FRAME, SECONDSs, CLIP:FRAME, or auto (zero, or clip where that is no "
          "pose of a body)")
      ->capture_default_str();
  add_read_budget(command, choice.limits);
  command.add_option("--asf", choice.asf, "skeleton of an .amc; default: the one beside it");
  command.add_option("--map", choice.map,
                     "a motion map: which joint, angle or marker of the file moves what");
}

std::unique_ptr<MotionSource> open_motion(const Program& program, const MotionChoice& choice,
                                          const Rig& rig) {
  const std::string ending = choice.file.extension().string();
  if (ending == ".mot" || ending == ".sto") return std::make_unique<AngleSource>(program, choice, rig);
  if (ending == ".trc") return open_markers(program, choice, rig);
  if (ending == ".yaml" || ending == ".yml") return std::make_unique<SequenceSource>(program, choice, rig);
  return std::make_unique<ClipSource>(program, choice, rig);
}

}  // namespace ecorche::app
