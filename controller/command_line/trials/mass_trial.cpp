#include "controller/command_line/trials/mass_trial.hpp"

#include "controller/library/simulated_loop.hpp"
#include "controller/report/summary.hpp"

namespace proxarm::command_line {

MassTrial try_mass(PreparedSession session, double felt_mass_kg, double hand_factor) {
  session.settings.mass_kg = felt_mass_kg;
  session.settings.horizon_s = 0.0;
  session.settings.passivity = controller::Passivity::observe;
  session.hand.mass_kg *= hand_factor;
  session.hand.stiffness_N_per_m *= hand_factor;
  for (description::Grip& grip : session.hand.grips) grip.stiffness_N_per_m *= hand_factor;
  controller::SummaryBuilder summary({.period_s = session.settings.period_s, .passivity = true});
  MassTrial out;
  out.fault = controller::run_quietly(session, [&](controller::CycleRecord record, const sim::Truth& truth) {
                record.set(controller::RecordFlag::truth);
                record.true_tool_W_m = controller::triple(truth.X_WT.translation());
                summary.add(record);
              }).fault;
  out.oscillation = summary.finish().oscillation.value_or(controller::Oscillation{});
  return out;
}

}  // namespace proxarm::command_line
