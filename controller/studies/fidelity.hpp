// What a hand feels at the handle of the simulated arm, by frequency: the impedance F/v in free motion and against a
// wall, and of a tool that turns τ/ω, from 0.1 to 30 Hz.
//
// The hand's intention is a sum of sines; force of the hand on the handle and the tool's true position are sampled once
// a cycle, over whole periods of all sines, so that one Fourier coefficient per sine is exact. In free motion
//   F/a = M_apparent(f) complex: its real part is the mass that is felt, its imaginary part −B/ω;
// apparent_mass_error is |F/a − M|/M. An arm doesn't feel alike in all directions, so free motion is measured along x,
// y and z of W, a session each, and what counts is the worst of them. Against a wall, along x, F/x is the stiffness
// that is felt. The two span the impedances that can be rendered at this frequency (the Z-width). Turning it is the
// same of torque, turn and inertia.
//
// The caller provides the arm: the studies know no bus and no drive.
#pragma once

#include <functional>
#include <string>
#include <utility>

#include "controller/studies/common/study.hpp"
#include "models/geometry/geometry.hpp"

namespace proxarm::studies {

struct ArmSine {
  double frequency_Hz = 1.0, amplitude = 0.0;  // m, or where the hand turns rad
};

// A session as the fidelity study wants it.
struct ArmSetup {
  std::string cell = "default";  // of models/cells
  double mass_kg = 4.0;
  double inertia_kg_m2 = 0.0;  // 0: the orientation is held
  double period_s = 1e-3;
  double drive_factor = 1.0;     // on the drives' position bandwidth
  bool wall = false;             // 0.2 m in front, and the hand leans on it
  bool looks_ahead = false;      // --lookahead auto
  bool torque = false;           // its gears' torque is measured, and they are damped by it
  double settling_s = 2.0;       // before what is returned
  double duration_s = 10.0;      // of what is returned
  std::vector<ArmSine> sines{};  // of the hand's intention
  Eigen::Index axis = 0;         // of W, along which it moves or about which it turns: 0 to 2

  [[nodiscard]] bool turns() const noexcept { return inertia_kg_m2 > 0.0; }
};

struct ArmSample {
  models::Vec3 hand_force_N = models::Vec3::Zero(), tool_m = models::Vec3::Zero();
  models::Vec3 hand_torque_Nm = models::Vec3::Zero(), turn_rad = models::Vec3::Zero();  // since the first sample
};

// One sample per cycle; fewer than asked for if a fault ended the session.
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
