// Defines proxarm's command line: the commands, their options and the help.
//
// Exit status: 0: fine; 1: a fault ended the run, or the arm oscillated; 2: set-up mistake.
#include <CLI/CLI.hpp>
#include <cstdint>
#include <string>
#include <utility>

#include "controller/command_line/commands.hpp"
#include "controller/command_line/entry/command_app.hpp"
#include "controller/command_line/entry/program.hpp"
#include "controller/command_line/entry/separate_commands.hpp"
#include "controller/options/parsing/option_parsing.hpp"
#include "controller/options/run_words.hpp"
#include "controller/options/session_options.hpp"
#include "models/base/quantity.hpp"
#include "models/base/setup_error.hpp"
#include "models/base/text.hpp"

namespace {

using namespace proxarm;
using command_line::CommandApp;
using controller::add_enabling_option;
using controller::add_fault_option;
using controller::add_quantity;
using controller::add_run_options;
using controller::add_session_options;
using controller::add_view_options;
using controller::leave_out;
using controller::RunOptions;

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

// Adds all commands with their options to proxarm's command line.
class Commands {
 public:
  explicit Commands(CommandApp& app) : app_(app) {
    add_sessions();
    add_bus();
    add_orders();
    add_files();
    for (const auto& command : command_line::separate_commands()) app_.add_line(command.name, command.text);
  }

 private:
  void add_sessions() {
    add_run_options(*app_.add("run", "render a scene on a simulated or real arm",
                              [this] { return command_line::run_command(run_); }),
                    run_);
    CLI::App* sim = app_.add("sim", "the simulated arm as a process of its own on CAN interfaces",
                             [this] { return command_line::sim_command(sim_); });
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
    CLI::App* plan = app_.add("plan", "bus budget of a cell; status 1 if it can't be carried",
                              [this] { return command_line::plan_command(plan_); });
    add_session_options(*plan, plan_);
    leave_out(*plan, {"--scene", "--hand", "--mass", "--damping", "--spring", "--stiffness", "--extra-delay",
                      "--lookahead", "--gear-damping", "--duration"});
    CLI::App* scan = app_.add("scan", "what is on a CAN interface: listens, then asks; changes nothing",
                              [this] { return command_line::scan_command(scan_); });
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
    CLI::App* set = app_.add(
        "set",
        "change mass, inertia, damping, spring, tool, timestep, or an object's friction or place, in a running session",
        [this] { return command_line::set_command(set_); });
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
      CLI::App* order = app_.add(name, help, [this, line = std::string(name), has_distance] {
        set_.changes = {has_distance ? line + " " + distance_ : line};
        return command_line::set_command(set_);
      });
      order->add_option("--control", set_.control, control_text)->type_name("PATH");
      if (has_distance) order->add_option("distance", distance_, "such as 20mm")->required();
    }
  }

  void add_status(const char* control_text) {
    CLI::App* status = app_.add("status", "how a running session is: phase, force, speed, limits, delay",
                                [this] { return command_line::status_command(status_); });
    status->add_option("--control", status_.control, control_text)->type_name("PATH");
    status->add_flag("--watch", status_.watch, "four times a second, until the session ends");
    status->add_flag("--json", status_.json, "a line of JSON (docs/reference/files.md#the-status-of-a-session)");
  }

  void add_files() {
    CLI::App* replay = app_.add("replay", "a recorded session or black box again, by the controller alone",
                                [this] { return command_line::replay_command(replay_); });
    replay->add_option("folder", replay_.folder, "folder of --record, or of a black box")->required();
    replay->add_flag("--json", replay_.json, "print the result as one JSON object");
    CLI::App* signals = app_.add("signals", "the signals of a record as text, as in signals.csv",
                                 [this] { return command_line::signals_command(signals_); });
    signals->add_option("folder", signals_.folder, "folder of --record")->required();
    CLI::Option* contacts =
        signals->add_flag("--contacts", signals_.contacts, "its contacts instead, as in contacts.csv");
    signals->add_flag("--frames", signals_.frames, "the frames on its buses instead, as in frames.log")
        ->excludes(contacts);
    CLI::App* check =
        app_.add("check", "whether cell, scene, hand, sensor and other files are fine. Status 2: one isn't",
                 [this] { return command_line::check_command(check_); });
    check->add_option("files", check_.files, "files to check")->required();
    check->add_option("--scene", check_.scene, "the scene that cells are held against (default: each cell's own)")
        ->type_name("FILE");
    add_check_options(*check, check_.states);
    app_.add("explain", "what a scene compiles to, what is skipped and why",
             [this] { return command_line::explain_command(explain_); })
        ->add_option("scene", explain_.files, "scene file")
        ->required();
  }

  CommandApp& app_;
  RunOptions run_, sim_, plan_;
  command_line::ReplayOptions replay_;
  command_line::SignalsOptions signals_;
  command_line::ScanOptions scan_;
  command_line::SetOptions set_;
  command_line::StatusOptions status_;
  std::string distance_;
  command_line::CheckFilesOptions check_;
  command_line::FileOptions explain_;
};

int run(int argc, char** argv) {
  CommandApp app(PROXARM_VERSION);
  Commands commands(app);
  return app.run(argc, argv);
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
    command_line::become_separate(words);
    return run(static_cast<int>(words.size()), words.data());
  });
}
