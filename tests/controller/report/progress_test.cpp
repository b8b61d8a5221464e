#include "controller/report/progress.hpp"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <poll.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdlib>
#include <string>

namespace proxarm::controller {
namespace {

TEST(Progress, SaysHowFarItIs) {
  EXPECT_EQ(progress_line(0.0, 10.0, "", 80), "   0 % [>                       ] 0.0 of 10 s");
  EXPECT_EQ(progress_line(4.36, 10.0, "slip", 80), "  43 % [==========>             ] 4.4 of 10 s, slip");
  EXPECT_EQ(progress_line(10.0, 10.0, "", 80), " 100 % [========================] 10.0 of 10 s");
}

TEST(Progress, NeverLeavesItsLineOrItsRange) {
  for (const double done : {-1.0, 0.0, 3.0, 11.0, 1e300, std::nan("")}) {
    for (const double total : {0.0, 10.0, std::nan("")}) {
      EXPECT_LE(progress_line(done, total, "a long note about contact and force", 40).size(), 40u);
    }
  }
  // Not cut within a character: "µ" is two bytes, the second of them would be the 48th.
  EXPECT_EQ(progress_line(1.0, 10.0, "µµ", 48).size() % 2, progress_line(1.0, 10.0, "", 80).size() % 2);
}

TEST(Progress, IsSilentWhereNobodyLooks) {
  std::FILE* file = std::tmpfile();
  {
    Progress progress(10.0, file);
    EXPECT_FALSE(progress.enabled());
    progress.update(1.0, "x");
  }
  EXPECT_EQ(std::ftell(file), 0);
  std::fclose(file);
}

TEST(Progress, DrawsOnATerminalAndCleansUp) {
  const int master = posix_openpt(O_RDWR | O_NOCTTY);
  if (master < 0 || grantpt(master) != 0 || unlockpt(master) != 0) GTEST_SKIP() << "no pseudo-terminal here";
  std::FILE* slave = std::fopen(ptsname(master), "w");
  ASSERT_NE(slave, nullptr);
  setenv("TERM", "xterm", 1);
  const auto start = std::chrono::steady_clock::now();
  {
    Progress progress(10.0, slave);
    ASSERT_TRUE(progress.enabled());
    for (int i = 0; i < 1000; ++i) progress.update(0.001 * i, "free");  // far faster than ten a second
  }
  // A terminal hands over what was written in pieces, and a little later.
  std::string seen;
  pollfd readable{master, POLLIN, 0};
  while (!seen.ends_with("\r\x1b[K") && poll(&readable, 1, 5000) == 1) {
    char piece[4096];
    const ssize_t got = read(master, piece, sizeof piece);
    if (got <= 0) break;
    seen.append(piece, static_cast<std::size_t>(got));
  }
  EXPECT_NE(seen.find("of 10 s, free"), std::string::npos);
  // Ten a second, whatever else the machine is doing.
  const std::chrono::duration<double> took = std::chrono::steady_clock::now() - start;
  EXPECT_LE(static_cast<double>(std::count(seen.begin(), seen.end(), '%')), 1.0 + took.count() / 0.1);
  EXPECT_TRUE(seen.ends_with("\r\x1b[K"));
  setenv("TERM", "dumb", 1);
  EXPECT_FALSE(Progress(10.0, slave).enabled());
  std::fclose(slave);
  close(master);
}

}  // namespace
}  // namespace proxarm::controller
