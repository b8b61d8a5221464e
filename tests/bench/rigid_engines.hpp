// One rigid tool among flat or hollow objects, moved by (26) or by a physics engine: what bench_rigid_engines compares.
// All have the same mass (4 kg) and moment of inertia (0.05 kg m²), no gravity, and steps of 1 ms.
#pragma once

#include <mujoco/mujoco.h>

#include <cstdio>
#include <cstdlib>
#include <memory>
#include <string>
#include <vector>

#include "models/rigid/rigid_world.hpp"
#include "tests/models/rigid_judges/held_tool.hpp"

#if __has_include(<btBulletDynamicsCommon.h>)  // only the program that this is for has it among its folders
#include <btBulletDynamicsCommon.h>
#endif

namespace proxarm::bench {

using models::HeldTool;
using models::ToolPose;
using models::Twist;
using models::Vec3;

// A box, or a cylinder along z where `radius` isn't 0; about the origin. The planes are what an engine has it among: a
// table, or the tangents of a hole.
struct RigidScene {
  Vec3 size = Vec3::Zero();
  double length = 0.0, radius = 0.0, friction = 0.0;
  std::vector<models::FlatSide> planes;
  models::RigidObject ours;
  ToolPose start;
};

class RigidEngine {
 public:
  RigidEngine() = default;
  RigidEngine(const RigidEngine&) = delete;
  RigidEngine& operator=(const RigidEngine&) = delete;
  virtual ~RigidEngine() = default;
  virtual void step(const Twist& wrench) = 0;
  // Where it is and how it moves, in a HeldTool.
  virtual void tell(HeldTool& tool) const = 0;
  // Counted by the engine itself, where it does.
  [[nodiscard]] virtual int unresolved() const { return 0; }
};

class Proxy final : public RigidEngine {
 public:
  explicit Proxy(const RigidScene& scene) : world_(tool(scene), {scene.ours}), held_(models::realistic(scene.start)) {}
  void step(const Twist& wrench) override {
    held_.arrive(world_.step(held_.K, held_.freely(wrench), held_.q));
    unresolved_ += world_.unresolved() ? 1 : 0;
  }
  void tell(HeldTool& tool) const override { tool = held_; }
  [[nodiscard]] int unresolved() const override { return unresolved_; }

 private:
  static models::Tool tool(const RigidScene& scene) {
    models::ToolPart part;
    part.shape = models::BoxTool{scene.size};
    if (scene.radius > 0.0) part.shape = models::CylinderTool{scene.length, scene.radius};
    return {{part}};
  }
  models::RigidWorld world_;
  HeldTool held_;
  int unresolved_ = 0;
};

struct MujocoTuning {
  double stiffness, ratio, impedance;
};

class Mujoco final : public RigidEngine {
 public:
  Mujoco(const RigidScene& scene, const MujocoTuning& tuning) {
    auto files = std::make_unique<mjVFS>();
    mj_defaultVFS(files.get());
    const std::string model = text(scene, tuning);
    mj_makeEmptyFileVFS(files.get(), "tool.xml", static_cast<int>(model.size()));
    std::copy(model.begin(), model.end(), static_cast<char*>(files->filedata[0]));
    char error[300] = "";
    model_ = mj_loadXML("tool.xml", files.get(), error, sizeof error);
    mj_deleteVFS(files.get());
    if (model_ == nullptr) {
      std::fprintf(stderr, "MuJoCo: %s\n", error);
      std::abort();
    }
    data_ = mj_makeData(model_);
  }
  ~Mujoco() override {
    mj_deleteData(data_);
    mj_deleteModel(model_);
  }
  void step(const Twist& wrench) override {
    for (int i = 0; i < 6; ++i) data_->xfrc_applied[6 + i] = wrench[i];
    mj_step(model_, data_);
  }
  void tell(HeldTool& tool) const override {
    const mjtNum *q = data_->qpos, *v = data_->qvel;
    tool.q.position = Vec3(q[0], q[1], q[2]);
    tool.q.orientation = models::Quaternion(q[3], q[4], q[5], q[6]);
    tool.v << v[0], v[1], v[2], tool.q.orientation * Vec3(v[3], v[4], v[5]);  // it turns in its own frame
  }

 private:
  // A negative solref is stiffness and damping; both are of the constraint's acceleration, so per kilogram.
  static std::string text(const RigidScene& scene, const MujocoTuning& tuning) {
    char line[600];
    std::snprintf(line, sizeof line,
                  "<mujoco><size nconmax='400' njmax='2000'/><option timestep='0.001' gravity='0 0 0' cone='elliptic' "
                  "solver='Newton' tolerance='1e-12'/><default><geom condim='3' friction='%g 0 0' solref='%g %g' "
                  "solimp='%g %g 0.001'/></default><worldbody>",
                  scene.friction, -tuning.stiffness, -2.0 * tuning.ratio * std::sqrt(tuning.stiffness),
                  tuning.impedance, tuning.impedance);
    std::string out = line;
    for (const models::FlatSide& plane : scene.planes) {
      const Vec3 n = plane.normal, x = plane.offset * n;
      std::snprintf(line, sizeof line,
                    "<geom type='plane' size='1 1 1' pos='%.17g %.17g %.17g' zaxis='%.17g %.17g %.17g'/>", x.x(), x.y(),
                    x.z(), n.x(), n.y(), n.z());
      out += line;
    }
    const Vec3 at = scene.start.position, half = 0.5 * scene.size;
    std::snprintf(line, sizeof line,
                  "<body pos='%.17g %.17g %.17g'><freejoint/><inertial pos='0 0 0' mass='4' diaginertia='0.05 0.05 "
                  "0.05'/><geom type='%s' size='%.17g %.17g %.17g'/></body></worldbody></mujoco>",
                  at.x(), at.y(), at.z(), scene.radius > 0.0 ? "cylinder" : "box",
                  scene.radius > 0.0 ? scene.radius : half.x(), scene.radius > 0.0 ? 0.5 * scene.length : half.y(),
                  half.z());
    return out + line;
  }

  mjModel* model_ = nullptr;
  mjData* data_ = nullptr;
};

struct BulletTuning {
  double erp;
  bool split;
  int iterations;
  double breaking_m;  // contacts further apart than this are forgotten
};

#if __has_include(<btBulletDynamicsCommon.h>)
class Bullet final : public RigidEngine {
 public:
  Bullet(const RigidScene& scene, const BulletTuning& tuning)
      : dispatcher_(&configuration_), world_(&dispatcher_, &broadphase_, &solver_, &configuration_) {
    gContactBreakingThreshold = tuning.breaking_m;
    world_.setGravity(btVector3(0, 0, 0));
    world_.getSolverInfo().m_erp2 = tuning.erp;
    world_.getSolverInfo().m_splitImpulse = tuning.split ? 1 : 0;
    world_.getSolverInfo().m_splitImpulsePenetrationThreshold = 0.0;
    world_.getSolverInfo().m_numIterations = tuning.iterations;
    if (scene.radius > 0.0) {
      shape_ = std::make_unique<btCylinderShapeZ>(btVector3(scene.radius, scene.radius, 0.5 * scene.length));
    } else {
      shape_ = std::make_unique<btBoxShape>(vector(0.5 * scene.size));
    }
    shape_->setMargin(0.0);  // it would round the edges
    btTransform place = btTransform::getIdentity();
    place.setOrigin(vector(scene.start.position));
    motion_ = std::make_unique<btDefaultMotionState>(place);
    tool_ = std::make_unique<btRigidBody>(
        btRigidBody::btRigidBodyConstructionInfo(4.0, motion_.get(), shape_.get(), btVector3(0.05, 0.05, 0.05)));
    tool_->setActivationState(DISABLE_DEACTIVATION);
    tool_->setFriction(scene.friction);  // Bullet multiplies both frictions
    world_.addRigidBody(tool_.get());
    for (const models::FlatSide& plane : scene.planes) {
      sides_.push_back(std::make_unique<btStaticPlaneShape>(vector(plane.normal), plane.offset));
      sides_.back()->setMargin(0.0);
      walls_.push_back(std::make_unique<btRigidBody>(
          btRigidBody::btRigidBodyConstructionInfo(0.0, nullptr, sides_.back().get(), btVector3(0, 0, 0))));
      walls_.back()->setFriction(1.0);
      world_.addRigidBody(walls_.back().get());
    }
  }
  ~Bullet() override {
    world_.removeRigidBody(tool_.get());
    for (const auto& wall : walls_) world_.removeRigidBody(wall.get());
  }
  void step(const Twist& wrench) override {
    tool_->applyCentralForce(vector(wrench.head<3>()));
    tool_->applyTorque(vector(wrench.tail<3>()));
    world_.stepSimulation(1e-3, 0);
    tool_->clearForces();
  }
  void tell(HeldTool& tool) const override {
    const btTransform& X = tool_->getWorldTransform();
    const btQuaternion r = X.getRotation();
    tool.q.position = vector(X.getOrigin());
    tool.q.orientation = models::Quaternion(r.w(), r.x(), r.y(), r.z()).normalized();
    tool.v << vector(tool_->getLinearVelocity()), vector(tool_->getAngularVelocity());
  }

 private:
  static btVector3 vector(const Vec3& v) { return {v.x(), v.y(), v.z()}; }
  static Vec3 vector(const btVector3& v) { return {v.x(), v.y(), v.z()}; }
  btDefaultCollisionConfiguration configuration_;
  btCollisionDispatcher dispatcher_;
  btDbvtBroadphase broadphase_;
  btSequentialImpulseConstraintSolver solver_;
  btDiscreteDynamicsWorld world_;
  std::unique_ptr<btConvexInternalShape> shape_;
  std::unique_ptr<btDefaultMotionState> motion_;
  std::unique_ptr<btRigidBody> tool_;
  std::vector<std::unique_ptr<btStaticPlaneShape>> sides_;
  std::vector<std::unique_ptr<btRigidBody>> walls_;
};
#endif

}  // namespace proxarm::bench
