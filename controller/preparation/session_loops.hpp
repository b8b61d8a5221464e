// The models of a prepared session's closed loops: the hand, the arm in the poses that it is led to, the tool's
// rotation.
#pragma once

#include <memory>
#include <optional>
#include <vector>

#include "controller/preparation/prepared_session.hpp"
#include "controller/stability/pose_loop.hpp"
#include "controller/stability/stability.hpp"

namespace proxarm::controller {

// Returns the hand for the stability check, with that one of the hand's grips which needs the largest mass in this
// loop. That isn't always the stiffest grip: a grip that is nearly as stiff but has little damping may need more mass.
// If no mass is stable with some grip, returns the hand with that grip.
HandModel hand_model(const PreparedSession& session, LoopModel loop);
// Returns the hand for the stability check in the session's own loop.
HandModel hand_model(const PreparedSession& session);

// Return the hand and the loop for the tool's rotation alone. Their stiffness is in Nm/rad, their damping in Nms/rad,
// and their mass is an inertia in kg m².
HandModel turning_hand_model(const PreparedSession& session);
LoopModel turning_loop(const PreparedSession& session);
// Returns the model of the loop of translation and rotation for pose_loop_at(): in free motion, and with one of the
// tool's extreme points in contact. Returns nullopt if the hand doesn't turn the tool.
std::optional<PoseLoopModel> turned_model(const PreparedSession& session);
// Returns the oscillation that decays most slowly in the loop of turned_model() in the start pose. Returns nullopt if
// the hand doesn't turn the tool, or if the loop isn't stable.
std::optional<Swing> slowest_swing(const PreparedSession& session);
// Returns the inertia that the hand feels, including that of the load behind the sensor. Precondition: the orientation
// is free.
double felt_inertia_kg_m2(const PreparedSession& session);

// Returns the poses of the arm along the hand's intended motion, the start pose first. Objects of the scene are
// ignored.
std::vector<models::JointVector> led_poses(const PreparedSession& session);
// Returns the session's loop in all poses of led_poses().
LoopModel led_loop(const PreparedSession& session);

// Returns the longest lookahead horizon that is stable with margins, for the session's mass and loop.
double longest_horizon_s(const PreparedSession& session);

// Returns the loop of turned_model() in the start pose. Returns nullopt if the hand doesn't turn the tool.
std::optional<PoseLoop> pose_loop_at_start(const PreparedSession& session);

// Returns the elastic arm in the start poses of which the loop's model is made.
std::shared_ptr<const std::vector<ElasticArm>> arms_at_start(const PreparedSession& session);
// Returns the ways in which the tool may touch the scene's layers: it slides on each combination of layers, and on a
// single layer with friction it may also stick. Returns null if the scene has no layers.
std::shared_ptr<const std::vector<LayerTouch>> layers_of(const scenes::Scene& scene);

// Returns the loop's delay beyond the one period that every sampled loop has. A position setpoint is reached one period
// after it is latched. A torque is held for a period, which delays it by half a period on average.
double loop_delay_s(const PreparedSession& session);
// Returns the delay from the proxy's step to the motion of the links: the setpoint is latched at the next SYNC and
// reached one period later, and the setpoint filter adds its delay. Returns 0 for the impedance type, in which no
// setpoint of a position is sent.
double motion_delay_s(const PreparedSession& session);

// Returns the delay from a force on the handle to the arm's motion, in s.
double total_delay_s(const PreparedSession& session);

}  // namespace proxarm::controller
