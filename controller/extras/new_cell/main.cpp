// Defines the program that `proxarm new-cell` becomes. It is a separate program because it is used once for an arm.
//
// Exit status: 0: fine; 2: set-up mistake.
#include <CLI/CLI.hpp>
#include <memory>

#include "controller/command_line/entry/help.hpp"
#include "controller/command_line/entry/program.hpp"
#include "controller/command_line/entry/separate_commands.hpp"
#include "controller/extras/new_cell/new_cell.hpp"
#include "controller/options/parsing/option_parsing.hpp"

namespace {

using namespace proxarm;
using command_line::NewCellOptions;

void add_options(CLI::App& app, NewCellOptions& options) {
  app.add_option("arm", options.arm, "the arm's URDF, or its xacro (expanded by the program xacro)")
      ->type_name("FILE")
      ->required();
  app.add_option("arguments", options.xacro_arguments, "of the xacro: NAME:=VALUE")->type_name("NAME:=VALUE");
  app.add_option("--package", options.packages, "where a package is that the file names; repeated: more")
      ->type_name("NAME=DIR")
      ->expected(1)
      ->allow_extra_args(false)  // because a xacro's arguments may follow
      ->multi_option_policy(CLI::MultiOptionPolicy::TakeAll);
  app.add_option("--out", options.out, "folder for the cell and what it names (default: named after the robot)")
      ->type_name("DIR");
  app.add_option("--tip", options.tip, "link that carries the force sensor (default: found)")->type_name("LINK");
  app.add_option("--sensor", options.sensor, "of models/sensors, or a file (default ati_net_can_oem)")
      ->type_name("NAME");
  app.add_option("--drive", options.eds, "EDS or DCF file of the drives (default: none)")->type_name("FILE");
  app.add_option("--buses", options.buses, "how many CAN buses (default: as many as 1 ms needs)")
      ->check(CLI::Range(1, 8))
      ->type_name("N");
  app.add_option("--arm-mass", options.arm_mass_kg, "of the whole arm, kg, for links that don't say theirs")
      ->check(CLI::Range(0.1, 20'000.0))
      ->type_name("KG");
  app.add_flag("--force", options.force, "write over an earlier cell");
}

int run(int argc, char** argv) {
  CLI::App app{command_line::text_of("new-cell"), "proxarm new-cell"};
  app.formatter(std::make_shared<command_line::HelpFormatter>());
  NewCellOptions options;
  add_options(app, options);
  if (const auto status = command_line::parse_options(app, argc, argv)) return *status;
  return command_line::new_cell_command(options);
}

}  // namespace

int main(int argc, char** argv) {
  return proxarm::command_line::run_program([&] { return run(argc, argv); });
}
