// SPDX-License-Identifier: Apache-2.0
// Our own reader over expat instead of VTK's, which allocates what its attributes promise and stores cells of
// points that are not there.
#include "io/surface/vtk_xml.hpp"

#include <expat.h>

#include <algorithm>
#include <memory>

namespace ecorche::io::vtk_xml {
namespace {

using bytes::refuse;

constexpr std::size_t kDeepest = 64;  // a DataArray lies five deep

std::string_view value_of(const Attributes& attributes, std::string_view key) {
  const auto found = attributes.find(key);
  return found == attributes.end() ? std::string_view() : std::string_view(found->second);
}

// What expat meets, kept as far as it was asked for.
struct XmlReader {
  std::string_view type;
  std::initializer_list<std::string_view> sections;
  Attributes file;
  bool of_type = false;
  std::string appended_encoding;
  std::vector<Piece> pieces;
  std::map<std::string, DataArray> fields;
  std::vector<std::string> open;  // elements around the present place
  DataArray* filling = nullptr;
  bool too_deep = false;

  static void begin(void* self, const XML_Char* name, const XML_Char** attributes) {
    static_cast<XmlReader*>(self)->begin_element(name, attributes);
  }
  static void end(void* self, const XML_Char*) {
    auto& reader = *static_cast<XmlReader*>(self);
    reader.open.pop_back();
    reader.filling = nullptr;
  }
  static void text(void* self, const XML_Char* from, int length) {
    auto& reader = *static_cast<XmlReader*>(self);
    if (reader.filling != nullptr) reader.filling->text.append(from, static_cast<std::size_t>(length));
  }

 private:
  void begin_element(std::string_view name, const XML_Char** list) {
    Attributes attributes;
    for (; *list != nullptr; list += 2) attributes.emplace(list[0], list[1]);
    const std::string parent = open.empty() ? "" : open.back();
    open.emplace_back(name);
    if (open.size() > kDeepest) too_deep = true;
    filling = nullptr;
    if (name == "VTKFile" && parent.empty()) file = std::move(attributes);
    if (name == type && parent == "VTKFile") of_type = true;
    if (name == "AppendedData") appended_encoding = attributes["encoding"];
    if (name == "Piece" && parent == type) pieces.push_back({std::move(attributes), {}});
    if ((name == "Array" || name == "DataArray") && parent == "FieldData") {
      keep(fields[attributes["Name"]], attributes);
    } else if (name == "DataArray" && !pieces.empty() &&
               std::find(sections.begin(), sections.end(), parent) != sections.end()) {
      const std::string key = parent == "Points" ? "" : attributes["Name"];
      keep(pieces.back().sections[parent][key], attributes);
    }
  }
  void keep(DataArray& array, Attributes& attributes) {
    array = {std::move(attributes), {}};
    filling = &array;
  }
};

// Appended raw bytes are no XML: the document ends where they begin.
void read(std::string_view file, std::string_view& appended, XmlReader& reader, const std::string& where) {
  std::string xml(file);
  const std::size_t tag = file.find("<AppendedData");
  if (tag != file.npos) {
    const std::size_t end = file.find('>', tag);
    const std::size_t underscore = end == file.npos ? end : file.find('_', end);
    if (underscore == file.npos) refuse(where, "its appended data do not begin");
    appended = file.substr(underscore + 1);
    xml = std::string(file.substr(0, end + 1)) + "</AppendedData></VTKFile>";
  }
  const std::unique_ptr<XML_ParserStruct, void (*)(XML_Parser)> parser(XML_ParserCreate(nullptr),
                                                                       XML_ParserFree);
  XML_SetUserData(parser.get(), &reader);
  XML_SetElementHandler(parser.get(), XmlReader::begin, XmlReader::end);
  XML_SetCharacterDataHandler(parser.get(), XmlReader::text);
  // Entities are what makes small XML large; VTK's files have none.
  if (xml.find("<!DOCTYPE") != xml.npos) refuse(where, "has a DOCTYPE, as no VTK file has");
  for (std::size_t at = 0; at <= xml.size();) {
    constexpr std::size_t block = std::size_t{1} << 16;
    const std::size_t some = std::min(block, xml.size() - at);
    const bool last = at + some == xml.size();
    if (XML_Parse(parser.get(), xml.data() + at, static_cast<int>(some), last ? 1 : 0) != XML_STATUS_OK) {
      refuse(where + ":" + std::to_string(XML_GetCurrentLineNumber(parser.get())),
             std::string("is no XML: ") + XML_ErrorString(XML_GetErrorCode(parser.get())));
    }
    if (reader.too_deep) refuse(where, "its elements are nested more than 64 deep");
    if (last) break;
    at += some;
  }
}

Storage storage_of(const XmlReader& reader, std::string_view appended, const std::string& where) {
  Storage storage;
  storage.big_endian = value_of(reader.file, "byte_order") == "BigEndian";
  storage.wide_header = value_of(reader.file, "header_type") == "UInt64";
  const std::string_view compressor = value_of(reader.file, "compressor");
  storage.zlib = compressor == "vtkZLibDataCompressor";
  if (!storage.zlib && !compressor.empty()) {
    refuse(where, "its arrays are packed by " + std::string(compressor.substr(0, 60)),
           "save it packed by zlib, or not packed");
  }
  storage.appended = appended;
  storage.base64_appended = reader.appended_encoding == "base64";
  return storage;
}

}  // namespace

const DataArray* Piece::find(const std::string& section, const std::string& name) const {
  const auto found = sections.find(section);
  if (found == sections.end()) return nullptr;
  const auto array = found->second.find(name);
  return array == found->second.end() ? nullptr : &array->second;
}

Document parse(std::string_view file, std::string_view type, std::initializer_list<std::string_view> sections,
               const std::string& mend, files::Budget& budget) {
  const std::string& where = budget.where();
  std::string_view appended;
  XmlReader reader;
  reader.type = type;
  reader.sections = sections;
  read(file, appended, reader, where);
  if (value_of(reader.file, "type") != type || !reader.of_type)
    refuse(where, "is no VTK " + std::string(type), mend);
  Document document{std::move(reader.pieces), std::move(reader.fields), storage_of(reader, appended, where)};
  document.storage.budget = &budget;
  // A value takes a byte; packed, coordinates never shrink to a 64th.
  document.largest = document.storage.zlib ? file.size() * 64 + (std::uint64_t{1} << 20) : file.size();
  return document;
}

std::uint64_t count_of(const Piece& piece, std::string_view key, const Document& document,
                       const std::string& where) {
  const std::string_view word = value_of(piece.attributes, key);
  if (word.empty()) return 0;
  const auto value = bytes::whole(word);
  if (!value || *value < 0 || static_cast<std::uint64_t>(*value) > document.largest)
    refuse(where,
           std::string(key) + " is '" + std::string(word.substr(0, 40)) + "', more than the file can hold");
  return static_cast<std::uint64_t>(*value);
}

void fail_count(const std::string& what, std::uint64_t said, std::uint64_t found, const std::string& where) {
  refuse(where, "says " + std::to_string(said) + " " + what + ", but has " + std::to_string(found));
}

std::vector<double> points_of(const Piece& piece, const Document& document, const std::string& where) {
  const std::uint64_t points = count_of(piece, "NumberOfPoints", document, where);
  const DataArray* array = piece.find("Points", "");
  if (array == nullptr) {
    if (points > 0) fail_count("points", points, 0, where);
    return {};
  }
  if (array->attribute("NumberOfComponents") != "3") refuse(where, "its points have not 3 coordinates");
  std::vector<double> x = vtp::reals(*array, document.storage, 3 * points, where);
  if (x.size() != 3 * points) fail_count("points", points, x.size() / 3, where);
  return x;
}

std::string letters(const DataArray& array, const Storage& storage, std::uint64_t limit,
                    const std::string& where) {
  DataArray whole = array;
  whole.attributes["type"] = "UInt8";  // a string is its bytes
  std::string text;
  for (const std::int64_t c : vtp::wholes(whole, storage, limit, where)) text += static_cast<char>(c);
  return text;
}

}  // namespace ecorche::io::vtk_xml
