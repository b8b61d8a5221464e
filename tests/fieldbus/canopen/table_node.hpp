// A CANopen node for tests of the bring-up: an object dictionary as a table, expedited SDO, NMT and heartbeat, written
// from CiA 301 by hand and knowing nothing of what the objects mean. It can be told to misbehave.
#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <set>
#include <utility>

#include "tests/fieldbus/can/scripted_network.hpp"

namespace proxarm::fieldbus {

class TableNode {
 public:
  using Key = std::pair<int, int>;
  struct Entry {
    int bytes;
    std::uint32_t value;
  };

  TableNode(ScriptedBus& bus, std::uint8_t node) : bus_(bus), node_(node) {}

  // To be called for every frame that the master sends.
  void on_frame(const CanFrame& f) {
    if (!powered) return;
    if (freed_by && freed_by(f)) starts = true;
    if (f.id == 0 && (f.data[1] == node_ || f.data[1] == 0)) return on_nmt(f.data[0]);
    if (f.id != 0x600U + node_ || f.length != 8) return;
    const Key key{f.data[1] | f.data[2] << 8, f.data[3]};
    CanFrame a;
    a.id = 0x580U + node_;
    a.length = 8;
    for (int i = 1; i < 4; ++i) a.data[i] = f.data[i];
    if (f.data[0] == 0x80) return;
    if (ignored-- > 0) return;
    ignored = 0;
    const auto entry = objects.find(key);
    std::uint32_t abort = entry == objects.end() ? 0x06020000 : 0;
    const bool write = f.data[0] >> 5 == 1;
    if (aborts.count(key) != 0) abort = aborts[key];
    if (write && write_aborts.count(key) != 0) abort = write_aborts[key];
    if (abort == 0 && write) {
      const int bytes = 4 - (f.data[0] >> 2 & 3);
      if (bytes != entry->second.bytes) abort = 0x06070010;
    }
    if (abort != 0) {
      a.data[0] = 0x80;
      for (int i = 0; i < 4; ++i) a.data[4 + i] = static_cast<std::uint8_t>(abort >> 8 * i);
    } else if (write) {
      std::uint32_t value = 0;
      for (int i = 0; i < entry->second.bytes; ++i) value |= static_cast<std::uint32_t>(f.data[4 + i]) << 8 * i;
      if (deaf.count(key) == 0) entry->second.value = value;
      if (key == Key{0x6060, 0} && mode_follows) objects[{0x6061, 0}].value = value;
      if (key == Key{0x1017, 0}) heartbeat();
      written.push_back(key);
      a.data[0] = 0x60;
    } else {
      a.data[0] = static_cast<std::uint8_t>(0x43 | (4 - entry->second.bytes) << 2);
      for (int i = 0; i < 4; ++i) a.data[4 + i] = static_cast<std::uint8_t>(entry->second.value >> 8 * i);
    }
    bus_.arrive(a, 150'000);
  }

  void heartbeat() {
    CanFrame h;
    h.id = 0x700U + node_;
    h.length = 1;
    h.data[0] = state;
    bus_.arrive(h, 300'000);
  }

  // What a servo drive has, with values other than those the master wants.
  static std::map<Key, Entry> servo_drive() {
    std::map<Key, Entry> od = {{{0x1000, 0}, {4, 0x00020192}}, {{0x1001, 0}, {1, 0}},     {{0x1003, 1}, {4, 0}},
                               {{0x6040, 0}, {2, 0}},          {{0x1006, 0}, {4, 0}},     {{0x1016, 1}, {4, 0}},
                               {{0x1017, 0}, {2, 0}},          {{0x1018, 1}, {4, 0x2E1}}, {{0x1018, 2}, {4, 0x1234}},
                               {{0x1018, 3}, {4, 0x10002}},    {{0x1018, 4}, {4, 77}},    {{0x1029, 1}, {1, 1}},
                               {{0x6007, 0}, {2, 1}},          {{0x605A, 0}, {2, 1}},     {{0x605B, 0}, {2, 0}},
                               {{0x605C, 0}, {2, 0}},          {{0x605D, 0}, {2, 2}},     {{0x605E, 0}, {2, 1}},
                               {{0x6060, 0}, {1, 0}},          {{0x6061, 0}, {1, 0}},     {{0x6065, 0}, {4, 0}},
                               {{0x6066, 0}, {2, 0}},          {{0x6084, 0}, {4, 1}},     {{0x6085, 0}, {4, 1}},
                               {{0x60C2, 1}, {1, 2}},          {{0x60C2, 2}, {1, 0xFD}},  {{0x6502, 0}, {4, 0x03EF}}};
    for (int n = 0; n < 4; ++n) {
      od[{0x1400 + n, 1}] = od[{0x1800 + n, 1}] = {4, 0};
      od[{0x1400 + n, 2}] = od[{0x1800 + n, 2}] = {1, 0xFF};
      od[{0x1400 + n, 5}] = od[{0x1800 + n, 5}] = {2, 0};
      for (int sub = 0; sub <= 8; ++sub) od[{0x1600 + n, sub}] = od[{0x1A00 + n, sub}] = {sub == 0 ? 1 : 4, 0};
    }
    return od;
  }

  std::map<Key, Entry> objects = servo_drive();
  std::map<Key, std::uint32_t> aborts;        // answered by this code
  std::map<Key, std::uint32_t> write_aborts;  // the same, but can be read
  std::set<Key> deaf;                         // written without an error, but not kept
  std::vector<Key> written;
  bool powered = true;
  bool mode_follows = true;
  bool starts = true;
  std::function<bool(const CanFrame&)> freed_by;  // the frame from which on it starts
  int ignored = 0;                                // that many requests aren't answered
  std::uint8_t state = 0x7F;
  int resets = 0;  // of its communication

 private:
  void on_nmt(std::uint8_t command) {
    if (command == 0x01 && starts) state = 0x05;
    if (command == 0x02) state = 0x04;
    if (command == 0x80) state = 0x7F;
    if (command == 0x82) {
      ++resets;
      for (auto& [key, entry] : servo_drive()) objects[key] = entry;
      objects[{0x1001, 0}].value = 0;
      CanFrame boot_up;
      boot_up.id = 0x700U + node_;
      boot_up.length = 1;
      bus_.arrive(boot_up, 5'000'000);
      state = 0x7F;
    }
    if (objects[{0x1017, 0}].value > 0) heartbeat();
  }

  ScriptedBus& bus_;
  std::uint8_t node_;
};

}  // namespace proxarm::fieldbus
