#include "controller/command_line/entry/separate_commands.hpp"

#include <unistd.h>

#include <algorithm>
#include <filesystem>

#include "models/base/setup_error.hpp"

namespace proxarm::command_line {

namespace {

const SeparateCommand* find(const std::string& name) {
  const auto& commands = separate_commands();
  const auto found = std::find_if(commands.begin(), commands.end(), [&](const auto& one) { return one.name == name; });
  return found == commands.end() ? nullptr : &*found;
}

}  // namespace

const std::vector<SeparateCommand>& separate_commands() {
  static const std::string commissioning = "proxarm-commissioning";
  static const std::vector<SeparateCommand> commands{
      {"schema", "what cell, hand, scene, sensor or drive files may say, as JSON Schema for editors", commissioning},
      {"tune", "advice on mass, inertia, damping and timestep for a cell and a hand", commissioning},
      {"prove",
       "whether an arm is as its cell says, by small slow motions and pushes: joint signs, gear ratios, the sensor's "
       "mounting, sign and scale, brakes. Status 1: not proven",
       commissioning},
      {"zero",
       "what the sensor reads with nobody at the handle: tared, and kept beside the cell for the sessions to come, "
       "whose tare is held against it. Nothing moves. Status 1: somebody was there",
       commissioning},
      {"identify",
       "mass, centre of mass and zero of what hangs behind the sensor, by slow motions of the wrist, or friction, "
       "rotors and gears of the joints (--joints), with their uncertainty. Status 1: not identified",
       commissioning},
      {"calibrate",
       "where the encoders' zeros are: by poses that the arm is brought to by hand, or by homing; into the cell's "
       "file, with a backup. Status 1: the poses don't fit one another",
       commissioning},
      {"assess",
       "stopping times and distances, and clamping forces, of the simulated arm, held against thresholds; certifies "
       "nothing. Status 1: a threshold is exceeded",
       commissioning},
      {"new-cell", "a cell of your own arm out of its URDF or xacro: runs at once in simulation", "proxarm-new-cell"},
      {"study", "accuracy, stability and speed measured: CSV, JSON and plots", "proxarm-study"},
      {"view", "a recorded session or a black box in the browser", "proxarm-view"}};
  return commands;
}

const std::string& text_of(const std::string& name) { return find(name)->text; }

void become_separate(std::vector<char*> words) {
  const SeparateCommand* command = words.size() > 1 ? find(words[1]) : nullptr;
  if (!command) return;
  const std::string program = std::filesystem::read_symlink("/proc/self/exe").replace_filename(command->program);
  words.push_back(nullptr);
  execv(program.c_str(), words.data() + 1);
  throw description::SetupError({.found = "no program " + program + ", which carries out " + command->name,
                                 .expected = "it beside proxarm",
                                 .advice = "in a source tree `./dev " + command->name + "` builds it"});
}

}  // namespace proxarm::command_line
