// How far from swinging: the mass that is felt over the smallest that is stable where the arm last came by a new place, as
// the session judges it; in words, and as colour along the way of the tool. Live it comes with the status, of a record with
// the stage.
import * as THREE from './three/build/three.module.js';
import { vector } from './connection.js';
import { colour, onTheme } from './theme.js';

// By the ratio, up to `below`. The nearer to swinging the larger the dots, which says it without colours.
export const CLASSES = [
  { below: 1, colour: '--margin-1', words: 'under 1: may swing', px: 8 },
  { below: 1.5, colour: '--margin-2', words: '1 to 1.5', px: 6 },
  { below: 3, colour: '--margin-3', words: '1.5 to 3', px: 5 },
  { below: Infinity, colour: '--margin-4', words: 'over 3', px: 4 },
];
const APART_M = 2e-3;     // of two dots
const MOST_DOTS = 4000;

let margins = [];
export function setMargins(all) {
  margins = all;
}
export function addMargin(margin) {
  if (margins[margins.length - 1]?.time_s !== margin.time_s) margins.push(margin);
}
export const marginAt = (time_s) => margins.filter((margin) => margin.time_s <= time_s + 1e-9).pop();
export const marginCount = () => margins.length;

// 0: none is stable there.
export const ratioOf = ({ felt_mass_kg: felt, smallest_stable_mass_kg: smallest }) => (smallest === null ? 0 : felt / smallest);
export const classOf = (ratio) => CLASSES.findIndex(({ below }) => ratio < below);

export function overSmallest(margin) {
  const { smallest_stable_mass_kg: smallest } = margin;
  if (smallest === null) return '! none is stable';
  const ratio = ratioOf(margin);
  return `${ratio < 1 ? '! ' : ''}${smallest.toPrecision(2)} kg (${ratio.toFixed(2)} ×)`;
}

// Dots along where the tool was, in the colour of what was judged there; none before anything was.
export class MarginTrace extends THREE.Group {
  constructor(legend) {
    super();
    this.name = 'margin trace';
    this.legend = legend;
    this.way = [];  // {time_s, place}
    this.dots = CLASSES.map(({ px }) => {
      const material = new THREE.PointsMaterial({ size: px, sizeAttenuation: false });
      const dots = new THREE.Points(new THREE.BufferGeometry(), material);
      dots.frustumCulled = false;
      this.add(dots);
      return dots;
    });
    onTheme(() => this.dots.forEach((dots, i) => dots.material.color.set(colour(CLASSES[i].colour))));
    legend.replaceChildren(document.createTextNode('dots along the way, mass over the smallest stable: '), ...CLASSES.map((one) => {
      const item = document.createElement('span'), dot = document.createElement('i');
      Object.assign(dot.style, { width: `${one.px + 2}px`, height: `${one.px + 2}px`, background: `var(${one.colour})` });
      item.append(dot, one.words);
      return item;
    }));
  }

  // A record's whole way, once.
  setWay(rows) {
    this.whole = true;
    this.way = [];
    for (const row of rows) this.put(row);
    this.paint();
  }

  // The next moment of a session that runs. True: there is something new to draw.
  show(moment) {
    if (this.whole) return;
    const last = this.way[this.way.length - 1];
    if (last && moment.time_s < last.time_s) this.way = [];
    if (this.put(moment) || this.painted !== marginCount()) this.paint();
  }

  put(row) {
    if (!(row.mass_kg > 0)) return false;
    const place = vector(row, 'tool'), last = this.way[this.way.length - 1];
    if (last && Math.hypot(...place.map((x, i) => x - last.place[i])) < APART_M) return false;
    this.way.push({ time_s: row.time_s, place });
    if (this.way.length > MOST_DOTS) this.way.shift();
    return true;
  }

  paint() {
    this.painted = marginCount();
    const places = CLASSES.map(() => []);
    for (const { time_s, place } of this.way) {
      const margin = marginAt(time_s);
      if (margin) places[classOf(ratioOf(margin))].push(...place);
    }
    this.counts = places.map((of) => of.length / 3);
    places.forEach((of, i) => this.dots[i].geometry.setAttribute('position', new THREE.BufferAttribute(new Float32Array(of), 3)));
    this.dots.forEach((dots, i) => { dots.visible = places[i].length > 0; });
    this.legend.hidden = !this.counts.some(Boolean);
  }
}
