// Proxy and tool as two things, what they have behind them, and the forces on them: arrows, cone, normal.
import * as THREE from './three/build/three.module.js';
import { UP, Arrow } from './shapes.js';
import { colour, onTheme } from './theme.js';
import { PHASE_RENDERING, vector } from './connection.js';
import { newtons } from './panel.js';

// At a distance of one metre; from further away everything here is drawn larger, so that it keeps its size in the picture.
const METRES_PER_NEWTON = 0.0075;
// Longer arrows are cut: in the overview, whose height is 0.69 of its distance, this is 44 % of the height.
const MOST_N = 40;
const CONE_HEIGHT = 0.1;
const TRAIL_POINTS = 360;
const FREE = 0, STICK = 1, SLIP = 2;

const at = (moment, name) => new THREE.Vector3(...vector(moment, name));

// Where the proxy has been in the last seconds: plain in free motion, in colour along what it touched.
class Trail extends THREE.Line {
  constructor() {
    const geometry = new THREE.BufferGeometry();
    geometry.setAttribute('position', new THREE.BufferAttribute(new Float32Array(3 * TRAIL_POINTS), 3));
    geometry.setAttribute('color', new THREE.BufferAttribute(new Float32Array(3 * TRAIL_POINTS), 3));
    super(geometry, new THREE.LineBasicMaterial({ vertexColors: THREE.VertexColors, linewidth: 2 }));
    this.frustumCulled = false;
    this.points = [];
    this.colours = [];
    onTheme(() => { this.colours = ['--soft', '--stick', '--slip'].map((name) => new THREE.Color(colour(name))); });
  }

  clear() {
    this.points = [];
  }

  push(point, contact) {
    this.points.push([point, contact]);
    if (this.points.length > TRAIL_POINTS) this.points.shift();
    const { position, color } = this.geometry.attributes;
    this.points.forEach(([p, c], i) => {
      position.setXYZ(i, p.x, p.y, p.z);
      const paint = this.colours[c] || this.colours[0];
      color.setXYZ(i, paint.r, paint.g, paint.b);
    });
    this.geometry.setDrawRange(0, this.points.length);
    position.needsUpdate = color.needsUpdate = true;
  }
}

export class ContactView extends THREE.Group {
  // `proxy`: whether there is one, or the arm alone.
  constructor(proxy = true) {
    super();
    this.name = 'contacts';
    this.withProxy = proxy;
    this.size = 1;
    this.makeMaterials();
    this.proxy = new THREE.Mesh(new THREE.SphereBufferGeometry(0.0105, 32, 20), this.materials.proxy);
    this.proxy.name = 'proxy';
    // The tool is a ring with a cross in it, so that the proxy is seen inside of it.
    this.tool = new THREE.Group();
    this.tool.name = 'tool';
    for (const turn of [[0, 0], [Math.PI / 2, 0], [0, Math.PI / 2]]) {
      const ring = new THREE.Mesh(new THREE.TorusBufferGeometry(0.021, 0.0018, 10, 40), this.materials.tool);
      ring.rotation.set(turn[0], turn[1], 0);
      this.tool.add(ring);
    }
    this.leash = new THREE.Line(new THREE.BufferGeometry().setFromPoints([new THREE.Vector3(), new THREE.Vector3()]),
      this.materials.leash);
    this.leash.frustumCulled = false;
    this.hand = new Arrow(this.materials.hand, { radius: 0.0036 });
    this.hand.name = 'hand force';
    this.stick = new Arrow(this.materials.stick, { radius: 0.0045 });
    this.stick.name = 'stick force';
    this.slip = new Arrow(this.materials.slip, { radius: 0.0045, pieces: 5 });
    this.slip.name = 'slip force';
    this.cones = ['', '_2', '_3'].map((end) => this.makeCone(end));
    this.trail = new Trail();
    this.add(this.trail, this.leash, ...this.cones.flatMap((c) => [c.cone, c.normal]), this.hand, this.stick, this.slip, this.tool, this.proxy);
  }

  makeMaterials() {
    const onTop = (material) => Object.assign(material, { depthTest: true });
    this.materials = {
      proxy: new THREE.MeshLambertMaterial(),
      tool: new THREE.MeshLambertMaterial(),
      hand: new THREE.MeshLambertMaterial(),
      stick: new THREE.MeshLambertMaterial(),
      slip: new THREE.MeshLambertMaterial(),
      normal: new THREE.MeshLambertMaterial(),
      leash: onTop(new THREE.LineBasicMaterial()),
      cone: new THREE.MeshBasicMaterial({ transparent: true, opacity: 0.16, side: THREE.DoubleSide, depthWrite: false }),
      coneEdge: new THREE.LineBasicMaterial({ transparent: true, opacity: 0.8 }),
    };
    onTheme(() => {
      for (const name of ['proxy', 'tool', 'hand', 'stick', 'slip']) {
        const paint = new THREE.Color(colour(`--${name}`));
        this.materials[name].color.copy(paint);
        this.materials[name].emissive.copy(paint).multiplyScalar(0.35);
      }
      const soft = new THREE.Color(colour('--soft'));
      this.materials.normal.color.copy(soft);
      this.materials.leash.color.set(colour('--tool'));
      this.materials.cone.color.set(colour('--slip'));
      this.materials.coneEdge.color.set(colour('--slip'));
    });
  }

  // Of a contact whose fields have this end: of height 1 and radius 1 about z, its tip at the contact; scaled by the
  // coefficient of friction.
  makeCone(end) {
    const cone = new THREE.Group(), normal = new Arrow(this.materials.normal, { radius: 0.0014 });
    cone.name = `friction cone${end}`;
    normal.name = `normal${end}`;
    const sides = 36;
    const geometry = new THREE.ConeBufferGeometry(1, 1, sides, 1, true).rotateX(-Math.PI / 2).translate(0, 0, 0.5);
    const rim = [];
    for (let i = 0; i <= sides; ++i) {
      const a = (2 * Math.PI * i) / sides;
      rim.push(new THREE.Vector3(Math.cos(a), Math.sin(a), 1));
    }
    const ribs = [];
    for (let i = 0; i < 8; ++i) ribs.push(new THREE.Vector3(), rim[Math.round((i * sides) / 8)]);
    cone.add(new THREE.Mesh(geometry, this.materials.cone),
      new THREE.Line(new THREE.BufferGeometry().setFromPoints(rim), this.materials.coneEdge),
      new THREE.LineSegments(new THREE.BufferGeometry().setFromPoints(ribs), this.materials.coneEdge));
    cone.visible = false;
    return { cone, normal, fields: `normal${end}`, friction: `friction${end}` };
  }

  showCone({ cone, normal, fields, friction }, moment, proxy) {
    const direction = at(moment, fields), touches = moment.contact !== FREE && direction.lengthSq() > 0.5;
    const height = CONE_HEIGHT * this.size;
    normal.setTo(proxy, touches ? direction.clone().multiplyScalar(1.25 * height) : new THREE.Vector3());
    cone.visible = touches && moment[friction] > 1e-6;
    if (!cone.visible) return;
    cone.position.copy(proxy);
    cone.quaternion.setFromUnitVectors(UP, direction);
    const radius = Math.min(2.5 * height, moment[friction] * height);
    cone.scale.set(radius, radius, height);
  }

  // Where forces act: at the proxy, or at the tool while there is none.
  proxyOf(moment) {
    return at(moment, this.withProxy && moment.phase >= PHASE_RENDERING ? 'proxy' : 'tool');
  }

  // `moves`: it is another moment, not the same seen from elsewhere.
  show(moment, moves = true) {
    const there = this.withProxy && moment.phase >= PHASE_RENDERING;
    const tool = at(moment, 'tool'), proxy = this.proxyOf(moment);
    this.proxy.visible = this.leash.visible = there;
    this.proxy.position.copy(proxy);
    this.tool.position.copy(tool);
    this.leash.geometry.setFromPoints([proxy, tool]);
    if (moves) {
      // What was between two places of a record that lie apart isn't known.
      if (Math.abs(moment.time_s - this.trail.time) > 0.3 || moment.time_s < this.trail.time) this.trail.clear();
      if (!there) this.trail.clear();
      this.trail.time = moment.time_s;
      this.trail.push(proxy, moment.contact);
    }

    const force = this.arrowOf(moment, 'contact_force'), hand = this.arrowOf(moment, 'force');
    // The hand's arrow ends where it pushes, the world's begins there.
    this.hand.setTo(proxy.clone().sub(hand), hand, moment.hand_N > MOST_N);
    const none = new THREE.Vector3(), cut = moment.contact_N > MOST_N;
    this.stick.setTo(proxy, moment.contact === STICK ? force : none, cut);
    this.slip.setTo(proxy, moment.contact === SLIP ? force : none, cut);
    for (const one of this.cones) this.showCone(one, moment, proxy);
  }

  // By the camera's distance from the tool. True: it has changed enough to be drawn anew.
  setDistance(distance) {
    const size = Math.min(3, Math.max(0.35, distance));
    if (Math.abs(size / this.size - 1) < 0.02) return false;
    this.size = size;
    for (const thing of [this.proxy, this.tool]) thing.scale.setScalar(size);
    for (const arrow of [this.hand, this.stick, this.slip, ...this.cones.map((c) => c.normal)]) arrow.setThickness(size);
    return true;
  }

  // A force as metres in the picture, at most MOST_N of it.
  arrowOf(moment, name) {
    return at(moment, name).clampLength(0, MOST_N).multiplyScalar(METRES_PER_NEWTON * this.size);
  }

  // What is written beside the arrows. `told`: the moment that the numbers are of.
  labels(moment, told) {
    const proxy = this.proxyOf(moment), out = [];
    const text = (force_N) => newtons(force_N) + (force_N > MOST_N ? ', arrow cut' : '');
    if (told.contact !== FREE) {
      out.push({ name: 'contact', at: proxy.clone().add(this.arrowOf(moment, 'contact_force')), text: text(told.contact_N),
                 colour: told.contact === SLIP ? '--slip' : '--stick', beside: [-78, -40] });
    }
    if (told.hand_N > 0.3) {
      out.push({ name: 'hand', at: proxy.clone().sub(this.arrowOf(moment, 'force')), text: text(told.hand_N),
                 colour: '--hand', beside: [14, 6] });
    }
    return out;
  }
}
