#include <cstdio>
#include <filesystem>
#include <fstream>
#include <string>
#include <string_view>
#include <system_error>

#include "controller/command_line/commands.hpp"
#include "controller/command_line/entry/exit_status.hpp"
#include "controller/signals/signal_table.hpp"
#include "models/base/setup_error.hpp"
#include "models/packed/packed.hpp"

namespace proxarm::command_line {
namespace {

namespace fs = std::filesystem;
using description::SetupError;

constexpr std::size_t piece_bytes = 1 << 16;

// Returns whether the text was written. If it wasn't, run_program() reports the failure at the end.
bool print(std::string_view text) { return std::fwrite(text.data(), 1, text.size(), stdout) == text.size(); }

void print_text(const fs::path& file) {
  std::ifstream in(file, std::ios::binary);
  std::string piece(piece_bytes, '\0');
  do {
    in.read(piece.data(), static_cast<std::streamsize>(piece.size()));
  } while (print(std::string_view(piece.data(), static_cast<std::size_t>(in.gcount()))) && in);
}

void print_table(const fs::path& file) {
  const controller::SignalTable table(file);
  std::string text = table.header() + "\n";
  for (std::size_t row = 0; row < table.rows(); ++row) {
    table.append_row(text, row);
    text += '\n';
    if (text.size() < piece_bytes) continue;
    if (!print(text)) return;
    text.clear();
  }
  print(text);
}

void print_packed(const fs::path& file) {
  std::ifstream in(file, std::ios::binary);
  if (models::unpack(in, print)) return;
  throw SetupError(
      {.file = file.string(), .found = "frames that are damaged", .expected = "what a session has written"});
}

}  // namespace

int signals_command(const SignalsOptions& options) {
  const std::string name = options.frames ? "frames" : options.contacts ? "contacts" : "signals";
  const std::string numbers = options.frames ? "frames.log.zst" : name + ".bin";
  const std::string lines = options.frames ? "frames.log" : name + ".csv";
  const fs::path table = options.folder / numbers, text = options.folder / lines;
  std::error_code error;
  if (fs::is_regular_file(table, error)) {
    options.frames ? print_packed(table) : print_table(table);
  } else if (fs::is_regular_file(text, error)) {
    print_text(text);
  } else {
    throw SetupError({.file = options.folder.string(),
                      .found = "neither " + numbers + " nor " + lines,
                      .expected = "the folder of a record"});
  }
  return fine;
}

}  // namespace proxarm::command_line
