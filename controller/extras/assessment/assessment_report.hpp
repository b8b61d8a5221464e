// The report of an assessment, for people and for programs.
#pragma once

#include <string>

#include "controller/extras/assessment/assessment.hpp"

namespace proxarm::assessment {

// What was assessed. These are facts that only the command knows.
struct Subject {
  std::string cell, hand;                                                      // names
  double stiffness_N_per_m = 0.0, damping_Ns_per_m = 0.0, hand_mass_kg = 0.0;  // the hand's values
  double felt_mass_kg = 0.0, period_s = 0.0, max_tool_speed_m_per_s = 0.0;
  // Number of drives whose cell doesn't describe their brakes.
  int assumed_brakes = 0;
  double assumed_brake_delay_s = 0.0, assumed_brake_share = 0.0;  // the share is a share of max_torque_Nm
};

// Returns the names of the regions whose thresholds are exceeded by a body with the region's stiffness, such as "hands
// and fingers".
std::vector<std::string> exceeded(const Assessment& assessment, const Thresholds& thresholds);

std::string text(const Subject& subject, const Assessment& assessment, const Thresholds& thresholds);
std::string json(const Subject& subject, const Assessment& assessment, const Thresholds& thresholds);

}  // namespace proxarm::assessment
