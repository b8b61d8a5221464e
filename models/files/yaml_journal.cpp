#include "models/files/yaml_journal.hpp"

#include <cassert>

namespace proxarm::description {
namespace {

thread_local YamlJournal* listener = nullptr;

}  // namespace

YamlListening::YamlListening(YamlJournal& journal) noexcept {
  assert(listener == nullptr);
  listener = &journal;
}

YamlListening::~YamlListening() { listener = nullptr; }

bool is_heard() noexcept { return listener != nullptr; }

void note(const YamlNode& parent, std::string_view key, const YamlFact& fact) {
  if (listener != nullptr) listener->note(parent, key, fact);
}

}  // namespace proxarm::description
