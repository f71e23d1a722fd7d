// SPDX-License-Identifier: Apache-2.0
// What a case says about surfaces that come from its label map: `labels`, `side`, `within`, `close_mm`.
#pragma once

#include <functional>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include <ecorche/values/case.hpp>
#include "io/case/yaml_reader.hpp"

namespace ecorche::io {

/// Turns entries into label sources and keeps count of the labels that they use. Refusals are Error{config}.
class LabelSources {
 public:
  using ReadImage = std::function<Image(const yaml::Value& entry, const yaml::Value& file)>;

  /// `labels` is null where the case has none; `mid_plane` is the case's own, if it says so. `read_image`
  /// locates and reads the image of a `within`.
  LabelSources(const CaseLabels* labels, std::optional<double> mid_plane, ReadImage read_image);

  /// Whether `entry` is a map with `labels`. Refuses one that also has `file`, `frame` or `unit`, and one
  /// with `side`, `within` or `close_mm` that has no `labels`.
  bool is_one(const yaml::Value& entry) const;

  /// The source that `entry` names: ids or names of the table, or `all` where `may_be_all`.
  LabelSource read(const yaml::Value& entry, bool may_be_all = false);
  /// The outside of everything, for a case whose skin is left out.
  LabelSource everything(const yaml::Value& labels) const;

  /// The `apart` of the case's labels. `labels` of a limb are not used by it: they stand for no surface.
  HeldApart read_apart(const yaml::Value& apart, const Skeleton& skeleton) const;

  /// Whether `entry` asks for all labels that no other entry uses: `labels: rest`.
  static bool is_rest(const yaml::Value& entry);
  /// One tissue for each name of the table whose labels no other entry used, `except` does not list and the
  /// map holds. Names become identifiers, made unique with the id against `taken`.
  std::vector<CaseTissue> rest(const yaml::Value& entry, std::set<std::string> taken) const;

 private:
  const CaseLabels& need_labels(const yaml::Value& value) const;
  std::vector<std::int64_t> read_ids(const yaml::Value& value) const;
  void add_ids(const yaml::Value& value, std::vector<std::int64_t>& ids) const;
  void read_within(const yaml::Value& within, LabelSource& source);
  double mid_plane();

  const CaseLabels* labels_;
  std::optional<double> mid_plane_;
  ReadImage read_image_;
  std::vector<std::int64_t> present_;  // ids of the map, ascending
  std::set<std::int64_t> used_;
  struct Within {
    std::string file;
    std::shared_ptr<const Image> image;
    std::vector<std::int64_t> values;
  };
  std::vector<Within> withins_;  // each file is read once
};

}  // namespace ecorche::io
