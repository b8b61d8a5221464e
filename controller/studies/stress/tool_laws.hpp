// What is known of a rigid tool among objects, whatever its 𝒢: the judge's own copy of the laws
// (models/geometry/pose_algorithm.hpp), of distances, and of where a script leads an object, for the stress study.
//
// An object that moves, by X(t), carries what it touches. With c = X(t) X(t − T)⁻¹ a material point of the tool that
// was at y slips by x − c y, and what the contact's force does on that way is judged as where the object stands still:
// seen from it, the tool goes from c q to r. The rest, fᵀ(c y − y), the object did, and no law limits it.
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

// One call of 𝒢.
struct ToolCall {
  models::Mat6 K;
  double stiffest = 0.0;  // K's largest eigenvalue, rotations at `lever`; N/m
  models::ToolPose p, q, r;
  std::vector<models::PoseContact> contacts;
  bool unresolved = false;
  double since_s = 0.0, time_s = 0.0;    // when the tool was at q, and when it is at r
  std::vector<models::ToolPose> with{};  // of each object: q, carried along with it; empty where nothing moves

  [[nodiscard]] const models::ToolPose& from(const models::PoseContact& contact) const {
    return with.empty() ? q : with[static_cast<std::size_t>(contact.object)];
  }

  [[nodiscard]] models::Twist wrench() const { return K * models::difference(r, p); }
  // Of the tool's material point at a contact since q, relative to the object, and what of it isn't along the normal.
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
  static constexpr double lever_m = 0.03;  // by which rotations are taken as lengths

  // Precondition: the scene outlives the laws.
  ToolLaws(const scenes::Scene& scene, const models::Tool& tool);

  // How deep the tool is inside of anything, metres; below 0 it is so far outside, or farther.
  [[nodiscard]] double depth_m(const models::ToolPose& pose, double time_s = 0.0) const;

  // Tells a call where its objects carried q.
  void carry(ToolCall& call) const;
  // Contacts where and as their objects have carried them since.
  [[nodiscard]] std::vector<models::PoseContact> carried(std::vector<models::PoseContact> contacts, double since_s,
                                                         double time_s) const;
  [[nodiscard]] bool moves() const { return moves_; }

  // What of the law the call misses; empty if nothing.
  [[nodiscard]] std::string missed(const ToolCall& call) const;

  // What contacts may add to the tool's energy, being of second order in the step: the way of a point that turns by θ
  // at a lever bends by θ² lever/2, normals turn by θ while the point goes on by s, and something round falls off by
  // s²/2r.
  //
  // Where two sharp edges cross, along a and b, the normal is along a × b, and turns by up to θ over the sine of the
  // angle between them. How far is known: with n₀ that of the same edges at q, y the place of contact and x that of its
  // material point at q, s = y − x leads from one edge's line to the other's, and −n₀ᵀs was the edges' gap. So
  // n₀ᵀs ≤ 0 but for rounding, and nᵀs = (n − n₀ cos α)ᵀs + cos α n₀ᵀs ≤ sin α ‖s‖.
  [[nodiscard]] double curvature_J(const ToolCall& call) const;
  // What gaps at a pose are short of. A place may lie beside its feature, by up to 1e-10 m, and so below the feature's
  // plane while it is inside of nothing; by 1e-12 m at most, as deep as it may be inside.
  [[nodiscard]] static double short_m(double depth_m, const std::vector<models::PoseContact>& contacts);
  // What neither that nor rounding accounts for of a rise of the tool's energy; below 0 if all is. What gaps were short
  // of at q, `short_m`, the contacts' forces push back; and where contacts hold each other, by thousands of newtons, a
  // local problem is solved to 1e-10 of the step.
  [[nodiscard]] double left_J(const ToolCall& call, double rise_J, double short_m) const;
  // The same of what the contacts' forces at r do along those normals that places have come forward along. (The bend of
  // a place's way by its lever isn't in that: ways are those of places.)
  [[nodiscard]] double pushed_J(const ToolCall& call, double short_m) const;

  // And where the tool leaves one feature of an object for another, over an edge, the normal turns by α at once, from
  // n₀ to n. Along n₀ the place of contact has come to meet the feature or been held by it, n₀ᵀs ≤ 0 (but for what the
  // curvature accounts for), so that nᵀs = (n − n₀ cos α)ᵀs + cos α n₀ᵀs ≤ sin α ‖s‖: sin α of the way, if the parts of
  // the step say that it is an edge (tool_parts.hpp). `earlier`: what touched before, in the step before or on the way.
  // What the place came from behind says nothing about it, nor does a normal at a right angle to n or more, where
  // cos α n₀ᵀs ≥ 0 bounds nothing.
  [[nodiscard]] double edges_J(const ToolCall& call, const std::vector<models::PoseContact>& earlier) const;

  // Rounding of a pose, as a length.
  [[nodiscard]] static double rounding_m(const models::ToolPose& pose);

 private:
  using Edges = std::vector<std::pair<models::Vec3, models::Vec3>>;
  // A convex piece: its corners, and all directions that may separate it from another.
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
  static constexpr double clear_m = 1e-3;  // what is farther apart is known by balls around it
  static bool are_clear(const models::Vec3& a, double a_reach_m, const models::Vec3& b, double b_reach_m, double& gap);
  static double between_m(const Piece& a, const Piece& b, double enough);
  static double from_segment_m(const Piece& triangle, const models::Vec3& from, const models::Vec3& to, double radius,
                               double enough);

  // All points within a radius of the hull of some: one for a sphere, two for a capsule.
  struct Core {
    std::vector<Piece> pieces_T;                           // of a sharp one; a mesh's triangles
    std::shared_ptr<const models::TriangleMesh> mesh_T{};  // of a mesh
    std::vector<models::Vec3> corners_T, normals_T, edges_T;
    Edges sharp_T;
    models::Vec3 middle_T = models::Vec3::Zero();
    models::Pose X_TP = models::Pose::Identity();
    models::Vec3 half_m = models::Vec3::Zero();  // of a box
    double radius_m = 0.0, reach_m = 0.0;
    std::optional<double> friction;
  };

  // Where an object is, relative to where it was described, and what has become of it since.
  [[nodiscard]] models::Pose place(std::size_t object, double time_s) const;
  [[nodiscard]] models::Pose motion(std::size_t object, double since_s, double time_s) const;
  // Rounding of a material point's way, m.
  [[nodiscard]] double rounding_of_ways_m(const ToolCall& call) const;
  [[nodiscard]] double friction(const models::PoseContact& contact) const;
  [[nodiscard]] double normal_turns(const ToolCall& call, const models::PoseContact& contact) const;
  // What a place may come forward along its normal, as the normal turns and the surface falls off.
  [[nodiscard]] double forward_m(const ToolCall& call, const models::PoseContact& contact) const;
  [[nodiscard]] double slack_m(const ToolCall& call, double short_m) const;
  [[nodiscard]] double apart_m(const Core& core, const models::ToolPose& pose, const scenes::Object& object) const;
  [[nodiscard]] double apart_from_m(const Core& core, const models::ToolPose& pose, std::size_t object) const;

  const scenes::Scene& scene_;
  bool hollow_ = false, moves_ = false;
  std::vector<Core> cores_;
  std::vector<std::vector<Piece>> pieces_;  // of each object: a mesh's triangles, a box; of others none
  std::vector<Edges> sharp_;                // of each object
  std::vector<double> bend_per_m_;          // of each object; 1/radius where it is round
};

}  // namespace proxarm::studies
