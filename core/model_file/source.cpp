// SPDX-License-Identifier: Apache-2.0
#include "core/model_file/source.hpp"

#include <algorithm>

#include "core/model_file/digest.hpp"

namespace ecorche::model_file {
namespace {

std::string shape_text(const Source::Shape& shape) {
  std::string text;
  for (const std::uint64_t extent : shape) {
    text += (text.empty() ? "" : " x ") + (extent == Source::any ? std::string("n") : std::to_string(extent));
  }
  return text.empty() ? "one value without a shape" : text;
}

bool fits(const Source::Shape& shape, const Source::Shape& asked) {
  return std::equal(shape.begin(), shape.end(), asked.begin(), asked.end(),
                    [](std::uint64_t is, std::uint64_t want) { return want == Source::any || is == want; });
}

}  // namespace

Source::Source(const Catalogue& catalogue, const Context& context)
    : catalogue_(catalogue), context_(context) {
  for (const auto& [path, dataset] : catalogue.datasets) total_bytes_ += dataset.bytes;
}

std::vector<std::string> Source::ordered_members(const std::string& group) const {
  const std::string prefix = group + "/";
  std::vector<std::string> members;
  for (const std::string& path : catalogue_.groups) {
    if (path.starts_with(prefix)) members.push_back(path.substr(prefix.size()));
  }
  std::vector<std::string> ordered(members.size());
  for (const std::string& member : members) {
    const std::string path = prefix + member + "/index";
    const auto index = scalar<std::int32_t>(path);
    if (index < 0 || static_cast<std::size_t>(index) >= ordered.size() ||
        !ordered[static_cast<std::size_t>(index)].empty()) {
      refuse(path,
             std::to_string(index) + " is not a place of its own among " + std::to_string(members.size()));
    }
    ordered[static_cast<std::size_t>(index)] = member;
  }
  return ordered;
}

const StoredDataset& Source::find(const std::string& path) const {
  const auto found = catalogue_.datasets.find(path);
  if (found == catalogue_.datasets.end()) refuse(path, "is missing");
  return found->second;
}

const StoredDataset& Source::find(const std::string& path, ElementType type, const Shape& shape) const {
  const StoredDataset& dataset = find(path);
  if (dataset.type != type) {
    refuse(path,
           "is " + std::string(element_name(dataset.type)) + ", not " + std::string(element_name(type)));
  }
  if (!fits(dataset.shape, shape)) {
    refuse(path, "has the shape " + shape_text(dataset.shape) + ", not " + shape_text(shape));
  }
  return dataset;
}

void Source::read(const std::string& path, const StoredDataset& dataset, std::span<std::byte> out) const {
  read_blocks(path, dataset, [&](std::uint64_t at, std::uint64_t size) { return out.subspan(at, size); });
}

void Source::read_blocks(const std::string& path, const StoredDataset& dataset, const Room& room,
                         const Seen& seen) const {
  if (digest_of(dataset, room, seen) != dataset.digest) {
    refuse(path, "is damaged: its XXH64 is not the stored one");
  }
}

std::vector<std::string> Source::texts(const std::string& path, const Shape& shape) const {
  const StoredDataset& dataset = find(path, ElementType::text, shape);
  std::string bytes(dataset.bytes, '\0');
  read(path, dataset, std::as_writable_bytes(std::span(bytes)));
  std::vector<std::string> texts;
  for (std::size_t at = 0; at < bytes.size(); at += dataset.width) {
    const std::string_view padded = std::string_view(bytes).substr(at, dataset.width);
    texts.emplace_back(padded.substr(0, padded.find('\0')));
  }
  return texts;
}

void Source::refuse(const std::string& path, const std::string& what) const {
  throw Error(ErrorKind::data, catalogue_.file.name() + ":" + path, what,
              "preprocess the case again, or copy the file again");
}

bool Source::digest_is_good(const std::string& path) const {
  const StoredDataset& dataset = find(path);
  std::vector<std::byte> passing(std::min(block, dataset.bytes));
  const auto room = [&](std::uint64_t, std::uint64_t size) { return std::span(passing).first(size); };
  return digest_of(dataset, room, {}) == dataset.digest;
}

std::uint64_t Source::digest_of(const StoredDataset& dataset, const Room& room, const Seen& seen) const {
  Digest digest;
  for (std::uint64_t at = 0; at < dataset.bytes; at += block) {
    context_.check_stop();
    const std::uint64_t size = std::min(block, dataset.bytes - at);
    const std::span<std::byte> bytes = room(at, size);
    catalogue_.file.read(dataset.offset + at, bytes);
    digest.bytes(bytes);
    if (seen) seen(at, size);
    const std::lock_guard lock(mutex_);
    read_bytes_ += size;
    if (total_bytes_ > 0)
      context_.report(static_cast<double>(read_bytes_) / static_cast<double>(total_bytes_));
  }
  return digest.value();
}

}  // namespace ecorche::model_file
