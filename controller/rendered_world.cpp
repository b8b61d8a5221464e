#include "controller/rendered_world.hpp"

#include "controller/limited_algorithm.hpp"

namespace proxarm::controller {

using models::Vec;
using models::Vec3;

namespace {

template <int N>
class WorldOfDimension final : public RenderedWorld {
 public:
  WorldOfDimension(scenes::CompiledScene& scene, const AdmittanceConfig& config)
      : scene_(&scene),
        basis_(scene.space.axes.leftCols<N>()),
        limited_(scene.algorithm<N>()),
        proxy_(config, limited_) {}

  void start(const Vec3& q_W) noexcept override {
    ProxyStart<N> start;
    start.q = scene_->from_W<N>(q_W);
    proxy_.start(start);
    proxy_.set_reference(start.q);
    start_W_ = q_W;
    start_ = start.q;
    last_ = {};
    last_.q_W = last_.p_hat_W = q_W;
  }

  Vec3 resume(const Vec3& q_W, const Vec3& v_W) noexcept override {
    // As far as the scene lets it: a step of 𝒢, whose κ doesn't matter.
    const Vec<N> wanted = to_coordinates(q_W), v = basis_.transpose() * v_W;
    if (!wanted.allFinite() || !v.allFinite()) return last_.q_W;
    const double lead_s = proxy_.config().order == 2 ? proxy_.config().period_s : 0.0;
    ProxyStart<N> start;
    start.q = scene_->algorithm<N>()(proxy_.kappa_N_per_m(), wanted, proxy_.q());
    start.v = v;
    start.time_s = proxy_.time_s() + lead_s;
    proxy_.start(start);
    proxy_.set_reference(start_);
    last_.q_W = to_W(start.q);
    return last_.q_W;
  }

  WorldStep step(const Vec3& h_W, const StepLimits& limits) noexcept override {
    limited_.set_limits(limits, basis_, proxy_.q());
    const ProxyFault fault = proxy_.step(basis_.transpose() * h_W);
    if (fault != ProxyFault::none) {
      last_.fault = fault;
      return last_;
    }
    last_ = {};
    last_.q_W = to_W(proxy_.q());
    last_.p_hat_W = to_W(proxy_.p_hat());
    last_.limit_force_W = basis_ * (proxy_.kappa_N_per_m() * limited_.limit_shift());
    last_.f_W = basis_ * proxy_.f();
    last_.limits = limited_.active();
    if (last_.limits.kinds != 0) last_.f_W -= last_.limit_force_W;
    last_.soft_limits_met = limited_.soft_limits_met();
    last_.v_W = basis_ * proxy_.velocity();
    for (const models::Contact<N>& contact : scene_->algorithm<N>().contacts()) {
      if (last_.contacts++ == 0) {
        last_.normal_W = basis_ * contact.normal;
        last_.object = contact.object;
      }
      last_.slips = last_.slips || contact.slips;
    }
    return last_;
  }

  void set(const Change& change) noexcept override {
    switch (change.parameter) {
      case Parameter::mass:
        proxy_.set_mass(change.value);
        break;
      case Parameter::damping:
        proxy_.set_damping(change.value);
        break;
      case Parameter::spring:
        proxy_.set_spring(change.value);
        break;
      case Parameter::none:
        break;
    }
  }

  void archive(fieldbus::StateArchive& state) noexcept override { state(proxy_, start_W_, start_, last_.q_W); }

 private:
  // In three dimensions the coordinates are W's own where the scene keeps W's axes, and not even rounding comes in.
  Vec3 to_W(const Vec<N>& x) const noexcept {
    if constexpr (N == 3) {
      return scene_->to_W<N>(x);
    } else {
      return start_W_ + basis_ * (x - start_);
    }
  }

  Vec<N> to_coordinates(const Vec3& q_W) const noexcept {
    if constexpr (N == 3) {
      return scene_->from_W<N>(q_W);
    } else {
      return start_ + basis_.transpose() * (q_W - start_W_);
    }
  }

  scenes::CompiledScene* scene_;
  Eigen::Matrix<double, 3, N> basis_;
  LimitedAlgorithm<N> limited_;
  AdmittanceProxy<N> proxy_;
  Vec3 start_W_ = Vec3::Zero();
  Vec<N> start_ = Vec<N>::Zero();
  WorldStep last_;
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
      return std::make_unique<WorldOfDimension<1>>(scene, config);
    case 2:
      return std::make_unique<WorldOfDimension<2>>(scene, config);
    default:
      return std::make_unique<WorldOfDimension<3>>(scene, config);
  }
}

}  // namespace proxarm::controller
