// The proof of a cell as a file beside it, CELL.proof: for which cell it was given, on which arm, and when.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "controller/command_line/preparation/prepared_session.hpp"

namespace proxarm::command_line {

// How a drive stopped when the controller was silent on purpose.
struct ProvenStop {
  std::string joint;
  double after_ms = 0.0;  // of the controller's last word
  std::string signs;      // what it said, for people
};

struct ProofFile {
  std::string cell_sha256;  // of the cell's file, its URDF and its sensor's, one after the other
  bool real_arm = false;    // else a simulated one
  std::string date;         // UTC
  std::string verdict;      // for people
  bool whole = true;        // signs, ratios, sensor and brakes; false: the bus loss alone
  std::vector<ProvenStop> bus_loss;
};

// Throws SetupError where one of the files can't be read.
std::string cell_sha256(const PreparedSession& session);
// Now, in UTC.
std::string today();
std::filesystem::path proof_path(const description::Cell& cell);

// What is there already for this cell on this kind of arm; nullopt: nothing.
std::optional<ProofFile> kept_proof(const std::filesystem::path& file, const std::string& cell_sha256, bool real_arm);

// Throws SetupError where it can't be written.
void write_proof(const std::filesystem::path& file, const ProofFile& proof);

// Throws SetupError unless the cell as it is now has been proven on a real arm.
void require_proof(const PreparedSession& session);

}  // namespace proxarm::command_line
