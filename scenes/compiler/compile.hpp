// Compiles a scene to the smallest 𝒢 that renders it. A scene without friction gets no code for friction, a single wall
// is just (2) or (4), and an empty scene is 𝒢(K, p, q) = p.
//
//   CompiledScene world = compile(load_scene("scenes/wall.yaml"));
//   GeometricAlgorithm<3>& g = world.algorithm<3>();
//   const Vec3 q = g(M / (T * T), p_hat, q_k1);                    // (26b)
#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include "models/geometry/geometric_algorithm.hpp"
#include "models/obstacles/moving_obstacle.hpp"
#include "scenes/compiler/plan.hpp"
#include "scenes/format/scene.hpp"

namespace proxarm::scenes {

struct CompiledScene {
  template <int N>
  using Algorithm = std::unique_ptr<models::GeometricAlgorithm<N>>;

  std::string name;
  Space space;
  Plan plan;                            // the plan from which it was built
  std::shared_ptr<const Scene> source;  // needed to compile the scene again for another proxy
  std::variant<Algorithm<1>, Algorithm<2>, Algorithm<3>> any_algorithm;

  [[nodiscard]] int dimensions() const noexcept { return space.dimensions; }

  // Returns the scene's 𝒢. Precondition: N is the scene's number of dimensions; otherwise throws
  // std::bad_variant_access. Each proxy needs its own CompiledScene, because 𝒢 remembers contacts.
  template <int N>
  [[nodiscard]] models::GeometricAlgorithm<N>& algorithm() const {
    return *std::get<Algorithm<N>>(any_algorithm);
  }

  // Moves an object whose motion is `driven` to the pose X relative to its described place. `object` is its index in
  // the scene. Must be called once before each step: the proxy feels the motion since the call before. In fewer than
  // three dimensions, only the part of X along the space counts.
  void drive(std::size_t object, const models::Pose& X) noexcept;
  std::vector<std::pair<std::int32_t, models::MovingObstacle*>> driven;  // parts of any_algorithm
  // drive() passes each motion to this function too, for the 𝒢 of a rigid tool.
  std::function<void(std::int32_t object, const models::Pose& X)> also_drive;

  // Sets an object's friction from the next step on. Preconditions: has_friction(object); `friction` is finite and not
  // negative.
  void set_friction(std::size_t object, double friction) noexcept;
  [[nodiscard]] bool has_friction(std::size_t object) const noexcept;
  std::vector<double> frictions;  // friction of each object, as described
  std::vector<std::pair<std::int32_t, std::function<void(double)>>> friction_setters;  // parts of any_algorithm

  // Convert between coordinates of the space and points of W.
  template <int N>
  [[nodiscard]] models::Vec3 to_W(const models::Vec<N>& x) const noexcept {
    return space.origin_m + space.axes.leftCols<N>() * x;
  }
  template <int N>
  [[nodiscard]] models::Vec<N> from_W(const models::Vec3& x_W) const noexcept {
    return space.axes.leftCols<N>().transpose() * (x_W - space.origin_m);
  }
};

// Throws description::SetupError if the scene can't be rendered, for example if a space of fewer than three dimensions
// lies inside an object.
CompiledScene compile(const Scene& scene);

}  // namespace proxarm::scenes
