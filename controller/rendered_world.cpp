#include "controller/rendered_world.hpp"

namespace proxarm::controller {

using models::Vec;
using models::Vec3;

namespace {

template <int N>
class WorldOfDimension final : public RenderedWorld {
 public:
  WorldOfDimension(scenes::CompiledScene& scene, const AdmittanceConfig& config)
      : scene_(&scene), basis_(scene.space.axes.leftCols<N>()), proxy_(config, scene.algorithm<N>()) {}

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

  WorldStep step(const Vec3& h_W) noexcept override {
    const ProxyFault fault = proxy_.step(basis_.transpose() * h_W);
    if (fault != ProxyFault::none) {
      last_.fault = fault;
      return last_;
    }
    last_ = {};
    last_.q_W = to_W(proxy_.q());
    last_.p_hat_W = to_W(proxy_.p_hat());
    last_.f_W = basis_ * proxy_.f();
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

 private:
  // In three dimensions the coordinates are W's own where the scene keeps W's axes, and not even rounding comes in.
  Vec3 to_W(const Vec<N>& x) const noexcept {
    if constexpr (N == 3) {
      return scene_->to_W<N>(x);
    } else {
      return start_W_ + basis_ * (x - start_);
    }
  }

  scenes::CompiledScene* scene_;
  Eigen::Matrix<double, 3, N> basis_;
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
