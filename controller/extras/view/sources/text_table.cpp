#include "controller/extras/view/sources/text_table.hpp"

#include <fcntl.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <unistd.h>

#include <charconv>

#include "models/base/setup_error.hpp"

namespace proxarm::view {

TextTable::TextTable(const std::filesystem::path& file, std::string_view header_begins) {
  const auto refuse = [&](const char* found) {
    throw description::SetupError(
        {.file = file.string(),
         .found = found,
         .expected = file.filename().string() + " of a session that was recorded, or of a black box"});
  };
  const int descriptor = open(file.c_str(), O_RDONLY | O_CLOEXEC);
  struct stat status {};
  if (descriptor < 0 || fstat(descriptor, &status) != 0 || !S_ISREG(status.st_mode)) refuse("no such file");
  const auto bytes = static_cast<std::size_t>(status.st_size);
  void* const memory = bytes > 0 ? mmap(nullptr, bytes, PROT_READ, MAP_PRIVATE, descriptor, 0) : MAP_FAILED;
  close(descriptor);
  if (memory == MAP_FAILED) refuse("an empty file");
  text_ = {static_cast<const char*>(memory), bytes};
  const std::string_view header = line_at(0);
  if (!header.starts_with(header_begins)) {
    munmap(memory, bytes);
    refuse("another kind of file");
  }
  for (std::size_t at = header.size() + 1; at < bytes;) {
    const std::size_t end = text_.find('\n', at);
    if (end == std::string_view::npos) break;
    rows_.push_back(at);
    at = end + 1;
  }
}

TextTable::~TextTable() { munmap(const_cast<char*>(text_.data()), text_.size()); }

std::vector<std::string_view> TextTable::names() const {
  std::vector<std::string_view> names;
  const std::string_view header = line_at(0);
  for (std::size_t at = 0; at <= header.size();) {
    names.push_back(header.substr(at, header.find(',', at) - at));
    at += names.back().size() + 1;
  }
  return names;
}

std::uint64_t TextTable::first(std::size_t row) const noexcept {
  std::uint64_t number = 0;
  std::from_chars(text_.data() + rows_[row], text_.data() + text_.size(), number);
  return number;
}

}  // namespace proxarm::view
