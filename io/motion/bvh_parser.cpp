// SPDX-License-Identifier: Apache-2.0
// Ours, since assimp's reader works in float32 (up to 7e-5 degrees off on the CMU clips) and needs a guard
// that reads as strictly as this. The tests ask assimp for a second opinion on every rotation order.
#include "io/motion/bvh_parser.hpp"

#include <algorithm>
#include <set>

#include "core/values/text.hpp"

namespace ecorche::io::bvh {
namespace {

constexpr std::size_t kMostJoints = 4096, kMostDepth = 256, kLongestName = 256;

class BvhParser {
 public:
  explicit BvhParser(TextStream& stream) : in_(stream) {}

  Header parse() {
    in_.expect("HIERARCHY");
    in_.expect("ROOT");
    hierarchy();
    in_.expect("MOTION");
    motion();
    return std::move(header_);
  }

 private:
  // Names run to the end of their line, or to their brace: some tools put spaces in them.
  std::string name() {
    const TextStream::Mark begin = in_.mark();
    bool more = true;
    const std::string_view line = in_.line(more);
    const std::size_t brace = line.find('{');
    std::string out(text::trim(line.substr(0, brace)));
    in_.seek({begin.byte + std::min(brace, line.size()), begin.line});
    if (out.empty() || out.size() > kLongestName)
      in_.fail("a joint has no name, or one of more than 256 letters");
    return out;
  }

  void add_joint(int parent) {
    if (header_.joints.size() >= kMostJoints)
      in_.fail("more than " + std::to_string(kMostJoints) + " joints");
    FileJoint joint;
    joint.parent = parent;
    joint.name = name();
    if (!names_.insert(joint.name).second)
      in_.fail("the joint '" + joint.name + "' stands twice", "give each joint its own name");
    in_.expect("{");
    in_.expect("OFFSET");
    for (double& x : joint.offset) x = in_.number();
    in_.expect("CHANNELS");
    joint.channels.resize(in_.count(6));
    for (Channel& channel : joint.channels) channel = read_channel();
    auto sorted = joint.channels;
    std::sort(sorted.begin(), sorted.end());
    if (std::adjacent_find(sorted.begin(), sorted.end()) != sorted.end()) {
      in_.fail("a channel of '" + joint.name + "' stands twice");
    }
    header_.channels += joint.channels.size();
    header_.joints.push_back(std::move(joint));
  }
  Channel read_channel() {
    constexpr std::array<std::string_view, 6> names{"xposition", "yposition", "zposition",
                                                    "xrotation", "yrotation", "zrotation"};
    const std::string_view met = in_.word();
    const auto found = std::find(names.begin(), names.end(), text::lower(met.substr(0, 16)));
    if (found == names.end()) in_.unexpected("a channel such as Xrotation", met);
    return static_cast<Channel>(found - names.begin());
  }

  // After ROOT: the joints, without recursion.
  void hierarchy() {
    add_joint(-1);
    std::vector<int> open{0};
    while (!open.empty()) {
      const std::string_view met = in_.word();
      if (met == "}") {
        open.pop_back();
      } else if (met == "JOINT") {
        if (open.size() >= kMostDepth) in_.fail("joints nested deeper than " + std::to_string(kMostDepth));
        add_joint(open.back());
        open.push_back(static_cast<int>(header_.joints.size()) - 1);
      } else if (met == "End") {
        in_.expect("Site");
        in_.expect("{");
        in_.expect("OFFSET");
        for (int k = 0; k < 3; ++k) in_.number();
        in_.expect("}");
      } else {
        in_.unexpected("JOINT, End Site or '}'", met);
      }
    }
  }

  void motion() {
    in_.expect("Frames:");
    header_.frames = in_.count(std::uint64_t{1} << 48);
    if (header_.frames == 0) in_.fail("has no frame");
    in_.expect("Frame");
    in_.expect("Time:");
    header_.frame_seconds = in_.number();
    if (!(header_.frame_seconds > 0)) in_.fail("its frame time is not positive");
    if (header_.channels == 0) in_.fail("no joint has a channel");
    // Every value takes two bytes at least: a count that lies cannot make anything large.
    if (header_.frames > in_.size() / (2 * header_.channels) + 1)
      in_.fail("says " + std::to_string(header_.frames) + " frames, more than the file can hold");
  }

  TextStream& in_;
  std::set<std::string> names_;
  Header header_;
};

}  // namespace

Header read_header(TextStream& stream) {
  return BvhParser(stream).parse();
}

bool read_frame(TextStream& stream, const Header& header, std::size_t frame, std::span<double> values) {
  if (frame == header.frames) {
    if (const std::string_view rest = stream.word(); !rest.empty())
      stream.unexpected("the file's end after the last frame", rest);
    return false;
  }
  for (double& value : values) value = stream.number();
  return true;
}

}  // namespace ecorche::io::bvh
