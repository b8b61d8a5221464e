#include "controller/messages/mcap_writer.hpp"

#include <gtest/gtest.h>

#include <cstring>
#include <iterator>

#include "models/base/setup_error.hpp"
#include "models/packed/packed.hpp"
#include "tests/scratch_folder.hpp"

namespace proxarm::view {
namespace {

template <typename Number>
Number number_at(const std::string& bytes, std::size_t at) {
  Number number{};
  std::memcpy(&number, bytes.data() + at, sizeof number);
  return number;
}

struct Record {
  std::uint8_t op;
  std::size_t begins;  // of its content
  std::uint64_t size;
};

// By the format's own rules: an opcode, a length, so many bytes.
std::vector<Record> records_in(const std::string& bytes, std::size_t from, std::size_t to) {
  std::vector<Record> all;
  while (from < to) {
    const auto size = number_at<std::uint64_t>(bytes, from + 1);
    all.push_back({static_cast<std::uint8_t>(bytes[from]), from + 9, size});
    from += 9 + size;
  }
  EXPECT_EQ(from, to);
  return all;
}

// Of a chunk: its records, unpacked.
std::string content_of(const std::string& bytes, const Record& chunk) {
  const auto size = number_at<std::uint64_t>(bytes, chunk.begins + 16);
  const std::size_t name = chunk.begins + 28;
  EXPECT_EQ(bytes.substr(name + 4, number_at<std::uint32_t>(bytes, name)), "zstd");
  const auto packed = number_at<std::uint64_t>(bytes, name + 8);
  EXPECT_EQ(name + 16 + packed, chunk.begins + chunk.size);
  return models::unpacked(std::string_view(bytes).substr(name + 16, packed), size).value_or("");
}

struct Written {
  tests::ScratchFolder folder;
  std::string bytes;
  std::vector<Record> records;
};

void write(Written& out, int messages) {
  McapWriter writer(out.folder / "a.mcap");
  const std::uint16_t schema = writer.add_schema("s", "{}");
  const std::uint16_t first = writer.add_channel("/a", schema), second = writer.add_channel("/b", schema);
  for (int i = 0; i < messages; ++i) writer.add(i % 3 == 0 ? second : first, 1000 * i, std::string(1000, 'x'));
  writer.finish();
  std::ifstream in(out.folder / "a.mcap", std::ios::binary);
  out.bytes = {std::istreambuf_iterator<char>(in), {}};
  const std::string magic("\x89MCAP0\r\n", 8);
  ASSERT_EQ(out.bytes.substr(0, 8), magic);
  ASSERT_EQ(out.bytes.substr(out.bytes.size() - 8), magic);
  out.records = records_in(out.bytes, 8, out.bytes.size() - 8);
}

TEST(McapWriter, IsASequenceOfRecordsWithAnIndexAtItsEnd) {
  Written written;
  write(written, 5000);
  EXPECT_EQ(written.records.front().op, 0x01);  // header
  EXPECT_EQ(written.records.back().op, 0x02);   // footer
  const auto summary = number_at<std::uint64_t>(written.bytes, written.records.back().begins);
  EXPECT_EQ(written.bytes[summary], 0x03);  // schemas again
  int chunks = 0, indexed = 0, messages = 0;
  for (const Record& record : written.records) {
    if (record.op == 0x08) ++indexed;
    if (record.op != 0x06) continue;
    ++chunks;
    const std::string content = content_of(written.bytes, record);
    for (const Record& inner : records_in(content, 0, content.size())) {
      if (inner.op == 0x05) ++messages;
    }
  }
  EXPECT_EQ(chunks, 5);  // of a megabyte
  EXPECT_EQ(indexed, chunks);
  EXPECT_EQ(messages, 5000);
}

TEST(McapWriter, AnIndexLeadsToItsMessage) {
  Written written;
  write(written, 10);
  std::string chunk;
  int found = 0;
  for (const Record& record : written.records) {
    if (record.op == 0x06) chunk = content_of(written.bytes, record);
    if (record.op != 0x07) continue;
    const auto channel = number_at<std::uint16_t>(written.bytes, record.begins);
    for (std::size_t at = record.begins + 6; at < record.begins + record.size; at += 16) {
      const auto message = number_at<std::uint64_t>(written.bytes, at + 8);
      ASSERT_LT(message, chunk.size());
      EXPECT_EQ(chunk[message], 0x05);
      EXPECT_EQ(number_at<std::uint16_t>(chunk, message + 9), channel);
      EXPECT_EQ(number_at<std::uint64_t>(chunk, message + 15), number_at<std::uint64_t>(written.bytes, at));
      ++found;
    }
  }
  EXPECT_EQ(found, 10);
}

TEST(McapWriter, ASessionWithoutACycleIsAFileToo) {
  Written written;
  write(written, 0);
  EXPECT_EQ(written.records.back().op, 0x02);
}

TEST(McapWriter, WhatCantBeWrittenIsTold) {
  EXPECT_THROW(McapWriter("/proc/nothing/a.mcap"), description::SetupError);
  McapWriter full("/dev/full");
  full.add(full.add_channel("/a", full.add_schema("s", "{}")), 0, std::string(1 << 21, 'x'));
  EXPECT_THROW(full.finish(), description::SetupError);
}

}  // namespace
}  // namespace proxarm::view
