// Reads and writes the proof of a cell, which is the file CELL.proof beside the cell. It says which cell was proven, on
// which arm, and when.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "controller/preparation/prepared_session.hpp"

namespace proxarm::controller {

// How a drive stopped by itself after the controller was silenced on purpose.
struct ProvenStop {
  std::string joint;
  double after_ms = 0.0;  // time from the controller's last frame to the stop
  std::string signs;      // what the drive reported, as text for people
};

struct ProofFile {
  std::string cell_sha256;  // hash of the cell's file, its URDF and its sensor's file, one after the other
  bool real_arm = false;    // false: a simulated arm
  std::string date;         // UTC
  std::string verdict;      // what was proven, as text for people
  bool whole = true;        // true: signs, ratios, sensor and brakes are proven; false: only the bus loss is
  std::vector<ProvenStop> bus_loss;
};

// Returns ProofFile::cell_sha256 for the session's cell. Throws SetupError if one of the files can't be read.
std::string cell_sha256(const PreparedSession& session);
// Returns the present date and time in UTC.
std::string today();
std::filesystem::path proof_path(const description::Cell& cell);

// Returns the proof in the file if it is of this cell and on this kind of arm, real or simulated; otherwise nullopt.
std::optional<ProofFile> kept_proof(const std::filesystem::path& file, const std::string& cell_sha256, bool real_arm);

// Throws SetupError if the file can't be written.
void write_proof(const std::filesystem::path& file, const ProofFile& proof);

// Throws SetupError unless the cell in its present form has been proven on a real arm.
void require_proof(const PreparedSession& session);

}  // namespace proxarm::controller
