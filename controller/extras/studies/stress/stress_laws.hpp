// Judges a point's steps for the stress study. The laws of contact forces are written here a second time, independently
// of 𝒢's code, and hold for any 𝒢.
#pragma once

#include <cstddef>
#include <vector>

#include "models/geometry/geometric_algorithm.hpp"
#include "models/obstacles/moving_obstacle.hpp"
#include "models/surfaces/contact_judge.hpp"
#include "scenes/format/scene.hpp"

namespace proxarm::studies {

// One call of 𝒢 by the proxy: r = 𝒢(K, p, q), with p for p̂.
template <int N>
struct Call {
  double K = 0.0;
  models::Vec<N> p = models::Vec<N>::Zero(), q = models::Vec<N>::Zero(), r = models::Vec<N>::Zero();
  models::StepTime time;
  // By object, for moving meshes: q moved with the mesh, where 𝒢 starts at order 2.
  std::vector<models::Vec3> carried;
  std::vector<models::Contact<N>> contacts;
  bool unresolved = false;

  [[nodiscard]] models::Vec<N> f() const { return K * (r - p); }
  [[nodiscard]] double size() const { return 0.1 + r.norm() + p.norm() + q.norm() + (r - p).norm(); }
};

// Returns the factor by which the contacts' geometry amplifies rounding.
template <int N>
double condition(const Call<N>& call) {
  return models::rounding_amplification<N>(call.contacts);
}

class Laws {
 public:
  // Precondition: the scene outlives the laws.
  explicit Laws(const scenes::Scene& scene);

  [[nodiscard]] bool judged() const noexcept { return !scene_.guide; }
  [[nodiscard]] bool moving() const noexcept { return moving_; }
  [[nodiscard]] bool meshes() const noexcept { return meshes_; }
  [[nodiscard]] bool soft() const noexcept;
  [[nodiscard]] bool bends() const noexcept {
    return scene_.guide && scene_.guide->kind == scenes::GuideDescription::Kind::polyline;
  }

  // The force of the objects alone. `f` is the call's force without the known forces of media. A Coulomb medium's force
  // isn't subtracted; its size is coulomb_N. `K` includes the viscous media.
  struct ObjectForce {
    models::Vec3 f;
    double coulomb_N = 0.0, K = 0.0;
  };
  template <int N>
  [[nodiscard]] ObjectForce without_media(const Call<N>& call) const;

  // Returns whether f is a sum of contact forces that obey (17).
  template <int N>
  [[nodiscard]] bool obeyed(const Call<N>& call) const;

  // Returns the largest distance by which an object has been moved, m. The rounding of objects' places is in proportion
  // to that distance.
  [[nodiscard]] double carriage(double time_s) const;

  // Returns q moved with the object.
  [[nodiscard]] models::Vec3 carried(std::size_t object, const models::StepTime& time, const models::Vec3& q) const;

  // Returns the largest depth of r inside an object, m. If negative, r is at least that far away from all objects.
  [[nodiscard]] double depth(const models::Vec3& r, double time_s) const;

  // The curvature of an object's surface, which limits the work of f on the proxy. Sets radius_m for round objects.
  enum class Curvature { flat_or_concave, convex, edged };
  [[nodiscard]] Curvature curvature(std::size_t object, double& radius_m) const;

 private:
  const scenes::Scene& scene_;
  bool moving_ = false, meshes_ = false;
  std::vector<models::ScriptedMotion> scripts_;
  std::vector<bool> convex_;  // for each object: whether it is a convex mesh
};

}  // namespace proxarm::studies
