// The margin to instability: the felt mass divided by the smallest stable mass, at the last new place to which the arm
// came, as the session judges it. It is shown in words, and as coloured dots along the tool's way. A running session
// sends margins with its status, a record sends them with the stage.
import * as THREE from './three/build/three.module.js';
import { vector } from './connection.js';
import { colour, onTheme } from './theme.js';

// Classes of the ratio, each up to `below`. Dots are larger where the margin is smaller, so that classes differ without
// colours, too.
export const CLASSES = [
  { below: 1, colour: '--margin-1', words: 'under 1: may swing', px: 8 },
  { below: 1.5, colour: '--margin-2', words: '1 to 1.5', px: 6 },
  { below: 3, colour: '--margin-3', words: '1.5 to 3', px: 5 },
  { below: Infinity, colour: '--margin-4', words: 'over 3', px: 4 },
];
const APART_M = 2e-3;  // distance between two dots
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

// Returns the ratio of felt mass to smallest stable mass; 0 if no mass is stable there.
export const ratioOf = ({ felt_mass_kg: felt, smallest_stable_mass_kg: smallest }) => (smallest === null ? 0 : felt / smallest);
export const classOf = (ratio) => CLASSES.findIndex(({ below }) => ratio < below);

export function overSmallest(margin) {
  const { smallest_stable_mass_kg: smallest } = margin;
  if (smallest === null) return '! none is stable';
  const ratio = ratioOf(margin);
  return `${ratio < 1 ? '! ' : ''}${smallest.toPrecision(2)} kg (${ratio.toFixed(2)} ×)`;
}

// Dots along the tool's way, in the colour of the margin there. There are no dots before the first margin.
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

  // Sets the whole way of a record.
  setWay(rows) {
    this.whole = true;
    this.way = [];
    for (const row of rows) this.put(row);
    this.paint();
  }

  // Adds the next moment of a running session.
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
