#include "controller/rendering/pose_world.hpp"

#include <algorithm>
#include <cmath>

#include "models/geometry/linear_systems.hpp"

namespace proxarm::controller {
namespace {

using models::Mat3;
using models::Mat6;
using models::ToolPose;
using models::Twist;
using models::Vec3;

// Speed at which the spring's reference returns to the tool's start pose, after the spring has become stiffer and after
// a hold. It is slow enough for a hand to follow.
constexpr double reference_m_per_s = 0.05, reference_rad_per_s = TurnSets::returning_rad_per_s;
// Rounding error of positions of some metres. A tool that touches an object at its start may be inside the object by
// this distance.
constexpr double rounding_m = 1e-12;
// After a hold in contact, the twisted gears put the tool some micrometres inside the object. The start pose is
// corrected if the correction is at most this large.
constexpr double settled_m = 1e-3, settled_rad = 0.01;
// Tolerance of the sets of turning. A wall yields by 1e-7 rad to 10 Nm.
constexpr double yields_rad = 1e-6;
constexpr int most_walls = 3;

Vec3 shortened(const Vec3& v, double most) noexcept {
  const double length = v.norm();
  return length > most ? Vec3(most / length * v) : v;
}

}  // namespace

PoseWorld::PoseWorld(std::unique_ptr<models::PoseAlgorithm> g, scenes::CompiledScene& scene,
                     const PoseWorldConfig& config)
    : config_(config),
      g_(std::move(g)),
      changes_(with_setters(scene), config.proxy.period_s),
      limits_(no_world_),
      proxy_(config_.proxy, *g_),
      damping_Ns_per_m_(config_.proxy.damping_Ns_per_m),
      turning_damping_Nms_per_rad_(config_.proxy.turning_damping_Nms_per_rad) {
  if (config.looks_ahead) ahead_ = std::make_unique<PoseLookahead>(*g_);
}

// Redirects the scene's setters of friction and motion from the point's 𝒢 to the tool's.
scenes::CompiledScene& PoseWorld::with_setters(scenes::CompiledScene& scene) {
  scene.friction_setters.clear();
  for (std::int32_t object = 0; static_cast<std::size_t>(object) < scene.frictions.size(); ++object) {
    scene.friction_setters.emplace_back(object, [this, object](double friction) {
      g_->set_friction(object, friction);
      if (ahead_) ahead_->set_friction(object, friction);
    });
  }
  scene.also_drive = [this](std::int32_t object, const models::Pose& X) { g_->drive(object, X); };
  return scene;
}

void PoseWorld::turn_to(const Eigen::Quaterniond& R_WT, const Vec3& omega_W) noexcept {
  R_WT_ = R_WT;
  omega_W_ = omega_W;
}

void PoseWorld::start(const Vec3& q_W) noexcept {
  const ToolPose wanted{q_W, R_WT_};
  const ToolPose q = started_ ? outside(wanted) : wanted;
  // After a hold the scene continues from the time at which it stopped.
  proxy_.start(q, started_ ? proxy_.time_s() : 0.0);
  if (!started_) home_ = q;
  started_ = true;
  no_room_ = g_->clearance_m(q) < -rounding_m;
  last_ = {};
  last_.q_W = last_.p_hat_W = q.position;
}

// Returns the pose nearest to `wanted` that 𝒢 reaches from the last pose, which is outside all objects. Returns
// `wanted` if `wanted` is outside all objects, or if the reached pose is too far from `wanted`.
ToolPose PoseWorld::outside(const ToolPose& wanted) noexcept {
  if (g_->clearance_m(wanted) >= -rounding_m) return wanted;
  const ToolPose reached = g_->step(proxy_.K(), wanted, proxy_.q());
  const Twist off = models::difference(reached, wanted);
  return off.head<3>().norm() <= settled_m && off.tail<3>().norm() <= settled_rad ? reached : wanted;
}

// One step of 𝒢 from the last pose moves the tool to the pose nearest to the wanted pose, and through no object.
Vec3 PoseWorld::resume(const Vec3& q_W, const Vec3& v_W) noexcept {
  const ToolPose wanted{q_W, R_WT_};
  if (!q_W.allFinite() || !v_W.allFinite() || !R_WT_.coeffs().allFinite() || !omega_W_.allFinite()) return last_.q_W;
  Twist velocity;
  velocity << v_W, omega_W_;
  proxy_.resume(g_->step(proxy_.K(), wanted, proxy_.q()), velocity);
  last_.q_W = proxy_.q().position;
  return last_.q_W;
}

WorldStep PoseWorld::step(const Vec3& h_W, const StepLimits& limits) noexcept {
  changes_.step();
  turning_limited_ = false;
  last_.fault = ProxyFault::none;
  if (no_room_) {
    last_.fault = ProxyFault::squeezed;
    return last_;
  }
  if (!h_W.allFinite() || !torque_W_.allFinite()) {
    last_.fault = ProxyFault::input_not_finite;
    return last_;
  }
  if (proxy_.config().spring_N_per_m > 0.0 || proxy_.config().turning_spring_Nm_per_rad > 0.0) return_reference();
  const ToolPose p_hat = proxy_.predict({h_W, torque_W_});
  ToolPose limited = p_hat;
  if (p_hat.position.allFinite()) limit_place(limits, limited);
  turning_limited_ = sets().keep(proxy_.q().orientation, limited.orientation).any();
  walls_.setZero();
  last_.fault = proxy_.step(limited);
  if (last_.fault == ProxyFault::none && !proxy_.config().held && !g_->wants_time()) hold_rotation(limited);
  if (last_.fault == ProxyFault::none && g_->squeezed()) last_.fault = ProxyFault::squeezed;
  if (last_.fault == ProxyFault::none) report(p_hat, limited);
  return last_;
}

void PoseWorld::limit_place(const StepLimits& limits, ToolPose& p_hat) noexcept {
  limits_.set_limits(limits, Mat3::Identity(), proxy_.q().position);
  p_hat.position = limits_(proxy_.K()(0, 0), p_hat.position, proxy_.q().position);
}

TurnSets PoseWorld::sets() const noexcept {
  TurnSets sets = config_.turn;
  sets.home = home_.orientation;
  sets.max_speed_rad_per_s *= speed_share_;
  sets.period_s = proxy_.config().period_s;
  return sets;
}

void PoseWorld::hold_rotation(const ToolPose& p_hat) noexcept {
  const double s = proxy_.holds_Nm_per_rad();
  Mat6 K = proxy_.K();
  Twist pull = Twist::Zero();
  int walls = 0;
  for (; walls < most_walls; ++walls) {
    ToolPose within = proxy_.q();
    if (!sets().keep(proxy_.q_before().orientation, within.orientation).any()) break;
    const Vec3 beyond = models::rotation_vector(proxy_.q().orientation * within.orientation.conjugate());
    if (!(beyond.norm() > yields_rad)) break;
    turning_limited_ = true;
    const Vec3 n = beyond.normalized();
    const auto from_p_hat = [&](const ToolPose& at) {
      return n.dot(models::rotation_vector(at.orientation * p_hat.orientation.conjugate()));
    };
    const double c = std::max(from_p_hat(within), from_p_hat(proxy_.q_before()) - yields_rad);
    K.bottomRightCorner<3, 3>() += s * n * n.transpose();
    pull.tail<3>() += s * c * n;
    last_.fault = proxy_.again(K, models::moved(p_hat, models::solve_square<6>(K, pull)));
    if (last_.fault != ProxyFault::none) return;
  }
  // K (q ⊟ p̂) is the wrench of contacts and walls together.
  if (walls > 0) walls_ = proxy_.K() * models::difference(proxy_.q(), p_hat) - proxy_.wrench_W();
}

void PoseWorld::return_reference() noexcept {
  const Twist way = models::difference(home_, proxy_.reference());
  if (way.isZero(0.0)) return;
  const double T = proxy_.config().period_s;
  Twist step;
  step << shortened(way.head<3>(), reference_m_per_s * T), shortened(way.tail<3>(), reference_rad_per_s * T);
  proxy_.set_reference(step == way ? home_ : models::moved(proxy_.reference(), step));
}

// Sets last_. The limits' wrench on the proxy is the wrench that holds p̂ back, plus the walls' wrench.
void PoseWorld::report(const ToolPose& p_hat, const ToolPose& limited) noexcept {
  last_ = {};
  last_.q_W = proxy_.q().position;
  last_.p_hat_W = p_hat.position;
  last_.f_W = proxy_.wrench_W().head<3>();
  last_.torque_W = proxy_.wrench_W().tail<3>();
  const Twist held_back = walls_ + proxy_.K() * models::difference(limited, p_hat);
  last_.limit_force_W = held_back.head<3>();
  last_.limit_torque_W = held_back.tail<3>();
  last_.limits = limits_.active();
  last_.soft_limits_met = limits_.soft_limits_met();
  last_.v_W = proxy_.move().head<3>() / proxy_.config().period_s;
  last_.mass_kg = proxy_.config().mass_kg;
  last_.damping_Ns_per_m = proxy_.config().damping_Ns_per_m;
  last_.unresolved = g_->unresolved();
  report_contacts();
}

// Reports the contacts with the largest forces, in falling order. Contacts without force don't count.
void PoseWorld::report_contacts() noexcept {
  auto end = touches_.begin();
  for (const models::PoseContact& contact : g_->contacts()) {
    const double force_N = contact.force_W.norm();
    if (!(force_N > 0.0)) continue;
    ++last_.contacts;
    last_.slips = last_.slips || contact.slips;
    const auto place = std::find_if(touches_.begin(), end, [&](const auto& t) { return t.force_W.norm() < force_N; });
    if (place == touches_.end()) continue;
    if (end != touches_.end()) ++end;
    std::move_backward(place, end - 1, end);
    *place = contact;
  }
  last_.touches = {touches_.begin(), end};
}

void PoseWorld::set(const Change& change) noexcept {
  PoseConfig changed = proxy_.config();
  switch (change.parameter) {
    case Parameter::mass:
      changed.mass_kg = change.value;
      break;
    case Parameter::damping:
      changed.damping_Ns_per_m = change.value + added_Ns_per_m_;
      if (proxy_.set(changed)) damping_Ns_per_m_ = change.value;
      return;
    case Parameter::inertia:
      changed.inertia_kg_m2 = change.value;
      break;
    case Parameter::turning_damping:
      changed.turning_damping_Nms_per_rad = change.value + added_Nms_per_rad_;
      if (proxy_.set(changed)) turning_damping_Nms_per_rad_ = change.value;
      return;
    case Parameter::spring:
      changed.spring_N_per_m = change.value;
      return set_springs(changed);
    case Parameter::turning_spring:
      changed.turning_spring_Nm_per_rad = change.value;
      return set_springs(changed);
    case Parameter::friction:
    case Parameter::position:
      return changes_.set(change);
    case Parameter::lookahead:
    case Parameter::tool:
    case Parameter::none:
      return;
  }
  proxy_.set(changed);
}

void PoseWorld::hang(double proxy_mass_kg, const models::ToolInertia& behind) noexcept {
  PoseConfig changed = proxy_.config();
  changed.mass_kg = proxy_mass_kg;
  changed.behind_mass_kg = behind.mass_kg;
  changed.behind_centre_T_m = behind.centre_T_m;
  changed.behind_inertia_T_kg_m2 = behind.about_T_kg_m2;
  proxy_.set(changed);
}

// When a spring's stiffness K becomes K', its reference moves so that the distance e from the reference becomes e' with
// K'e' = Ke, which keeps the force. If the spring becomes softer, the force's jump can't hurt, so the reference stays.
void PoseWorld::set_springs(PoseConfig changed) noexcept {
  const PoseConfig before = proxy_.config();
  if (!proxy_.set(changed)) return;
  Twist e = models::difference(proxy_.q(), proxy_.reference());
  const auto keep = [](double K, double K_before) { return K > K_before ? K_before / K : 1.0; };
  e.head<3>() *= keep(changed.spring_N_per_m, before.spring_N_per_m);
  e.tail<3>() *= keep(changed.turning_spring_Nm_per_rad, before.turning_spring_Nm_per_rad);
  proxy_.set_reference(
      {proxy_.q().position - e.head<3>(), (models::rotation_by(-e.tail<3>()) * proxy_.q().orientation).normalized()});
}

void PoseWorld::add_damping(double damping_Ns_per_m) noexcept {
  PoseConfig changed = proxy_.config();
  changed.damping_Ns_per_m = damping_Ns_per_m_ + damping_Ns_per_m;
  if (changed.damping_Ns_per_m == proxy_.config().damping_Ns_per_m || proxy_.set(changed)) {
    added_Ns_per_m_ = damping_Ns_per_m;
  }
}

void PoseWorld::add_turning_damping(double damping_Nms_per_rad) noexcept {
  PoseConfig changed = proxy_.config();
  changed.turning_damping_Nms_per_rad = turning_damping_Nms_per_rad_ + damping_Nms_per_rad;
  if (changed.turning_damping_Nms_per_rad == proxy_.config().turning_damping_Nms_per_rad || proxy_.set(changed)) {
    added_Nms_per_rad_ = damping_Nms_per_rad;
  }
}

void PoseWorld::archive(fieldbus::StateArchive& state) noexcept {
  state(proxy_, torque_W_, omega_W_, R_WT_, home_.position, home_.orientation, last_.q_W, damping_Ns_per_m_,
        added_Ns_per_m_, turning_damping_Nms_per_rad_, added_Nms_per_rad_, speed_share_, started_, no_room_);
  changes_.archive(state);
}

}  // namespace proxarm::controller
