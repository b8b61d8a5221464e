#include "models/files/key_line.hpp"

#include <sstream>

#include "models/files/yaml_file.hpp"

namespace proxarm::description {

int line_of_key(const std::filesystem::path& file, const std::string& dotted) {
  YamlNode node = YamlNode::load(file);
  int line = 0;
  std::istringstream parts(dotted);
  for (std::string part; std::getline(parts, part, '.');) {
    if (!node.is_map() || !node.has(part)) break;
    node = node.at(part);
    line = node.line();
  }
  return line;
}

}  // namespace proxarm::description
