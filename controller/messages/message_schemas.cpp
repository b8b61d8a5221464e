// The messages of each topic, as JSON Schemas. Schemas whose title begins with foxglove are Foxglove's own.
#include <array>
#include <utility>

#include "controller/messages/session_messages.hpp"

namespace proxarm::view {
namespace {

// Types that several schemas share. The text of a type replaces @name in schemas. A text may contain the types above it
// in this list.
constexpr std::array<std::pair<std::string_view, std::string_view>, 9> shared_types{{
    {"@text", R"({"type": "string"})"},
    {"@number", R"({"type": "number"})"},
    {"@flag", R"({"type": "boolean"})"},
    {"@anything", R"({"type": "array", "items": {"type": "object"}})"},
    {"@time", R"({"type": "object", "title": "time",
      "properties": {"sec": {"type": "integer"}, "nsec": {"type": "integer"}}})"},
    {"@vector", R"({"type": "object", "properties": {"x": @number, "y": @number, "z": @number}})"},
    {"@quaternion", R"({"type": "object", "properties": {"x": @number, "y": @number, "z": @number, "w": @number}})"},
    {"@colour", R"({"type": "object", "properties": {"r": @number, "g": @number, "b": @number, "a": @number}})"},
    {"@pose", R"({"type": "object", "title": "foxglove.Pose",
      "properties": {"position": @vector, "orientation": @quaternion}})"},
}};

constexpr std::string_view pose_schema = R"({
  "title": "foxglove.PoseInFrame",
  "type": "object",
  "properties": {"timestamp": @time, "frame_id": @text, "pose": @pose}
})";

constexpr std::string_view transforms_schema = R"({
  "title": "foxglove.FrameTransforms",
  "type": "object",
  "properties": {
    "transforms": {"type": "array", "items": {
      "title": "foxglove.FrameTransform",
      "type": "object",
      "properties": {
        "timestamp": @time,
        "parent_frame_id": @text,
        "child_frame_id": @text,
        "translation": @vector,
        "rotation": @quaternion
      }
    }}
  }
})";

constexpr std::string_view scene_schema = R"({
  "title": "foxglove.SceneUpdate",
  "type": "object",
  "properties": {
    "deletions": @anything,
    "entities": {"type": "array", "items": {
      "title": "foxglove.SceneEntity",
      "type": "object",
      "properties": {
        "timestamp": @time,
        "frame_id": @text,
        "id": @text,
        "lifetime": @time,
        "frame_locked": @flag,
        "metadata": @anything,
        "arrows": {"type": "array", "items": {
          "title": "foxglove.ArrowPrimitive",
          "type": "object",
          "properties": {
            "pose": @pose,
            "shaft_length": @number,
            "shaft_diameter": @number,
            "head_length": @number,
            "head_diameter": @number,
            "color": @colour
          }
        }},
        "cubes": {"type": "array", "items": {
          "title": "foxglove.CubePrimitive",
          "type": "object",
          "properties": {"pose": @pose, "size": @vector, "color": @colour}
        }},
        "spheres": {"type": "array", "items": {
          "title": "foxglove.SpherePrimitive",
          "type": "object",
          "properties": {"pose": @pose, "size": @vector, "color": @colour}
        }},
        "cylinders": {"type": "array", "items": {
          "title": "foxglove.CylinderPrimitive",
          "type": "object",
          "properties": {
            "pose": @pose,
            "size": @vector,
            "bottom_scale": @number,
            "top_scale": @number,
            "color": @colour
          }
        }},
        "lines": @anything,
        "triangles": {"type": "array", "items": {
          "title": "foxglove.TriangleListPrimitive",
          "type": "object",
          "properties": {
            "pose": @pose,
            "points": {"type": "array", "items": @vector},
            "color": @colour,
            "colors": {"type": "array", "items": @colour},
            "indices": {"type": "array", "items": {"type": "integer"}}
          }
        }},
        "texts": @anything,
        "models": @anything
      }
    }}
  }
})";

constexpr std::string_view wrench_schema = R"({
  "title": "proxarm.Wrench",
  "type": "object",
  "properties": {"timestamp": @time, "frame_id": @text, "force": @vector, "torque": @vector}
})";

constexpr std::string_view contact_schema = R"({
  "title": "proxarm.Contact",
  "type": "object",
  "properties": {
    "timestamp": @time,
    "frame_id": @text,
    "state": @text,
    "object": @text,
    "contacts": @number,
    "friction": @number,
    "force": @vector,
    "normal": @vector,
    "others": {"type": "array", "items": {
      "type": "object",
      "properties": {"object": @text, "friction": @number, "normal": @vector}
    }},
    "proxy_clearance_m": @number,
    "tool_clearance_m": @number
  }
})";

constexpr std::string_view contacts_schema = R"({
  "title": "proxarm.Contacts",
  "type": "object",
  "properties": {
    "timestamp": @time,
    "frame_id": @text,
    "contacts": {"type": "array", "items": {
      "type": "object",
      "properties": {
        "object": @text,
        "part": {"type": "integer"},
        "state": @text,
        "friction": @number,
        "gap_m": @number,
        "point": @vector,
        "normal": @vector,
        "force": @vector,
        "torque": @vector
      }
    }}
  }
})";

constexpr std::string_view joints_schema = R"({
  "title": "proxarm.JointStates",
  "type": "object",
  "properties": {
    "timestamp": @time,
    "name": {"type": "array", "items": @text},
    "commanded_rad": {"type": "array", "items": @number},
    "measured_rad": {"type": "array", "items": @number}
  }
})";

constexpr std::string_view session_schema = R"({
  "title": "proxarm.Session",
  "type": "object",
  "properties": {
    "timestamp": @time,
    "cycle": @number,
    "phase": @text,
    "flags": {"type": "array", "items": @text},
    "fault": @text,
    "mass_kg": @number,
    "damping_Ns_per_m": @number,
    "energy_hand_J": @number,
    "energy_proxy_J": @number
  }
})";

// Returns the schema with all types replaced. Goes from the last type to the first, since a type may contain types
// above it.
std::string whole(std::string_view schema) {
  std::string text(schema);
  for (auto type = shared_types.rbegin(); type != shared_types.rend(); ++type) {
    for (std::size_t at = text.find(type->first); at != std::string::npos; at = text.find(type->first, at)) {
      text.replace(at, type->first.size(), type->second);
    }
  }
  return text;
}

}  // namespace

const TopicDescription& describe(Topic topic) {
  static const std::array<TopicDescription, topic_count> all{{
      {"/tool", "foxglove.PoseInFrame", whole(pose_schema)},
      {"/proxy", "foxglove.PoseInFrame", whole(pose_schema)},
      {"/wrench", "proxarm.Wrench", whole(wrench_schema)},
      {"/contact", "proxarm.Contact", whole(contact_schema)},
      {"/joint_states", "proxarm.JointStates", whole(joints_schema)},
      {"/session", "proxarm.Session", whole(session_schema)},
      {"/tf", "foxglove.FrameTransforms", whole(transforms_schema)},
      {"/scene", "foxglove.SceneUpdate", whole(scene_schema)},
      {"/contacts", "proxarm.Contacts", whole(contacts_schema)},
      {"/contact_arrows", "foxglove.SceneUpdate", whole(scene_schema)},
  }};
  return all[static_cast<std::size_t>(topic)];
}

}  // namespace proxarm::view
