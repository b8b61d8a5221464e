// Controls a Chromium without a window through a pipe, by the DevTools protocol: opens an address, runs JavaScript,
// takes pictures.
#pragma once

#include <filesystem>
#include <nlohmann/json_fwd.hpp>
#include <string>

namespace proxarm::command_line {

struct PictureSize {
  int width = 1280, height = 720;
};

class HeadlessBrowser {
 public:
  // Starts the browser. Throws SetupError if no browser is found or the browser doesn't start.
  explicit HeadlessBrowser(PictureSize size, bool dark);
  HeadlessBrowser(const HeadlessBrowser&) = delete;
  HeadlessBrowser& operator=(const HeadlessBrowser&) = delete;
  ~HeadlessBrowser();

  void open(const std::string& url);
  // Waits until the JavaScript expression is true. Throws SetupError if it isn't true within a minute.
  void wait_for(const std::string& condition);
  void run(const std::string& script);
  // Saves a picture of the page as PNG. Throws SetupError if the file can't be written.
  void save_picture(const std::filesystem::path& file);

 private:
  void start(const std::filesystem::path& program);
  void attach(PictureSize size, bool dark);
  nlohmann::json command(const std::string& method, const nlohmann::json& parameters);
  std::string read_message();

  std::filesystem::path profile_;
  int to_ = -1, from_ = -1, child_ = -1;
  int last_id_ = 0;
  std::string session_, buffer_;
};

}  // namespace proxarm::command_line
