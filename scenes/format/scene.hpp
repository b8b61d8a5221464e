// A virtual world as in its file: plain numbers without behaviour. load_scene() or the caller fills it in, and
// compile() turns it into a 𝒢.
//
// Metres, newtons, radians; positions and directions in W unless a name says otherwise.
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

// The space of the proxy: all of W (three dimensions), a plane in W (two) or a line (one). The point with coordinates ξ
// is at origin_m + axes ξ in W.
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

// inside_out, here and below: the shape is a cavity that holds the proxy inside.
struct BoxShape {
  models::Pose pose_W = models::Pose::Identity();  // of its centre
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

// A cylinder with flat ends, centred at from_m and to_m.
struct CylinderShape {
  models::Vec3 from_m = models::Vec3::Zero();
  models::Vec3 to_m = models::Vec3::UnitZ();
  double radius_m = 1.0;
  bool inside_out = false;
};

// A surface of triangles, loaded with its scene (scenes/mesh_files/mesh_file.hpp). Both sides stop the proxy, so a
// closed mesh is a body for a proxy outside and a cavity for a proxy inside.
struct MeshShape {
  std::filesystem::path file;
  double scale_m = 1.0;                              // metres per unit of the file
  models::Pose pose_W = models::Pose::Identity();    // as described: of the file's origin, or of the `anchor`
  std::optional<double> weld_m;                      // MeshPlacement::weld_m
  double close_holes_m = 0.0;                        // holes up to this size are closed; 0: none
  bool inside_out = false;                           // closed mesh: the inside is free
  std::shared_ptr<const models::TriangleMesh> mesh;  // in W
  FaceAccount account;                               // how the file's faces were used
};

using Shape = std::variant<PlaneShape, BoxShape, SphereShape, CapsuleShape, CylinderShape, MeshShape>;

// An elastic skin on an object: depth = force / stiffness, down to its thickness.
struct ElasticLayer {
  double thickness_m = 0.0;
  double stiffness_N_per_m = 0.0;
};

// Moves each point x of the object as described to x(t) = c + R(ω t)(x − c) + v t + a sin(2π f t + φ).
struct Motion {
  models::Vec3 velocity_m_per_s = models::Vec3::Zero();
  models::Vec3 amplitude_m = models::Vec3::Zero();
  double frequency_Hz = 0.0;
  double phase_rad = 0.0;
  models::Vec3 axis = models::Vec3::UnitZ();  // any length but zero
  models::Vec3 centre_m = models::Vec3::Zero();
  double turn_rad_per_s = 0.0;
  bool driven = false;  // CompiledScene::drive() moves the object; the other values are unused
};

// A different friction for those triangles of a mesh whose centres lie within a shape.
struct FrictionRegion {
  Shape within;
  double friction = 0.0;
  int line = 0;
};

struct Object {
  std::string name;  // unique in a scene; "plane 1" if the file gives no name
  Shape shape;
  double friction = 0.0;                         // μ, no unit
  std::vector<FrictionRegion> friction_regions;  // of a mesh; the last region with the triangle counts
  std::optional<ElasticLayer> layer;
  std::optional<Motion> motion;
  int line = 0;  // in the scene's file, for messages; 0: unknown
};

// Resists motion through it; see models/world/media.hpp.
struct MediumDescription {
  double damping_Ns_per_m = 0.0;
  double force_N = 0.0;
  std::optional<Shape> within;  // nullopt: everywhere
  int line = 0;
};

// Holds the proxy on a line, a plane or a polyline; see models/world/guides.hpp.
struct GuideDescription {
  enum class Kind { line, plane, polyline };
  Kind kind = Kind::line;
  std::vector<models::Vec3> points_m;              // one, or the points of the polyline
  models::Vec3 direction = models::Vec3::UnitX();  // of the line, or normal of the plane
  bool closed = false;
  double friction = 0.0;
  int line_number = 0;
};

struct Scene {
  std::filesystem::path file;  // empty if it wasn't loaded from a file
  std::string name;
  Space space;
  std::vector<Object> objects;
  std::vector<MediumDescription> media;
  std::optional<double> coulomb_force_N;  // dry friction everywhere, equation (3), as a medium without `within`
  int coulomb_line = 0;
  std::optional<GuideDescription> guide;
  std::shared_ptr<const RigidTool> tool;  // tool that the arm holds in this scene; null: a point
};

// Name of a shape's kind in files and messages: "plane".
std::string kind_of(const Shape& shape);

}  // namespace proxarm::scenes
