// Judges a rigid tool's steps for the stress study. The laws of a rigid tool among objects
// (models/geometry/pose_algorithm.hpp), distances, and scripted motion are written here a second time, without the code
// that is judged.
//
// An object that moves by X(t) carries what touches it. Let c = X(t) X(t − T)⁻¹. A material point of the tool that was
// at y and is at x has moved by x − c y relative to the object. The work of the contact's force on that displacement is
// judged as if the object stood still and the tool moved from c q to r. The rest of the force's work, fᵀ(c y − y), is
// done by the object, and no law limits it.
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
  double stiffest = 0.0;  // K's largest eigenvalue, with rotations scaled to lengths by lever_m; N/m
  models::ToolPose p, q, r;
  std::vector<models::PoseContact> contacts;
  bool unresolved = false;
  double since_s = 0.0, time_s = 0.0;    // times at which the tool is at q and at r
  std::vector<models::ToolPose> with{};  // for each object, q moved with the object; empty if no object moves

  [[nodiscard]] const models::ToolPose& from(const models::PoseContact& contact) const {
    return with.empty() ? q : with[static_cast<std::size_t>(contact.object)];
  }

  [[nodiscard]] models::Twist wrench() const { return K * models::difference(r, p); }
  // Returns the displacement since q, relative to the object, of the tool's material point at a contact. slip_of()
  // returns the tangential part of this displacement.
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

  // Returns the largest depth of the tool inside an object, m. If negative, the tool is at least that far away from all
  // objects.
  [[nodiscard]] double depth_m(const models::ToolPose& pose, double time_s = 0.0) const;

  // Sets call.with: for each object, q moved with the object.
  void carry(ToolCall& call) const;
  // Returns the contacts, each moved with its object from since_s to time_s.
  [[nodiscard]] std::vector<models::PoseContact> carried(std::vector<models::PoseContact> contacts, double since_s,
                                                         double time_s) const;
  [[nodiscard]] bool moves() const { return moves_; }

  // Returns the name of a law that the call violates; empty if there is none.
  [[nodiscard]] std::string missed(const ToolCall& call) const;

  // Returns a bound of the energy that the contacts may add to the tool. The bound is of second order in the step, and
  // has three parts:
  //   - If the tool turns by θ, the path of a point bends by θ² lever/2.
  //   - The normal turns by θ while the contact point moves by s.
  //   - A round surface of radius r falls away by s²/2r.
  //
  // If two sharp edges along a and b cross, the normal n is along a × b. It may turn by up to θ over the sine of the
  // angle between the edges, but its actual turn α is known, and bounds the energy:
  //   1. Let n₀ be the normal of the two edges at q, y the contact point, x the place of y's material point at q, and
  //      s = y − x.
  //   2. s leads from the line of one edge to the line of the other, and −n₀ᵀs was the gap between the edges. So n₀ᵀs ≤
  //   0
  //      except for rounding.
  //   3. Therefore nᵀs = (n − n₀ cos α)ᵀs + cos α n₀ᵀs ≤ sin α ‖s‖.
  [[nodiscard]] double curvature_J(const ToolCall& call) const;
  // Returns by how much the gaps at a pose fall short of 0, at most 1e-12 m, which is the permitted depth. Larger
  // shortfalls don't count: a contact point may lie up to 1e-10 m beside its feature, and so below the feature's plane
  // without being inside an object.
  [[nodiscard]] static double short_m(double depth_m, const std::vector<models::PoseContact>& contacts);
  // Returns the part of the energy gain `rise_J` that neither curvature_J() nor rounding explains, J; negative if all
  // of the gain is explained. `short_m`: by how much gaps at q fell short of 0; the contacts' forces push the tool back
  // by that length. Contacts that press against each other with thousands of newtons are solved to 1e-10 of the step.
  [[nodiscard]] double left_J(const ToolCall& call, double rise_J, double short_m) const;
  // Returns the work of the normal forces at r on contact points that moved forward along their normals, J. Only the
  // length counts that turning normals, curvature and rounding don't explain. The displacements are those of contact
  // points, so the bend of a path by its lever doesn't occur in them.
  [[nodiscard]] double pushed_J(const ToolCall& call, double short_m) const;

  // Returns a bound of the energy that contacts may add because the tool goes over an edge from one feature of an
  // object to another. At the edge the normal turns by α at once, from n₀, the normal of the first feature, to n. Let s
  // be the displacement since q of the material point at the contact.
  //   1. Along n₀ the contact point reached the first feature or was held by it, so n₀ᵀs ≤ 0 except for curvature.
  //   2. Therefore nᵀs = (n − n₀ cos α)ᵀs + cos α n₀ᵀs ≤ sin α ‖s‖.
  // Precondition: the step's parts show that the tool goes over an edge (tool_parts.hpp). `earlier`: the contacts of
  // the step before, and the contacts on the path. A normal n₀ isn't used if the contact point came from behind the
  // first feature. Neither is it used if n₀ is at a right angle or more to n, because then cos α n₀ᵀs ≥ 0 bounds
  // nothing.
  [[nodiscard]] double edges_J(const ToolCall& call, const std::vector<models::PoseContact>& earlier) const;

  // Returns the rounding of a pose, as a length in m.
  [[nodiscard]] static double rounding_m(const models::ToolPose& pose);

 private:
  using Edges = std::vector<std::pair<models::Vec3, models::Vec3>>;
  // A convex piece: its corners, and the directions of its normals and edges, from which all axes follow that may
  // separate it from another piece.
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
  static constexpr double clear_m = 1e-3;  // above this distance, the distance of balls around pieces is precise enough
  static bool are_clear(const models::Vec3& a, double a_reach_m, const models::Vec3& b, double b_reach_m, double& gap);
  static double between_m(const Piece& a, const Piece& b, double enough);
  static double from_segment_m(const Piece& triangle, const models::Vec3& from, const models::Vec3& to, double radius,
                               double enough);

  // A part of the tool: all points within radius_m of the convex hull of its corners. A sphere has one corner, and a
  // capsule has two.
  struct Core {
    std::vector<Piece> pieces_T;  // pieces of a part with sharp edges; for a mesh, its triangles
    std::shared_ptr<const models::TriangleMesh> mesh_T{};  // of a part that is a mesh
    std::vector<models::Vec3> corners_T, normals_T, edges_T;
    Edges sharp_T;
    models::Vec3 middle_T = models::Vec3::Zero();
    models::Pose X_TP = models::Pose::Identity();
    models::Vec3 half_m = models::Vec3::Zero();  // half the edge lengths of a box
    double radius_m = 0.0, reach_m = 0.0;
    std::optional<double> friction;
  };

  // place() returns an object's pose relative to the object's description; motion() returns the object's motion from
  // since_s to time_s.
  [[nodiscard]] models::Pose place(std::size_t object, double time_s) const;
  [[nodiscard]] models::Pose motion(std::size_t object, double since_s, double time_s) const;
  // Returns the rounding of a material point's displacement, m.
  [[nodiscard]] double rounding_of_ways_m(const ToolCall& call) const;
  [[nodiscard]] double friction(const models::PoseContact& contact) const;
  [[nodiscard]] double normal_turns(const ToolCall& call, const models::PoseContact& contact) const;
  // Returns how far a contact point may move forward along its normal because the normal turns and the surface falls
  // away, m.
  [[nodiscard]] double forward_m(const ToolCall& call, const models::PoseContact& contact) const;
  [[nodiscard]] double slack_m(const ToolCall& call, double short_m) const;
  [[nodiscard]] double apart_m(const Core& core, const models::ToolPose& pose, const scenes::Object& object) const;
  [[nodiscard]] double apart_from_m(const Core& core, const models::ToolPose& pose, std::size_t object) const;

  const scenes::Scene& scene_;
  bool hollow_ = false, moves_ = false;
  std::vector<Core> cores_;
  std::vector<std::vector<Piece>> pieces_;  // of each object: a mesh's triangles, or a box; empty for other shapes
  std::vector<Edges> sharp_;                // of each object
  std::vector<double> bend_per_m_;          // curvature of each object: 1/radius if the object is round
};

}  // namespace proxarm::studies
