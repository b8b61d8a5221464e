#include "models/rigid_pairs/candidates.hpp"

#include <algorithm>

#include "models/rigid_features/near_faces.hpp"

namespace proxarm::models {
namespace {

constexpr std::size_t kMostLeaves = 4096;  // leaves of two meshes that are near each other

}  // namespace

const PressedPlaces::Place* PressedPlaces::of(std::uint16_t pair, std::uint8_t which) const noexcept {
  for (std::size_t k = 0; k < count; ++k) {
    if (places[k].pair == pair && places[k].which == which) return &places[k];
  }
  return nullptr;
}

Candidates::Candidates(const RigidSetup& setup) {
  const std::size_t met = setup.parts.size() * setup.first_moving;
  if (setup.mesh_tool || setup.mesh_objects) near_triangles.make_room(NearFaces::most_faces, met);
  if (setup.mesh_tool && setup.mesh_objects) near_leaves.make_room(kMostLeaves, met);
}

double Candidates::came_m(const RigidBodies& bodies, const ToolPose& q) const noexcept {
  double most = bodies.has_carrier() ? 0.0 : bodies.motion_m(q, gathered_at);
  for (const MovingEntry& m : bodies.moving()) {
    if (m.close) most = std::max(most, bodies.motion_m(m.mover.at().back(q), m.gathered));
  }
  return most;
}

bool Candidates::lists_leaves(const RigidBodies& bodies, const ToolPose& pose, double reach) const noexcept {
  return near_leaves.all() && bodies.motion_m(pose, near_leaves.at()) + reach <= near_leaves.reach();
}

bool Candidates::lists_triangles(const RigidBodies& bodies, const ToolPose& pose) const noexcept {
  return near_triangles.all() && bodies.motion_m(pose, near_triangles.at()) <= near_triangles.reach();
}

void Candidates::forget() noexcept {
  count = pressed.count = 0;
  gathered_reach_m = -1.0;
  near_leaves.forget();
  near_triangles.forget();
}

}  // namespace proxarm::models
