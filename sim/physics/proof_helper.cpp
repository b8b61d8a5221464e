#include "sim/physics/proof_helper.hpp"

namespace proxarm::sim {

using models::Vec3;

Clamp leaning(const Vec3& from_W, const Vec3& along_W) noexcept {
  constexpr double depth_m = 0.02, stiffness_N_per_m = 750.0;
  return {from_W + depth_m * along_W, -along_W, stiffness_N_per_m};
}

ProofHelper::ProofHelper(Plant& plant) : plant_(plant), demand_counts_(plant.axis_count(), 0) {}

void ProofHelper::on_time(std::int64_t time_ns) noexcept {
  const bool moved = was_moved();
  if (!enabled()) pushes_ = 0;
  if (moved || !enabled()) return let_go(time_ns);
  const std::int64_t so_far_ns = time_ns - since_ns_;
  if (leans_ && so_far_ns >= lean_ns) {
    let_go(time_ns);
  } else if (!leans_ && so_far_ns >= wait_ns) {
    lean(time_ns);
  }
}

bool ProofHelper::enabled() const noexcept {
  for (std::size_t axis = 0; axis < plant_.axis_count(); ++axis) {
    if (!plant_.servo(axis).powered()) return false;
  }
  return true;
}

// True if a drive's setpoint has changed since the last call. Encoder positions aren't used, because a standing arm
// yields to a push.
bool ProofHelper::was_moved() noexcept {
  bool moved = false;
  for (std::size_t axis = 0; axis < demand_counts_.size(); ++axis) {
    const std::int32_t demand = plant_.servo(axis).demand_counts();
    moved = moved || demand != demand_counts_[axis];
    demand_counts_[axis] = demand;
  }
  return moved;
}

void ProofHelper::lean(std::int64_t time_ns) noexcept {
  const Vec3 along_W = pushes_ == 1 ? Vec3::UnitY() : Vec3::UnitX();
  plant_.set_clamp(leaning(plant_.tool().X_WT.translation(), along_W));
  leans_ = true;
  ++pushes_;
  since_ns_ = time_ns;
}

void ProofHelper::let_go(std::int64_t time_ns) noexcept {
  if (leans_) plant_.set_clamp({});
  leans_ = false;
  since_ns_ = time_ns;
}

}  // namespace proxarm::sim
