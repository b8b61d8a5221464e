// Draws proxy and tool as two things, the leash between them, the proxy's trail, and the forces on them. The hand's
// force is drawn at the handle. The world's forces are drawn at each contact, with the contact's normal and friction
// cone.
import * as THREE from './three/build/three.module.js';
import { UP, Arrow } from './shapes.js';
import { colour, onTheme } from './theme.js';
import { PHASE_RENDERING, vector } from './connection.js';
import { newtons } from './panel.js';

// Scale of the arrows at a camera distance of one metre. From further away, everything here is drawn larger, so that it
// keeps its size in the picture.
const METRES_PER_NEWTON = 0.0075;
// Arrows of larger forces are cut. In the overview, whose height is 0.69 of the camera's distance, this is 44 % of the
// height.
const MOST_N = 40;
const CONE_HEIGHT = 0.1;
const TRAIL_POINTS = 360;
const LEAST_N = 0.005;  // smaller forces are 0 in two decimals
// Impulses below LEAST_NS aren't shown. An impulse is shown for BLOW_S.
const LEAST_NS = 0.005, BLOW_S = 1;
const FREE = 0;

const at = (moment, name) => new THREE.Vector3(...vector(moment, name));
const newtonsOf = (touch) => Math.hypot(...vector(touch, 'force'));

// The proxy's way in the last seconds: grey in free motion, coloured by the state of the contact.
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
  // `proxy`: whether there is a proxy; false for the arm alone.
  constructor(proxy = true) {
    super();
    this.name = 'contacts';
    this.withProxy = proxy;
    this.size = 1;
    this.makeMaterials();
    this.proxy = new THREE.Mesh(new THREE.SphereBufferGeometry(0.0105, 32, 20), this.materials.proxy);
    this.proxy.name = 'proxy';
    // The tool is drawn as crossed rings, so that the proxy is visible inside them.
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
    this.marks = [];
    this.trail = new Trail();
    this.add(this.trail, this.leash, this.hand, this.tool, this.proxy);
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

  // Makes the objects that are drawn at a contact. `end` is appended to their names, which distinguishes several
  // contacts.
  makeMark(end) {
    const mark = {
      normal: new Arrow(this.materials.normal, { radius: 0.0014 }),
      stick: new Arrow(this.materials.stick, { radius: 0.0045 }),
      slip: new Arrow(this.materials.slip, { radius: 0.0045, pieces: 5 }),
      cone: this.makeCone(),
    };
    for (const [kind, words] of [['normal', 'normal'], ['stick', 'stick force'], ['slip', 'slip force'], ['cone', 'friction cone']]) {
      mark[kind].name = words + end;
      this.add(mark[kind]);
    }
    for (const kind of ['normal', 'stick', 'slip']) mark[kind].setThickness(this.size);
    return mark;
  }

  // Makes a friction cone of height 1 and radius 1 about z, with its tip at the contact. It is later scaled by the
  // coefficient of friction.
  makeCone() {
    const cone = new THREE.Group();
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
    return cone;
  }

  // Shows one mark for each contact, and hides the other marks.
  showMarks(touches) {
    while (this.marks.length < touches.length) {
      this.marks.push(this.makeMark(this.marks.length ? `_${this.marks.length + 1}` : ''));
    }
    this.marks.forEach((mark, i) => {
      if (i < touches.length) return this.showMark(mark, touches[i]);
      for (const part of Object.values(mark)) part.visible = false;
    });
  }

  showMark({ normal, stick, slip, cone }, touch) {
    const point = at(touch, 'point'), direction = at(touch, 'normal'), height = CONE_HEIGHT * this.size;
    const none = new THREE.Vector3(), force = this.arrowOf(touch, 'force'), cut = newtonsOf(touch) > MOST_N;
    stick.setTo(point, touch.slips ? none : force, cut);
    slip.setTo(point, touch.slips ? force : none, cut);
    const known = direction.lengthSq() > 0.5;
    normal.setTo(point, known ? direction.clone().multiplyScalar(1.25 * height) : none);
    cone.visible = known && touch.friction > 1e-6;
    if (!cone.visible) return;
    cone.position.copy(point);
    cone.quaternion.setFromUnitVectors(UP, direction);
    const radius = Math.min(2.5 * height, touch.friction * height);
    cone.scale.set(radius, radius, height);
  }

  // Returns the point at which forces act: the proxy, or the tool while there is no proxy.
  proxyOf(moment) {
    return at(moment, this.withProxy && moment.phase >= PHASE_RENDERING ? 'proxy' : 'tool');
  }

  // `moves`: whether this is another moment; false: the same moment from another camera position.
  show(moment, moves = true) {
    const there = this.withProxy && moment.phase >= PHASE_RENDERING;
    const tool = at(moment, 'tool'), proxy = this.proxyOf(moment);
    this.proxy.visible = this.leash.visible = there;
    this.proxy.position.copy(proxy);
    this.tool.position.copy(tool);
    this.leash.geometry.setFromPoints([proxy, tool]);
    if (moves) {
      // If two moments of a record lie apart, the way between them isn't known.
      if (Math.abs(moment.time_s - this.trail.time) > 0.3 || moment.time_s < this.trail.time) this.trail.clear();
      if (!there) this.trail.clear();
      this.trail.time = moment.time_s;
      this.trail.push(proxy, moment.contact);
    }

    const hand = this.arrowOf(moment, 'force');
    // The hand's arrow ends at the proxy, the world's arrows begin at the contacts.
    this.hand.setTo(proxy.clone().sub(hand), hand, moment.hand_N > MOST_N);
    this.showMarks(moment.contact === FREE ? [] : moment.touches);
  }

  // Adapts the sizes to the camera's distance from the tool. Returns whether the sizes have changed, so that everything
  // must be drawn anew.
  setDistance(distance) {
    const size = Math.min(3, Math.max(0.35, distance));
    if (Math.abs(size / this.size - 1) < 0.02) return false;
    this.size = size;
    for (const thing of [this.proxy, this.tool]) thing.scale.setScalar(size);
    for (const arrow of [this.hand, ...this.marks.flatMap((m) => [m.stick, m.slip, m.normal])]) arrow.setThickness(size);
    return true;
  }

  // Returns the arrow of a force in metres, cut at MOST_N.
  arrowOf(moment, name) {
    return at(moment, name).clampLength(0, MOST_N).multiplyScalar(METRES_PER_NEWTON * this.size);
  }

  // Returns the labels beside the arrows. `told`: the moment from which the labels' numbers come. Labels that yield
  // come last: such a label is left out if it would lie over another label.
  labels(moment, told) {
    const proxy = this.proxyOf(moment), out = [];
    const text = (force_N) => newtons(force_N) + (force_N > MOST_N ? ', arrow cut' : '');
    // No label is shown for a contact that is already gone, nor for a contact that doesn't press.
    told.touches.slice(0, moment.touches.length).forEach((touch, i) => {
      if (newtonsOf(touch) < LEAST_N) return;
      const place = moment.touches[i];
      out.push({ name: `contact ${i}`, at: at(place, 'point').add(this.arrowOf(place, 'force')), text: text(newtonsOf(touch)),
                 colour: touch.slips ? '--slip' : '--stick', beside: [-78, -40], yields: i > 0 });
    });
    // A blow is over before its force could be read, and the force depends on the timestep. So the blow's impulse is
    // shown for a moment instead.
    if (told.blow_Ns >= LEAST_NS && told.time_s - told.blow_s < BLOW_S && moment.touches.length) {
      out.push({ name: 'blow', at: at(moment.touches[0], 'point'), text: `impact ${told.blow_Ns.toPrecision(2)} Ns`,
                 colour: '--soft', beside: [18, -34], yields: true });
    }
    if (told.hand_N > 0.3) {
      out.push({ name: 'hand', at: proxy.clone().sub(this.arrowOf(moment, 'force')), text: text(told.hand_N),
                 colour: '--hand', beside: [14, 6] });
    }
    return out.sort((a, b) => Boolean(a.yields) - Boolean(b.yields));
  }
}
