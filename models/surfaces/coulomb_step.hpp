// One step in a medium with Coulomb friction of force F, beside any 𝒢' that renders the rest of the world.
//
// The step is derived as follows:
// 1. The medium adds −F (r − q)/‖r − q‖ (16) to ℳ.
// 2. For a moving proxy, the medium equals a viscous medium (media.hpp) whose b/T is the unknown λ = F/‖r − q‖.
// 3. With τ = λ/(κ + λ), 0 ≤ τ < 1, the step and the condition for τ are
//      r(τ) = 𝒢'(κ/(1 − τ), p + τ (q − p), q),   κ τ/(1 − τ) ‖r(τ) − q‖ = F.
// 4. If 𝒢' is free or slides on a plane, the left side of the condition is linear in τ, and (3) is the solution.
// 5. The proxy sticks if κ ‖R‖ ≤ F, where R is the limit of (r(τ) − q)/(1 − τ) for τ → 1, found by extrapolation.
// 6. Otherwise the code solves the condition for τ: by the secant method for short slips, and by false position (the
//    Illinois variant) for longer slips.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>

#include "models/geometry/geometric_algorithm.hpp"

namespace proxarm::models {

template <int N>
class CoulombStep {
 public:
  CoulombStep(GeometricAlgorithm<N>& rest, double kappa, double force_N, const Vec<N>& p, const Vec<N>& q) noexcept
      : rest_(rest), kappa_(kappa), F_(force_N), p_(p), q_(q), d_(q - p), size_(d_.norm()) {}

  // Returns r; rest.contacts() are then the contacts at r. `found` becomes false if no τ satisfies the condition. The
  // medium's force then differs from F, and r is the sample at which the search for τ ended.
  Vec<N> solve(bool& found) noexcept {
    found = true;
    if (Vec<N> free; goes_free(0, 0, free)) return free;
    Sample low{0.0, -F_, q_}, high = at(held_at);
    Vec<N> R = (high.r - q_) / (1.0 - held_at);
    if (!(kappa_ * R.norm() > 2.0 * F_)) {
      const bool place = q_is_place();
      const bool flat = !place || extrapolate(R, high);
      const double pull = kappa_ * R.norm();
      if (place && (!(pull > F_) || !(kappa_ * size_ > F_))) {  // (3), first case
        if (!flat) touch_at_rest();
        return q_;
      }
      if (place && F_ >= high.tau * pull) {
        Vec<N> r;
        if (slip(F_ / pull, pull, r)) return r;
      }
      // The proxy can't rest at q: q is behind a surface (possible at order 2), or an object carries the proxy away.
      // Then r(τ) doesn't end in q for τ → 1, so the medium's force grows without bound, and a sample with more than F
      // exists.
      while (high.excess < 0.0 && 1.0 - high.tau > 1e-15) {
        low = high;
        high = at(1.0 - 0.1 * (1.0 - high.tau));
      }
    }
    found = search(low, high) || goes_free(1, 8, last_.r) || search_each_answer();
    return last_.r;
  }

 private:
  struct Sample {
    double tau = 0.0, excess = 0.0;  // excess: the medium's force at τ minus F, in N
    Vec<N> r;
  };

  Sample at(double tau) noexcept {
    // Starts from p or q, whichever is nearer, because the result then has the smaller rounding error.
    const Vec<N> aim = tau < 0.5 ? Vec<N>(p_ + tau * d_) : Vec<N>(q_ - (1.0 - tau) * d_);
    Sample sample{tau, 0.0, rest_(kappa_ / (1.0 - tau), aim, q_)};
    sample.excess = kappa_ * tau / (1.0 - tau) * (sample.r - q_).norm() - F_;
    return sample;
  }

  // Returns the error of the medium's force (N) that the rounding of r and of p + τ (q − p) can cause.
  [[nodiscard]] double rounding_N(const Vec<N>& r) const noexcept {
    const double places = 16.0 * u * (r.template lpNorm<1>() + q_.template lpNorm<1>());
    return F_ * places / (r - q_).norm() + kappa_ * (places + 16.0 * u * p_.template lpNorm<1>());
  }

  // Tries (3), second case: the proxy ends without contact. Attempt 0 uses the exact end point of the motion. Attempts
  // 1 to 8 use points some units in the last place beside the end point. They are necessary if p is beyond the middle
  // of a ball: 𝒢' may then find a point blocked although the neighbouring point is free.
  bool goes_free(int first, int last, Vec<N>& r) noexcept {
    const double share = (kappa_ * size_ - F_) / (kappa_ * size_);  // fraction of the path from q to p; NaN for p = q
    if (!(share > 0.0)) return false;
    for (int k = first; k <= last; ++k) {
      const int units = k % 2 == 0 ? -2 * k : 2 * (k + 1);
      const double off = u * units;
      const Vec<N> aim = q_ - share * (1.0 + off) * d_;
      r = rest_(kappa_ / share, aim, q_);
      if (r == aim) return true;
    }
    return false;
  }

  // Whether a proxy at q stays at q in the rest of the world, within the rounding of q. The stiffness is huge, so that
  // elastic layers don't move the proxy.
  bool q_is_place() noexcept {
    return (rest_(1e15 * kappa_, q_, q_) - q_).norm() <= 32.0 * u * q_.template lpNorm<1>();
  }

  // Extrapolates R to 1 − τ = 0 by Neville's scheme. Near rest (τ → 1) the slip is so short that the world is flat, and
  // r(τ) = q + (1 − τ) R. Each sample has a quarter of the last sample's 1 − τ, until R changes by no more than the
  // rounding of r. `high` becomes the last sample. Returns true if the world is flat from the first sample on.
  bool extrapolate(Vec<N>& R, Sample& high) noexcept {
    constexpr int most = 14;
    // row[d] is the value at 1 − τ = 0 of the polynomial of degree d through the last samples.
    std::array<Vec<N>, most> row;
    row[0] = R;
    Sample sample = high;
    double least = std::numeric_limits<double>::infinity();
    for (int k = 1; k < most; ++k) {
      sample = at(1.0 - 0.25 * (1.0 - sample.tau));
      const double left = 1.0 - sample.tau;
      const double rounding = 8.0 * u * (sample.r.template lpNorm<1>() + q_.template lpNorm<1>()) / left;
      const Vec<N> last = row[k - 1];
      Vec<N> previous = row[0];
      row[0] = (sample.r - q_) / left;
      if (k == 1 && (row[0] - previous).norm() <= rounding) return true;
      double ratio = 4.0;
      for (int degree = 1; degree <= k; ++degree, ratio *= 4.0) {
        const Vec<N> higher = row[degree - 1] + (row[degree - 1] - previous) / (ratio - 1.0);
        previous = row[degree];
        row[degree] = higher;
      }
      const double change = (row[k] - last).norm();
      if (change > least && least <= 100.0 * rounding) break;
      least = change;
      // If the last two values agree within rounding, the earlier value is taken, because the later value has four
      // times as much rounding error.
      R = change <= 0.5 * rounding ? last : row[k];
      high = sample;
      if (change <= rounding) break;
    }
    return false;
  }

  // Tries a slip so short that r(τ) ≈ q + (1 − τ) R. Starts at the τ at which this approximation gives F, and goes on
  // by the secant method. Returns false if the method doesn't converge.
  bool slip(double tau, double pull, Vec<N>& r) noexcept {
    Sample sample = at(tau);
    double slope = pull;
    for (int k = 0; k < 10 && std::abs(sample.excess) > rounding_N(sample.r); ++k) {
      const double next = sample.tau - sample.excess / slope;
      if (!(next > 0.0 && next < 1.0) || next == sample.tau) return false;
      const Sample before = sample;
      sample = at(next);
      slope = (sample.excess - before.excess) / (sample.tau - before.tau);
    }
    r = sample.r;
    if (rest_.contacts().empty()) touch_at_rest();
    return std::abs(sample.excess) <= rounding_N(sample.r);
  }

  // Evaluates 𝒢' once more, so that rest.contacts() are the contacts at q. The evaluated sample is as near to q as
  // rounding allows. If it has no contacts, the sample at τ = held_at is evaluated.
  void touch_at_rest() noexcept {
    at(1.0 - std::min(1e6 * u * (p_.template lpNorm<1>() + q_.template lpNorm<1>()) / size_, 1.0 - held_at));
    if (rest_.contacts().empty()) at(held_at);
  }

  // Searches by false position (the Illinois variant), with a bisection every eighth step. Precondition: low.excess < 0
  // < high.excess.
  bool search(Sample low, Sample high) noexcept {
    double e_low = low.excess, e_high = high.excess;
    double tau = F_ / (kappa_ * size_);
    for (int k = 0, side = 0; k < 100; ++k) {
      if (!(tau > low.tau && tau < high.tau)) tau = 0.5 * (low.tau + high.tau);
      if (!(tau > low.tau && tau < high.tau)) break;
      last_ = at(tau);
      if (std::abs(last_.excess) <= close_enough * F_) return true;
      const int now = last_.excess < 0.0 ? -1 : 1;
      (now < 0 ? low : high) = last_;
      (now < 0 ? e_low : e_high) = last_.excess;
      if (side == now) (now < 0 ? e_high : e_low) *= 0.5;
      side = now;
      tau = k % 8 == 7 ? 0.5 * (low.tau + high.tau) : (low.tau * e_high - high.tau * e_low) / (e_high - e_low);
    }
    return std::abs(last_.excess) <= rounding_N(last_.r);
  }

  // One solution of 𝒢', if 𝒢' has several (for a push straight through a ball's middle, or at two faces of a box). r(τ)
  // then jumps between the solutions, and the τ that gives F may lie at a jump. Each solution by itself is smooth in τ.
  // Its contacts identify it.
  struct Answer {
    std::uint64_t touches = 0;
    Sample low{.tau = -1.0, .excess = 0.0, .r = {}}, high{.tau = 2.0, .excess = 0.0, .r = {}};

    void narrow(const Sample& sample) noexcept {
      if (sample.excess < 0.0 && sample.tau > low.tau) low = sample;
      if (sample.excess >= 0.0 && sample.tau < high.tau) high = sample;
    }
  };
  using Answers = std::array<Answer, 6>;

  [[nodiscard]] std::uint64_t touches() const noexcept {
    std::uint64_t sum = 1;
    for (const Contact<N>& contact : rest_.contacts()) {
      const auto object = static_cast<std::uint32_t>(contact.object);
      const auto feature = static_cast<std::uint32_t>(contact.feature);
      sum += ((std::uint64_t{object} << 33U) ^ (std::uint64_t{feature} << 1U) ^ (contact.slips ? 1U : 0U)) *
             0x9E3779B97F4A7C15ULL;
    }
    return sum;
  }

  bool search_each_answer() noexcept {
    const double nearest = last_.tau;
    Answers answers;
    std::size_t count = 0;
    for (int k = -24; k <= 24; ++k) {
      const double ratio = std::pow(10.0, 0.25 * k);  // τ/(1 − τ)
      const Sample sample = at(ratio / (1.0 + ratio));
      const std::uint64_t name = touches();
      std::size_t i = 0;
      while (i < count && answers[i].touches != name) ++i;
      if (i == answers.size()) continue;
      if (i == count) answers[count++].touches = name;
      answers[i].narrow(sample);
    }
    for (std::size_t i = 0; i < count; ++i) {
      if (search_within(answers[i])) return true;
    }
    last_ = at(nearest);
    return false;
  }

  // Uses the secant method while samples belong to this solution. Otherwise samples points that the golden ratio
  // spreads evenly over the bracket.
  bool search_within(Answer& answer) noexcept {
    constexpr double golden = 0.6180339887498949;
    bool same = true;
    for (int k = 1; k <= 80; ++k) {
      const Sample &low = answer.low, &high = answer.high;
      if (low.tau < 0.0 || high.tau > 1.0 || low.tau >= high.tau) return false;
      const double secant = low.excess / (low.excess - high.excess), anywhere = golden * k - std::floor(golden * k);
      last_ = at(low.tau + (same && k % 4 != 0 ? secant : anywhere) * (high.tau - low.tau));
      same = touches() == answer.touches;
      if (!same) continue;
      if (std::abs(last_.excess) <= std::max(close_enough * F_, rounding_N(last_.r))) return true;
      answer.narrow(last_);
    }
    return false;
  }

  // τ of the first sample near rest, whose aim is at 4 % of the path from q to p. This is near enough to q that most
  // worlds are flat, and far above rounding.
  static constexpr double held_at = 0.96;
  static constexpr double close_enough = 1e-14;
  static constexpr double u = 0.5 * std::numeric_limits<double>::epsilon();

  GeometricAlgorithm<N>& rest_;
  double kappa_, F_;
  const Vec<N>&p_, &q_;
  Vec<N> d_;
  double size_;
  Sample last_{};  // the last sample that a search evaluated
};

}  // namespace proxarm::models
