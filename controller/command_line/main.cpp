// Defines proxarm's command line: the commands, their options and the help.
//
// Exit status: 0: fine; 1: a fault ended the run, or the arm oscillated; 2: set-up mistake.
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <cstdio>
#include <filesystem>
#include <functional>
#include <iostream>
#include <memory>
#include <sstream>
#include <string>
#include <utility>

#include "controller/command_line/commands.hpp"
#include "controller/command_line/entry/exit_status.hpp"
#include "controller/command_line/entry/help.hpp"
#include "controller/command_line/entry/options.hpp"
#include "controller/command_line/entry/program.hpp"
#include "controller/command_line/options/run_words.hpp"
#include "controller/command_line/options/session_options.hpp"
#include "models/base/quantity.hpp"
#include "models/base/setup_error.hpp"
#include "models/base/text.hpp"

namespace {

using namespace proxarm;
using command_line::add_arm_option;
using command_line::add_enabling_option;
using command_line::add_fault_option;
using command_line::add_hardware_option;
using command_line::add_quantity;
using command_line::add_run_options;
using command_line::add_session_options;
using command_line::add_turning_options;
using command_line::add_view_options;
using command_line::add_without_enabling;
using command_line::choice;
using command_line::leave_out;
using command_line::RunOptions;
using command_line::whole_number;

void add_check_options(CLI::App& app, scenes::CheckOptions& options) {
  app.add_option("--states", options.states, "random states in which each object of a scene, and the whole, is tried")
      ->type_name("NUMBER")
      ->check(CLI::Range(std::int64_t{1}, std::int64_t{1'000'000'000}))
      ->capture_default_str();
  app.add_option("--seed", options.seed, "of these states")
      ->type_name("NUMBER")
      ->check(CLI::NonNegativeNumber)
      ->capture_default_str();
  add_quantity(app, "--depth", description::parse_length, options.deepest_m,
               "how deep states push (default 20mm), a tenth of the least radius at most: deeper in round things "
               "there are several solutions")
      ->type_name("LENGTH");
}

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

// Adds all commands with their options to proxarm's command line. After parsing, `chosen` runs the command that the
// user chose.
class Commands {
 public:
  explicit Commands(CLI::App& app) : app_(app) {
    add_sessions();
    add_bus();
    add_orders();
    add_files();
    add_judges();
    // The next three commands are separate programs (become()); they are added for the help.
    app_.add_subcommand("new-cell", "a cell of your own arm out of its URDF or xacro: runs at once in simulation");
    app_.add_subcommand("study", "accuracy, stability and speed measured: CSV, JSON and plots");
    app_.add_subcommand("view", "a recorded session or a black box in the browser");
  }

  std::function<int()> chosen;

 private:
  CLI::App* add(const char* name, const char* text, std::function<int()> command) {
    CLI::App* added = app_.add_subcommand(name, text);
    added->callback([this, command = std::move(command)] { chosen = command; });
    return added;
  }

  void add_sessions() {
    add_run_options(*add("run", "render a scene on a simulated or real arm", [this] { return run_command(run_); }),
                    run_);
    CLI::App* sim =
        add("sim", "the simulated arm as a process of its own on CAN interfaces", [this] { return sim_command(sim_); });
    add_session_options(*sim, sim_);
    leave_out(*sim, {"--lookahead", "--gear-damping"});
    sim->add_flag("--for-proof", sim_.for_proof,
                  "for `proxarm prove` on these interfaces: in place of the hand, somebody who pushes as it asks");
    add_fault_option(*sim, sim_);
    add_enabling_option(*sim, sim_);
    add_view_options(*sim, sim_,
                     "show the arm in a browser, at an address on this machine that is printed: with drives, hand and "
                     "the load on the sensor, as its own process knows them, and the scene that --scene names");
  }

  void add_bus() {
    CLI::App* plan =
        add("plan", "bus budget of a cell; status 1 if it can't be carried", [this] { return plan_command(plan_); });
    add_session_options(*plan, plan_);
    leave_out(*plan, {"--scene", "--hand", "--mass", "--damping", "--spring", "--stiffness", "--extra-delay",
                      "--lookahead", "--gear-damping", "--duration"});
    CLI::App* scan = add("scan", "what is on a CAN interface: listens, then asks; changes nothing",
                         [this] { return scan_command(scan_); });
    scan->add_option("--bus", scan_.interface, "CAN interface, such as can0")->required()->type_name("IFACE");
    scan->add_option_function<std::string>(
            "--poll-sensor",
            [this](const std::string& text) {
              const auto id = description::strict_integer(text);
              if (!id || *id < 0 || *id > 0x7F) throw CLI::ValidationError("--poll-sensor", "expected 0x09 to 0x7F");
              scan_.sensor_base_id = static_cast<std::uint32_t>(*id);
            },
            "poll an ATI Net CAN OEM at this base id, such as 0x68; never guessed")
        ->type_name("BASE_ID");
  }

  void add_orders() {
    constexpr const char* control_text = "the session's socket, where `proxarm run --control PATH` isn't \"default\"";
    CLI::App* set = add(
        "set",
        "change mass, inertia, damping, spring, tool, timestep, or an object's friction or place, in a running session",
        [this] { return set_command(set_); });
    set->add_option("changes", set_.changes,
                    "one or more of:\n"
                    "mass=6kg: mass that the hand feels, in kg, handle included\n"
                    "damping=20Ns/m: against the world\n"
                    "spring=100N/m: to the start position\n"
                    "inertia=0.05: moment of inertia that the hand feels of a tool that turns, in kg m²\n"
                    "turning_damping=0.5, turning_spring=20: of a tool that turns, in Nms/rad and Nm/rad\n"
                    "tool_mass=0.75kg, tool_centre_m=X,Y,Z: of the tool behind the sensor, which the cell has wrong; "
                    "the centre of mass in metres from the sensor\n"
                    "lookahead=4ms or auto: of a session that was started with one\n"
                    "timestep=2ms: the arm stops for it, and goes on\n"
                    "OBJECT.friction=0.6: of an object, by its name in the scene\n"
                    "OBJECT.position_m=X,Y,Z: of an object with motion: {driven: true}, in metres from where the scene "
                    "describes it")
        ->required()
        ->type_name("NAME=VALUE");
    set->add_option("--control", set_.control, control_text)->type_name("PATH");
    add_status(control_text);

    const std::pair<const char*, const char*> orders[] = {
        {"hold", "stop the arm of a running session, its drives enabled"},
        {"resume", "go on out of a hold"},
        {"release", "out of a hold: let the arm follow the hand slowly, without the scene; hold ends it"},
        {"back-off", "out of a hold: move the tool away from what was touched last"},
        {"reset", "after a fault, with --wait-after-fault: enable the drives again, into a hold"}};
    for (const auto& [name, help] : orders) {
      const bool has_distance = std::string(name) == "back-off";
      CLI::App* order = add(name, help, [this, line = std::string(name), has_distance] {
        set_.changes = {has_distance ? line + " " + distance_ : line};
        return set_command(set_);
      });
      order->add_option("--control", set_.control, control_text)->type_name("PATH");
      if (has_distance) order->add_option("distance", distance_, "such as 20mm")->required();
    }
  }

  void add_status(const char* control_text) {
    CLI::App* status = add("status", "how a running session is: phase, force, speed, limits, delay",
                           [this] { return command_line::status_command(status_); });
    status->add_option("--control", status_.control, control_text)->type_name("PATH");
    status->add_flag("--watch", status_.watch, "four times a second, until the session ends");
    status->add_flag("--json", status_.json, "a line of JSON (docs/files.md#the-status-of-a-session)");
  }

  void add_files() {
    CLI::App* replay = add("replay", "a recorded session or black box again, by the controller alone",
                           [this] { return replay_command(replay_); });
    replay->add_option("folder", replay_.folder, "folder of --record, or of a black box")->required();
    replay->add_flag("--json", replay_.json, "print the result as one JSON object");
    CLI::App* signals = add("signals", "the signals of a record as text, as in signals.csv",
                            [this] { return signals_command(signals_); });
    signals->add_option("folder", signals_.folder, "folder of --record")->required();
    CLI::Option* contacts =
        signals->add_flag("--contacts", signals_.contacts, "its contacts instead, as in contacts.csv");
    signals->add_flag("--frames", signals_.frames, "the frames on its buses instead, as in frames.log")
        ->excludes(contacts);
    CLI::App* check = add("check", "whether cell, scene, hand, sensor and other files are fine. Status 2: one isn't",
                          [this] { return check_command(check_); });
    check->add_option("files", check_.files, "files to check")->required();
    check->add_option("--scene", check_.scene, "the scene that cells are held against (default: each cell's own)")
        ->type_name("FILE");
    add_check_options(*check, check_.states);
    add("explain", "what a scene compiles to, what is skipped and why", [this] { return explain_command(explain_); })
        ->add_option("scene", explain_.files, "scene file")
        ->required();
    CLI::App* schema =
        add("schema", "what cell, hand, scene, sensor or drive files may say, as JSON Schema for editors",
            [this] { return schema_command(schema_); });
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
    CLI::App* tune = add("tune", "advice on mass, inertia, damping and timestep for a cell and a hand",
                         [this] { return tune_command(tune_); });
    add_session_options(*tune, tune_);
    add_turning_options(*tune, tune_);
    leave_out(*tune, {"--stiffness", "--duration", "--bus"});
    add_prove_options(
        *add("prove",
             "whether an arm is as its cell says, by small slow motions and pushes: joint signs, gear ratios, the "
             "sensor's mounting, sign and scale, brakes. Status 1: not proven",
             [this] {
               prove_.run.without_proof = true;
               return prove_command(prove_);
             }),
        prove_);
    CLI::App* zero = add("zero",
                         "what the sensor reads with nobody at the handle: tared, and kept beside the cell for the "
                         "sessions to come, whose tare is held against it. Nothing moves. Status 1: somebody was there",
                         [this] {
                           zero_.run.without_proof = true;
                           return zero_command(zero_);
                         });
    add_session_options(*zero, zero_.run);
    leave_out(*zero, {"--scene", "--hand", "--mass", "--damping", "--spring", "--stiffness", "--scheme", "--duration",
                      "--extra-delay", "--lookahead", "--gear-damping"});
    add_fault_option(*zero, zero_.run);
    add_enabling_option(*zero, zero_.run);
    add_hardware_option(*zero, zero_.run);
    add_arm_option(*zero, zero_.arm);
    zero->add_option("--out", zero_.out, "file of the zero (default: beside the cell, CELL.zero)")->type_name("FILE");
    add_identify_options(
        *add(
            "identify",
            "mass, centre of mass and zero of what hangs behind the sensor, by slow motions of the wrist, or friction, "
            "rotors and gears of the joints (--joints), with their uncertainty. Status 1: not identified",
            [this] {
              identify_.run.without_proof = true;
              return identify_.joints ? identify_joints_command(identify_) : identify_command(identify_);
            }),
        identify_);
    add_calibrate_options(
        *add(
            "calibrate",
            "where the encoders' zeros are: by poses that the arm is brought to by hand, or by homing; into the cell's "
            "file, with a backup. Status 1: the poses don't fit one another",
            [this] { return command_line::calibrate_command(calibrate_); }),
        calibrate_);
    add_assess_options(
        *add("assess",
             "stopping times and distances, and clamping forces, of the simulated arm, held against thresholds; "
             "certifies nothing. Status 1: a threshold is exceeded",
             [this] { return assess_command(assess_); }),
        assess_);
  }

  CLI::App& app_;
  RunOptions run_, sim_, plan_, tune_;
  command_line::ReplayOptions replay_;
  command_line::SignalsOptions signals_;
  command_line::ScanOptions scan_;
  command_line::SetOptions set_;
  command_line::StatusOptions status_;
  std::string distance_;
  command_line::CheckFilesOptions check_;
  command_line::FileOptions explain_;
  command_line::SchemaOptions schema_;
  command_line::ProveOptions prove_;
  command_line::ZeroOptions zero_;
  command_line::IdentifyOptions identify_;
  command_line::CalibrateOptions calibrate_;
  command_line::AssessOptions assess_;
};

int refuse_command(const CLI::App& app, const std::string& word) {
  std::vector<std::string> commands;
  for (const CLI::App* command : app.get_subcommands({})) commands.push_back(command->get_name());
  std::string message = (word.empty() ? "found no command" : "found " + description::in_quotes(word)) + ", expected " +
                        description::one_of(commands);
  const std::string near = description::nearest(word, commands);
  if (!near.empty()) message += "; did you mean " + near + "?";
  std::fprintf(stderr, "proxarm: %s; see proxarm --help\n", message.c_str());
  return command_line::set_up_mistake;
}

int run(int argc, char** argv) {
  CLI::App app{"Hold an industrial robot arm and feel a virtual world through it.", "proxarm"};
  app.require_subcommand(1);
  app.set_version_flag("--version", std::string("proxarm ") + PROXARM_VERSION);
  app.formatter(std::make_shared<command_line::HelpFormatter>());
  app.set_help_all_flag("--help-all", "help of all commands");
  Commands commands(app);
  command_line::refuse_options_as_values(app);
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    if (error.get_exit_code() == 0) return app.exit(error, std::cout, std::cerr);  // help, version
    if (app.get_subcommands().empty()) return refuse_command(app, argc > 1 ? argv[1] : "");
    const CLI::App& command = *app.get_subcommands().front();
    return command_line::refuse_options(command, "proxarm " + command.get_name(), {argv + 2, argv + argc}, error);
  }
  return commands.chosen();
}

// Replaces this process by another program in proxarm's folder. Separate programs keep proxarm quick to build and small
// in memory. If the program is missing, throws a SetupError that says what the program does (`missing`) and which
// command builds the program (`builder`).
int become(const char* name, std::vector<char*> words, const char* missing, const char* builder) {
  const std::string program = std::filesystem::read_symlink("/proc/self/exe").replace_filename(name);
  words.push_back(nullptr);
  execv(program.c_str(), words.data() + 1);
  throw description::SetupError({.found = "no program " + program + ", which " + missing,
                                 .expected = "it beside proxarm",
                                 .advice = std::string("in a source tree `") + builder + "` builds it"});
}

}  // namespace

int main(int argc, char** argv) {
  std::vector<char*> words(argv, argv + argc);
  std::string help = "--help";
  if (argc > 1 && std::string(argv[1]) == "help") {  // "help run" is "run --help"
    words.erase(words.begin() + 1);
    words.push_back(help.data());
  }
  return command_line::run_program([&] {
    const std::string command = words.size() > 1 ? words[1] : "";
    if (command == "new-cell") return become("proxarm-new-cell", words, "makes cells", "./dev new-cell");
    if (command == "study") return become("proxarm-study", words, "measures", "./dev study");
    if (command == "view") return become("proxarm-view", words, "shows", "./dev view");
    return run(static_cast<int>(words.size()), words.data());
  });
}
