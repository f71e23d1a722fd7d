// SPDX-License-Identifier: Apache-2.0
// Our own reader over expat instead of vtkXMLPolyDataReader, which allocates what its attributes promise and
// stores cells of points that are not there.
#include "io/surface/vtp.hpp"

#include <expat.h>

#include <memory>

#include "io/surface/mesh_builder.hpp"
#include "io/surface/vtp_arrays.hpp"

namespace ecorche::io::vtp {
namespace {

using bytes::refuse;

struct Piece {
  Attributes attributes;
  // By section (`Points`, `Polys`, `Strips`), then by name; the points' array is named "".
  std::map<std::string, std::map<std::string, DataArray>> sections;
};

// What expat meets, kept as far as it is geometry.
struct Document {
  Attributes file;
  bool poly_data = false;
  std::string appended_encoding;
  std::vector<Piece> pieces;
  std::optional<DataArray> space;
  std::vector<std::string> open;  // elements around the present place
  DataArray* filling = nullptr;
  std::string problem;

  static void begin(void* self, const XML_Char* name, const XML_Char** attributes) {
    static_cast<Document*>(self)->begin_element(name, attributes);
  }
  static void end(void* self, const XML_Char*) {
    auto& document = *static_cast<Document*>(self);
    document.open.pop_back();
    document.filling = nullptr;
  }
  static void text(void* self, const XML_Char* from, int length) {
    auto& document = *static_cast<Document*>(self);
    if (document.filling != nullptr) document.filling->text.append(from, static_cast<std::size_t>(length));
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
    if (name == "Piece" && parent == "PolyData") pieces.push_back({std::move(attributes), {}});
    if (name == "Array" && parent == "FieldData" && attributes["Name"] == "SPACE") {
      filling = &space.emplace(DataArray{std::move(attributes), {}});
    } else if (name == "DataArray" && !pieces.empty() &&
               (parent == "Points" || parent == "Polys" || parent == "Strips")) {
      const std::string key = parent == "Points" ? "" : attributes["Name"];
      DataArray& array = pieces.back().sections[parent][key];
      array = {std::move(attributes), {}};
      filling = &array;
    }
  }
};

// Appended raw bytes are no XML: the document ends where they begin.
Document parse(std::string_view file, std::string_view& appended, const std::string& where) {
  std::string xml(file);
  const std::size_t tag = file.find("<AppendedData");
  if (tag != file.npos) {
    const std::size_t end = file.find('>', tag);
    const std::size_t underscore = end == file.npos ? end : file.find('_', end);
    if (underscore == file.npos) refuse(where, "its appended data do not begin");
    appended = file.substr(underscore + 1);
    xml = std::string(file.substr(0, end + 1)) + "</AppendedData></VTKFile>";
  }
  Document document;
  const std::unique_ptr<XML_ParserStruct, void (*)(XML_Parser)> parser(XML_ParserCreate(nullptr),
                                                                       XML_ParserFree);
  XML_SetUserData(parser.get(), &document);
  XML_SetElementHandler(parser.get(), Document::begin, Document::end);
  XML_SetCharacterDataHandler(parser.get(), Document::text);
  // Entities are what makes small XML large; VTK's files have none.
  if (xml.find("<!DOCTYPE") != xml.npos) refuse(where, "has a DOCTYPE, as no VTK file has");
  for (std::size_t at = 0; at <= xml.size();) {
    constexpr std::size_t block = std::size_t{1} << 24;
    const std::size_t some = std::min(block, xml.size() - at);
    const bool last = at + some == xml.size();
    if (XML_Parse(parser.get(), xml.data() + at, static_cast<int>(some), last ? 1 : 0) != XML_STATUS_OK) {
      refuse(where + ":" + std::to_string(XML_GetCurrentLineNumber(parser.get())),
             std::string("is no XML: ") + XML_ErrorString(XML_GetErrorCode(parser.get())));
    }
    if (last) break;
    at += some;
  }
  return document;
}

std::string_view value_of(const Attributes& attributes, std::string_view key) {
  const auto found = attributes.find(key);
  return found == attributes.end() ? std::string_view() : std::string_view(found->second);
}

Storage storage_of(const Document& document, std::string_view appended, const std::string& where) {
  if (value_of(document.file, "type") != "PolyData" || !document.poly_data)
    refuse(where, "is no VTK PolyData", "save it as XML PolyData (.vtp)");
  Storage storage;
  storage.big_endian = value_of(document.file, "byte_order") == "BigEndian";
  storage.wide_header = value_of(document.file, "header_type") == "UInt64";
  const std::string_view compressor = value_of(document.file, "compressor");
  storage.zlib = compressor == "vtkZLibDataCompressor";
  if (!storage.zlib && !compressor.empty()) {
    refuse(where, "its arrays are packed by " + std::string(compressor.substr(0, 60)),
           "save it packed by zlib, or not packed");
  }
  storage.appended = appended;
  storage.base64_appended = document.appended_encoding == "base64";
  return storage;
}

class PieceReader {
 public:
  PieceReader(const Piece& piece, const Storage& storage, std::uint64_t largest, MeshBuilder& mesh)
      : piece_(piece), storage_(storage), largest_(largest), mesh_(mesh) {}

  void read() {
    const std::uint64_t points = count("NumberOfPoints");
    const auto base = static_cast<std::int64_t>(mesh_.points());
    if (const DataArray* array = find("Points", "")) {
      if (array->attribute("NumberOfComponents") != "3")
        refuse(mesh_.where(), "its points have not 3 coordinates");
      const std::vector<double> x = reals(*array, storage_, 3 * points, mesh_.where());
      if (x.size() != 3 * points) fail("points", points, x.size() / 3);
      for (std::size_t i = 0; i < points; ++i) mesh_.add_point({x[3 * i], x[3 * i + 1], x[3 * i + 2]});
    } else if (points > 0) {
      fail("points", points, 0);
    }
    read_cells("Polys", count("NumberOfPolys"), points, base, false);
    read_cells("Strips", count("NumberOfStrips"), points, base, true);
  }

 private:
  [[noreturn]] void fail(const std::string& what, std::uint64_t said, std::uint64_t found) const {
    refuse(mesh_.where(), "says " + std::to_string(said) + " " + what + ", but has " + std::to_string(found));
  }
  std::uint64_t count(std::string_view key) const {
    const std::string_view word = value_of(piece_.attributes, key);
    if (word.empty()) return 0;
    const auto value = bytes::whole(word);
    if (!value || *value < 0 || static_cast<std::uint64_t>(*value) > largest_)
      refuse(mesh_.where(),
             std::string(key) + " is '" + std::string(word.substr(0, 40)) + "', more than the file can hold");
    return static_cast<std::uint64_t>(*value);
  }
  const DataArray* find(const std::string& section, const std::string& name) const {
    const auto found = piece_.sections.find(section);
    if (found == piece_.sections.end()) return nullptr;
    const auto array = found->second.find(name);
    return array == found->second.end() ? nullptr : &array->second;
  }

  void read_cells(const std::string& section, std::uint64_t cells, std::uint64_t points, std::int64_t base,
                  bool strips) {
    if (cells == 0) return;
    const DataArray* ends = find(section, "offsets");
    const DataArray* list = find(section, "connectivity");
    if (ends == nullptr || list == nullptr) fail(section, cells, 0);
    const std::vector<std::int64_t> offsets = wholes(*ends, storage_, cells, mesh_.where());
    if (offsets.size() != cells) fail(section, cells, offsets.size());
    std::vector<std::int64_t> corners = wholes(*list, storage_, largest_, mesh_.where());
    for (std::int64_t& c : corners) {
      if (c < 0 || static_cast<std::uint64_t>(c) >= points)
        refuse(mesh_.where(), "a cell uses point " + std::to_string(c) + " of " + std::to_string(points));
      c += base;
    }
    std::int64_t begin = 0;
    for (const std::int64_t end : offsets) {
      if (end < begin || static_cast<std::uint64_t>(end) > corners.size())
        refuse(mesh_.where(),
               "a cell ends at corner " + std::to_string(end) + " of " + std::to_string(corners.size()));
      const auto cell =
          std::span(corners).subspan(static_cast<std::size_t>(begin), static_cast<std::size_t>(end - begin));
      if (strips) {
        mesh_.add_strip(cell);
      } else {
        mesh_.add_polygon(cell);
      }
      begin = end;
    }
  }

  const Piece& piece_;
  const Storage& storage_;
  std::uint64_t largest_;
  MeshBuilder& mesh_;
};

}  // namespace

Decoded decode(std::string_view file, const std::string& where) {
  std::string_view appended;
  const Document document = parse(file, appended, where);
  const Storage storage = storage_of(document, appended, where);
  // A value takes a byte; packed, coordinates never shrink to a 64th.
  const std::uint64_t largest = storage.zlib ? file.size() * 64 + (std::uint64_t{1} << 20) : file.size();
  MeshBuilder mesh(where);
  for (const Piece& piece : document.pieces) PieceReader(piece, storage, largest, mesh).read();
  Decoded out;
  if (document.space) {
    DataArray letters = *document.space;
    letters.attributes["type"] = "UInt8";  // a string is its bytes
    std::string text;
    for (const std::int64_t c : wholes(letters, storage, 64, where)) text += static_cast<char>(c);
    out.space = bytes::space_tag("SPACE=" + text);
  }
  out.mesh = mesh.finish();
  return out;
}

}  // namespace ecorche::io::vtp
