#include "controller/supervision/supervisor.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <fstream>
#include <map>
#include <string>
#include <vector>

#include "tests/source_file.hpp"

namespace {

using namespace proxarm::controller;

std::vector<Event> all_events() {
  std::vector<Event> events;
  for (std::size_t i = 0; i < event_count; ++i) events.push_back(static_cast<Event>(i));
  return events;
}

// The shortest way there, by the table; checked by the tests below.
Supervisor in_phase(Phase phase) {
  const std::map<Phase, std::vector<Event>> ways{
      {Phase::idle, {}},
      {Phase::enabling, {Event::begin}},
      {Phase::taring, {Event::begin, Event::enabled}},
      {Phase::rendering, {Event::begin, Event::enabled, Event::tared}},
      {Phase::holding, {Event::begin, Event::enabled, Event::tared, Event::hold}},
      {Phase::freeing, {Event::begin, Event::enabled, Event::tared, Event::hold, Event::free}},
      {Phase::stopping, {Event::begin, Event::enabled, Event::tared, Event::stop}},
      {Phase::disabling, {Event::begin, Event::stop}},
      {Phase::faulted, {Event::begin, Event::fault, Event::wait}},
      {Phase::done, {Event::stop}},
  };
  Supervisor supervisor;
  for (const Event event : ways.at(phase)) supervisor.handle(event);
  EXPECT_EQ(supervisor.phase(), phase);
  return supervisor;
}

Supervisor in_rendering() {
  Supervisor supervisor;
  for (const Event event : {Event::begin, Event::enabled, Event::tared}) supervisor.handle(event);
  return supervisor;
}

TEST(Supervisor, WalksTheWholeSession) {
  Supervisor supervisor = in_rendering();
  EXPECT_EQ(supervisor.phase(), Phase::rendering);
  for (const Event event : {Event::stop, Event::at_rest, Event::disabled}) supervisor.handle(event);
  EXPECT_EQ(supervisor.phase(), Phase::done);
  EXPECT_FALSE(supervisor.faulted());
}

// All phases by all events: where the table has a row it moves there, where it has none it stays. Each pair has one row
// at most.
TEST(Supervisor, MovesByTheTableAndByNothingElse) {
  std::size_t rows = 0;
  for (std::size_t from = 0; from < phase_count; ++from) {
    for (const Event event : all_events()) {
      const auto is_pair = [&](const Transition& t) { return t.from == static_cast<Phase>(from) && t.event == event; };
      const auto found = std::count_if(transitions().begin(), transitions().end(), is_pair);
      ASSERT_LE(found, 1) << phase_name(static_cast<Phase>(from)) << " " << event_name(event);
      rows += static_cast<std::size_t>(found);
      Supervisor supervisor = in_phase(static_cast<Phase>(from));
      EXPECT_EQ(supervisor.handle(event), found == 1);
      const Phase expected =
          found == 1 ? std::find_if(transitions().begin(), transitions().end(), is_pair)->to : static_cast<Phase>(from);
      EXPECT_EQ(supervisor.phase(), expected) << phase_name(static_cast<Phase>(from)) << " " << event_name(event);
    }
  }
  EXPECT_EQ(rows, transitions().size());
}

// What any design of the table must keep, whatever its rows are.
TEST(Supervisor, LeadsBackToRenderingThroughAHoldAlone) {
  for (const Transition& t : transitions()) {
    if (t.to == Phase::rendering) {
      EXPECT_TRUE(t.from == Phase::taring || t.from == Phase::holding);
    }
    if (t.to == Phase::freeing) {
      EXPECT_EQ(t.from, Phase::holding);
    }
    if (t.from == Phase::faulted) {
      EXPECT_NE(t.event, Event::resume);
    }
    if (t.from == Phase::stopping) {
      EXPECT_EQ(t.to, Phase::disabling);
    }
    if (t.from == Phase::disabling) {
      EXPECT_TRUE(t.to == Phase::done || t.to == Phase::faulted || t.to == Phase::disabling);
    }
    EXPECT_NE(t.from, Phase::done);
  }
  // Both categories of stop act in every phase in which drives may be enabled.
  for (const Phase phase : {Phase::enabling, Phase::taring, Phase::rendering, Phase::holding, Phase::freeing}) {
    for (const Event event : {Event::fault, Event::fault_off, Event::stop}) {
      Supervisor supervisor = in_phase(phase);
      EXPECT_TRUE(supervisor.handle(event)) << phase_name(phase) << " " << event_name(event);
    }
  }
  // And while the arm stops, until all drives are off, power can still be cut.
  for (const Phase phase : {Phase::stopping, Phase::disabling}) {
    EXPECT_TRUE(in_phase(phase).handle(Event::fault_off)) << phase_name(phase);
  }
}

TEST(Supervisor, ActsByTheReactionOfEachFaultInEachPhase) {
  for (std::size_t i = 1; i < fault_count; ++i) {
    const auto fault = static_cast<Fault>(i);
    for (std::size_t p = 0; p < phase_count; ++p) {
      const auto phase = static_cast<Phase>(p);
      Supervisor supervisor = in_phase(phase);
      supervisor.raise({fault, -1, 17});
      EXPECT_EQ(supervisor.notice(fault).cycles, 1u);
      Reaction reaction = default_reaction(fault);
      const bool live = phase == Phase::rendering || phase == Phase::holding || phase == Phase::freeing;
      if (reaction == Reaction::hold && !live) reaction = Reaction::stop_1;
      Supervisor expected = in_phase(phase);
      if (reaction == Reaction::hold) expected.handle(Event::hold);
      if (reaction == Reaction::stop_1) expected.handle(Event::fault);
      if (reaction == Reaction::stop_0) expected.handle(Event::fault_off);
      EXPECT_EQ(supervisor.phase(), expected.phase()) << fault_name(fault) << " " << phase_name(phase);
      EXPECT_EQ(supervisor.faulted(), reaction >= Reaction::stop_1) << fault_name(fault);
      EXPECT_EQ(supervisor.slowed(18, 3), reaction == Reaction::slow) << fault_name(fault);
      EXPECT_FALSE(supervisor.slowed(21, 3));
    }
  }
}

TEST(Supervisor, CountsWhatItDoesNotStopFor) {
  Supervisor supervisor = in_rendering();
  for (const std::uint64_t cycle : {10u, 11u, 11u, 12u, 20u}) supervisor.raise({Fault::feedback_late, 1, cycle});
  EXPECT_EQ(supervisor.notice(Fault::feedback_late).times, 2u);
  EXPECT_EQ(supervisor.notice(Fault::feedback_late).cycles, 4u);
  EXPECT_EQ(supervisor.phase(), Phase::rendering);
}

TEST(Supervisor, StopsForWhatItWasHeldForWhenTheHoldIsOver) {
  Supervisor supervisor = in_rendering();
  supervisor.raise({Fault::enabling_released, -1, 17});
  EXPECT_EQ(supervisor.phase(), Phase::holding);
  EXPECT_FALSE(supervisor.faulted());
  EXPECT_TRUE(supervisor.cause_lasts(20, 10));
  EXPECT_FALSE(supervisor.cause_lasts(28, 10));
  supervisor.give_up_hold();
  EXPECT_EQ(supervisor.phase(), Phase::stopping);
  EXPECT_EQ(supervisor.report().fault, Fault::enabling_released);
  EXPECT_EQ(supervisor.report().cycle, 17u);
  Supervisor asked = in_rendering();
  asked.hold();
  asked.give_up_hold();
  EXPECT_EQ(asked.phase(), Phase::stopping);
  EXPECT_FALSE(asked.faulted()) << "a hold that was asked for ends without a fault";
}

TEST(Supervisor, ForgetsTheFaultWithAReset) {
  Supervisor supervisor = in_rendering();
  supervisor.raise({Fault::drive_fault, 2, 17});
  EXPECT_FALSE(supervisor.reset()) << "not before the drives are off";
  supervisor.handle(Event::at_rest);
  supervisor.handle(Event::wait);
  EXPECT_TRUE(supervisor.reset());
  EXPECT_EQ(supervisor.phase(), Phase::enabling);
  EXPECT_FALSE(supervisor.faulted());
  supervisor.raise({Fault::sensor_lost, -1, 19});
  EXPECT_EQ(supervisor.report().fault, Fault::sensor_lost);
}

TEST(Supervisor, TakesTheCellsChoices) {
  proxarm::description::SupervisionDescription cell;
  cell.reactions = {{"sensor_lost", "hold"}, {"bus_off", "stop_0"}};
  Supervisor supervisor{reactions_of(cell)};
  for (const Event event : {Event::begin, Event::enabled, Event::tared}) supervisor.handle(event);
  supervisor.raise({Fault::sensor_lost, -1, 17});
  EXPECT_EQ(supervisor.phase(), Phase::holding);
  EXPECT_EQ(supervisor.held_for().fault, Fault::sensor_lost);
  supervisor.raise({Fault::bus_off, 0, 18});
  EXPECT_EQ(supervisor.phase(), Phase::disabling);
}

// The names and defaults that cell files are read by are those of the faults.
TEST(Supervisor, KnowsTheFaultsThatACellMayChooseFor) {
  for (const auto& choice : proxarm::description::reaction_choices()) {
    Fault fault = Fault::none;
    for (std::size_t i = 1; i < fault_count; ++i) {
      if (fault_name(static_cast<Fault>(i)) == std::string(choice.fault)) fault = static_cast<Fault>(i);
    }
    ASSERT_NE(fault, Fault::none) << choice.fault;
    EXPECT_EQ(choice.allowed.front(), reaction_name(default_reaction(fault))) << choice.fault;
    for (const std::string& allowed : choice.allowed) {
      proxarm::description::SupervisionDescription cell;
      cell.reactions[choice.fault] = allowed;
      EXPECT_EQ(allowed, reaction_name(reactions_of(cell)[static_cast<std::size_t>(fault)]));
    }
  }
}

// Cells of a Markdown table's row, without the backquotes.
std::vector<std::string> cells_of(const std::string& line) {
  std::vector<std::string> cells;
  std::string cell;
  for (const char c : line.substr(1)) {
    if (c == '|') {
      while (!cell.empty() && cell.back() == ' ') cell.pop_back();
      cells.push_back(cell.substr(std::min(cell.size(), cell.find_first_not_of(' '))));
      cell.clear();
    } else if (c != '`') {
      cell += c;
    }
  }
  return cells;
}

std::vector<std::vector<std::string>> table_in_docs(const std::string& head) {
  std::ifstream file(proxarm::source_file("docs/reference/supervision.md"));
  std::vector<std::vector<std::string>> rows;
  bool inside = false;
  for (std::string line; std::getline(file, line);) {
    if (inside && line.rfind("|", 0) != 0) break;
    if (inside && line.rfind("|-", 0) != 0) rows.push_back(cells_of(line));
    if (line.rfind(head, 0) == 0) inside = true;
  }
  return rows;
}

// docs/reference/supervision.md shows the table of transitions row by row, and the reactions of all faults with their
// choices.
TEST(Supervisor, IsAsTheDocumentationSays) {
  const auto rows = table_in_docs("| from |");
  ASSERT_EQ(rows.size(), transitions().size());
  for (std::size_t i = 0; i < rows.size(); ++i) {
    const Transition& t = transitions()[i];
    EXPECT_EQ(rows[i][0], phase_name(t.from)) << i;
    EXPECT_EQ(rows[i][1], event_name(t.event)) << i;
    EXPECT_EQ(rows[i][2], phase_name(t.to)) << i;
  }
  const auto faults = table_in_docs("| fault |");
  ASSERT_EQ(faults.size(), fault_count - 1);
  for (std::size_t i = 1; i < fault_count; ++i) {
    const auto fault = static_cast<Fault>(i);
    EXPECT_EQ(faults[i - 1][0], fault_name(fault));
    EXPECT_EQ(faults[i - 1][1], reaction_name(default_reaction(fault))) << fault_name(fault);
    std::string others;
    for (const auto& choice : proxarm::description::reaction_choices()) {
      if (choice.fault != std::string(fault_name(fault))) continue;
      for (std::size_t k = 1; k < choice.allowed.size(); ++k) others += (k > 1 ? ", " : "") + choice.allowed[k];
    }
    EXPECT_EQ(faults[i - 1][2], others) << fault_name(fault);
  }
}

TEST(Supervisor, NeverRendersWithoutEnablingAndTaring) {
  Supervisor supervisor;
  for (const Event event : {Event::tared, Event::enabled, Event::at_rest, Event::disabled}) supervisor.handle(event);
  EXPECT_EQ(supervisor.phase(), Phase::idle);
}

TEST(Supervisor, KeepsTheFirstFault) {
  Supervisor supervisor = in_rendering();
  supervisor.raise({Fault::sensor_lost, -1, 17, 4.0, 3.0});
  supervisor.raise({Fault::bus_off, 2, 18});
  EXPECT_EQ(supervisor.phase(), Phase::stopping);
  EXPECT_EQ(supervisor.report().fault, Fault::sensor_lost);
  EXPECT_EQ(supervisor.report().cycle, 17U);
  EXPECT_EQ(supervisor.escalation().fault, Fault::none);
}

// The story: a drive ran off while the arm stopped because its tool didn't follow. The stop's second fault was noted,
// the drives were told to ramp down as after the first, and the steel went 65 mm at 1.6 m/s.
TEST(Supervisor, CutsThePowerWhenADriveGoesAstrayWhileTheArmStops) {
  for (const Fault astray :
       {Fault::drive_deviates, Fault::position_implausible, Fault::tool_too_fast, Fault::elbow_too_fast}) {
    Supervisor supervisor = in_rendering();
    supervisor.raise({Fault::leash_exceeded, -1, 17});
    EXPECT_FALSE(supervisor.cuts_power());
    supervisor.raise({astray, 0, 18});
    EXPECT_EQ(supervisor.phase(), Phase::disabling);
    EXPECT_TRUE(supervisor.cuts_power());
    supervisor.raise({astray, 0, 19});
    EXPECT_EQ(supervisor.report().fault, Fault::leash_exceeded) << "the first one is the cause";
    EXPECT_EQ(supervisor.escalation().fault, astray);
    EXPECT_EQ(supervisor.escalation().cycle, 18u);
    supervisor.handle(Event::wait);
    EXPECT_TRUE(supervisor.reset());
    EXPECT_FALSE(supervisor.cuts_power());
  }
}

TEST(Supervisor, CutsThePowerOfADriveThatGoesAstrayWhileItIsSwitchedOffWhateverTheCellChose) {
  proxarm::description::SupervisionDescription cell;
  cell.reactions = {{"drive_deviates", "stop_1"}};
  Supervisor supervisor{reactions_of(cell)};
  for (const Event event : {Event::begin, Event::enabled, Event::tared}) supervisor.handle(event);
  supervisor.raise({Fault::drive_deviates, 1, 17});
  supervisor.raise({Fault::drive_deviates, 1, 18});
  EXPECT_EQ(supervisor.phase(), Phase::stopping) << "as the cell chose, while it can be asked to stop";
  EXPECT_FALSE(supervisor.cuts_power());
  supervisor.handle(Event::at_rest);
  supervisor.raise({Fault::drive_deviates, 1, 60});
  EXPECT_TRUE(supervisor.cuts_power());
}

// A drive's own ramp is a better stop than none, so what makes several drives faulty at once isn't counted twice.
TEST(Supervisor, TakesADrivesFaultForASecondOneOnlyWhereTheFirstDoesNotExplainIt) {
  const auto cut = [](Fault first) {
    Supervisor supervisor = in_rendering();
    supervisor.raise({first, 0, 17});
    supervisor.raise({Fault::drive_fault, 1, 18});
    return supervisor.cuts_power();
  };
  for (const Fault first : {Fault::sensor_lost, Fault::leash_exceeded, Fault::force_excessive}) {
    EXPECT_TRUE(cut(first)) << fault_name(first);
  }
  for (const Fault first : {Fault::drive_fault, Fault::bus_off, Fault::overrun, Fault::second_master}) {
    EXPECT_FALSE(cut(first)) << fault_name(first);
  }
  Supervisor asked = in_phase(Phase::stopping);
  asked.raise({Fault::drive_fault, 1, 18});
  EXPECT_FALSE(asked.cuts_power()) << "the first fault of a stop that was asked for: the others brake";
  Supervisor off = in_phase(Phase::disabling);
  off.raise({Fault::drive_fault, 1, 18});
  EXPECT_TRUE(off.cuts_power()) << "the arm stands";
}

TEST(Supervisor, AFaultBeforeAnythingMovesDisablesAtOnce) {
  Supervisor supervisor;
  supervisor.handle(Event::begin);
  supervisor.raise({Fault::drive_not_enabled, 3, 100});
  EXPECT_EQ(supervisor.phase(), Phase::disabling);
}

TEST(FaultText, EveryFaultHasANameOfItsOwn) {
  for (int i = 1; i < static_cast<int>(fault_count); ++i) {
    EXPECT_STRNE(proxarm::controller::fault_name(static_cast<Fault>(i)), "none") << i;
  }
}

TEST(FaultText, OfAFaultAtTheStartSaysThatNothingHasMoved) {
  for (const Fault fault : {Fault::force_at_start, Fault::drive_not_enabled}) {
    const std::string text = describe({fault, 0, 100, 6.0, 5.0}, "");
    EXPECT_NE(text.find("had not begun to move"), std::string::npos) << text;
    EXPECT_EQ(text.find("controlled stop"), std::string::npos) << text;
  }
}

TEST(FaultText, EveryFaultSaysCauseReactionAndAdvice) {
  for (int i = 1; i < static_cast<int>(fault_count); ++i) {
    const std::string text = describe({static_cast<Fault>(i), 0, 100, 6.0, 5.0}, "somewhere");
    const std::size_t cause = text.find(": "), did = text.find("; "), advice = text.rfind("; ");
    EXPECT_TRUE(cause < did && did < advice && advice + 10 < text.size()) << text;
  }
}

TEST(FaultText, OfAStopThatBecameOneOfCategory0TellsBothFaultsAndWhatIsKnown) {
  const FaultReport first{Fault::leash_exceeded, -1, 100, 0.021, 0.02}, then{Fault::drive_deviates, 0, 102, 0.1, 0.02};
  const std::string text = describe(first, "", then, "drive of axis_1", true);
  EXPECT_EQ(text.rfind("leash_exceeded: ", 0), 0u) << text;
  EXPECT_NE(text.find("drive_deviates (drive of axis_1): "), std::string::npos) << text;
  EXPECT_NE(text.find("at cycle 102; the drives were switched off at once; the brakes are to stop the arm; "),
            std::string::npos)
      << text;
  EXPECT_EQ(text.find("a controlled stop"), std::string::npos) << text;
  EXPECT_NE(describe(first, "", then, "", false).find("not every drive has confirmed it"), std::string::npos);
}

TEST(FaultText, DoesNotClaimDrivesToBeOffThatHaveNotSaidSo) {
  const FaultReport report{Fault::drive_silent, 2, 100, 5.0, 4.0};
  const std::string confirmed = describe(report, "drive of axis_3"), not_confirmed = describe(report, "", false);
  EXPECT_NE(confirmed.find("the drives were switched off"), std::string::npos) << confirmed;
  EXPECT_EQ(not_confirmed.find("the drives were switched off"), std::string::npos) << not_confirmed;
  EXPECT_NE(not_confirmed.find("not every drive has confirmed it"), std::string::npos) << not_confirmed;
  EXPECT_NE(describe({Fault::drive_not_disabled, 2, 100}, "", false).find("drive_not_disabled: a drive didn't confirm"),
            std::string::npos);
}

}  // namespace
