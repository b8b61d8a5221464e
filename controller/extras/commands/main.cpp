// Defines the program proxarm-commissioning, which proxarm becomes for the commands that prepare and judge an arm
// before sessions.
//
// Exit status: 0: fine; 1: not proven, not identified, a threshold exceeded; 2: set-up mistake.
#include <CLI/CLI.hpp>
#include <functional>
#include <sstream>
#include <string>
#include <utility>
#include <vector>

#include "controller/command_line/entry/command_app.hpp"
#include "controller/command_line/entry/program.hpp"
#include "controller/command_line/entry/separate_commands.hpp"
#include "controller/extras/commands/commands.hpp"
#include "controller/options/parsing/option_parsing.hpp"
#include "controller/options/session_options.hpp"
#include "models/base/setup_error.hpp"
#include "models/base/text.hpp"

namespace {

using namespace proxarm;
using command_line::CommandApp;
using controller::add_arm_option;
using controller::add_enabling_option;
using controller::add_fault_option;
using controller::add_hardware_option;
using controller::add_session_options;
using controller::add_turning_options;
using controller::add_without_enabling;
using controller::choice;
using controller::leave_out;
using controller::RunOptions;
using controller::whole_number;

void add_assess_options(CLI::App& app, command_line::AssessOptions& options) {
  add_session_options(app, options.run);
  leave_out(app, {"--scene", "--stiffness", "--scheme", "--duration", "--bus"});
  app.add_option("--thresholds", options.thresholds,
                 "file of the forces that clamping is held against, with their source (default: "
                 "models/thresholds/hands.yaml)")
      ->type_name("FILE");
  app.add_option("--poses",
                 whole_number("--poses",
                              [&](std::uint64_t n) {
                                if (n < 1 || n > 100) {
                                  throw description::SetupError(
                                      {.key = "--poses", .found = std::to_string(n), .expected = "1 to 100"});
                                }
                                options.poses = static_cast<int>(n);
                              }),
                 "in how many poses, the start and others about it (default 4)")
      ->type_name("N");
  app.add_flag("--json", options.run.json, "print the figures as one JSON object");
}

void add_prove_options(CLI::App& app, command_line::ProveOptions& options) {
  add_session_options(app, options.run);
  leave_out(app, {"--scene", "--hand", "--mass", "--damping", "--spring", "--stiffness", "--scheme", "--duration",
                  "--extra-delay", "--lookahead", "--gear-damping"});
  add_fault_option(app, options.run);
  add_enabling_option(app, options.run);
  add_without_enabling(app, options.run);
  add_hardware_option(app, options.run);
  add_arm_option(app, options.arm);
  app.add_flag(
      "--bus-loss", options.bus_loss,
      "at standstill the controller falls silent on purpose: how and when each drive stops by itself, kept with "
      "the cell's proof");
  app.add_option("--out", options.out, "file of the proof (default: beside the cell, CELL.proof)")->type_name("FILE");
  app.add_flag("--json", options.run.json, "print the verdict as one JSON object");
}

void add_identify_options(CLI::App& app, command_line::IdentifyOptions& options) {
  add_session_options(app, options.run);
  leave_out(app, {"--scene", "--mass", "--damping", "--spring", "--stiffness", "--scheme", "--duration",
                  "--extra-delay", "--lookahead", "--gear-damping"});
  app.remove_option(app.get_option("--hand"));
  app.add_option("--hand", options.run.hand, "simulated arm only: file of a hand at the handle (default: nobody)")
      ->type_name("FILE");
  add_fault_option(app, options.run);
  add_enabling_option(app, options.run);
  add_without_enabling(app, options.run);
  add_hardware_option(app, options.run);
  add_arm_option(app, options.arm);
  app.add_flag("--joints", options.joints,
               "friction, rotor inertia, gear stiffness and damping of each joint instead, by small motions about the "
               "pose the arm is in");
  app.add_flag("--compare", options.compare,
               "what differs from the cell and its CELL.zero, and whether by more than the uncertainty. Status 1: "
               "something does");
  app.add_flag(
      "--write", options.write,
      "write tool.mass_kg and tool.centre_of_mass_S_m into the cell, with a backup, and the zero beside it; or "
      "with --joints what was found of these");
  app.add_flag("--json", options.run.json, "print the result as one JSON object");
}

std::vector<double> angles_of(const std::string& text) {
  std::vector<double> angles;
  std::istringstream parts(text);
  for (std::string part; std::getline(parts, part, ',');) {
    const auto number = description::strict_number(part);
    if (!number) throw CLI::ValidationError("--at", "expected angles in rad with commas between, such as 0,0.5,-1");
    angles.push_back(*number);
  }
  return angles;
}

void add_calibrate_options(CLI::App& app, command_line::CalibrateOptions& options) {
  add_session_options(app, options.run);
  leave_out(app, {"--scene", "--hand", "--mass", "--damping", "--spring", "--stiffness", "--scheme", "--duration",
                  "--extra-delay", "--lookahead", "--gear-damping", "--timestep"});
  add_fault_option(app, options.run);
  add_hardware_option(app, options.run);
  app.add_flag("--without-enabling-input", options.run.settings.without_enabling_input,
               "leave out the cell's enabling input while drives are homed");
  app.add_option("--at", CLI::callback_t([&](const CLI::results_t& words) {
                   for (const std::string& word : words) options.at.push_back(angles_of(word));
                   return true;
                 }),
                 "angles of all joints at their marks, rad, with commas between; repeated: more poses, which must "
                 "agree (default: "
                 "start_rad)")
      ->type_name("RAD,RAD,...")
      ->expected(1)
      ->multi_option_policy(CLI::MultiOptionPolicy::TakeAll);
  app.add_option("--tolerance", options.tolerance_rad, "by which the poses may disagree, rad (default 0.01)")
      ->check(CLI::Range(1e-6, 1.0))
      ->type_name("RAD");
  app.add_flag("--home", options.home,
               "home the drives with incremental encoders, one joint after the other: they move");
  add_arm_option(app, options.arm);
}

// Adds this program's commands with their options.
class Commands {
 public:
  explicit Commands(CommandApp& app) : app_(app) {
    add_schema();
    add_judges();
  }

 private:
  CLI::App* add(const std::string& name, std::function<int()> command) {
    return app_.add(name, command_line::text_of(name), std::move(command));
  }

  void add_schema() {
    CLI::App* schema = add("schema", [this] { return command_line::schema_command(schema_); });
    schema
        ->add_option("kind",
                     choice<std::string>("kind",
                                         {{"cell", "cell"},
                                          {"hand", "hand"},
                                          {"scene", "scene"},
                                          {"tool", "tool"},
                                          {"sensor", "sensor"},
                                          {"drive", "drive"}},
                                         [this](const std::string& kind) { schema_.kind = kind; }),
                     "which: cell, hand, scene, tool, sensor, or drive (on Modbus)")
        ->required()
        ->type_name("KIND");
    schema->add_flag("--markdown", schema_.markdown, "tables of the keys: unit, default, range and meaning");
  }

  void add_judges() {
    CLI::App* tune = add("tune", [this] { return command_line::tune_command(tune_); });
    add_session_options(*tune, tune_);
    add_turning_options(*tune, tune_);
    leave_out(*tune, {"--stiffness", "--duration", "--bus"});
    add_prove_options(*add("prove",
                           [this] {
                             prove_.run.without_proof = true;
                             return command_line::prove_command(prove_);
                           }),
                      prove_);
    CLI::App* zero = add("zero", [this] {
      zero_.run.without_proof = true;
      return command_line::zero_command(zero_);
    });
    add_session_options(*zero, zero_.run);
    leave_out(*zero, {"--scene", "--hand", "--mass", "--damping", "--spring", "--stiffness", "--scheme", "--duration",
                      "--extra-delay", "--lookahead", "--gear-damping"});
    add_fault_option(*zero, zero_.run);
    add_enabling_option(*zero, zero_.run);
    add_hardware_option(*zero, zero_.run);
    add_arm_option(*zero, zero_.arm);
    zero->add_option("--out", zero_.out, "file of the zero (default: beside the cell, CELL.zero)")->type_name("FILE");
    add_identify_options(*add("identify",
                              [this] {
                                identify_.run.without_proof = true;
                                return identify_.joints ? command_line::identify_joints_command(identify_)
                                                        : command_line::identify_command(identify_);
                              }),
                         identify_);
    add_calibrate_options(*add("calibrate", [this] { return command_line::calibrate_command(calibrate_); }),
                          calibrate_);
    add_assess_options(*add("assess", [this] { return command_line::assess_command(assess_); }), assess_);
  }

  CommandApp& app_;
  RunOptions tune_;
  command_line::SchemaOptions schema_;
  command_line::ProveOptions prove_;
  command_line::ZeroOptions zero_;
  command_line::IdentifyOptions identify_;
  command_line::CalibrateOptions calibrate_;
  command_line::AssessOptions assess_;
};

}  // namespace

int main(int argc, char** argv) {
  // proxarm gives the command's name as the first word, where CLI11 expects the program's.
  std::string program = "proxarm";
  std::vector<char*> words{program.data()};
  words.insert(words.end(), argv, argv + argc);
  return command_line::run_program([&] {
    CommandApp app(PROXARM_VERSION);
    Commands commands(app);
    return app.run(static_cast<int>(words.size()), words.data());
  });
}
