// A virtual world as its file states it: plain numbers, no behaviour. It is loaded by load_scene() or filled in by
// hand, and compile() makes it into a 𝒢.
//
// Metres, newtons, radians; all positions and directions in W unless a name says otherwise.
#pragma once

#include <array>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "models/geometry/geometry.hpp"
#include "models/mesh/mesh.hpp"
#include "scenes/format/tool_file.hpp"
#include "scenes/mesh_files/face_account.hpp"

namespace proxarm::scenes {

// Where the proxy lives: all of W (three dimensions), a plane of it (two) or a line (one). A point of the space with
// coordinates ξ is at origin_m + axes ξ in W.
struct Space {
  int dimensions = 3;  // 1, 2 or 3
  models::Vec3 origin_m = models::Vec3::Zero();
  models::Mat3 axes = models::Mat3::Identity();  // orthonormal columns; the first `dimensions` span the space
};

// The half-space behind a flat surface.
struct PlaneShape {
  models::Vec3 point_m = models::Vec3::Zero();
  models::Vec3 normal = models::Vec3::UnitZ();  // any length but zero; points to the free side
};

// inside_out, here and below: the shape is a cavity, and the proxy is held inside of it.
struct BoxShape {
  models::Pose pose_W = models::Pose::Identity();  // of its middle
  models::Vec3 size_m = models::Vec3::Ones();      // full edges
  bool inside_out = false;
};

struct SphereShape {
  models::Vec3 centre_m = models::Vec3::Zero();
  double radius_m = 1.0;
  bool inside_out = false;
};

// All points within radius_m of the segment from from_m to to_m.
struct CapsuleShape {
  models::Vec3 from_m = models::Vec3::Zero();
  models::Vec3 to_m = models::Vec3::UnitZ();
  double radius_m = 1.0;
  bool inside_out = false;
};

// A cylinder with flat ends, whose middles are from_m and to_m.
struct CylinderShape {
  models::Vec3 from_m = models::Vec3::Zero();
  models::Vec3 to_m = models::Vec3::UnitZ();
  double radius_m = 1.0;
  bool inside_out = false;
};

// A surface of triangles, read together with its scene (scenes/mesh_files/mesh_file.hpp). Both its sides hold the
// proxy, so a closed mesh is a body for a proxy outside and a cavity for a proxy inside.
struct MeshShape {
  std::filesystem::path file;
  double scale_m = 1.0;                              // metres per unit of the file
  models::Pose pose_W = models::Pose::Identity();    // as described: of the file's origin, or of what `anchor` names
  std::optional<double> weld_m;                      // MeshPlacement::weld_m
  double close_holes_m = 0.0;                        // holes up to this size are closed; 0: none
  bool inside_out = false;                           // of a closed mesh: the inside is the free side
  std::shared_ptr<const models::TriangleMesh> mesh;  // in W
  FaceAccount account;                               // what became of the file's faces
};

using Shape = std::variant<PlaneShape, BoxShape, SphereShape, CapsuleShape, CylinderShape, MeshShape>;

// The outer skin of an object: it gives way by force over stiffness, down to its thickness.
struct ElasticLayer {
  double thickness_m = 0.0;
  double stiffness_N_per_m = 0.0;
};

// x(t) = c + R(ω t)(x − c) + v t + a sin(2π f t + φ) for each point x of the object as it is described.
struct Motion {
  models::Vec3 velocity_m_per_s = models::Vec3::Zero();
  models::Vec3 amplitude_m = models::Vec3::Zero();
  double frequency_Hz = 0.0;
  double phase_rad = 0.0;
  models::Vec3 axis = models::Vec3::UnitZ();  // any length but zero
  models::Vec3 centre_m = models::Vec3::Zero();
  double turn_rad_per_s = 0.0;
  bool driven = false;  // true: CompiledScene::drive() moves the object, and the other values don't count
};

// Another friction for those triangles of a mesh whose centres lie within a shape.
struct FrictionRegion {
  Shape within;
  double friction = 0.0;
  int line = 0;
};

struct Object {
  std::string name;  // unique in a scene; "plane 1" where the file gives none
  Shape shape;
  double friction = 0.0;                         // μ, no unit
  std::vector<FrictionRegion> friction_regions;  // of a mesh; the last one that holds a triangle counts
  std::optional<ElasticLayer> layer;
  std::optional<Motion> motion;
  int line = 0;  // in the scene's file, for messages; 0: unknown
};

// Resists motion through it; see models/world/media.hpp.
struct MediumDescription {
  double damping_Ns_per_m = 0.0;
  double force_N = 0.0;
  std::optional<Shape> within;  // none: everywhere
  int line = 0;
};

// Holds the proxy on a line, a plane or a polyline; see models/world/guides.hpp.
struct GuideDescription {
  enum class Kind { line, plane, polyline };
  Kind kind = Kind::line;
  std::vector<models::Vec3> points_m;              // one, or those of the polyline
  models::Vec3 direction = models::Vec3::UnitX();  // of the line, or the plane's normal
  bool closed = false;
  double friction = 0.0;
  int line_number = 0;
};

struct Scene {
  std::filesystem::path file;  // empty if it wasn't loaded
  std::string name;
  Space space;
  std::vector<Object> objects;
  std::vector<MediumDescription> media;
  std::optional<double> coulomb_force_N;  // dry friction everywhere, equation (3); like a medium without `within`
  int coulomb_line = 0;
  std::optional<GuideDescription> guide;
  std::shared_ptr<const RigidTool> tool;  // that is held in it; null: a point
};

// What a shape is called in files and messages: "plane".
std::string kind_of(const Shape& shape);

}  // namespace proxarm::scenes
