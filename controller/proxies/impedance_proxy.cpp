#include "controller/proxies/impedance_proxy.hpp"

#include "models/base/option_check.hpp"

namespace proxarm::controller {

void ImpedanceConfig::validate() const {
  require_option(is_positive(stiffness_N_per_m), "--stiffness", stiffness_N_per_m, "N/m, above 0");
  require_option(is_not_negative(damping_Ns_per_m), "--damping", damping_Ns_per_m, "Ns/m, 0 or more");
  require_option(is_positive(period_s), "--timestep", period_s, "seconds, above 0");
}

}  // namespace proxarm::controller
