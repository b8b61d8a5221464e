// The judge's own copy of the laws of a rigid tool among objects (models/geometry/pose_algorithm.hpp), of distances,
// and of scripted motion, for the stress study.
//
// An object that moves by X(t) carries what it touches. With c = X(t) X(t − T)⁻¹, a material point of the tool that was
// at y and is at x has moved by x − c y relative to the object. The work of the contact's force on that displacement is
// judged as if the object stood still: relative to the object, the tool moves from c q to r. The object does the rest
// of the work, fᵀ(c y − y), which no law limits.
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "models/geometry/pose_algorithm.hpp"
#include "models/mesh/mesh.hpp"
#include "models/rigid_shapes/tool.hpp"
#include "scenes/format/scene.hpp"

namespace proxarm::studies {

struct ToolCall {
  models::Mat6 K;
  double stiffest = 0.0;  // K's largest eigenvalue with rotations scaled by lever_m; N/m
  models::ToolPose p, q, r;
  std::vector<models::PoseContact> contacts;
  bool unresolved = false;
  double since_s = 0.0, time_s = 0.0;    // times of the tool at q and at r
  std::vector<models::ToolPose> with{};  // for each object, q moved with it; empty if nothing moves

  [[nodiscard]] const models::ToolPose& from(const models::PoseContact& contact) const {
    return with.empty() ? q : with[static_cast<std::size_t>(contact.object)];
  }

  [[nodiscard]] models::Twist wrench() const { return K * models::difference(r, p); }
  // Displacement since q of the tool's material point at a contact, relative to the object. slip_of() is its tangential
  // part.
  [[nodiscard]] models::Vec3 way_of(const models::PoseContact& contact) const {
    return contact.point_W - from(contact) * on_tool(contact);
  }
  [[nodiscard]] models::Vec3 on_tool(const models::PoseContact& contact) const {
    return r.orientation.conjugate() * (contact.point_W - r.position);
  }
  [[nodiscard]] models::Vec3 slip_of(const models::PoseContact& contact) const {
    const models::Vec3 way = way_of(contact);
    return way - contact.normal_W * contact.normal_W.dot(way);
  }
};

class ToolLaws {
 public:
  static constexpr double lever_m = 0.03;  // scales rotations to lengths

  // Precondition: the scene outlives the laws.
  ToolLaws(const scenes::Scene& scene, const models::Tool& tool);

  // Depth of the tool inside the objects, m. If negative, the tool is at least that far away from them.
  [[nodiscard]] double depth_m(const models::ToolPose& pose, double time_s = 0.0) const;

  // Sets the call's `with`: q moved with each object.
  void carry(ToolCall& call) const;
  // Returns the contacts moved with their objects from since_s to time_s.
  [[nodiscard]] std::vector<models::PoseContact> carried(std::vector<models::PoseContact> contacts, double since_s,
                                                         double time_s) const;
  [[nodiscard]] bool moves() const { return moves_; }

  // Names the law that the call violates; empty if none.
  [[nodiscard]] std::string missed(const ToolCall& call) const;

  // Energy that the contacts may add to the tool, which is of second order in the step. A point's path bends by θ²
  // lever/2 if the tool turns by θ; a normal turns by θ while the point moves by s; a round surface falls away by
  // s²/2r.
  //
  // If two sharp edges along a and b cross, the normal is along a × b and turns by up to θ over the sine of the angle
  // between them. Its turn is known. Let n₀ be the same edges' normal at q, y the contact point and x the place of its
  // material point at q. Then s = y − x leads from one edge's line to the other's, and −n₀ᵀs was the edges' gap. So
  // n₀ᵀs ≤ 0 except for rounding, and nᵀs = (n − n₀ cos α)ᵀs + cos α n₀ᵀs ≤ sin α ‖s‖.
  [[nodiscard]] double curvature_J(const ToolCall& call) const;
  // How much the gaps at a pose fall short of 0, at most 1e-12 m, the permitted depth. A contact point may lie up to
  // 1e-10 m beside its feature, and so below the feature's plane without being inside an object.
  [[nodiscard]] static double short_m(double depth_m, const std::vector<models::PoseContact>& contacts);
  // Energy gain that neither curvature_J() nor rounding explains (J); negative if fully explained. The contacts' forces
  // push back `short_m`, by which gaps at q fell short. Contacts that press against each other with thousands of
  // newtons are solved to 1e-10 of the step.
  [[nodiscard]] double left_J(const ToolCall& call, double rise_J, double short_m) const;
  // Work of the normal forces at r on contact points that moved forward along their normals further than turning
  // normals, curvature and rounding explain (J). The displacements are those of contact points, so the bend of a path
  // by its lever isn't part of it.
  [[nodiscard]] double pushed_J(const ToolCall& call, double short_m) const;

  // Energy that contacts may add because the tool goes over an edge from one feature of an object to another. There the
  // normal turns by α at once, from n₀ to n. Along n₀ the contact point reached the feature or was held by it, so n₀ᵀs
  // ≤ 0 except for curvature, and nᵀs = (n − n₀ cos α)ᵀs + cos α n₀ᵀs ≤ sin α ‖s‖. Precondition: the step's parts show
  // that it is an edge (tool_parts.hpp). `earlier`: the contacts of the step before, and those on the path. A normal n₀
  // isn't used if the point came from behind its feature, nor at a right angle or more to n, where cos α n₀ᵀs ≥ 0
  // bounds nothing.
  [[nodiscard]] double edges_J(const ToolCall& call, const std::vector<models::PoseContact>& earlier) const;

  // Rounding of a pose, as a length in m.
  [[nodiscard]] static double rounding_m(const models::ToolPose& pose);

 private:
  using Edges = std::vector<std::pair<models::Vec3, models::Vec3>>;
  // A convex piece: its corners, and all directions that may separate it from another piece.
  struct Piece {
    std::vector<models::Vec3> corners, normals, edges;
    models::Vec3 middle = models::Vec3::Zero();
    double reach_m = 0.0;
  };
  static Piece piece_of(std::vector<models::Vec3> corners, std::vector<models::Vec3> normals,
                        std::vector<models::Vec3> edges);
  static Piece triangle_of(const models::TriangleMesh& mesh, std::uint32_t face);
  static Edges sharp_edges_of(const Piece& piece);
  static Edges sharp_edges_of(const models::TriangleMesh& mesh);
  static Piece moved(const Piece& piece, const models::ToolPose& pose);
  static constexpr double clear_m = 1e-3;  // beyond this distance, balls around pieces are precise enough
  static bool are_clear(const models::Vec3& a, double a_reach_m, const models::Vec3& b, double b_reach_m, double& gap);
  static double between_m(const Piece& a, const Piece& b, double enough);
  static double from_segment_m(const Piece& triangle, const models::Vec3& from, const models::Vec3& to, double radius,
                               double enough);

  // All points within radius_m of the convex hull of the corners: one corner for a sphere, two for a capsule.
  struct Core {
    std::vector<Piece> pieces_T;                           // of a part with sharp edges; a mesh's triangles
    std::shared_ptr<const models::TriangleMesh> mesh_T{};  // of a mesh
    std::vector<models::Vec3> corners_T, normals_T, edges_T;
    Edges sharp_T;
    models::Vec3 middle_T = models::Vec3::Zero();
    models::Pose X_TP = models::Pose::Identity();
    models::Vec3 half_m = models::Vec3::Zero();  // of a box
    double radius_m = 0.0, reach_m = 0.0;
    std::optional<double> friction;
  };

  // The object's pose relative to its description; its motion from since_s to time_s.
  [[nodiscard]] models::Pose place(std::size_t object, double time_s) const;
  [[nodiscard]] models::Pose motion(std::size_t object, double since_s, double time_s) const;
  // Rounding of a material point's displacement, m.
  [[nodiscard]] double rounding_of_ways_m(const ToolCall& call) const;
  [[nodiscard]] double friction(const models::PoseContact& contact) const;
  [[nodiscard]] double normal_turns(const ToolCall& call, const models::PoseContact& contact) const;
  // How far a contact point may move forward along its normal, as the normal turns and the surface falls away, m.
  [[nodiscard]] double forward_m(const ToolCall& call, const models::PoseContact& contact) const;
  [[nodiscard]] double slack_m(const ToolCall& call, double short_m) const;
  [[nodiscard]] double apart_m(const Core& core, const models::ToolPose& pose, const scenes::Object& object) const;
  [[nodiscard]] double apart_from_m(const Core& core, const models::ToolPose& pose, std::size_t object) const;

  const scenes::Scene& scene_;
  bool hollow_ = false, moves_ = false;
  std::vector<Core> cores_;
  std::vector<std::vector<Piece>> pieces_;  // of each object: a mesh's triangles or a box; empty for others
  std::vector<Edges> sharp_;                // of each object
  std::vector<double> bend_per_m_;          // of each object; 1/radius if it is round
};

}  // namespace proxarm::studies
