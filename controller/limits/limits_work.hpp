// Whether the arm's limits work against the hand.
//
// The proxy's momentum changes by the hand's force, by that of the world, and by what limits add, f_l. A limit may hold
// the proxy back, which takes energy. It may also carry it on for as long as the arm brakes: joints can't stop at once,
// and a hand that pulls back feels that. Nothing else may give energy to the tool. With w = Σ f_l·Δq over a push, that
// is since f_l last took back all that it had given,
//   w ≤ t max(F |v|) + max ½M v² + w₀
// over that push. F: hand's and world's force together; t: the longest time in which the arm comes to rest; a push that
// only brakes gives half of F|v|t. w₀ is 50 mJ, which a hand of 10 N feels as half a centimetre. What gives more is an
// arm that goes against the hand. Neither allocates nor throws.
#pragma once

#include "models/base/archive_fields.hpp"
#include "models/base/state_archive.hpp"

namespace proxarm::controller {

class LimitsWork {
 public:
  struct Step {
    double work_J = 0.0;     // f_l·Δq, and that of rotation
    double power_W = 0.0;    // F |v|, and that of rotation
    double kinetic_J = 0.0;  // of the proxy
  };

  void set_braking(double braking_s) noexcept { braking_s_ = braking_s; }  // t
  void start() noexcept { state_ = {}; }
  void step(const Step& step) noexcept;

  [[nodiscard]] double total_J() const noexcept { return state_.total_J; }  // since the start; negative: taken
  [[nodiscard]] double push_J() const noexcept { return state_.push_J; }    // w
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
