#include "controller/command_line/commands.hpp"
namespace proxarm::command_line {
int sim_command(const RunOptions&) { return 2; }
int plan_command(const RunOptions&) { return 2; }
int check_command(const FileOptions&) { return 2; }
int explain_command(const FileOptions&) { return 2; }
}  // namespace proxarm::command_line
