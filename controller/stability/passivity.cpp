#include "controller/stability/passivity.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace proxarm::controller {

using models::Twist;
using models::Vec3;

PassivityObserver::PassivityObserver(const PassivityConfig& config, double period_s, Damping damping)
    : config_(config), damping_(damping), spell_(config.spell) {
  delay_.reset(Vec3::Zero());
  set_period(period_s);
}

void PassivityObserver::set_period(double period_s) noexcept {
  period_s_ = period_s;
  average_ = 1.0 - std::exp(-period_s / config_.average_s);
  delay_.design(config_.force_age_s, period_s);
  for (Band* band : {&force_, &torque_}) band->design(config_.band, period_s);
  for (View* view : {&seen_, &motors_}) {
    for (Band* band : {&view->motion, &view->place, &view->turning, &view->angle}) band->design(config_.band, period_s);
  }
}

void PassivityObserver::start(const Vec3& tool_W) noexcept {
  delay_.reset(Vec3::Zero());
  force_.reset();
  torque_.reset();
  for (View* view : {&seen_, &motors_}) {
    for (Band* band : {&view->motion, &view->place, &view->turning, &view->angle}) band->reset();
    view->moved_W.setZero();
    view->power = view->band = view->all = view->square = 0.0;
    view->tank = config_.tank_J;
  }
  start_W_ = tool_k1_ = tool_W;
  h_.setZero();
  h_k1_.setZero();
  torque_W_.setZero();
  force_square_ = added_ = remembered_s_ = 0.0;
  spell_.start();
  release_s_ = config_.release_s;
  oscillates_ = false;
  energies_ = {};
}

double PassivityObserver::observe_hand(const Vec3& h_W, const Vec3& tool_W) noexcept {
  if (!h_W.allFinite() || !tool_W.allFinite()) return added_;  // a fault follows; the observer's state stays finite
  h_k1_ = h_;
  h_ = h_W;
  const Vec3 step = delay_.step(tool_W - tool_k1_), velocity = seen_.motion.smooth(step / period_s_);
  tool_k1_ = tool_W;
  energies_.hand += 0.5 * (h_ + h_k1_).dot(step);
  const Vec3 force = force_.step(h_), motion = seen_.motion.above(velocity);
  take(seen_, {.power = force.dot(motion),
               .band = motion.squaredNorm(),
               .all = velocity.squaredNorm(),
               .square = seen_.place.step(tool_W - start_W_).squaredNorm()});
  return judge(force.squaredNorm());
}

double PassivityObserver::observe_hand(const models::Wrench& h_W, const ToolMove& move, double gyration_m2) noexcept {
  const bool finite =
      h_W.force.allFinite() && h_W.torque.allFinite() && move.links_W.allFinite() && move.motors_W.allFinite();
  if (!finite) return added_;
  gyration_m2_ = gyration_m2;
  h_k1_ = h_;
  h_ = h_W.force;
  const Vec3 torque_k1 = torque_W_;
  torque_W_ = h_W.torque;
  energies_.hand +=
      0.5 * ((h_ + h_k1_).dot(move.links_W.head<3>()) + (torque_W_ + torque_k1).dot(move.links_W.tail<3>()));
  const Vec3 force = force_.step(h_), torque = torque_.step(torque_W_);
  take(seen_, look(seen_, move.links_W, force, torque));
  take(motors_, look(motors_, move.motors_W, force, torque));
  return judge(force.squaredNorm() + torque.squaredNorm() / (config_.grip_m * config_.grip_m));
}

PassivityObserver::Moment PassivityObserver::look(View& view, const Twist& move_W, const Vec3& force,
                                                  const Vec3& torque) const noexcept {
  view.moved_W += move_W;
  const Vec3 velocity = view.motion.smooth(move_W.head<3>() / period_s_);
  const Vec3 omega = view.turning.smooth(move_W.tail<3>() / period_s_);
  const Vec3 motion = view.motion.above(velocity), turning = view.turning.above(omega);
  const Vec3 place = view.place.step(view.moved_W.head<3>()), angle = view.angle.step(view.moved_W.tail<3>());
  const double rho2 = gyration_m2_;
  return {.power = force.dot(motion) + torque.dot(turning),
          .band = motion.squaredNorm() + rho2 * turning.squaredNorm(),
          .all = velocity.squaredNorm() + rho2 * omega.squaredNorm(),
          .square = place.squaredNorm() + rho2 * angle.squaredNorm()};
}

void PassivityObserver::take(View& view, const Moment& now) const noexcept {
  view.power += average_ * (now.power - view.power);
  view.band += average_ * (now.band - view.band);
  view.all += average_ * (now.all - view.all);
  view.square += average_ * (now.square - view.square);
  view.tank = std::clamp(view.tank + period_s_ * (view.power + config_.refill_W), -config_.tank_J, config_.tank_J);
}

bool PassivityObserver::gives(const View& view) const noexcept {
  return view.tank < 0.0 && view.power < -config_.refill_W && view.band > config_.share * view.all;
}

double PassivityObserver::judge(double force_square) noexcept {
  const bool did = oscillates_;
  force_square_ += average_ * (force_square - force_square_);
  oscillates_ = shakes() || gives(seen_) || gives(motors_);
  follow_spell();
  if (damping_ != Damping::never) follow_damping(oscillates_ && !did);
  return added_;
}

bool PassivityObserver::shakes() const noexcept {
  const double omega = 2.0 * std::numbers::pi * config_.shake_Hz;
  return force_square_ > config_.shake_N * config_.shake_N && seen_.band > omega * omega * seen_.square;
}

void PassivityObserver::follow_spell() noexcept {
  remembered_s_ = std::max(0.0, remembered_s_ - period_s_);
  spell_.step({.oscillates = oscillates_,
               .square_m2 = seen_.square,
               .speed_square_m2_per_s2 = seen_.band,
               .turns = gyration_m2_ > 0.0},
              period_s_);
  if (spell_.lasts() || (oscillates_ && remembered_s_ > 0.0)) remembered_s_ = config_.remembered_s;
}

// `begins`: another oscillation begins in this period.
void PassivityObserver::follow_damping(bool begins) noexcept {
  const double felt = felt_damping_Ns_per_m();
  const bool acts = damping_ == Damping::at_once || remembered_s_ > 0.0;
  if (begins && added_ > 0.0) release_s_ = std::min(2.0 * release_s_, config_.longest_release_s);
  const double wanted = shakes() ? config_.most_felt_Ns_per_m : std::min(-felt, config_.most_felt_Ns_per_m);
  if (acts && oscillates_ && wanted > 0.0) {
    const double growth = wanted * period_s_ / config_.rise_s;
    added_ = std::min(added_ + growth, config_.max_damping_Ns_per_m);
    return;
  }
  added_ -= added_ * period_s_ / release_s_;
  if (added_ < config_.gone_Ns_per_m) {
    added_ = 0.0;
    release_s_ = config_.release_s;
  }
}

void PassivityObserver::observe_proxy(const Vec3& v_W, const Vec3& f_W, double mass_kg,
                                      double damping_Ns_per_m) noexcept {
  const double speed_squared = v_W.squaredNorm();
  energies_.proxy += period_s_ * h_.dot(v_W);
  energies_.world += period_s_ * f_W.dot(v_W);
  energies_.kinetic = 0.5 * mass_kg * speed_squared;
  energies_.damping += period_s_ * damping_Ns_per_m * speed_squared;
  energies_.added += period_s_ * added_ * speed_squared;
}

void PassivityObserver::observe_proxy(const TurningPort& port) noexcept {
  const Vec3 v = port.velocity_W.head<3>(), omega = port.velocity_W.tail<3>();
  const double v2 = v.squaredNorm(), omega2 = omega.squaredNorm();
  energies_.proxy += period_s_ * (h_.dot(v) + torque_W_.dot(omega));
  energies_.world += period_s_ * port.world_W.dot(port.velocity_W);
  energies_.kinetic = port.kinetic_J;
  energies_.damping += period_s_ * (port.damping_Ns_per_m * v2 + port.turning_damping_Nms_per_rad * omega2);
  energies_.added += period_s_ * added_ * (v2 + gyration_m2_ * omega2);
}

double PassivityObserver::oscillation_m_per_s() const noexcept { return std::sqrt(seen_.band); }

double PassivityObserver::felt_damping_Ns_per_m() const noexcept {
  const double felt = seen_.band > 0.0 ? seen_.power / seen_.band : 0.0;
  return gives(motors_) ? std::min(felt, motors_.power / motors_.band) : felt;
}

}  // namespace proxarm::controller
