// SPDX-License-Identifier: Apache-2.0
// Models whose datasets were rewritten: HDF5 and every digest are in order, so that what is read is believed.
#include <algorithm>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include <ecorche/model_file/model_file.hpp>
#include "core/model_file/layout.hpp"
#include "tests/fuzz/place.hpp"
#include "tests/fuzz/targets.hpp"
#include "tests/support/forge.hpp"
#include "tests/support/toy_model.hpp"

namespace ecorche::fuzz {
namespace {

using model_file::ElementType;

constexpr std::size_t kMostBytes = 1 << 18;  // of a dataset, so that one input takes milliseconds

struct Part {
  ElementType type = ElementType::u8;
  std::size_t width = 1;
  std::vector<hsize_t> shape;
  std::string bytes;

  std::size_t elements() const { return bytes.size() / width; }
};

// What the input says next; zeros behind its end.
class Script {
 public:
  explicit Script(Bytes bytes) : bytes_(bytes) {}
  bool over() const { return bytes_.empty(); }
  std::uint64_t number(std::size_t width) {
    std::uint64_t value = 0;
    const std::size_t n = std::min(width, bytes_.size());
    std::memcpy(&value, bytes_.data(), n);
    bytes_ = bytes_.subspan(n);
    return value;
  }

 private:
  Bytes bytes_;
};

// The good model: its file, and what stands in it.
struct Good {
  std::string file;
  std::vector<std::string> paths;
  std::vector<Part> parts;
};

Good make_good(const Place& place) {
  Good good;
  const std::filesystem::path path = place / "parts.hdf";
  const Model model = test::toy_model();
  model_file::leave_hdf5_open_at_exit();
  model_file::write(model, path, Context{});
  std::ifstream in(path, std::ios::binary);
  good.file.assign(std::istreambuf_iterator<char>(in), {});
  for (const model_file::Layout& layout : {model_file::lay_out(model), model_file::lay_out_vtk(model)}) {
    for (const model_file::Entry& entry : layout.entries()) {
      good.paths.push_back(entry.path);
      good.parts.push_back(
          {entry.type,
           entry.width,
           {entry.shape.begin(), entry.shape.end()},
           std::string(reinterpret_cast<const char*>(entry.bytes.data()), entry.bytes.size())});
    }
  }
  return good;
}

// As many bytes as the shape asks for: the old ones, again and again.
void fill(Part& part) {
  std::size_t bytes = part.width;
  for (hsize_t& extent : part.shape) {
    if (bytes * extent > kMostBytes) extent = 1;
    bytes *= extent;
  }
  const std::string old = part.bytes.empty() ? std::string(1, '\0') : part.bytes;
  part.bytes.resize(bytes);
  for (std::size_t i = 0; i < bytes; ++i) part.bytes[i] = old[i % old.size()];
}

void put(Part& part, std::size_t element, std::uint64_t value) {
  std::memcpy(&part.bytes[element * part.width], &value, std::min(part.width, sizeof value));
}

// One edit of a dataset; nothing is left where it removes it.
void edit(Script& script, const Good& good, std::optional<Part>& part) {
  const std::uint64_t what = script.number(1) % 6;
  if (!part || what == 0) return part.reset();
  switch (what) {
    case 1:
      if (part->elements() > 0) put(*part, script.number(2) % part->elements(), script.number(8));
      return;
    case 2:
      for (std::size_t e = 0, value = script.number(8); e < part->elements(); ++e) put(*part, e, value);
      return;
    case 3:
      part->shape.resize(std::min<std::size_t>(part->shape.size() + script.number(1) % 2, 4), 1);
      if (!part->shape.empty()) part->shape[script.number(1) % part->shape.size()] = script.number(2) % 1024;
      return fill(*part);
    case 4:
      part->type = static_cast<ElementType>(script.number(1) % 11);
      part->width = part->type == ElementType::text ? 1 + script.number(1) : element_bytes(part->type);
      return fill(*part);
    default:
      part = good.parts[script.number(2) % good.parts.size()];
  }
}

void write(test::Forge& forge, const std::string& path, const Part& part) {
  const test::Id type = model_file::hdf::file_type(part.type, part.width);
  const test::Id dataset = forge.dataset(
      path, type, part.shape, [](hid_t creation) { H5Pset_alloc_time(creation, H5D_ALLOC_TIME_EARLY); });
  if (!part.bytes.empty()) H5Dwrite(dataset, type, H5S_ALL, H5S_ALL, H5P_DEFAULT, part.bytes.data());
}

}  // namespace

void model_parts(Bytes bytes) {
  static const Place place;
  static const Good good = make_good(place);
  Script script(bytes);
  std::map<std::size_t, std::optional<Part>> edited;
  while (!script.over() && edited.size() < 16) {
    const std::size_t row = script.number(2) % good.parts.size();
    edit(script, good, edited.try_emplace(row, good.parts[row]).first->second);
  }
  const std::filesystem::path path = place.put("parts.hdf", good.file);
  {
    const model_file::hdf::Session quiet;
    test::Forge forge(path);
    test::Forge::Table table = forge.table();
    for (const auto& [row, part] : edited) {
      const std::string& name = good.paths[row];
      const auto listed =
          std::find_if(table.begin(), table.end(), [&](const auto& r) { return r.first == name; });
      if (part) {
        write(forge, name, *part);
        listed->second = XXH64(part->bytes.data(), part->bytes.size(), 0);
      } else {
        forge.remove(name);
        table.erase(listed);
      }
    }
    forge.set_table(table);
  }
  try {
    const Model read = model_file::read(path, Context{});
    if (read.segment_count() == 0) std::abort();
  } catch (const Error& error) {
    if (error.kind() != ErrorKind::data) std::abort();
  }
}

}  // namespace ecorche::fuzz
