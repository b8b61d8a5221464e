// A session of the simulated arm in somebody's own program: the closed loop of `proxarm run`, in virtual time.
//
//   proxarm::Session session({{"scene", "scenes/wall.yaml"}, {"mass", 4.0}});
//   const proxarm::Summary summary = session.run([](const proxarm::CycleRecord& cycle) { … });
//
// It takes the options of `proxarm run` (options.hpp), is assembled and checked as that does it, refuses what that
// refuses, with the same words, and moves the arm to the same setpoints, to the bit. World, hand, force sensor and
// drives can be one's own (docs/library.md). A real arm is run by the command line alone, which has its supervision,
// consent and clocks.
#pragma once

#include <array>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "controller/library/options.hpp"
#include "controller/library/own_world.hpp"
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

class Session {
 public:
  // Files that aren't there by their name are looked for among those that come with proxarm; PROXARM_DATA says where
  // these are, if they aren't where they were installed. Throws SetupError. Opens and starts nothing.
  explicit Session(const SessionOptions& options = {});
  ~Session();
  Session(Session&&) noexcept;
  Session& operator=(Session&&) noexcept;

  // ---- before run(); each returns the session

  // In the place of the scene: 𝒢 in W; an OwnWorld says more of its contacts. It must outlive the session. Not with a
  // scene, a tool with a shape or a lookahead, nor for an arm whose tool moves on a line or in a plane alone.
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

  // ---- while it runs, from within a callback or from another thread

  // Asks it to stop.
  void stop() noexcept;
  // What its socket takes (docs/supervision.md), and the answer: "hold", "resume", "mass=3kg", "wall.friction=0.2",
  // "status". Several changes at once have a tab between two. Throws SetupError where the session refuses, or none
  // runs.
  std::string ask(const std::string& line);

  // ---- any time

  // What is possible but hardly meant, a sentence each: what `proxarm run` warns of.
  [[nodiscard]] std::vector<std::string> surprises() const;
  // Names of the objects that records have by their index.
  [[nodiscard]] std::vector<std::string> objects() const;
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
