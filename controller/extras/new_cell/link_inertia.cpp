#include "controller/extras/new_cell/link_inertia.hpp"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <string_view>

namespace proxarm::command_line {
namespace {

using models::Vec3;
using tinyxml2::XMLElement;

// Mass of an arm divided by its reach cubed. Collaborative arms with a reach of 1 m have 20 to 30 kg/m³, and industrial
// arms with 2.5 m have 70 kg/m³.
constexpr double usual_kg_per_m3 = 40.0;
// effort_over_weight: the largest effort of a revolute joint, divided by the torque of the stretched arm's weight.
// Makers that state both have 1.4 to 2. It limits the estimated mass, because an arm isn't heavier than its joints can
// lift.
//
// least_of_usual: a smaller share of the mass that is usual for the reach isn't estimated. No arm weighs less, and
// efforts are often placeholders.
constexpr double effort_over_weight = 1.4, least_of_usual = 1.0 / 3.0;
constexpr double gravity_m_per_s2 = 9.80665;
constexpr double least_reach_m = 0.1;  // reach of an arm that only slides, or whose joints are in one place
// Values below these are taken for placeholders: a gram, and the moment of a gram at 3 mm.
constexpr double least_mass_kg = 1e-3, least_moment_kg_m2 = 1e-8;

// What a link's <inertial> states physically: nothing, a mass alone, or a mass and an inertia. MuJoCo refuses an
// inertia with a principal moment larger than the sum of the other two moments. Such an inertia comes about when the
// tensor's numbers are in the wrong places.
enum class Inertial { missing, mass_alone, whole };
Inertial inertial_of(const XMLElement* link) {
  const XMLElement* inertial = link->FirstChildElement("inertial");
  const XMLElement* mass = inertial != nullptr ? inertial->FirstChildElement("mass") : nullptr;
  const double mass_kg = mass != nullptr ? mass->DoubleAttribute("value") : 0.0;
  if (!(mass_kg >= least_mass_kg) || !std::isfinite(mass_kg)) return Inertial::missing;
  const XMLElement* inertia = inertial->FirstChildElement("inertia");
  if (inertia == nullptr) return Inertial::mass_alone;
  const double xy = inertia->DoubleAttribute("ixy"), xz = inertia->DoubleAttribute("ixz"),
               yz = inertia->DoubleAttribute("iyz");
  models::Mat3 I;
  I << inertia->DoubleAttribute("ixx"), xy, xz, xy, inertia->DoubleAttribute("iyy"), yz, xz, yz,
      inertia->DoubleAttribute("izz");
  const Vec3 moments = Eigen::SelfAdjointEigenSolver<models::Mat3>(I, Eigen::EigenvaluesOnly).eigenvalues();
  const bool of_a_body = moments[0] >= least_moment_kg_m2 && moments[0] + moments[1] >= moments[2];
  return of_a_body ? Inertial::whole : Inertial::mass_alone;
}

// Gives the link the inertia of a rod from the link's joint to the next joint at `to`. The rod's diameter is a tenth of
// its length, but at least 8 cm.
void set_rod(XMLElement* link, double mass_kg, const Vec3& to, double least_length_m) {
  while (auto* old = link->FirstChildElement("inertial")) link->DeleteChild(old);
  const double length = std::max(to.norm(), least_length_m), radius = std::max(0.05 * length, 0.04);
  const double across = mass_kg * (length * length / 12.0 + radius * radius / 4.0);
  const double along = 0.5 * mass_kg * radius * radius;
  // I = across E + (along − across) n nᵀ
  const Vec3 n = to.norm() > 0.0 ? Vec3(to.normalized()) : Vec3::UnitZ();
  const models::Mat3 I = across * models::Mat3::Identity() + (along - across) * n * n.transpose();
  XMLElement* inertial = link->InsertNewChildElement("inertial");
  inertial->InsertFirstChild(link->GetDocument()->NewComment(" estimated by proxarm new-cell: a rod "));
  const auto number = [](double x) {
    char text[32];
    std::snprintf(text, sizeof text, "%.9g", std::abs(x) < 1e-12 ? 0.0 : x);
    return std::string(text);
  };
  XMLElement* origin = inertial->InsertNewChildElement("origin");
  origin->SetAttribute("xyz", (number(0.5 * to.x()) + " " + number(0.5 * to.y()) + " " + number(0.5 * to.z())).c_str());
  inertial->InsertNewChildElement("mass")->SetAttribute("value", number(mass_kg).c_str());
  XMLElement* inertia = inertial->InsertNewChildElement("inertia");
  inertia->SetAttribute("ixx", number(I(0, 0)).c_str());
  inertia->SetAttribute("ixy", number(I(0, 1)).c_str());
  inertia->SetAttribute("ixz", number(I(0, 2)).c_str());
  inertia->SetAttribute("iyy", number(I(1, 1)).c_str());
  inertia->SetAttribute("iyz", number(I(1, 2)).c_str());
  inertia->SetAttribute("izz", number(I(2, 2)).c_str());
}

// A link of the chain behind a moving joint, and the place of the next moving joint relative to the link's own joint.
// Fixed joints between them are included.
struct MovingLink {
  XMLElement* element;
  Vec3 to_next = Vec3::Zero();
};

// Returns the largest effort of a joint that turns; 0 if the URDF states none.
double strongest_Nm(const UrdfTree::Path& path) {
  double most = 0.0;
  for (const UrdfTreeJoint* joint : path) {
    const XMLElement* const limit = joint->element->FirstChildElement("limit");
    const char* const type = joint->element->Attribute("type");
    if (limit == nullptr || type == nullptr || std::string_view(type) == "prismatic") continue;
    const double effort = limit->DoubleAttribute("effort");
    if (std::isfinite(effort)) most = std::max(most, effort);
  }
  return most;
}

// Estimates the arm's mass m from the reach and the joints' efforts. If the arm is stretched and d_k is the distance
// from the first joint to the middle of link k, the weight's torque is g m Σ share_k d_k, where the shares add up to 1.
double estimated_mass_kg(const UrdfTree::Path& path, const std::vector<MovingLink>& moving,
                         const std::vector<double>& share, double shares, double reach_m) {
  const double usual_kg = usual_kg_per_m3 * std::pow(reach_m, 3);
  double lever_m = 0.0, from_m = 0.0;
  for (std::size_t k = 0; k < moving.size(); ++k) {
    const double length_m = moving[k].to_next.norm();
    lever_m += share[k] / shares * (from_m + 0.5 * length_m);
    from_m += length_m;
  }
  const double strongest = strongest_Nm(path);
  if (!(strongest > 0.0) || !(lever_m > 0.0)) return usual_kg;
  return std::clamp(strongest / effort_over_weight / (gravity_m_per_s2 * lever_m), least_of_usual * usual_kg, usual_kg);
}

}  // namespace

void estimate_inertia(UrdfTree& tree, const UrdfTree::Path& path, std::optional<double> said_kg,
                      std::vector<std::string>& remarks) {
  std::vector<MovingLink> moving;
  double reach_m = 0.0;  // from the first joint on, because a pedestal below that joint isn't part of the reach
  for (const UrdfTreeJoint* joint : path) {
    if (!moving.empty()) {
      reach_m += joint->origin().norm();
      moving.back().to_next += joint->origin();
    }
    if (joint->moves()) moving.push_back({tree.links().at(joint->child)});
  }
  reach_m = std::max(reach_m, least_reach_m);
  std::vector<double> share;
  double shares = 0.0;
  for (const MovingLink& link : moving) {
    const double outwards = std::pow(0.75, static_cast<double>(share.size()));
    share.push_back((link.to_next.norm() + 0.1 * reach_m) * outwards);
    shares += share.back();
  }
  const double arm_kg = said_kg ? *said_kg : estimated_mass_kg(path, moving, share, shares, reach_m);
  std::string estimated;
  for (std::size_t k = 0; k < moving.size(); ++k) {
    XMLElement* const link = moving[k].element;
    const Inertial given = inertial_of(link);
    if (given == Inertial::whole) continue;
    const double mass_kg =
        given == Inertial::mass_alone
            ? link->FirstChildElement("inertial")->FirstChildElement("mass")->DoubleAttribute("value")
            : std::max(arm_kg * share[k] / shares, 0.2);
    set_rod(link, mass_kg, moving[k].to_next, 0.05 * reach_m);
    char part[160];
    std::snprintf(part, sizeof part, "%s%s (%.3g kg%s)", estimated.empty() ? "" : ", ", text_of(link, "name").c_str(),
                  mass_kg, given == Inertial::mass_alone ? ", as the file says" : "");
    estimated += part;
  }
  if (estimated.empty()) return;
  char total[64];
  std::snprintf(total, sizeof total, "%.3g kg", arm_kg);
  remarks.push_back("ESTIMATED inertia of links for which the file has none that a body can have: " + estimated +
                    "; rods, of an arm of " + total +
                    (said_kg ? "" : " by its reach and what its joints can lift (--arm-mass says better)"));
}

}  // namespace proxarm::command_line
