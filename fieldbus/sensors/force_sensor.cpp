#include "fieldbus/sensors/force_sensor.hpp"

namespace proxarm::fieldbus {

std::string losses_text(std::initializer_list<LossCount> losses) {
  std::string text;
  for (const LossCount& loss : losses) {
    if (loss.count > 0) text += (text.empty() ? "" : ", ") + std::to_string(loss.count) + " " + loss.what;
  }
  return text;
}

}  // namespace proxarm::fieldbus
