// Changes the friction and place of a scene's objects during rendering. Neither friction nor place jumps.
//
// A driven object (scenes::Motion::driven) moves straight to its wanted place, at most at speed_m_per_s and
// acceleration_m_per_s2, and pushes like any moving object:
//   v(k) = min(v(k−1) + aT, v_max, √(2 a d))        d: remaining distance
// √(2ad) is the speed from which braking at a ends within d. The last step ends exactly at the wanted place. The
// friction μ changes by at most friction_per_s, so that the force on a sliding proxy doesn't jump.
//
// set() and step() don't allocate, lock or throw. Without changes, step() only tests one value.
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

  // Precondition: the scene outlives this object.
  SceneChanges(scenes::CompiledScene& scene, double period_s);

  // Begins a change of Parameter::friction of an object with friction, or of Parameter::position of a driven object.
  // Ignores other changes.
  void set(const Change& change) noexcept;
  void set_period(double period_s) noexcept { period_s_ = period_s; }
  // Makes one step of all changes. Precondition: called before each step of the proxy.
  void step() noexcept;

  // Copies the state of `other` into this object's scene. Precondition: both scenes are compiled from one file.
  void follow(const SceneChanges& other) noexcept;

  // Present μ of an object, by its index in the scene; 0 if the scene has no object with this index.
  [[nodiscard]] double friction(std::int32_t object) const noexcept;
  // Present displacement of an object from its place in the scene file, m.
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
