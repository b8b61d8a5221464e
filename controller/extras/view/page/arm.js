// The arm as the URDF draws it, and the handle behind the sensor.
import * as THREE from './three/build/three.module.js';
import { capsuleGeometry, cylinderGeometry, fetchMesh, hullGeometry, setPose, vec } from './shapes.js';
import { colour, onTheme } from './theme.js';

const EDGE_ANGLE_DEG = 30;

export class ArmView extends THREE.Group {
  constructor(stage) {
    super();
    this.name = 'arm';
    // Faces are drawn a little behind their depth, so that their edges are seen whole.
    const behind = { polygonOffset: true, polygonOffsetFactor: 1, polygonOffsetUnits: 1 };
    this.materials = [new THREE.MeshLambertMaterial(behind), new THREE.MeshLambertMaterial(behind)];
    this.handleMaterial = new THREE.MeshLambertMaterial();
    this.toolMaterial = new THREE.MeshLambertMaterial({ flatShading: true });
    this.edgeMaterial = new THREE.LineBasicMaterial({ transparent: true, opacity: 0.65 });
    this.links = stage.links.map((link, i) => this.makeLink(link, i));
    this.add(...this.links);
    this.addHandle(stage.tool);
    onTheme(() => this.paint());
  }

  paint() {
    this.materials[0].color.set(colour('--arm'));
    this.materials[1].color.set(colour('--arm-joint'));
    this.handleMaterial.color.set(colour('--handle'));
    this.toolMaterial.color.set(colour('--tool-body'));
    this.edgeMaterial.color.set(colour('--arm-edge'));
  }

  makeLink(link, index) {
    const group = new THREE.Group();
    group.name = link.name;
    for (const shape of link.shapes) this.addShape(group, shape, index);
    return group;
  }

  // Boxes get the tone of the arms, round shapes the tone of the joints. Two tones make the joints visible.
  addShape(group, shape, index) {
    const material = shape.colour
      ? new THREE.MeshLambertMaterial({ color: new THREE.Color(...shape.colour) })
      : this.materials[shape.kind === 'box' || index === 0 ? 0 : 1];
    if (shape.kind === 'mesh') {
      fetchMesh(shape.mesh).then((geometry) => {
        const mesh = new THREE.Mesh(geometry, material);
        setPose(mesh, shape.pose);
        group.add(mesh);
      }).catch(() => {});  // a mesh that can't be fetched leaves a gap
      return;
    }
    group.add(this.makeSolid(shape, material));
  }

  makeSolid(shape, material) {
    const geometry =
      shape.kind === 'box' ? new THREE.BoxBufferGeometry(...shape.size)
      : shape.kind === 'sphere' ? new THREE.SphereBufferGeometry(shape.radius, 32, 20)
      : shape.kind === 'capsule' ? capsuleGeometry(shape.radius, shape.length)
      : shape.kind === 'hull' ? hullGeometry(shape)
      : cylinderGeometry(shape.radius, shape.length);
    const mesh = new THREE.Mesh(geometry, material);
    mesh.add(new THREE.LineSegments(new THREE.EdgesGeometry(geometry, EDGE_ANGLE_DEG), this.edgeMaterial));
    setPose(mesh, shape.pose);
    return mesh;
  }

  // Draws what the hand holds: the sensor, and the handle from the sensor to a little beyond the rendered point. Draws
  // the shape of a rigid tool, too.
  addHandle(tool) {
    const link = this.links[tool.link];
    if (!link) return;
    const from = vec(tool.sensor), to = vec(tool.handle);
    const length = from.distanceTo(to);
    const sensor = new THREE.Mesh(cylinderGeometry(0.036, 0.022), this.materials[0]);
    setPose(sensor, tool.sensor);
    sensor.translateZ(0.002);
    link.add(sensor);
    for (const part of tool.parts) {
      const solid = this.makeSolid(part, this.toolMaterial);
      solid.name = 'tool';
      link.add(solid);
    }
    if (length < 0.01) return;
    const handle = new THREE.Mesh(capsuleGeometry(0.016, Math.max(0.01, length - 0.026)), this.handleMaterial);
    handle.name = 'handle';
    handle.position.copy(from).lerp(to, 0.5);
    handle.quaternion.setFromUnitVectors(new THREE.Vector3(0, 0, 1), to.clone().sub(from).normalize());
    link.add(handle);
  }

  show(moment) {
    this.links.forEach((link, i) => setPose(link, moment.links, 7 * i));
  }
}
