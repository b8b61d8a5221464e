#include "scenes/compiler/plan.hpp"

#include <algorithm>
#include <utility>

#include "models/base/setup_error.hpp"

namespace proxarm::scenes {
namespace {

using description::number_text;

std::string counted(std::size_t n, const std::string& one, const std::string& several) {
  return std::to_string(n) + " " + (n > 1 ? several : one);
}

class Narrator {
 public:
  Narrator(const Scene& scene, const Plan& plan) : scene_(scene), plan_(plan) {}

  Narration tell() {
    for (const std::int32_t index : plan_.missed) skipped(object(index).name, "doesn't meet the proxy's space");
    contacts();
    media();
    return std::move(narration_);
  }

 private:
  void stage(std::string what, std::string why) { narration_.stages.push_back({std::move(what), std::move(why)}); }
  void skipped(std::string what, std::string why) { narration_.skipped.push_back({std::move(what), std::move(why)}); }

  [[nodiscard]] const Object& object(std::int32_t index) const {
    return scene_.objects[static_cast<std::size_t>(index)];
  }
  [[nodiscard]] const Object& only() const { return object(*plan_.only_object); }
  [[nodiscard]] bool has_friction() const { return plan_.friction == Plan::Friction::acts; }

  void skip_friction(const std::string& where = "") {
    if (has_friction()) return;
    const bool wanted = plan_.friction == Plan::Friction::no_tangent;
    skipped("friction", wanted ? "a line has no tangent to slip along" : "μ = 0" + where);
  }

  void contacts() {
    switch (plan_.contacts) {
      case Plan::Contacts::none:
        return skipped("contacts", "nothing to touch");
      case Plan::Contacts::plane:
      case Plan::Contacts::friction_plane:
        return plane();
      case Plan::Contacts::planes:
        return planes();
      case Plan::Contacts::mesh:
        return mesh();
      case Plan::Contacts::guide:
        return guide();
      case Plan::Contacts::guide_among_objects:
        return guide_among_objects();
      case Plan::Contacts::world:
        return world();
    }
  }

  void plane() {
    if (plan_.contacts == Plan::Contacts::friction_plane) {
      stage("wall with friction, equation (4)", only().name + ", μ = " + number_text(only().friction));
    } else {
      stage("wall, equation (2)", only().name);
    }
    skipped("motion", "nothing moves");
    skipped("composition", "a single surface");
    skip_friction();
  }

  void planes() {
    stage("composition of " + std::to_string(plan_.surfaces) + " planes" + (has_friction() ? " with friction" : ""),
          "sets of at most three contacts, solved directly");
    skipped("motion", "nothing moves");
    skip_friction(" everywhere");
    skipped("search", "all surfaces are flat and few");
  }

  void mesh() {
    const models::TriangleMesh& mesh = *std::get<MeshShape>(only().shape).mesh;
    const double mu = only().friction;
    stage("clearance", "a step that can't reach anything is q = p, without a look");
    stage("faces near the proxy", "of " + std::to_string(mesh.size()) + ", by a tree of boxes, once in many steps");
    stage("mesh" + (mu > 0.0 ? " with friction, μ = " + number_text(mu) : ""),
          only().name + (mesh.closed() ? ", closed" : ", open: both sides hold"));
    if (!only().friction_regions.empty()) {
      stage("friction by triangle", std::to_string(only().friction_regions.size()) + " regions");
    }
    const FaceAccount& account = std::get<MeshShape>(only().shape).account;
    if (account.flat + account.unfit > 0) {
      skipped(std::to_string(account.flat + account.unfit) + " triangles", "without an area");
    }
    if (account.closing > 0) stage("holes closed", "by " + std::to_string(account.closing) + " triangles");
    skipped("composition", "a single object");
    skip_friction();
    skipped("motion", "nothing moves");
  }

  void world() {
    const bool many = plan_.surfaces > 1;
    if (plan_.guide) stage("guide on a plane", "two half-spaces back to back, among the objects");
    stage("clearance", plan_.moving > 0 ? "of no use here: something moves"
                                        : "a step that can't reach anything is q = p, without a look");
    if (!plan_.joined.empty()) stage("no seam between objects that stand flush", joined_text(scene_, plan_));
    if (many) stage("search among " + std::to_string(plan_.surfaces) + " surfaces", "by a tree of boxes");
    stage(std::string("contact") + (has_friction() ? " with friction" : ""),
          std::string("each surface alone, exactly") + (many ? "; then pairs and triples" : ""));
    if (plan_.layers > 0) {
      stage(counted(plan_.layers, "elastic layer", "elastic layers"),
            many ? "alone exactly; with others the force is shared, by Newton's method" : only().name);
    }
    if (plan_.moving > 0) {
      stage("motion",
            counted(plan_.moving, "object", "objects") + "; q is carried along, and met in the object's frame");
    }
    if (!many) skipped("composition", "a single surface");
    skip_friction(" everywhere");
    if (plan_.moving == 0) skipped("motion", "nothing moves");
    if (plan_.layers == 0) skipped("elastic layers", "none");
  }

  void guide() {
    const std::string points = std::to_string(plan_.guide->points_m.size());
    skipped("contacts", "no objects");
    skip_friction();
    switch (plan_.guide->kind) {
      case GuideDescription::Kind::line:
        return stage("guide", "on a line");
      case GuideDescription::Kind::plane:
        return stage("guide", "on a plane, from both sides");
      case GuideDescription::Kind::polyline:
        return stage("guide", "along " + points + " points");
    }
  }

  void guide_among_objects() {
    const bool line = plan_.guide->kind == GuideDescription::Kind::line;
    stage(line ? "guide on a line" : "guide along " + std::to_string(plan_.guide->points_m.size()) + " points",
          has_friction() ? "μ = " + number_text(plan_.guide->friction) : "without friction");
    stage("stop", "at the first of " + counted(scene_.objects.size(), "object", "objects") + " on the way");
    if (plan_.moving > 0) stage("push", "by what moves onto the proxy, to the next free point");
    skipped("friction of objects", "there is one way to go, and what stops it holds");
  }

  void media() {
    for (const MediumDescription& medium : scene_.media) {
      stage(medium.force_N > 0.0 ? "Coulomb medium" : "viscous medium",
            medium.within ? "within a " + kind_of(*medium.within) : "everywhere");
    }
    if (plan_.coulomb == Plan::Coulomb::field) {
      return stage("Coulomb field, equation (3)", number_text(*scene_.coulomb_force_N) + " N everywhere");
    }
    const bool coulomb = plan_.coulomb == Plan::Coulomb::medium;
    if (coulomb) stage("Coulomb field", number_text(*scene_.coulomb_force_N) + " N everywhere, over the rest");
    if (plan_.contacts == Plan::Contacts::none) stage("free space, q = p", "nothing to touch");
    if (scene_.media.empty() && !coulomb) skipped("media", "none");
  }

  const Scene& scene_;
  const Plan& plan_;
  Narration narration_;
};

}  // namespace

std::string joined_text(const Scene& scene, const Plan& plan) {
  constexpr std::size_t told = 4;
  std::string text;
  for (std::size_t i = 0; i < std::min(told, plan.joined.size()); ++i) {
    const auto [a, b] = plan.joined[i];
    text += (i > 0 ? ", " : "") + scene.objects[static_cast<std::size_t>(a)].name + " and " +
            scene.objects[static_cast<std::size_t>(b)].name;
  }
  return plan.joined.size() > told ? text + " and " + std::to_string(plan.joined.size() - told) + " more" : text;
}

Narration narrate(const Scene& scene, const Plan& plan) { return Narrator(scene, plan).tell(); }

}  // namespace proxarm::scenes
