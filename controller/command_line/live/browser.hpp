// Opens an address of the view in the user's browser, without showing it to other users.
#pragma once

#include <string>

namespace proxarm::command_line {

class BrowserDoor {
 public:
  // Where there is a desktop and somebody at a terminal: opens it. Nowhere else, and never throws: the address is
  // printed anyway.
  explicit BrowserDoor(const std::string& url);
  BrowserDoor(const BrowserDoor&) = delete;
  BrowserDoor& operator=(const BrowserDoor&) = delete;
  ~BrowserDoor();

 private:
  std::string file_;  // leads to the address, and only its owner may read it: a command line everybody may
};

}  // namespace proxarm::command_line
