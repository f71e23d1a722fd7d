// SPDX-License-Identifier: Apache-2.0
// Our own reader over expat instead of vtkXMLPolyDataReader, which allocates what its attributes promise and
// stores cells of points that are not there.
#include "io/surface/vtp_document.hpp"

#include <expat.h>

#include <algorithm>
#include <memory>

namespace ecorche::io::vtp {
namespace {

using bytes::refuse;

// What expat meets, kept as far as it was asked for.
struct Parser {
  std::initializer_list<std::string_view> sections;
  Document document;
  Attributes file;
  bool poly_data = false;
  std::string appended_encoding;
  std::vector<std::string> open;  // elements around the present place
  DataArray* filling = nullptr;

  static void begin(void* self, const XML_Char* name, const XML_Char** attributes) {
    static_cast<Parser*>(self)->begin_element(name, attributes);
  }
  static void end(void* self, const XML_Char*) {
    auto& parser = *static_cast<Parser*>(self);
    parser.open.pop_back();
    parser.filling = nullptr;
  }
  static void text(void* self, const XML_Char* from, int length) {
    auto& parser = *static_cast<Parser*>(self);
    if (parser.filling != nullptr) parser.filling->text.append(from, static_cast<std::size_t>(length));
  }

 private:
  void begin_element(std::string_view name, const XML_Char** list) {
    Attributes attributes;
    for (; *list != nullptr; list += 2) attributes.emplace(list[0], list[1]);
    const std::string parent = open.empty() ? "" : open.back();
    open.emplace_back(name);
    filling = nullptr;
    if (name == "VTKFile" && parent.empty()) file = std::move(attributes);
    if (name == "PolyData" && parent == "VTKFile") poly_data = true;
    if (name == "AppendedData") appended_encoding = attributes["encoding"];
    if (name == "Piece" && parent == "PolyData") document.pieces.push_back({std::move(attributes), {}});
    if ((name == "Array" || name == "DataArray") && parent == "FieldData") {
      keep(document.fields[attributes["Name"]], attributes);
    } else if (name == "DataArray" && !document.pieces.empty() &&
               std::find(sections.begin(), sections.end(), parent) != sections.end()) {
      const std::string key = parent == "Points" ? "" : attributes["Name"];
      keep(document.pieces.back().sections[parent][key], attributes);
    }
  }
  void keep(DataArray& array, Attributes& attributes) {
    array = {std::move(attributes), {}};
    filling = &array;
  }
};

std::string_view value_of(const Attributes& attributes, std::string_view key) {
  const auto found = attributes.find(key);
  return found == attributes.end() ? std::string_view() : std::string_view(found->second);
}

void set_storage(Parser& parser, const std::string& where) {
  if (value_of(parser.file, "type") != "PolyData" || !parser.poly_data)
    refuse(where, "is no VTK PolyData", "save it as XML PolyData (.vtp)");
  Storage& storage = parser.document.storage;
  storage.big_endian = value_of(parser.file, "byte_order") == "BigEndian";
  storage.wide_header = value_of(parser.file, "header_type") == "UInt64";
  const std::string_view compressor = value_of(parser.file, "compressor");
  storage.zlib = compressor == "vtkZLibDataCompressor";
  if (!storage.zlib && !compressor.empty()) {
    refuse(where, "its arrays are packed by " + std::string(compressor.substr(0, 60)),
           "save it packed by zlib, or not packed");
  }
  storage.base64_appended = parser.appended_encoding == "base64";
}

}  // namespace

const DataArray* Piece::find(const std::string& section, const std::string& name) const {
  const auto found = sections.find(section);
  if (found == sections.end()) return nullptr;
  const auto array = found->second.find(name);
  return array == found->second.end() ? nullptr : &array->second;
}

Document parse(std::string_view file, std::initializer_list<std::string_view> sections,
               const std::string& where) {
  Parser parser;
  parser.sections = sections;
  // Appended raw bytes are no XML: the document ends where they begin.
  std::string xml(file);
  const std::size_t tag = file.find("<AppendedData");
  if (tag != file.npos) {
    const std::size_t end = file.find('>', tag);
    const std::size_t underscore = end == file.npos ? end : file.find('_', end);
    if (underscore == file.npos) refuse(where, "its appended data do not begin");
    parser.document.storage.appended = file.substr(underscore + 1);
    xml = std::string(file.substr(0, end + 1)) + "</AppendedData></VTKFile>";
  }
  const std::unique_ptr<XML_ParserStruct, void (*)(XML_Parser)> expat(XML_ParserCreate(nullptr),
                                                                      XML_ParserFree);
  XML_SetUserData(expat.get(), &parser);
  XML_SetElementHandler(expat.get(), Parser::begin, Parser::end);
  XML_SetCharacterDataHandler(expat.get(), Parser::text);
  // Entities are what makes small XML large; VTK's files have none.
  if (xml.find("<!DOCTYPE") != xml.npos) refuse(where, "has a DOCTYPE, as no VTK file has");
  for (std::size_t at = 0; at <= xml.size();) {
    constexpr std::size_t block = std::size_t{1} << 24;
    const std::size_t some = std::min(block, xml.size() - at);
    const bool last = at + some == xml.size();
    if (XML_Parse(expat.get(), xml.data() + at, static_cast<int>(some), last ? 1 : 0) != XML_STATUS_OK) {
      refuse(where + ":" + std::to_string(XML_GetCurrentLineNumber(expat.get())),
             std::string("is no XML: ") + XML_ErrorString(XML_GetErrorCode(expat.get())));
    }
    if (last) break;
    at += some;
  }
  set_storage(parser, where);
  // A value takes a byte; packed, coordinates never shrink to a 64th.
  parser.document.largest =
      parser.document.storage.zlib ? file.size() * 64 + (std::uint64_t{1} << 20) : file.size();
  return std::move(parser.document);
}

std::uint64_t count(const Document& document, const Piece& piece, std::string_view key,
                    const std::string& where) {
  const std::string_view word = value_of(piece.attributes, key);
  if (word.empty()) return 0;
  const auto value = bytes::whole(word);
  if (!value || *value < 0 || static_cast<std::uint64_t>(*value) > document.largest)
    refuse(where,
           std::string(key) + " is '" + std::string(word.substr(0, 40)) + "', more than the file can hold");
  return static_cast<std::uint64_t>(*value);
}

std::string letters(const DataArray& array, const Storage& storage, std::uint64_t limit,
                    const std::string& where) {
  DataArray whole = array;
  whole.attributes["type"] = "UInt8";  // a string is its bytes
  std::string text;
  for (const std::int64_t c : wholes(whole, storage, limit, where)) text += static_cast<char>(c);
  return text;
}

}  // namespace ecorche::io::vtp
