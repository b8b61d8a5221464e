#include "controller/assessment/thresholds.hpp"

#include "models/files/yaml_file.hpp"

namespace proxarm::assessment {
namespace {

// From softer than any tissue to harder than a skull, and from hardly felt to bone-breaking.
constexpr description::Range stiffness_range = description::between(1.0, 1000.0);
constexpr description::Range force_range = description::between(1.0, 10'000.0);
constexpr double per_mm = 1000.0;  // N/m in a N/mm

Region read_region(const description::YamlNode& node) {
  Region region;
  region.name = node.string("name");
  region.stiffness_N_per_m = per_mm * node.number("stiffness_N_per_mm", stiffness_range);
  region.quasi_static_N = node.number("quasi_static_N", force_range);
  region.transient_N = node.number("transient_N", force_range);
  if (region.transient_N < region.quasi_static_N) {
    throw node.error_at("transient_N", "at least quasi_static_N: a short contact may be as hard as a long one");
  }
  return region;
}

}  // namespace

Thresholds load_thresholds(const std::filesystem::path& file) {
  const description::YamlNode root = description::YamlNode::load(file);
  Thresholds thresholds;
  thresholds.file = file;
  thresholds.source = root.string("source");
  for (const description::YamlNode& node : root.list("regions", 1, 100)) {
    thresholds.regions.push_back(read_region(node));
  }
  root.finish();
  return thresholds;
}

}  // namespace proxarm::assessment
