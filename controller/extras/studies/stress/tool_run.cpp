#include "controller/extras/studies/stress/tool_run.hpp"

#include <Eigen/QR>
#include <algorithm>
#include <cmath>
#include <span>
#include <sstream>

#include "controller/extras/studies/stress/random_tool.hpp"
#include "controller/extras/studies/stress/tool_laws.hpp"
#include "controller/extras/studies/stress/tool_parts.hpp"
#include "controller/proxies/pose_proxy.hpp"
#include "scenes/compiler/obstacles.hpp"
#include "scenes/rigid/compile_rigid.hpp"

namespace proxarm::studies {
namespace {

using controller::PoseProxy;
using models::Mat6;
using models::PoseAlgorithm;
using models::PoseContact;
using models::ToolPose;
using models::Twist;
using models::Vec3;

constexpr int steps_per_run = 1000;
// A run ends before a step that is larger than most_m or most_rad, or if the tool is further than furthest_m from the
// origin.
constexpr double most_m = 0.05, most_rad = 0.3, furthest_m = 2.0;
constexpr double lever = ToolLaws::lever_m;

Twist levers() {
  Twist out;
  out << Vec3::Ones(), Vec3::Constant(lever);
  return out;
}

// Returns a random K whose eigenvectors have any direction, and whose eigenvalues (N/m) are 1 to `condition`.
Mat6 random_stiffness(Random& random, double condition) {
  Mat6 A;
  for (int i = 0; i < 36; ++i) A.data()[i] = random.uniform(-1.0, 1.0);
  const Mat6 axes = Eigen::HouseholderQR<Mat6>(A).householderQ();
  Twist values;
  values << 1.0, condition, 0.0, 0.0, 0.0, 0.0;
  for (int i = 2; i < 6; ++i) values[i] = random.log_uniform(1.0, condition);
  const Mat6 half = levers().asDiagonal() * axes * values.cwiseSqrt().asDiagonal();
  return half * half.transpose();
}

// Makes wrenches as a hand or a machine might make them, with a spring and a damper that lead the tool back to `home`.
class Pull {
 public:
  Pull(Random& random, const Vec3& towards, const Vec3& home)
      : random_(random),
        size_N_(random.log_uniform(1e-2, 1e3)),
        kind_(random.below(5)),
        noise_(random.chance(0.5) ? random.log_uniform(1e-6, 1.0) : 0.0),
        turn_(random.log_uniform(1e-3, 1.0)),
        centring_(random.log_uniform(3e-3, 0.3)),
        arm_m_(random.log_uniform(1e-4, 0.05)),
        force_(random.direction()),
        torque_(random.direction()),
        towards_(towards),
        home_(home) {}

  [[nodiscard]] double size_N() const noexcept { return size_N_; }

  models::Wrench operator()(int step, const PoseProxy& proxy) {
    const auto& config = proxy.config();
    const Vec3 &q = proxy.q().position, v = proxy.move().head<3>() / config.period_s,
               omega = proxy.move().tail<3>() / config.period_s;
    if (kind_ == 1 && random_.chance(0.03)) {
      force_ = random_.direction();
      torque_ = random_.direction();
    }
    if (kind_ == 3) {
      force_ = (force_ + 0.1 * random_.in_box(1.0)).normalized();
      torque_ = (torque_ + 0.1 * random_.in_box(1.0)).normalized();
    }
    if (kind_ == 4) force_ = (towards_ - q) / (1e-3 + (towards_ - q).norm());
    const double share = kind_ == 2 ? std::sin(turn_ * step) : 1.0;
    models::Wrench h{size_N_ * share * force_, size_N_ * arm_m_ * share * torque_};
    if (noise_ > 0.0) {
      h.force += size_N_ * noise_ * random_.in_box(1.0);
      h.torque += size_N_ * arm_m_ * noise_ * random_.in_box(1.0);
    }
    // The frequency of the spring and the damper is so low that they are stable at this timestep.
    const double rate = centring_ / config.period_s;
    h.force -= config.mass_kg * rate * (rate * (q - home_) + v);
    h.torque -= config.inertia_kg_m2 * rate * omega;
    return h;
  }

 private:
  Random& random_;
  double size_N_;
  int kind_;
  double noise_, turn_, centring_, arm_m_;
  Vec3 force_, torque_, towards_, home_;
};

// Returns the place near which the tool is kept. In a hollow object it is off the middle, because a tool in the middle
// would touch nothing. The place is drawn from a seed of its own, so that other worlds stay the same.
Vec3 home_in(const std::string& kind, std::uint64_t seed) {
  Random random(seed + 1);
  const double away_m = random.uniform(0.0, 0.15);
  const Vec3 there = away_m * random.direction();
  return kind == "hollow" ? there : Vec3(Vec3::Zero());
}

class Judge {
 public:
  Judge(const ToolLaws& laws, PoseAlgorithm& g, Random& random, Tally& tally, std::string* report)
      : laws_(laws), g_(g), fresh_(g.clone()), parts_(laws, *fresh_), random_(random), tally_(tally), report_(report) {}

  // Judges step k. `rise_J` is the rise of the tool's energy less the hand's work.
  void step(std::int64_t k, bool fault, const ToolCall& call, double rise_J) {
    step_ = k;
    ++tally_.steps;
    if (fault) return note(finite, call, "", 0.0);
    tally_.contact += call.contacts.empty() ? 0 : 1;
    tally_.slipping += std::any_of(call.contacts.begin(), call.contacts.end(), [](const auto& c) { return c.slips; });
    // Even in a step without forces the tool must not be inside an object.
    const double depth = laws_.depth_m(call.r, call.time_s);
    tally_.deepest_m = std::max(tally_.deepest_m, depth / (1.0 + call.r.position.norm()));
    if (!(depth <= 1e-12)) note(inside, call, "", depth);
    if (call.unresolved) {
      ++tally_.unresolved;
    } else {
      judge_energy(call, rise_J);
    }
    before_ = call.contacts;
    short_before_m_ = ToolLaws::short_m(depth, call.contacts);
    if (call.unresolved) return;
    if (const std::string missed = laws_.missed(call); !missed.empty()) note(law, call, missed, call.wrench().norm());
    if (!call.contacts.empty() && random_.chance(0.2)) judge_stiffness(call);
  }

 private:
  void note(Invariant which, const ToolCall& call, const std::string& what, double value) {
    tally_.violated(which, step_);
    if (report_ == nullptr || report_->size() > 20'000) return;
    std::ostringstream out;
    out.precision(17);
    const auto pose = [&out](const char* name, const ToolPose& x) {
      out << ", " << name << " = [" << x.position.transpose() << "], wxyz [" << x.orientation.w() << " "
          << x.orientation.vec().transpose() << "]";
    };
    out << "step " << step_ << ": " << invariant_names[which] << " " << what << " (" << value << ")";
    pose("p", call.p);
    pose("q", call.q);
    pose("r", call.r);
    out << (call.unresolved ? ", unresolved" : "") << ", contacts:";
    for (const PoseContact& contact : call.contacts) {
      out << " object " << contact.object << "." << contact.feature << (contact.slips ? " slips" : " sticks")
          << " n = [" << contact.normal_W.transpose() << "] f = [" << contact.force_W.transpose()
          << "] mu = " << contact.friction << " gap = " << contact.gap_m;
    }
    *report_ += out.str() + "\n";
  }

  void judge_energy(const ToolCall& call, double rise_J) {
    if (call.contacts.empty()) return;
    const double rest_J = laws_.left_J(call, rise_J, short_before_m_);
    if (!(rest_J > 0.0)) return;
    std::vector<PoseContact> touched = laws_.carried(before_, call.since_s, call.time_s);
    if (parts_.keep(call, short_before_m_, rest_J, touched)) {
      ++tally_.edge;
    } else {
      note(work, call, "J", rest_J);
    }
  }

  // Checks Assumption 1 with a random K'. tests/models/rigid/stiffness_independence_test.cpp explains the tolerances.
  void judge_stiffness(const ToolCall& call) {
    Twist w = Twist::Zero();
    double least_slip_m = 1e9;
    for (const PoseContact& contact : call.contacts) {
      const Vec3 at = contact.point_W - call.r.position;
      w.head<3>() += contact.force_W;
      w.tail<3>() += at.cross(contact.force_W);
      if (contact.force_W.isZero(0.0) || !contact.slips || contact.friction == 0.0) continue;
      least_slip_m = std::min(least_slip_m, call.slip_of(contact).norm());
    }
    if (w.isZero(0.0)) return;
    const double condition = random_.log_uniform(1.0, 1e4), depth_m = random_.log_uniform(1e-7, 1e-3);
    ToolCall other;
    other.K = random_stiffness(random_, condition);
    const double least = levers().cwiseProduct(Twist(other.K.ldlt().solve(w))).norm() / depth_m;
    other.K *= least;
    other.stiffest = condition * least;
    other.p = models::moved(call.r, -other.K.ldlt().solve(w));
    other.q = call.q;
    other.since_s = call.since_s;
    other.time_s = call.time_s;
    other.with = call.with;
    // With moving objects a fresh world repeats the step, because the world that made the step would find its objects
    // at rest.
    const std::unique_ptr<PoseAlgorithm> again = laws_.moves() ? fresh_->clone() : nullptr;
    PoseAlgorithm& g = again ? *again : g_;
    g.set_time({.time_s = call.time_s, .period_s = call.time_s - call.since_s});
    other.r = g.step(other.K, other.p, call.q);
    other.contacts.assign(g.contacts().begin(), g.contacts().end());
    const double off = levers().cwiseProduct(models::difference(other.r, call.r)).norm();
    const double allowed =
        64.0 * ToolLaws::rounding_m(call.r) *
            (std::sqrt(condition) + call.stiffest / least + w.cwiseQuotient(levers()).norm() / least / least_slip_m) +
        1e-12 * std::sqrt(condition) * depth_m;
    if (g.unresolved()) {
      ++tally_.unresolved;
    } else if (!(off <= std::min(allowed, 1e-10))) {
      // If both answers obey the laws in this state, Coulomb's law has several solutions, and 𝒢 isn't at fault.
      if (laws_.missed(other).empty() && laws_.depth_m(other.r, other.time_s) <= 1e-12) {
        ++tally_.several;
      } else {
        note(stiffness, other, laws_.missed(other), off);
      }
    }
  }

  const ToolLaws& laws_;
  PoseAlgorithm& g_;
  std::unique_ptr<PoseAlgorithm> fresh_;  // a world that hasn't made a step
  ToolParts parts_;
  Random& random_;
  Tally& tally_;
  std::string* report_;
  std::vector<PoseContact> before_;  // contacts of the step before
  double short_before_m_ = 0.0;
  std::int64_t step_ = 0;
};

// Finds a random pose at least a millimetre outside all objects. Returns false if no try found one.
bool find_start(Random& random, const ToolLaws& laws, ToolPose& q) {
  for (int k = 0; k < 300; ++k) {
    q.position = random.in_box(0.15);
    q.orientation = models::rotation_by(random.arrow(0.0, 3.0));
    if (laws.depth_m(q) < -1e-3) return true;
  }
  return false;
}

}  // namespace

Tally run_tool_seed(std::uint64_t seed, bool moving, std::string* report) {
  Random random(seed);
  // Drawn from a seed of its own, so that all other draws are as they were before meshes were added.
  const bool meshes = Random(seed + 2).chance(0.2);
  RandomToolScene made = meshes ? random_mesh_tool_scene(random) : random_tool_scene(random);
  if (moving) set_in_motion(random, made.scene);
  Tally tally;
  tally.kind = made.kind;
  tally.objects = made.scene.objects.size();
  const std::unique_ptr<PoseAlgorithm> g = scenes::compile_rigid(made.scene, made.tool);
  const ToolLaws laws(made.scene, made.tool);
  controller::PoseConfig config;
  config.mass_kg = tally.mass_kg = random.log_uniform(0.1, 100.0);
  config.inertia_kg_m2 = config.mass_kg * random.log_uniform(1e-4, 1e-2);
  config.period_s = tally.period_s = random.log_uniform(1e-4, 5e-3);
  const auto& near = made.scene.objects[static_cast<std::size_t>(random.below(static_cast<int>(tally.objects)))];
  Pull pull(random, scenes::middle_of(near.shape), home_in(made.kind, seed));
  tally.force_N = pull.size_N();
  ToolPose q;
  if (!find_start(random, laws, q)) return tally;
  PoseProxy proxy(config, *g);
  proxy.start(q, 0.0);
  Judge judge(laws, *g, random, tally, report);
  const Twist mass = (Twist() << Vec3::Constant(config.mass_kg), Vec3::Constant(config.inertia_kg_m2)).finished();
  const auto energy_J = [&] {
    const Twist v = proxy.move() / config.period_s;
    return 0.5 * v.dot(mass.cwiseProduct(v));
  };
  for (int k = 0; k < steps_per_run; ++k) {
    ToolCall call;
    call.q = proxy.q();
    const double before_J = energy_J();
    const models::Wrench h = pull(k, proxy);
    call.p = proxy.predict(h);
    // The limits of a session would have stopped such a motion.
    const Twist way = models::difference(call.p, call.q);
    if (way.head<3>().norm() > most_m || way.tail<3>().norm() > most_rad || call.q.position.norm() > furthest_m) break;
    call.since_s = proxy.time_s();
    call.K = proxy.K();
    call.stiffest = std::max(call.K(0, 0), call.K(3, 3) / (lever * lever));
    const bool fault = proxy.step(call.p) != controller::ProxyFault::none;
    call.r = proxy.q();
    call.time_s = proxy.time_s();
    laws.carry(call);
    call.contacts.assign(g->contacts().begin(), g->contacts().end());
    call.unresolved = g->unresolved();
    const double hand_J = h.force.dot(proxy.move().head<3>()) + h.torque.dot(proxy.move().tail<3>());
    if (!g->squeezed()) judge.step(k, fault, call, energy_J() - before_J - hand_J);
    tally.squeezed += g->squeezed() ? 1 : 0;
    if (fault || g->squeezed()) break;  // a tool without room isn't judged
  }
  return tally;
}

}  // namespace proxarm::studies
