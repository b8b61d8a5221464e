#include "controller/preparation/session_loops.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <numbers>

#include "controller/session/bring_up.hpp"
#include "models/arm/arm.hpp"
#include "models/arm/tool_inertia.hpp"
#include "models/rigid_shapes/furthest.hpp"
#include "scenes/compiler/layer_touches.hpp"

namespace proxarm::controller {
namespace {

using std::numbers::pi;

// Returns the mean age of a sample in s. The converter holds a sample for half the sampling period on average, and the
// filter adds its time constant.
double sensor_delay_s(const description::SensorPlacement& sensor) {
  double delay_s = sensor.delay_s;
  if (sensor.sample_rate_Hz > 0.0) delay_s += 0.5 / sensor.sample_rate_Hz;
  if (sensor.bandwidth_Hz > 0.0) delay_s += 1.0 / (2.0 * pi * sensor.bandwidth_Hz);
  return delay_s;
}

// Returns the delay of ElasticSetpoint's critically damped filter, 2/ω, in s.
double setpoint_filter_delay_s(const description::Cell& cell) {
  return cell.limits.setpoint_bandwidth_Hz > 0.0 ? 2.0 / (2.0 * pi * cell.limits.setpoint_bandwidth_Hz) : 0.0;
}

// Returns the mean delay, in s, that a streaming sensor adds because it isn't synchronous with the cycle.
double stream_delay_s(const description::SensorDescription& sensor) {
  return sensor.described && sensor.described->streams() ? 0.5 / sensor.described->rate_Hz : 0.0;
}

std::shared_ptr<const std::vector<ElasticArm>> arms_at(const PreparedSession& session,
                                                       const std::vector<models::JointVector>& poses_rad) {
  const models::Arm arm(session.cell);
  auto arms = std::make_shared<std::vector<ElasticArm>>();
  for (const models::JointVector& pose_rad : poses_rad) {
    arms->push_back(elastic_arm(arm, pose_rad, session.cell));
  }
  return arms;
}

// Returns the stiffness as text, for example "20 kN/m". Three digits are enough, because scenes have round numbers.
std::string stiffness_text(double N_per_m) {
  std::array<char, 40> text{};
  const bool kilo = N_per_m >= 1000.0;
  std::snprintf(text.data(), text.size(), kilo ? "%.3g kN/m" : "%.3g N/m", kilo ? 1e-3 * N_per_m : N_per_m);
  return text.data();
}

// Returns the layers as text, for example "layer 'foam' of 20 kN/m and layer 'mat' of 4 kN/m at once".
std::string words_of(const scenes::LayersTogether& layers) {
  std::string words;
  for (const scenes::PressedLayer& layer : layers) {
    words +=
        (words.empty() ? "layer '" : " and layer '") + layer.object + "' of " + stiffness_text(layer.stiffness_N_per_m);
  }
  return words + (layers.size() > 1 ? " at once" : "");
}

// Returns whether the hand turns the tool. If the hand doesn't twist the handle, rotation has no loop with the hand,
// and the proxy's pole at 1 would count as unstable.
bool is_turned(const PreparedSession& session) {
  return !session.impedance() && session.settings.orientation != OrientationMode::held &&
         session.cell.drives.size() >= 6 && session.hand.twists();
}

// Returns the points at which contact is assumed. For a tool with a shape these are the extreme points in the
// directions of a cube's faces and corners. A point tool touches at T's origin.
std::vector<TouchedPlace> touched_places_T(const PreparedSession& session) {
  std::vector<TouchedPlace> places;
  const bool is_point = !session.scene.tool;
  for (int i = 0; i < 27; ++i) {
    const int x = i % 3 - 1, y = i / 3 % 3 - 1, z = i / 9 - 1;
    const models::Vec3 way(x, y, z);
    if (way.squaredNorm() != 1.0 && way.squaredNorm() != 3.0) continue;
    if (is_point && i > 13) continue;  // the opposite direction gives the same constraint
    const models::Vec3 n_T = way.normalized();
    const models::Vec3 r_T = is_point ? models::Vec3::Zero() : models::furthest_of(session.scene.tool->shape, n_T);
    places.push_back({r_T, n_T});
  }
  return places;
}

// The loosest grip that is judged; it replaces looser ones. A hand without stiffness, such as one that plays a recorded
// force, lets the tool drift: the loop has an eigenvalue of exactly 1 at any mass, which isn't an instability. With the
// loosest grip the drift decays. A kilogram on this grip swings with a period of six seconds, far slower than any
// oscillation of interest. With this grip D > K L for any loop delay L below a second; with D < K L no mass would be
// stable.
constexpr double loosest_N_per_m = 1.0, loosest_Ns_per_m = 1.0;

HandModel held_with(const description::Grip& grip, double mass_kg) {
  if (grip.stiffness_N_per_m >= loosest_N_per_m) return {grip.stiffness_N_per_m, grip.damping_Ns_per_m, mass_kg};
  return {loosest_N_per_m, std::max(grip.damping_Ns_per_m, loosest_Ns_per_m), mass_kg};
}

// Returns each of the hand's grips other than the tightest one, at its largest stiffness and damping, without
// duplicates. A grip with hardly any stiffness and damping is left out, because the hand has let go.
std::vector<description::Grip> other_grips(const description::HandDescription& hand,
                                           const description::Grip& tightest) {
  std::vector<description::Grip> all{{0.0, hand.stiffness_N_per_m, hand.damping_Ns_per_m}}, others;
  all.insert(all.end(), hand.grips.begin(), hand.grips.end());
  for (description::Grip grip : all) {
    grip.stiffness_N_per_m *= 1.0 + hand.variation.share;
    grip.damping_Ns_per_m *= 1.0 + hand.variation.share;
    const auto same = [&](const description::Grip& other) {
      return other.stiffness_N_per_m == grip.stiffness_N_per_m && other.damping_Ns_per_m == grip.damping_Ns_per_m;
    };
    const bool holds = grip.stiffness_N_per_m >= loosest_N_per_m || grip.damping_Ns_per_m >= loosest_Ns_per_m;
    if (holds && !same(tightest) && std::none_of(others.begin(), others.end(), same)) others.push_back(grip);
  }
  return others;
}

}  // namespace

double loop_delay_s(const PreparedSession& session) {
  if (session.impedance()) return 0.5 * session.settings.period_s;
  return session.settings.period_s + sensor_delay_s(session.cell.sensor) + stream_delay_s(session.sensor) +
         setpoint_filter_delay_s(session.cell);
}

std::shared_ptr<const std::vector<ElasticArm>> arms_at_start(const PreparedSession& session) {
  return arms_at(session, led_poses(models::Arm(session.cell), {}));
}

std::shared_ptr<const std::vector<LayerTouch>> layers_of(const scenes::Scene& scene) {
  auto all = std::make_shared<std::vector<LayerTouch>>();
  for (const scenes::LayersTogether& layers : scenes::layer_touches(scene)) {
    LayerTouch touch{.what = words_of(layers)};
    for (const scenes::PressedLayer& layer : layers)
      touch.spring_W += layer.stiffness_N_per_m * layer.normal_W * layer.normal_W.transpose();
    all->push_back(touch);
    if (layers.size() > 1 || !(layers[0].friction > 0.0)) continue;
    touch.sticks_along_W = layers[0].normal_W;
    all->push_back(touch);
  }
  return all->empty() ? nullptr : all;
}

HandModel turning_hand_model(const PreparedSession& session) {
  const double tightest = 1.0 + session.hand.variation.share;
  return {tightest * session.hand.turning_stiffness_Nm_per_rad, tightest * session.hand.turning_damping_Nms_per_rad,
          session.hand.inertia_kg_m2};
}

double felt_inertia_kg_m2(const PreparedSession& session) { return felt_inertia_kg_m2(session.cell, session.settings); }

LoopModel turning_loop(const PreparedSession& session) {
  const models::Arm arm(session.cell);
  LoopModel loop = session.loop;
  loop.horizon_s = 0.0;  // the lookahead predicts the translation only
  loop.order = 1;
  loop.layers = nullptr;  // with a held place, layers have no effect
  // This loop holds the tool's place. With feed-forward in it, the inertia needed would come out a quarter too large;
  // PoseLoop judges the feed-forward.
  loop.either_drive = false;
  loop.handle_mass_kg = models::tool_inertia(session.cell.tool).largest_kg_m2;
  loop.damping_Ns_per_m = session.settings.rotational_damping_Nms_per_rad;
  loop.spring_N_per_m = session.settings.rotational_spring_Nm_per_rad;
  loop.arms = std::make_shared<const std::vector<ElasticArm>>(
      1, elastic_turning_arm(arm, arm.start_rad(), session.cell, session.hand.mass_kg));
  return loop;
}

std::optional<PoseLoopModel> turned_model(const PreparedSession& session) {
  if (!is_turned(session)) return {};
  PoseLoopModel model;
  model.place = hand_model(session);
  model.turning = turning_hand_model(session);
  model.turning_damping_Nms_per_rad = session.settings.rotational_damping_Nms_per_rad;
  model.turning_spring_Nm_per_rad = session.settings.rotational_spring_Nm_per_rad;
  model.loop = session.loop;
  model.touched = touched_places_T(session);
  return model;
}

std::optional<PoseLoop> pose_loop_at_start(const PreparedSession& session) {
  const std::optional<PoseLoopModel> model = turned_model(session);
  if (!model) return {};
  const models::Arm arm(session.cell);
  return pose_loop_at(arm, arm.start_rad(), session.cell, *model);
}

std::optional<Swing> slowest_swing(const PreparedSession& session) {
  const std::optional<PoseLoop> loop = pose_loop_at_start(session);
  if (!loop) return {};
  return loop->slowest_swing(session.settings.mass_kg, felt_inertia_kg_m2(session));
}

// To save time, a grip's smallest stable mass is computed only if the largest of the earlier grips' smallest stable
// masses is unstable with this grip.
HandModel hand_model(const PreparedSession& session, LoopModel loop) {
  const description::Grip tightest = description::tightest_grip(session.hand);
  HandModel worst = held_with(tightest, session.hand.mass_kg);
  const std::vector<description::Grip> others = other_grips(session.hand, tightest);
  if (session.impedance() || others.empty()) return worst;
  loop.horizon_s = 0.0;
  std::optional<double> least_kg = smallest_stable_mass(worst, loop);
  for (const description::Grip& grip : others) {
    const HandModel hand = held_with(grip, session.hand.mass_kg);
    if (!least_kg) return worst;
    if (spectral_radius(hand, loop, *least_kg) < 1.0) continue;
    least_kg = smallest_stable_mass(hand, loop);
    worst = hand;
  }
  return worst;
}

HandModel hand_model(const PreparedSession& session) { return hand_model(session, session.loop); }

std::vector<models::JointVector> led_poses(const PreparedSession& session) {
  std::vector<Lead> leads;
  for (const description::Waypoint& waypoint : session.hand.waypoints) {
    leads.push_back({.offset_m = models::Vec3(waypoint.offset_m.data())});
    if (is_turned(session)) leads.back().turn_rad = models::Vec3(waypoint.turn_rad.data());
  }
  // Adds the poses at both ends of each sine, and at both ends of the sum of all sines.
  Lead all;
  const auto add_both = [&](const Lead& lead) {
    leads.push_back(lead);
    leads.push_back({-lead.offset_m, -lead.turn_rad});
  };
  for (const description::Sine& sine : session.hand.multisine) {
    const models::Vec3 direction(sine.direction.data());
    const Lead end{sine.amplitude_m * direction, (is_turned(session) ? sine.amplitude_rad : 0.0) * direction};
    all = {all.offset_m + end.offset_m, all.turn_rad + end.turn_rad};
    add_both(end);
  }
  if (session.hand.multisine.size() > 1) add_both(all);
  // Adds the poses at about 48 rows of a trajectory; more would take too much time.
  constexpr std::size_t places = 48;
  const std::vector<description::TimedVector>& trajectory = session.hand.trajectory;
  const std::size_t step = std::max<std::size_t>(1, trajectory.size() / places);
  for (std::size_t i = 0; i < trajectory.size(); i += step) {
    leads.push_back({.offset_m = models::Vec3(trajectory[i].value.data())});
  }
  return led_poses(models::Arm(session.cell), leads);
}

LoopModel led_loop(const PreparedSession& session) {
  LoopModel loop = session.loop;
  loop.arms = arms_at(session, led_poses(session));
  return loop;
}

double longest_horizon_s(const PreparedSession& session) {
  const double proxy_kg = session.settings.mass_kg - session.loop.handle_mass_kg;
  LoopModel loop = led_loop(session);
  loop.filter_s = 0.5 * setpoint_filter_delay_s(session.cell);
  return stable_horizon_s(hand_model(session), loop, proxy_kg);
}

double motion_delay_s(const PreparedSession& session) {
  if (session.impedance()) return 0.0;
  return 2.0 * session.settings.period_s + setpoint_filter_delay_s(session.cell);
}

double total_delay_s(const PreparedSession& session) {
  return session.loop.period_s + session.loop.delay_s + session.loop.drive_time_constant_s;
}

}  // namespace proxarm::controller
