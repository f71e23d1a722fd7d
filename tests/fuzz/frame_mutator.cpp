// SPDX-License-Identifier: Apache-2.0
#include "tests/fuzz/frame_mutator.hpp"

#include <algorithm>
#include <array>
#include <cstring>
#include <random>
#include <utility>
#include <vector>

#include <ecorche/wire/framing.hpp>
#include "tests/fuzz/wire_tree.hpp"

namespace ecorche::fuzz {
namespace {

using Dice = std::minstd_rand;

std::size_t draw(Dice& dice, std::size_t end) {
  return std::uniform_int_distribution<std::size_t>(0, end - 1)(dice);
}

struct RawFrame {
  std::string envelope, payload;
};

struct Input {
  std::string lead;  // the byte before the frames
  std::vector<RawFrame> frames;
};

std::uint32_t load(std::string_view bytes, std::size_t at) {
  std::uint32_t value = 0;
  std::memcpy(&value, bytes.data() + at, sizeof value);
  return value;
}

// The frames up to the first that is cut; what is behind it is lost.
Input read_frames(std::string_view bytes, bool led) {
  Input input;
  if (led) {
    input.lead = bytes.substr(0, 1);
    bytes.remove_prefix(input.lead.size());
  }
  while (bytes.size() >= wire::header_bytes) {
    const std::size_t envelope = load(bytes, 0), payload = load(bytes, 4);
    const std::size_t head = wire::aligned(wire::header_bytes + envelope);
    if (head > bytes.size() || payload > bytes.size() - head) break;
    input.frames.push_back(
        {std::string(bytes.substr(wire::header_bytes, envelope)), std::string(bytes.substr(head, payload))});
    bytes.remove_prefix(head + payload);
  }
  return input;
}

Input read_message(std::string_view bytes) {
  Input input;
  if (bytes.empty()) return input;
  const std::size_t size =
      std::min<std::size_t>(16 * static_cast<std::uint8_t>(bytes[0]), (bytes.size() - 1) / 16 * 16);
  input.frames.push_back({std::string(bytes.substr(1, bytes.size() - 1 - size)),
                          std::string(bytes.substr(bytes.size() - size))});
  return input;
}

std::string write(Form form, const Input& input) {
  if (form == Form::message) {
    const RawFrame& frame = input.frames.front();
    return static_cast<char>(std::min<std::size_t>(frame.payload.size() / 16, 255)) + frame.envelope +
           frame.payload;
  }
  std::string out = input.lead;
  for (const RawFrame& frame : input.frames) {
    const auto append = [&](std::size_t value) {
      const auto number = static_cast<std::uint32_t>(value);
      out.append(reinterpret_cast<const char*>(&number), sizeof number);
    };
    append(frame.envelope.size());
    append(frame.payload.size());
    out += frame.envelope;
    out.append(wire::aligned(wire::header_bytes + frame.envelope.size()) - wire::header_bytes -
                   frame.envelope.size(),
               '\0');
    out += frame.payload;
  }
  return out;
}

// Every list of fields of a tree, its own among them.
void lists_of(WireTree& tree, std::vector<WireTree*>& out) {
  out.push_back(&tree);
  for (WireField& field : tree) {
    if (field.fields) lists_of(*field.fields, out);
  }
}

std::uint64_t odd_number(Dice& dice, std::uint64_t was) {
  constexpr std::array<std::uint64_t, 14> odd{0,          1,          2,          15,         16,
                                              127,        0xffff,     0x7fffffff, 0x80000000, 0xffffffff,
                                              1ULL << 40, 1ULL << 62, 1ULL << 63, ~0ULL};
  // Of float and double: -0, infinities, the largest, the smallest, no number.
  constexpr std::array<std::uint64_t, 8> real{0x8000000000000000, 0x7ff0000000000000, 0xfff0000000000000,
                                              0x7fefffffffffffff, 0x7ff8000000000000, 0x3ff0000000000000,
                                              0x7f800000,         0x7fc00000};
  switch (draw(dice, 4)) {
    case 0:
      return odd[draw(dice, odd.size())];
    case 1:
      return real[draw(dice, real.size())];
    case 2:
      return was + draw(dice, 33) - 16;
    default:
      return was ^ std::uint64_t{1} << draw(dice, 64);
  }
}

// Any bytes, a little longer than they were at most.
void change_bytes(std::string& bytes, const ChangeBytes& change) {
  const std::size_t longest = bytes.size() + 64;
  bytes = change(std::move(bytes), longest);
}

WireField new_field(Dice& dice) {
  constexpr std::array<WireField::Kind, 4> kinds{WireField::Kind::varint, WireField::Kind::fixed64,
                                                 WireField::Kind::length, WireField::Kind::fixed32};
  WireField field{.number = static_cast<std::uint32_t>(1 + draw(dice, draw(dice, 2) == 0 ? 12 : 96)),
                  .kind = kinds[draw(dice, kinds.size())]};
  field.value = odd_number(dice, 1);
  if (field.kind == WireField::Kind::length && draw(dice, 2) == 0) field.fields.emplace();
  return field;
}

void change_tree(WireTree& tree, Dice& dice, const ChangeBytes& change) {
  std::vector<WireTree*> lists;
  lists_of(tree, lists);
  WireTree& list = *lists[draw(dice, lists.size())];
  const std::size_t what = draw(dice, 8);
  if (list.empty() || what == 0) return list.push_back(new_field(dice));
  const std::size_t row = draw(dice, list.size());
  WireField& field = list[row];
  switch (what) {
    case 1:
      list.erase(list.begin() + static_cast<std::ptrdiff_t>(row));
      return;
    case 2:
      list.push_back(WireField(field));
      return;
    case 3: {  // a field from anywhere, such as a list into itself
      const WireTree& from = *lists[draw(dice, lists.size())];
      if (!from.empty()) list.push_back(WireField(from[draw(dice, from.size())]));
      return;
    }
    case 4:
      field.number = static_cast<std::uint32_t>(1 + draw(dice, 96));
      return;
    case 5:
      std::swap(field, list[draw(dice, list.size())]);
      return;
    default:
      if (field.kind != WireField::Kind::length) {
        field.value = odd_number(dice, field.value);
      } else if (!field.fields) {
        change_bytes(field.bytes, change);
      } else {
        field.fields->push_back(new_field(dice));
      }
  }
}

void change_frames(Input& input, Dice& dice, const ChangeBytes& change) {
  auto& frames = input.frames;
  RawFrame& frame = frames[draw(dice, frames.size())];
  const std::size_t what = draw(dice, 12);
  if (what == 0) {
    std::swap(frame, frames[draw(dice, frames.size())]);
  } else if (what == 1) {
    frames.push_back(RawFrame(frame));
  } else if (what == 2 && frames.size() > 1) {
    frames.erase(frames.begin() + static_cast<std::ptrdiff_t>(draw(dice, frames.size())));
  } else if (what == 3) {
    change_bytes(frame.payload, change);
    frame.payload.resize(wire::aligned(frame.payload.size()));
  } else if (std::optional<WireTree> tree = parse_wire(frame.envelope)) {
    for (std::size_t i = 0, times = 1 + draw(dice, 4); i < times; ++i) change_tree(*tree, dice, change);
    frame.envelope = write_wire(*tree);
  } else {
    change_bytes(frame.envelope, change);
  }
}

Input read(Form form, std::string_view bytes) {
  return form == Form::message ? read_message(bytes) : read_frames(bytes, form == Form::led_frames);
}

}  // namespace

Form form_of(std::string_view target) {
  if (target == "framing" || target == "requests") return Form::led_frames;
  if (target == "messages") return Form::message;
  return target == "meshes" || target == "volumes" || target == "recording" ? Form::frames : Form::none;
}

std::string mutate_frames(Form form, const std::string& input, std::size_t most, unsigned seed,
                          const ChangeBytes& change) {
  Dice dice(seed);
  Input frames = form == Form::none ? Input{} : read(form, input);
  if (!frames.frames.empty() && draw(dice, 8) != 0) {
    change_frames(frames, dice, change);
    std::string out = write(form, frames);
    if (out.size() <= most) return out;
  }
  return change(input, most);
}

std::string cross_frames(Form form, const std::string& a, const std::string& b, std::size_t most,
                         unsigned seed) {
  Dice dice(seed);
  Input first, second;
  if (form != Form::none) {
    first = read(form, a);
    second = read(form, b);
  }
  std::string out;
  if (first.frames.empty() || second.frames.empty()) {
    out = a.substr(0, draw(dice, a.size() + 1)) + b.substr(draw(dice, b.size() + 1));
  } else if (const RawFrame& taken = second.frames[draw(dice, second.frames.size())]; form == Form::message) {
    first.frames.front().payload = taken.payload;
    out = write(form, first);
  } else {
    const std::size_t at = draw(dice, first.frames.size() + 1);
    first.frames.insert(first.frames.begin() + static_cast<std::ptrdiff_t>(at), taken);
    out = write(form, first);
  }
  return out.substr(0, most);
}

}  // namespace ecorche::fuzz
