// A simulated drive's dictionary by its maker's file: what the network finds, what it reads and what it may write.
#include "sim/devices/eds_objects.hpp"

#include <gtest/gtest.h>

#include <string>
#include <vector>

namespace proxarm::sim {
namespace {

std::string section(const char* name, const char* type, const char* access, const char* more) {
  return std::string("[") + name + "]\nParameterName=x\nObjectType=7\nDataType=" + type + "\nAccessType=" + access +
         "\n" + more + "\n";
}

class EdsObjects : public ::testing::Test {
 protected:
  EdsObjects() {
    od.add(0x1017, 0, DataType::unsigned16, Access::read_write, 0);
    od.add(0x6041, 0, DataType::unsigned16, Access::read_only, 0x21, true);
    od.add(0x6060, 0, DataType::integer8, Access::read_write, 0, true);
    od.add(0x607D, 1, DataType::integer32, Access::read_write, -5);
    od.add(0x605A, 0, DataType::integer16, Access::read_write, 2);
  }
  void by(const std::string& objects) {
    take_over(description::parse_eds("[DeviceInfo]\n" + objects, "maker.eds"), 5, od);
  }
  SdoAbort write(std::uint16_t index, std::vector<std::uint8_t> bytes) { return od.write(index, 0, bytes); }

  ObjectDictionary od;
};

TEST_F(EdsObjects, WhatTheFileHasNotIsNotFoundButKeepsItsOwnDefault) {
  by(section("1017", "6", "rw", "DefaultValue=100"));
  const ObjectEntry* entry = nullptr;
  EXPECT_EQ(od.read(0x605A, 0, entry), SdoAbort::object_does_not_exist);
  EXPECT_EQ(write(0x605A, {1, 0}), SdoAbort::object_does_not_exist);
  EXPECT_EQ(od.number(0x605A), 2) << "what the firmware does without showing it";
  EXPECT_EQ(od.read(0x1017, 0, entry), SdoAbort::none);
  EXPECT_EQ(entry->number(), 100);
  od.at(0x1017).set(1);
  od.restore_defaults(0x1000, 0xFFFF);
  EXPECT_EQ(od.number(0x1017), 100) << "after a reset, too";
}

TEST_F(EdsObjects, TypeAccessMappingAndLimitsAreTheFiles) {
  by(section("6060", "4", "ro", "PDOMapping=0\nDefaultValue=-2") +
     section("2345", "2", "rw", "LowLimit=-3\nHighLimit=0x7\nPDOMapping=1") + section("2346", "0x16", "wo", "") +
     section("2347", "8", "rw", "DefaultValue=0.5") + section("2348", "9", "const", "DefaultValue=ours"));
  EXPECT_EQ(od.at(0x6060).value, (std::vector<std::uint8_t>{0xFE, 0xFF, 0xFF, 0xFF}));
  EXPECT_FALSE(od.at(0x6060).pdo_mappable);
  EXPECT_EQ(write(0x6060, {8, 0, 0, 0}), SdoAbort::write_of_read_only);
  EXPECT_TRUE(od.at(0x2345).pdo_mappable);
  EXPECT_EQ(write(0x2345, {8}), SdoAbort::value_too_high);
  EXPECT_EQ(write(0x2345, {0xFC}), SdoAbort::value_too_low);
  EXPECT_EQ(write(0x2345, {0xFD}), SdoAbort::none);
  const ObjectEntry* entry = nullptr;
  EXPECT_EQ(od.read(0x2346, 0, entry), SdoAbort::read_of_write_only);
  EXPECT_EQ(write(0x2346, {1, 2, 3, 4}), SdoAbort::length_too_high) << "UNSIGNED24";
  EXPECT_EQ(od.at(0x2347).value, (std::vector<std::uint8_t>{0, 0, 0, 0x3F})) << "0.5 as IEEE 754";
  EXPECT_EQ(std::string(od.at(0x2348).value.begin(), od.at(0x2348).value.end()), "ours");
}

TEST_F(EdsObjects, NodeIdIsTheDrivesAndWhatIsMeasuredOrBelongsToTheAxisIsNotTheFiles) {
  by(section("1400sub1", "7", "rw", "DefaultValue=$NODEID+0x200") + section("6041", "6", "ro", "DefaultValue=0x9999") +
     section("607Dsub1", "4", "rw", "DefaultValue=-1"));
  EXPECT_EQ(od.number(0x1400, 1), 0x205);
  EXPECT_EQ(od.number(0x6041), 0x21);
  EXPECT_EQ(od.number(0x607D, 1), -5);
}

}  // namespace
}  // namespace proxarm::sim
