// Opens an address of the view in the user's browser, without showing it to other users.
#pragma once

#include <string>

namespace proxarm::command_line {

class BrowserDoor {
 public:
  // Opens the address if there is a desktop and a terminal; otherwise does nothing. Never throws, because the address
  // is printed anyway.
  explicit BrowserDoor(const std::string& url);
  BrowserDoor(const BrowserDoor&) = delete;
  BrowserDoor& operator=(const BrowserDoor&) = delete;
  ~BrowserDoor();

 private:
  std::string file_;  // leads to the address, readable by its owner only: a command line would show it to everybody
};

}  // namespace proxarm::command_line
