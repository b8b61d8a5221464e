#include "controller/report/progress.hpp"

#include <sys/ioctl.h>

#include <algorithm>
#include <cmath>

#include "controller/report/terminal.hpp"

namespace proxarm::controller {
namespace {

std::size_t columns_of(std::FILE* stream) {
  winsize size{};
  return ioctl(fileno(stream), TIOCGWINSZ, &size) == 0 && size.ws_col > 0 ? size.ws_col : 80;
}

}  // namespace

Progress::Progress(double total_s, std::FILE* stream, std::string unit)
    : total_s_(total_s), stream_(stream), unit_(std::move(unit)), enabled_(can_redraw(stream)) {}

void Progress::update(double done_s, std::string_view note) {
  if (!enabled_) return;
  const auto now = std::chrono::steady_clock::now();
  if (drawn_ && now - last_ < std::chrono::milliseconds(100)) return;
  last_ = now;
  drawn_ = true;
  // The last column stays free, since some terminals wrap when the last column is written.
  const std::string line = "\r" + progress_line(done_s, total_s_, note, columns_of(stream_) - 1, unit_) + "\x1b[K";
  std::fwrite(line.data(), 1, line.size(), stream_);
  std::fflush(stream_);
}

void Progress::clear() {
  if (!drawn_) return;
  std::fputs("\r\x1b[K", stream_);
  std::fflush(stream_);
  drawn_ = false;
}

std::string progress_line(double done_s, double total_s, std::string_view note, std::size_t columns,
                          std::string_view unit) {
  const double ratio = done_s / total_s;
  const double fraction = std::isfinite(ratio) ? std::clamp(ratio, 0.0, 1.0) : 0.0;
  constexpr std::size_t width = 24;
  const auto filled = static_cast<std::size_t>(fraction * static_cast<double>(width));
  char text[64];
  std::snprintf(text, sizeof text, "%4.0f %% [", std::floor(100.0 * fraction));
  std::string line = text;
  for (std::size_t i = 0; i < width; ++i) line += i < filled ? '=' : i == filled ? '>' : ' ';
  std::snprintf(text, sizeof text, unit == "s" ? "] %.1f of %.4g " : "] %.0f of %.0f ", done_s, total_s);
  line += text;
  line += unit;
  if (!note.empty()) line += ", ";
  line += note;
  if (line.size() <= columns) return line;
  // Doesn't cut inside a UTF-8 character.
  std::size_t end = columns;
  while (end > 0 && (static_cast<unsigned char>(line[end]) & 0xC0) == 0x80) --end;
  return line.substr(0, end);
}

}  // namespace proxarm::controller
