#include "controller/preparation/file_kind.hpp"

#include <algorithm>
#include <cctype>
#include <string>

#include "models/files/yaml_file.hpp"
#include "scenes/format/tool_file.hpp"

namespace proxarm::controller {
namespace {

namespace fs = std::filesystem;

FileKind kind_of_yaml(const description::YamlNode& root) {
  if (!root.is_map()) return FileKind::unknown;
  if (root.has("drives") || root.has("urdf")) return FileKind::cell;
  if (root.has("protocol") && root.has("command")) return FileKind::registers;
  if (root.has("protocol")) return FileKind::sensor;
  for (const char* key : {"waypoints", "multisine", "trajectory", "force", "stiffness_N_per_m"}) {
    if (root.has(key)) return FileKind::hand;
  }
  for (const char* key : {"objects", "media", "coulomb_field", "guide", "space", "dimensions"}) {
    if (root.has(key)) return FileKind::scene;
  }
  if (root.has("parts")) return FileKind::tool;
  for (const std::string& key : scenes::tool_kinds()) {
    if (root.has(key)) return FileKind::tool;
  }
  return FileKind::unknown;
}

const char* name_of(FileKind kind) {
  switch (kind) {
    case FileKind::cell:
      return "a cell file";
    case FileKind::scene:
      return "a scene file";
    case FileKind::tool:
      return "a tool file";
    case FileKind::hand:
      return "a hand file";
    case FileKind::sensor:
      return "a sensor's description";
    case FileKind::registers:
      return "a register map of a Modbus drive";
    case FileKind::urdf:
      return "a URDF file, the arm alone";
    case FileKind::eds:
      return "a description of a CANopen device";
    case FileKind::dbc:
      return "a list of messages and signals";
    case FileKind::mesh:
      return "a mesh";
    case FileKind::unknown:
      break;
  }
  return "a file of another kind";
}

const char* advice_for(FileKind kind) {
  switch (kind) {
    case FileKind::cell:
      return "give it without an option";
    case FileKind::scene:
      return "give it as --scene FILE";
    case FileKind::tool:
      return "give it to proxarm run as --tool FILE";
    case FileKind::hand:
      return "give it as --hand FILE";
    case FileKind::mesh:
      return "a scene names it: `objects: [{mesh: {file: part.stl, scale_m: 0.001}}]`";
    default:
      return "a cell file names it; models/cells/default.yaml is an example";
  }
}

}  // namespace

FileKind kind_of(const fs::path& file) {
  std::string extension = file.extension().string();
  std::transform(extension.begin(), extension.end(), extension.begin(),
                 [](unsigned char c) { return std::tolower(c); });
  if (extension == ".eds" || extension == ".dcf") return FileKind::eds;
  if (extension == ".dbc") return FileKind::dbc;
  if (extension == ".urdf") return FileKind::urdf;
  if (extension == ".stl" || extension == ".obj" || extension == ".ply") return FileKind::mesh;
  std::error_code ignored;
  if (!fs::is_regular_file(file, ignored)) return FileKind::unknown;
  try {
    return kind_of_yaml(description::YamlNode::load(file));
  } catch (const description::SetupError&) {  // the file's loader will report the error with its line
  }
  return FileKind::unknown;
}

void require_kind(const fs::path& file, FileKind expected) {
  const FileKind found = kind_of(file);
  if (found == expected || found == FileKind::unknown) return;
  throw description::SetupError(
      {.file = file.string(), .found = name_of(found), .expected = name_of(expected), .advice = advice_for(found)});
}

}  // namespace proxarm::controller
