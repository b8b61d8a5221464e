// Writes MCAP, the container of messages that Foxglove, Lichtblick and ROS tools read.
//
// A file is magic, records, magic; a record is an opcode (u8), its length (u64) and its content; numbers are
// little-endian, strings and maps are preceded by their length in bytes (u32). Messages stand in chunks of about a
// megabyte, each followed by the places of its messages; at the end stand schemas and channels again, the chunks'
// places and the counts, so that a reader finds any time without reading all. Chunks aren't compressed, and no
// checksum is written but those of the chunks.
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
  // Throws SetupError for a file that can't be written.
  explicit McapWriter(const std::filesystem::path& file);

  // Both before the first message; return the id. Messages of a channel are JSON, by a JSON Schema.
  std::uint16_t add_schema(const std::string& name, const std::string& json_schema);
  std::uint16_t add_channel(const std::string& topic, std::uint16_t schema);
  // Times don't go back.
  void add(std::uint16_t channel, std::int64_t time_ns, std::string_view message);
  // Throws SetupError where it couldn't be written whole.
  void finish();

 private:
  struct Chunk {
    std::int64_t first_ns = 0, last_ns = 0;
    std::uint64_t begins = 0, bytes = 0, index_bytes = 0, content_bytes = 0;
    std::map<std::uint16_t, std::uint64_t> index_of_channel;
  };
  void write(std::string_view bytes);
  void end_chunk();
  void write_chunk_index(const Chunk& chunk);
  void write_statistics();

  std::filesystem::path name_;
  std::ofstream file_;
  std::uint64_t at_ = 0;     // of the file's end
  std::string definitions_;  // schemas and channels as records, for both places
  std::uint16_t schemas_ = 0, channels_ = 0;
  std::string content_;  // of the chunk under way
  Chunk chunk_;
  std::map<std::uint16_t, std::vector<std::pair<std::int64_t, std::uint64_t>>> places_;  // in it, by channel
  std::vector<Chunk> chunks_;
  std::map<std::uint16_t, std::uint64_t> counts_;
  std::map<std::uint16_t, std::uint32_t> sequences_;
  std::int64_t first_ns_ = 0, last_ns_ = 0;
};

}  // namespace proxarm::view
