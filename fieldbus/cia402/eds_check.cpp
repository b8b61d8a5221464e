#include "fieldbus/cia402/eds_check.hpp"

#include <algorithm>
#include <cstdio>

#include "fieldbus/canopen/canopen_object.hpp"

namespace proxarm::fieldbus {
namespace {

using description::EdsFile;
using description::EdsObject;
using description::SetupError;

std::uint32_t number_of(ObjectAddress object) noexcept {
  return static_cast<std::uint32_t>(object.index) << 8 | object.sub;
}

std::string section_of(std::uint32_t object) {
  char text[24];
  if ((object & 0xFF) == 0) {
    std::snprintf(text, sizeof text, "[%04X]", object >> 8);
  } else {
    std::snprintf(text, sizeof text, "[%04Xsub%X]", object >> 8, object & 0xFF);
  }
  return text;
}

[[noreturn]] void refuse(const EdsFile& eds, std::uint32_t object, const char* key, std::string found,
                         std::string expected) {
  const EdsObject* there = eds.find(object);
  throw SetupError({.file = eds.file.string(),
                    .line = there == nullptr ? 0 : there->line,
                    .key = section_of(object) + (*key == '\0' ? "" : " ") + key,
                    .found = std::move(found),
                    .expected = std::move(expected),
                    .advice = "is this the drive's own file? `objects` in the cell's file says where a drive has "
                              "something else than the profile"});
}

const EdsObject& require(const EdsFile& eds, std::uint32_t object, int bits, const std::string& for_what) {
  const EdsObject* there = eds.find(object);
  if (there == nullptr) refuse(eds, object, "", "no such object", for_what);
  if (!there->mistake.empty())
    throw description::SetupError({.message = there->mistake, .advice = "wanted: " + for_what});
  if (there->bits != bits) {
    refuse(eds, object, "DataType", std::to_string(there->bits) + " bits", std::to_string(bits) + " bits: " + for_what);
  }
  return *there;
}

bool is_mapping(ObjectAddress object) noexcept {
  const unsigned block = object.index & 0xFE00U;
  return object.sub > 0 && (block == 0x1600 || block == 0x1A00);
}

void check_step(const EdsFile& eds, const SdoStep& step) {
  const bool advised = step.kind == SdoStep::Kind::write && *step.advice != '\0';
  const EdsObject& object = require(eds, number_of(step.object), 8 * step.bytes,
                                    advised ? std::string(step.name) + ": " + step.advice : std::string(step.name));
  if (!object.readable) refuse(eds, number_of(step.object), "AccessType", "wo", "one that can be read back");
  if (step.kind == SdoStep::Kind::write && !object.writable && step.as_found.empty()) {
    refuse(eds, number_of(step.object), "AccessType", "ro", "one that can be written: " + std::string(step.name));
  }
  if (step.kind == SdoStep::Kind::expect && !step.is_state && object.default_value &&
      (*object.default_value & step.mask) != step.value) {
    refuse(eds, number_of(step.object), "DefaultValue", hex_text(*object.default_value, 8),
           hex_text(step.value, 8) + " (" + step.name + ")" + (*step.advice == '\0' ? "" : "; ") + step.advice);
  }
  if (step.kind != SdoStep::Kind::write || !is_mapping(step.object) || step.value == 0) return;
  const std::uint32_t mapped = step.value >> 8;
  if (!require(eds, mapped, static_cast<int>(step.value & 0xFF), "what the PDO carries").mappable) {
    refuse(eds, mapped, "PDOMapping", "0", "1: it travels in a PDO");
  }
}

// Returns the default of an object that can't be written; nullopt if the EDS has no default for it.
std::optional<std::uint32_t> fixed_value(const EdsObject& object, std::uint8_t node) noexcept {
  if (object.default_offset) return *object.default_offset + node;
  return object.default_value;
}

// Throws SetupError if the object's fixed value isn't one of the values that the step permits.
void require_found(const EdsFile& eds, const SdoStep& step, std::uint8_t node) {
  const auto value = fixed_value(*eds.find(number_of(step.object)), node);
  if (!value) return;  // the value is only known when the drive is asked
  const auto is = [&](std::uint32_t fits) { return ((*value ^ fits) & step.mask) == 0; };
  if (is(step.value) || std::any_of(step.as_found.begin(), step.as_found.end(), is)) return;
  std::string expected;
  for (const std::uint32_t fits : step.as_found) {
    expected += (expected.empty() ? "" : " or ") + hex_text(fits, 2 * step.bytes);
  }
  refuse(eds, number_of(step.object), "DefaultValue", hex_text(*value, 2 * step.bytes) + ", which can't be written",
         expected + ": " + step.name);
}

// Returns the effect of an optional object that is missing or read-only; empty if it has no effect.
std::string loss_of(const EdsObject* there, const SdoStep& step, std::uint8_t node) {
  if (*step.lost == '\0') return "";
  if (there == nullptr) return "no " + to_string(step.object) + ": " + step.lost;
  const auto value = fixed_value(*there, node);
  if (value && ((*value ^ step.value) & step.mask) == 0) return "";
  return to_string(step.object) + " can't be written: " + step.lost;
}

void lose(std::vector<std::string>& losses, const std::string& text) {
  if (!text.empty() && std::find(losses.begin(), losses.end(), text) == losses.end()) losses.push_back(text);
}

bool is_set_by(const std::vector<SdoStep>& steps, std::uint32_t object) {
  return std::any_of(steps.begin(), steps.end(), [&](const SdoStep& step) {
    return step.kind == SdoStep::Kind::write && number_of(step.object) == object;
  });
}

}  // namespace

std::optional<std::uint32_t> cia402_device_type(const EdsFile& eds) noexcept {
  const EdsObject* device_type = eds.find(0x100000);
  const bool is_drive = device_type != nullptr && device_type->default_value.value_or(0) % 0x10000 == 0x0192;
  return is_drive ? device_type->default_value : std::nullopt;
}

bool can_send(const EdsFile& eds, const MappedObject& mapped) {
  const EdsObject* there = eds.find(number_of(mapped.object));
  if (there == nullptr) return false;
  return require(eds, number_of(mapped.object), mapped.bits, "what the PDO carries").mappable;
}

std::vector<SdoStep> steps_by_eds(const std::vector<SdoStep>& steps, const EdsFile& eds,
                                  const description::DriveDescription& drive, EdsLosses* losses) {
  if (eds.node && *eds.node != drive.node) {
    throw SetupError({.file = eds.file.string(),
                      .key = "[DeviceComissioning] NodeID",
                      .found = std::to_string(*eds.node),
                      .expected = std::to_string(drive.node) + ", the node of " + drive.joint + " in the cell's file"});
  }
  std::vector<SdoStep> checked;
  for (SdoStep step : steps) {
    const EdsObject* there = eds.find(number_of(step.object));
    const bool can = there != nullptr && (there->writable || step.kind != SdoStep::Kind::write);
    if (step.is_optional && (there == nullptr || (!can && step.as_found.empty()))) {
      if (losses != nullptr) lose(losses->missing, loss_of(there, step, drive.node));
      continue;
    }
    check_step(eds, step);
    if (!can) {
      require_found(eds, step, drive.node);
      if (losses != nullptr) losses->fixed += (losses->fixed.empty() ? "" : ", ") + to_string(step.object);
      if (losses != nullptr) lose(losses->missing, loss_of(there, step, drive.node));
    }
    const std::pair<ObjectAddress, std::optional<std::uint32_t>> identity[] = {{{0x1018, 1}, eds.vendor},
                                                                               {{0x1018, 2}, eds.product}};
    for (const auto& [object, value] : identity) {
      if (!value || number_of(object) != number_of(step.object)) continue;
      step.kind = SdoStep::Kind::expect;
      step.value = *value;
      step.advice = "is another device set to this node, or is this another device's EDS?";
    }
    // The upper half of the revision number changes with the CANopen behaviour, the lower half with the firmware (CiA
    // 301, 7.5.2.19). An EDS without a revision has 0.
    if (const std::uint32_t major = eds.revision.value_or(0) & 0xFFFF0000U;
        major != 0 && step.object == ObjectAddress{0x1018, 3}) {
      step.kind = SdoStep::Kind::expect;
      step.value = major;
      step.mask = 0xFFFF0000U;
      step.advice = "the device has another major revision than its EDS: get the file of its firmware";
    }
    checked.push_back(step);
  }
  // Objects below this address are communication objects, which the master sets.
  constexpr std::uint32_t first_of_device = 0x200000;
  for (const auto& [address, object] : eds.objects) {
    if (!object.value || !object.writable || !object.readable || object.bits < 8 || object.bits > 32) continue;
    if (address < first_of_device || is_set_by(checked, address)) continue;
    checked.push_back(sdo_write({static_cast<std::uint16_t>(address >> 8), static_cast<std::uint8_t>(address)},
                                static_cast<std::uint8_t>(object.bits / 8), *object.value, object.name.c_str()));
  }
  return checked;
}

}  // namespace proxarm::fieldbus
