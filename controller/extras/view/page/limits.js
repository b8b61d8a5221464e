// Draws the borders that the cell sets: the workspace, keep-out boxes and the leash. A border stands out while it acts.
import * as THREE from './three/build/three.module.js';
import { colour, onTheme } from './theme.js';
import { vector } from './connection.js';

// An open side of a box is drawn twice this far, in m, from the opposite side. If both sides are open, each is drawn
// this far from the origin.
const FAR = 1.6;

function boxOf(limits) {
  const min = limits.min.map((x, i) => x ?? ((limits.max[i] ?? FAR) - 2 * FAR));
  const max = limits.max.map((x, i) => x ?? ((limits.min[i] ?? -FAR) + 2 * FAR));
  const size = max.map((x, i) => x - min[i]);
  const geometry = new THREE.BoxBufferGeometry(...size);
  geometry.translate(...min.map((x, i) => x + size[i] / 2));
  return geometry;
}

export class LimitsView extends THREE.Group {
  constructor(stage) {
    super();
    this.name = 'limits';
    this.bits = Object.fromEntries(stage.words.flags.map((flag) => [flag.name, flag.bit]));
    this.quiet = new THREE.LineDashedMaterial({ dashSize: 0.03, gapSize: 0.03, transparent: true, opacity: 0.5 });
    this.loud = new THREE.MeshBasicMaterial({ transparent: true, opacity: 0.22, side: THREE.DoubleSide, depthWrite: false });
    onTheme(() => {
      this.quiet.color.set(colour('--soft'));
      this.loud.color.set(colour('--slip'));
    });
    if (stage.limits.workspace) this.workspace = this.addBox(boxOf(stage.limits.workspace));
    this.keepOut = stage.limits.keep_out.filter(Boolean).map((box) => this.addBox(boxOf(box)));
    this.leash = new THREE.Mesh(new THREE.SphereBufferGeometry(stage.limits.leash_m, 32, 20), this.loud);
    this.leash.visible = false;
    this.add(this.leash);
  }

  addBox(geometry) {
    const edges = new THREE.LineSegments(new THREE.EdgesGeometry(geometry), this.quiet);
    edges.computeLineDistances();
    const faces = new THREE.Mesh(geometry, this.loud);
    faces.visible = false;
    this.add(edges, faces);
    return faces;
  }

  acts(moment, ...names) {
    return names.some((name) => Math.floor(moment.flags_since / this.bits[name]) % 2 === 1);
  }

  show(moment) {
    if (this.workspace) this.workspace.visible = this.acts(moment, 'limit_workspace', 'guard_border');
    for (const zone of this.keepOut) zone.visible = this.acts(moment, 'limit_keep_out', 'guard_border');
    this.leash.visible = this.acts(moment, 'limit_leash');
    this.leash.position.set(...vector(moment, 'tool'));
  }
}
