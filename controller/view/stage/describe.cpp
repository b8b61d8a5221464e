// Stage::describe(): what a page must know once, as JSON.
#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "controller/limits/step_limits.hpp"
#include "controller/view/stage/stage.hpp"
#include "controller/view/stage/words.hpp"

namespace proxarm::view {
namespace {

using models::Pose;
using models::Vec3;
using nlohmann::json;

json of(const Vec3& v) { return json::array({v.x(), v.y(), v.z()}); }

json of(const Pose& X) {
  const Eigen::Quaterniond q(X.linear());
  const Vec3 p = X.translation();
  return json::array({p.x(), p.y(), p.z(), q.x(), q.y(), q.z(), q.w()});
}

json of(const scenes::Shape& shape) {
  json out{{"kind", scenes::kind_of(shape)}};
  if (const auto* plane = std::get_if<scenes::PlaneShape>(&shape)) {
    out["point"] = of(plane->point_m);
    out["normal"] = of(plane->normal.normalized());
  } else if (const auto* box = std::get_if<scenes::BoxShape>(&shape)) {
    out["pose"] = of(box->pose_W);
    out["size"] = of(box->size_m);
    out["inside_out"] = box->inside_out;
  } else if (const auto* sphere = std::get_if<scenes::SphereShape>(&shape)) {
    out["centre"] = of(sphere->centre_m);
    out["radius"] = sphere->radius_m;
    out["inside_out"] = sphere->inside_out;
  } else if (const auto* capsule = std::get_if<scenes::CapsuleShape>(&shape)) {
    out.update({{"from", of(capsule->from_m)}, {"to", of(capsule->to_m)}, {"radius", capsule->radius_m}});
    out["inside_out"] = capsule->inside_out;
  } else if (const auto* cylinder = std::get_if<scenes::CylinderShape>(&shape)) {
    out.update({{"from", of(cylinder->from_m)}, {"to", of(cylinder->to_m)}, {"radius", cylinder->radius_m}});
    out["inside_out"] = cylinder->inside_out;
  } else if (const auto* mesh = std::get_if<scenes::MeshShape>(&shape)) {
    out["inside_out"] = mesh->inside_out;
    out["triangles"] = mesh->mesh ? mesh->mesh->size() : 0;
  }
  return out;
}

json of(const scenes::Object& object, std::size_t index, const scenes::CompiledScene& compiled) {
  json out{{"name", object.name},
           {"shape", of(object.shape)},
           {"friction", object.friction},
           {"friction_can_change", compiled.has_friction(index)},
           {"moves", object.motion && !object.motion->driven},
           {"driven", object.motion && object.motion->driven}};
  if (object.layer) {
    out["layer"] = {{"thickness", object.layer->thickness_m}, {"stiffness", object.layer->stiffness_N_per_m}};
  }
  if (std::holds_alternative<scenes::MeshShape>(object.shape)) out["mesh"] = "mesh/object/" + std::to_string(index);
  return out;
}

json of(const scenes::GuideDescription& guide) {
  constexpr std::array kinds{"line", "plane", "polyline"};
  json points = json::array();
  for (const Vec3& p : guide.points_m) points.push_back(of(p));
  return {{"kind", kinds[static_cast<std::size_t>(guide.kind)]},
          {"points", points},
          {"direction", of(guide.direction.normalized())},
          {"closed", guide.closed},
          {"friction", guide.friction}};
}

json scene_json(const scenes::Scene& scene, const scenes::CompiledScene& compiled) {
  json out{{"name", scene.name}, {"objects", json::array()}, {"media", json::array()}};
  for (std::size_t i = 0; i < scene.objects.size(); ++i) out["objects"].push_back(of(scene.objects[i], i, compiled));
  for (const scenes::MediumDescription& medium : scene.media) {
    out["media"].push_back({{"damping", medium.damping_Ns_per_m},
                            {"force", medium.force_N},
                            {"within", medium.within ? of(*medium.within) : json()}});
  }
  out["coulomb_force"] = scene.coulomb_force_N ? json(*scene.coulomb_force_N) : json();
  out["guide"] = scene.guide ? of(*scene.guide) : json();
  out["space"] = {
      {"dimensions", scene.space.dimensions},
      {"origin", of(scene.space.origin_m)},
      {"axes",
       {of(Vec3(scene.space.axes.col(0))), of(Vec3(scene.space.axes.col(1))), of(Vec3(scene.space.axes.col(2)))}}};
  return out;
}

json of(const models::LinkShape& shape, std::size_t link, std::size_t index) {
  json out{{"pose", of(shape.X_link)}};
  if (shape.colour) out["colour"] = *shape.colour;
  if (const auto* box = std::get_if<models::DrawnBox>(&shape.shape)) {
    out.update({{"kind", "box"}, {"size", of(box->size_m)}});
  } else if (const auto* cylinder = std::get_if<models::DrawnCylinder>(&shape.shape)) {
    out.update({{"kind", "cylinder"}, {"radius", cylinder->radius_m}, {"length", cylinder->length_m}});
  } else if (const auto* sphere = std::get_if<models::DrawnSphere>(&shape.shape)) {
    out.update({{"kind", "sphere"}, {"radius", sphere->radius_m}});
  } else {
    out.update({{"kind", "mesh"}, {"mesh", "mesh/link/" + std::to_string(link) + "/" + std::to_string(index)}});
  }
  return out;
}

json links_json(const models::LinkTree& tree) {
  json out = json::array();
  for (std::size_t i = 0; i < tree.links().size(); ++i) {
    const models::DrawnLink& link = tree.links()[i];
    json shapes = json::array();
    for (std::size_t k = 0; k < link.shapes.size(); ++k) shapes.push_back(of(link.shapes[k], i, k));
    out.push_back({{"name", link.name}, {"parent", link.parent}, {"moves", link.drive >= 0}, {"shapes", shapes}});
  }
  return out;
}

// Null where a side is open, as limits that aren't given are.
json box_json(const std::array<double, 3>& low, const std::array<double, 3>& high) {
  json out{{"min", json::array()}, {"max", json::array()}};
  bool any = false;
  for (std::size_t i = 0; i < 3; ++i) {
    any = any || std::isfinite(low[i]) || std::isfinite(high[i]);
    out["min"].push_back(std::isfinite(low[i]) ? json(low[i]) : json());
    out["max"].push_back(std::isfinite(high[i]) ? json(high[i]) : json());
  }
  return any ? out : json();
}

json limits_json(const description::CellLimits& limits) {
  json keep_out = json::array();
  for (const description::BoxDescription& box : limits.keep_out) keep_out.push_back(box_json(box.min_m, box.max_m));
  return {{"speed_m_per_s", limits.max_tool_speed_m_per_s},
          {"force_N", limits.max_force_N},
          {"power_W", limits.max_power_W},
          {"leash_m", limits.leash_m},
          {"keep_out", keep_out},
          {"workspace", box_json(limits.workspace_min_m, limits.workspace_max_m)}};
}

json words_json() {
  json flags = json::array(), phases = json::array();
  for (const FlagWords& flag : flag_words()) {
    flags.push_back({{"bit", static_cast<std::uint32_t>(flag.flag)},
                     {"name", flag.name},
                     {"words", flag.words},
                     {"holds_back", flag.holds_back}});
  }
  for (std::size_t i = 0; i < controller::phase_count; ++i) {
    const auto phase = static_cast<controller::Phase>(i);
    phases.push_back({{"name", controller::phase_name(phase)}, {"words", phase_words(phase)}});
  }
  return {{"flags", flags}, {"phases", phases}, {"contacts", {"free", "stick", "slip"}}};
}

json tool_json(const description::Cell& cell, const models::LinkTree& tree) {
  const auto& links = tree.links();
  const auto link =
      std::find_if(links.begin(), links.end(), [&](const models::DrawnLink& l) { return l.name == cell.sensor.link; });
  const Pose X_LS = models::to_pose(cell.sensor.pose_link), X_ST = models::to_pose(cell.tool.handle_S);
  return {{"link", link != links.end() ? link - links.begin() : static_cast<std::ptrdiff_t>(links.size()) - 1},
          {"sensor", of(X_LS)},
          {"handle", of(Pose(X_LS * X_ST))},
          {"mass_kg", cell.tool.mass_kg}};
}

}  // namespace

std::string Stage::describe() const {
  const json out{{"cell", cell_.name},
                 {"fields", field_names()},
                 {"links", links_json(tree_)},
                 {"tool", tool_json(cell_, tree_)},
                 {"scene", scene_json(scene_, compiled_)},
                 {"limits", limits_json(cell_.limits)},
                 {"words", words_json()},
                 {"notes", tree_.notes()},
                 {"settings",
                  {{"period_s", options_.period_s},
                   {"mass_kg", options_.mass_kg},
                   {"damping_Ns_per_m", options_.damping_Ns_per_m},
                   {"spring_N_per_m", options_.spring_N_per_m},
                   {"impedance", options_.impedance}}}};
  return out.dump(-1, ' ', false, json::error_handler_t::replace);
}

}  // namespace proxarm::view
