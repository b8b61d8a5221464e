// Worlds composed at random, for studies that want any world.
#pragma once

#include <cmath>
#include <cstdint>
#include <random>
#include <string>

#include "scenes/scene.hpp"

namespace proxarm::studies {

// The same numbers on every machine: nothing of <random> but its engine, whose output the standard defines.
class Random {
 public:
  explicit Random(std::uint64_t seed) : engine_(seed) {}

  double uniform(double low, double high) {
    return low + (high - low) * (static_cast<double>(engine_() >> 11) * 0x1p-53);
  }
  double log_uniform(double low, double high) { return std::exp(uniform(std::log(low), std::log(high))); }
  bool chance(double probability) { return uniform(0.0, 1.0) < probability; }
  int below(int n) { return static_cast<int>(uniform(0.0, static_cast<double>(n))); }
  models::Vec3 in_box(double half) {
    const double x = uniform(-half, half), y = uniform(-half, half), z = uniform(-half, half);
    return {x, y, z};
  }
  models::Vec3 direction() {
    for (;;) {
      const models::Vec3 v = in_box(1.0);
      const double size = v.norm();
      if (size > 0.1 && size <= 1.0) return v / size;
    }
  }
  // A direction with a length; the length is drawn first (operands of one product are evaluated in no set order).
  models::Vec3 arrow(double shortest, double longest) {
    const double length = uniform(shortest, longest);
    return length * direction();
  }
  models::Vec3 log_arrow(double shortest, double longest) {
    const double length = log_uniform(shortest, longest);
    return length * direction();
  }

 private:
  std::mt19937_64 engine_;
};

struct RandomScene {
  scenes::Scene scene;
  std::string kind;  // planes, round, edged, several, moving, media, layer, guide, mesh
};

RandomScene random_scene(Random& random);

// Worlds of meshes: concave ones, and any that move (kinds concave_mesh, moving_mesh), half of them with another
// object.
RandomScene random_mesh_scene(Random& random);

// Two to five objects of which most have elastic layers, some of them moving (kinds layers, moving_layers).
RandomScene random_layer_scene(Random& random);

}  // namespace proxarm::studies
