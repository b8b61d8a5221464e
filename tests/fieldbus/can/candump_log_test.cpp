#include "fieldbus/can/candump_log.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <chrono>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <limits>
#include <random>
#include <sstream>
#include <string>

#include "fieldbus/can/can_timing.hpp"
#include "models/base/setup_error.hpp"
#include "tests/allocation_count.hpp"
#include "tests/scratch_folder.hpp"

namespace proxarm::fieldbus {
namespace {

using description::SetupError;
using testing::AllOf;
using testing::HasSubstr;

CanFrame frame_of(std::uint32_t id, std::initializer_list<int> bytes = {}) {
  CanFrame frame;
  frame.id = id;
  for (const int byte : bytes) frame.data[frame.length++] = static_cast<std::uint8_t>(byte);
  return frame;
}

std::string line_of(std::int64_t time_ns, std::string_view interface, const CanFrame& frame) {
  CandumpLine line;
  return {line.data(), format_candump_line(line, time_ns, interface, frame)};
}

std::vector<CandumpEntry> read(const std::string& text) {
  std::istringstream stream(text);
  CandumpLogReader reader(stream, "run.log");
  std::vector<CandumpEntry> entries;
  CandumpEntry entry;
  while (reader.next(entry)) entries.push_back(entry);
  return entries;
}

std::string mistake_in(const std::string& text) {
  try {
    read(text);
  } catch (const SetupError& error) {
    return error.what();
  }
  return "";
}

// Lines as the documentation of can-utils gives them, typed by hand.
struct Sample {
  const char* line;
  std::int64_t time_ns;
  CanFrame frame;
};
std::vector<Sample> samples() {
  std::vector<Sample> out;
  out.push_back({"(1436509052.249713) vcan0 044#2A366C2BBA\n", 1436509052249713000,
                 frame_of(0x044, {0x2a, 0x36, 0x6c, 0x2b, 0xba})});
  out.push_back({"(1436509052.449847) vcan0 0F6#7ADFE07BD2\n", 1436509052449847000,
                 frame_of(0x0f6, {0x7a, 0xdf, 0xe0, 0x7b, 0xd2})});
  out.push_back({"(0000000000.000000) vcan0 000#\n", 0, frame_of(0)});
  out.push_back(
      {"(0000000001.000001) vcan0 7FF#0102030405060708\n", 1'000'001'000, frame_of(0x7ff, {1, 2, 3, 4, 5, 6, 7, 8})});
  CanFrame frame = frame_of(0x1f334455, {0x11, 0x22, 0x33, 0x44});
  frame.extended = true;
  out.push_back({"(1436509053.000000) vcan0 1F334455#11223344\n", 1436509053000000000, frame});
  frame = frame_of(0x5aa);
  frame.extended = true;
  out.push_back({"(1436509053.000000) vcan0 000005AA#\n", 1436509053000000000, frame});
  frame = frame_of(0x123);
  frame.remote = true;
  out.push_back({"(1436509053.000000) vcan0 123#R\n", 1436509053000000000, frame});
  frame.length = 4;
  out.push_back({"(1436509053.000000) vcan0 123#R4\n", 1436509053000000000, frame});
  frame = frame_of(0x213, {0x11, 0x22, 0x33});
  frame.fd = true;
  out.push_back({"(1436509053.000000) vcan0 213##0112233\n", 1436509053000000000, frame});
  frame.bit_rate_switch = true;
  out.push_back({"(1436509053.000000) vcan0 213##1112233\n", 1436509053000000000, frame});
  frame = frame_of(0x004, {0, 0x08, 0, 0, 0, 0, 0x60, 0});
  frame.error = true;
  out.push_back({"(1436509053.000000) vcan0 20000004#0008000000006000\n", 1436509053000000000, frame});
  return out;
}

TEST(CandumpLog, WritesTheLinesOfCanUtils) {
  for (const Sample& sample : samples()) EXPECT_EQ(line_of(sample.time_ns, "vcan0", sample.frame), sample.line);
}

TEST(CandumpLog, ReadsTheLinesOfCanUtils) {
  for (const Sample& sample : samples()) {
    const auto entries = read(sample.line);
    ASSERT_EQ(entries.size(), 1u) << sample.line;
    EXPECT_EQ(entries[0].time_ns, sample.time_ns) << sample.line;
    EXPECT_EQ(entries[0].interface, "vcan0");
    EXPECT_EQ(entries[0].frame, sample.frame) << sample.line;
  }
}

TEST(CandumpLog, ReadsWhatOtherVersionsWrite) {
  const auto entries = read(
      "# a comment\n"
      "\n"
      "(1436509052.249713123)   can0 044#2a36\r\n"  // nanoseconds, padded name, lower case, DOS line end
      "(1436509052.249713) can0 044#2A.36 R\n"      // dots, direction
      "(1436509052.249713) can0 044#0102030405060708_C T\n"
      "(1436509052.249713) can0 044#r8_9\n"
      "(1436509052.249713) can0 044##3");  // FD, error passive sender; no line end
  ASSERT_EQ(entries.size(), 5u);
  EXPECT_EQ(entries[0].time_ns, 1436509052249713123);
  EXPECT_EQ(entries[0].interface, "can0");
  EXPECT_EQ(entries[0].frame, frame_of(0x044, {0x2a, 0x36}));
  EXPECT_EQ(entries[1].frame, entries[0].frame);
  EXPECT_EQ(entries[2].frame.length, 8);
  EXPECT_TRUE(entries[3].frame.remote);
  EXPECT_TRUE(entries[4].frame.fd && entries[4].frame.bit_rate_switch);
  EXPECT_TRUE(read("").empty());
}

TEST(CandumpLog, NamesTheLineTheValueAndWhatItShouldBe) {
  const std::string good = "(1436509052.249713) can0 044#2A36\n";
  EXPECT_THAT(mistake_in(good + good + "hello\n"),
              AllOf(HasSubstr("run.log:3"), HasSubstr("hello"), HasSubstr("time")));
  for (const char* bad : {
           "(1436509052,249713) can0 044#",
           "(1436509052.2497) can0 044#",
           "(-1.249713) can0 044#",
           "(1.-49713) can0 044#",
           "(99999999999.000000) can0 044#",
           "() can0 044#",
           "(1436509052.249713)",
           "(1436509052.249713) can0",
           "(1436509052.249713) can0 44#",
           "(1436509052.249713) can0 800#",
           "(1436509052.249713) can0 0G4#",
           "(1436509052.249713) can0 44444444#",
           "(1436509052.249713) can0 044",
           "(1436509052.249713) can0 044#1",
           "(1436509052.249713) can0 044#1X",
           "(1436509052.249713) can0 044#R9",
           "(1436509052.249713) can0 044#010203040506070809",
           "(1436509052.249713) can0 044##",
           "(1436509052.249713) can0 044##1010203040506070809",
           "(1436509052.249713) can0 044#01_9",
           "(1436509052.249713) can0 044#0102030405060708_8",
           "(1436509052.249713) can0 044# X",
           "(1436509052.249713) can0 044# R 1",
           "1436509052.249713 can0 044#",
       }) {
    EXPECT_THAT(mistake_in(good + bad), HasSubstr("run.log:2")) << bad;
  }
  EXPECT_THAT(mistake_in(good + std::string(100'000, 'x')), HasSubstr("run.log:2"));
  EXPECT_THAT(mistake_in(good + std::string("\0\0\0", 3)), HasSubstr("run.log:2"));
}

TEST(CandumpLog, ReadsBackWhatItWrites) {
  std::mt19937 random(11);
  for (int i = 0; i < 5000; ++i) {
    CanFrame frame;
    frame.extended = random() % 2 != 0;
    frame.id = static_cast<std::uint32_t>(random() & (frame.extended ? 0x1fffffffu : 0x7ffu));
    frame.fd = random() % 2 != 0;
    frame.bit_rate_switch = frame.fd && random() % 2 != 0;
    frame.remote = !frame.fd && random() % 4 == 0;
    frame.length = static_cast<std::uint8_t>(padded_length(static_cast<int>(random() % 70), frame.fd));
    if (!frame.remote) {
      for (std::size_t k = 0; k < frame.length; ++k) frame.data[k] = static_cast<std::uint8_t>(random());
    }
    const std::int64_t time_ns =
        static_cast<std::int64_t>(random()) * 1'000'000 + static_cast<std::int64_t>(random() % 1000) * 1000;
    const std::string line = line_of(time_ns, "axes_1_3", frame);
    const auto entries = read(line);
    ASSERT_EQ(entries.size(), 1u) << "seed 11: " << line;
    ASSERT_EQ(entries[0].frame, frame) << "seed 11: " << line;
    ASSERT_EQ(entries[0].time_ns, time_ns);
    ASSERT_EQ(entries[0].interface, "axes_1_3");
  }
}

TEST(CandumpLog, NeverWritesPastALineWhateverTheInput) {
  CanFrame frame;
  frame.fd = frame.extended = true;
  frame.id = 0xffffffff;
  frame.length = 255;
  const std::string line = line_of(std::numeric_limits<std::int64_t>::max(), std::string(1000, 'x'), frame);
  EXPECT_LE(line.size(), max_candump_line);
  EXPECT_EQ(line.back(), '\n');
  EXPECT_EQ(line_of(-5, "", frame_of(1)), "(0000000000.000000) can 001#\n");
  EXPECT_EQ(line_of(0, "my arm", frame_of(1)), "(0000000000.000000) my_arm 001#\n");
}

TEST(CandumpLog, FormatsWithoutAllocation) {
  const CanFrame frame = frame_of(0x181, {1, 2, 3, 4, 5, 6});
  CandumpLine line;
  const std::uint64_t before = tests::allocation_count();
  for (int i = 0; i < 1000; ++i) format_candump_line(line, i, "axes_1_3", frame);
  EXPECT_EQ(tests::allocation_count(), before);
}

TEST(CandumpLog, WritesFilesThatItReads) {
  const tests::ScratchFolder folder;
  const auto path = folder / "run.log";
  CandumpLogWriter writer(path.string(), 1'700'000'000'000'000'000);
  for (int i = 0; i < 10'000; ++i) writer.write(i * std::int64_t{1'000'000}, "sensor", frame_of(0x680, {i & 0xff}));
  writer.finish();
  const auto entries = read_candump_log(path.string());
  ASSERT_EQ(entries.size(), 10'000u);
  EXPECT_EQ(entries.back().time_ns, 1'700'000'009'999'000'000);
  EXPECT_EQ(entries.back().frame, frame_of(0x680, {9999 & 0xff}));
  std::filesystem::remove(path);
  EXPECT_THROW((void)read_candump_log(path.string()), SetupError);
  EXPECT_THROW(CandumpLogWriter("/nowhere/at/all.log"), SetupError);
  if (std::filesystem::exists("/dev/full")) {
    CandumpLogWriter full("/dev/full");
    for (int i = 0; i < 10'000; ++i) full.write(0, "sensor", frame_of(1));
    EXPECT_THROW(full.finish(), SetupError);
  }
}

// can-utils' own reader as the witness: log2asc reads the log and says the same in another format.
TEST(CandumpLog, IsUnderstoodByCanUtils) {
  if (std::system("command -v log2asc >/dev/null 2>&1") != 0) GTEST_SKIP() << "needs can-utils (log2asc)";
  const tests::ScratchFolder folder;
  {
    CandumpLogWriter writer((folder / "run.log").string());
    CanFrame extended = frame_of(0x1abcdef0, {0xca, 0xfe});
    extended.extended = true;
    writer.write(1'000'000'000, "vcan0", frame_of(0x123, {0xde, 0xad, 0xbe, 0xef}));
    writer.write(1'250'000'000, "vcan0", extended);
    writer.finish();
  }
  const std::string command =
      "log2asc -I " + (folder / "run.log").string() + " -O " + (folder / "run.asc").string() + " vcan0 >/dev/null 2>&1";
  ASSERT_EQ(std::system(command.c_str()), 0);
  const std::string asc = tests::text_of(folder / "run.asc");
  EXPECT_THAT(asc, HasSubstr("DE AD BE EF"));
  EXPECT_THAT(asc, HasSubstr("1ABCDEF0x"));
  EXPECT_THAT(asc, HasSubstr("0.2500"));
}

}  // namespace
}  // namespace proxarm::fieldbus
