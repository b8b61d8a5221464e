#include "controller/rendering/rendered_world.hpp"

#include <algorithm>
#include <cmath>

#include "controller/limits/limited_algorithm.hpp"
#include "controller/rendering/lookahead.hpp"
#include "controller/rendering/scene_changes.hpp"
#include "controller/rendering/scene_space.hpp"

namespace proxarm::controller {

using models::Vec;
using models::Vec3;

namespace {

constexpr double rounding_m = 1e-12;  // rounding error of positions of some metres after a few operations

// The anchor of the spring of (26). It is at the start position, except after the spring has become stiffer and after a
// hold, while it returns to the start position.
//
// q: the proxy's place. r: the anchor's place. When the spring's stiffness K becomes K', the anchor jumps to the r'
// with K'(r' − q) = K(r − q), which keeps the force; without a spring before (K = 0), r' = q. From r' the anchor
// returns to the start position like a driven object, at the speed
//     v(k) = min(v(k−1) + aT, v_max, √(2 a d))        d: remaining distance
// A mass on an undamped spring oscillates with at most v about an anchor that moves at v, and with at most 2v after the
// anchor has stopped. So with nobody at the handle, the proxy is no faster than 2 v_max = 0.1 m/s. If the spring
// becomes softer, the force's jump can't hurt, so the anchor doesn't jump.
template <int N>
class SpringAnchor {
 public:
  using V = Vec<N>;
  static constexpr double speed_m_per_s = 0.05, acceleration_m_per_s2 = 0.5;

  void start(const V& home) noexcept {
    home_ = at_ = home;
    speed_ = 0.0;
  }
  // Starts after a hold, without force of the spring, since the person may have left the handle.
  void start_again(const V& q) noexcept {
    at_ = q;
    speed_ = 0.0;
  }
  void stiffen(double K, double K_before, const V& q) noexcept {
    if (!(K > K_before) || q == at_) return;
    at_ = q - K_before / K * (q - at_);
    speed_ = 0.0;
  }
  // Moves the anchor for one period. Returns true if the anchor has moved.
  bool step(double period_s) noexcept {
    const V way = home_ - at_;
    const double distance_m = way.norm(), a = acceleration_m_per_s2;
    if (distance_m == 0.0) return false;
    speed_ = std::min({speed_ + a * period_s, speed_m_per_s, std::sqrt(2.0 * a * distance_m)});
    const double step_m = speed_ * period_s;
    at_ = step_m >= distance_m ? home_ : V(at_ + step_m / distance_m * way);
    return true;
  }
  [[nodiscard]] const V& at() const noexcept { return at_; }
  void archive(fieldbus::StateArchive& state) noexcept { state(home_, at_, speed_); }

 private:
  V home_ = V::Zero(), at_ = V::Zero();
  double speed_ = 0.0;
};

template <int N>
class WorldOfDimension final : public RenderedWorld {
 public:
  WorldOfDimension(scenes::CompiledScene& scene, const AdmittanceConfig& config, bool looks_ahead)
      : scene_(&scene),
        changes_(scene, config.period_s),
        space_(scene),
        limited_(scene.algorithm<N>()),
        proxy_(config, limited_),
        damping_Ns_per_m_(config.damping_Ns_per_m) {
    if (looks_ahead) ahead_ = std::make_unique<Lookahead<N>>(*scene.source, config);
  }

  void start(const Vec3& q_W) noexcept override {
    space_.start(q_W);
    ProxyStart<N> start;
    start.q = space_.start();
    // After a hold the scene continues from the time at which it stopped.
    if (started_) start.time_s = proxy_.time_s();
    proxy_.start(start);
    limited_.start();
    if (started_) {
      anchor_.start_again(start.q);
    } else {
      anchor_.start(start.q);
    }
    started_ = true;
    unsettled_ = true;
    last_ = {};
    last_.q_W = last_.p_hat_W = q_W;
  }

  Vec3 resume(const Vec3& q_W, const Vec3& v_W) noexcept override {
    // One evaluation of 𝒢 moves the proxy to the nearest place that the scene allows, for any κ. If the proxy is
    // outside all objects, this place is nearer to the wanted place. If the proxy is inside an object, because limits
    // made the contact give way, 𝒢 moves the proxy out of the object, over any distance. So if 𝒢 leads away from the
    // wanted place, the wanted place is used instead, and contacts count from 𝒢's place.
    const Vec<N> wanted = space_.from_W(q_W), v = space_.basis().transpose() * v_W;
    if (!wanted.allFinite() || !v.allFinite()) return last_.q_W;
    ProxyStart<N> start;
    models::GeometricAlgorithm<N>& g = scene_->algorithm<N>();
    // Objects have already moved in this cycle. They don't move once more: they would pass the proxy.
    if (g.wants_time()) g.set_time({proxy_.time_s(), 0.0});
    start.q = g(proxy_.kappa_N_per_m(), wanted, limited_.from(proxy_.q()));
    if ((start.q - wanted).norm() <= (proxy_.q() - wanted).norm() + rounding_m) {
      limited_.start();
    } else {
      limited_.give_way_at(start.q);
      start.q = wanted;
    }
    start.v = v;
    start.time_s = proxy_.time_s();
    proxy_.start(start);
    proxy_.set_reference(anchor_.at());
    unsettled_ = false;
    last_.q_W = space_.to_W(start.q);
    return last_.q_W;
  }

  WorldStep step(const Vec3& h_W, const StepLimits& limits) noexcept override {
    changes_.step();
    if (anchor_.step(proxy_.config().period_s)) proxy_.set_reference(anchor_.at());
    limited_.set_limits(limits, space_.basis(), proxy_.q());
    if (unsettled_ && settle()) return last_;
    const std::uint64_t unresolved = scene_->template algorithm<N>().unresolved_steps();
    ProxyFault fault = proxy_.step(space_.basis().transpose() * h_W);
    if (fault == ProxyFault::none && limited_.squeezed()) fault = ProxyFault::squeezed;
    if (fault != ProxyFault::none) {
      last_.fault = fault;
      return last_;
    }
    take_last();
    last_.unresolved = scene_->template algorithm<N>().unresolved_steps() != unresolved;
    return last_;
  }

  Vec3 look_ahead(const Vec3& h_W, const StepLimits& limits, double horizon_s) noexcept override {
    if (!ahead_) return last_.q_W;
    const Vec<N> h = space_.basis().transpose() * h_W;
    return space_.to_W((*ahead_)(proxy_, limited_, changes_, h, limits, space_.basis(), horizon_s));
  }

  void set(const Change& change) noexcept override {
    switch (change.parameter) {
      case Parameter::mass:
        proxy_.set_mass(change.value);
        break;
      case Parameter::damping:
        if (proxy_.set_damping(change.value + added_Ns_per_m_)) damping_Ns_per_m_ = change.value;
        break;
      case Parameter::spring:
        set_spring(change.value);
        break;
      case Parameter::friction:
      case Parameter::position:
        changes_.set(change);
        break;
      case Parameter::lookahead:
      case Parameter::inertia:
      case Parameter::turning_damping:
      case Parameter::turning_spring:
      case Parameter::tool:
      case Parameter::none:
        break;
    }
  }

  void set_period(double period_s) noexcept override {
    if (period_s != proxy_.config().period_s) proxy_.set_period(period_s);
    changes_.set_period(period_s);
  }

  void add_damping(double damping_Ns_per_m) noexcept override {
    if (proxy_.set_damping(damping_Ns_per_m_ + damping_Ns_per_m)) added_Ns_per_m_ = damping_Ns_per_m;
  }

  void archive(fieldbus::StateArchive& state) noexcept override {
    state(proxy_, limited_, space_, changes_, anchor_, last_.q_W, damping_Ns_per_m_, added_Ns_per_m_, started_,
          unsettled_);
  }

 private:
  // Moves the start to an allowed place if the scene excludes the start position (some micrometres from a guide, or
  // inside a wall): the proxy starts at rest at 𝒢 of the start position, with q(k−2) = q(k−1). In a step of (26), the
  // displacement would become a velocity, such as 21 µm in a millisecond. Returns false if the scene doesn't exclude
  // the start position. If limits hold the proxy back, several steps are needed.
  bool settle() noexcept {
    unsettled_ = false;
    const Vec<N> before = proxy_.q();
    const double next_s = proxy_.time_s() + proxy_.config().period_s;
    if (limited_.wants_time()) limited_.set_time({next_s, proxy_.config().period_s});
    ProxyStart<N> start;
    start.q = limited_(proxy_.kappa_N_per_m(), before, before);
    start.time_s = next_s;
    if (!((start.q - before).norm() > rounding_m) || limited_.squeezed() || !proxy_.start(start)) return false;
    unsettled_ = limited_.active().kinds != 0;
    proxy_.set_reference(anchor_.at());
    take_last();
    last_.f_W = last_.limit_force_W = Vec3::Zero();
    last_.settled = true;
    return true;
  }

  void take_last() noexcept {
    last_ = {};
    last_.q_W = space_.to_W(proxy_.q());
    last_.p_hat_W = space_.to_W(proxy_.p_hat());
    last_.limit_force_W = space_.basis() * (proxy_.kappa_N_per_m() * limited_.limit_shift());
    last_.f_W = space_.basis() * proxy_.f();
    last_.limits = limited_.active();
    if (last_.limits.kinds != 0) last_.f_W -= last_.limit_force_W;
    last_.soft_limits_met = limited_.soft_limits_met();
    last_.v_W = space_.basis() * proxy_.velocity();
    last_.mass_kg = proxy_.config().mass_kg;
    last_.damping_Ns_per_m = proxy_.config().damping_Ns_per_m;
    add_contacts<N>(last_, touches_, scene_->algorithm<N>().contacts(), space_.basis());
    for (std::size_t i = 0; i < last_.touches.size(); ++i) {
      touches_[i].friction = changes_.friction(touches_[i].object);
    }
  }

  void set_spring(double spring_N_per_m) noexcept {
    const double before = proxy_.config().spring_N_per_m;
    if (!proxy_.set_spring(spring_N_per_m)) return;
    anchor_.stiffen(spring_N_per_m, before, proxy_.q());
    proxy_.set_reference(anchor_.at());
  }

  scenes::CompiledScene* scene_;
  SceneChanges changes_;
  SceneSpace<N> space_;
  LimitedAlgorithm<N> limited_;
  AdmittanceProxy<N> proxy_;
  std::unique_ptr<Lookahead<N>> ahead_;  // null: no lookahead
  SpringAnchor<N> anchor_;
  Touches touches_;
  WorldStep last_;  // last_.touches refers to touches_
  double damping_Ns_per_m_, added_Ns_per_m_ = 0.0;
  bool started_ = false;
  bool unsettled_ = false;  // the proxy may be at a place that the scene excludes
};

}  // namespace

std::unique_ptr<RenderedWorld> make_rendered_world(scenes::CompiledScene& scene, const SessionSettings& settings,
                                                   double proxy_mass_kg) {
  AdmittanceConfig config;
  config.mass_kg = proxy_mass_kg;
  config.damping_Ns_per_m = settings.damping_Ns_per_m;
  config.spring_N_per_m = settings.spring_N_per_m;
  config.period_s = settings.period_s;
  config.order = settings.order;
  switch (scene.dimensions()) {
    case 1:
      return std::make_unique<WorldOfDimension<1>>(scene, config, settings.looks_ahead);
    case 2:
      return std::make_unique<WorldOfDimension<2>>(scene, config, settings.looks_ahead);
    default:
      return std::make_unique<WorldOfDimension<3>>(scene, config, settings.looks_ahead);
  }
}

}  // namespace proxarm::controller
