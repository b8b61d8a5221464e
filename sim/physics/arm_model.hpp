// Builds MuJoCo's model of the links from a cell's URDF, for ArmDynamics.
#pragma once

#include <mujoco/mujoco.h>

#include <memory>

#include "models/description/cell.hpp"

namespace proxarm::sim {

struct MujocoDelete {
  void operator()(mjModel* model) const noexcept { mj_deleteModel(model); }
  void operator()(mjData* data) const noexcept { mj_deleteData(data); }
};
using ModelPointer = std::unique_ptr<mjModel, MujocoDelete>;
using DataPointer = std::unique_ptr<mjData, MujocoDelete>;

// Returns the links of the URDF in the base frame, with the handle and the hand's point mass fixed to the sensor's
// link. The gravity vector is given in the base frame. The model has no shapes, because nothing collides here. Throws
// description::SetupError.
ModelPointer load_links(const description::Cell& cell, double hand_mass_kg, double hand_inertia_kg_m2 = 0.0);

}  // namespace proxarm::sim
