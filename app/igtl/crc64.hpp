// SPDX-License-Identifier: Apache-2.0
// The checksum of OpenIGTLink's bodies: CRC-64 of ECMA-182, from zero, highest bit first.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

namespace ecorche::app::igtl {

/// Of all `bytes`; zero for none. Eight bytes a step: a whole body's surfaces are tens of megabytes a frame.
std::uint64_t crc64(std::span<const std::byte> bytes);

}  // namespace ecorche::app::igtl
