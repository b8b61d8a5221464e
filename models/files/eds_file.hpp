// Reads an electronic data sheet (EDS) or device configuration file (DCF) of a CANopen device, CiA 306-1: its objects
// and their types and, in a DCF, the values to set.
//
//   [DeviceInfo]   VendorNumber, ProductNumber, RevisionNumber
//   [6064]         ParameterName, DataType (CiA 301, table 44), AccessType, PDOMapping, DefaultValue
//   [60C2sub1]     a sub-index; [1400] with CompactSubObj=5: sub-indices 1 to 5 alike
//   DCF only:      ParameterValue of an object, [1400Value] of compact ones, [DeviceComissioning] (sic) NodeID
// Values relative to $NODEID are known only in a DCF, which names its node.
//
// Makers' files deviate from the standard, mostly in unused objects. So a mistake in an object is stored with it, and
// only code that needs the object refuses it. `remarks` lists all mistakes. An unreadable default counts as unknown,
// but values that a DCF sets must be readable.
#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace proxarm::description {

struct EdsObject {
  std::string name;
  int type = 0;  // number in CiA 301, table 44; 0: not a type of 1 to 64 bits
  int bits = 0;  // of its data type; 0: not 1 to 64 bits, for example a text
  bool readable = true, writable = true, mappable = false;
  std::optional<std::uint32_t> default_value, value;  // value: set by a DCF
  std::optional<std::uint32_t> default_offset;        // instead of default_value: added to the node's number
  std::string default_text;                           // default of an object without bits: a text
  std::optional<std::int64_t> low, high;              // limits, unless they make no sense
  int line = 0;                                       // of its section
  std::string mistake;                                // its first mistake, with file and line; empty: none
};

struct EdsFile {
  std::filesystem::path file;
  std::optional<std::uint32_t> vendor, product, revision;
  std::optional<int> node;                     // DCF
  std::map<std::uint32_t, EdsObject> objects;  // by index << 8 | sub-index
  std::vector<std::string> remarks;            // one per line

  [[nodiscard]] const EdsObject* find(std::uint32_t object) const noexcept;
};

// Throws SetupError, with file, line and "[section] key", if the file can't be used at all.
EdsFile load_eds(const std::filesystem::path& file);
EdsFile parse_eds(std::string_view text, const std::filesystem::path& file);

}  // namespace proxarm::description
