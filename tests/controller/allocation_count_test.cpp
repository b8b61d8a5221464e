// Each test program counts for itself: the counter replaces malloc in the program that it is linked into.
#include "tests/models/allocation_count_test.cpp"  // NOLINT(bugprone-suspicious-include)
