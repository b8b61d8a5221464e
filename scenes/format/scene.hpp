// A virtual world as its file describes it: plain numbers without behaviour. load_scene() or the caller fills it in,
// and compile() turns it into a 𝒢.
//
// Units: metres, newtons, radians. Positions and directions are in W unless a name says otherwise.
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

// The space in which the proxy can move: all of W (three dimensions), a plane in W (two) or a line (one). The point
// with coordinates ξ in the space has the coordinates origin_m + axes ξ in W.
struct Space {
  int dimensions = 3;  // 1, 2 or 3
  models::Vec3 origin_m = models::Vec3::Zero();
  models::Mat3 axes = models::Mat3::Identity();  // orthonormal columns; the first `dimensions` span the space
};

// A flat surface and the half-space behind it.
struct PlaneShape {
  models::Vec3 point_m = models::Vec3::Zero();
  models::Vec3 normal = models::Vec3::UnitZ();  // any length except zero; points to the free side
};

// A box. In all shapes, inside_out means: the shape is a cavity that holds the proxy inside.
struct BoxShape {
  models::Pose pose_W = models::Pose::Identity();  // pose of the box's centre
  models::Vec3 size_m = models::Vec3::Ones();      // full lengths of the edges
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

// A cylinder with flat ends, whose centres are from_m and to_m.
struct CylinderShape {
  models::Vec3 from_m = models::Vec3::Zero();
  models::Vec3 to_m = models::Vec3::UnitZ();
  double radius_m = 1.0;
  bool inside_out = false;
};

// A surface of triangles, loaded with its scene (scenes/mesh_files/mesh_file.hpp). Both sides of the surface stop the
// proxy. So a closed mesh is a body for a proxy outside it and a cavity for a proxy inside it.
struct MeshShape {
  std::filesystem::path file;
  double scale_m = 1.0;                              // metres per unit of the file
  models::Pose pose_W = models::Pose::Identity();    // as described: pose of the file's origin, or of the `anchor`
  std::optional<double> weld_m;                      // see MeshPlacement::weld_m
  double close_holes_m = 0.0;                        // holes up to this size are closed; 0: no hole is closed
  bool inside_out = false;                           // true: the inside of a closed mesh is free
  std::shared_ptr<const models::TriangleMesh> mesh;  // the mesh in W
  FaceAccount account;                               // counts how the file's faces were used
};

using Shape = std::variant<PlaneShape, BoxShape, SphereShape, CapsuleShape, CylinderShape, MeshShape>;

// An elastic skin on an object. A force presses it in by force / stiffness, at most by its thickness.
struct ElasticLayer {
  double thickness_m = 0.0;
  double stiffness_N_per_m = 0.0;
};

// The motion of an object. It moves each point x of the object in its described place to x(t) = c + R(ω t)(x − c) + v t
// + a sin(2π f t + φ).
struct Motion {
  models::Vec3 velocity_m_per_s = models::Vec3::Zero();
  models::Vec3 amplitude_m = models::Vec3::Zero();
  double frequency_Hz = 0.0;
  double phase_rad = 0.0;
  models::Vec3 axis = models::Vec3::UnitZ();  // any length except zero
  models::Vec3 centre_m = models::Vec3::Zero();
  double turn_rad_per_s = 0.0;
  bool driven = false;  // true: CompiledScene::drive() moves the object; the other members are unused
};

// Gives the triangles of a mesh whose centres lie within a shape another friction than the rest of the mesh.
struct FrictionRegion {
  Shape within;
  double friction = 0.0;
  int line = 0;
};

struct Object {
  std::string name;  // unique in a scene; a name such as "plane 1" if the file gives no name
  Shape shape;
  double friction = 0.0;  // coefficient of friction μ, no unit
  // Friction regions of a mesh. If several regions contain a triangle, the last of them determines its friction.
  std::vector<FrictionRegion> friction_regions;
  std::optional<ElasticLayer> layer;
  std::optional<Motion> motion;
  int line = 0;  // line in the scene's file, for messages; 0: unknown
};

// A medium, which resists motion through it; see models/world/media.hpp.
struct MediumDescription {
  double damping_Ns_per_m = 0.0;
  double force_N = 0.0;
  std::optional<Shape> within;  // nullopt: everywhere
  int line = 0;
};

// A guide, which holds the proxy on a line, a plane or a polyline; see models/world/guides.hpp.
struct GuideDescription {
  enum class Kind { line, plane, polyline };
  Kind kind = Kind::line;
  std::vector<models::Vec3> points_m;              // one point, or all points of the polyline
  models::Vec3 direction = models::Vec3::UnitX();  // direction of the line, or normal of the plane
  bool closed = false;
  double friction = 0.0;
  int line_number = 0;
};

struct Scene {
  std::filesystem::path file;  // empty if the scene wasn't loaded from a file
  std::string name;
  Space space;
  std::vector<Object> objects;
  std::vector<MediumDescription> media;
  std::optional<double> coulomb_force_N;  // dry friction everywhere, equation (3); acts as a medium without `within`
  int coulomb_line = 0;
  std::optional<GuideDescription> guide;
  std::shared_ptr<const RigidTool> tool;  // tool that the arm holds in this scene; nullptr: the tool is a point
};

// Returns the name of a shape's kind in files and messages, such as "plane".
std::string kind_of(const Shape& shape);

}  // namespace proxarm::scenes
