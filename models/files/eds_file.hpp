// An electronic data sheet (EDS) or device configuration (DCF) of a CANopen device, CiA 306-1: what objects it has, of
// which type, and in a DCF what they shall be set to.
//
//   [DeviceInfo]   VendorNumber, ProductNumber, RevisionNumber
//   [6064]         ParameterName, DataType (CiA 301, table 44), AccessType, PDOMapping, DefaultValue
//   [60C2sub1]     a sub-index; [1400] with CompactSubObj=5: sub-indices 1 to 5 alike
//   DCF alone:     ParameterValue of an object, [1400Value] of compact ones, [DeviceComissioning] (sic) NodeID
// Values relative to $NODEID are unknown in an EDS, and known in a DCF, which names its node.
//
// Makers' files deviate from the standard, mostly in objects that nobody asks for. So a mistake in an object is kept
// with it, and refused by whoever needs that object; a default that can't be read is unknown. `remarks` tells all of
// them. What a DCF sets must be readable.
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
  int type = 0;  // by its number in CiA 301, table 44; 0: none of 1 to 64 bits
  int bits = 0;  // of its data type; 0: none of 1 to 64 bits, a text for instance
  bool readable = true, writable = true, mappable = false;
  std::optional<std::uint32_t> default_value, value;  // value: what a DCF wants
  std::optional<std::uint32_t> default_offset;        // instead of default_value: what is added to the node's number
  std::string default_text;                           // of an object without bits: a text
  std::optional<std::int64_t> low, high;              // limits, where both make sense
  int line = 0;                                       // of its section
  std::string mistake;                                // what is wrong with it, with file and line; else empty
};

struct EdsFile {
  std::filesystem::path file;
  std::optional<std::uint32_t> vendor, product, revision;
  std::optional<int> node;                     // DCF
  std::map<std::uint32_t, EdsObject> objects;  // by index << 8 | sub-index
  std::vector<std::string> remarks;            // a line each

  [[nodiscard]] const EdsObject* find(std::uint32_t object) const noexcept;
};

// Throws SetupError, with file, line and "[section] key", where nothing can be made of the file.
EdsFile load_eds(const std::filesystem::path& file);
EdsFile parse_eds(std::string_view text, const std::filesystem::path& file);

}  // namespace proxarm::description
