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
  std::string gzip;  // the compressed body; empty: compressing saves too little
};
using AssetPtr = std::shared_ptr<const Asset>;

// Returns an asset with a compressed body, if compressing makes the body smaller by at least a tenth.
AssetPtr make_asset(std::string type, std::string body);

// Returns the content type by the file's extension; "application/octet-stream" for an unknown extension.
std::string type_of(const std::filesystem::path& file);

// All files of a page by their URL paths ("/index.html"). Only these files are served, so no URL leads to other files.
using Assets = std::map<std::string, AssetPtr, std::less<>>;

// Adds the files of `folder` under their names. Throws SetupError if there is no index.html.
void add_page(Assets& assets, const std::filesystem::path& folder);
// Adds three.js as Debian installs it. Throws SetupError if the package is missing.
void add_three(Assets& assets, const std::filesystem::path& folder);

}  // namespace proxarm::view
