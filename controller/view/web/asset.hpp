// A file that the server gives out, with what a browser is told of it.
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
  std::string gzip;  // the same compressed; empty: it isn't worth it
};
using AssetPtr = std::shared_ptr<const Asset>;

// Compressed where that makes it smaller by a tenth.
AssetPtr make_asset(std::string type, std::string body);

// By the end of the name; "application/octet-stream" for what isn't known.
std::string type_of(const std::filesystem::path& file);

// All files of a page by their paths in it: "/index.html". Only what is listed can be asked for, so no path leads out.
using Assets = std::map<std::string, AssetPtr, std::less<>>;

// Adds the files of `folder`, as at `prefix`. Throws SetupError where it holds no index.html.
void add_page(Assets& assets, const std::filesystem::path& folder);
// three.js as Debian installs it. Throws SetupError where the package is missing.
void add_three(Assets& assets, const std::filesystem::path& folder);

}  // namespace proxarm::view
