// The proof of a cell as a file beside it, CELL.proof: for which cell it was given, on which arm, and when.
#pragma once

#include <filesystem>
#include <string>

#include "controller/command_line/preparation/prepared_session.hpp"

namespace proxarm::command_line {

struct ProofFile {
  std::string cell_sha256;  // of the cell's file, its URDF and its sensor's, one after the other
  bool real_arm = false;    // else a simulated one
  std::string date;         // UTC
  std::string verdict;      // for people
};

// Throws SetupError where one of the files can't be read.
std::string cell_sha256(const PreparedSession& session);
std::filesystem::path proof_path(const description::Cell& cell);

// Throws SetupError where it can't be written.
void write_proof(const std::filesystem::path& file, const ProofFile& proof);

// Throws SetupError unless the cell as it is now has been proven on a real arm.
void require_proof(const PreparedSession& session);

}  // namespace proxarm::command_line
