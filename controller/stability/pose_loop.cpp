#include "controller/stability/pose_loop.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <array>
#include <cmath>
#include <complex>
#include <cstdio>
#include <numbers>

#include "controller/stability/smallest.hpp"
#include "models/arm/tool_inertia.hpp"
#include "models/base/setup_error.hpp"

namespace proxarm::controller {
namespace {

using Eigen::MatrixXd;
using models::Mat6;
using models::Vec3;

Mat6 of_both(double place, double turning) {
  Mat6 m = Mat6::Zero();
  m.diagonal() << place, place, place, turning, turning, turning;
  return m;
}

Grip grip_of(const PoseLoopModel& model) {
  const HandModel &place = model.place, &turning = model.turning;
  return {of_both(place.stiffness_N_per_m, turning.stiffness_N_per_m),
          of_both(place.damping_Ns_per_m, turning.damping_Ns_per_m), of_both(place.mass_kg, turning.mass_kg),
          model.behind_sensor_W};
}

// Returns N of the point r, which is held in the first `count` directions.
MatrixXd held(const Vec3& r, const models::Mat3& directions, Eigen::Index count) {
  MatrixXd N(6, count);
  for (Eigen::Index i = 0; i < count; ++i) N.col(i) << directions.col(i), r.cross(directions.col(i));
  return N;
}

// Returns an orthonormal basis that begins with n.
models::Mat3 beside(const Vec3& n) {
  models::Mat3 directions;
  directions.col(0) = n;
  directions.col(1) = n.unitOrthogonal();
  directions.col(2) = n.cross(directions.col(1));
  return directions;
}

// Returns a loop for each kind of drive, since the cell doesn't say which kind it has. Without a time constant, both
// kinds are equal, and one loop suffices.
std::vector<ElasticLoop> with_both_drives(const ElasticArm& arm, const PoseLoopModel& model) {
  const Grip grip = grip_of(model);
  LoopModel loop = model.loop;
  loop.feed_forward = false;
  std::vector<ElasticLoop> loops{{arm, grip, loop}};
  loop.feed_forward = true;
  if (loop.drive_time_constant_s > 0.0) loops.emplace_back(arm, grip, loop);
  return loops;
}

}  // namespace

std::vector<PoseLoop::Touch> PoseLoop::touches_of(const PoseLoopModel& model) {
  std::vector<Touch> touches{{MatrixXd(6, 0)}};
  for (const TouchedPlace& at : model.touched) {
    touches.push_back({held(at.r_W_m, beside(at.n_W), 1)});
    touches.push_back({held(at.r_W_m, beside(at.n_W), 3)});
  }
  if (!model.loop.layers) return touches;
  for (const LayerTouch& layer : *model.loop.layers) {
    Touch touch{MatrixXd(6, 0)};
    touch.spring.topLeftCorner<3, 3>() = layer.spring_W;
    if (layer.sticks_along_W) touch.forbidden = held(Vec3::Zero(), beside(*layer.sticks_along_W), 3).rightCols(2);
    touches.push_back(touch);
  }
  return touches;
}

Mat6 behind_sensor_W(const description::Cell& cell, const models::Mat3& R_WT) {
  const models::ToolInertia tool = models::tool_inertia(cell.tool);
  const Vec3 c = R_WT * tool.centre_T_m;
  models::Mat3 cross;
  cross << 0.0, -c.z(), c.y(), c.z(), 0.0, -c.x(), -c.y(), c.x(), 0.0;
  Mat6 m;
  m << tool.mass_kg * models::Mat3::Identity(), -tool.mass_kg * cross, tool.mass_kg * cross,
      R_WT * tool.about_T_kg_m2 * R_WT.transpose();
  return m;
}

PoseLoop pose_loop_at(const models::Arm& arm, const models::JointVector& pose_rad, const description::Cell& cell,
                      PoseLoopModel model) {
  const models::Mat3 R_WT = arm.tool_pose(pose_rad).linear();
  model.behind_sensor_W = behind_sensor_W(cell, R_WT);
  for (TouchedPlace& at : model.touched) at = {R_WT * at.r_W_m, R_WT * at.n_W};
  model.loop.horizon_s = 0.0;
  model.loop.order = 1;
  model.loop.arms = nullptr;
  return {elastic_pose_arm(arm, pose_rad, cell), model};
}

PoseLoop::PoseLoop(const ElasticArm& arm, const PoseLoopModel& model)
    : loops_(with_both_drives(arm, model)),
      behind_(model.behind_sensor_W),
      own_{Mat6::Zero(), of_both(model.loop.damping_Ns_per_m, model.turning_damping_Nms_per_rad),
           of_both(model.loop.spring_N_per_m, model.turning_spring_Nm_per_rad)},
      touches_(touches_of(model)),
      period_s_(model.loop.period_s) {}

ProxyMatrices PoseLoop::proxy(const Touch& touch, double mass_kg, double inertia_kg_m2, double margin) const {
  ProxyMatrices proxy = own_;
  proxy.spring += touch.spring;
  proxy.mass = (of_both(mass_kg, inertia_kg_m2) - behind_) / margin;
  return proxy;
}

bool PoseLoop::stable(const ElasticLoop& loop, const Touch& touch, double mass_kg, double inertia_kg_m2) const {
  const ProxyMatrices lighter = proxy(touch, mass_kg, inertia_kg_m2, elastic_margin);
  // If `lighter.mass` isn't positive definite, the part behind the sensor exceeds the requested mass or inertia.
  if (Eigen::LLT<MatrixXd>(lighter.mass).info() != Eigen::Success) return false;
  return loop.spectral_radius(lighter, touch.forbidden) < 1.0;
}

bool PoseLoop::stable(double mass_kg, double inertia_kg_m2) const {
  return std::all_of(loops_.begin(), loops_.end(), [&](const ElasticLoop& loop) {
    return std::all_of(touches_.begin(), touches_.end(),
                       [&](const Touch& touch) { return stable(loop, touch, mass_kg, inertia_kg_m2); });
  });
}

// Most contacts are stable at the inertia that earlier contacts require; these contacts aren't searched.
std::optional<double> PoseLoop::smallest_inertia(double mass_kg) const {
  constexpr double least_kg_m2 = 1e-6, close_enough = 1.005;
  double smallest = 0.0;
  for (const ElasticLoop& loop : loops_) {
    for (const Touch& touch : touches_) {
      const auto holds = [&](double inertia_kg_m2) { return stable(loop, touch, mass_kg, inertia_kg_m2); };
      if (smallest > 0.0 && holds(smallest) && holds(largest_kg_m2)) continue;
      const auto here = smallest_from_above(holds, largest_kg_m2, least_kg_m2, close_enough);
      if (!here) return std::nullopt;
      smallest = std::max(smallest, *here);
    }
  }
  return smallest;
}

namespace {
// Returns whether a mode swings: half a period later, on the other side, more than a tenth of its amplitude is left.
// Other modes fall to a tenth, the reported share, before they swing back.
bool swings(const std::complex<double>& s) { return s.real() * std::numbers::pi > std::log(0.1) * std::abs(s.imag()); }
}  // namespace

std::optional<Swing> PoseLoop::slowest_swing(double mass_kg, double inertia_kg_m2) const {
  constexpr double pi = std::numbers::pi, slowest_Hz = 3.0;
  std::optional<Swing> slowest;
  for (const ElasticLoop& loop : loops_) {
    for (const Touch& touch : touches_) {
      const ProxyMatrices as_it_is = proxy(touch, mass_kg, inertia_kg_m2, 1.0);
      for (const std::complex<double>& z : loop.eigenvalues(as_it_is, touch.forbidden)) {
        if (!(std::abs(z) < 1.0)) return std::nullopt;
        if (z == 0.0) continue;  // gone after a period
        const std::complex<double> s = std::log(z) / period_s_;
        const double frequency_Hz = std::abs(s.imag()) / (2.0 * pi), tenth_s = std::log(0.1) / s.real();
        if (frequency_Hz < slowest_Hz || !swings(s) || (slowest && tenth_s <= slowest->tenth_s)) continue;
        slowest = Swing{frequency_Hz, tenth_s};
      }
    }
  }
  return slowest;
}

void refuse_unstable_pose(double mass_kg, double inertia_kg_m2, const std::optional<double>& smallest) {
  std::array<char, 80> found{};
  std::array<char, 160> expected{};
  std::snprintf(found.data(), found.size(), "%.6g kg m²", inertia_kg_m2);
  if (smallest) {
    std::snprintf(expected.data(), expected.size(),
                  "at least %.2g kg m², the smallest that is stable with %.4g kg, led and turned at once by this hand",
                  round_up(*smallest), mass_kg);
  } else {
    std::snprintf(expected.data(), expected.size(),
                  "an inertia that is stable with %.4g kg, led and turned at once by this hand; none is", mass_kg);
  }
  throw description::SetupError({.key = "--inertia",
                                 .found = found.data(),
                                 .expected = expected.data(),
                                 .advice = smallest ? "choose a larger inertia, or a larger --mass (--force-unstable "
                                                      "overrides, in simulation)"
                                                    : "choose a larger --mass (--force-unstable overrides, in "
                                                      "simulation)"});
}

}  // namespace proxarm::controller
