// The judge's own copy of the laws of contact forces, which hold for any 𝒢, for the stress study.
#pragma once

#include <cstddef>
#include <vector>

#include "models/geometry/geometric_algorithm.hpp"
#include "models/obstacles/moving_obstacle.hpp"
#include "models/surfaces/contact_judge.hpp"
#include "scenes/format/scene.hpp"

namespace proxarm::studies {

// One call of 𝒢 by the proxy.
template <int N>
struct Call {
  double K = 0.0;
  models::Vec<N> p = models::Vec<N>::Zero(), q = models::Vec<N>::Zero(), r = models::Vec<N>::Zero();
  models::StepTime time;
  std::vector<models::Vec3> carried;  // q moved with each object: where 𝒢 starts for meshes at order 2
  std::vector<models::Contact<N>> contacts;
  bool unresolved = false;

  [[nodiscard]] models::Vec<N> f() const { return K * (r - p); }
  [[nodiscard]] double size() const { return 0.1 + r.norm() + p.norm() + q.norm() + (r - p).norm(); }
};

// The factor by which the contacts' geometry amplifies rounding.
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

  // The force f of the objects alone: the known force of the media is subtracted, except for a Coulomb medium's, whose
  // size is returned. K includes the viscous media.
  struct ObjectForce {
    models::Vec3 f;
    double coulomb_N = 0.0, K = 0.0;
  };
  template <int N>
  [[nodiscard]] ObjectForce without_media(const Call<N>& call) const;

  // Whether the contacts can bear f by (17).
  template <int N>
  [[nodiscard]] bool obeyed(const Call<N>& call) const;

  // How far the objects have been moved, m; their places are rounded in proportion.
  [[nodiscard]] double carriage(double time_s) const;

  // Returns q moved with the object.
  [[nodiscard]] models::Vec3 carried(std::size_t object, const models::StepTime& time, const models::Vec3& q) const;

  // Depth of r inside the objects, m.
  [[nodiscard]] double depth(const models::Vec3& r, double time_s) const;

  // Curvature of a surface, which limits the work of f on the proxy.
  enum class Curvature { flat_or_concave, convex, edged };
  [[nodiscard]] Curvature curvature(std::size_t object, double& radius_m) const;

 private:
  const scenes::Scene& scene_;
  bool moving_ = false, meshes_ = false;
  std::vector<models::ScriptedMotion> scripts_;
  std::vector<bool> convex_;  // of meshes
};

}  // namespace proxarm::studies
