// Draws the scene's objects: planes as grids that show their free side, solids, meshes, layers ("skins"), media,
// guides.
import * as THREE from './three/build/three.module.js';
import { UP, Arrow, capsuleGeometry, cylinderGeometry, fetchMesh, lineOf, placeBetween, setPose, vec } from './shapes.js';
import { colour, onTheme } from './theme.js';

const PLANE_SIZE = 1.1, PLANE_CELL = 0.1, HATCH = 0.045, MEDIUM_DEPTH = 0.2;

// Makes the materials, whose colours follow the theme.
function makeMaterials() {
  const all = {
    solid: new THREE.MeshLambertMaterial({ transparent: true, opacity: 0.86, side: THREE.DoubleSide }),
    cavity: new THREE.MeshLambertMaterial({ transparent: true, opacity: 0.16, side: THREE.BackSide, depthWrite: false }),
    skin: new THREE.MeshLambertMaterial({ transparent: true, opacity: 0.22, side: THREE.DoubleSide, depthWrite: false }),
    medium: new THREE.MeshLambertMaterial({ transparent: true, opacity: 0.2, side: THREE.DoubleSide, depthWrite: false }),
    sheet: new THREE.MeshBasicMaterial({ transparent: true, opacity: 0.3, side: THREE.DoubleSide, depthWrite: false }),
    grid: new THREE.LineBasicMaterial({ transparent: true, opacity: 0.75 }),
    border: new THREE.LineBasicMaterial(),
    edge: new THREE.LineBasicMaterial({ transparent: true, opacity: 0.6 }),
    skinEdge: new THREE.LineBasicMaterial(),
    guide: new THREE.LineBasicMaterial(),
    free: new THREE.MeshLambertMaterial(),
  };
  onTheme(() => {
    const green = new THREE.Color(colour('--good'));
    all.solid.color.set(colour('--solid'));
    for (const name of ['cavity', 'sheet']) all[name].color.set(colour('--cavity'));
    all.skin.color.set(colour('--skin'));
    all.skinEdge.color.set(colour('--skin-edge'));
    all.medium.color.set(colour('--medium'));
    for (const name of ['grid', 'border', 'guide', 'free']) all[name].color.copy(green);
    all.edge.color.set(colour('--solid-edge'));
  });
  return all;
}

function segments(points, material) {
  return new THREE.LineSegments(new THREE.BufferGeometry().setFromPoints(points), material);
}

// Returns a group at the plane's point that is nearest to the tool, with z along the plane's normal.
function atPlane(shape, near) {
  const normal = vec(shape.normal), point = vec(shape.point);
  const group = new THREE.Group();
  group.position.copy(near).addScaledVector(normal, -near.clone().sub(point).dot(normal));
  // In an upright plane, the grid is upright, too: its x axis is horizontal.
  const level = new THREE.Vector3().crossVectors(UP, normal);
  if (level.lengthSq() < 1e-6) level.set(1, 0, 0).addScaledVector(normal, -normal.x);
  level.normalize();
  const steep = new THREE.Vector3().crossVectors(normal, level);
  group.quaternion.setFromRotationMatrix(new THREE.Matrix4().makeBasis(level, steep, normal));
  return group;
}

// Draws a part of a medium's region that ends at a plane, down to some depth.
function makeHalfSpace(shape, near, materials) {
  const group = atPlane(shape, near);
  const slab = new THREE.Mesh(new THREE.BoxBufferGeometry(PLANE_SIZE, PLANE_SIZE, MEDIUM_DEPTH), materials.medium);
  slab.name = 'solid';
  slab.position.z = -MEDIUM_DEPTH / 2;
  slab.add(new THREE.LineSegments(new THREE.EdgesGeometry(slab.geometry), materials.edge));
  group.add(slab);
  return group;
}

// Draws a square of the plane around the tool's place. Hatching lies on the solid side, an arrow on the free side.
function makePlane(shape, near, materials) {
  const group = atPlane(shape, near);
  const half = PLANE_SIZE / 2, lines = [], hatch = [];
  for (let x = -half; x <= half + 1e-9; x += PLANE_CELL) {
    lines.push(new THREE.Vector3(x, -half, 0), new THREE.Vector3(x, half, 0));
    lines.push(new THREE.Vector3(-half, x, 0), new THREE.Vector3(half, x, 0));
  }
  for (let x = -half; x <= half + 1e-9; x += PLANE_CELL / 2) {
    for (const side of [-half, half]) {
      hatch.push(new THREE.Vector3(x, side, 0), new THREE.Vector3(x - HATCH * 0.6, side, -HATCH));
      hatch.push(new THREE.Vector3(side, x, 0), new THREE.Vector3(side, x - HATCH * 0.6, -HATCH));
    }
  }
  const sheet = new THREE.Mesh(new THREE.PlaneBufferGeometry(PLANE_SIZE, PLANE_SIZE), materials.sheet);
  sheet.name = 'sheet';
  const corners = [[-half, -half], [half, -half], [half, half], [-half, half], [-half, -half]];
  const border = lineOf(corners.map(([x, y]) => new THREE.Vector3(x, y, 0)), materials.border);
  const free = new Arrow(materials.free, { radius: 0.004 });
  free.setTo(new THREE.Vector3(half - 0.05, half - 0.05, 0), new THREE.Vector3(0, 0, 0.11));
  group.add(sheet, segments(lines, materials.grid), segments(hatch, materials.border), border, free);
  return group;
}

function roundGeometry(shape) {
  const length = vec(shape.from).distanceTo(vec(shape.to));
  return shape.kind === 'capsule' ? capsuleGeometry(shape.radius, length) : cylinderGeometry(shape.radius, length);
}

// Returns a solid's geometry and the body that has its pose. `more`: added to the solid's size on all sides; negative
// for the core below a layer.
function solidGeometry(shape, more = 0) {
  const body = new THREE.Group();
  let geometry = null;
  if (shape.kind === 'box') {
    geometry = new THREE.BoxBufferGeometry(...shape.size.map((edge) => edge + 2 * more));
    setPose(body, shape.pose);
  } else if (shape.kind === 'sphere') {
    geometry = new THREE.SphereBufferGeometry(shape.radius + more, 48, 32);
    body.position.copy(vec(shape.centre));
  } else if (shape.kind === 'capsule' || shape.kind === 'cylinder') {
    geometry = roundGeometry({ ...shape, radius: shape.radius + more });
    placeBetween(body, shape.from, shape.to);
  }
  return { geometry, body };
}

function addSolid(group, shape, material, materials, edges = true) {
  const { geometry, body } = solidGeometry(shape);
  if (!geometry) return;
  const mesh = new THREE.Mesh(geometry, material);
  mesh.name = 'solid';
  body.add(mesh);
  if (edges) body.add(new THREE.LineSegments(new THREE.EdgesGeometry(geometry, 30), materials.edge));
  group.add(body);
}

function makeObject(object, near, materials) {
  const group = new THREE.Group();
  group.name = object.name;
  const shape = object.shape;
  if (shape.kind === 'plane') {
    group.add(makePlane(shape, near, materials));
    if (object.layer) {
      // A layer lies within the object: its outer side is at the plane.
      const geometry = new THREE.BoxBufferGeometry(PLANE_SIZE, PLANE_SIZE, object.layer.thickness);
      const skin = new THREE.Mesh(geometry, materials.skin);
      skin.name = 'skin';
      skin.add(new THREE.LineSegments(new THREE.EdgesGeometry(geometry), materials.skinEdge));
      skin.position.z = -object.layer.thickness / 2;
      group.children[0].add(skin);
    }
  } else if (shape.kind === 'mesh') {
    fetchMesh(object.mesh).then((geometry) => {
      const mesh = new THREE.Mesh(geometry, shape.inside_out ? materials.cavity : materials.solid);
      mesh.name = 'solid';
      group.add(mesh);
      group.dispatchEvent({ type: 'loaded' });
    }).catch(() => {});
  } else {
    const outer = object.layer ? materials.skin : shape.inside_out ? materials.cavity : materials.solid;
    addSolid(group, shape, outer, materials);
    if (object.layer && !shape.inside_out) {
      const { geometry, body } = solidGeometry(shape, -object.layer.thickness);
      body.add(new THREE.Mesh(geometry, materials.solid));
      group.add(body);
    }
  }
  return group;
}

function makeGuide(guide, near, materials) {
  const direction = vec(guide.direction);
  if (guide.kind === 'plane') {
    return makePlane({ point: guide.points[0], normal: guide.direction }, near, materials);
  }
  let points = guide.points.map(vec);
  if (guide.kind === 'line') {
    points = [points[0].clone().addScaledVector(direction, -1), points[0].clone().addScaledVector(direction, 1)];
  } else if (guide.closed) {
    points.push(points[0]);
  }
  const group = new THREE.Group();
  for (let i = 0; i + 1 < points.length; ++i) {
    const tube = new THREE.Mesh(cylinderGeometry(0.003, points[i].distanceTo(points[i + 1]), 10), materials.free);
    placeBetween(tube, points[i].toArray(), points[i + 1].toArray());
    group.add(tube);
  }
  return group;
}

export class SceneView extends THREE.Group {
  constructor(stage, near) {
    super();
    this.name = 'scene';
    const materials = makeMaterials();
    this.parts = stage.scene.objects.map((object) => makeObject(object, near, materials));
    if (this.parts.length) this.add(...this.parts);
    for (const medium of stage.scene.media) {
      if (!medium.within) continue;  // a medium everywhere: the panel describes it
      const group = medium.within.kind === 'plane' ? makeHalfSpace(medium.within, near, materials) : new THREE.Group();
      group.name = 'medium';
      addSolid(group, medium.within, materials.medium, materials, false);
      this.add(group);
    }
    if (stage.scene.guide) {
      const guide = makeGuide(stage.scene.guide, near, materials);
      guide.name = 'guide';
      this.add(guide);
    }
  }

  show(moment) {
    this.parts.forEach((part, i) => setPose(part, moment.objects, 7 * i));
  }
}
