// SPDX-License-Identifier: Apache-2.0
#include "runtime/server/session/payload_layout.hpp"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <utility>

namespace ecorche::server {
namespace {

constexpr std::size_t kMostPerPiece = 256 << 10;

}  // namespace

void PayloadLayout::begin(v1::Array& array, v1::ScalarType type, std::uint32_t components) {
  array_ = &array;
  array.set_type(type);
  array.set_components(components);
  array.set_offset(size_);
}

void PayloadLayout::add(std::span<const std::byte> bytes) {
  for (std::size_t at = 0; at < bytes.size(); at += kMostPerPiece) {
    const std::span<const std::byte> piece = bytes.subspan(at, std::min(kMostPerPiece, bytes.size() - at));
    pieces_.push_back({piece, size_});
    size_ += piece.size();
  }
}

void PayloadLayout::end(std::size_t row) {
  array_->set_count((size_ - array_->offset()) / row);
  ends_.push_back(size_);
  size_ = wire::aligned(size_);
}

void PayloadLayout::fill(wire::Payload& payload) const {
  // No clear() before: what is there already need not be zeroed, since all of it is written.
  payload.resize(size_);
  tbb::parallel_for(std::size_t{0}, pieces_.size(), [&](std::size_t p) {
    std::copy(pieces_[p].from.begin(), pieces_[p].from.end(),
              payload.begin() + static_cast<std::ptrdiff_t>(pieces_[p].to));
  });
  for (const std::size_t end : ends_) {
    std::fill(payload.begin() + static_cast<std::ptrdiff_t>(end),
              payload.begin() + static_cast<std::ptrdiff_t>(wire::aligned(end)), std::byte{0});
  }
}

wire::Pieces PayloadLayout::pieces(std::shared_ptr<const void> owner) const {
  static constexpr std::array<std::byte, wire::alignment> zeros{};
  wire::Pieces out{.parts = {}, .owner = std::move(owner)};
  out.parts.reserve(pieces_.size() + ends_.size());
  std::size_t p = 0;
  for (const std::size_t end : ends_) {
    for (; p < pieces_.size() && pieces_[p].to < end; ++p) out.parts.push_back(pieces_[p].from);
    if (wire::aligned(end) > end) out.parts.push_back(std::span(zeros).first(wire::aligned(end) - end));
  }
  return out;
}

}  // namespace ecorche::server
