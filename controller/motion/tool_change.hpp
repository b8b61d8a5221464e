// Corrects mass and centre of mass of the tool behind the sensor during a session.
//
// Precondition: this tool was mounted during the tare, but the cell gave wrong figures for it. The bias, learnt with
// gravity g₀ (in S), then contains a wrong weight. m₀, c₀: mass and centre of mass so far; m, c: the corrected ones.
// The correction is
//   bias   += −(m − m₀) g₀                         so the bias is the one that a tare with m, c would have found
//   hand_S += (m − m₀) d                           the hand's force
//   torque about S += (m c − m₀ c₀) × d            the hand's torque
// d = g₀ − g is the change of gravity in S since the tare. If the sensor has the tare's orientation, the hand's wrench
// doesn't change. While the bias follows the reading of an empty handle at rest (Measurement::follow_bias), g₀ follows
// the gravity g of that time.
//
// The hand feels the tool's full mass, so the proxy's mass changes by m₀ − m at once, and the felt mass stays constant.
// The weight and the arm's model change evenly, within
//   max(1 s, |ΔF|/(2 N/s), |Δτ|/(0.2 Nm/s))
// so the force changes by at most 2 N/s, and no setpoint jumps.
//
// doubt() refuses figures that contradict the sensor, for one of two reasons:
//   1. The remembered zero: with the new figures the tare would differ from the remembered zero by more than the sensor
//      drifts, and by more than with the present figures.
//   2. The present reading: the change of the reading exceeds the tare's uncertainty, but the new reading is neither
//      within this uncertainty nor at most half of the present reading, and the figures don't halve the tare's
//      difference from the remembered zero. Even a wrong reading of 0.07 N, within the band of an empty handle, may
//      move the handle by 10 mm before it can be distinguished from a hand's force, and further with a load.
//
// Nothing allocates, locks or throws after construction.
#pragma once

#include <array>

#include "controller/handle/hand_force.hpp"
#include "models/arm/tool_inertia.hpp"
#include "models/base/archive_fields.hpp"
#include "models/description/cell.hpp"
#include "models/geometry/geometry.hpp"

namespace proxarm::controller {

[[nodiscard]] HeldTool held_tool(const description::ToolDescription& tool) noexcept;

// A reason to refuse figures of the tool: the sensor's readings contradict them.
struct ToolDoubt {
  enum class Why : std::uint8_t { none, zero, force, torque };
  Why why = Why::none;
  // With the new figures: the tare's difference from the remembered zero, or the reading about T. In N or Nm.
  double would_be = 0.0;
  double limit = 0.0;  // the largest accepted value of would_be

  // Returns an explanation without numbers; null for Why::none.
  [[nodiscard]] static const char* text(Why why) noexcept;
};

// Readings by which new figures are judged. All vectors are in S.
struct ToolEvidence {
  using Numbers = std::array<double, 17>;

  models::Wrench hand_S;                           // the hand's wrench about T, with the present figures
  models::Vec3 turned_S = models::Vec3::Zero();    // d, m/s²
  models::Vec3 learnt_S = models::Vec3::Zero();    // g₀, m/s²; zero: no tare yet
  models::Vec3 zero_off_S = models::Vec3::Zero();  // N: the tare less the remembered zero
  double zero_limit_N = 0.0;                       // limit of ‖zero_off_S‖; infinite: no zero is remembered

  double open_N = 0.0;  // uncertainty of the tare

  // Returns the change of the hand's wrench about T.
  [[nodiscard]] models::Wrench change(const HeldTool& from, const HeldTool& to) const noexcept;
  [[nodiscard]] ToolDoubt doubt(const HeldTool& from, const HeldTool& to) const noexcept;

  [[nodiscard]] Numbers numbers() const noexcept;
  [[nodiscard]] static ToolEvidence of(const Numbers& numbers) noexcept;
};

class ToolChange {
 public:
  explicit ToolChange(const description::ToolDescription& tool);

  // Starts the change to `wanted`. `change`: the change of the hand's wrench about T.
  void take(const HeldTool& wanted, const models::Wrench& change) noexcept;
  // One period. Returns true if the present figures have changed.
  bool step(double period_s) noexcept;
  [[nodiscard]] const HeldTool& wanted() const noexcept { return state_.wanted; }
  [[nodiscard]] const HeldTool& present() const noexcept { return state_.present; }
  // Returns the inertia about T with these figures. The inertia about the centre of mass remains the cell's.
  [[nodiscard]] models::ToolInertia about_T(const HeldTool& figures) noexcept;

  void archive(fieldbus::StateArchive& state) noexcept { archive_fields(state, state_); }

 private:
  struct State {
    HeldTool from, wanted, present;
    // share: the part of the change from `from` to `wanted` that is complete. fade_s: duration of the whole change.
    double share = 1.0, fade_s = 1.0;
  };

  description::ToolDescription tool_;
  State state_;
};

}  // namespace proxarm::controller
