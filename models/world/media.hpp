// Renders media, which act on the proxy without a surface: viscous and Coulomb media, everywhere or within a shape, in
// addition to any 𝒢.
//
// A viscous medium with damping b (Ns/m) adds −(b/T)(r − q) to ℳ. Let 𝒢' be the rest of the world and f' its force:
//   f'(r) = K (r − p) + (b/T)(r − q) = (K + b/T)(r − p'),   p' = (K p + (b/T) q)/(K + b/T).
// So the medium acts as a stiffer coupling to a point p' that is nearer to q than p is: 𝒢(K, p, q) = 𝒢'(K + b/T, p',
// q). In free space q(k) = p'. coulomb_step.hpp solves a step in a Coulomb medium. A medium acts in a step if it
// contains q. T is the period in StepTime (at order 2 two thirds of the cycle). Precondition: set_time() is called
// before each step.
#pragma once

#include <cstdint>
#include <memory>
#include <utility>
#include <vector>

#include "models/geometry/geometric_algorithm.hpp"
#include "models/obstacles/obstacle.hpp"
#include "models/surfaces/coulomb_step.hpp"

namespace proxarm::models {

struct Medium {
  double damping_Ns_per_m = 0.0;
  double force_N = 0.0;  // the force of Coulomb friction
  // The medium acts within this shape and on its surface. null: the medium acts everywhere.
  std::unique_ptr<Obstacle> shape;
};

template <int N>
class Media final : public GeometricAlgorithm<N> {
 public:
  static constexpr double first_period_s = 1e-3;  // T until the first call of set_time()

  // The proxy's coordinates are the first N coordinates of a frame S; `X_WS` is the pose of S in W. Shapes are in W.
  Media(std::unique_ptr<GeometricAlgorithm<N>> rest, std::vector<Medium> media, double period_s = first_period_s,
        const Pose& X_WS = Pose::Identity())
      : rest_(std::move(rest)), media_(std::move(media)), X_WS_(X_WS), T_(period_s) {}

  Vec<N> operator()(double K, const Vec<N>& p, const Vec<N>& q) noexcept override {
    double c = 0.0, F = 0.0;
    for (const Medium& medium : media_) {
      if (!holds(medium, q)) continue;
      c += medium.damping_Ns_per_m / T_;
      F += medium.force_N;
    }
    const double kappa = K + c;
    const Vec<N> p_v = c > 0.0 ? Vec<N>(q + (K / kappa) * (p - q)) : p;
    return F > 0.0 ? coulomb(kappa, F, p_v, q) : (*rest_)(kappa, p_v, q);
  }

  // Sets one bit for each medium that contains q. From the 33rd medium on, media share bits with the first media.
  [[nodiscard]] std::uint32_t media_at(const Vec<N>& q) const noexcept override {
    std::uint32_t held = 0;
    for (std::size_t i = 0; i < media_.size(); ++i) {
      if (holds(media_[i], q)) held |= 1U << (i % 32);
    }
    return held;
  }
  [[nodiscard]] bool has_media() const noexcept override { return !media_.empty(); }

  void set_time(const StepTime& time) noexcept override {
    if (time.period_s > 0.0) T_ = time.period_s;
    rest_->set_time(time);
  }
  [[nodiscard]] std::span<const Contact<N>> contacts() const noexcept override { return rest_->contacts(); }
  [[nodiscard]] std::uint64_t unresolved_steps() const noexcept override {
    return rest_->unresolved_steps() + unresolved_;
  }
  [[nodiscard]] bool squeezed() const noexcept override { return rest_->squeezed(); }

 private:
  [[nodiscard]] bool holds(const Medium& medium, const Vec<N>& q) const noexcept {
    return medium.shape == nullptr || !(medium.shape->distance(in_W(q)) > 0.0);
  }
  [[nodiscard]] Vec3 in_W(const Vec<N>& q) const noexcept {
    if constexpr (N == 3) return q;
    return X_WS_ * lift<N>(q);
  }
  Vec<N> coulomb(double kappa, double F, const Vec<N>& p, const Vec<N>& q) noexcept {
    bool found = true;
    const Vec<N> r = CoulombStep<N>(*rest_, kappa, F, p, q).solve(found);
    unresolved_ += found ? 0 : 1;
    return r;
  }

  std::unique_ptr<GeometricAlgorithm<N>> rest_;
  std::vector<Medium> media_;
  Pose X_WS_;
  double T_;
  std::uint64_t unresolved_ = 0;
};

}  // namespace proxarm::models
