// Writes MCAP, the message container of Foxglove, Lichtblick and ROS tools.
//
// A file is magic, records, magic. A record is an opcode (u8), the length of its content (u64) and its content. Numbers
// are little-endian. Strings and maps follow their length in bytes (u32). Messages are in chunks of about a megabyte. A
// chunk is compressed by Zstandard, has a checksum, and is followed by an index of its messages. The file ends with
// schemas and channels once more, an index of the chunks, and counts, so that a reader finds any time quickly.
#pragma once

#include <cstdint>
#include <filesystem>
#include <fstream>
#include <map>
#include <string>
#include <string_view>
#include <vector>

namespace proxarm::view {

class McapWriter {
 public:
  // Throws SetupError if the file can't be written.
  explicit McapWriter(const std::filesystem::path& file);

  // Return the id of the new schema or channel. A channel's messages are JSON, described by a JSON Schema.
  // Precondition: called before the first message.
  std::uint16_t add_schema(const std::string& name, const std::string& json_schema);
  std::uint16_t add_channel(const std::string& topic, std::uint16_t schema);
  // Adds a message to a channel. Precondition: times don't decrease.
  void add(std::uint16_t channel, std::int64_t time_ns, std::string_view message);
  // Throws SetupError if the file couldn't be written completely.
  void finish();

 private:
  struct Chunk {
    std::int64_t first_ns = 0, last_ns = 0;
    std::uint64_t begins = 0, bytes = 0, index_bytes = 0, content_bytes = 0, packed_bytes = 0;
    std::map<std::uint16_t, std::uint64_t> index_of_channel;
  };
  void write(std::string_view bytes);
  void end_chunk();
  void write_chunk_index(const Chunk& chunk);
  void write_statistics();

  std::filesystem::path name_;
  std::ofstream file_;
  std::uint64_t at_ = 0;     // length of the file so far
  std::string definitions_;  // records of schemas and channels, which the file has in two places
  std::uint16_t schemas_ = 0, channels_ = 0;
  std::string content_;  // content of the present chunk
  Chunk chunk_;
  std::map<std::uint16_t, std::vector<std::pair<std::int64_t, std::uint64_t>>>
      places_;  // by channel: time and offset of each message in the present chunk
  std::vector<Chunk> chunks_;
  std::map<std::uint16_t, std::uint64_t> counts_;
  std::map<std::uint16_t, std::uint32_t> sequences_;
  std::int64_t first_ns_ = 0, last_ns_ = 0;
};

}  // namespace proxarm::view
