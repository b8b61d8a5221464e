#include "controller/rendering/scene_changes.hpp"

#include <algorithm>
#include <cmath>

namespace proxarm::controller {

using models::Vec3;

SceneChanges::SceneChanges(scenes::CompiledScene& scene, double period_s)
    : scene_(&scene), period_s_(period_s), objects_(scene.frictions.size()) {
  for (std::size_t i = 0; i < objects_.size(); ++i) {
    objects_[i].friction = objects_[i].wanted_friction = scene.frictions[i];
    objects_[i].rubs = scene.has_friction(i);
  }
  for (const auto& [index, part] : scene.driven) objects_[static_cast<std::size_t>(index)].driven = true;
}

void SceneChanges::set(const Change& change) noexcept {
  if (change.object < 0 || static_cast<std::size_t>(change.object) >= objects_.size()) return;
  Object& object = objects_[static_cast<std::size_t>(change.object)];
  const Vec3 position_m(change.position_m.data());
  if (change.parameter == Parameter::friction && object.rubs && std::isfinite(change.value) && change.value >= 0.0) {
    object.wanted_friction = change.value;
    under_way_ = true;
  }
  if (change.parameter == Parameter::position && object.driven && position_m.allFinite()) {
    object.wanted_m = position_m;
    under_way_ = true;
  }
}

void SceneChanges::step() noexcept {
  if (!under_way_) return;
  under_way_ = false;
  for (std::size_t i = 0; i < objects_.size(); ++i) {
    const bool rubs = rub(i), moves = move(i);
    under_way_ = under_way_ || rubs || moves;
  }
}

// Makes one step of an object's friction. Returns true until the friction has the wanted value.
bool SceneChanges::rub(std::size_t index) noexcept {
  Object& object = objects_[index];
  if (object.friction == object.wanted_friction) return false;
  const double most = friction_per_s * period_s_, way = object.wanted_friction - object.friction;
  object.friction = std::abs(way) <= most ? object.wanted_friction : object.friction + std::copysign(most, way);
  scene_->set_friction(index, object.friction);
  return object.friction != object.wanted_friction;
}

// Makes one step of an object's place. Returns true until the object has arrived. The scene computes an object's motion
// from the object's last two places, so a place is sent a second time after the object has arrived: the object is then
// at rest.
bool SceneChanges::move(std::size_t index) noexcept {
  Object& object = objects_[index];
  if (!object.driven) return false;
  const Vec3 way = object.wanted_m - object.position_m;
  const double distance_m = way.norm();
  if (distance_m == 0.0) {
    object.speed_m_per_s = 0.0;
    if (object.before_m != object.position_m) drive(index, object.position_m);
    return false;
  }
  const double a = acceleration_m_per_s2;
  object.speed_m_per_s =
      std::min({object.speed_m_per_s + a * period_s_, speed_m_per_s, std::sqrt(2.0 * a * distance_m)});
  const double step_m = object.speed_m_per_s * period_s_;
  drive(index, step_m >= distance_m ? object.wanted_m : Vec3(object.position_m + (step_m / distance_m) * way));
  return true;
}

void SceneChanges::drive(std::size_t index, const Vec3& position_m) noexcept {
  Object& object = objects_[index];
  object.before_m = object.position_m;
  object.position_m = position_m;
  models::Pose X = models::Pose::Identity();
  X.translation() = position_m;
  scene_->drive(index, X);
}

double SceneChanges::friction(std::int32_t object) const noexcept {
  const auto i = static_cast<std::size_t>(object);
  return object >= 0 && i < objects_.size() ? objects_[i].friction : 0.0;
}

Vec3 SceneChanges::position_m(std::int32_t object) const noexcept {
  const auto i = static_cast<std::size_t>(object);
  return object >= 0 && i < objects_.size() ? objects_[i].position_m : Vec3(Vec3::Zero());
}

void SceneChanges::archive(fieldbus::StateArchive& state) noexcept {
  for (std::size_t i = 0; i < objects_.size(); ++i) {
    Object& object = objects_[i];
    if (!object.driven && !object.rubs) continue;
    state(object.friction, object.wanted_friction, object.position_m, object.before_m, object.wanted_m,
          object.speed_m_per_s);
    if (state.reading()) tell_scene(i);
  }
  state(under_way_);
}

// Sends an object's friction and last two places to the scene, which computes the object's motion from these places.
void SceneChanges::tell_scene(std::size_t index) noexcept {
  Object& object = objects_[index];
  if (object.rubs && object.friction >= 0.0) scene_->set_friction(index, object.friction);
  if (!object.driven || !object.before_m.allFinite() || !object.position_m.allFinite()) return;
  const Vec3 now_m = object.position_m;
  drive(index, object.before_m);
  drive(index, now_m);
}

// Copies all objects of `other`, and sends them to the scene. If no change is under way, an object that hasn't changed
// since the last call isn't sent again.
void SceneChanges::follow(const SceneChanges& other) noexcept {
  const bool idle = !under_way_ && !other.under_way_;
  period_s_ = other.period_s_;
  for (std::size_t i = 0; i < objects_.size(); ++i) {
    const Object &from = other.objects_[i], &to = objects_[i];
    const bool same =
        idle && from.friction == to.friction && from.position_m == to.position_m && from.before_m == to.before_m;
    objects_[i] = from;
    if (!same && (from.driven || from.rubs)) tell_scene(i);
  }
  under_way_ = other.under_way_;
}

}  // namespace proxarm::controller
