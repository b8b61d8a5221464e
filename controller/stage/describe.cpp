// Stage::describe(): what a page needs once, as JSON.
#include <algorithm>
#include <cmath>

#include "controller/limits/step_limits.hpp"
#include "controller/stage/json_text.hpp"
#include "controller/stage/stage.hpp"
#include "controller/stage/words.hpp"
#include "models/rigid_shapes/solid.hpp"

namespace proxarm::view {
namespace {

using models::Pose;
using models::Vec3;

void put(JsonText& json, const Vec3& v) { json.begin_list().value(v.x()).value(v.y()).value(v.z()).end(); }

// Writes a pose in the order of the wire: x y z and quaternion x y z w.
void put(JsonText& json, const Pose& X) {
  const Eigen::Quaterniond q(X.linear());
  json.begin_list();
  for (const double x : {X.translation().x(), X.translation().y(), X.translation().z(), q.x(), q.y(), q.z(), q.w()}) {
    json.value(x);
  }
  json.end();
}

template <typename Value>
void add(JsonText& json, const char* name, const Value& value) {
  put(json.name(name), value);
}

template <typename Round>
void add_round(JsonText& json, const Round& shape) {
  add(json, "from", shape.from_m);
  add(json, "to", shape.to_m);
  json.add("radius", shape.radius_m).add("inside_out", shape.inside_out);
}

void put(JsonText& json, const scenes::Shape& shape) {
  json.begin_object().add("kind", scenes::kind_of(shape));
  if (const auto* plane = std::get_if<scenes::PlaneShape>(&shape)) {
    add(json, "point", plane->point_m);
    add(json, "normal", Vec3(plane->normal.normalized()));
  } else if (const auto* box = std::get_if<scenes::BoxShape>(&shape)) {
    add(json, "pose", box->pose_W);
    add(json, "size", box->size_m);
    json.add("inside_out", box->inside_out);
  } else if (const auto* sphere = std::get_if<scenes::SphereShape>(&shape)) {
    add(json, "centre", sphere->centre_m);
    json.add("radius", sphere->radius_m).add("inside_out", sphere->inside_out);
  } else if (const auto* capsule = std::get_if<scenes::CapsuleShape>(&shape)) {
    add_round(json, *capsule);
  } else if (const auto* cylinder = std::get_if<scenes::CylinderShape>(&shape)) {
    add_round(json, *cylinder);
  } else if (const auto* mesh = std::get_if<scenes::MeshShape>(&shape)) {
    json.add("inside_out", mesh->inside_out).add("triangles", mesh->mesh ? mesh->mesh->size() : 0);
  }
  json.end();
}

void put(JsonText& json, const scenes::Object& object, std::size_t index, const scenes::CompiledScene& compiled) {
  put(json.begin_object().add("name", object.name).name("shape"), object.shape);
  json.add("friction", object.friction).add("friction_can_change", compiled.has_friction(index));
  json.add("moves", object.motion && !object.motion->driven).add("driven", object.motion && object.motion->driven);
  if (object.layer) {
    json.name("layer").begin_object().add("thickness", object.layer->thickness_m);
    json.add("stiffness", object.layer->stiffness_N_per_m).end();
  }
  if (std::holds_alternative<scenes::MeshShape>(object.shape)) {
    json.add("mesh", "mesh/object/" + std::to_string(index));
  }
  json.end();
}

void put(JsonText& json, const scenes::GuideDescription& guide) {
  constexpr std::array kinds{"line", "plane", "polyline"};
  json.begin_object().add("kind", kinds[static_cast<std::size_t>(guide.kind)]).name("points").begin_list();
  for (const Vec3& p : guide.points_m) put(json, p);
  json.end();
  add(json, "direction", Vec3(guide.direction.normalized()));
  json.add("closed", guide.closed).add("friction", guide.friction).end();
}

void put_scene(JsonText& json, const scenes::Scene& scene, const scenes::CompiledScene& compiled) {
  json.begin_object().add("name", scene.name).name("objects").begin_list();
  for (std::size_t i = 0; i < scene.objects.size(); ++i) put(json, scene.objects[i], i, compiled);
  json.end().name("media").begin_list();
  for (const scenes::MediumDescription& medium : scene.media) {
    json.begin_object().add("damping", medium.damping_Ns_per_m).add("force", medium.force_N).name("within");
    medium.within ? put(json, *medium.within) : void(json.null());
    json.end();
  }
  json.end().name("coulomb_force");
  scene.coulomb_force_N ? json.value(*scene.coulomb_force_N) : json.null();
  json.name("guide");
  scene.guide ? put(json, *scene.guide) : void(json.null());
  json.name("space").begin_object().add("dimensions", scene.space.dimensions);
  add(json, "origin", scene.space.origin_m);
  json.name("axes").begin_list();
  for (int i = 0; i < 3; ++i) put(json, Vec3(scene.space.axes.col(i)));
  json.end().end().end();
}

void put(JsonText& json, const models::LinkShape& shape, std::size_t link, std::size_t index) {
  json.begin_object();
  add(json, "pose", shape.X_link);
  if (shape.colour) {
    json.name("colour").begin_list();
    for (const double part : *shape.colour) json.value(part);
    json.end();
  }
  if (const auto* box = std::get_if<models::DrawnBox>(&shape.shape)) {
    add(json.add("kind", "box"), "size", box->size_m);
  } else if (const auto* cylinder = std::get_if<models::DrawnCylinder>(&shape.shape)) {
    json.add("kind", "cylinder").add("radius", cylinder->radius_m).add("length", cylinder->length_m);
  } else if (const auto* sphere = std::get_if<models::DrawnSphere>(&shape.shape)) {
    json.add("kind", "sphere").add("radius", sphere->radius_m);
  } else {
    json.add("kind", "mesh").add("mesh", "mesh/link/" + std::to_string(link) + "/" + std::to_string(index));
  }
  json.end();
}

void put_links(JsonText& json, const models::LinkTree& tree) {
  json.begin_list();
  for (std::size_t i = 0; i < tree.links().size(); ++i) {
    const models::DrawnLink& link = tree.links()[i];
    json.begin_object().add("name", link.name).add("parent", link.parent).add("moves", link.drive >= 0);
    json.name("shapes").begin_list();
    for (std::size_t k = 0; k < link.shapes.size(); ++k) put(json, link.shapes[k], i, k);
    json.end().end();
  }
  json.end();
}

// Writes a box. An infinite side is open, and written as null. A box without any finite side is written as null.
void put_box(JsonText& json, const std::array<double, 3>& low, const std::array<double, 3>& high) {
  const auto is_border = [](double x) { return std::isfinite(x); };
  if (std::none_of(low.begin(), low.end(), is_border) && std::none_of(high.begin(), high.end(), is_border)) {
    json.null();
    return;
  }
  json.begin_object().name("min").begin_list();
  for (const double x : low) json.value(x);
  json.end().name("max").begin_list();
  for (const double x : high) json.value(x);
  json.end().end();
}

void put_limits(JsonText& json, const description::CellLimits& limits) {
  json.begin_object().add("speed_m_per_s", limits.max_tool_speed_m_per_s).add("force_N", limits.max_force_N);
  json.add("power_W", limits.max_power_W).add("leash_m", limits.leash_m).name("keep_out").begin_list();
  for (const description::BoxDescription& box : limits.keep_out) put_box(json, box.min_m, box.max_m);
  json.end().name("workspace");
  put_box(json, limits.workspace_min_m, limits.workspace_max_m);
  json.end();
}

void put_words(JsonText& json, bool arm_alone) {
  json.begin_object().name("flags").begin_list();
  for (const FlagWords& flag : flag_words()) {
    json.begin_object().add("bit", static_cast<std::uint32_t>(flag.flag)).add("name", controller::flag_name(flag.flag));
    json.add("words", flag.words).add("holds_back", flag.holds_back).end();
  }
  json.end().name("phases").begin_list();
  for (std::size_t i = 0; i < controller::phase_count; ++i) {
    const auto phase = static_cast<controller::Phase>(i);
    const PhaseWords words = arm_alone ? drive_words(phase) : phase_words(phase);
    json.begin_object().add("name", words.name).add("words", words.words).end();
  }
  json.end().name("contacts").begin_list();
  for (const auto contact :
       {controller::ContactPhase::free, controller::ContactPhase::stick, controller::ContactPhase::slip}) {
    json.value(controller::contact_phase_name(contact));
  }
  json.end().end();
}

// Writes a hull as triangles: its points, and three indices for each triangle.
void add_hull(JsonText& json, const models::ConvexTool& hull) {
  const models::Solid solid = models::solid_of(hull, Pose::Identity());
  json.add("kind", "hull").name("points").begin_list();
  for (const Vec3& point : solid.points) put(json, point);
  json.end().name("triangles").begin_list();
  for (const models::Solid::Face& face : solid.faces) {
    const auto corners = solid.corners(face);
    for (std::size_t i = 2; i < corners.size(); ++i) {
      json.begin_list().value(corners[0]).value(corners[i - 1]).value(corners[i]).end();
    }
  }
  json.end();
}

void add_mesh(JsonText& json, const models::MeshTool& mesh) {
  json.add("kind", "hull").name("points").begin_list();
  for (const Vec3& point : mesh.points_m) put(json, point);
  json.end().name("triangles").begin_list();
  for (const auto& [a, b, c] : mesh.triangles) json.begin_list().value(a).value(b).value(c).end();
  json.end();
}

// Writes a part of a rigid tool. The pose is in the frame of the tool's link.
void put(JsonText& json, const models::ToolPart& part, const Pose& X_LT) {
  json.begin_object();
  add(json, "pose", Pose(X_LT * part.X_TP));
  if (const auto* box = std::get_if<models::BoxTool>(&part.shape)) {
    add(json.add("kind", "box"), "size", box->size_m);
  } else if (const auto* sphere = std::get_if<models::SphereTool>(&part.shape)) {
    json.add("kind", "sphere").add("radius", sphere->radius_m);
  } else if (const auto* capsule = std::get_if<models::CapsuleTool>(&part.shape)) {
    json.add("kind", "capsule").add("radius", capsule->radius_m).add("length", capsule->length_m);
  } else if (const auto* cylinder = std::get_if<models::CylinderTool>(&part.shape)) {
    json.add("kind", "cylinder").add("radius", cylinder->radius_m).add("length", cylinder->length_m);
  } else if (const auto* hull = std::get_if<models::ConvexTool>(&part.shape)) {
    add_hull(json, *hull);
  } else if (const auto* mesh = std::get_if<models::MeshTool>(&part.shape)) {
    add_mesh(json, *mesh);
  }
  json.end();
}

void put_tool(JsonText& json, const description::Cell& cell, const models::LinkTree& tree, const scenes::Scene& scene) {
  const auto& links = tree.links();
  const auto link =
      std::find_if(links.begin(), links.end(), [&](const models::DrawnLink& l) { return l.name == cell.sensor.link; });
  const Pose X_LS = models::to_pose(cell.sensor.pose_link), X_ST = models::to_pose(cell.tool.handle_S);
  json.begin_object();
  json.add("link", link != links.end() ? link - links.begin() : static_cast<std::ptrdiff_t>(links.size()) - 1);
  add(json, "sensor", X_LS);
  add(json, "handle", Pose(X_LS * X_ST));
  json.add("mass_kg", cell.tool.mass_kg).name("parts").begin_list();
  if (scene.tool) {
    for (const models::ToolPart& part : scene.tool->shape.parts) put(json, part, X_LS * X_ST);
  }
  json.end().end();
}

}  // namespace

std::string Stage::describe() const {
  JsonText json;
  json.begin_object().add("cell", cell_.name).name("fields").begin_list();
  for (const std::string& field : field_names()) json.value(field);
  json.end().name("contact_fields").begin_list();
  for (const std::string& field : contact_field_names()) json.value(field);
  put_links(json.end().name("links"), tree_);
  put_tool(json.name("tool"), cell_, tree_, scene_);
  put_scene(json.name("scene"), scene_, compiled_);
  put_limits(json.name("limits"), cell_.limits);
  put_words(json.name("words"), options_.arm_alone);
  json.name("notes").begin_list();
  for (const std::string& note : tree_.notes()) json.value(note);
  json.end().name("settings").begin_object();
  json.add("period_s", options_.period_s).add("mass_kg", options_.mass_kg);
  json.add("damping_Ns_per_m", options_.damping_Ns_per_m).add("spring_N_per_m", options_.spring_N_per_m);
  json.add("impedance", options_.impedance).end();
  return json.end().take();
}

}  // namespace proxarm::view
