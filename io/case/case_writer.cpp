// SPDX-License-Identifier: Apache-2.0
// Writing a case as an ordinary folder of files: case.yaml last, so that a folder with one is whole.
#include <ecorche/io/case_file.hpp>
#include "core/files/atomic_file.hpp"
#include "io/case/joint_rule_file.hpp"
#include "io/case/yaml_text.hpp"
#include "io/image/image_file.hpp"
#include "io/image/segmentation.hpp"
#include "io/surface/surface_file.hpp"

namespace ecorche::io {
namespace {

using yaml::write_text;

class CaseWriter {
 public:
  CaseWriter(const std::filesystem::path& folder, const Case& patient, const Context& context)
      : folder_(folder),
        patient_(patient),
        context_(context),
        steps_(1 + patient.bones.size() + patient.tissues.size() + patient.volumes.size() +
               (patient.labels ? 1 : 0)) {}

  void write() {
    files::make_folder(folder_);
    if (!patient_.generic)
      files::write_text(folder_ / "skeleton.yaml", skeleton_to_yaml(patient_.skeleton, patient_.size));
    yaml_ = "name: " + write_text(patient_.name) +
            "\nframe: LPS\nunit: mm\nskeleton: " + (patient_.generic ? "generic" : "skeleton.yaml") + "\n" +
            (patient_.stiffness_kpa ? stiffness("", patient_.stiffness_kpa) + "\n" : "") + contacts();
    surface("skin.stl", patient_.skin);
    yaml_ += patient_.skin_name == "skin"
                 ? "skin: skin.stl\n"
                 : "skin: {name: " + write_text(patient_.skin_name) + ", file: skin.stl}\n";
    write_bones();
    write_regions();
    write_tissues();
    write_volumes();
    if (patient_.labels) write_labels(*patient_.labels);
    files::write_text(folder_ / "case.yaml", yaml_);
  }

 private:
  void step() {
    context_.check_stop();
    context_.report(static_cast<double>(++done_) / static_cast<double>(steps_));
  }
  void surface(const std::string& file, const SurfaceMesh& mesh) {
    write_surface(folder_ / file, mesh);
    step();
  }
  void image(const std::string& file, const Image& image) {
    write_image(folder_ / file, image);
    step();
  }

  void write_bones() {
    if (patient_.bones.empty()) return;
    files::make_folder(folder_ / "bones");
    yaml_ += "bones:\n";
    for (const CaseBone& bone : patient_.bones) {
      const std::string file = "bones/" + bone.name + ".stl";
      surface(file, bone.surface);
      yaml_ += "  - {name: " + write_text(bone.name) + ", file: " + write_text(file) +
               ", segment: " + write_text(bone.segment) + "}\n";
    }
  }
  void write_regions() {
    if (patient_.regions.empty()) return;
    files::write_text(folder_ / "regions.yaml", regions_to_yaml(patient_.regions));
    yaml_ += "regions: regions.yaml\n";
  }
  std::string contacts() const {
    const CaseContacts& said = patient_.contacts;
    if (!said.cut) return "contacts: joined\n";
    std::string pairs;
    for (const auto& [a, b] : said.joined)
      pairs.append(pairs.empty() ? "[" : ", [").append(a).append(", ").append(b).append("]");
    return pairs.empty() ? "" : "contacts: {joined: [" + pairs + "]}\n";
  }
  static std::string stiffness(const std::string& before, const std::optional<double>& kpa) {
    return kpa ? before + "stiffness_kpa: " + yaml::write_number(*kpa) : "";
  }
  void write_tissues() {
    if (patient_.tissues.empty()) return;
    files::make_folder(folder_ / "tissues");
    yaml_ += "tissues:\n";
    for (const CaseTissue& tissue : patient_.tissues) {
      const std::string file = "tissues/" + tissue.name + ".stl";
      surface(file, tissue.surface);
      yaml_ += "  - {name: " + write_text(tissue.name) + ", file: " + write_text(file) +
               ", group: " + std::string(group_name(tissue.group)) + stiffness(", ", tissue.stiffness_kpa) +
               "}\n";
    }
  }
  void write_volumes() {
    if (patient_.volumes.empty()) return;
    files::make_folder(folder_ / "volumes");
    yaml_ += "volumes:\n";
    for (const CaseVolume& volume : patient_.volumes) {
      const std::string file = "volumes/" + volume.name + ".nrrd";
      image(file, volume.image);
      yaml_ += "  - {name: " + write_text(volume.name) + ", file: " + write_text(file) +
               ", background: " + yaml::write_number(volume.background) + "}\n";
    }
  }
  void write_labels(const CaseLabels& labels) {
    files::make_folder(folder_ / "volumes");
    std::string file = "volumes/labels.nrrd";
    if (labels.overlaps.empty()) {
      image(file, labels.image);
    } else {
      file = "volumes/labels.seg.nrrd";
      Segmentation segmentation{{labels.image}, labels.table};
      segmentation.layers.insert(segmentation.layers.end(), labels.overlaps.begin(), labels.overlaps.end());
      write_segmentation(folder_ / file, segmentation);
      step();
    }
    yaml_ += "labels:\n  file: " + file + "\n  table:";
    if (labels.table.empty()) yaml_ += " {}";
    yaml_ += "\n";
    for (const auto& [id, name] : labels.table)
      yaml_ += "    " + std::to_string(id) + ": " + write_text(name) + "\n";
  }

  const std::filesystem::path& folder_;
  const Case& patient_;
  const Context& context_;
  std::size_t steps_, done_ = 0;
  std::string yaml_;
};

}  // namespace

void write_case(const std::filesystem::path& folder, const Case& patient, const Context& context) {
  CaseWriter(folder, patient, context).write();
}

}  // namespace ecorche::io
