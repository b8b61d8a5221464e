// The picture: camera, light, floor, and everything on it. It is drawn when something has changed, as finely as the
// machine can.
import * as THREE from './three/build/three.module.js';
import { OrbitControls } from './three/examples/jsm/controls/OrbitControls.js';
import { ArmView } from './arm.js';
import { ContactView } from './contacts.js';
import { LimitsView } from './limits.js';
import { MarginTrace } from './margins.js';
import { SceneView } from './objects.js';
import { vector } from './connection.js';
import { colour, onTheme } from './theme.js';

const SLOW_FRAME_MS = 32, FAST_FRAME_MS = 20;
const RATIOS = [1, 0.8, 0.65, 0.5];

// Camera positions, relative to the middle between arm and tool, or to the tool.
const VIEWS = {
  overview: { from: [-1.06, -2.07, 0.6], about: 'middle' },
  tool: { from: [-0.28, -0.44, 0.2], about: 'tool' },
  top: { from: [0, -0.001, 2.2], about: 'middle' },
  front: { from: [2.2, 0, 0.05], about: 'middle' },
  side: { from: [0, -2.2, 0.05], about: 'middle' },
};

const BAR_PX = 46;  // height of the buttons above the picture and of the legend below it
// Share of the picture's height that the default arm takes in the overview, with room for a rising elbow.
const USED_HEIGHT = 0.91;

const LABEL_HEIGHT = 22;
const overlap = ([left, top, right, bottom], [l, t, r, b]) => left < r && l < right && top < b && t < bottom;

function drawnBySoftware() {
  const context = document.createElement('canvas').getContext('webgl');
  const details = context && context.getExtension('WEBGL_debug_renderer_info');
  const name = details ? context.getParameter(details.UNMASKED_RENDERER_WEBGL) : '';
  return /swiftshader|llvmpipe|software/i.test(name);
}

export class World {
  constructor(canvas, labels) {
    this.canvas = canvas;
    this.labelBox = labels;
    this.labelElements = new Map();
    this.labelWidths = new Map();
    const software = drawnBySoftware();
    this.renderer = new THREE.WebGLRenderer({ canvas, alpha: true, antialias: !software, powerPreference: 'high-performance' });
    this.software = software;
    this.ratioStep = 0;
    this.scene = new THREE.Scene();
    this.camera = new THREE.PerspectiveCamera(38, 1, 0.01, 60);
    this.camera.up.set(0, 0, 1);
    this.orbit = new OrbitControls(this.camera, canvas);
    this.orbit.enableKeys = false;  // keys.js handles all keys
    this.orbit.minDistance = 0.08;
    this.orbit.maxDistance = 12;
    this.orbit.addEventListener('change', () => { this.changed = true; });
    this.follow = false;
    this.middle = new THREE.Vector3(0.45, 0, 0.55);
    this.tool = new THREE.Vector3(0.7, 0, 0.6);
    this.addLight();
    this.addFloor();
    onTheme(() => { this.changed = true; });
    new ResizeObserver(() => this.resize()).observe(canvas.parentElement);
    this.changed = true;
    this.frames = 0;
    this.drawMs = 20;
    this.lastDraw = this.stepped = 0;
    this.patienceMs = 2000;
  }

  addLight() {
    this.sky = new THREE.HemisphereLight(0xffffff, 0x8a8f98, 0.75);
    this.sky.position.set(0, 0, 1);
    const sun = new THREE.DirectionalLight(0xffffff, 0.55);
    sun.position.set(-1.5, -2.2, 3);
    this.scene.add(this.sky, sun);
  }

  addFloor() {
    this.floor = new THREE.GridHelper(4, 20);
    this.floor.rotateX(Math.PI / 2);
    this.floor.material.transparent = true;
    this.floor.material.opacity = 0.55;
    this.scene.add(this.floor);
    onTheme(() => {
      const paint = new THREE.Color(colour('--floor')), colours = this.floor.geometry.attributes.color;
      for (let i = 0; i < colours.count; ++i) colours.setXYZ(i, paint.r, paint.g, paint.b);
      colours.needsUpdate = true;
    });
  }

  // Builds the picture. The first moment says where the tool is, and planes are drawn around this place.
  build(stage, moment) {
    for (const part of [this.arm, this.objects, this.contacts, this.limits, this.margins]) if (part) this.scene.remove(part);
    this.tool.set(...vector(moment, 'tool'));
    this.middle.copy(this.tool).multiplyScalar(0.62);
    this.middle.z = Math.max(0.2, this.tool.z * 0.95);
    this.arm = new ArmView(stage);
    this.objects = new SceneView(stage, this.tool.clone());
    this.contacts = new ContactView(stage.mode !== 'arm');
    this.limits = new LimitsView(stage);
    this.margins = new MarginTrace(document.getElementById('margin-legend'));
    this.scene.add(this.arm, this.objects, this.limits, this.contacts, this.margins);
    this.resize();
    for (const part of this.objects.parts) part.addEventListener('loaded', () => { this.changed = true; });
    this.look('overview');
  }

  look(name) {
    const view = VIEWS[name];
    const about = view.about === 'tool' ? this.tool : this.middle;
    // A narrow picture needs a larger distance to show the same width. A low picture needs a larger distance, too,
    // since buttons and legend cover part of its height.
    const narrow = Math.max(1, 1.35 / Math.max(0.3, this.camera.aspect));
    const low = Math.max(1, USED_HEIGHT / Math.max(0.3, 1 - (2 * BAR_PX) / this.height));
    this.orbit.target.copy(about);
    this.camera.position.copy(about).add(new THREE.Vector3(...view.from).multiplyScalar(view.about === 'tool' ? 1 : Math.max(narrow, low)));
    this.orbit.update();
    this.changed = true;
  }

  // Keys act like dragging. Turns the camera around the middle of the picture, by angles.
  turn(aside, up) {
    const way = this.camera.position.clone().sub(this.orbit.target), far = way.length();
    const round = Math.atan2(way.y, way.x) + aside, most = Math.PI / 2 - 1e-3;
    const steep = Math.min(most, Math.max(-most, Math.asin(way.z / far) + up));
    way.set(Math.cos(steep) * Math.cos(round), Math.cos(steep) * Math.sin(round), Math.sin(steep)).multiplyScalar(far);
    this.moveCamera(way);
  }

  // Moves the camera nearer or further away, by a factor of the distance.
  zoom(factor) {
    const way = this.camera.position.clone().sub(this.orbit.target);
    const far = Math.min(this.orbit.maxDistance, Math.max(this.orbit.minDistance, factor * way.length()));
    this.moveCamera(way.setLength(far));
  }

  // Moves the camera aside and up, by shares of the distance.
  shift(aside, up) {
    const way = this.camera.position.clone().sub(this.orbit.target), far = way.length();
    for (const [axis, share] of [[0, aside], [1, up]]) {
      this.orbit.target.addScaledVector(new THREE.Vector3().setFromMatrixColumn(this.camera.matrix, axis), share * far);
    }
    this.moveCamera(way);
  }

  moveCamera(fromTarget) {
    this.camera.position.copy(this.orbit.target).add(fromTarget);
    this.orbit.update();
    this.changed = true;
  }

  show(moment) {
    const before = this.tool.clone();
    this.tool.set(...vector(moment, 'tool'));
    if (this.follow) {
      const way = this.tool.clone().sub(before);
      this.camera.position.add(way);
      this.orbit.target.add(way);
      this.orbit.update();
    }
    this.arm.show(moment);
    this.objects.show(moment);
    this.contacts.show(moment);
    this.limits.show(moment);
    this.margins.show(moment);
    this.moment = moment;
    this.changed = true;
  }

  // Takes the moment from which the labels' numbers come, as the panel's figures do: faster changes can't be read.
  tell(moment) {
    if (this.told === moment) return;
    this.told = moment;
    this.changed = true;
  }

  resize() {
    const { clientWidth: width, clientHeight: height } = this.canvas.parentElement;
    if (!width || !height) return;
    const ratio = Math.min(2, devicePixelRatio || 1) * RATIOS[this.ratioStep];
    this.width = width;
    this.height = height;
    this.renderer.setPixelRatio(ratio);
    this.renderer.setSize(width, height, false);
    this.camera.aspect = width / height;
    this.camera.updateProjectionMatrix();
    this.changed = true;
  }

  // Called once per frame of the browser. Returns whether the picture was drawn.
  draw() {
    if (!this.changed) return false;
    this.changed = false;
    if (this.moment && this.contacts.setDistance(this.camera.position.distanceTo(this.tool))) {
      this.contacts.show(this.moment, false);
    }
    this.renderer.render(this.scene, this.camera);
    this.placeLabels();
    const now = performance.now();
    this.adapt(now - this.lastDraw);
    this.lastDraw = now;
    ++this.frames;
    return true;
  }

  // Adapts the resolution to the drawing time: a coarse picture that moves smoothly is better than a fine one that
  // jerks. `ms`: time since the last picture, because the graphics hardware works on after render() has returned. A
  // finer resolution that was too slow is tried again later, each time after a longer wait.
  adapt(ms) {
    if (!(ms < 500)) return;  // nothing has moved
    this.drawMs += 0.05 * (ms - this.drawMs);
    const now = performance.now();
    if (this.drawMs > SLOW_FRAME_MS && this.ratioStep + 1 < RATIOS.length) {
      ++this.ratioStep;
      this.patienceMs = Math.min(120_000, 2 * this.patienceMs);
    } else if (this.drawMs < FAST_FRAME_MS && this.ratioStep > 0 && now - this.stepped > this.patienceMs) {
      --this.ratioStep;
    } else {
      return;
    }
    this.stepped = now;
    this.drawMs = (SLOW_FRAME_MS + FAST_FRAME_MS) / 2;
    this.resize();
  }

  // Draws as finely as the size allows, however long it takes, for saving the picture.
  drawFine() {
    this.ratioStep = 0;
    this.adapt = () => {};
    this.resize();
  }

  placeLabels() {
    const wanted = this.moment && this.told ? this.contacts.labels(this.moment, this.told) : [];
    const { width, height } = this;
    const seen = new Set(), taken = [];
    for (const label of wanted) {
      const p = label.at.project(this.camera);
      if (p.z > 1) continue;
      let element = this.labelElements.get(label.name);
      if (!element) {
        element = document.createElement('span');
        this.labelBox.append(element);
        this.labelElements.set(label.name, element);
      }
      element.hidden = false;
      if (element.textContent !== label.text) {
        element.textContent = label.text;
        this.labelWidths.set(label.name, element.offsetWidth);
      }
      element.style.borderColor = colour(label.colour);
      const x = Math.min(width - this.labelWidths.get(label.name) - 4, Math.max(4, (0.5 + p.x / 2) * width + label.beside[0]));
      const y = Math.min(height - 26, Math.max(4, (0.5 - p.y / 2) * height + label.beside[1]));
      const box = [x, y, x + this.labelWidths.get(label.name), y + LABEL_HEIGHT];
      if (label.yields && taken.some((other) => overlap(box, other))) continue;
      taken.push(box);
      seen.add(label.name);
      element.style.transform = `translate(${x}px, ${y}px)`;
    }
    for (const [name, element] of this.labelElements) element.hidden = !seen.has(name);
  }
}
