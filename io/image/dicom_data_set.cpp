// SPDX-License-Identifier: Apache-2.0
// https://dicom.nema.org/medical/dicom/current/output/chtml/part05/chapter_7.html
#include "io/image/dicom_data_set.hpp"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <fstream>
#include <utility>

#include "core/values/text.hpp"
#include "io/image/header_fields.hpp"

namespace ecorche::io::dicom {
namespace {

using fields::refuse;
namespace fs = std::filesystem;

constexpr std::size_t kPreamble = 132, kFirstRead = std::size_t{1} << 15;
constexpr int kDeepest = 16;  // a SEG's own sequences are 5 deep
constexpr std::uint32_t kUndefined = 0xffffffff;
constexpr Tag kItem = 0xfffee000, kItemEnd = 0xfffee00d, kSequenceEnd = 0xfffee0dd;
constexpr Tag kPixels = 0x7fe00010, kSyntax = 0x00020010, kTextSet = 0x00080005;

struct KnownSyntax {
  std::string_view uid;
  Syntax syntax;
};
constexpr std::array<KnownSyntax, 14> kKnown{{
    {"1.2.840.10008.1.2", {false, false, Packing::none}},
    {"1.2.840.10008.1.2.1", {true, false, Packing::none}},
    {"1.2.840.10008.1.2.2", {true, true, Packing::none}},
    {"1.2.840.10008.1.2.5", {true, false, Packing::rle}},
    {"1.2.840.10008.1.2.4.50", {true, false, Packing::jpeg}},
    {"1.2.840.10008.1.2.4.51", {true, false, Packing::jpeg}},
    {"1.2.840.10008.1.2.4.53", {true, false, Packing::jpeg}},
    {"1.2.840.10008.1.2.4.55", {true, false, Packing::jpeg}},
    {"1.2.840.10008.1.2.4.57", {true, false, Packing::jpeg_lossless}},
    {"1.2.840.10008.1.2.4.70", {true, false, Packing::jpeg_lossless}},
    {"1.2.840.10008.1.2.4.80", {true, false, Packing::jpeg_ls}},
    {"1.2.840.10008.1.2.4.81", {true, false, Packing::jpeg_ls}},
    {"1.2.840.10008.1.2.4.90", {true, false, Packing::jpeg_2000}},
    {"1.2.840.10008.1.2.4.91", {true, false, Packing::jpeg_2000}},
}};

// Thrown where the head ends: a longer one is read then.
struct TooShort {};

bool is_long(std::string_view vr) {
  constexpr std::array<std::string_view, 12> kLong{"OB", "OD", "OF", "OL", "OV", "OW",
                                                   "SQ", "SV", "UC", "UN", "UR", "UT"};
  return vr == "UV" || std::find(kLong.begin(), kLong.end(), vr) != kLong.end();
}

bool is_vr(std::string_view vr) {
  return vr.size() == 2 && vr[0] >= 'A' && vr[0] <= 'Z' && vr[1] >= 'A' && vr[1] <= 'Z';
}

std::uint32_t number_at(std::string_view bytes, std::size_t size, bool big) {
  std::uint32_t out = 0;
  for (std::size_t i = 0; i < size; ++i) {
    const auto byte = static_cast<std::uint32_t>(static_cast<unsigned char>(bytes[i]));
    out |= byte << 8 * (big ? size - 1 - i : i);
  }
  return out;
}

class Parser {
 public:
  Parser(DataSet& set, std::string_view head, std::uint64_t file_bytes)
      : set_(set), head_(head), file_bytes_(file_bytes) {}

  void parse() {
    Syntax syntax = set_.syntax;
    if (head_.substr(0, kPreamble).ends_with("DICM") && head_.size() >= kPreamble) {
      at_ = kPreamble;
      syntax = meta();
    } else {
      syntax = {.is_explicit = is_vr(head_.substr(4, 2)), .big_endian = false, .packing = Packing::none};
    }
    set_.syntax = syntax;
    set_.shared_syntax = std::make_shared<const Syntax>(syntax);
    elements(set_.top, file_bytes_, 0);
    if (const Element* text_set = set_.top.find(kTextSet))
      set_.text_set = std::make_shared<const std::string>(text::lower(text_set->value));
    adopt(set_.top);
  }

 private:
  [[noreturn]] void broken(const std::string& what) const {
    refuse(set_.path, what + " at byte " + std::to_string(at_), "copy it from the archive again");
  }

  std::string_view take(std::uint64_t bytes) {
    if (bytes > file_bytes_ - at_) broken("its elements are longer than the file, which is cut or damaged,");
    if (at_ + bytes > head_.size()) throw TooShort();
    const std::string_view out = head_.substr(at_, static_cast<std::size_t>(bytes));
    at_ += bytes;
    return out;
  }
  std::uint32_t take_number(std::size_t size) { return number_at(take(size), size, set_.syntax.big_endian); }
  Tag take_tag() {
    const std::uint32_t group = take_number(2);
    return group << 16 | take_number(2);
  }

  // Group 2, always explicit and little endian.
  Syntax meta() {
    set_.syntax = Syntax();
    std::string uid;
    while (at_ < file_bytes_) {
      const std::uint64_t before = at_;
      if (take_tag() >> 16 != 2) {
        at_ = before;
        break;
      }
      at_ = before;
      Element element;
      if (!next(element, 0)) break;
      if (element.tag == kSyntax) uid = text::trim(element.value.substr(0, element.value.find('\0')));
    }
    const auto known =
        std::find_if(kKnown.begin(), kKnown.end(), [&](const KnownSyntax& one) { return one.uid == uid; });
    if (uid.empty() || known == kKnown.end()) {
      refuse(set_.path,
             uid.empty() ? std::string("does not tell its transfer syntax")
                         : "its transfer syntax " + uid + " cannot be read",
             "unpack it: gdcmconv --raw IN OUT, or dcmconv +te IN OUT");
    }
    return known->syntax;
  }

  // The next element without its pixels; false where they begin.
  bool next(Element& element, int depth) {
    element.tag = take_tag();
    std::string_view vr;
    std::uint32_t length = 0;
    if (set_.syntax.is_explicit) {
      vr = take(2);
      if (!is_vr(vr)) broken("an element has no type");
      if (is_long(vr)) {
        take(2);
        length = take_number(4);
      } else {
        length = take_number(2);
      }
    } else {
      length = take_number(4);
    }
    if (element.tag == kPixels && depth == 0) {
      set_.pixels_at = at_;
      set_.pixels_bytes = length == kUndefined ? 0 : length;
      if ((length == kUndefined) != (set_.syntax.packing != Packing::none))
        broken("its pixels are not stored as its transfer syntax says,");
      if (set_.pixels_bytes > file_bytes_ - at_) broken("its pixels are longer than the file, which is cut,");
      return false;
    }
    if (element.tag == kPixels && length == kUndefined) {  // of an icon
      for (Tag tag = take_tag(); tag != kSequenceEnd; tag = take_tag()) take(take_number(4));
      take(4);
      return true;
    }
    // Where types are not told, a sequence is what has no length, or begins with an item.
    const bool sequence = vr == "SQ" || length == kUndefined ||
                          (vr.empty() && length >= 8 && at_ + 4 <= head_.size() &&
                           head_.substr(at_, 4) == std::string_view("\xfe\xff\x00\xe0", 4));
    if (sequence) {
      items(element, length, depth, vr == "UN");
    } else {
      element.value = take(length);
    }
    return true;
  }

  void items(Element& element, std::uint32_t length, int depth, bool unknown) {
    if (depth >= kDeepest) broken("sequences lie " + std::to_string(kDeepest) + " deep in each other");
    if (length != kUndefined && length > file_bytes_ - at_) broken("a sequence is longer than the file");
    const std::uint64_t end = length == kUndefined ? file_bytes_ : at_ + length;
    const bool was_explicit = set_.syntax.is_explicit;
    if (unknown) set_.syntax.is_explicit = false;  // PS3.5 6.2.2: UN without a length is implicit inside
    while (at_ < end) {
      const Tag tag = take_tag();
      const std::uint32_t bytes = take_number(4);
      if (tag == kSequenceEnd) break;
      if (tag != kItem) broken("a sequence holds what is no item");
      if (bytes != kUndefined && bytes > file_bytes_ - at_) broken("an item is longer than the file");
      elements(element.items.emplace_back(), bytes == kUndefined ? kNoEnd : at_ + bytes, depth + 1);
    }
    set_.syntax.is_explicit = was_explicit;
  }

  // Up to `end`, or to the mark of an item's end.
  void elements(Item& item, std::uint64_t end, int depth) {
    while (at_ < std::min(end, file_bytes_)) {
      if (end == kNoEnd) {
        const std::uint64_t before = at_;
        if (take_tag() == kItemEnd) {
          take(4);
          return;
        }
        at_ = before;
      }
      Element element;
      if (!next(element, depth)) return;
      item.elements.push_back(std::move(element));
    }
  }

  void adopt(Item& item) const {
    item.syntax = set_.shared_syntax.get();
    item.text_set = set_.text_set.get();
    for (Element& element : item.elements) {
      for (Item& within : element.items) adopt(within);
    }
  }

  static constexpr std::uint64_t kNoEnd = ~std::uint64_t{0};

  DataSet& set_;
  std::string_view head_;
  std::uint64_t file_bytes_, at_ = 0;
};

std::string latin_to_utf8(std::string_view text) {
  std::string out;
  for (const char c : text) {
    const auto byte = static_cast<unsigned char>(c);
    if (byte < 0x80) {
      out += c;
    } else {
      out += static_cast<char>(0xc0 | byte >> 6);
      out += static_cast<char>(0x80 | (byte & 0x3f));
    }
  }
  return out;
}

}  // namespace

bool is_data_set(std::string_view head) {
  if (head.size() >= kPreamble && head.substr(128, 4) == "DICM") return true;
  // Old files begin with group 8: a low element, of a plausible length.
  if (head.size() < 12 || head.substr(0, 2) != std::string_view("\x08\x00", 2) || head[3] != 0) return false;
  return is_vr(head.substr(4, 2)) || number_at(head.substr(4, 4), 4, false) < 1024;
}

DataSet read_data_set(const fs::path& path, const files::ReadOptions& options) {
  std::ifstream file(path, std::ios::binary);
  std::error_code error;
  const std::uint64_t file_bytes = fs::file_size(path, error);
  if (!file || error)
    throw Error(ErrorKind::missing_input, path.string(), "cannot be opened", "check the path and its rights");
  files::Budget budget(file_bytes, options.limits, path.string());
  auto head = std::make_shared<std::string>();
  for (std::uint64_t wanted = std::min<std::uint64_t>(kFirstRead, file_bytes);;
       wanted = std::min(2 * wanted, file_bytes)) {
    const std::size_t had = head->size();
    budget.spend(wanted - had, 16);
    head->resize(static_cast<std::size_t>(wanted));
    file.read(head->data() + had, static_cast<std::streamsize>(wanted - had));
    if (!file) throw Error(ErrorKind::io, path.string(), "cannot be read", "check the disk");
    if (had == 0 && !is_data_set(*head)) refuse(path, "is no DICOM file", "take it out of the folder");
    DataSet set;
    set.path = path;
    set.file_bytes = file_bytes;
    try {
      Parser(set, *head, file_bytes).parse();
      set.head = std::move(head);
      return set;
    } catch (const TooShort&) {
      if (wanted == file_bytes) refuse(path, "is cut", "copy it from the archive again");
    }
  }
}

const Element* Item::find(Tag tag) const {
  const auto found =
      std::find_if(elements.begin(), elements.end(), [&](const Element& one) { return one.tag == tag; });
  return found == elements.end() ? nullptr : &*found;
}

const Item* Item::only(Tag sequence) const {
  const Element* found = find(sequence);
  return found == nullptr || found->items.empty() ? nullptr : &found->items.front();
}

std::string Item::text(Tag tag) const {
  const Element* found = find(tag);
  if (found == nullptr) return {};
  const std::string_view plain =
      text::trim(found->value.substr(0, std::min(found->value.find('\0'), found->value.size())));
  const std::string set = text_set == nullptr ? "" : *text_set;
  if (set.find("192") != set.npos) return std::string(plain);
  if (set.find("100") != set.npos || set.find("101") != set.npos) return latin_to_utf8(plain);
  std::string out(plain);
  std::replace_if(
      out.begin(), out.end(), [](char c) { return static_cast<signed char>(c) < 32; }, '?');
  return out;
}

std::string Item::text(Tag tag, std::size_t which) const {
  const std::string all = text(tag);
  std::size_t from = 0;
  for (; which > 0; --which) {
    from = all.find('\\', from);
    if (from == all.npos) return {};
    ++from;
  }
  return std::string(text::trim(all.substr(from, all.find('\\', from) - from)));
}

std::vector<double> Item::numbers(Tag tag) const {
  const Element* found = find(tag);
  if (found == nullptr) return {};
  std::vector<double> out;
  std::string_view rest = found->value.substr(0, std::min(found->value.find('\0'), found->value.size()));
  while (!text::trim(rest).empty()) {
    const std::size_t end = rest.find('\\');
    std::string_view one = text::trim(rest.substr(0, end));
    if (one.starts_with('+')) one.remove_prefix(1);
    double value = 0;
    const auto [stop, error] = std::from_chars(one.data(), one.data() + one.size(), value);
    if (error != std::errc() || stop != one.data() + one.size() || !std::isfinite(value)) return {};
    out.push_back(value);
    rest = end == rest.npos ? std::string_view() : rest.substr(end + 1);
  }
  return out;
}

std::optional<double> Item::number(Tag tag) const {
  const std::vector<double> all = numbers(tag);
  return all.empty() ? std::nullopt : std::optional(all.front());
}

std::vector<std::uint32_t> Item::wholes(Tag tag, std::size_t bytes) const {
  std::vector<std::uint32_t> out;
  const Element* found = find(tag);
  if (found == nullptr) return out;
  for (std::size_t i = 0; i + bytes <= found->value.size(); i += bytes)
    out.push_back(number_at(found->value.substr(i), bytes, syntax->big_endian));
  return out;
}

std::optional<std::uint32_t> Item::whole(Tag tag) const {
  const Element* found = find(tag);
  if (found == nullptr || (found->value.size() != 4 && found->value.size() % 2 != 0) || found->value.empty())
    return std::nullopt;
  return number_at(found->value, found->value.size() == 4 ? 4 : 2, syntax->big_endian);
}

std::string_view packing_name(Packing packing) {
  constexpr std::array<std::string_view, 6> names{"raw",           "RLE",     "JPEG",
                                                  "JPEG lossless", "JPEG-LS", "JPEG 2000"};
  return names[static_cast<std::size_t>(packing)];
}

}  // namespace ecorche::io::dicom
