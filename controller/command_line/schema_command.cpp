#include <cstdio>

#include "controller/command_line/commands.hpp"
#include "controller/command_line/preparation/data_files.hpp"
#include "controller/command_line/schema/file_model.hpp"
#include "controller/command_line/schema/json_schema.hpp"
#include "controller/command_line/schema/key_tables.hpp"

namespace proxarm::command_line {

int schema_command(const SchemaOptions& options) {
  const MapModel model = model_of(Specimens(shipped_file("schema/specimens"), options.kind));
  const std::string text =
      options.markdown ? key_tables(model, options.kind) : schema_of_file(model, options.kind).dump(2) + "\n";
  std::fputs(text.c_str(), stdout);
  return 0;
}

}  // namespace proxarm::command_line
