#include "controller/library/recorded_messages.hpp"

namespace proxarm::controller {

RecordedMessages::RecordedMessages(const std::filesystem::path& folder, const PreparedSession& session)
    : stage_(session.cell, session.scene,
             {.period_s = session.settings.period_s,
              .mass_kg = session.settings.mass_kg,
              .damping_Ns_per_m = session.settings.damping_Ns_per_m,
              .spring_N_per_m = session.settings.spring_N_per_m,
              .impedance = session.impedance()}),
      record_(folder / "session.mcap", stage_) {}

}  // namespace proxarm::controller
