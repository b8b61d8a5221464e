#include "controller/extras/identification/tool_stations.hpp"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

#include "controller/extras/identification/free_path.hpp"
#include "models/base/setup_error.hpp"

namespace proxarm::identification {
namespace {

using models::JointVector;
using models::Mat3;
using models::Vec3;
using proof::Station;

constexpr std::size_t wrist_joints = 3;
// Number of poses in addition to the first. With seven, there are 27 force readings for 13 unknowns, and all 5,040
// rounds can be tried. Fewer than five aren't enough.
constexpr std::size_t chosen = 7, least_chosen = 5;
// Shares of most_turn_rad that are tried for a joint.
constexpr double shares[] = {1.0, 0.5, 0.25, 0.125};
// Poses in which the weight's directions differ by less than this count as the same.
constexpr double same = 1e-6;

std::vector<Eigen::Index> wrist_of(const models::Arm& arm) {
  std::vector<Eigen::Index> joints;
  for (auto k = static_cast<std::size_t>(arm.axes()); k > 0 && joints.size() < wrist_joints; --k) {
    const int drive = arm.drive_along_chain(k - 1);
    if (!arm.slides(drive)) joints.push_back(drive);
  }
  return joints;
}

Vec3 down_in_sensor(const description::Cell& cell, const models::Arm& arm, const JointVector& motor_rad) {
  const Vec3 down_W = Vec3(cell.gravity_W_m_per_s2.data()).normalized();
  return arm.sensor_pose(arm.link_from_motor(motor_rad)).linear().transpose() * down_W;
}

// Returns how far a joint alone can turn to one side, rad. The following error is kept as a margin to the ends of the
// joint's range, since a drive may deviate by this without a fault.
double turn_of(const description::Cell& cell, const models::Arm& arm, const JointVector& start, Eigen::Index joint,
               double side) {
  const auto& range = cell.drives[static_cast<std::size_t>(joint)].range_rad;
  const double kept_rad = cell.limits.following_error_rad;
  const double low = std::min(start[joint], range[0] + kept_rad), high = std::max(start[joint], range[1] - kept_rad);
  for (const double share : shares) {
    JointVector there = start;
    there[joint] = std::clamp(start[joint] + side * share * most_turn_rad, low, high);
    if (free_path(cell, arm, start, there)) return there[joint] - start[joint];
  }
  return 0.0;
}

// Returns all poses of the grid that the arm can reach from its first pose. Each joint turns to either side by its full
// turn, by half of it, or not at all.
std::vector<JointVector> candidates(const description::Cell& cell, const models::Arm& arm, const JointVector& start) {
  std::vector<JointVector> poses{start};
  for (const Eigen::Index joint : wrist_of(arm)) {
    const double back = turn_of(cell, arm, start, joint, -1.0), forth = turn_of(cell, arm, start, joint, 1.0);
    std::vector<JointVector> more;
    for (const JointVector& pose : poses) {
      for (const double turn : {back, 0.5 * back, 0.0, 0.5 * forth, forth}) {
        more.push_back(pose);
        more.back()[joint] += turn;
      }
    }
    poses = std::move(more);
  }
  std::erase_if(poses, [&](const JointVector& pose) { return !free_path(cell, arm, start, pose); });
  return poses;
}

Mat3 scatter_of(const std::vector<Vec3>& directions) {
  Vec3 sum = Vec3::Zero();
  Mat3 squares = Mat3::Zero();
  for (const Vec3& u : directions) {
    sum += u;
    squares += u * u.transpose();
  }
  return squares - sum * sum.transpose() / static_cast<double>(directions.size());
}

// Returns the start and the chosen poses, each of which maximises the determinant with the poses before it.
std::vector<JointVector> best_of(const description::Cell& cell, const models::Arm& arm, const JointVector& start) {
  const std::vector<JointVector> poses = candidates(cell, arm, start);
  std::vector<Vec3> shown;
  for (const JointVector& pose : poses) shown.push_back(down_in_sensor(cell, arm, pose));
  std::vector<JointVector> taken{start};
  std::vector<Vec3> directions{down_in_sensor(cell, arm, start)};
  // Added to the scatter's diagonal. If the directions span fewer than three dimensions, determinants are then compared
  // over the spanned dimensions alone.
  constexpr double little = 1e-4;
  for (std::size_t n = 0; n < chosen; ++n) {
    double most = 0.0;
    std::size_t best = poses.size();
    for (std::size_t i = 0; i < poses.size(); ++i) {
      if (std::any_of(taken.begin(), taken.end(), [&](const JointVector& t) { return t == poses[i]; })) continue;
      directions.push_back(shown[i]);
      const double size = (scatter_of(directions) + little * Mat3::Identity()).determinant();
      directions.pop_back();
      if (size <= most) continue;
      most = size;
      best = i;
    }
    if (best == poses.size()) break;
    taken.push_back(poses[best]);
    directions.push_back(shown[best]);
  }
  return taken;
}

// Returns the largest joint motion between each two poses; infinite if the path between them isn't free.
Eigen::MatrixXd ways(const description::Cell& cell, const models::Arm& arm, const std::vector<JointVector>& poses) {
  const auto count = static_cast<Eigen::Index>(poses.size());
  Eigen::MatrixXd way = Eigen::MatrixXd::Zero(count, count);
  for (Eigen::Index i = 0; i < count; ++i) {
    for (Eigen::Index j = 0; j < i; ++j) {
      const JointVector &from = poses[static_cast<std::size_t>(i)], &to = poses[static_cast<std::size_t>(j)];
      const bool is_free = free_path(cell, arm, from, to);
      way(i, j) = way(j, i) = is_free ? (to - from).cwiseAbs().maxCoeff() : std::numeric_limits<double>::infinity();
    }
  }
  return way;
}

// Returns the shortest free round through all poses, from the first pose and back to it. If there is no free round, the
// arm returns to the first pose each time; these paths are free by candidates().
std::vector<std::size_t> round_of(const Eigen::MatrixXd& way) {
  std::vector<std::size_t> order(static_cast<std::size_t>(way.rows() - 1)), best;
  std::iota(order.begin(), order.end(), std::size_t{1});
  double shortest = std::numeric_limits<double>::infinity();
  do {
    double length = 0.0;
    std::size_t at = 0;
    for (const std::size_t next : order) {
      length += way(static_cast<Eigen::Index>(at), static_cast<Eigen::Index>(next));
      at = next;
    }
    length += way(static_cast<Eigen::Index>(at), 0);
    if (length >= shortest) continue;
    shortest = length;
    best = order;
  } while (std::next_permutation(order.begin(), order.end()));
  if (!best.empty()) return best;
  for (std::size_t next = 1; next < static_cast<std::size_t>(way.rows()); ++next) {
    if (next > 1) best.push_back(0);
    best.push_back(next);
  }
  return best;
}

bool turns_weight(const description::Cell& cell, const models::Arm& arm, const std::vector<JointVector>& poses) {
  const Vec3 first = down_in_sensor(cell, arm, poses.front());
  return std::any_of(poses.begin(), poses.end(),
                     [&](const JointVector& pose) { return (down_in_sensor(cell, arm, pose) - first).norm() > same; });
}

}  // namespace

std::vector<Station> tool_stations(const description::Cell& cell, const models::Arm& arm,
                                   const JointVector& motor_rad) {
  const std::vector<JointVector> poses = best_of(cell, arm, motor_rad);
  std::vector<Station> stations{{motor_rad}};
  if (wrist_of(arm).empty()) return stations;
  if (poses.size() < 1 + least_chosen) {
    throw description::SetupError(
        {.file = cell.file.string(),
         .key = "identify",
         .found = "a start from which the wrist can go to " + std::to_string(poses.size() - 1) + " other poses",
         .expected = "5 at least, within ranges, workspace_m and keep_out_m",
         .advice = "begin further from the border"});
  }
  if (!turns_weight(cell, arm, poses)) return stations;
  for (const std::size_t pose : round_of(ways(cell, arm, poses))) stations.push_back({poses[pose]});
  stations.push_back({motor_rad});
  return stations;
}

}  // namespace proxarm::identification
