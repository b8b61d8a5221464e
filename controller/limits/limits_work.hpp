// Detects limits that work against the hand.
//
// The hand's force, the world's force and the limits' force f_l change the proxy's momentum. A limit that holds the
// proxy back takes energy from it. A limit gives the proxy energy if it carries the proxy on while the arm brakes:
// joints can't stop at once, and a hand that pulls back feels their motion. Limits that give more energy than braking
// explains work against the hand.
//
// A push is the time since the limits last took back all energy that they had given, and w = Σ f_l·Δq over the push is
// the energy that they have given. Braking explains
//   w ≤ max(t F |v| + ½M v²) + w₀,   the maximum over the push
// F: size of the hand's force plus size of the world's force. t: longest time in which the arm comes to rest; limits
// that only brake the arm give half of t F |v|. w₀: 50 mJ, the work of a hand of 10 N over half a centimetre. If w is
// larger, the arm moves against the hand. Nothing allocates or throws.
#pragma once

#include "models/base/archive_fields.hpp"
#include "models/base/state_archive.hpp"

namespace proxarm::controller {

class LimitsWork {
 public:
  struct Step {
    double work_J = 0.0;     // f_l·Δq, rotation included
    double power_W = 0.0;    // F |v|, rotation included
    double kinetic_J = 0.0;  // ½M v², the proxy's kinetic energy
  };

  void set_braking(double braking_s) noexcept { braking_s_ = braking_s; }  // t
  void start() noexcept { state_ = {}; }
  void step(const Step& step) noexcept;

  // The energy that the limits have given since the start; negative: they have taken energy.
  [[nodiscard]] double total_J() const noexcept { return state_.total_J; }
  [[nodiscard]] double push_J() const noexcept { return state_.push_J; }  // w
  [[nodiscard]] double allowed_J() const noexcept { return state_.explained_J + least_J; }
  [[nodiscard]] bool against_the_hand() const noexcept { return push_J() > allowed_J(); }
  void archive(fieldbus::StateArchive& state) noexcept { archive_fields(state, state_); }

 private:
  static constexpr double least_J = 0.05;  // w₀
  struct State {
    double total_J = 0.0, push_J = 0.0, explained_J = 0.0;
  };

  double braking_s_ = 0.2;
  State state_;
};

}  // namespace proxarm::controller
