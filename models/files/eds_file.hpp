// An electronic data sheet (EDS) or device configuration (DCF) of a CANopen device, CiA 306-1: what objects it has, of
// which type, and in a DCF what they shall be set to.
//
//   [DeviceInfo]   VendorNumber, ProductNumber, RevisionNumber
//   [6064]         ParameterName, DataType (CiA 301, table 44), AccessType, PDOMapping, DefaultValue
//   [60C2sub1]     a sub-index; [1400] with CompactSubObj=5: sub-indices 1 to 5 alike
//   DCF alone:     ParameterValue of an object, [DeviceComissioning] (sic) NodeID
// Boost reads the INI; sections and keys are found whatever their case. Values that name $NODEID count as unknown.
#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <string_view>

namespace proxarm::description {

struct EdsObject {
  std::string name;
  int bits = 0;  // of its data type; 0: none of 1 to 64 bits, a text for instance
  bool readable = true, writable = true, mappable = false;
  std::optional<std::uint32_t> default_value, value;  // value: what a DCF wants
  int line = 0;                                       // of its section
};

struct EdsFile {
  std::filesystem::path file;
  std::optional<std::uint32_t> vendor, product, revision;
  std::optional<int> node;                     // DCF
  std::map<std::uint32_t, EdsObject> objects;  // by index << 8 | sub-index

  [[nodiscard]] const EdsObject* find(std::uint32_t object) const noexcept;
};

// Throws SetupError, with file, line and "[section] key".
EdsFile load_eds(const std::filesystem::path& file);
EdsFile parse_eds(std::string_view text, const std::filesystem::path& file);

}  // namespace proxarm::description
