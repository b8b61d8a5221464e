// Reads an electronic data sheet (EDS) or a device configuration file (DCF) of a CANopen device, CiA 306-1. Both
// contain the device's objects with their types. A DCF also contains the values to set.
//
//   [DeviceInfo]   VendorNumber, ProductNumber, RevisionNumber
//   [6064]         ParameterName, DataType (CiA 301, table 44), AccessType, PDOMapping, DefaultValue
//   [60C2sub1]     a sub-index; [1400] with CompactSubObj=5: sub-indices 1 to 5, which are alike
//   DCF only:      ParameterValue of an object; [1400Value] for compact sub-indices; [DeviceComissioning] (sic) NodeID
// Values relative to $NODEID are known only in a DCF, because a DCF states the node's number.
//
// Makers' files deviate from the standard, mostly in objects that aren't used. Therefore a mistake in an object is
// stored with the object, and only code that needs the object refuses the file. `remarks` contains all mistakes. An
// unreadable default counts as unknown, but a value that a DCF sets must be readable.
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
  int type = 0;  // the type's number in CiA 301, table 44; 0: not a type of 1 to 64 bits
  int bits = 0;  // bits of the data type; 0: not 1 to 64 bits, for example a text
  bool readable = true, writable = true, mappable = false;
  // `value` is set by a DCF.
  std::optional<std::uint32_t> default_value, value;
  // Replaces default_value if the default is relative to $NODEID: the default is then default_offset plus the node's
  // number.
  std::optional<std::uint32_t> default_offset;
  std::string default_text;  // the default if the object is a text, which has no bits
  // The limits; nullopt if the file's limits make no sense.
  std::optional<std::int64_t> low, high;
  int line = 0;  // the line of the object's section
  // The first mistake in the object, with file and line; empty: no mistake.
  std::string mistake;
};

struct EdsFile {
  std::filesystem::path file;
  std::optional<std::uint32_t> vendor, product, revision;
  std::optional<int> node;                     // only in a DCF
  std::map<std::uint32_t, EdsObject> objects;  // by index << 8 | sub-index
  std::vector<std::string> remarks;            // all mistakes, one per line

  [[nodiscard]] const EdsObject* find(std::uint32_t object) const noexcept;
};

// Read an EDS or a DCF. Both throw SetupError, with file, line and "[section] key", if the file can't be used at all.
EdsFile load_eds(const std::filesystem::path& file);
EdsFile parse_eds(std::string_view text, const std::filesystem::path& file);

}  // namespace proxarm::description
