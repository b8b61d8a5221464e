#include "controller/command_line/preparation/proof_file.hpp"

#include <fstream>
#include <iterator>
#include <span>

#include "models/base/setup_error.hpp"
#include "models/base/sha256.hpp"
#include "models/files/yaml_file.hpp"

namespace proxarm::command_line {
namespace {

namespace fs = std::filesystem;

constexpr const char* how = "proxarm prove, on this arm; or, on your own responsibility, --without-proof";

void add_file(scenes::Sha256& hash, const fs::path& file) {
  std::ifstream in(file, std::ios::binary);
  const std::string bytes((std::istreambuf_iterator<char>(in)), std::istreambuf_iterator<char>());
  if (!in) throw description::SetupError({.file = file.string(), .message = "can't be read"});
  hash.add(std::as_bytes(std::span(bytes)));
}

[[noreturn]] void refuse_proof(const fs::path& file, const char* found) {
  throw description::SetupError(
      {.file = file.string(), .found = found, .expected = "a proof of this cell on a real arm", .advice = how});
}

}  // namespace

std::string cell_sha256(const PreparedSession& session) {
  scenes::Sha256 hash;
  for (const fs::path& file : {session.cell.file, session.cell.urdf, session.sensor.file}) add_file(hash, file);
  const auto digest = hash.digest();
  if (!digest) throw description::SetupError({.message = "OpenSSL doesn't compute SHA-256 here"});
  constexpr char digits[] = "0123456789abcdef";
  std::string text;
  for (const unsigned char byte : *digest) {
    text += digits[byte >> 4];
    text += digits[byte & 15];
  }
  return text;
}

fs::path proof_path(const description::Cell& cell) { return fs::path(cell.file.string() + ".proof"); }

void write_proof(const fs::path& file, const ProofFile& proof) {
  std::ofstream out(file);
  out << "# Written by `proxarm prove`; wanted by `proxarm run --hardware`. It certifies nothing.\n"
      << "cell_sha256: \"" << proof.cell_sha256 << "\"\n"
      << "arm: " << (proof.real_arm ? "real" : "simulated") << "\n"
      << "date: \"" << proof.date << "\"\n"
      << "verdict: \"" << proof.verdict << "\"\n";
  out.flush();
  if (!out) throw description::SetupError({.file = file.string(), .message = "the proof can't be written"});
}

void require_proof(const PreparedSession& session) {
  const fs::path file = proof_path(session.cell);
  std::error_code ignored;
  if (!fs::exists(file, ignored)) refuse_proof(file, "no proof");
  const description::YamlNode root = description::YamlNode::load(file);
  const std::string hash = root.string("cell_sha256");
  const std::string arm = root.choice("arm", {"real", "simulated"});
  static_cast<void>(root.string("date"));
  static_cast<void>(root.string("verdict"));
  root.finish();
  if (arm != "real") refuse_proof(file, "a proof on a simulated arm");
  if (hash != cell_sha256(session))
    refuse_proof(file, "a proof of another cell, or of this one before it, its URDF or its sensor's file was changed");
}

}  // namespace proxarm::command_line
