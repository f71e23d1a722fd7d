// SPDX-License-Identifier: Apache-2.0
#include "io/motion/amc.hpp"

#include <algorithm>
#include <map>
#include <vector>

#include <ecorche/values/error.hpp>
#include "core/files/look.hpp"
#include "io/motion/asf_parser.hpp"
#include "io/motion/frame_rows.hpp"

namespace ecorche::io {
namespace {

using Eigen::Quaterniond;
using Eigen::Vector3d;

constexpr double kFrameSeconds = 1.0 / 120;  // the file does not say; CMU's rate

class AmcFile final : public ClipFile {
 public:
  AmcFile(TextStream amc, TextStream asf, const std::string& name, const MotionSpace& space)
      : space_(space), skeleton_(asf::parse(asf)), rows_(rows(std::move(amc))) {
    head_.name = name;
    head_.frame_seconds = kFrameSeconds;
    for (const asf::Bone& bone : skeleton_.bones) {
      Vector3d offset = Vector3d::Zero();
      if (bone.parent >= 0) offset = skeleton_.bones[static_cast<std::size_t>(bone.parent)].offset;
      head_.joints.push_back({bone.name, bone.parent, unit() * space_.direction(offset)});
    }
    frames_ = rows_.frames();
  }

  void read(std::size_t frame, Vector3d& root, std::span<Quaterniond> rotation) override {
    const std::span<const double> row = rows_.row(frame);
    Vector3d position = Vector3d::Zero();
    const auto& order = skeleton_.bones[0].freedoms;
    for (std::size_t i = 0; i < order.size(); ++i) {
      if (order[i] >= 3 && order[i] < 6) position[order[i] - 3] = row[i];
    }
    root = unit() * space_.direction(position);
    for (std::size_t b = 0; b < skeleton_.bones.size(); ++b) {
      const asf::Bone& bone = skeleton_.bones[b];
      const Quaterniond turn = asf::turn_of(bone.freedoms, row.data() + first_[b], skeleton_.radians);
      rotation[b] = space_.turn(bone.axis * turn * bone.axis.conjugate()).normalized();
    }
  }

 private:
  double unit() const { return space_.unit_mm.value_or(skeleton_.unit_mm); }

  FrameRows rows(TextStream amc) {
    std::size_t columns = 0;
    for (std::size_t b = 0; b < skeleton_.bones.size(); ++b) {
      first_.push_back(columns);
      columns += skeleton_.bones[b].freedoms.size();
      row_[skeleton_.bones[b].name] = b;
      moving_ += skeleton_.bones[b].freedoms.empty() ? 0 : 1;
    }
    // Before the first frame: comments, and words that begin with a colon.
    while (amc.peek().starts_with('#') || amc.peek().starts_with(':')) {
      const std::string word(amc.peek());
      if (word == ":RADIANS" && skeleton_.radians != 1)
        amc.fail("its angles are in radians, its skeleton's in degrees");
      bool more = true;
      amc.line(more);
    }
    return {std::move(amc), columns, [this](TextStream& in, std::size_t frame, std::span<double> values) {
              return read_frame(in, frame, values);
            }};
  }

  // `number`, then every bone that moves with its values, in any order.
  bool read_frame(TextStream& in, std::size_t frame, std::span<double> values) {
    if (in.peek().empty()) return false;
    const std::uint64_t number = in.count(std::uint64_t{1} << 48);
    if (frame == 0) begin_ = number;
    if (number != begin_ + frame)
      in.fail("frame " + std::to_string(number) + " stands where " + std::to_string(begin_ + frame) +
              " should");
    met_.assign(skeleton_.bones.size(), 0);
    for (std::size_t i = 0; i < moving_; ++i) {
      const std::string_view word = in.word();
      const auto found = row_.find(word);
      if (found == row_.end()) in.unexpected("a bone of the skeleton", word);
      const std::size_t b = found->second;
      if (met_[b] != 0) in.fail("the bone '" + found->first + "' stands twice in one frame");
      met_[b] = 1;
      if (skeleton_.bones[b].freedoms.empty())
        in.fail("the bone '" + found->first + "' has no degree of freedom in its skeleton");
      for (std::size_t k = 0; k < skeleton_.bones[b].freedoms.size(); ++k)
        values[first_[b] + k] = in.number();
    }
    return true;
  }

  MotionSpace space_;
  asf::File skeleton_;
  std::vector<std::size_t> first_;
  std::map<std::string, std::size_t, std::less<>> row_;
  std::size_t moving_ = 0;
  std::uint64_t begin_ = 1;
  std::vector<char> met_;
  FrameRows rows_;
};

}  // namespace

std::unique_ptr<ClipFile> open_amc(TextStream amc, TextStream asf, const std::string& name,
                                   const MotionSpace& space) {
  if (space.unit_mm) check_unit(*space.unit_mm);
  return std::make_unique<AmcFile>(std::move(amc), std::move(asf), name, space);
}

std::unique_ptr<ClipFile> open_amc(const std::filesystem::path& amc, const std::filesystem::path& asf,
                                   const MotionSpace& space) {
  TextStream frames = TextStream::open(amc);
  return open_amc(std::move(frames), TextStream::open(asf), amc.stem().string(), space);
}

std::filesystem::path asf_of(const std::filesystem::path& amc) {
  if (!files::is_file(amc)) TextStream::open(amc);  // tells what is wrong with it
  std::filesystem::path same = amc;
  same.replace_extension(".asf");
  if (files::is_file(same)) return same;
  const std::string stem = amc.stem().string();
  const std::filesystem::path folder = amc.has_parent_path() ? amc.parent_path() : ".";
  std::filesystem::path subject = folder / (stem.substr(0, stem.find('_')) + ".asf");
  if (files::is_file(subject)) return subject;
  std::vector<std::filesystem::path> found;
  std::error_code ignored;
  for (const auto& entry : std::filesystem::directory_iterator(folder, ignored)) {
    if (entry.path().extension() == ".asf") found.push_back(entry.path());
  }
  if (found.size() == 1) return found[0];
  throw Error(ErrorKind::missing_input, amc.string(),
              "its skeleton is not beside it: " + std::to_string(found.size()) + " .asf files are",
              "name it by --asf FILE");
}

}  // namespace ecorche::io
