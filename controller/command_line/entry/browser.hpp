// Opens the view's address in the user's browser, without showing the address to other users.
#pragma once

#include <string>

namespace proxarm::command_line {

class BrowserDoor {
 public:
  // Opens the address if there is a desktop and a terminal; otherwise does nothing. Doesn't throw if the browser can't
  // be started, because the address is printed anyway.
  explicit BrowserDoor(const std::string& url);
  BrowserDoor(const BrowserDoor&) = delete;
  BrowserDoor& operator=(const BrowserDoor&) = delete;
  ~BrowserDoor();

 private:
  // An HTML file that leads to the address and that only its owner can read. On the browser's command line every user
  // could see the address.
  std::string file_;
};

}  // namespace proxarm::command_line
