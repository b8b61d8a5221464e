#include "controller/preparation/proof_file.hpp"

#include <chrono>
#include <cstdio>
#include <ctime>
#include <fstream>
#include <iterator>
#include <span>

#include "models/base/setup_error.hpp"
#include "models/base/sha256.hpp"
#include "models/files/yaml_file.hpp"

namespace proxarm::controller {
namespace {

namespace fs = std::filesystem;

constexpr const char* how = "proxarm prove, on this arm; or, on your own responsibility, --without-proof";

void add_file(scenes::Sha256& hash, const fs::path& file) {
  std::ifstream in(file, std::ios::binary);
  const std::string bytes((std::istreambuf_iterator<char>(in)), std::istreambuf_iterator<char>());
  if (!in) throw description::SetupError({.file = file.string(), .message = "can't be read"});
  hash.add(std::as_bytes(std::span(bytes)));
}

[[noreturn]] void refuse_proof(const fs::path& file, const std::string& found) {
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

std::string today() {
  const std::time_t now = std::chrono::system_clock::to_time_t(std::chrono::system_clock::now());
  std::tm utc{};
  gmtime_r(&now, &utc);
  char text[24];
  std::strftime(text, sizeof text, "%Y-%m-%dT%H:%M:%SZ", &utc);
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
  if (!proof.whole) out << "whole: false\n";
  if (!proof.bus_loss.empty()) out << "bus_loss:  # how each drive stopped after the controller's last word\n";
  for (const ProvenStop& stop : proof.bus_loss) {
    char after[32];
    std::snprintf(after, sizeof after, "%.1f", stop.after_ms);
    out << "  - {joint: \"" << stop.joint << "\", stops_after_ms: " << after << ", by: \"" << stop.signs << "\"}\n";
  }
  out.flush();
  if (!out) throw description::SetupError({.file = file.string(), .message = "the proof can't be written"});
}

namespace {

ProofFile read_proof(const fs::path& file) {
  constexpr double longest_ms = 1e4;
  const description::YamlNode root = description::YamlNode::load(file);
  ProofFile proof;
  proof.cell_sha256 = root.string("cell_sha256");
  proof.real_arm = root.choice("arm", {"real", "simulated"}) == "real";
  proof.date = root.string("date");
  proof.verdict = root.string("verdict");
  proof.whole = root.boolean_or("whole", true);
  if (root.has("bus_loss")) {
    for (const description::YamlNode& stop : root.list("bus_loss", 1, 64)) {
      proof.bus_loss.push_back(
          {stop.string("joint"), stop.number("stops_after_ms", 0.0, longest_ms), stop.string("by")});
    }
  }
  root.finish();
  return proof;
}

}  // namespace

std::optional<ProofFile> kept_proof(const fs::path& file, const std::string& cell_sha256, bool real_arm) {
  std::error_code ignored;
  if (!fs::exists(file, ignored)) return std::nullopt;
  try {
    const ProofFile proof = read_proof(file);
    if (proof.cell_sha256 == cell_sha256 && proof.real_arm == real_arm) return proof;
  } catch (const description::SetupError&) {
    return std::nullopt;  // the new proof will replace an unreadable file
  }
  return std::nullopt;
}

void require_proof(const PreparedSession& session) {
  const fs::path file = proof_path(session.cell);
  std::error_code ignored;
  if (!fs::exists(file, ignored)) refuse_proof(file, "no proof");
  const ProofFile proof = read_proof(file);
  if (!proof.real_arm) refuse_proof(file, "a proof on a simulated arm");
  if (proof.cell_sha256 != cell_sha256(session))
    refuse_proof(file, "a proof of another cell, or of this one before it, its URDF or its sensor's file was changed");
  if (!proof.whole) refuse_proof(file, "a proof of what drives do without the controller, and of nothing else");
  for (const description::DriveDescription& drive : session.cell.drives) {
    if (drive.bring_up.stops_by != description::StopsBy::heartbeat && proof.bus_loss.empty()) {
      refuse_proof(file, "a proof without --bus-loss, though the drive of " + drive.joint +
                             " isn't stopped by the heartbeat (bring_up: stops_by)");
    }
  }
}

}  // namespace proxarm::controller
