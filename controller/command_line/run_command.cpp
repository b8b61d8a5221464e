#include <cstdio>
#include <memory>

#include "controller/command_line/commands.hpp"
#include "controller/command_line/sessions/interface_run.hpp"
#include "controller/command_line/sessions/simulated_run.hpp"
#include "controller/command_line/sessions/view_process.hpp"
#include "controller/command_line/sessions/zero_run.hpp"
#include "controller/library/simulated_loop.hpp"
#include "controller/live/live_parameters.hpp"
#include "controller/preparation/prepared_session.hpp"
#include "controller/preparation/start_check.hpp"
#include "models/base/setup_error.hpp"

namespace proxarm::command_line {

namespace {

void refuse_for_interfaces(const controller::RunOptions& options) {
  if (!options.arm.empty()) {
    throw description::SetupError({.key = "--arm",
                                   .found = "a bus that isn't simulated",
                                   .expected = "--bus sim, where the arm is simulated",
                                   .advice = "on an interface, give it to `proxarm sim`"});
  }
  if (!options.faults.empty()) {
    throw description::SetupError({.key = "--fault",
                                   .found = "a bus that isn't simulated",
                                   .expected = "--bus sim, where devices can be made to fail",
                                   .advice = "on an interface, give it to `proxarm sim`"});
  }
  if (!options.enabling.empty()) {
    throw description::SetupError({.key = "--enabling",
                                   .found = "a bus that isn't simulated",
                                   .expected = "--bus sim, where the enabling switch is simulated",
                                   .advice = "on an interface, give it to `proxarm sim`"});
  }
  if (options.pace == controller::Pace::virtual_time) {
    throw description::SetupError({.key = "--pace",
                                   .found = "virtual with --bus on an interface",
                                   .expected = "realtime: the kernel's interfaces live by the machine's clock",
                                   .advice = "leave --pace away, or use --bus sim"});
  }
}

}  // namespace

namespace {

// What the view asks for of the other options.
controller::RunOptions with_view(controller::RunOptions options) {
  options.view = options.view || options.view_control;
  if (options.view_control && options.control.empty()) options.control = view_control_path();
  return options;
}

void refuse_view(const controller::PreparedSession& session, const controller::RunOptions& options) {
  if (options.view_control && session.impedance()) {
    throw description::SetupError({.key = "--view-control",
                                   .found = "the impedance type",
                                   .expected = "--scheme admittance, or --view, which only looks"});
  }
  controller::require_view(options);
}

}  // namespace

int run_command(const controller::RunOptions& given) {
  controller::RunOptions options = with_view(given);
  controller::require_interface_for_hardware(options);
  if (!options.bus.simulated()) refuse_for_interfaces(options);
  controller::PreparedSession session = controller::prepare(options);
  know_zero(session, options);
  controller::warn_of_surprises(session);
  controller::require_runnable(session, options);
  refuse_view(session, options);
  controller::require_changes(session, options);
  BlackBoxKeeper keeper(session, options);
  std::unique_ptr<ViewProcess> view;
  if (options.view) {
    view = std::make_unique<ViewProcess>(session, options, keeper.box().descriptor());
    options.view_place = view->place();
  }
  const int status = options.bus.simulated()
                         ? SimulatedRun(session, controller::simulated_arm(session, options), options, keeper).run()
                         : run_on_interfaces(session, options, keeper);
  if (options.view_control && given.control.empty()) remove_view_control();
  if (view) view->show_end(status);
  return status;
}

}  // namespace proxarm::command_line
