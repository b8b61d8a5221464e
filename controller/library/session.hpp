// A session of the simulated arm in somebody's own program: the closed loop of `proxarm run`, in virtual time.
//
//   proxarm::Session session({.scene = "scenes/wall.yaml", .mass_kg = 4.0});
//   const proxarm::Summary summary = session.run([](const proxarm::CycleRecord& cycle) { … });
//
// It is assembled and checked as `proxarm run` does it, refuses what that refuses, with the same words, and moves the
// arm to the same setpoints, to the bit. World, hand, force sensor and drives can be one's own (docs/library.md).
// A real arm is run by the command line alone, which has its supervision, consent and clocks.
#pragma once

#include <array>
#include <atomic>
#include <exception>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "controller/library/simulated_loop.hpp"
#include "controller/record/cycle_record.hpp"
#include "controller/report/summary.hpp"
#include "models/base/setup_error.hpp"
#include "models/geometry/geometric_algorithm.hpp"
#include "sim/physics/plant.hpp"

namespace proxarm {

using controller::CycleRecord;
using controller::Summary;
using description::SetupError;
using models::GeometricAlgorithm;
using models::Vec3;

// What `proxarm run` has as options, in SI units, meant for designated initialisers. Files that aren't there by that
// name are looked for among those that come with proxarm; PROXARM_DATA says where these are, if they aren't where they
// were installed.
struct SessionOptions {
  std::filesystem::path cell{};        // empty: the default cell
  std::filesystem::path scene{};       // empty: the cell's
  std::filesystem::path hand{};        // empty: the cell's; by its grip and its mass stability is judged
  std::optional<double> mass_kg{};     // that the hand feels; unset: the cell's
  std::optional<double> timestep_s{};  // unset: the cell's
  double duration_s = 10.0;            // of rendering
  double damping_Ns_per_m = 0.0;       // against the world; 0: the cell's
  double spring_N_per_m = 0.0;         // to the start position
  int order = 1;                       // 1: (26); 2: its second-order sibling
  std::string lookahead = "off";       // "auto", "off" or a time, such as "8ms"
  bool force_unstable = false;
};

class Session {
 public:
  // Throws SetupError. Opens and starts nothing.
  explicit Session(const SessionOptions& options = {});
  ~Session();
  Session(Session&&) noexcept;
  Session& operator=(Session&&) noexcept;

  // ---- before run(); each returns the session

  // In the place of the scene: 𝒢 in W. It must outlive the session. Not with a scene or a lookahead, nor for an arm
  // whose tool moves on a line or in a plane alone.
  Session& set_world(GeometricAlgorithm<3>& world);
  // In the place of the hand's motion and grip; of its file, its mass and, for the check of stability, its grip remain.
  // In N, on the handle, in W. What it throws ends the session, and comes out of run().
  Session& set_hand(sim::HandForce force);
  // In the place of the cell's sensor, and of the drive of one of its joints (simulated_loop.hpp). zero_S_N is what the
  // sensor reads without a load: one that reads something else at the start, beside the tool's weight, is a fault.
  Session& set_sensor(controller::MakeSensor make, const std::array<double, 3>& zero_S_N = {});
  Session& set_drive(const std::string& joint, controller::MakeDrive make);

  // Runs a session from power on to power off. `each` sees every cycle's record in order, whatever the phase, with the
  // simulation's truth and the distances in it. A fault is no exception: it stands in the summary. May be called again,
  // for a session like the first one if the parts of one's own are as they were.
  Summary run(const std::function<void(const CycleRecord&)>& each = {});

  // Asks the session that runs to stop, from within a callback or from another thread.
  void stop() noexcept;

  [[nodiscard]] const command_line::PreparedSession& prepared() const noexcept;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

// The names of a record's axes, in its order.
std::vector<std::string> axis_names(const Session& session);

// For people, and as one JSON object, as the command line prints them.
using controller::summary_json;
using controller::summary_text;

}  // namespace proxarm
