// SPDX-License-Identifier: Apache-2.0
// The same frame our way, through gRPC and as Protobuf bytes.
#pragma once

#include <string>

namespace ecorche::bench {

/// The whole body in float32, 20 poses a second, one client that keeps each frame: prints p50 and p99 of
/// ours, and, where `peers` (bench_grpc) was built, of theirs, and how ours compare.
void same_frame(const std::string& program, const std::string& model, const std::string& peers,
                double seconds);

}  // namespace ecorche::bench
