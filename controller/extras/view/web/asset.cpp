#include "controller/extras/view/web/asset.hpp"

#include <zlib.h>

#include <array>
#include <fstream>
#include <iterator>
#include <utility>

#include "models/base/setup_error.hpp"

namespace proxarm::view {
namespace {

namespace fs = std::filesystem;
using description::SetupError;

std::string contents(const fs::path& file) {
  std::ifstream in(file, std::ios::binary);
  std::string text{std::istreambuf_iterator<char>(in), {}};
  if (!in.good() && !in.eof()) throw SetupError({.file = file.string(), .message = "can't be read"});
  return text;
}

// Returns the body compressed by gzip; empty if zlib fails.
std::string compressed(const std::string& body) {
  z_stream stream{};
  constexpr int gzip_window = 15 + 16;
  if (deflateInit2(&stream, 6, Z_DEFLATED, gzip_window, 8, Z_DEFAULT_STRATEGY) != Z_OK) return {};
  std::string out(deflateBound(&stream, body.size()), '\0');
  stream.next_in = reinterpret_cast<Bytef*>(const_cast<char*>(body.data()));  // zlib only reads it
  stream.avail_in = static_cast<uInt>(body.size());
  stream.next_out = reinterpret_cast<Bytef*>(out.data());
  stream.avail_out = static_cast<uInt>(out.size());
  const bool whole = deflate(&stream, Z_FINISH) == Z_STREAM_END;
  out.resize(stream.total_out);
  deflateEnd(&stream);
  return whole ? out : std::string();
}

}  // namespace

AssetPtr make_asset(std::string type, std::string body) {
  Asset asset{std::move(type), std::move(body), {}};
  constexpr std::size_t worth_it = 512;
  if (asset.body.size() >= worth_it) asset.gzip = compressed(asset.body);
  if (10 * asset.gzip.size() > 9 * asset.body.size()) asset.gzip.clear();
  return std::make_shared<const Asset>(std::move(asset));
}

std::string type_of(const fs::path& file) {
  constexpr std::array<std::pair<std::string_view, const char*>, 6> types{{{".html", "text/html; charset=utf-8"},
                                                                           {".js", "text/javascript; charset=utf-8"},
                                                                           {".css", "text/css; charset=utf-8"},
                                                                           {".json", "application/json"},
                                                                           {".svg", "image/svg+xml"},
                                                                           {".png", "image/png"}}};
  const std::string end = file.extension().string();
  for (const auto& [known, type] : types) {
    if (end == known) return type;
  }
  return "application/octet-stream";
}

void add_page(Assets& assets, const fs::path& folder) {
  std::error_code error;
  for (const fs::directory_entry& entry : fs::directory_iterator(folder, error)) {
    if (!entry.is_regular_file()) continue;
    assets["/" + entry.path().filename().string()] = make_asset(type_of(entry.path()), contents(entry.path()));
  }
  if (assets.contains("/index.html")) return;
  throw SetupError({.file = folder.string(),
                    .found = "no index.html",
                    .expected = "the page of the view",
                    .advice = "is PROXARM_DATA set to another folder?"});
}

void add_three(Assets& assets, const fs::path& folder) {
  for (const char* name : {"build/three.module.js", "examples/jsm/controls/OrbitControls.js"}) {
    std::error_code error;
    if (!fs::is_regular_file(folder / name, error)) {
      throw SetupError({.file = (folder / name).string(),
                        .found = "no such file",
                        .expected = "three.js as Debian's package libjs-three installs it",
                        .advice = "apt-get install libjs-three"});
    }
    assets["/three/" + std::string(name)] = make_asset(type_of(name), contents(folder / name));
  }
}

}  // namespace proxarm::view
