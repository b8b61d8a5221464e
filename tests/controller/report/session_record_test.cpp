#include "controller/report/session_record.hpp"

#include <gtest/gtest.h>

#include <bit>
#include <cerrno>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <limits>
#include <nlohmann/json.hpp>
#include <random>
#include <sstream>

#include "models/base/setup_error.hpp"
#include "tests/scratch_folder.hpp"

namespace proxarm::controller {
namespace {

namespace fs = std::filesystem;

std::vector<std::string> cells(const std::string& row) {
  std::vector<std::string> result;
  std::stringstream stream(row);
  for (std::string cell; std::getline(stream, cell, ',');) result.push_back(cell);
  if (!row.empty() && row.back() == ',') result.emplace_back();
  return result;
}

const std::vector<std::string> six_axes{"j1", "j2", "j3", "j4", "j5", "j6"};

CycleRecord some_record(std::uint64_t k) {
  CycleRecord r;
  r.cycle = k;
  r.time_ns = static_cast<std::int64_t>(k * 1'000'000);  // of any k: it wraps
  r.phase = Phase::rendering;
  r.contact = ContactPhase::stick;
  r.axes = 6;
  r.set(RecordFlag::truth);
  r.force_S_N = {0.1, -2.5, 1e-17};
  r.proxy_clearance_m = std::numeric_limits<double>::infinity();
  r.target_counts = {1, -2, 3, INT32_MIN, INT32_MAX, 0, 77, 88};
  return r;
}

TEST(SessionRecord, EveryColumnHasAName) {
  for (const bool truth : {false, true}) {
    std::string row;
    append_signals(row, some_record(3), 6, truth);
    EXPECT_EQ(cells(row).size(), cells(signals_header(six_axes, truth)).size());
    CycleRecord without = some_record(3);
    without.set(RecordFlag::truth, false);
    row.clear();
    append_signals(row, without, 6, truth);
    EXPECT_EQ(cells(row).size(), cells(signals_header(six_axes, truth)).size());
  }
}

TEST(SessionRecord, EveryColumnHasAMeaning) {
  const nlohmann::json columns = nlohmann::json::parse(json_of(signal_columns(six_axes, true)));
  std::string header;
  for (const nlohmann::json& column : columns) {
    header += (header.empty() ? "" : ",") + column.at("name").get<std::string>();
    EXPECT_FALSE(column.at("meaning").get<std::string>().empty());
    // A name that ends in a unit has that unit.
    const bool named_N = column.at("name").get<std::string>().find("_N") != std::string::npos;
    EXPECT_TRUE(!named_N || column.contains("unit"));
  }
  EXPECT_EQ(header, signals_header(six_axes, true));
}

TEST(SessionRecord, WritesARowAsPeopleWouldReadIt) {
  CycleRecord r = some_record(1250);
  r.time_ns = 1'250'500'000;
  r.set(RecordFlag::sample_held);
  r.set(RecordFlag::limit_speed);
  r.set(RecordFlag::overrun);
  std::string row;
  append_signals(row, r, 6, false);
  EXPECT_EQ(row.substr(0, 72), "1250,1.2505,rendering,stick,sample_held|limit_speed,0.1,-2.5,1e-17,0,0,0");
  EXPECT_NE(row.find(",inf,0,1,-2,3,-2147483648,2147483647,0,"), std::string::npos) << row;
}

// Shortest decimals that read back to the same bits: 10,000 doubles of any exponent.
TEST(SessionRecord, NumbersReadBackToTheSameBits) {
  std::mt19937_64 generator(17);
  std::printf("seed 17\n");
  for (int i = 0; i < 10000; ++i) {
    double value = 0.0;
    do {
      const std::uint64_t bits = generator();
      std::memcpy(&value, &bits, sizeof value);
    } while (!std::isfinite(value));
    CycleRecord r;
    r.force_S_N[0] = value;
    std::string row;
    append_signals(row, r, 0, false);
    ASSERT_EQ(std::strtod(cells(row)[5].c_str(), nullptr), value);
  }
}

// Any bits of a double, and rows without a truth: what the table says of a row is what is written as text.
TEST(SessionRecord, NumbersOfATableAreThoseOfTheText) {
  const tests::ScratchFolder folder;
  std::mt19937_64 generator(18);
  std::printf("seed 18\n");
  std::vector<std::string> expected;
  SignalTableWriter writer(folder / "signals.bin", signal_columns(six_axes, true), SignalTableWriter::Blocks::plain);
  for (std::uint64_t k = 0; k < 3000; ++k) {
    CycleRecord r = some_record(generator() >> 11);
    r.time_ns = static_cast<std::int64_t>(generator() >> (13 + generator() % 40));
    r.flags = static_cast<std::uint32_t>(generator());
    r.phase = static_cast<Phase>(generator() % phase_count);
    r.fault = static_cast<Fault>(generator() % fault_count);
    for (Triple* triple : {&r.force_W_N, &r.tool_W_m, &r.hand_force_W_N}) {
      for (double& value : *triple) value = std::bit_cast<double>(generator());
    }
    r.contacts[2].object = static_cast<std::int32_t>(generator());
    DerivedSignals derived;
    derived.torques = k % 2 == 0;
    derived.target_Nm[2] = std::bit_cast<double>(generator());
    append_signals(expected.emplace_back(), r, 6, true, derived);
    store_signals(writer.row(), SignalTableWriter::apart, r, 6, true, derived);
    writer.end_row();
    if (k % 97 != 0) continue;
    // What a session that is killed now leaves: 64 rows at a time, each whole.
    const SignalTable table(folder / "signals.bin");
    ASSERT_EQ(table.rows(), (k + 1) / 64 * 64);
    if (table.rows() == 0) continue;
    std::string last;
    table.append_row(last, table.rows() - 1);
    ASSERT_EQ(last, expected[table.rows() - 1]);
  }
  writer.finish();
  EXPECT_EQ(writer.error(), 0);
  const SignalTable table(folder / "signals.bin");
  ASSERT_EQ(table.rows(), expected.size());
  EXPECT_EQ(table.header(), signals_header(six_axes, true));
  for (std::size_t row = 0; row < expected.size(); ++row) {
    std::string text;
    table.append_row(text, row);
    ASSERT_EQ(text, expected[row]);
  }
}

TEST(SessionRecord, ATableTellsOfAFullDisk) {
  if (!fs::exists("/dev/full")) GTEST_SKIP() << "no /dev/full here";
  EXPECT_EQ(SignalTableWriter("/dev/full", signal_columns(six_axes, true), SignalTableWriter::Blocks::plain).error(),
            ENOSPC);
}

// Written by hand in candump -L's format (can-utils, lib.c: "id#data", "id##flags data", "id#R", 8 digits when
// extended).
TEST(SessionRecord, FramesAreACandumpLog) {
  const tests::ScratchFolder folder;
  SessionWriter writer(folder / "s", six_axes, false);
  fieldbus::CanFrame frame{.id = 0x181, .length = 6, .data = {0x37, 0x12, 0x00, 0x10, 0x00, 0xAB}};
  writer.add_frame("axes_1_3", frame, 1'000'250'999);
  writer.add_frame("axes_1_3", {.id = 0x080}, 0);
  writer.add_frame("sensor", {.id = 0x123, .extended = true, .length = 1, .data = {0xFF}}, 12'345'678'901'000);
  writer.add_frame("sensor", {.id = 0x6A0, .remote = true}, 5000);
  writer.add_frame("sensor", {.id = 0x6A0, .fd = true, .bit_rate_switch = true, .length = 2, .data = {1, 2}}, 6000);
  writer.finish({});
  EXPECT_EQ(tests::text_of(folder / "s" / "frames.log"),
            "(0000000001.000250) axes_1_3 181#3712001000AB\n"
            "(0000000000.000000) axes_1_3 080#\n"
            "(0000012345.678901) sensor 00000123#FF\n"
            "(0000000000.000005) sensor 6A0#R\n"
            "(0000000000.000006) sensor 6A0##10102\n");
}

// The witness: can-utils' own reader (which takes times within the first second for no time at all).
TEST(SessionRecord, CanUtilsReadTheLog) {
  if (std::system("command -v log2asc > /dev/null 2>&1") != 0) GTEST_SKIP() << "can-utils' log2asc isn't installed";
  const tests::ScratchFolder folder;
  SessionWriter writer(folder / "s", six_axes, false);
  for (int k = 0; k < 100; ++k) {
    writer.add_frame("axes_1_3",
                     {.id = 0x201, .length = 6, .data = {0x0F, 0, static_cast<std::uint8_t>(k), 0xBE, 0xEF, 0xFF}},
                     1'000'000'000 + k * 1'000'000LL);
  }
  writer.finish({});
  const std::string command =
      "log2asc -I '" + (folder / "s" / "frames.log").string() + "' -O '" + (folder / "out.asc").string() + "' axes_1_3";
  ASSERT_EQ(std::system(command.c_str()), 0);
  const std::string asc = tests::text_of(folder / "out.asc");
  EXPECT_NE(asc.find("0.099000 1  201"), std::string::npos) << asc;
  EXPECT_NE(asc.find("d 6 0F 00 63 BE EF FF"), std::string::npos) << asc;
}

TEST(SessionRecord, HoldsAllFilesAndKeepsTheWallClockApart) {
  const tests::ScratchFolder folder;
  for (const char* name : {"a", "b"}) {
    SessionWriter writer(folder / name, six_axes, true);
    Summary summary;
    summary.wall_time_s = name[0] == 'a' ? 0.5 : 0.7;
    summary.overruns = name[0] == 'a' ? 0 : 3;
    for (std::uint64_t k = 0; k < 2000; ++k) {
      CycleRecord r = some_record(k);
      r.compute_ns = name[0] == 'a' ? 5000 : 7000;
      r.set(RecordFlag::overrun, name[0] == 'b');
      writer.add(r);
    }
    writer.write_file("effective.yaml", "mass: 4 kg\n");
    writer.finish(summary);
  }
  for (const char* file : {"signals.csv", "frames.log", "effective.yaml", "summary.json"}) {
    EXPECT_EQ(tests::text_of(folder / "a" / file), tests::text_of(folder / "b" / file)) << file;
  }
  EXPECT_NE(tests::text_of(folder / "a" / "timing.json"), tests::text_of(folder / "b" / "timing.json"));
  EXPECT_EQ(tests::text_of(folder / "a" / "effective.yaml"), "mass: 4 kg\n");
  const std::string csv = tests::text_of(folder / "a" / "signals.csv");
  EXPECT_EQ(std::count(csv.begin(), csv.end(), '\n'), 2001);
  EXPECT_TRUE(nlohmann::json::accept(tests::text_of(folder / "a" / "summary.json")));
  EXPECT_TRUE(nlohmann::json::accept(tests::text_of(folder / "a" / "timing.json")));
}

TEST(SessionRecord, ReplacesAnEarlierSessionButNothingElse) {
  const tests::ScratchFolder folder;
  {
    SessionWriter writer(folder / "s", six_axes, false);
    writer.add(some_record(1));
    writer.finish({});
  }
  {
    SessionWriter writer(folder / "s", six_axes, false);
    writer.finish({});
  }
  EXPECT_EQ(tests::text_of(folder / "s" / "signals.csv"), signals_header(six_axes, false) + "\n");
  std::ofstream(folder / "s" / "thesis.tex") << "\\documentclass";
  try {
    SessionWriter writer(folder / "s", six_axes, false);
    FAIL();
  } catch (const description::SetupError& error) {
    EXPECT_EQ(error.key(), "--record");
    EXPECT_NE(std::string(error.what()).find("thesis.tex"), std::string::npos) << error.what();
  }
  EXPECT_EQ(tests::text_of(folder / "s" / "thesis.tex"), "\\documentclass");
}

TEST(SessionRecord, NamesTheFolderThatCantBeWritten) {
  const tests::ScratchFolder folder;
  std::ofstream(folder / "file") << "x";
  EXPECT_THROW(SessionWriter(folder / "file", six_axes, false), description::SetupError);
  EXPECT_THROW(SessionWriter(fs::path("/proc/proxarm"), six_axes, false), description::SetupError);
}

// /dev/full takes every write and has room for none.
TEST(SessionRecord, TellsOfAFullDisk) {
  if (!fs::exists("/dev/full")) GTEST_SKIP() << "no /dev/full here";
  const tests::ScratchFolder folder;
  SessionWriter writer(folder / "s", six_axes, false);
  fs::create_symlink("/dev/full", folder / "s" / "summary.json");
  try {
    writer.finish({});
    FAIL();
  } catch (const description::SetupError& error) {
    EXPECT_NE(std::string(error.what()).find("summary.json"), std::string::npos) << error.what();
  }
}

}  // namespace
}  // namespace proxarm::controller
