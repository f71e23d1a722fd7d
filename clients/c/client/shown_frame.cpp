// SPDX-License-Identifier: Apache-2.0
#include "clients/c/client/shown_frame.hpp"

#include <algorithm>
#include <iterator>
#include <string>
#include <utility>

#include "clients/c/client/connection.hpp"
#include "clients/c/space.hpp"

namespace ecorche::c {
namespace {

ecorche_code not_shown() {
  return fail(ECORCHE_FAILED_PRECONDITION, "tissue: no frame has brought it (subscribe, and poll)");
}

// Numbers of the tissue, or the error.
ecorche_code find_numbers(const ecorche_client& client, std::uint32_t tissue,
                          const wire::DecodedTissue*& found) {
  found = client.frame.numbers(tissue);
  if (found == nullptr) return not_shown();
  if (found->numbers.empty() && !found->positions.empty()) {
    return fail(ECORCHE_FAILED_PRECONDITION,
                "encoding: frames of ECORCHE_ENCODING_F32 have no numbers (see ecorche_stream_options)");
  }
  return ECORCHE_OK;
}

}  // namespace

Status ShownFrame::take(const v1::MeshFrame& frame, const wire::Payload& payload) {
  Status status = decoder_.decode_numbers(frame, payload, tissues_);
  made_.assign(tissues_.size(), {});
  return status;
}

void ShownFrame::clear() {
  forget_keyframes();
  tissues_.clear();
}

const wire::DecodedTissue* ShownFrame::numbers(std::uint32_t tissue) const {
  const auto found =
      std::lower_bound(tissues_.begin(), tissues_.end(), tissue,
                       [](const wire::DecodedTissue& one, std::uint32_t row) { return one.tissue < row; });
  return found == tissues_.end() || found->tissue != tissue ? nullptr : &*found;
}

const wire::DecodedTissue* ShownFrame::positions(std::uint32_t tissue) {
  const wire::DecodedTissue* const found = numbers(tissue);
  if (found == nullptr) return nullptr;
  const auto row = static_cast<std::size_t>(found - tissues_.data());
  if (!std::exchange(made_[row].positions, true)) make_positions(tissues_[row]);
  return found;
}

const wire::DecodedTissue* ShownFrame::normals(std::uint32_t tissue) {
  const wire::DecodedTissue* const found = numbers(tissue);
  if (found == nullptr) return nullptr;
  const auto row = static_cast<std::size_t>(found - tissues_.data());
  if (!std::exchange(made_[row].normals, true)) make_normals(tissues_[row]);
  return found;
}

}  // namespace ecorche::c

using namespace ecorche;

const float* ecorche_client_positions(const ecorche_client* client, uint32_t tissue) {
  const wire::DecodedTissue* const found = client == nullptr ? nullptr : client->frame.positions(tissue);
  return found == nullptr ? nullptr : found->positions.data();
}

const float* ecorche_client_normals(const ecorche_client* client, uint32_t tissue) {
  const wire::DecodedTissue* const found = client == nullptr ? nullptr : client->frame.normals(tissue);
  return found == nullptr || found->normals.empty() ? nullptr : found->normals.data();
}

ecorche_code ecorche_client_copy(const ecorche_client* client, uint32_t tissue, ecorche_space space,
                                 float* positions, size_t position_stride, float* normals,
                                 size_t normal_stride, size_t capacity) {
  return c::with_client(client, true, [&] {
    const wire::DecodedTissue* const found = client->frame.numbers(tissue);
    if (found == nullptr) return c::not_shown();
    if (normals != nullptr && found->normal_numbers.empty() && found->vertices() > 0)
      return c::fail(ECORCHE_FAILED_PRECONDITION,
                     "normals: the frames have none (see ecorche_stream_options)");
    const auto points = [&](std::size_t first, std::size_t count, c::Batch& batch) -> const float* {
      if (found->numbers.empty()) return &found->positions[3 * first];
      wire::make_positions(*found, first, std::span(batch).first(3 * count));
      return batch.data();
    };
    const auto directions = [&](std::size_t first, std::size_t count, c::Batch& batch) -> const float* {
      wire::make_normals(*found, first, std::span(batch).first(3 * count));
      return batch.data();
    };
    return c::copy_vertices(found->vertices(), points, directions, 1, space,
                            {positions, position_stride, normals, normal_stride, capacity});
  });
}

ecorche_code ecorche_client_packed(const ecorche_client* client, uint32_t tissue, ecorche_packed* out) {
  return c::with_client(client, true, [&] {
    const wire::DecodedTissue* found = nullptr;
    if (const ecorche_code wrong = c::find_numbers(*client, tissue, found); wrong != ECORCHE_OK) return wrong;
    ecorche_packed packed = ECORCHE_PACKED_INIT;
    packed.vertex_count = static_cast<uint32_t>(found->vertices());
    packed.positions = found->numbers.data();
    packed.normals = found->normal_numbers.empty() ? nullptr : found->normal_numbers.data();
    std::copy(found->low.begin(), found->low.end(), std::begin(packed.low));
    packed.step = found->step;
    return c::fill(out, packed);
  });
}

ecorche_code ecorche_client_copy_packed(const ecorche_client* client, uint32_t tissue, void* vertices,
                                        size_t capacity) {
  return c::with_client(client, true, [&] {
    const wire::DecodedTissue* found = nullptr;
    if (const ecorche_code wrong = c::find_numbers(*client, tissue, found); wrong != ECORCHE_OK) return wrong;
    if (vertices == nullptr) return c::fail(ECORCHE_INVALID_ARGUMENT, "vertices: is null");
    if (found->vertices() > capacity) {
      return c::fail(ECORCHE_INVALID_ARGUMENT,
                     "capacity: the tissue has " + std::to_string(found->vertices()) + " vertices");
    }
    wire::interleave(*found, static_cast<std::byte*>(vertices));
    return ECORCHE_OK;
  });
}
