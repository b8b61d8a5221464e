// Objects of a scene whose friction and place change while it is touched, without a step in either.
//
// An object that is driven (scenes::Motion::driven) moves straight to where it is wanted, at most at speed_m_per_s and
// with acceleration_m_per_s2, and so sweeps what is in its way like any object that moves:
//   v(k) = min(v(k−1) + aT, v_max, √(2 a d))        d: the distance that is left
// √(2ad) is the speed from which braking at a ends within d; the last step ends on the spot.
// μ changes by at most friction_per_s, so that a proxy that slides feels no step of force.
//
// set() and step() neither allocate, lock nor throw. With nothing under way, step() looks at one number.
#pragma once

#include <cstdint>
#include <vector>

#include "controller/rendering/change.hpp"
#include "models/base/state_archive.hpp"
#include "models/geometry/geometry.hpp"
#include "scenes/compiler/compile.hpp"

namespace proxarm::controller {

class SceneChanges {
 public:
  static constexpr double speed_m_per_s = 0.1, acceleration_m_per_s2 = 0.5, friction_per_s = 1.0;

  // The scene must outlive it.
  SceneChanges(scenes::CompiledScene& scene, double period_s);

  // Takes Parameter::friction of an object with friction and Parameter::position of one that is driven; anything else
  // changes nothing.
  void set(const Change& change) noexcept;
  void set_period(double period_s) noexcept { period_s_ = period_s; }
  // Called before each step of the proxy.
  void step() noexcept;

  // Goes on from where `other` is, in a scene of its own, compiled from the same file.
  void follow(const SceneChanges& other) noexcept;

  // The present μ of an object, by its index in the scene; 0 where there is no such object.
  [[nodiscard]] double friction(std::int32_t object) const noexcept;
  // How far an object is now from where the scene describes it, m.
  [[nodiscard]] models::Vec3 position_m(std::int32_t object) const noexcept;

  void archive(fieldbus::StateArchive& state) noexcept;

 private:
  struct Object {
    double friction = 0.0, wanted_friction = 0.0;
    models::Vec3 position_m = models::Vec3::Zero(), before_m = models::Vec3::Zero();
    models::Vec3 wanted_m = models::Vec3::Zero();
    double speed_m_per_s = 0.0;
    bool driven = false, rubs = false;
  };
  void tell_scene(std::size_t index) noexcept;
  bool rub(std::size_t index) noexcept;
  bool move(std::size_t index) noexcept;
  void drive(std::size_t index, const models::Vec3& position_m) noexcept;

  scenes::CompiledScene* scene_;
  double period_s_;
  std::vector<Object> objects_;
  bool under_way_ = false;
};

}  // namespace proxarm::controller
