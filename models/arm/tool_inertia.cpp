#include "models/arm/tool_inertia.hpp"

#include "models/arm/arm.hpp"
#include "models/geometry/eigenvalues.hpp"

namespace proxarm::models {

Mat3 inertia_about_centre_S(const description::ToolDescription& tool) noexcept {
  const auto& I = tool.inertia_kg_m2;
  Mat3 inertia;
  inertia << I[0], I[3], I[4], I[3], I[1], I[5], I[4], I[5], I[2];
  return inertia;
}

ToolInertia tool_about_T(const description::ToolDescription& tool) noexcept {
  const Mat3 R_ST = to_pose(tool.handle_S).linear();
  const Mat3 about_centre_S = inertia_about_centre_S(tool);
  const Vec3 r_S = Vec3(tool.centre_of_mass_S_m.data()) - Vec3(tool.handle_S.position_m.data());
  // Steiner's theorem: I_T = I_C + m (r·r E − r rᵀ).
  const Mat3 about_T_S = about_centre_S + tool.mass_kg * (r_S.squaredNorm() * Mat3::Identity() - r_S * r_S.transpose());
  return {.mass_kg = tool.mass_kg,
          .centre_T_m = R_ST.transpose() * r_S,
          .about_T_kg_m2 = R_ST.transpose() * about_T_S * R_ST};
}

ToolInertia tool_inertia(const description::ToolDescription& tool) {
  ToolInertia out = tool_about_T(tool);
  SmallMatrix all = out.about_T_kg_m2;
  out.largest_kg_m2 = symmetric_eigenvalues(all)[2];
  return out;
}

}  // namespace proxarm::models
