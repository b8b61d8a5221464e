// What is known of the forces of a world, whatever its 𝒢: the judge's own copy of the laws, for the stress study.
#pragma once

#include <cstddef>
#include <vector>

#include "models/geometry/geometric_algorithm.hpp"
#include "models/obstacles/moving_obstacle.hpp"
#include "models/surfaces/contact_judge.hpp"
#include "scenes/format/scene.hpp"

namespace proxarm::studies {

// One call of 𝒢, as the proxy made it.
template <int N>
struct Call {
  double K = 0.0;
  models::Vec<N> p = models::Vec<N>::Zero(), q = models::Vec<N>::Zero(), r = models::Vec<N>::Zero();
  models::StepTime time;
  std::vector<models::Vec3> carried;  // q, by objects' motion: where 𝒢 begins, of meshes at order 2
  std::vector<models::Contact<N>> contacts;
  bool unresolved = false;

  [[nodiscard]] models::Vec<N> f() const { return K * (r - p); }
  [[nodiscard]] double size() const { return 0.1 + r.norm() + p.norm() + q.norm() + (r - p).norm(); }
};

// By how much the contacts' geometry amplifies rounding.
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

  // f of the objects alone: what media take is known, but for a Coulomb medium's force, whose size is returned. K with
  // what viscous media add to it.
  struct ObjectForce {
    models::Vec3 f;
    double coulomb_N = 0.0, K = 0.0;
  };
  template <int N>
  [[nodiscard]] ObjectForce without_media(const Call<N>& call) const;

  // (17): how far f is from what the contacts can bear, as yes or no.
  template <int N>
  [[nodiscard]] bool obeyed(const Call<N>& call) const;

  // How far the objects have been carried, metres: their places are rounded by that.
  [[nodiscard]] double carriage(double time_s) const;

  // Where the object's motion takes q.
  [[nodiscard]] models::Vec3 carried(std::size_t object, const models::StepTime& time, const models::Vec3& q) const;

  // How deep r is inside of anything, metres.
  [[nodiscard]] double depth(const models::Vec3& r, double time_s) const;

  // What a surface's curvature lets f do on the proxy.
  enum class Curvature { flat_or_concave, convex, edged };
  [[nodiscard]] Curvature curvature(std::size_t object, double& radius_m) const;

 private:
  const scenes::Scene& scene_;
  bool moving_ = false, meshes_ = false;
  std::vector<models::ScriptedMotion> scripts_;
  std::vector<bool> convex_;  // meshes
};

}  // namespace proxarm::studies
