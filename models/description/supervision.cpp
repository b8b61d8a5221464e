#include "models/description/supervision.hpp"

#include "models/base/text.hpp"
#include "models/files/yaml_file.hpp"
#include "models/files/yaml_rules.hpp"

namespace proxarm::description {

const std::vector<ReactionChoice>& reaction_choices() {
  static const std::vector<ReactionChoice> choices{
      {"sensor_lost", {"stop_1", "hold"}},
      {"sensor_late", {"slow", "continue", "hold", "stop_1"}},
      {"sensor_saturated", {"stop_1", "hold"}},
      {"force_excessive", {"stop_1", "hold"}},
      {"force_reversed", {"stop_1", "stop_0", "hold"}},
      {"sensor_drifts", {"stop_1", "hold", "continue"}},
      {"force_jumped", {"stop_1", "stop_0", "hold"}},
      {"feedback_late", {"continue", "slow"}},
      {"position_implausible", {"stop_0", "stop_1"}},
      {"drive_deviates", {"stop_0", "stop_1"}},
      {"drive_blocked", {"hold", "stop_1", "stop_0"}},
      {"leash_exceeded", {"stop_1", "hold"}},
      {"tool_too_fast", {"stop_0", "stop_1"}},
      {"tool_off_limits", {"stop_1", "stop_0"}},
      {"elbow_too_fast", {"stop_0", "stop_1"}},
      {"proxy_squeezed", {"stop_1", "hold"}},
      {"bus_off", {"stop_1", "stop_0"}},
      {"interface_down", {"stop_1", "stop_0"}},
      {"receive_overflow", {"stop_1", "slow"}},
      {"overrun", {"stop_1", "hold"}},
      {"second_master", {"stop_1", "stop_0"}},
      {"error_passive", {"slow", "hold", "stop_1"}},
      {"enabling_released", {"hold", "stop_1", "stop_0"}},
      {"enabling_squeezed", {"stop_1", "hold", "stop_0"}},
  };
  return choices;
}

SupervisionDescription read_supervision(const YamlNode& node) {
  SupervisionDescription s;
  s.hold_s = node.number_or("hold_s", s.hold_s, 0.1, 3600.0);
  s.ramp_in_s = node.number_or("ramp_in_s", s.ramp_in_s, 0.0, 10.0);
  s.slow_speed_m_per_s = node.number_or("slow_speed_m_per_s", s.slow_speed_m_per_s, 0.01, 1.0);
  s.release_speed_m_per_s = node.number_or("release_speed_m_per_s", s.release_speed_m_per_s, 0.005, 0.25);
  const std::string let_go = node.choice_or("let_go", "rest", {"rest", "coast", "hold"});
  s.let_go = let_go == "coast" ? LetGo::coast : let_go == "hold" ? LetGo::hold : LetGo::rest;
  s.empty_handle_N = node.number_or("empty_handle_N", s.empty_handle_N, 0.001, 10.0);
  s.max_bias_drift_N = node.number_or("max_bias_drift_N", s.max_bias_drift_N, 0.01, 100.0);
  s.max_force_step_N = node.number_or("max_force_step_N", s.max_force_step_N, 1.0, 1e4);
  s.brake_release = text_up_to(node, "brake_release", "", 120);
  s.monitored_standstill = node.boolean_or("monitored_standstill", s.monitored_standstill);
  s.bus_loss_stop_s = node.number_or("bus_loss_stop_s", s.bus_loss_stop_s, 0.006, 1.0);
  const auto reactions = node.find_map("reactions");
  if (!reactions) return s;
  for (const ReactionChoice& choice : reaction_choices()) {
    if (reactions->has(choice.fault)) s.reactions[choice.fault] = reactions->choice(choice.fault, choice.allowed);
  }
  return s;
}

namespace {

// Reads `three_position`. Precondition: `input` already contains the place of the middle contact.
void read_three_position(const YamlNode& node, EnablingInputDescription& input) {
  const auto contact = node.find_map("three_position");
  if (!contact) return;
  PanicContact panic;
  const bool of_drive = !input.drive.empty();
  panic.bit = static_cast<int>(contact->integer("panic_bit", 0, of_drive ? 31 : 7));
  if (!of_drive) panic.byte = static_cast<int>(contact->integer_or("panic_byte", input.byte, 0, 7));
  panic.squeezed_is = contact->integer_or("panic_is", 1, 0, 1) == 1;
  if (panic.bit == input.bit && panic.byte == input.byte) {
    throw contact->error_at("panic_bit", "another bit than that of the middle position", {},
                            "a switch with three positions has a contact of its own for each");
  }
  input.three_position = panic;
}

}  // namespace

EnablingInputDescription read_enabling_input(const YamlNode& node) {
  EnablingInputDescription input;
  const std::string where =
      exactly_one(node, {"drive", "identifier"},
                  "either drive (and bit, of its object 60FDh) or bus, identifier, byte and bit of a CAN message");
  input.pressed_is = node.integer_or("pressed_is", 1, 0, 1) == 1;
  input.timeout_s = node.number_or("timeout_s", input.timeout_s, 0.002, 1.0);
  if (where == "drive") {
    input.drive = node.string("drive");
    input.bit = static_cast<int>(node.integer("bit", 0, 31));
    if (node.has("object")) {
      const std::string object =
          text_like(node, "object",
                    {"0x[1-9A-Fa-f][0-9A-Fa-f]{3}", "an object of 32 bits, its index in hexadecimal: \"0x60FD\""});
      input.object = static_cast<std::uint32_t>(*strict_integer(object) << 8);
    }
    read_three_position(node, input);
    return input;
  }
  input.bus = node.string("bus");
  input.extended = node.boolean_or("extended", false);
  input.identifier = static_cast<std::uint32_t>(node.integer("identifier", 1, input.extended ? 0x1FFFFFFF : 0x7FF));
  input.byte = static_cast<int>(node.integer("byte", 0, 7));
  input.bit = static_cast<int>(node.integer("bit", 0, 7));
  read_three_position(node, input);
  return input;
}

}  // namespace proxarm::description
