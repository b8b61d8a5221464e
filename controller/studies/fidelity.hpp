// Measures what a hand feels at the handle of the simulated arm from 0.1 to 30 Hz: the impedance F/v in free motion and
// against a wall, and τ/ω for a tool that turns.
//
// The hand's intended motion is a sum of sines. Its force on the handle and the tool's true position are sampled once a
// cycle over whole periods of all sines, so one Fourier coefficient per sine is exact. In free motion
//   F/a = M_apparent(f) is complex: its real part is the felt mass, its imaginary part −B/ω;
// apparent_mass_error is |F/a − M|/M. An arm feels different in different directions, so free motion is measured along
// x, y and z of W, and the worst one counts. Against a wall, along x, F/x is the felt stiffness. Both together span the
// impedances that can be rendered at a frequency (the Z-width). For rotation, torque, turn and inertia replace force,
// position and mass. The caller provides the arm.
#pragma once

#include <functional>
#include <string>
#include <utility>

#include "controller/studies/common/study.hpp"
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
  bool wall = false;             // 0.2 m in front; the hand leans on it
  bool looks_ahead = false;      // --lookahead auto
  bool torque = false;           // the gears' torques are measured and used to damp them
  double settling_s = 2.0;       // before the first returned sample
  double duration_s = 10.0;      // of the returned samples
  std::vector<ArmSine> sines{};  // of the hand's intended motion
  Eigen::Index axis = 0;         // of W, along which the hand moves or about which it turns: 0 to 2

  [[nodiscard]] bool turns() const noexcept { return inertia_kg_m2 > 0.0; }
};

struct ArmSample {
  models::Vec3 hand_force_N = models::Vec3::Zero(), tool_m = models::Vec3::Zero();
  models::Vec3 hand_torque_Nm = models::Vec3::Zero(), turn_rad = models::Vec3::Zero();  // since the first sample
};

// One sample per cycle; fewer if a fault ended the session.
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
