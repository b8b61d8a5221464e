#include "controller/extras/assessment/assessment.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <set>

#include "models/base/random.hpp"
#include "models/geometry/eigenvalues.hpp"

namespace proxarm::assessment {
namespace {

using models::Vec3;

// The spring constants of ISO/TS 15066 lie in this range. No body region has 100 N/mm; this value fills a gap.
constexpr std::array body_stiffnesses_N_per_m{10e3, 25e3, 50e3, 75e3, 100e3, 150e3};

// Returns the smallest mobility over the directions of the tool's space.
double worst_mobility(const models::Arm& arm, const models::ToolSpace& space, const models::JointVector& q) {
  models::ToolKinematics at;
  arm.kinematics(q, at);
  if (space.dimensions == 3) return models::smallest_singular_value(at.J_W.topRows<3>());
  models::Mat6 squares = models::Mat6::Zero();
  const auto J = at.J_W.topRows<3>();
  squares.topLeftCorner<3, 3>() = J.lazyProduct(J.transpose());
  const models::SymmetricEigen eigen = models::symmetric_eigen(squares);
  return std::sqrt(std::max(0.0, eigen.values[6 - space.dimensions]));
}

bool allowed(const description::CellLimits& limits, const Vec3& tool_W) {
  const auto within = [&](const auto& min_m, const auto& max_m) {
    return (tool_W.array() >= Vec3(min_m.data()).array()).all() && (tool_W.array() <= Vec3(max_m.data()).array()).all();
  };
  return within(limits.workspace_min_m, limits.workspace_max_m) &&
         std::none_of(limits.keep_out.begin(), limits.keep_out.end(),
                      [&](const description::BoxDescription& box) { return within(box.min_m, box.max_m); });
}

const Sample& fastest(const TrialResult& result) {
  return *std::max_element(result.samples.begin(), result.samples.end(), [](const Sample& a, const Sample& b) {
    return a.velocity_W.squaredNorm() < b.velocity_W.squaredNorm();
  });
}

// The worst figures over all poses and directions: one for each stop category and one for each body.
class Worst {
 public:
  void take(const StopFigure& figure) {
    for (std::size_t i = 0; i < result_.stops.size(); ++i) {
      StopFigure& worst = result_.stops[i];
      if (worst.stop != figure.stop) continue;
      result_.longest_stop_s[i] = std::max(result_.longest_stop_s[i], figure.time_s);
      const bool all_rest = worst.at_rest && figure.at_rest;
      if (figure.distance_m > worst.distance_m) worst = figure;
      worst.at_rest = all_rest;
      return;
    }
    result_.stops.push_back(figure);
    result_.longest_stop_s.push_back(figure.time_s);
  }
  void take(const ClampFigure& figure) {
    for (ClampFigure& worst : result_.clamps) {
      if (worst.felt != figure.felt || worst.stiffness_N_per_m != figure.stiffness_N_per_m) continue;
      const double quasi_static_N = std::max(worst.quasi_static_N, figure.quasi_static_N);
      const double energy_J = std::max(worst.energy_J, figure.energy_J);
      const double left_N = std::max(worst.left_N, figure.left_N);
      if (figure.transient_N > worst.transient_N) worst = figure;
      worst.quasi_static_N = quasi_static_N;
      worst.energy_J = energy_J;
      worst.left_N = left_N;
      return;
    }
    result_.clamps.push_back(figure);
  }
  [[nodiscard]] Assessment finish(const std::vector<std::vector<double>>& poses_rad) {
    result_.poses_rad = poses_rad;
    return result_;
  }

 private:
  Assessment result_;
};

}  // namespace

std::vector<std::vector<double>> poses_about_start(const description::Cell& cell, const models::Arm& arm, int count) {
  constexpr double reach = 0.4;  // largest distance of each joint from its start, rad or m
  constexpr double least_share_of_mobility = 0.6;
  constexpr int tries = 1000;
  const models::JointVector& start = arm.start_rad();
  const models::ToolSpace space = models::tool_space(arm);
  const double mobility = worst_mobility(arm, space, start);
  std::vector<std::vector<double>> poses{{start.begin(), start.end()}};
  models::Random random(1);
  for (int i = 0; i < tries && static_cast<int>(poses.size()) < count; ++i) {
    models::JointVector q = start;
    for (int axis = 0; axis < arm.axes(); ++axis) {
      const auto& range = cell.drives[static_cast<std::size_t>(axis)].range_rad;
      const double room = 0.1 * (range[1] - range[0]);
      const double from = std::min(start[axis], std::max(start[axis] - reach, range[0] + room));
      const double to = std::max(start[axis], std::min(start[axis] + reach, range[1] - room));
      q[axis] = random.uniform(from, to);
    }
    if (worst_mobility(arm, space, q) < least_share_of_mobility * mobility) continue;
    if (allowed(cell.limits, arm.tool_pose(q).translation())) poses.emplace_back(q.begin(), q.end());
  }
  return poses;
}

StopFigure stop_figure(const TrialResult& result) {
  StopFigure figure;
  const auto stopped = std::find_if(result.samples.begin(), result.samples.end(),
                                    [&](const Sample& sample) { return sample.time_s >= result.stopped_at_s; });
  if (stopped == result.samples.end()) return figure;
  figure.from_m_per_s = stopped->velocity_W.norm();
  for (auto sample = stopped; sample != result.samples.end(); ++sample) {
    figure.distance_m = std::max(figure.distance_m, (sample->tool_W - stopped->tool_W).norm());
    const bool goes_on = (sample->tool_W - result.samples.back().tool_W).norm() > stopped_within_m;
    if (goes_on) figure.time_s = sample->time_s - result.stopped_at_s;
  }
  figure.at_rest = result.samples.back().velocity_W.norm() < rest_m_per_s;
  return figure;
}

ClampFigure clamp_figure(const Body& body, const TrialResult& result) {
  ClampFigure figure{.felt = body.felt, .stiffness_N_per_m = body.stiffness_N_per_m};
  figure.end = result.end;
  double touched_s = -1.0;
  for (const Sample& sample : result.samples) {
    figure.left_N = 0.0;
    const double depth_m = (sample.tool_W - body.surface_W).dot(body.normal_W);
    // Before the body appears, the tool is on the body's outer side.
    if (depth_m <= 0.0) continue;
    if (touched_s < 0.0) {
      touched_s = sample.time_s;
      figure.at_m_per_s = sample.velocity_W.norm();
    }
    const double force_N = body.stiffness_N_per_m * depth_m;
    double& largest_N = sample.time_s - touched_s < quasi_static_from_s ? figure.transient_N : figure.quasi_static_N;
    largest_N = std::max(largest_N, force_N);
    figure.left_N = force_N;
    figure.energy_J = std::max(figure.energy_J, 0.5 * force_N * depth_m);
  }
  return figure;
}

std::vector<Direction> directions_of(const models::ToolSpace& space) {
  std::vector<Direction> directions;
  for (Eigen::Index i = 0; i < space.dimensions; ++i) {
    const Vec3 along = space.axes.col(i);
    std::string name = std::to_string(i + 1);
    for (Eigen::Index k = 0; k < 3; ++k) {
      if (along == Vec3::Unit(k)) name = std::string(1, "xyz"[k]);
    }
    directions.push_back({"+" + name, along});
    directions.push_back({"-" + name, -along});
  }
  return directions;
}

Assessment assess(const std::vector<std::vector<double>>& poses_rad, const std::vector<Direction>& directions,
                  const Thresholds& thresholds, const ArmTrial& run_trial) {
  std::set<double> stiffnesses(body_stiffnesses_N_per_m.begin(), body_stiffnesses_N_per_m.end());
  for (const Region& region : thresholds.regions) stiffnesses.insert(region.stiffness_N_per_m);
  Worst worst;
  for (std::size_t pose = 0; pose < poses_rad.size(); ++pose) {
    for (const Direction& direction : directions) {
      Trial trial{.start_rad = poses_rad[pose], .direction_W = direction.along_W};
      const TrialResult free = run_trial(trial);
      if (free.samples.empty()) continue;
      const Sample& top = fastest(free);
      trial.at_s = top.time_s;
      for (const Stop stop : {Stop::category_0, Stop::category_1, Stop::category_2}) {
        trial.stop = stop;
        StopFigure figure = stop_figure(run_trial(trial));
        figure.stop = stop;
        figure.pose = static_cast<int>(pose);
        figure.direction = direction.name;
        worst.take(figure);
      }
      trial.stop = Stop::none;
      for (const bool felt : {true, false}) {
        for (const double stiffness : stiffnesses) {
          trial.body = {stiffness, top.tool_W, top.velocity_W.normalized(), felt};
          ClampFigure figure = clamp_figure(trial.body, run_trial(trial));
          figure.pose = static_cast<int>(pose);
          figure.direction = direction.name;
          worst.take(figure);
        }
      }
    }
  }
  return worst.finish(poses_rad);
}

}  // namespace proxarm::assessment
