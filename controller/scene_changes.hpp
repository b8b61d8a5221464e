// Objects of a scene whose friction and place change while it is touched, without a step in either.
//
// An object that is driven (scenes::Motion::driven) moves straight to where it is wanted, at most at speed_m_per_s and
// with acceleration_m_per_s2, and so sweeps what is in its way like any object that moves:
//   v(k) = min(v(k−1) + aT, v_max, √(2 a d))        d: what is left of the way; ends on the spot
// μ goes to its new value by at most friction_per_s: a proxy that slides feels no step of force.
//
// set() and step() neither allocate, lock nor throw. With nothing under way, step() looks at one number.
#pragma once

#include <cstdint>
#include <vector>

#include "controller/change.hpp"
#include "fieldbus/state_archive.hpp"
#include "models/geometry.hpp"
#include "scenes/compile.hpp"

namespace proxarm::controller {

class SceneChanges {
 public:
  static constexpr double speed_m_per_s = 0.1, acceleration_m_per_s2 = 0.5, friction_per_s = 1.0;

  // The scene must outlive it.
  SceneChanges(scenes::CompiledScene& scene, double period_s);

  // Parameter::friction or position, of an object that has it; anything else changes nothing.
  void set(const Change& change) noexcept;
  void set_period(double period_s) noexcept { period_s_ = period_s; }
  // Before each step of the proxy.
  void step() noexcept;

  // μ of an object, by its index in the scene, now; 0 for none.
  [[nodiscard]] double friction(std::int32_t object) const noexcept;
  // By how much an object is away from where it is described, m.
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
  bool rub(std::size_t index) noexcept;
  bool move(std::size_t index) noexcept;
  void drive(std::size_t index, const models::Vec3& position_m) noexcept;

  scenes::CompiledScene* scene_;
  double period_s_;
  std::vector<Object> objects_;
  bool under_way_ = false;
};

}  // namespace proxarm::controller
