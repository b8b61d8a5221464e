// A file that the server sends, with its headers.
#pragma once

#include <filesystem>
#include <map>
#include <memory>
#include <string>
#include <string_view>

namespace proxarm::view {

struct Asset {
  std::string type;  // Content-Type
  std::string body;
  std::string gzip;  // the compressed body; empty: not worth it
};
using AssetPtr = std::shared_ptr<const Asset>;

// Compresses the body if this makes it smaller by at least a tenth.
AssetPtr make_asset(std::string type, std::string body);

// The content type by the end of the name; "application/octet-stream" for unknown ones.
std::string type_of(const std::filesystem::path& file);

// All files of a page by their URL paths ("/index.html"). Only these are served, so no path leads elsewhere.
using Assets = std::map<std::string, AssetPtr, std::less<>>;

// Adds the files of `folder` under their paths in it. Throws SetupError if there is no index.html.
void add_page(Assets& assets, const std::filesystem::path& folder);
// Adds three.js as Debian installs it. Throws SetupError if the package is missing.
void add_three(Assets& assets, const std::filesystem::path& folder);

}  // namespace proxarm::view
