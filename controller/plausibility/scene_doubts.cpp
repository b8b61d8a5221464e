#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>

#include "controller/plausibility/doubts.hpp"
#include "controller/plausibility/expected.hpp"
#include "models/base/text.hpp"

namespace proxarm::controller {

namespace {

using models::Vec3;
using Lines = std::vector<std::string>;

// Number of the arm's reaches. An object that is further from the tool's start than this is never touched.
constexpr double far_reaches = 4.0;
// A hand may pull at an arm at the end of its reach from this far beyond, m.
constexpr double pulls_from_m = 0.3;
const Expected friction{0.0, 3.0, "", {{"percent", 1e-2}}};

// A ball around a box, sphere, capsule or cylinder.
struct Ball {
  Vec3 centre_W;
  double radius_m;
};
std::optional<Ball> ball_around(const scenes::Shape& shape) {
  if (const auto* box = std::get_if<scenes::BoxShape>(&shape)) {
    return Ball{box->pose_W.translation(), 0.5 * box->size_m.norm()};
  }
  if (const auto* sphere = std::get_if<scenes::SphereShape>(&shape)) return Ball{sphere->centre_m, sphere->radius_m};
  const auto along = [](const auto& rod) {
    return Ball{0.5 * (rod.from_m + rod.to_m), 0.5 * (rod.to_m - rod.from_m).norm() + rod.radius_m};
  };
  if (const auto* capsule = std::get_if<scenes::CapsuleShape>(&shape)) return along(*capsule);
  if (const auto* cylinder = std::get_if<scenes::CylinderShape>(&shape)) return along(*cylinder);
  return std::nullopt;
}

// Returns a lower bound of the distance to a shape's surface; absent for a mesh, since meshes have their own report.
std::optional<double> distance_m(const scenes::Shape& shape, const Vec3& from_W) {
  if (const auto* plane = std::get_if<scenes::PlaneShape>(&shape)) {
    return std::abs(plane->normal.normalized().dot(from_W - plane->point_m));
  }
  const std::optional<Ball> ball = ball_around(shape);
  if (!ball) return std::nullopt;
  const double outside_m = (ball->centre_W - from_W).norm() - ball->radius_m;
  // Within a sphere its surface is that far away, too.
  return std::holds_alternative<scenes::SphereShape>(shape) ? std::abs(outside_m) : std::max(0.0, outside_m);
}

// Returns the radius of a round shape, m; 0 for other shapes.
double radius_of(const scenes::Shape& shape) {
  if (const auto* sphere = std::get_if<scenes::SphereShape>(&shape)) return sphere->radius_m;
  if (const auto* capsule = std::get_if<scenes::CapsuleShape>(&shape)) return capsule->radius_m;
  if (const auto* cylinder = std::get_if<scenes::CylinderShape>(&shape)) return cylinder->radius_m;
  return 0.0;
}

std::string beyond_text(double beyond_m, const ToolReach::FirstAxis& axis) {
  return description::rounded_text(beyond_m) + " m beyond the tool's reach, expected at most " +
         description::rounded_text(axis.radius_m) + " m from the arm's first axis";
}

class SceneDoubts {
 public:
  SceneDoubts(const scenes::Scene& scene, const std::optional<ToolReach>& reach) : scene_(scene), reach_(reach) {}

  Lines operator()() {
    for (const scenes::Object& object : scene_.objects) judge_object(object);
    for (const scenes::MediumDescription& medium : scene_.media) {
      begin(medium.line, "medium");
      value("damping_Ns_per_m", medium.damping_Ns_per_m, {0.0, 1e5, "Ns/m", {}});
      value("force_N", medium.force_N, {0.0, 1000.0, "N", {}});
    }
    if (scene_.coulomb_force_N) {
      begin(scene_.coulomb_line, "scene");
      value("coulomb_force_N", *scene_.coulomb_force_N, {0.0, 1000.0, "N", {}});
    }
    return std::move(lines_);
  }

 private:
  void begin(int line, const std::string& name) {
    where_ = scene_.file.string() + (line > 0 ? ":" + std::to_string(line) : "") + ": " + name + ": ";
  }

  void value(const char* key, double found, const Expected& expected) { judge(where_ + key, found, expected, lines_); }

  void judge_object(const scenes::Object& object) {
    begin(object.line, object.name);
    value("friction", object.friction, friction);
    for (const scenes::FrictionRegion& region : object.friction_regions) value("friction", region.friction, friction);
    if (radius_of(object.shape) > 0.0) value("radius_m", radius_of(object.shape), {1e-4, 1e4, "m", {}});
    judge_place(object);
    if (object.layer) {
      value("layer.stiffness_N_per_m", object.layer->stiffness_N_per_m,
            {20.0, 1e8, "N/m", {{"N/mm", 1e3}, {"kN/m", 1e3}, {"N/µm", 1e6}}});
      value("layer.thickness_m", object.layer->thickness_m, {1e-6, 1.0, "m", {units::mm}});
    }
    if (!object.motion) return;
    value("motion.velocity_m_per_s", object.motion->velocity_m_per_s.norm(), {0.0, 5.0, "m/s", {units::mm_per_s}});
    value("motion.amplitude_m", object.motion->amplitude_m.norm(), {0.0, 5.0, "m", {units::mm}});
    judge_swing(*object.motion);
    value("motion.turn_rad_per_s", std::abs(object.motion->turn_rad_per_s),
          {0.0, 20.0, "rad/s", {units::degrees_per_s}});
  }

  void judge_place(const scenes::Object& object) {
    if (!reach_) return;
    const std::optional<double> far = distance_m(object.shape, reach_->start_W);
    if (far && *far > far_reaches * reach_->most_m) {
      lines_.push_back(where_ + "it is " + description::rounded_text(*far) +
                       " m from where the tool starts, far beyond the arm's reach: are its places in metres?");
      return;
    }
    const std::optional<Ball> ball = ball_around(object.shape);
    if (!ball || !reach_->first_axis || object.motion || scene_.tool) return;
    const double beyond_m = reach_->first_axis->beyond_m(ball->centre_W) - ball->radius_m;
    if (beyond_m > 0.0) {
      lines_.push_back(where_ + "it is " + beyond_text(beyond_m, *reach_->first_axis) + ": nothing can touch it");
    }
  }

  // How fast a swing moves the object at most.
  void judge_swing(const scenes::Motion& motion) {
    const double speed_m_per_s = 2.0 * std::numbers::pi * motion.frequency_Hz * motion.amplitude_m.norm();
    judge(where_ + "motion.frequency_Hz", motion.frequency_Hz,
          {"Hz", speed_m_per_s, 1.0, "by which it moves at " + description::rounded_text(speed_m_per_s) + " m/s"},
          {0.0, 5.0, "m/s", {{"swings/min", 1.0 / 60.0}}}, lines_);
  }

  const scenes::Scene& scene_;
  const std::optional<ToolReach>& reach_;
  std::string where_;
  Lines lines_;
};

}  // namespace

double ToolReach::FirstAxis::beyond_m(const Vec3& point_W) const noexcept {
  return direction_W.cross(point_W - through_W).norm() - radius_m;
}

ToolReach tool_reach(const models::Arm& arm) {
  models::ToolKinematics at;
  arm.kinematics(arm.start_rad(), at);
  const models::JointMatrix bounds = arm.path_curvature();
  const Vec3 tool_W = at.X_WT.translation(), origin_W = at.joint_W[0];
  ToolReach reach{tool_W, std::max(bounds.maxCoeff(), 0.1), std::nullopt};
  const Vec3 axis_W = at.J_W.col(0).tail<3>(), speed_W = at.J_W.col(0).head<3>();
  // The drives' order may differ from the joints'; only if the first drive's joint is the first one, its axis stands
  // still and goes through the first joint's origin.
  constexpr double rounding_m = 1e-9;
  const bool is_first = (axis_W.cross(tool_W - origin_W) - speed_W).norm() < rounding_m;
  if (!arm.slides(0) && is_first) reach.first_axis = ToolReach::FirstAxis{origin_W, axis_W, bounds(0, 0)};
  return reach;
}

std::vector<std::string> scene_doubts(const scenes::Scene& scene, const std::optional<ToolReach>& reach) {
  return SceneDoubts(scene, reach)();
}

std::vector<std::string> hand_doubts(const description::HandDescription& hand, const std::optional<ToolReach>& reach) {
  Lines lines;
  judge("mass_kg", hand.mass_kg, {0.0, 30.0, "kg", {units::g}}, lines);
  if (hand.stiffness_N_per_m > 0.0) {
    judge("stiffness_N_per_m", hand.stiffness_N_per_m, {5.0, 1e6, "N/m", {{"N/mm", 1e3}, {"N/cm", 1e2}}}, lines);
  }
  judge("damping_Ns_per_m", hand.damping_Ns_per_m, {0.0, 5000.0, "Ns/m", {}}, lines);
  judge("max_force_N", hand.max_force_N, {0.5, 3000.0, "N", {units::kN}}, lines);
  for (const description::Waypoint& waypoint : hand.waypoints) {
    for (const double x : waypoint.offset_m) judge("waypoints.offset_m", x, {-20.0, 20.0, "m", {units::mm}}, lines);
    for (const double x : waypoint.turn_rad) {
      judge("waypoints.turn_rad", x, {-10.0, 10.0, "rad", {units::degrees}}, lines);
    }
    if (!reach || !reach->first_axis) continue;
    const double beyond_m = reach->first_axis->beyond_m(reach->start_W + Vec3(waypoint.offset_m.data()));
    if (beyond_m > pulls_from_m) {
      lines.push_back("waypoints.offset_m: the one at " + description::rounded_text(waypoint.time_s) + " s is " +
                      beyond_text(beyond_m, *reach->first_axis));
    }
  }
  for (const description::Sine& sine : hand.multisine) {
    judge("multisine.amplitude_m", sine.amplitude_m, {-1.0, 1.0, "m", {units::mm}}, lines);
  }
  for (std::string& line : lines) line = hand.file.string() + ": " + line;
  return lines;
}

}  // namespace proxarm::controller
