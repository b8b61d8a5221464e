#include "controller/rendering/rendered_world.hpp"

#include "controller/limits/limited_algorithm.hpp"
#include "controller/rendering/lookahead.hpp"
#include "controller/rendering/scene_changes.hpp"
#include "controller/rendering/scene_space.hpp"

namespace proxarm::controller {

using models::Vec;
using models::Vec3;

namespace {

constexpr double rounding_m = 1e-12;  // of positions of some metres, a few operations

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
    // Out of a hold the scene goes on from where it stood.
    if (started_) start.time_s = proxy_.time_s() + lead_s();
    started_ = true;
    proxy_.start(start);
    proxy_.set_reference(start.q);
    last_ = {};
    last_.q_W = last_.p_hat_W = q_W;
  }

  Vec3 resume(const Vec3& q_W, const Vec3& v_W) noexcept override {
    // One step of 𝒢 goes as far as the scene lets it, for any κ. From outside of all objects it leads nearer to what is
    // wanted. From inside of one, where limits made the contact give way, 𝒢 leads out at once, however far that is;
    // then the wanted place is taken instead.
    const Vec<N> wanted = space_.from_W(q_W), v = space_.basis().transpose() * v_W;
    if (!wanted.allFinite() || !v.allFinite()) return last_.q_W;
    ProxyStart<N> start;
    start.q = scene_->algorithm<N>()(proxy_.kappa_N_per_m(), wanted, proxy_.q());
    if (!((start.q - wanted).norm() <= (proxy_.q() - wanted).norm() + rounding_m)) start.q = wanted;
    start.v = v;
    start.time_s = proxy_.time_s() + lead_s();
    proxy_.start(start);
    proxy_.set_reference(space_.start());
    last_.q_W = space_.to_W(start.q);
    return last_.q_W;
  }

  WorldStep step(const Vec3& h_W, const StepLimits& limits) noexcept override {
    changes_.step();
    limited_.set_limits(limits, space_.basis(), proxy_.q());
    ProxyFault fault = proxy_.step(space_.basis().transpose() * h_W);
    if (fault == ProxyFault::none && limited_.squeezed()) fault = ProxyFault::squeezed;
    if (fault != ProxyFault::none) {
      last_.fault = fault;
      return last_;
    }
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
    add_contacts<N>(last_, scene_->algorithm<N>().contacts(), space_.basis());
    last_.friction = changes_.friction(last_.object);
    return last_;
  }

  Vec3 look_ahead(const Vec3& h_W, const StepLimits& limits, double horizon_s) noexcept override {
    if (!ahead_) return last_.q_W;
    const Vec<N> h = space_.basis().transpose() * h_W;
    return space_.to_W((*ahead_)(proxy_, changes_, h, limits, space_.basis(), horizon_s));
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
        proxy_.set_spring(change.value);
        break;
      case Parameter::friction:
      case Parameter::position:
        changes_.set(change);
        break;
      case Parameter::lookahead:
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
    state(proxy_, space_, changes_, last_.q_W, damping_Ns_per_m_, added_Ns_per_m_, started_);
  }

 private:
  [[nodiscard]] double lead_s() const noexcept { return proxy_.config().order == 2 ? proxy_.config().period_s : 0.0; }

  scenes::CompiledScene* scene_;
  SceneChanges changes_;
  SceneSpace<N> space_;
  LimitedAlgorithm<N> limited_;
  AdmittanceProxy<N> proxy_;
  std::unique_ptr<Lookahead<N>> ahead_;  // none: looks no further than the proxy
  WorldStep last_;
  double damping_Ns_per_m_, added_Ns_per_m_ = 0.0;
  bool started_ = false;
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
