#include "controller/messages/session_messages.hpp"

#include <algorithm>

#include "controller/drawing/palette.hpp"
#include "controller/signals/contact_columns.hpp"
#include "controller/stage/json_text.hpp"
#include "controller/stage/words.hpp"
#include "controller/supervision/fault.hpp"

namespace proxarm::view {
namespace {

using models::Pose;
using models::Vec3;

// ---- parts of messages

void put(JsonText& json, const Vec3& v) { json.begin_object().add("x", v.x()).add("y", v.y()).add("z", v.z()).end(); }
void put(JsonText& json, const Eigen::Quaterniond& q) {
  json.begin_object().add("x", q.x()).add("y", q.y()).add("z", q.z()).add("w", q.w()).end();
}
void put(JsonText& json, const Pose& X) {
  json.begin_object();
  put(json.name("position"), Vec3(X.translation()));
  put(json.name("orientation"), Eigen::Quaterniond(X.linear()));
  json.end();
}

struct Colour {
  double r, g, b, a;
};
void put(JsonText& json, const Colour& c) {
  json.begin_object().add("r", c.r).add("g", c.g).add("b", c.b).add("a", c.a).end();
}

void put_time(JsonText& json, std::int64_t time_ns) {
  json.begin_object().add("sec", time_ns / 1'000'000'000).add("nsec", time_ns % 1'000'000'000).end();
}

JsonText begin_message(std::int64_t time_ns) {
  JsonText json;
  put_time(json.begin_object().name("timestamp"), time_ns);
  return json;
}

// ---- the scene

Pose at(const Vec3& p) {
  Pose X = Pose::Identity();
  X.translation() = p;
  return X;
}

// Returns the smallest rotation from z to `direction`, by the half-way vector. For the direction −z, the rotation is
// about x.
Eigen::Quaterniond turn_from_z(const Vec3& direction) {
  const Vec3 d = direction.normalized();
  if (d.z() < -1.0 + 1e-12) return {0.0, 1.0, 0.0, 0.0};  // nearer to −z, rounding would dominate the sum
  return Eigen::Quaterniond(1.0 + d.z(), -d.y(), d.x(), 0.0).normalized();
}

// Returns the pose half-way between two points, with its z axis from the first point to the second.
Pose between(const Vec3& from, const Vec3& to) {
  Pose X = at(0.5 * (from + to));
  X.linear() = turn_from_z(to - from).toRotationMatrix();
  return X;
}

// Large meshes would make the message larger than tools accept, so only every n-th of their triangles is sent.
constexpr std::size_t most_triangles = 20'000;

// A foxglove.SceneEntity: one list for each kind of shape.
class Entity {
 public:
  explicit Entity(const Colour& colour) : colour_(colour) {
    for (JsonText* list : {&arrows_, &cubes_, &spheres_, &cylinders_, &triangles_}) list->begin_list();
  }
  void set_colour(const Colour& colour) { colour_ = colour; }

  // `X` is the pose of the arrow's tail; the arrow points along x.
  void add_arrow(const Pose& X, double length_m, double thickness_m) {
    const double head_m = std::min(3.0 * thickness_m, length_m);
    begin_shape(arrows_, X);
    arrows_.add("shaft_length", length_m - head_m).add("shaft_diameter", thickness_m);
    arrows_.add("head_length", head_m).add("head_diameter", 2.0 * thickness_m).end();
  }
  void add_cube(const Pose& X, const Vec3& size_m) {
    begin_shape(cubes_, X);
    put(cubes_.name("size"), size_m);
    cubes_.end();
  }
  void add_sphere(const Vec3& centre, double radius_m) {
    begin_shape(spheres_, at(centre));
    put(spheres_.name("size"), Vec3(Vec3::Constant(2.0 * radius_m)));
    spheres_.end();
  }
  void add_cylinder(const Pose& X, double radius_m, double length_m) {
    begin_shape(cylinders_, X);
    put(cylinders_.name("size"), Vec3(2.0 * radius_m, 2.0 * radius_m, length_m));
    cylinders_.add("bottom_scale", 1.0).add("top_scale", 1.0).end();
  }
  void add_mesh(const models::TriangleMesh& mesh, const Pose& X) {
    begin_shape(triangles_, X);
    triangles_.name("points").begin_list();
    const std::size_t step = mesh.size() / most_triangles + 1;
    for (std::size_t face = 0; face < mesh.size(); face += step) {
      for (std::size_t k = 0; k < 3; ++k) put(triangles_, mesh.corner(static_cast<std::uint32_t>(face), k));
    }
    triangles_.end();
    for (const char* none : {"colors", "indices"}) triangles_.name(none).begin_list().end();
    triangles_.end();
  }

  // Writes the shapes that were added, and clears them.
  void put_into(JsonText& json, const std::string& id, const std::string& frame, std::int64_t time_ns) {
    put_time(json.begin_object().name("timestamp"), time_ns);
    json.add("frame_id", frame).add("id", id);
    put_time(json.name("lifetime"), 0);
    json.add("frame_locked", true);
    for (const char* none : {"metadata", "lines", "texts", "models"}) json.name(none).begin_list().end();
    json.name("arrows").splice(arrows_.end());
    json.name("cubes").splice(cubes_.end()).name("spheres").splice(spheres_.end());
    json.name("cylinders").splice(cylinders_.end()).name("triangles").splice(triangles_.end()).end();
  }

 private:
  void begin_shape(JsonText& list, const Pose& X) {
    put(list.begin_object().name("pose"), X);
    put(list.name("color"), colour_);
  }
  Colour colour_;
  JsonText arrows_, cubes_, spheres_, cylinders_, triangles_;
};

void add_shape(Entity& entity, const models::LinkShape& shape) {
  const auto rgb = shape.colour.value_or(std::array{0.75, 0.78, 0.82});
  entity.set_colour({rgb[0], rgb[1], rgb[2], 1.0});
  if (const auto* box = std::get_if<models::DrawnBox>(&shape.shape)) {
    entity.add_cube(shape.X_link, box->size_m);
  } else if (const auto* round = std::get_if<models::DrawnCylinder>(&shape.shape)) {
    entity.add_cylinder(shape.X_link, round->radius_m, round->length_m);
  } else if (const auto* ball = std::get_if<models::DrawnSphere>(&shape.shape)) {
    entity.add_sphere(shape.X_link.translation(), ball->radius_m);
  }
}

// `X`: the object's displacement from its pose in the scene's file.
void add_object(Entity& entity, const scenes::Object& object, const Pose& X) {
  if (const auto* plane = std::get_if<scenes::PlaneShape>(&object.shape)) {
    Pose sheet = X * at(plane->point_m);
    sheet.linear() = X.linear() * turn_from_z(plane->normal).toRotationMatrix();
    entity.add_cube(sheet, Vec3(1.0, 1.0, 1e-3));
  } else if (const auto* box = std::get_if<scenes::BoxShape>(&object.shape)) {
    entity.add_cube(X * box->pose_W, box->size_m);
  } else if (const auto* ball = std::get_if<scenes::SphereShape>(&object.shape)) {
    entity.add_sphere(X * ball->centre_m, ball->radius_m);
  } else if (const auto* capsule = std::get_if<scenes::CapsuleShape>(&object.shape)) {
    entity.add_cylinder(X * between(capsule->from_m, capsule->to_m), capsule->radius_m,
                        (capsule->to_m - capsule->from_m).norm());
    for (const Vec3& end : {capsule->from_m, capsule->to_m}) entity.add_sphere(X * end, capsule->radius_m);
  } else if (const auto* round = std::get_if<scenes::CylinderShape>(&object.shape)) {
    entity.add_cylinder(X * between(round->from_m, round->to_m), round->radius_m, (round->to_m - round->from_m).norm());
  } else if (const auto* mesh = std::get_if<scenes::MeshShape>(&object.shape); mesh != nullptr && mesh->mesh) {
    entity.add_mesh(*mesh->mesh, X);
  }
}

std::string scene_message(const Stage& stage, std::int64_t time_ns, std::span<const Pose> objects) {
  constexpr Colour of_objects{0.25, 0.65, 0.5, 0.5};
  JsonText json;
  json.begin_object().name("deletions").begin_list().end().name("entities").begin_list();
  for (const models::DrawnLink& link : stage.links().links()) {
    Entity entity({});
    for (const models::LinkShape& shape : link.shapes) add_shape(entity, shape);
    entity.put_into(json, "link " + link.name, link.name, time_ns);
  }
  for (std::size_t i = 0; i < stage.scene().objects.size(); ++i) {
    Entity entity(of_objects);
    add_object(entity, stage.scene().objects[i], objects[i]);
    entity.put_into(json, "object " + stage.scene().objects[i].name, "W", time_ns);
  }
  return json.end().end().take();
}

// ---- other messages

std::string transforms_message(const Stage& stage, std::int64_t time_ns, std::span<const Pose> links) {
  JsonText json;
  json.begin_object().name("transforms").begin_list();
  for (std::size_t i = 0; i < links.size(); ++i) {
    put_time(json.begin_object().name("timestamp"), time_ns);
    json.add("parent_frame_id", "W").add("child_frame_id", stage.links().links()[i].name);
    put(json.name("translation"), Vec3(links[i].translation()));
    put(json.name("rotation"), Eigen::Quaterniond(links[i].linear()));
    json.end();
  }
  return json.end().end().take();
}

std::string wrench_message(const controller::CycleRecord& record) {
  JsonText json = begin_message(record.time_ns);
  put(json.add("frame_id", "W").name("force"), controller::vec3(record.force_W_N));
  put(json.name("torque"), controller::vec3(record.torque_W_Nm));
  return json.end().take();
}

// Returns the object's name, by the object's index in the scene; empty if there is no such object.
std::string object_name(const Stage& stage, std::int32_t object) {
  const auto index = static_cast<std::size_t>(object);
  return object >= 0 && index < stage.scene().objects.size() ? stage.scene().objects[index].name : std::string();
}

std::string contact_message(const Stage& stage, const controller::CycleRecord& record) {
  JsonText json = begin_message(record.time_ns);
  json.add("frame_id", "W").add("state", controller::contact_phase_name(record.contact));
  json.add("object", object_name(stage, record.contacts[0].object));
  json.add("contacts", record.contact_count).add("friction", record.contacts[0].friction);
  put(json.name("force"), controller::vec3(record.contact_force_W_N));
  put(json.name("normal"), controller::vec3(record.contacts[0].normal_W));
  json.name("others").begin_list();
  for (std::size_t i = 1; i < std::min(controller::contacts_in_signals, record.recorded_contacts()); ++i) {
    const controller::RecordedContact& other = record.contacts[i];
    if (other.object < 0) continue;
    json.begin_object().add("object", object_name(stage, other.object)).add("friction", other.friction);
    put(json.name("normal"), controller::vec3(other.normal_W));
    json.end();
  }
  json.end();
  json.add("proxy_clearance_m", record.proxy_clearance_m).add("tool_clearance_m", record.tool_clearance_m);
  return json.end().take();
}

std::string contacts_message(const Stage& stage, const controller::CycleRecord& record) {
  JsonText json = begin_message(record.time_ns);
  json.add("frame_id", "W").name("contacts").begin_list();
  for (std::size_t i = 0; i < record.recorded_contacts(); ++i) {
    const controller::RecordedContact& contact = record.contacts[i];
    json.begin_object().add("object", object_name(stage, contact.object)).add("part", contact.part);
    json.add("state", contact.slips ? "slip" : "stick").add("friction", contact.friction).add("gap_m", contact.gap_m);
    put(json.name("point"), controller::vec3(contact.point_W_m));
    put(json.name("normal"), controller::vec3(contact.normal_W));
    put(json.name("force"), controller::vec3(contact.force_W_N));
    put(json.name("torque"), controller::vec3(controller::contact_torque_W_Nm(record, contact)));
    json.end();
  }
  return json.end().end().take();
}

std::string contact_arrows_message(const controller::CycleRecord& record) {
  constexpr double metres_per_N = 0.005, thickness_m = 0.004;
  const auto painted = [](const char* name) {
    const controller::Rgb rgb = controller::on_white(controller::colour(name).light);
    return Colour{rgb.r, rgb.g, rgb.b, 1.0};
  };
  const Colour sticks = painted("stick"), slips = painted("slip");
  Entity entity(sticks);
  for (std::size_t i = 0; i < record.recorded_contacts(); ++i) {
    const controller::RecordedContact& contact = record.contacts[i];
    const Vec3 force = controller::vec3(contact.force_W_N);
    if (!(force.norm() > 0.0)) continue;
    Pose X = at(controller::vec3(contact.point_W_m));
    X.linear() = Eigen::Quaterniond::FromTwoVectors(Vec3::UnitX(), force).toRotationMatrix();
    entity.set_colour(contact.slips ? slips : sticks);
    entity.add_arrow(X, metres_per_N * force.norm(), thickness_m);
  }
  JsonText json;
  json.begin_object().name("deletions").begin_list().end().name("entities").begin_list();
  entity.put_into(json, "contacts", "W", record.time_ns);
  return json.end().end().take();
}

std::string joints_message(const Stage& stage, const controller::CycleRecord& record) {
  JsonText json = begin_message(record.time_ns), commanded, measured;
  json.name("name").begin_list();
  commanded.begin_list();
  measured.begin_list();
  for (std::size_t i = 0; i < stage.cell().drives.size() && i < controller::max_axes; ++i) {
    const description::DriveDescription& drive = stage.cell().drives[i];
    json.value(drive.joint);
    measured.value(drive.angle_rad(record.actual_counts[i]));
    if (drive.mode != "cst") commanded.value(drive.angle_rad(record.target_counts[i]));
  }
  json.end().name("commanded_rad").splice(commanded.end()).name("measured_rad").splice(measured.end());
  return json.end().take();
}

std::string session_message(const Moment& moment) {
  const controller::CycleRecord& record = moment.record;
  JsonText json = begin_message(record.time_ns);
  json.add("cycle", record.cycle).add("phase", controller::phase_name(record.phase)).name("flags").begin_list();
  for (const FlagWords& flag : flag_words()) {
    if ((moment.flags_since & static_cast<std::uint32_t>(flag.flag)) != 0) json.value(controller::flag_name(flag.flag));
  }
  json.end().add("fault", record.fault == controller::Fault::none ? "" : controller::fault_name(record.fault));
  json.add("mass_kg", record.proxy_mass_kg > 0.0 ? record.proxy_mass_kg + moment.handle_mass_kg : 0.0);
  json.add("damping_Ns_per_m", record.proxy_damping_Ns_per_m);
  json.add("energy_hand_J", record.energies_J.hand).add("energy_proxy_J", record.energies_J.proxy);
  return json.end().take();
}

Pose proxy_pose(const controller::CycleRecord& record) {
  const auto& [x, y, z, w] = record.proxy_q_W;
  Pose X = at(controller::vec3(record.proxy_W_m));
  X.linear() = Eigen::Quaterniond(w, x, y, z).toRotationMatrix();
  return X;
}

std::string pose_message(std::int64_t time_ns, const Pose& X) {
  JsonText json = begin_message(time_ns);
  put(json.add("frame_id", "W").name("pose"), X);
  return json.end().take();
}

}  // namespace

std::string SessionMessages::message(Topic topic, const Moment& moment, std::span<const Pose> links,
                                     std::span<const Pose> objects) const {
  const controller::CycleRecord& record = moment.record;
  switch (topic) {
    case Topic::tool: {
      // The handle is fixed to its link, so the tool has the link's orientation.
      Pose X = stage_.tool_pose(links);
      X.translation() = controller::vec3(record.tool_W_m);
      return pose_message(record.time_ns, X);
    }
    case Topic::proxy:
      return pose_message(record.time_ns, proxy_pose(record));
    case Topic::wrench:
      return wrench_message(record);
    case Topic::contact:
      return contact_message(stage_, record);
    case Topic::joint_states:
      return joints_message(stage_, record);
    case Topic::session:
      return session_message(moment);
    case Topic::transforms:
      return transforms_message(stage_, record.time_ns, links);
    case Topic::contacts:
      return contacts_message(stage_, record);
    case Topic::contact_arrows:
      return contact_arrows_message(record);
    case Topic::scene:
      return scene_message(stage_, record.time_ns, objects);
  }
  return {};
}

}  // namespace proxarm::view
