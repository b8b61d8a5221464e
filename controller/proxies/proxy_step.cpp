#include "controller/proxies/proxy_step.hpp"

#include "models/base/option_check.hpp"

namespace proxarm::controller {

void AdmittanceConfig::validate() const {
  require_option(is_positive(mass_kg), "--mass", mass_kg, "kg, above 0");
  require_option(is_not_negative(damping_Ns_per_m), "--damping", damping_Ns_per_m, "Ns/m, 0 or more");
  require_option(is_not_negative(spring_N_per_m), "--spring", spring_N_per_m, "N/m, 0 or more");
  require_option(is_positive(period_s), "--timestep", period_s, "seconds, above 0");
  require_option(is_positive(mass_kg / (period_s * period_s)), "--timestep", period_s,
                 "a time such that M/T² is finite");
  require_option(order == 1 || order == 2, "--order", order, "1 or 2");
}

}  // namespace proxarm::controller
