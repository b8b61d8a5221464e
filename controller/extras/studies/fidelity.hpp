// Measures what a hand feels at the handle of the simulated arm from 0.1 to 30 Hz: the impedance F/v in free motion and
// against a wall, and τ/ω with a tool that turns.
//
// The hand's intended motion is a sum of sines. The hand's force on the handle and the tool's true position are sampled
// once a cycle, over a time that is a whole number of periods of every sine. So one Fourier coefficient per sine is
// exact. In free motion
//   F/a = M_apparent(f) is complex: its real part is the felt mass, its imaginary part −B/ω;
// apparent_mass_error is |F/a − M|/M. An arm feels different in different directions, so free motion is measured along
// x, y and z of W, and the worst direction counts. Against a wall the motion is along x, and F/x is the felt stiffness.
// The felt mass and the felt stiffness span the impedances that can be rendered at a frequency (the Z-width). For
// rotation, torque, turn and inertia replace force, position and mass. The caller provides the function that runs the
// arm.
#pragma once

#include <functional>
#include <string>
#include <utility>

#include "controller/extras/studies/common/study.hpp"
#include "models/geometry/geometry.hpp"

namespace proxarm::studies {

struct ArmSine {
  double frequency_Hz = 1.0, amplitude = 0.0;  // amplitude in m, or in rad if the hand turns the tool
};

struct ArmSetup {
  std::string cell = "default";  // name in models/cells
  double mass_kg = 4.0;
  double inertia_kg_m2 = 0.0;  // 0: the orientation is held
  double period_s = 1e-3;
  double drive_factor = 1.0;     // factor on the drives' position bandwidth
  bool wall = false;             // a wall is 0.2 m in front, and the hand leans on it
  bool looks_ahead = false;      // --lookahead auto
  bool torque = false;           // the gears' torques are measured, and damp the gears
  double settling_s = 2.0;       // time before the first returned sample
  double duration_s = 10.0;      // time from the first to the last returned sample
  std::vector<ArmSine> sines{};  // of the hand's intended motion
  // The axis of W (0 to 2) along which the hand moves or about which it turns.
  Eigen::Index axis = 0;

  [[nodiscard]] bool turns() const noexcept { return inertia_kg_m2 > 0.0; }
};

struct ArmSample {
  models::Vec3 hand_force_N = models::Vec3::Zero(), tool_m = models::Vec3::Zero();
  // turn_rad is the rotation since the first sample.
  models::Vec3 hand_torque_Nm = models::Vec3::Zero(), turn_rad = models::Vec3::Zero();
};

// A function that runs the arm and returns one sample per cycle; fewer if a fault ended the session.
using ArmRun = std::function<std::vector<ArmSample>(const ArmSetup&)>;

class Fidelity final : public Study {
 public:
  explicit Fidelity(ArmRun arm) : arm_(std::move(arm)) {}

  std::string name() const override { return "fidelity"; }
  std::vector<Column> columns() const override;
  std::size_t jobs(const Options& options) const override;
  std::vector<Row> run(std::size_t job, const Options& options) const override;
  nlohmann::json headline(const Table& table, const Options& options) const override;
  std::vector<std::string> plot(const Table& table, const Options& options,
                                const std::filesystem::path& out) const override;
  std::string text(const nlohmann::json& headline) const override;

 private:
  ArmRun arm_;
};

}  // namespace proxarm::studies
