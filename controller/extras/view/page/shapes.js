// Shapes of which all bodies in the picture are made: geometries, thick arrows, lines.
import * as THREE from './three/build/three.module.js';

export const UP = new THREE.Vector3(0, 0, 1);

export function vec(numbers) {
  return new THREE.Vector3(numbers[0], numbers[1], numbers[2]);
}

// Sets an object's pose from numbers[at] on: x y z and quaternion x y z w.
export function setPose(object, numbers, at = 0) {
  object.position.set(numbers[at], numbers[at + 1], numbers[at + 2]);
  object.quaternion.set(numbers[at + 3], numbers[at + 4], numbers[at + 5], numbers[at + 6]);
}

// Returns a cylinder along z about the origin; three.js has cylinders along y.
export function cylinderGeometry(radius, length, segments = 36) {
  return new THREE.CylinderBufferGeometry(radius, radius, length, segments).rotateX(Math.PI / 2);
}

// Returns a capsule along z: two half spheres, and a cylinder of this length between them.
export function capsuleGeometry(radius, length, rings = 10) {
  const profile = [];
  for (let i = 0; i <= rings; ++i) {
    const a = (-Math.PI / 2) * (1 - i / rings);
    profile.push(new THREE.Vector2(Math.max(1e-6, radius * Math.cos(a)), radius * Math.sin(a) - length / 2));
  }
  for (let i = 0; i <= rings; ++i) {
    const a = (Math.PI / 2) * (i / rings);
    profile.push(new THREE.Vector2(Math.max(1e-6, radius * Math.cos(a)), radius * Math.sin(a) + length / 2));
  }
  return new THREE.LatheBufferGeometry(profile, 32).rotateX(Math.PI / 2);
}

// Returns the geometry of a hull from its points, and from three indices of points for each triangle.
export function hullGeometry({ points, triangles }) {
  const geometry = new THREE.BufferGeometry();
  geometry.setAttribute('position', new THREE.BufferAttribute(new Float32Array(points.flat()), 3));
  geometry.setIndex(triangles.flat());
  const separate = geometry.toNonIndexed();
  separate.computeVertexNormals();
  return separate;
}

// Places an object that lies along z between two points.
export function placeBetween(object, from, to) {
  const a = vec(from), b = vec(to);
  object.position.copy(a).add(b).multiplyScalar(0.5);
  object.quaternion.setFromUnitVectors(UP, b.sub(a).normalize());
}

// Fetches a mesh as Stage::mesh_bytes() packs it: number of vertices, number of triangles, coordinates, indices.
export async function fetchMesh(path) {
  const answer = await fetch(path);
  if (!answer.ok) throw new Error(`the mesh ${path} can't be had`);
  const buffer = await answer.arrayBuffer();
  const [vertices, triangles] = new Uint32Array(buffer, 0, 2);
  const geometry = new THREE.BufferGeometry();
  geometry.setAttribute('position', new THREE.BufferAttribute(new Float32Array(buffer, 8, 3 * vertices), 3));
  geometry.setIndex(new THREE.BufferAttribute(new Uint32Array(buffer, 8 + 12 * vertices, 3 * triangles), 1));
  geometry.computeVertexNormals();
  geometry.computeBoundingSphere();
  return geometry;
}

export function lineOf(points, material) {
  const geometry = new THREE.BufferGeometry().setFromPoints(points);
  return new THREE.Line(geometry, material);
}

// An arrow with a thick shaft, which is visible from afar. The shaft is whole, or of several pieces. The arrow points
// along z, and setTo() scales it. An arrow that is cut has a second head.
export class Arrow extends THREE.Group {
  constructor(material, { radius = 0.005, pieces = 1 } = {}) {
    super();
    this.shaft = new THREE.Group();
    const length = pieces === 1 ? 1 : 0.62 / pieces;
    for (let i = 0; i < pieces; ++i) {
      const piece = new THREE.Mesh(cylinderGeometry(radius, length, 14), material);
      piece.position.z = pieces === 1 ? 0.5 : (i + 0.5) / pieces;
      this.shaft.add(piece);
    }
    this.head = new THREE.Mesh(
      new THREE.ConeBufferGeometry(3.2 * radius, 9 * radius, 18).rotateX(Math.PI / 2), material);
    this.plainHeadLength = this.headLength = 9 * radius;
    this.second = this.head.clone();
    this.add(this.shaft, this.head, this.second);
    this.visible = false;
  }

  setThickness(factor) {
    this.headLength = this.plainHeadLength * factor;
    this.shaft.scale.x = this.shaft.scale.y = factor;
    for (const head of [this.head, this.second]) head.scale.setScalar(factor);
  }

  // Draws the arrow from a point along a vector in metres; hides it if the vector is shorter than 1 mm. `cut`: whether
  // the arrow should be longer than it is drawn.
  setTo(from, along, cut = false) {
    const length = along.length();
    this.second.visible = cut;
    this.visible = length > 1e-3;
    if (!this.visible) return;
    this.position.copy(from);
    this.quaternion.setFromUnitVectors(UP, along.clone().normalize());
    this.shaft.scale.z = Math.max(1e-4, length - this.headLength);
    this.head.position.z = Math.max(this.headLength / 2, length - this.headLength / 2);
    this.second.position.z = this.head.position.z - 1.4 * this.headLength;
  }
}
