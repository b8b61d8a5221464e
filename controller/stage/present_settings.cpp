#include "controller/stage/present_settings.hpp"

#include <cmath>
#include <utility>

namespace proxarm::view {

using controller::Parameter;

PresentSettings::PresentSettings(const Stage& stage)
    : period_s(stage.options().period_s),
      mass_kg(stage.options().mass_kg),
      damping_Ns_per_m(stage.options().damping_Ns_per_m),
      spring_N_per_m(stage.options().spring_N_per_m),
      position_m(stage.scene().objects.size(), models::Vec3::Zero()),
      handle_mass_kg(stage.handle_mass_kg()) {
  for (const scenes::Object& object : stage.scene().objects) friction.push_back(object.friction);
}

bool PresentSettings::follow(const controller::Change& change, double period_s_now) {
  const auto take = [](auto& present, const auto& value) { return std::exchange(present, value) != value; };
  const bool other_period = take(period_s, period_s_now);
  // The cycle skips a change that was checked for another timestep. Both timesteps are whole nanoseconds.
  constexpr double same_s = 0.5e-9;
  if (change.period_s != 0.0 && std::abs(change.period_s - period_s_now) > same_s) return other_period;
  const auto object = static_cast<std::size_t>(change.object);
  const bool of_object = change.object >= 0 && object < friction.size();
  bool other_value = false;
  switch (change.parameter) {
    case Parameter::mass:
      other_value = take(mass_kg, change.value + handle_mass_kg);
      break;
    case Parameter::damping:
      other_value = take(damping_Ns_per_m, change.value);
      break;
    case Parameter::spring:
      other_value = take(spring_N_per_m, change.value);
      break;
    case Parameter::friction:
      other_value = of_object && take(friction[object], change.value);
      break;
    case Parameter::position:
      other_value = of_object && take(position_m[object], models::Vec3(change.position_m.data()));
      break;
    case Parameter::lookahead:
    case Parameter::inertia:
    case Parameter::turning_damping:
    case Parameter::turning_spring:
    case Parameter::tool:
    case Parameter::none:
      break;
  }
  return other_period || other_value;
}

}  // namespace proxarm::view
