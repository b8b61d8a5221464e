// What acts on the proxy without a surface: viscous and Coulomb media, everywhere or within a shape, over any 𝒢.
//
// A viscous medium of b (Ns/m) adds −(b/T)(r − q) to ℳ. With the rest of the world as 𝒢', that is a stiffer coupling:
//   𝒢(K, p, q) = 𝒢'(K + b/T, (K p + (b/T) q)/(K + b/T), q),
// which alone gives q(k) = (K p + (b/T) q)/(K + b/T). A Coulomb medium of force F adds −F (r − q)/‖r − q‖ (16), which
// is a viscous one of λ = F/‖r − q‖: with τ = λ/(κ + λ), κ = K + b/T,
//   r(τ) = 𝒢'(κ/(1 − τ), p' + τ (q − p'), q),   κ τ/(1 − τ) ‖r(τ) − q‖ = F,
// linear in τ where 𝒢' is free or slides on a plane; (3) is its solution there. Whether a medium acts is decided at q.
// T is the step's period (at order 2 the effective one), so media need set_time().
#pragma once

#include <cmath>
#include <limits>
#include <memory>
#include <utility>
#include <vector>

#include "models/geometric_algorithm.hpp"
#include "models/obstacle.hpp"

namespace proxarm::models {

struct Medium {
  double damping_Ns_per_m = 0.0;
  double force_N = 0.0;             // Coulomb
  std::unique_ptr<Obstacle> shape;  // acts where its distance isn't positive; null: everywhere
};

template <int N>
class Media final : public GeometricAlgorithm<N> {
 public:
  Media(std::unique_ptr<GeometricAlgorithm<N>> rest, std::vector<Medium> media, double period_s = 1e-3)
      : rest_(std::move(rest)), media_(std::move(media)), T_(period_s) {}

  Vec<N> operator()(double K, const Vec<N>& p, const Vec<N>& q) noexcept override {
    double c = 0.0, F = 0.0;
    for (const Medium& medium : media_) {
      if (medium.shape != nullptr && medium.shape->distance(lift<N>(q)) > 0.0) continue;
      c += medium.damping_Ns_per_m / T_;
      F += medium.force_N;
    }
    const double kappa = K + c;
    const Vec<N> p_v = c > 0.0 ? Vec<N>(q + (K / kappa) * (p - q)) : p;
    return F > 0.0 ? coulomb(kappa, F, p_v, q) : (*rest_)(kappa, p_v, q);
  }

  void set_time(const StepTime& time) noexcept override {
    if (time.period_s > 0.0) T_ = time.period_s;
    rest_->set_time(time);
  }
  [[nodiscard]] std::span<const Contact<N>> contacts() const noexcept override { return rest_->contacts(); }
  [[nodiscard]] std::uint64_t unresolved_steps() const noexcept override { return rest_->unresolved_steps(); }
  [[nodiscard]] bool squeezed() const noexcept override { return rest_->squeezed(); }

 private:
  Vec<N> coulomb(double kappa, double F, const Vec<N>& p, const Vec<N>& q) noexcept {
    const Vec<N> d = q - p;
    const auto at = [&](double tau) { return (*rest_)(kappa / (1.0 - tau), Vec<N>(p + tau * d), q); };
    const auto excess = [&](double tau, const Vec<N>& r) { return kappa * tau / (1.0 - tau) * (r - q).norm() - F; };
    const double size = d.norm();
    // (3), second case: where nothing else touches, however near the rest is.
    const double share = (kappa * size - F) / (kappa * size);  // of the way to p; NaN where there is no way
    if (share > 0.0) {
      const Vec<N> aim = q - share * d;
      const Vec<N> free = (*rest_)(kappa / share, aim, q);
      if (free == aim) return free;
    }
    // Next to rest (τ → 1) the way is short, the world flat, and r(τ) = q + (1 − τ) R.
    const Vec<N> held = at(held_at_);
    const Vec<N> R = (held - q) / (1.0 - held_at_);
    const double pull = kappa * R.norm();
    double low = 0.0, high = held_at_, e_low = -F, e_high = excess(held_at_, held);
    double tau = std::min(F / pull, held_at_);
    // (3), first case; unless something that moves has come onto the proxy.
    const bool rests = !(pull > F) || (!(kappa * size > F) && !(R.norm() > 2.0 * size));
    if (rests || F >= held_at_ * pull) {
      const Vec<N> straight = rests ? q : Vec<N>(q + (1.0 - F / pull) * R);
      if (is_place(kappa, straight, q)) {
        at(held_at_);  // its contacts are this step's
        return straight;
      }
      // q lies behind a surface, as the reference of order 2 may, or the surface is too curved to be flat that near:
      // there r(τ) does not end in q, and what the medium does grows without bound.
      while (e_high < 0.0 && 1.0 - high > 1e-15) {
        low = high;
        e_low = e_high;
        high = 1.0 - 0.1 * (1.0 - high);
        e_high = excess(high, at(high));
      }
      tau = 0.5 * (low + high);
    }

    Vec<N> r = held;
    for (int k = 0, side = 0; k < 100; ++k) {
      if (!(tau > low && tau < high)) tau = 0.5 * (low + high);
      if (!(tau > low && tau < high)) break;
      r = at(tau);
      const double e = excess(tau, r);
      if (std::abs(e) <= close_enough_ * F) break;
      if (e < 0.0) {
        low = tau;
        e_low = e;
        if (side == -1) e_high *= 0.5;
        side = -1;
      } else {
        high = tau;
        e_high = e;
        if (side == 1) e_low *= 0.5;
        side = 1;
      }
      tau = k % 8 == 7 ? 0.5 * (low + high) : (low * e_high - high * e_low) / (e_high - e_low);
    }
    return r;
  }

  // Whether the rest of the world leaves a proxy from q at r, within the rounding of r; held so stiffly there that no
  // elastic layer moves it.
  bool is_place(double kappa, const Vec<N>& r, const Vec<N>& q) noexcept {
    constexpr double u = 0.5 * std::numeric_limits<double>::epsilon();
    return ((*rest_)(1e15 * kappa, r, q) - r).norm() <= 16.0 * u * (r.template lpNorm<1>() + q.template lpNorm<1>());
  }

  // Where rest is looked at from: a hundredth of the way to p, far above rounding.
  static constexpr double held_at_ = 0.99;
  static constexpr double close_enough_ = 1e-14;

  std::unique_ptr<GeometricAlgorithm<N>> rest_;
  std::vector<Medium> media_;
  double T_;
};

}  // namespace proxarm::models
