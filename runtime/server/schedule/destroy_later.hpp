// SPDX-License-Identifier: Apache-2.0
// Where what is large ends.
#pragma once

#include <functional>
#include <memory>

namespace ecorche::server {

/// Has something destroyed elsewhere than on the I/O thread, which giving back hundreds of MiB would keep for
/// longer than a frame, as Executor::destroy_later() does. Throws nothing.
using DestroyLater = std::function<void(std::shared_ptr<const void>)>;

}  // namespace ecorche::server
