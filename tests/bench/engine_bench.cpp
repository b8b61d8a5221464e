// (26) and order 2 against physics engines of Debian 12 on the same point, the same wall, under the same forces at the
// same steps of 1 ms: the time of a step, and the rms position error against the exact solution, the median of twenty
// places within a step at which the motion begins.
//
// Each engine is tuned to each motion: of the settings below, the one that errs least. A ball of 1 cm that doesn't turn
// stands for the point; the plane lies a radius lower. All engines integrate by semi-implicit Euler, so their velocity
// begins half a step before the position, as leapfrog has it. The label of each line says the setting.
//   MuJoCo   the contact's stiffness and damping (solref), its impedance (solimp); Newton, elliptic cones
//   ODE      error reduction (ERP) and constraint force mixing (CFM) of the contact; the direct solver; one axis of its
//            friction pyramid along the slide, or the force of a ball at rest
//   Bullet   error reduction (ERP) of the contact, with split impulse and without; 50 iterations
// An engine whose headers weren't there when this was built is left out, and a line says so.
#include <benchmark/benchmark.h>
#include <mujoco/mujoco.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#ifdef PROXARM_ODE
#include <ode/ode.h>
#endif
#ifdef PROXARM_BULLET
#include <btBulletDynamicsCommon.h>
#endif

#include "controller/extras/studies/error/error_cases.hpp"
#include "controller/proxies/admittance_proxy.hpp"

namespace proxarm {
namespace {

using models::Vec3;
using studies::CaseState;
using studies::ErrorCase;

constexpr double T = 1e-3, radius_m = 0.01;

// Where an engine's motion begins, with the velocity half a step early.
CaseState begin(const ErrorCase& which, double t_0) {
  CaseState start = which.exact(t_0);
  start.v -= 0.5 * T / which.mass_kg * (which.force(t_0, start.q, start.v) + start.f);
  return start;
}

class Engine {
 public:
  Engine() = default;
  Engine(const Engine&) = delete;
  Engine& operator=(const Engine&) = delete;
  virtual ~Engine() = default;
  virtual void step(const Vec3& force) = 0;
  [[nodiscard]] virtual Vec3 position() const = 0;
};

class Proxy final : public Engine {
 public:
  Proxy(const ErrorCase& which, int order, double t_0)
      : world_(which.world()), proxy_({.mass_kg = which.mass_kg, .period_s = T, .order = order}, *world_) {
    const CaseState start = which.exact(t_0);
    proxy_.start({.q = start.q,
                  .v = start.v,
                  .a = (which.force(t_0, start.q, start.v) + start.f) / which.mass_kg,
                  .time_s = t_0,
                  .contact_established = which.starts_in_contact});
  }
  void step(const Vec3& force) override { static_cast<void>(proxy_.step(force)); }
  [[nodiscard]] Vec3 position() const override { return proxy_.q(); }

 private:
  std::unique_ptr<models::GeometricAlgorithm<3>> world_;
  controller::AdmittanceProxy<3> proxy_;
};

struct MujocoTuning {
  double stiffness, ratio, impedance;
};

class Mujoco final : public Engine {
 public:
  Mujoco(const ErrorCase& which, const MujocoTuning& tuning, double t_0) {
    char text[2000];
    // A negative solref is stiffness and damping; both are of the constraint's acceleration, so per kilogram.
    std::snprintf(text, sizeof text,
                  "<mujoco><option timestep='%g' gravity='0 0 0' cone='elliptic' solver='Newton' tolerance='1e-12'/>"
                  "<worldbody><geom type='plane' size='5 5 1' pos='0 0 %g' friction='%g 0 0' condim='3' "
                  "solref='%g %g' solimp='%g %g 0.001'/><body><joint type='slide' axis='1 0 0'/>"
                  "<joint type='slide' axis='0 1 0'/><joint type='slide' axis='0 0 1'/>"
                  "<geom type='sphere' size='%g' mass='%g' friction='%g 0 0' condim='3' solref='%g %g' "
                  "solimp='%g %g 0.001'/></body></worldbody></mujoco>",
                  T, -radius_m, which.friction, -tuning.stiffness, -2.0 * tuning.ratio * std::sqrt(tuning.stiffness),
                  tuning.impedance, tuning.impedance, radius_m, which.mass_kg, which.friction, -tuning.stiffness,
                  -2.0 * tuning.ratio * std::sqrt(tuning.stiffness), tuning.impedance, tuning.impedance);
    auto files = std::make_unique<mjVFS>();
    mj_defaultVFS(files.get());
    const std::string model = text;
    mj_makeEmptyFileVFS(files.get(), "point.xml", static_cast<int>(model.size()));
    std::copy(model.begin(), model.end(), static_cast<char*>(files->filedata[0]));
    char error[300] = "";
    model_ = mj_loadXML("point.xml", files.get(), error, sizeof error);
    mj_deleteVFS(files.get());
    if (model_ == nullptr) {
      std::fprintf(stderr, "MuJoCo: %s\n", error);
      std::abort();
    }
    data_ = mj_makeData(model_);
    const CaseState start = begin(which, t_0);
    for (int i = 0; i < 3; ++i) {
      data_->qpos[i] = start.q[i];
      data_->qvel[i] = start.v[i];
    }
  }
  ~Mujoco() override {
    mj_deleteData(data_);
    mj_deleteModel(model_);
  }
  void step(const Vec3& force) override {
    for (int i = 0; i < 3; ++i) data_->qfrc_applied[i] = force[i];
    mj_step(model_, data_);
  }
  [[nodiscard]] Vec3 position() const override { return {data_->qpos[0], data_->qpos[1], data_->qpos[2]}; }

 private:
  mjModel* model_ = nullptr;
  mjData* data_ = nullptr;
};

#ifdef PROXARM_ODE
struct OdeTuning {
  double erp, cfm;
};

class Ode final : public Engine {
 public:
  Ode(const ErrorCase& which, const OdeTuning& tuning, double t_0) : friction_(which.friction), tuning_(tuning) {
    static const int ready = dInitODE2(0);
    static_cast<void>(ready);
    world_ = dWorldCreate();
    dWorldSetGravity(world_, 0.0, 0.0, 0.0);
    dWorldSetERP(world_, tuning.erp);
    dWorldSetCFM(world_, tuning.cfm);
    group_ = dJointGroupCreate(0);
    plane_ = dCreatePlane(nullptr, 0.0, 0.0, 1.0, -radius_m);
    ball_ = dCreateSphere(nullptr, radius_m);
    body_ = dBodyCreate(world_);
    dMass mass;
    dMassSetSphereTotal(&mass, which.mass_kg, 1e3);  // so much inertia that friction doesn't turn it
    dBodySetMass(body_, &mass);
    dBodySetMaxAngularSpeed(body_, 0.0);
    dGeomSetBody(ball_, body_);
    const CaseState start = begin(which, t_0);
    dBodySetPosition(body_, start.q.x(), start.q.y(), start.q.z());
    dBodySetLinearVel(body_, start.v.x(), start.v.y(), start.v.z());
  }
  ~Ode() override {
    dJointGroupDestroy(group_);
    dGeomDestroy(ball_);
    dGeomDestroy(plane_);
    dWorldDestroy(world_);
  }
  void step(const Vec3& force) override {
    dContact contact[1] = {};
    if (dCollide(ball_, plane_, 1, &contact[0].geom, sizeof(dContact)) > 0) {
      contact[0].surface.mode = dContactSoftERP | dContactSoftCFM | dContactApprox1 | dContactFDir1;
      const dReal* v = dBodyGetLinearVel(body_);
      Vec3 along(v[0], v[1], 0.0);
      if (along.norm() < 1e-9) along = Vec3(force.x(), force.y(), 0.0);
      if (along.norm() == 0.0) along = Vec3::UnitX();
      along.normalize();
      contact[0].fdir1[0] = along.x();
      contact[0].fdir1[1] = along.y();
      contact[0].surface.mu = friction_;
      contact[0].surface.soft_erp = tuning_.erp;
      contact[0].surface.soft_cfm = tuning_.cfm;
      dJointAttach(dJointCreateContact(world_, group_, contact), body_, nullptr);
    }
    dBodyAddForce(body_, force.x(), force.y(), force.z());
    dWorldStep(world_, T);
    dJointGroupEmpty(group_);
  }
  [[nodiscard]] Vec3 position() const override {
    const dReal* q = dBodyGetPosition(body_);
    return {q[0], q[1], q[2]};
  }

 private:
  double friction_;
  OdeTuning tuning_;
  dWorldID world_;
  dJointGroupID group_;
  dGeomID plane_, ball_;
  dBodyID body_;
};
#endif

#ifdef PROXARM_BULLET
struct BulletTuning {
  double erp;
  bool split;
};

class Bullet final : public Engine {
 public:
  Bullet(const ErrorCase& which, const BulletTuning& tuning, double t_0)
      : dispatcher_(&configuration_),
        ball_shape_(static_cast<btScalar>(radius_m)),
        plane_shape_(btVector3(0, 0, 1), static_cast<btScalar>(-radius_m)),
        world_(&dispatcher_, &broadphase_, &solver_, &configuration_) {
    world_.setGravity(btVector3(0, 0, 0));
    world_.getSolverInfo().m_erp2 = static_cast<btScalar>(tuning.erp);
    world_.getSolverInfo().m_splitImpulse = tuning.split ? 1 : 0;
    world_.getSolverInfo().m_numIterations = 50;
    const CaseState start = begin(which, t_0);
    btTransform place = btTransform::getIdentity();
    plane_ = std::make_unique<btRigidBody>(
        btRigidBody::btRigidBodyConstructionInfo(0, nullptr, &plane_shape_, btVector3(0, 0, 0)));
    place.setOrigin(vector(start.q));
    motion_ = std::make_unique<btDefaultMotionState>(place);
    ball_ = std::make_unique<btRigidBody>(btRigidBody::btRigidBodyConstructionInfo(
        static_cast<btScalar>(which.mass_kg), motion_.get(), &ball_shape_, btVector3(1, 1, 1)));
    ball_->setAngularFactor(btVector3(0, 0, 0));
    ball_->setActivationState(DISABLE_DEACTIVATION);
    ball_->setLinearVelocity(vector(start.v));
    // Bullet multiplies both frictions.
    ball_->setFriction(static_cast<btScalar>(which.friction));
    plane_->setFriction(1);
    world_.addRigidBody(ball_.get());
    world_.addRigidBody(plane_.get());
  }
  ~Bullet() override {
    world_.removeRigidBody(ball_.get());
    world_.removeRigidBody(plane_.get());
  }
  void step(const Vec3& force) override {
    ball_->applyCentralForce(vector(force));
    world_.stepSimulation(static_cast<btScalar>(T), 0);
    ball_->clearForces();
  }
  [[nodiscard]] Vec3 position() const override {
    const btVector3& q = ball_->getWorldTransform().getOrigin();
    return {q.x(), q.y(), q.z()};
  }

 private:
  static btVector3 vector(const Vec3& v) {
    return {static_cast<btScalar>(v.x()), static_cast<btScalar>(v.y()), static_cast<btScalar>(v.z())};
  }
  btDefaultCollisionConfiguration configuration_;
  btCollisionDispatcher dispatcher_;
  btDbvtBroadphase broadphase_;
  btSequentialImpulseConstraintSolver solver_;
  btSphereShape ball_shape_;
  btStaticPlaneShape plane_shape_;
  btDiscreteDynamicsWorld world_;
  std::unique_ptr<btDefaultMotionState> motion_;
  std::unique_ptr<btRigidBody> ball_, plane_;
};
#endif

using Make = std::function<std::unique_ptr<Engine>(const ErrorCase&, double)>;
struct Tuned {
  std::string label{};
  Make make{};
};

double error_of(const ErrorCase& which, const Make& make) {
  constexpr int phases = 20;
  const int steps = static_cast<int>(std::lround(which.duration_s / T));
  std::vector<double> errors;
  for (int phase = 0; phase < phases; ++phase) {
    const double t_0 = T * (phase + 0.5) / phases;
    const auto engine = make(which, t_0);
    double sum = 0.0;
    for (int k = 0; k < steps; ++k) {
      engine->step(which.force(t_0 + k * T, engine->position(), Vec3::Zero()));
      sum += (engine->position() - which.exact(t_0 + (k + 1) * T).q).squaredNorm();
    }
    errors.push_back(std::sqrt(sum / steps));
  }
  std::nth_element(errors.begin(), errors.begin() + phases / 2, errors.end());
  return errors[phases / 2];
}

void bench(benchmark::State& state, const ErrorCase& which, const std::vector<Tuned>& list) {
  const Tuned* best = nullptr;
  double least = 0.0;
  for (const Tuned& tuned : list) {
    const double error = error_of(which, tuned.make);
    if (std::isfinite(error) && (best == nullptr || error < least)) {
      best = &tuned;
      least = error;
    }
  }
  if (best == nullptr) return state.SkipWithError("no setting keeps to numbers");
  const int steps = static_cast<int>(std::lround(which.duration_s / T));
  auto engine = best->make(which, 0.0);
  int k = 0;
  for (auto _ : state) {
    engine->step(which.force(k * T, engine->position(), Vec3::Zero()));
    if (++k < steps) continue;
    state.PauseTiming();
    engine = best->make(which, 0.0);
    k = 0;
    state.ResumeTiming();
  }
  state.counters["error_m"] = least;
  state.SetLabel(best->label);
}

std::string text(const char* pattern, double a, double b, double c = 0.0) {
  char buffer[100];
  std::snprintf(buffer, sizeof buffer, pattern, a, b, c);
  return buffer;
}

const int registered = [] {
  static const std::vector<ErrorCase> cases = studies::error_cases();
  for (const ErrorCase& which : cases) {
    // One plane, and a force that doesn't ask for the velocity.
    if (which.name != "impact" && which.name != "slide" && which.name != "stick_slip") continue;
    const auto add = [&which](const char* engine, std::vector<Tuned> list) {
      benchmark::RegisterBenchmark((which.name + "/" + engine).c_str(),
                                   [&which, list](benchmark::State& state) { bench(state, which, list); });
    };
    for (const int order : {1, 2}) {
      add(order == 1 ? "(26)" : "order 2", {{"nothing to tune", [order](const ErrorCase& c, double t_0) {
                                               return std::make_unique<Proxy>(c, order, t_0);
                                             }}});
    }
    std::vector<Tuned> list;
    for (const double stiffness : {1e3, 1e4, 1e5, 2.5e5, 1e6}) {
      for (const double ratio : {0.3, 1.0, 3.0}) {
        for (const double impedance : {0.9, 0.99, 0.9999}) {
          const MujocoTuning tuning{stiffness, ratio, impedance};
          list.push_back(
              {text("stiffness %g, ratio %g, impedance %g", stiffness, ratio, impedance),
               [tuning](const ErrorCase& c, double t_0) { return std::make_unique<Mujoco>(c, tuning, t_0); }});
        }
      }
    }
    add("MuJoCo", list);
#ifdef PROXARM_ODE
    list.clear();
    for (const double erp : {0.05, 0.2, 0.5, 0.8, 1.0}) {
      for (const double cfm : {0.0, 1e-9, 1e-6, 1e-4}) {
        const OdeTuning tuning{erp, cfm};
        list.push_back({text("ERP %g, CFM %g", erp, cfm),
                        [tuning](const ErrorCase& c, double t_0) { return std::make_unique<Ode>(c, tuning, t_0); }});
      }
    }
    add("ODE", list);
#endif
#ifdef PROXARM_BULLET
    list.clear();
    for (const double erp : {0.05, 0.2, 0.5, 0.8, 1.0}) {
      for (const bool split : {false, true}) {
        const BulletTuning tuning{erp, split};
        list.push_back({text(split ? "ERP %g, split impulse" : "ERP %g", erp, 0.0),
                        [tuning](const ErrorCase& c, double t_0) { return std::make_unique<Bullet>(c, tuning, t_0); }});
      }
    }
    add("Bullet", list);
#endif
  }
#ifndef PROXARM_ODE
  std::fprintf(stderr, "ODE is left out: libode-dev wasn't there when this was built\n");
#endif
#ifndef PROXARM_BULLET
  std::fprintf(stderr, "Bullet is left out: libbullet-dev wasn't there when this was built\n");
#endif
  return 0;
}();

}  // namespace
}  // namespace proxarm
