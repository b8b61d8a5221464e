#include "controller/view/messages/session_messages.hpp"

#include <array>
#include <charconv>
#include <cmath>
#include <nlohmann/json.hpp>

#include "controller/supervision/fault.hpp"
#include "controller/view/stage/words.hpp"

namespace proxarm::view {
namespace {

using models::Pose;
using models::Vec3;
using nlohmann::json;

// ---- schemas

json numbers(std::initializer_list<const char*> names) {
  json properties = json::object();
  for (const char* name : names) properties[name] = {{"type", "number"}};
  return {{"type", "object"}, {"properties", properties}};
}

json object_of(const char* title, json properties) {
  json schema{{"type", "object"}, {"properties", std::move(properties)}};
  if (title != nullptr) schema["title"] = title;
  return schema;
}

json list_of(json items) { return {{"type", "array"}, {"items", std::move(items)}}; }

const json text_type{{"type", "string"}}, number_type{{"type", "number"}}, flag_type{{"type", "boolean"}};

json time_type() {
  return {{"type", "object"},
          {"title", "time"},
          {"properties", {{"sec", {{"type", "integer"}}}, {"nsec", {{"type", "integer"}}}}}};
}

json xyz() { return numbers({"x", "y", "z"}); }
json xyzw() { return numbers({"x", "y", "z", "w"}); }
json pose_type() { return object_of("foxglove.Pose", {{"position", xyz()}, {"orientation", xyzw()}}); }
json colour_type() { return numbers({"r", "g", "b", "a"}); }

json pose_schema() {
  return object_of("foxglove.PoseInFrame",
                   {{"timestamp", time_type()}, {"frame_id", text_type}, {"pose", pose_type()}});
}

json transforms_schema() {
  return object_of("foxglove.FrameTransforms",
                   {{"transforms", list_of(object_of("foxglove.FrameTransform", {{"timestamp", time_type()},
                                                                                 {"parent_frame_id", text_type},
                                                                                 {"child_frame_id", text_type},
                                                                                 {"translation", xyz()},
                                                                                 {"rotation", xyzw()}}))}});
}

json scene_schema() {
  const json cube =
      object_of("foxglove.CubePrimitive", {{"pose", pose_type()}, {"size", xyz()}, {"color", colour_type()}});
  const json sphere =
      object_of("foxglove.SpherePrimitive", {{"pose", pose_type()}, {"size", xyz()}, {"color", colour_type()}});
  const json cylinder = object_of("foxglove.CylinderPrimitive", {{"pose", pose_type()},
                                                                 {"size", xyz()},
                                                                 {"bottom_scale", number_type},
                                                                 {"top_scale", number_type},
                                                                 {"color", colour_type()}});
  const json triangles = object_of("foxglove.TriangleListPrimitive", {{"pose", pose_type()},
                                                                      {"points", list_of(xyz())},
                                                                      {"color", colour_type()},
                                                                      {"colors", list_of(colour_type())},
                                                                      {"indices", list_of({{"type", "integer"}})}});
  const json anything = list_of({{"type", "object"}});
  const json entity = object_of("foxglove.SceneEntity", {{"timestamp", time_type()},
                                                         {"frame_id", text_type},
                                                         {"id", text_type},
                                                         {"lifetime", time_type()},
                                                         {"frame_locked", flag_type},
                                                         {"metadata", anything},
                                                         {"arrows", anything},
                                                         {"cubes", list_of(cube)},
                                                         {"spheres", list_of(sphere)},
                                                         {"cylinders", list_of(cylinder)},
                                                         {"lines", anything},
                                                         {"triangles", list_of(triangles)},
                                                         {"texts", anything},
                                                         {"models", anything}});
  return object_of("foxglove.SceneUpdate", {{"deletions", anything}, {"entities", list_of(entity)}});
}

json wrench_schema() {
  return object_of("proxarm.Wrench",
                   {{"timestamp", time_type()}, {"frame_id", text_type}, {"force", xyz()}, {"torque", xyz()}});
}

json contact_schema() {
  return object_of("proxarm.Contact", {{"timestamp", time_type()},
                                       {"frame_id", text_type},
                                       {"state", text_type},
                                       {"object", text_type},
                                       {"contacts", number_type},
                                       {"friction", number_type},
                                       {"force", xyz()},
                                       {"normal", xyz()},
                                       {"proxy_clearance_m", number_type},
                                       {"tool_clearance_m", number_type}});
}

json joints_schema() {
  return object_of("proxarm.JointStates", {{"timestamp", time_type()},
                                           {"name", list_of(text_type)},
                                           {"commanded_rad", list_of(number_type)},
                                           {"measured_rad", list_of(number_type)}});
}

json session_schema() {
  return object_of("proxarm.Session", {{"timestamp", time_type()},
                                       {"cycle", number_type},
                                       {"phase", text_type},
                                       {"flags", list_of(text_type)},
                                       {"fault", text_type},
                                       {"mass_kg", number_type},
                                       {"damping_Ns_per_m", number_type},
                                       {"energy_hand_J", number_type},
                                       {"energy_proxy_J", number_type}});
}

// ---- messages

json of_time(std::int64_t time_ns) { return {{"sec", time_ns / 1'000'000'000}, {"nsec", time_ns % 1'000'000'000}}; }
json of(const Vec3& v) { return {{"x", v.x()}, {"y", v.y()}, {"z", v.z()}}; }
json of(const Eigen::Quaterniond& q) { return {{"x", q.x()}, {"y", q.y()}, {"z", q.z()}, {"w", q.w()}}; }
json of(const Pose& X) {
  return {{"position", of(Vec3(X.translation()))}, {"orientation", of(Eigen::Quaterniond(X.linear()))}};
}
json colour(double r, double g, double b, double a) { return {{"r", r}, {"g", g}, {"b", b}, {"a", a}}; }

Pose at(const Vec3& p) {
  Pose X = Pose::Identity();
  X.translation() = p;
  return X;
}

// Between two points, its z from one to the other.
Pose between(const Vec3& from, const Vec3& to) {
  Pose X = at(0.5 * (from + to));
  X.linear() = Eigen::Quaterniond::FromTwoVectors(Vec3::UnitZ(), to - from).toRotationMatrix();
  return X;
}

json empty_entity(const std::string& id, const std::string& frame, std::int64_t time_ns) {
  json entity{{"timestamp", of_time(time_ns)},
              {"frame_id", frame},
              {"id", id},
              {"lifetime", of_time(0)},
              {"frame_locked", true}};
  for (const char* kind :
       {"metadata", "arrows", "cubes", "spheres", "cylinders", "lines", "triangles", "texts", "models"}) {
    entity[kind] = json::array();
  }
  return entity;
}

json cylinder(const Pose& X, double radius_m, double length_m, const json& paint) {
  return {{"pose", of(X)},
          {"size", of(Vec3(2.0 * radius_m, 2.0 * radius_m, length_m))},
          {"bottom_scale", 1.0},
          {"top_scale", 1.0},
          {"color", paint}};
}
json sphere(const Vec3& centre, double radius_m, const json& paint) {
  return {{"pose", of(at(centre))}, {"size", of(Vec3(Vec3::Constant(2.0 * radius_m)))}, {"color", paint}};
}
json cube(const Pose& X, const Vec3& size_m, const json& paint) {
  return {{"pose", of(X)}, {"size", of(size_m)}, {"color", paint}};
}

void add_shape(json& entity, const models::LinkShape& shape) {
  const auto rgb = shape.colour.value_or(std::array{0.75, 0.78, 0.82});
  const json paint = colour(rgb[0], rgb[1], rgb[2], 1.0);
  if (const auto* box = std::get_if<models::DrawnBox>(&shape.shape)) {
    entity["cubes"].push_back(cube(shape.X_link, box->size_m, paint));
  } else if (const auto* round = std::get_if<models::DrawnCylinder>(&shape.shape)) {
    entity["cylinders"].push_back(cylinder(shape.X_link, round->radius_m, round->length_m, paint));
  } else if (const auto* ball = std::get_if<models::DrawnSphere>(&shape.shape)) {
    entity["spheres"].push_back(sphere(shape.X_link.translation(), ball->radius_m, paint));
  }
}

// Large meshes would make the message larger than tools take: every so many triangles of them.
constexpr std::size_t most_triangles = 20'000;

json mesh_triangles(const models::TriangleMesh& mesh, const Pose& X, const json& paint) {
  json points = json::array(), indices = json::array();
  const std::size_t step = mesh.size() / most_triangles + 1;
  for (std::size_t face = 0; face < mesh.size(); face += step) {
    for (std::size_t k = 0; k < 3; ++k) points.push_back(of(mesh.corner(static_cast<std::uint32_t>(face), k)));
  }
  return {{"pose", of(X)}, {"points", points}, {"color", paint}, {"colors", json::array()}, {"indices", indices}};
}

// `X`: by which the object is moved from where it is described.
void add_object(json& entity, const scenes::Object& object, const Pose& X) {
  const json paint = colour(0.25, 0.65, 0.5, 0.5);
  if (const auto* plane = std::get_if<scenes::PlaneShape>(&object.shape)) {
    Pose sheet = X * at(plane->point_m);
    sheet.linear() = X.linear() * Eigen::Quaterniond::FromTwoVectors(Vec3::UnitZ(), plane->normal).toRotationMatrix();
    entity["cubes"].push_back(cube(sheet, Vec3(1.0, 1.0, 1e-3), paint));
  } else if (const auto* box = std::get_if<scenes::BoxShape>(&object.shape)) {
    entity["cubes"].push_back(cube(X * box->pose_W, box->size_m, paint));
  } else if (const auto* ball = std::get_if<scenes::SphereShape>(&object.shape)) {
    entity["spheres"].push_back(sphere(X * ball->centre_m, ball->radius_m, paint));
  } else if (const auto* capsule = std::get_if<scenes::CapsuleShape>(&object.shape)) {
    entity["cylinders"].push_back(cylinder(X * between(capsule->from_m, capsule->to_m), capsule->radius_m,
                                           (capsule->to_m - capsule->from_m).norm(), paint));
    for (const Vec3& end : {capsule->from_m, capsule->to_m}) {
      entity["spheres"].push_back(sphere(X * end, capsule->radius_m, paint));
    }
  } else if (const auto* round = std::get_if<scenes::CylinderShape>(&object.shape)) {
    entity["cylinders"].push_back(cylinder(X * between(round->from_m, round->to_m), round->radius_m,
                                           (round->to_m - round->from_m).norm(), paint));
  } else if (const auto* mesh = std::get_if<scenes::MeshShape>(&object.shape); mesh != nullptr && mesh->mesh) {
    entity["triangles"].push_back(mesh_triangles(*mesh->mesh, X, paint));
  }
}

json scene_message(const Stage& stage, std::int64_t time_ns, std::span<const Pose> objects) {
  json entities = json::array();
  for (const models::DrawnLink& link : stage.links().links()) {
    json entity = empty_entity("link " + link.name, link.name, time_ns);
    for (const models::LinkShape& shape : link.shapes) add_shape(entity, shape);
    entities.push_back(std::move(entity));
  }
  for (std::size_t i = 0; i < stage.scene().objects.size(); ++i) {
    json entity = empty_entity("object " + stage.scene().objects[i].name, "W", time_ns);
    add_object(entity, stage.scene().objects[i], objects[i]);
    entities.push_back(std::move(entity));
  }
  return {{"deletions", json::array()}, {"entities", entities}};
}

json transforms_message(const Stage& stage, std::int64_t time_ns, std::span<const Pose> links) {
  json transforms = json::array();
  for (std::size_t i = 0; i < links.size(); ++i) {
    transforms.push_back({{"timestamp", of_time(time_ns)},
                          {"parent_frame_id", "W"},
                          {"child_frame_id", stage.links().links()[i].name},
                          {"translation", of(Vec3(links[i].translation()))},
                          {"rotation", of(Eigen::Quaterniond(links[i].linear()))}});
  }
  return {{"transforms", transforms}};
}

// Those of every cycle are written by hand: as objects of a JSON library they take ten times as long.
class Text {
 public:
  explicit Text(std::int64_t time_ns) : text_("{\"timestamp\":") {
    text_ += "{\"sec\":" + std::to_string(time_ns / 1'000'000'000) +
             ",\"nsec\":" + std::to_string(time_ns % 1'000'000'000) + "}";
  }
  Text& add(const char* name, double value) {
    begin(name);
    put(value);
    return *this;
  }
  Text& add(const char* name, const std::string& value) {
    begin(name);
    text_ += json(value).dump(-1, ' ', false, json::error_handler_t::replace);
    return *this;
  }
  Text& add(const char* name, const controller::Triple& v) {
    begin(name);
    const char* before = "{\"x\":";
    for (std::size_t i = 0; i < 3; ++i) {
      text_ += before;
      put(v[i]);
      before = i == 0 ? ",\"y\":" : ",\"z\":";
    }
    text_ += '}';
    return *this;
  }
  Text& add(const char* name, std::span<const double> values) {
    begin(name);
    char before = '[';
    for (const double value : values) {
      text_ += before;
      put(value);
      before = ',';
    }
    text_ += values.empty() ? "[]" : "]";
    return *this;
  }
  std::string end() {
    text_ += '}';
    return std::move(text_);
  }

 private:
  void begin(const char* name) {
    text_ += ",\"";
    text_ += name;
    text_ += "\":";
  }
  // JSON has no infinity, which is how far it is to the nearest of no objects.
  void put(double value) {
    std::array<char, 32> digits;
    const auto end = std::to_chars(digits.data(), digits.data() + digits.size(), value).ptr;
    text_.append(std::isfinite(value) ? std::string_view(digits.data(), static_cast<std::size_t>(end - digits.data()))
                                      : std::string_view("null"));
  }
  std::string text_;
};

std::string wrench_message(const controller::CycleRecord& record) {
  return Text(record.time_ns)
      .add("frame_id", std::string("W"))
      .add("force", record.force_W_N)
      .add("torque", record.torque_W_Nm)
      .end();
}

std::string contact_message(const Stage& stage, const controller::CycleRecord& record) {
  const auto object = static_cast<std::size_t>(record.contact_object);
  const bool named = record.contact_object >= 0 && object < stage.scene().objects.size();
  return Text(record.time_ns)
      .add("frame_id", std::string("W"))
      .add("state", std::string(controller::contact_phase_name(record.contact)))
      .add("object", named ? stage.scene().objects[object].name : std::string())
      .add("contacts", static_cast<double>(record.contact_count))
      .add("friction", record.friction)
      .add("force", record.contact_force_W_N)
      .add("normal", record.normal_W)
      .add("proxy_clearance_m", record.proxy_clearance_m)
      .add("tool_clearance_m", record.tool_clearance_m)
      .end();
}

std::string joints_message(const Stage& stage, const controller::CycleRecord& record) {
  json names = json::array();
  std::vector<double> commanded, measured;
  for (std::size_t i = 0; i < stage.cell().drives.size() && i < controller::max_axes; ++i) {
    const description::DriveDescription& drive = stage.cell().drives[i];
    names.push_back(drive.joint);
    measured.push_back(drive.angle_rad(record.actual_counts[i]));
    if (drive.mode != "cst") commanded.push_back(drive.angle_rad(record.target_counts[i]));
  }
  std::string text = Text(record.time_ns).add("commanded_rad", commanded).add("measured_rad", measured).end();
  text.pop_back();
  return text + ",\"name\":" + names.dump(-1, ' ', false, json::error_handler_t::replace) + "}";
}

json session_message(const Moment& moment) {
  const controller::CycleRecord& record = moment.record;
  json flags = json::array();
  for (const FlagWords& flag : flag_words()) {
    if ((moment.flags_since & static_cast<std::uint32_t>(flag.flag)) != 0) flags.push_back(flag.name);
  }
  return {{"timestamp", of_time(record.time_ns)},
          {"cycle", record.cycle},
          {"phase", controller::phase_name(record.phase)},
          {"flags", flags},
          {"fault", record.fault == controller::Fault::none ? "" : controller::fault_name(record.fault)},
          {"mass_kg", record.proxy_mass_kg > 0.0 ? record.proxy_mass_kg + moment.handle_mass_kg : 0.0},
          {"damping_Ns_per_m", record.proxy_damping_Ns_per_m},
          {"energy_hand_J", record.energies_J.hand},
          {"energy_proxy_J", record.energies_J.proxy}};
}

json pose_message(std::int64_t time_ns, const Pose& X) {
  return {{"timestamp", of_time(time_ns)}, {"frame_id", "W"}, {"pose", of(X)}};
}

}  // namespace

const TopicDescription& describe(Topic topic) {
  static const std::array<TopicDescription, topic_count> all{{
      {"/tool", "foxglove.PoseInFrame", pose_schema().dump()},
      {"/proxy", "foxglove.PoseInFrame", pose_schema().dump()},
      {"/wrench", "proxarm.Wrench", wrench_schema().dump()},
      {"/contact", "proxarm.Contact", contact_schema().dump()},
      {"/joint_states", "proxarm.JointStates", joints_schema().dump()},
      {"/session", "proxarm.Session", session_schema().dump()},
      {"/tf", "foxglove.FrameTransforms", transforms_schema().dump()},
      {"/scene", "foxglove.SceneUpdate", scene_schema().dump()},
  }};
  return all[static_cast<std::size_t>(topic)];
}

std::string SessionMessages::message(Topic topic, const Moment& moment, std::span<const Pose> links,
                                     std::span<const Pose> objects) const {
  const controller::CycleRecord& record = moment.record;
  const auto text = [](const json& value) { return value.dump(-1, ' ', false, json::error_handler_t::replace); };
  switch (topic) {
    case Topic::tool: {
      // The tool's orientation is its link's: the handle is fixed to it.
      Pose X = stage_.tool_pose(links);
      X.translation() = controller::vec3(record.tool_W_m);
      return text(pose_message(record.time_ns, X));
    }
    case Topic::proxy:
      return text(pose_message(record.time_ns, at(controller::vec3(record.proxy_W_m))));
    case Topic::wrench:
      return wrench_message(record);
    case Topic::contact:
      return contact_message(stage_, record);
    case Topic::joint_states:
      return joints_message(stage_, record);
    case Topic::session:
      return text(session_message(moment));
    case Topic::transforms:
      return text(transforms_message(stage_, record.time_ns, links));
    case Topic::scene:
      return text(scene_message(stage_, record.time_ns, objects));
  }
  return {};
}

}  // namespace proxarm::view
