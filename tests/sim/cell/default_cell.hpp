// What the tests of the simulated arm start from: the default cell, its sensor, and a hand that does nothing.
#pragma once

#include <cstdlib>
#include <filesystem>
#include <string>
#include <vector>

#include "models/description/cell.hpp"
#include "models/description/hand.hpp"
#include "models/description/sensor.hpp"
#include "tests/source_file.hpp"

namespace proxarm::sim {

inline description::Cell default_cell() { return description::load_cell(source_file("models/cells/default.yaml")); }

inline description::SensorDescription default_sensor() {
  return description::load_sensor(source_file("models/sensors/ati_net_can_oem.yaml"));
}

// The default cell without anything that takes energy.
inline description::Cell lossless_cell() {
  description::Cell cell = default_cell();
  for (auto& drive : cell.drives) {
    drive.simulation.coulomb_friction_Nm = 0.0;
    drive.simulation.viscous_friction_Nms_per_rad = 0.0;
    drive.simulation.gear_damping_Nms_per_rad = 0.0;
  }
  return cell;
}

// Lets go of the handle: no stiffness, no damping, no mass.
inline description::HandDescription no_hand() {
  description::HandDescription hand;
  hand.mass_kg = 0.0;
  hand.stiffness_N_per_m = 0.0;
  hand.damping_Ns_per_m = 0.0;
  return hand;
}

// How many times a random test repeats: the count at scale 1 times PROXARM_TEST_SCALE, at least once.
inline int scaled(int count) {
  const char* text = std::getenv("PROXARM_TEST_SCALE");
  const double scale = text ? std::atof(text) : 1.0;
  return count * scale < 1.0 ? 1 : static_cast<int>(count * scale);
}

}  // namespace proxarm::sim
