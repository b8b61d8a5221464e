#include "controller/options/run_words.hpp"

#include <algorithm>

#include "controller/options/parsing/option_parsing.hpp"
#include "controller/options/session_options.hpp"
#include "models/base/quantity.hpp"
#include "models/base/setup_error.hpp"

namespace proxarm::controller {
namespace {

void add_supervision_options(CLI::App& app, RunOptions& options) {
  app.add_option("--do", options.orders,
                 "by script, counted from the first cycle: hold, resume, release, \"back-off 20mm\" or reset, such as "
                 "hold@2s; may be repeated")
      ->type_name("ORDER@TIME")
      ->expected(1)
      ->multi_option_policy(CLI::MultiOptionPolicy::TakeAll);
  app.add_option(
         "--handle",
         choice<bool>("--handle", {{"auto", false}, {"held", true}},
                      [&](bool is) { options.settings.always_held = is; }),
         "held: a hand or a load always acts on the handle, and no force is taken for the sensor's bias; the arm "
         "coasts when it is let go. auto (default): a handle that nobody holds is found out")
      ->type_name("auto|held");
  add_quantity(app, "--wait-after-fault", description::parse_duration, options.settings.wait_after_fault_s,
               "after a stop by a fault, how long to wait for `proxarm reset` (default: the session ends)")
      ->type_name("TIME");
  app.add_option(
         "--accept-force",
         quantity([](const std::string& w) { return description::parse_force(w, "--accept-force"); },
                  [&](double value) { options.settings.tare_spread_N = options.settings.zero_drift_N = value; }),
         "start with a force of up to this on the handle while the sensor is tared (default: it may vary by 5 N, "
         "and its mean by the cell's sensor.zero_drift_N); its mean is taken as zero")
      ->type_name("N");
  add_without_enabling(app, options);
  add_hardware_option(app, options);
  app.add_flag("--without-proof", options.without_proof,
               "real drives of a cell that `proxarm prove` hasn't proven on them");
}

}  // namespace

void add_run_options(CLI::App& app, RunOptions& options) {
  add_session_options(app, options);
  add_fault_option(app, options);
  add_arm_option(app, options.arm);
  add_enabling_option(app, options);
  add_supervision_options(app, options);
  app.add_option("--pace",
                 choice<Pace>("--pace", {{"virtual", Pace::virtual_time}, {"realtime", Pace::realtime}},
                              [&](Pace value) { options.pace = value; }),
                 "virtual (default in-process) or realtime")
      ->type_name("virtual|realtime");
  app.add_option("--order",
                 choice<int>("--order", {{"1", 1}, {"2", 2}}, [&](int value) { options.settings.order = value; }),
                 "1: eq. (26) (default); 2: its second-order sibling")
      ->type_name("1|2");
  add_turning_options(app, options);
  app.add_option(
         "--passivity",
         choice<Passivity>("--passivity",
                           {{"off", Passivity::off},
                            {"observe", Passivity::observe},
                            {"auto", Passivity::automatic},
                            {"on", Passivity::on}},
                           [&](Passivity value) { options.passivity = value; }),
         "observe: energies at the hand's and the proxy's port, and oscillations; auto (the default): add damping "
         "against those that last; on: against any at once; off: none of it")
      ->type_name("off|observe|auto|on");
  CLI::Option* record = app.add_option("--record", options.record_dir, "write the session to this folder");
  record->type_name("DIR");
  app.add_option(
         "--signals",
         choice<SignalsForm>(
             "--signals", {{"csv", SignalsForm::csv}, {"binary", SignalsForm::binary}, {"packed", SignalsForm::packed}},
             [&](SignalsForm form) { options.signals = form; }),
         "how the record keeps its rows: packed (the default: a quarter of the size, frames.log with them), binary "
         "(signals.bin: numbers in columns, which load in no time) or csv (signals.csv); `proxarm signals` makes text "
         "of all")
      ->type_name("packed|binary|csv")
      ->needs(record);
  app.add_option("--set", options.changes,
                 "change a parameter when so much time has been rendered (holds and stops don't count), such as "
                 "mass=3@4s (mass, damping, spring, inertia, turning_damping, turning_spring, tool_mass, "
                 "tool_centre_m, lookahead, timestep, "
                 "OBJECT.friction, OBJECT.position_m); may be repeated")
      ->type_name("NAME=VALUE@TIME")
      ->expected(1)
      ->multi_option_policy(CLI::MultiOptionPolicy::TakeAll);
  app.add_option("--control", options.control,
                 "take changes from `proxarm set` at this Unix socket, for its owner alone (default: none; PATH "
                 "\"default\": where `proxarm set` looks by itself)")
      ->type_name("PATH");
  app.add_option("--black-box", options.black_box_dir,
                 "where the last ten seconds go after a fault or a crash (default: black-box in the record, or "
                 "proxarm-black-box)")
      ->type_name("DIR");
  app.add_option("--plot", options.plot_file, "write the plot to this SVG file")->type_name("FILE");
  app.add_flag_callback(
      "--no-plot", [&] { options.plot = false; }, "draw no plot");
  add_view_options(app, options,
                   "show the session in a browser, at an address on this machine that is printed; virtual time keeps "
                   "pace with the clock then, and what is shown stays until Ctrl-C");
  app.add_flag("--view-control", options.view_control,
               "the same, and let it be changed there, as `proxarm set` and `proxarm hold` do");
  app.add_flag("--json", options.json, "print the summary as one JSON object");
  app.add_flag("--verbose", options.verbose, "print all figures, not the summary's eight lines");
  app.add_flag("--force-unstable", options.force_unstable,
               "simulation only: run with a mass that is predicted unstable");
}

namespace {

// The options, and a command that parses nothing else.
struct Table {
  RunOptions options;
  CLI::App app{"", "run"};

  Table() {
    add_run_options(app, options);
    refuse_options_as_values(app);
  }
};

}  // namespace

RunOptions run_options(const std::vector<std::string>& words) {
  Table table;
  try {
    table.app.parse(std::vector<std::string>(words.rbegin(), words.rend()));  // CLI11 takes them from the end
  } catch (const CLI::ParseError& error) {
    if (error.get_exit_code() == 0) {
      throw description::SetupError(
          {.found = "--help", .expected = "options alone", .advice = "see proxarm run --help"});
    }
    throw description::SetupError(
        {.message = options_mistake(table.app, words, error), .advice = "see proxarm run --help"});
  }
  return table.options;
}

std::optional<std::string> run_option_type(const std::string& name) {
  const Table table;
  const CLI::Option* const option = table.app.get_option_no_throw(name);
  if (option == nullptr) return {};
  return option->get_items_expected_max() == 0 ? "" : option->get_type_name();
}

}  // namespace proxarm::controller
