// A session of the simulated arm in somebody's own program: the closed loop of `proxarm run`, in virtual time.
//
//   proxarm::Session session({{"scene", "scenes/wall.yaml"}, {"mass", 4.0}});
//   const proxarm::Summary summary = session.run([](const proxarm::CycleRecord& cycle) { … });
//
// It takes the options of `proxarm run` (options.hpp), is assembled and checked by the same code, refuses the same with
// the same words, and commands the same setpoints, to the bit. World, hand, force sensor and drives can be your own
// (docs/how_to/library.md). Only the command line runs a real arm, with its supervision, consent and clocks.
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
  // A file that doesn't exist is looked up among those that come with proxarm: where they were installed, or below
  // PROXARM_DATA. Throws SetupError. Opens and starts nothing.
  explicit Session(const SessionOptions& options = {});
  ~Session();
  Session(Session&&) noexcept;
  Session& operator=(Session&&) noexcept;

  // ---- before run(); each returns the session

  // In the place of the scene: 𝒢 in W; an OwnWorld also names its objects. It must outlive the session. Not with a
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
  // Sends a line as to the session's socket (docs/reference/supervision.md) and returns the answer: "hold", "resume",
  // "mass=3kg", "wall.friction=0.2", "status". A tab separates changes that are made together. Throws SetupError if the
  // session refuses, or if none runs.
  std::string ask(const std::string& line);

  // ---- any time

  // The warnings of `proxarm run`: values that are possible but hardly meant, a sentence each.
  [[nodiscard]] std::vector<std::string> surprises() const;
  // The names of the objects; records have their indices.
  [[nodiscard]] std::vector<std::string> objects() const;
  [[nodiscard]] const controller::PreparedSession& prepared() const noexcept;

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
