// SPDX-License-Identifier: Apache-2.0
// https://nifti.nimh.nih.gov/nifti-1/documentation/nifti1fields/nifti1fields_pages/extension.html
#include "io/image/nifti_names.hpp"

#include <expat.h>
#include <zlib.h>

#include <algorithm>
#include <charconv>
#include <cstring>
#include <memory>
#include <optional>

#include "core/files/atomic_file.hpp"
#include "core/values/text.hpp"
#include "io/image/header.hpp"
#include "io/image/image_file.hpp"

namespace ecorche::io {
namespace {

constexpr std::size_t kLargestHead = std::size_t{1} << 20;
constexpr std::size_t kMostLabels = 65536, kLongestName = 256;

std::int32_t number_at(std::string_view bytes, std::size_t at, bool swapped) {
  std::uint32_t value = 0;
  for (std::size_t i = 0; i < 4; ++i) {
    const auto byte = static_cast<unsigned char>(bytes[at + (swapped ? 3 - i : i)]);
    value |= static_cast<std::uint32_t>(byte) << (8 * i);
  }
  return static_cast<std::int32_t>(value);
}

// The labels that one document names, as far as it can be read.
struct LabelXml {
  std::map<std::int64_t, std::string> names;
  std::optional<std::int64_t> key;
  std::string text;
  XML_Parser parser = nullptr;

  static void begin(void* self, const XML_Char* name, const XML_Char** attributes) {
    auto& xml = *static_cast<LabelXml*>(self);
    if (std::string_view(name) != "Label") return;
    xml.key.reset();
    xml.text.clear();
    for (; *attributes != nullptr; attributes += 2) {
      if (std::string_view(attributes[0]) != "Key") continue;
      const std::string_view word = text::trim(attributes[1]);
      std::int64_t value = 0;
      const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), value);
      if (error == std::errc() && end == word.data() + word.size()) xml.key = value;
    }
  }
  static void characters(void* self, const XML_Char* from, int length) {
    auto& xml = *static_cast<LabelXml*>(self);
    if (xml.key && xml.text.size() < kLongestName) xml.text.append(from, static_cast<std::size_t>(length));
  }
  static void end(void* self, const XML_Char* name) {
    auto& xml = *static_cast<LabelXml*>(self);
    if (std::string_view(name) != "Label" || !xml.key) return;
    const std::string trimmed(text::trim(xml.text));
    if (*xml.key != 0 && !trimmed.empty() && xml.names.size() < kMostLabels)
      xml.names.emplace(*xml.key, trimmed.substr(0, kLongestName));
    xml.key.reset();
  }
  // Nobody's list of labels needs a document type; entities in one could grow without bound.
  static void doctype(void* self, const XML_Char*, const XML_Char*, const XML_Char*, int) {
    auto& xml = *static_cast<LabelXml*>(self);
    xml.names.clear();
    XML_StopParser(xml.parser, XML_FALSE);
  }
};

std::map<std::int64_t, std::string> names_in(std::string_view document) {
  document = document.substr(0, document.find('\0'));  // it is padded to a multiple of 16 bytes
  if (document.find("<Label") == document.npos) return {};
  LabelXml xml;
  const std::unique_ptr<XML_ParserStruct, void (*)(XML_Parser)> parser(XML_ParserCreate(nullptr),
                                                                       XML_ParserFree);
  xml.parser = parser.get();
  XML_SetUserData(parser.get(), &xml);
  XML_SetElementHandler(parser.get(), LabelXml::begin, LabelXml::end);
  XML_SetCharacterDataHandler(parser.get(), LabelXml::characters);
  XML_SetStartDoctypeDeclHandler(parser.get(), LabelXml::doctype);
  const bool whole =
      XML_Parse(parser.get(), document.data(), static_cast<int>(document.size()), 1) != XML_STATUS_ERROR;
  return whole ? xml.names : std::map<std::int64_t, std::string>();
}

}  // namespace

std::map<std::int64_t, std::string> read_nifti_names(const std::filesystem::path& path) {
  const std::string name = text::lower(path.filename().string());
  if (!name.ends_with(".nii") && !name.ends_with(".nii.gz")) return {};
  std::string head = read_head(path);
  if (head.starts_with("\x1f\x8b")) head = inflate_head(head, kLargestHead, path);
  if (head.size() < 352) return {};
  const auto length_of = [&](bool swapped) { return number_at(head, 0, swapped); };
  const bool swapped = length_of(true) == 348 || length_of(true) == 540;
  const auto header = static_cast<std::size_t>(length_of(swapped));
  if ((header != 348 && header != 540) || head.size() < header + 4 || head[header] == 0) return {};
  // Each: its size with these eight bytes, its code, its text.
  for (std::size_t at = header + 4; at + 8 <= head.size();) {
    const std::int32_t size = number_at(head, at, swapped);
    if (size < 16 || static_cast<std::size_t>(size) > head.size() - at) break;
    auto names = names_in(std::string_view(head).substr(at + 8, static_cast<std::size_t>(size) - 8));
    if (!names.empty()) return names;
    at += static_cast<std::size_t>(size);
  }
  return {};
}

void write_named_nifti(const std::filesystem::path& path, const Image& labels,
                       const std::map<std::int64_t, std::string>& names) {
  if (!text::lower(path.filename().string()).ends_with(".nii.gz"))
    throw Error(ErrorKind::usage, path.string(), "labels with names are written as .nii.gz", "name it so");
  std::string xml =
      "<?xml version=\"1.0\" encoding=\"UTF-8\"?> <CaretExtension>  <VolumeInformation "
      "Index=\"0\">\n<LabelTable>\n";
  for (const auto& [id, name] : names)
    xml += "<Label Key=\"" + std::to_string(id) +
           "\" Red=\"1\" Green=\"1\" Blue=\"1\" Alpha=\"1\"><![CDATA[" + name + "]]></Label>\n";
  xml +=
      "</LabelTable>  <StudyMetaDataLinkSet>  </StudyMetaDataLinkSet>  "
      "<VolumeType><![CDATA[Label]]></VolumeType>   </VolumeInformation></CaretExtension>";
  xml.resize((xml.size() + 8 + 15) / 16 * 16 - 8, '\0');
  const files::AtomicFile plain(path);  // never committed: its bytes are completed first
  write_image(plain.temporary(), labels, false);
  const std::string packed =
      files::read_text(plain.temporary(), static_cast<std::size_t>(largest_image_bytes));
  std::string bytes = inflate_head(packed, 352 + labels.bytes.size(), path);
  const auto put = [&](std::size_t at, const void* from, std::size_t size) {
    std::memcpy(bytes.data() + at, from, size);
  };
  std::string extension(8, '\0');
  const auto size = static_cast<std::int32_t>(xml.size() + 8);
  constexpr std::int32_t code = 0;
  std::memcpy(extension.data(), &size, 4);
  std::memcpy(extension.data() + 4, &code, 4);
  const auto offset = static_cast<float>(352 + size);
  put(108, &offset, 4);  // vox_offset
  bytes[348] = 1;        // there are extensions
  bytes.insert(352, extension + xml);
  files::AtomicFile made(path);
  const gzFile out = gzopen(made.temporary().c_str(), "wb6");
  bool good = out != nullptr;
  for (std::size_t at = 0; good && at < bytes.size(); at += std::size_t{1} << 20) {
    const auto block = static_cast<unsigned>(std::min(std::size_t{1} << 20, bytes.size() - at));
    good = gzwrite(out, bytes.data() + at, block) == static_cast<int>(block);
  }
  good = out != nullptr && gzclose(out) == Z_OK && good;
  if (!good) throw Error(ErrorKind::io, path.string(), "cannot be written", "check the disk");
  made.commit();
}

}  // namespace ecorche::io
