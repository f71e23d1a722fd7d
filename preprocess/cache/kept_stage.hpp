// SPDX-License-Identifier: Apache-2.0
// One stage through a store: taken from it when it was made before, made and kept when not.
#pragma once

#include <cstdio>
#include <mutex>
#include <string>
#include <string_view>
#include <vector>

#include <ecorche/preprocess/stage_store.hpp>
#include <ecorche/values/context.hpp>
#include "core/values/text.hpp"
#include "preprocess/cache/archive.hpp"
#include "preprocess/cache/fields.hpp"

namespace ecorche::preprocess::cache {

/// `<stage>-<16 hexadecimal digits>`: XXH64 of the program, the stage, and everything that it reads.
template <class... Inputs>
std::string key(const StageStore& store, std::string_view stage, const Inputs&... inputs) {
  Hasher hash;
  hash(store.program(), stage, inputs...);
  return std::string(stage) + "-" + text::hex(hash.value());
}

/// What a stage made, and the warnings that it gave on the way: they are given again when it is taken.
template <class Value>
struct Kept {
  Value value;
  std::vector<std::string> warnings;
};

/// What is kept under `name`, its warnings given to `context`; nothing when it is not there or cannot be
/// read.
template <class Value>
std::optional<Value> take(StageStore& store, const std::string& name, const Context& context) {
  const std::optional<std::string> bytes = store.find(name);
  if (!bytes) return std::nullopt;
  Kept<Value> kept;
  try {
    Unpacker unpack(*bytes);
    unpack(kept.warnings, kept.value);
    if (!unpack.done()) return std::nullopt;
  } catch (const Misread&) {
    return std::nullopt;
  }
  for (const std::string& warning : kept.warnings) context.warn(warning);
  return std::move(kept.value);
}

/// `make(context)`, kept under `name` with its warnings. A store that fails is warned of, and the value
/// returned all the same.
template <class Make>
auto make_and_keep(StageStore& store, const std::string& name, const Context& outer, Make&& make) {
  Kept<decltype(make(outer))> kept;
  std::mutex mutex;
  Context context = outer;
  context.log = [&](LogLevel level, std::string_view line) {
    if (level == LogLevel::warning) {
      const std::lock_guard lock(mutex);
      kept.warnings.emplace_back(line);
    }
    outer.log ? outer.log(level, line) : void();
  };
  kept.value = make(context);
  try {
    Packer pack;
    pack(kept.warnings, kept.value);
    store.keep(name, pack.take());
  } catch (const Error& error) {
    if (error.kind() == ErrorKind::interrupted) throw;
    outer.warn("not kept: " + name + ": " + error.what());
  }
  return std::move(kept.value);
}

}  // namespace ecorche::preprocess::cache
