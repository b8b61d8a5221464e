#include "controller/extras/new_cell/start_pose.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <vector>

#include "controller/arm_step/place_margin.hpp"
#include "models/arm/inverse_kinematics.hpp"
#include "models/arm/tool_space.hpp"

namespace proxarm::command_line {
namespace {

using models::JointVector;
using models::Vec3;

constexpr int poses = 20000;
constexpr std::size_t tried = 2000;  // number of best poses from which the hand's path is tried
// Step along the hand's path, as a share of the reach, which counts up to 1 m. One call of the inverse kinematics could
// follow a longer step.
constexpr double step_share = 2e-3;
// Up to this distance from an axis the tool counts as lying on the axis, where turning about the axis doesn't move the
// tool.
constexpr double at_an_axis_m = 1e-3;
// A smaller reach counts as this reach when the step is chosen, because otherwise the path would take thousands of
// steps.
constexpr double smallest_circle_m = 0.05;
constexpr double another_rad = 0.3;  // least difference between two starts; in m for a joint that slides
// Everywhere on the path, the smallest singular value must be at least this share of its value at the start.
constexpr double least_share = 0.4;

// Returns how far the joint that is nearest to an end of its range is from that end: 0 at the end, 1 in the middle of
// the range.
double room(const models::Arm& arm, const JointVector& q) {
  double least = 1.0;
  for (int i = 0; i < arm.axes(); ++i) {
    const double half = 0.5 * (arm.upper_rad()[i] - arm.lower_rad()[i]);
    least = std::min(least, 1.0 - std::abs(q[i] - arm.lower_rad()[i] - half) / half);
  }
  return least;
}

// Returns the largest distance of the tool from a revolute axis, in m. For an arm without prismatic joints that is the
// stretched length; otherwise it is the maximum over the sampled poses. Returns 1 m for an arm that only slides.
double reach_of(const models::Arm& arm) {
  bool slides = false;
  for (int i = 0; i < arm.axes(); ++i) slides = slides || arm.slides(i);
  if (!slides) return std::max(arm.path_curvature().maxCoeff(), 0.1);
  double reach_m = 0.0;
  for (int k = 0; k < poses; ++k) {
    models::ToolKinematics tool;
    arm.kinematics(models::spread_pose(arm, k), tool);
    for (int i = 0; i < arm.axes(); ++i) {
      if (!arm.slides(i)) reach_m = std::max(reach_m, tool.J_W.col(i).head<3>().norm());
    }
  }
  return reach_m > at_an_axis_m ? reach_m : 1.0;
}

// Removes full turns from the angles of joints with a range of more than a turn.
void turn_within_once(const models::Arm& arm, JointVector& q) {
  constexpr double once = 2.0 * std::numbers::pi;
  for (int i = 0; i < arm.axes(); ++i) {
    if (arm.slides(i)) continue;
    const double turned = q[i] - once * std::round(q[i] / once);
    if (turned > arm.lower_rad()[i] && turned < arm.upper_rad()[i]) q[i] = turned;
  }
}

// Turns the first joint, if its axis is upright, so that the tool is straight ahead, where people take hold of an arm.
// If the joint's range is too narrow for that, the pose stays unchanged.
void turn_ahead(const models::Arm& arm, JointVector& q) {
  constexpr double upright = 0.999;
  const auto first = static_cast<Eigen::Index>(arm.drive_along_chain(0));
  models::ToolKinematics at;
  arm.kinematics(q, at);
  const double up = at.J_W.col(first).tail<3>().z();
  if (arm.slides(static_cast<int>(first)) || std::abs(up) < upright) return;
  const Vec3 p = at.X_WT.translation() - at.joint_W[0];
  const double turned = q[first] - std::copysign(std::atan2(p.y(), p.x()), up);
  for (const double full : {0.0, 2.0 * std::numbers::pi, -2.0 * std::numbers::pi}) {
    if (turned + full <= arm.lower_rad()[first] || turned + full >= arm.upper_rad()[first]) continue;
    q[first] = turned + full;
    return;
  }
}

// Returns how well the tool can move, from 0 to 1. It is the smaller of two quotients: σ of the place
// (place_margin.hpp) divided by a quarter of the reach; and, for an arm with a wrist, the sine of the wrist's middle
// angle divided by 0.5.
double dexterity(const models::Arm& arm, const controller::PlaceMargin& places, const JointVector& q, double reach_m) {
  constexpr double well_share = 0.25, well_sine = 0.5;
  models::ToolKinematics at;
  arm.kinematics(q, at);
  const double place = places.smallest(at) / (well_share * reach_m);
  if (arm.axes() < 6) return std::min(place, 1.0);
  const Eigen::Index last = arm.drive_along_chain(static_cast<std::size_t>(arm.axes()) - 1);
  const Eigen::Index third = arm.drive_along_chain(static_cast<std::size_t>(arm.axes()) - 3);
  const Vec3 first_axis = at.J_W.col(third).tail<3>(), last_axis = at.J_W.col(last).tail<3>();
  return std::min({place, first_axis.cross(last_axis).norm() / well_sine, 1.0});
}

double smallest_singular_value(const models::InverseKinematics& inverse, const models::Arm& arm, const JointVector& q) {
  models::InverseKinematicsResult result;
  inverse.solve(q, arm.tool_pose(q), result);
  return result.smallest_singular_value_m_per_rad;
}

// Returns the point relative to which the tool's place is judged. It is the first joint's place, moved to the height of
// the floor, z = 0 in W, because arms stand on the floor, hang above it or are bolted to a pedestal. If the floor is
// out of the arm's reach, the point is the joint's place itself.
Vec3 judged_from(const models::ArmPoints& points_W, double reach_m) {
  Vec3 from = points_W.joint_W[0];
  if (std::abs(from.z()) <= reach_m) from.z() = 0.0;
  return from;
}

// Returns how good a pose is; a larger number is better. Dexterity adds at most 2, and each other term at most 1.
double score(const models::Arm& arm, const controller::PlaceMargin& places, const JointVector& q, double reach_m) {
  const models::Pose X_WT = arm.tool_pose(q);
  models::ArmPoints points_W;
  arm.points(q, points_W);
  const Vec3 from = judged_from(points_W, reach_m);
  const Vec3 p = X_WT.translation() - from, z = X_WT.linear().col(2);
  const double free = std::min(room(arm, q) / 0.4, 1.0);
  const double points = std::max({z.x(), -z.z(), 0.0});
  const double ahead = std::clamp(p.x() / (0.5 * reach_m), -1.0, 1.0) - std::min(std::abs(p.y()) / reach_m, 1.0);
  const double low = 0.2 * reach_m, high = 0.8 * reach_m;
  const double off = std::max({low - p.z(), p.z() - high, 0.0}) / reach_m;
  double below = 0.0;
  for (int i = 1; i < arm.axes(); ++i) {
    below = std::max(below, (from.z() - points_W.joint_W[static_cast<std::size_t>(i)].z()) / reach_m);
  }
  return 2.0 * dexterity(arm, places, q, reach_m) + free + points + ahead - 4.0 * off - 4.0 * below;
}

// Returns how far the arm can follow the hand's path. If the arm can follow the whole path, returns infinity; otherwise
// returns the length that the arm can follow on the path's first straight piece.
double gone_m(const models::Arm& arm, models::InverseKinematics inverse, const JointVector& start,
              const description::HandDescription& hand, double step_m) {
  inverse.set_posture(start);
  const double least = least_share * smallest_singular_value(inverse, arm, start);
  const models::Pose X_start = arm.tool_pose(start);
  JointVector q = start;
  Vec3 at = Vec3::Zero();
  double first_m = 0.0;
  for (const description::Waypoint& waypoint : hand.waypoints) {
    const Vec3 to(waypoint.offset_m.data());
    const bool is_first = first_m == 0.0;
    const int steps = static_cast<int>(std::ceil((to - at).norm() / step_m));
    for (int k = 1; k <= steps; ++k) {
      models::Pose X_WT = X_start;
      X_WT.translation() += at + (to - at) * k / steps;
      models::InverseKinematicsResult result;
      inverse.solve(q, X_WT, result);
      if (result.status != models::InverseKinematicsResult::Status::converged || result.out_of_range ||
          result.smallest_singular_value_m_per_rad < least) {
        return is_first ? (to - at).norm() * k / steps : first_m;
      }
      q = result.q;
    }
    if (is_first) first_m = (to - at).norm();
    at = to;
  }
  return std::numeric_limits<double>::infinity();
}

double first_piece_m(const description::HandDescription& hand) {
  for (const description::Waypoint& waypoint : hand.waypoints) {
    const double length_m = Vec3(waypoint.offset_m.data()).norm();
    if (length_m > 0.0) return length_m;
  }
  return 0.0;
}

// A pose `q`, and the length `most_m` up to which the arm could follow the path's first piece from there. A scaled path
// whose first piece is longer than `most_m` needn't be tried.
struct Tried {
  JointVector q;
  double most_m = std::numeric_limits<double>::infinity();
};

// Returns the best of the poses all over the joints' ranges, the best first. With `ahead`, the first joint is turned by
// turn_ahead().
std::vector<Tried> sorted_poses(const models::Arm& arm, double reach_m, bool ahead) {
  struct Candidate {
    double score;
    JointVector q;
  };
  const controller::PlaceMargin places(arm, models::tool_space(arm));
  std::vector<Candidate> candidates;
  candidates.reserve(poses);
  for (int k = 0; k < poses; ++k) {
    JointVector q = models::spread_pose(arm, k);
    if (ahead) turn_ahead(arm, q);
    turn_within_once(arm, q);
    for (int i = 0; i < arm.axes(); ++i) q[i] = std::round(1e4 * q[i]) / 1e4;  // rounded as in the cell's file
    candidates.push_back({score(arm, places, q, reach_m), q});
  }
  std::sort(candidates.begin(), candidates.end(),
            [](const Candidate& a, const Candidate& b) { return a.score > b.score; });
  std::vector<Tried> sorted;
  for (std::size_t k = 0; k < tried; ++k) sorted.push_back({.q = candidates[k].q});
  return sorted;
}

}  // namespace

std::vector<StartPose> find_starts(const models::Arm& arm, const description::HandDescription& hand, std::size_t most) {
  const models::InverseKinematics inverse(arm);
  const double reach_m = reach_of(arm), step_m = step_share * std::clamp(reach_m, smallest_circle_m, 1.0);
  std::vector<StartPose> found;
  const auto is_another = [&](const JointVector& q) {
    return std::all_of(found.begin(), found.end(),
                       [&](const StartPose& start) { return (start.q - q).cwiseAbs().maxCoeff() > another_rad; });
  };
  // Two lists of poses: with the first joint turned ahead, and with any angle of the first joint. Each list is computed
  // when it is first needed. If the first joint slides, there is only one list.
  std::vector<std::vector<Tried>> sorted(arm.slides(arm.drive_along_chain(0)) ? 1 : 2);
  for (const double share : {1.0, 0.5, 0.25, 0.1}) {
    const description::HandDescription shorter = with_shorter_way(hand, share);
    const double piece_m = first_piece_m(shorter);
    for (std::vector<Tried>& starts : sorted) {
      if (starts.empty()) starts = sorted_poses(arm, reach_m, &starts == &sorted[0]);
      for (auto& [q, most_m] : starts) {
        if (found.size() == most) break;
        if (piece_m > most_m || !is_another(q)) continue;
        most_m = gone_m(arm, inverse, q, shorter, step_m);
        if (std::isinf(most_m)) found.push_back({q, share});
      }
      if (!found.empty()) return found;
    }
  }
  return {{sorted[0].front().q, 0.0}};
}

description::HandDescription with_shorter_way(description::HandDescription hand, double share) {
  for (description::Waypoint& waypoint : hand.waypoints) {
    for (double& x : waypoint.offset_m) x *= share;
  }
  return hand;
}

description::HandDescription with_way_in(const models::ToolSpace& space, description::HandDescription hand) {
  for (description::Waypoint& waypoint : hand.waypoints) {
    Vec3 to(waypoint.offset_m.data());
    for (int i = space.dimensions; i < 3; ++i) to[i] = 0.0;
    if (space.dimensions < 3) to = space.axes * to;
    for (std::size_t i = 0; i < 3; ++i) waypoint.offset_m[i] = to[static_cast<Eigen::Index>(i)];
  }
  return hand;
}

Vec3 outwards_in_sensor(const models::Arm& arm) {
  models::ToolKinematics tool;
  const JointVector q = arm.start_rad();
  arm.kinematics(q, tool);
  int last = arm.axes() - 1;
  while (last > 0 && arm.slides(last)) --last;
  if (arm.slides(last)) last = arm.axes() - 1;
  const Vec3 axis_W = (arm.slides(last) ? tool.J_W.col(last).head<3>() : tool.J_W.col(last).tail<3>()).normalized();
  models::ArmPoints points;
  arm.points(q, points);
  // `along` is the sensor's distance along the axis from the nearest joint with a distance that isn't 0.
  double along = 0.0;
  for (int i = arm.axes() - 1; i >= 0 && std::abs(along) < 1e-3; --i) {
    along = axis_W.dot(tool.X_WS.translation() - points.joint_W[static_cast<std::size_t>(i)]);
  }
  return tool.X_WS.linear().transpose() * (along < 0.0 ? Vec3(-axis_W) : axis_W);
}

}  // namespace proxarm::command_line
