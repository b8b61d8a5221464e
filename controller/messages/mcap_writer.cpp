#include "controller/messages/mcap_writer.hpp"

#include <array>
#include <boost/crc.hpp>
#include <cstring>

#include "models/base/setup_error.hpp"
#include "models/packed/packed.hpp"

namespace proxarm::view {
namespace {

constexpr std::string_view magic("\x89MCAP0\r\n", 8);
constexpr std::string_view compression = "zstd";
constexpr std::size_t chunk_bytes = 1 << 20;

enum class Op : std::uint8_t {
  header = 0x01,
  footer = 0x02,
  schema = 0x03,
  channel = 0x04,
  message = 0x05,
  chunk = 0x06,
  message_index = 0x07,
  chunk_index = 0x08,
  statistics = 0x0B,
  summary_offset = 0x0E,
  data_end = 0x0F,
};

// The content of a record, written field by field.
class Content {
 public:
  template <typename Number>
  Content& number(Number value) {
    std::array<char, sizeof(Number)> bytes;
    std::memcpy(bytes.data(), &value, sizeof value);
    text_.append(bytes.data(), bytes.size());
    return *this;
  }
  Content& text(std::string_view value) {
    number(static_cast<std::uint32_t>(value.size()));
    text_.append(value);
    return *this;
  }
  Content& raw(std::string_view value) {
    text_.append(value);
    return *this;
  }
  template <typename Key, typename Value>
  Content& numbers(const std::map<Key, Value>& map) {
    number(static_cast<std::uint32_t>(map.size() * (sizeof(Key) + sizeof(Value))));
    for (const auto& [key, value] : map) number(key).number(value);
    return *this;
  }
  [[nodiscard]] const std::string& bytes() const noexcept { return text_; }

 private:
  std::string text_;
};

std::string record(Op op, const Content& content) {
  return Content()
      .number(static_cast<std::uint8_t>(op))
      .number(static_cast<std::uint64_t>(content.bytes().size()))
      .raw(content.bytes())
      .bytes();
}

std::uint32_t crc_of(std::string_view bytes) {
  boost::crc_32_type crc;
  crc.process_bytes(bytes.data(), bytes.size());
  return crc.checksum();
}

}  // namespace

McapWriter::McapWriter(const std::filesystem::path& file)
    : name_(file), file_(file, std::ios::binary | std::ios::trunc) {
  if (!file_) throw description::SetupError({.file = name_.string(), .message = "can't be written"});
  write(magic);
  write(record(Op::header, Content().text("").text("proxarm")));
}

void McapWriter::write(std::string_view bytes) {
  // cppcheck-suppress danglingTemporaryLifetime  // it lives until the call is over
  file_.write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
  at_ += bytes.size();
}

std::uint16_t McapWriter::add_schema(const std::string& name, const std::string& json_schema) {
  definitions_ += record(Op::schema, Content().number(++schemas_).text(name).text("jsonschema").text(json_schema));
  return schemas_;
}

std::uint16_t McapWriter::add_channel(const std::string& topic, std::uint16_t schema) {
  definitions_ += record(Op::channel, Content()
                                          .number(++channels_)
                                          .number(schema)
                                          .text(topic)
                                          .text("json")
                                          .numbers(std::map<std::uint32_t, std::uint32_t>()));
  counts_[channels_] = 0;
  return channels_;
}

void McapWriter::add(std::uint16_t channel, std::int64_t time_ns, std::string_view message) {
  if (content_.empty()) {
    if (chunks_.empty()) {
      content_ = definitions_;
      first_ns_ = time_ns;
    }
    chunk_ = {};
    chunk_.first_ns = time_ns;
  }
  places_[channel].emplace_back(time_ns, content_.size());
  const auto time = static_cast<std::uint64_t>(time_ns);
  content_ += record(Op::message,
                     Content().number(channel).number(sequences_[channel]++).number(time).number(time).raw(message));
  chunk_.last_ns = last_ns_ = time_ns;
  ++counts_[channel];
  if (content_.size() >= chunk_bytes) end_chunk();
}

void McapWriter::end_chunk() {
  if (content_.empty()) return;
  chunk_.begins = at_;
  const std::string packed = models::packed(content_);
  chunk_.content_bytes = content_.size();
  chunk_.packed_bytes = packed.size();
  write(record(Op::chunk, Content()
                              .number(chunk_.first_ns)
                              .number(chunk_.last_ns)
                              .number(static_cast<std::uint64_t>(content_.size()))
                              .number(crc_of(content_))
                              .text(compression)
                              .number(chunk_.packed_bytes)
                              .raw(packed)));
  chunk_.bytes = at_ - chunk_.begins;
  const std::uint64_t indices = at_;
  for (const auto& [channel, places] : places_) {
    chunk_.index_of_channel[channel] = at_;
    Content entries;
    for (const auto& [time_ns, place] : places) entries.number(time_ns).number(place);
    write(record(Op::message_index, Content().number(channel).text(entries.bytes())));
  }
  chunk_.index_bytes = at_ - indices;
  chunks_.push_back(chunk_);
  places_.clear();
  content_.clear();
}

void McapWriter::write_chunk_index(const Chunk& chunk) {
  write(record(Op::chunk_index, Content()
                                    .number(chunk.first_ns)
                                    .number(chunk.last_ns)
                                    .number(chunk.begins)
                                    .number(chunk.bytes)
                                    .numbers(chunk.index_of_channel)
                                    .number(chunk.index_bytes)
                                    .text(compression)
                                    .number(chunk.packed_bytes)
                                    .number(chunk.content_bytes)));
}

void McapWriter::write_statistics() {
  std::uint64_t messages = 0;
  for (const auto& [channel, count] : counts_) messages += count;
  write(record(Op::statistics, Content()
                                   .number(messages)
                                   .number(schemas_)
                                   .number(static_cast<std::uint32_t>(channels_))
                                   .number(std::uint32_t{0})  // attachments
                                   .number(std::uint32_t{0})  // metadata
                                   .number(static_cast<std::uint32_t>(chunks_.size()))
                                   .number(first_ns_)
                                   .number(last_ns_)
                                   .numbers(counts_)));
}

void McapWriter::finish() {
  end_chunk();
  write(record(Op::data_end, Content().number(std::uint32_t{0})));
  const std::uint64_t summary = at_;
  write(definitions_);
  for (const Chunk& chunk : chunks_) write_chunk_index(chunk);
  write_statistics();
  write(record(Op::footer, Content().number(summary).number(std::uint64_t{0}).number(std::uint32_t{0})));
  write(magic);
  file_.close();
  if (!file_) throw description::SetupError({.file = name_.string(), .message = "couldn't be written whole"});
}

}  // namespace proxarm::view
