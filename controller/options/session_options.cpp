#include "controller/options/session_options.hpp"

#include <utility>

#include "controller/options/parsing/option_parsing.hpp"
#include "models/base/quantity.hpp"
#include "models/base/setup_error.hpp"
#include "sim/devices/device_fault.hpp"
#include "sim/devices/enabling_switch.hpp"

namespace proxarm::controller {

void add_session_options(CLI::App& app, RunOptions& options) {
  app.add_option("cell", options.cell,
                 "cell file (default: models/cells/default.yaml, a six-axis arm of the 150 kg class)")
      ->type_name("FILE");
  app.add_option("--scene", options.scene, "scene file (default: the cell's)")->type_name("FILE");
  app.add_option("--hand", options.hand,
                 "file of the simulated hand, such as sim/hands/touch.yaml (default: the cell's)")
      ->type_name("FILE");
  add_quantity(app, "--mass", description::parse_mass, options.mass_kg,
               "mass that the hand feels, in kg, handle included")
      ->type_name("KG");
  add_quantity(app, "--damping", description::parse_damping, options.damping_Ns_per_m,
               "damping against the world, in Ns/m (default: the cell's, else 0); impedance: of the virtual coupling "
               "(default 8)")
      ->type_name("NS/M");
  add_quantity(app, "--spring", description::parse_stiffness, options.settings.spring_N_per_m,
               "spring to the start position, in N/m (default 0)")
      ->type_name("N/M");
  add_quantity(app, "--stiffness", description::parse_stiffness, options.stiffness_N_per_m,
               "impedance: stiffness of the virtual coupling, in N/m (default 750)")
      ->type_name("N/M");
  app.add_option(
         "--scheme",
         choice<Scheme>("--scheme", {{"admittance", Scheme::admittance}, {"impedance", Scheme::impedance}},
                        [&](Scheme value) { options.scheme = value; }),
         "admittance: force in, positions out (drives in csp, ip or on Modbus); impedance: position in, torques "
         "out (drives in cst, a light device). Default: what the cell's drives take")
      ->type_name("admittance|impedance");
  add_quantity(app, "--timestep", description::parse_duration, options.period_s,
               "timestep T with its unit: 1ms, 500us (default: the cell's)")
      ->type_name("TIME");
  add_quantity(app, "--extra-delay", description::parse_duration, options.extra_delay_s,
               "readings of the force sensor are this much older than the cell says, such as 8ms: simulated, and "
               "counted where stability is judged")
      ->type_name("TIME");
  add_quantity(app, "--lookahead", LookaheadChoice::parse, options.lookahead,
               "send the arm to where the proxy is going to be, which makes up for the loop's delay: off (default), "
               "auto, the horizon that is stable with margins for this mass, hand and cell, or a time, such as 8ms")
      ->type_name("auto|off|TIME");
  app.add_option("--gear-damping",
                 choice<bool>("--gear-damping", {{"auto", true}, {"off", false}},
                              [&](bool value) { options.damps_gears = value; }),
                 "auto (default): where drives measure the torque of their gears, damp the arm's elastic modes by it, "
                 "as hard as is stable with margins; off: don't")
      ->type_name("auto|off");
  add_quantity(app, "--duration", description::parse_duration, options.duration_s,
               "how long to render, with its unit (default 10s; at most a week)")
      ->type_name("TIME");
  app.add_option("--bus",
                 quantity([](const std::string& w) { return BusMapping::parse(w); },
                          [&](BusMapping value) { options.bus = std::move(value); }),
                 "sim (default), one interface for all buses, or NAME=INTERFACE,…")
      ->type_name("BUS");
}

void add_turning_options(CLI::App& app, RunOptions& options) {
  app.add_option(
         "--orientation",
         choice<OrientationMode>("--orientation", {{"held", OrientationMode::held}, {"free", OrientationMode::free}},
                                 [&](OrientationMode value) { options.orientation = value; }),
         "held (default): the tool keeps its orientation, as with an inertia beyond all bounds; free: the hand turns "
         "it (the default with --inertia)")
      ->type_name("held|free");
  app.add_option(
         "--tool", options.tool,
         "file of the tool's shape, whose sides touch as well, such as scenes/tools/rod.yaml, or point (default: "
         "the scene's, else the cell's, else a point)")
      ->type_name("FILE|point");
  add_quantity(app, "--inertia", description::parse_inertia, options.inertia_kg_m2,
               "moment of inertia that the hand feels about each axis through the handle's point, in kg m², handle "
               "included; the tool turns under the hand's torque (default of a tool that turns: 0.05 more than the "
               "handle's)")
      ->type_name("KGM2");
  add_quantity(app, "--turning-damping", description::parse_turning_damping, options.turning_damping_Nms_per_rad,
               "damping of a tool that turns, in Nms/rad (default 0 with --inertia, else 0.5)")
      ->type_name("NMS/RAD");
  add_quantity(app, "--turning-spring", description::parse_turning_stiffness, options.turning_spring_Nm_per_rad,
               "spring of a tool that turns to its orientation at the start, in Nm/rad (default 0)")
      ->type_name("NM/RAD");
}

void add_fault_option(CLI::App& app, RunOptions& options) {
  app.add_option(
         "--fault", CLI::callback_t([&](const CLI::results_t& words) {
           for (const std::string& word : words) options.faults.push_back(sim::parse_device_fault(word));
           return true;
         }),
         "simulated devices only, may be repeated: let one fail, as DEVICE:KIND[=VALUE][@FROM[..UNTIL]], times "
         "counted from power on, some 0.2 s before the first cycle. DEVICE is a joint (KIND: silent, fault=EMCY code, "
         "device_type=VALUE, lacks=OBJECT, fixed=OBJECT, homed, heartbeat, sdo, "
         "period, power, jammed, ignored, reversed, runaway=rad/s, weak=Nm, offset=rad, stuck) or sensor (KIND: "
         "silent, samples, frozen, half, swapped, duplicated, short, checksum, "
         "saturated, lost=N, status=BITS, "
         "delay=US, channel=N, offset=FORCE, drift=N/s, scale=NUMBER, inverted, turned). Such as axis_2:silent@2s, "
         "axis_3:fault=0x4210@2s, sensor:frozen@1s..1.5s")
      ->type_name("TEXT")
      ->expected(1)
      ->multi_option_policy(CLI::MultiOptionPolicy::TakeAll);
}

void add_arm_option(CLI::App& app, std::filesystem::path& arm) {
  app.add_option("--arm", arm,
                 "cell file of the simulated arm, where it is another one than the controller takes it for")
      ->type_name("FILE");
}

void add_enabling_option(CLI::App& app, RunOptions& options) {
  app.add_option("--enabling", CLI::callback_t([&](const CLI::results_t& words) {
                   for (const std::string& word : words) options.enabling.push_back(sim::parse_pressed_span(word));
                   return true;
                 }),
                 "simulated enabling switch only, may be repeated: when it is pressed, FROM..UNTIL counted from the "
                 "first cycle, such as 0.5s..3s (default: from 0.1s on); for a cell with enabling_input. "
                 "squeezed:2s..2.5s: a switch with three positions is squeezed through")
      ->type_name("[squeezed:]TIME..TIME")
      ->expected(1)
      ->multi_option_policy(CLI::MultiOptionPolicy::TakeAll);
}

void add_without_enabling(CLI::App& app, RunOptions& options) {
  app.add_flag("--without-enabling-input", options.settings.without_enabling_input,
               "leave out the cell's enabling input; needed on real interfaces for a cell that has none");
}

void add_hardware_option(CLI::App& app, RunOptions& options) {
  app.add_flag("--hardware{ask}", options.hardware,
               "drives on real interfaces: shows a checklist to be confirmed on the terminal (scripts: "
               "--hardware=checked)");
}

void add_view_options(CLI::App& app, RunOptions& options, const char* what) {
  app.add_flag("--view", options.view, what);
  app.add_option(
         "--view-port",
         whole_number("--view-port",
                      [&](std::uint64_t port) {
                        if (port < 1024 || port > 65535) {
                          throw description::SetupError(
                              {.key = "--view-port", .found = std::to_string(port), .expected = "1024 to 65535"});
                        }
                        options.view_port = static_cast<std::uint16_t>(port);
                      }),
         "the port of the view on 127.0.0.1 (default: any that is free)")
      ->type_name("PORT");
  app.add_option("--allow-origin", options.allowed_origins,
                 "a web page of this origin, such as https://app.example.org, may look as well, if it knows the "
                 "address with its token; may be repeated")
      ->type_name("ORIGIN")
      ->expected(1)
      ->multi_option_policy(CLI::MultiOptionPolicy::TakeAll);
}

void leave_out(CLI::App& app, std::initializer_list<const char*> options) {
  for (const char* option : options) app.remove_option(app.get_option(option));
}

}  // namespace proxarm::controller
