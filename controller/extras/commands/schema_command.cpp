#include <cstdio>

#include "controller/extras/commands/commands.hpp"
#include "controller/extras/schema/file_model.hpp"
#include "controller/extras/schema/json_schema.hpp"
#include "controller/extras/schema/key_tables.hpp"
#include "controller/preparation/data_files.hpp"

namespace proxarm::command_line {

int schema_command(const SchemaOptions& options) {
  const MapModel model = model_of(Specimens(controller::shipped_file("models/schema/specimens"), options.kind));
  const std::string text =
      options.markdown ? key_tables(model, options.kind) : schema_of_file(model, options.kind).dump(2) + "\n";
  std::fputs(text.c_str(), stdout);
  return 0;
}

}  // namespace proxarm::command_line
