// Worlds of a few obstacles, in a line of a test.
#pragma once

#include <memory>
#include <utility>
#include <vector>

#include "models/world/world.hpp"
#include "tests/models/surfaces/contract.hpp"

namespace proxarm::tests {

template <typename T, typename... Arguments>
models::World::Entry entry(std::int32_t object, Arguments&&... arguments) {
  return {std::make_unique<T>(std::forward<Arguments>(arguments)...), object, -1};
}

template <typename... Entries>
models::World world(Entries&&... entries) {
  std::vector<models::World::Entry> all;
  (all.push_back(std::forward<Entries>(entries)), ...);
  return models::World(std::move(all));
}

inline std::unique_ptr<models::World> single(std::unique_ptr<models::Obstacle> obstacle) {
  std::vector<models::World::Entry> entries;
  entries.push_back({std::move(obstacle), 0, -1});
  return std::make_unique<models::World>(std::move(entries));
}

inline models::Pose tilted(const models::Vec3& at) {
  models::Pose X = models::Pose::Identity();
  X.translation() = at;
  X.linear() = (Eigen::AngleAxisd(0.7, models::Vec3(1, 2, 3).normalized())).toRotationMatrix();
  return X;
}

// States small against the radii: deeper ones have several solutions on a solid body (a proxy that is pushed through
// the middle of a ball may hold or go around either way).
inline ContractOptions<3> small_steps(std::vector<double> friction, double depth = 0.02) {
  ContractOptions<3> options;
  options.friction = std::move(friction);
  options.size_m = depth;
  options.near_surface = true;
  options.kappa_decades = 6.0;
  options.reach_m = depth;
  options.condition = 4.0;
  return options;
}

}  // namespace proxarm::tests
