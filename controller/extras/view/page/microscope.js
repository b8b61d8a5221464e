// An enlarged view of the contact, which shows what is too small for the picture: how far the tool is from the proxy's
// contact, and in a simulation also the true tool ("steel"). The view is a section through the strongest contact, along
// the contact's normal and along the direction in which the tool is aside. If the tool can move less than a millimetre
// along the normal, as in a hole, the opposite side is drawn, too. If nothing is touched, the section is through the
// nearest object.
import { colour, dash, onTheme } from './theme.js';
import { vector } from './connection.js';

const LEAST_M = 1e-6, MOST_M = 1e-2;  // shortest and longest scale bar
const BAR_PX = 64;  // shortest length of the bar on the screen; the longest is 2.5 times that
const STEPS = [1, 2, 5];
const FONT = '11px system-ui, "DejaVu Sans", sans-serif';
// The opposite side is shown if it is at most this many times as far away as everything else.
const MOST_TIMES = 20;
const BORDER = 12;  // distance from the border for what is too far aside
const MARGIN = 30;  // distance between the farthest drawn thing and the border

const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];

// Returns 3.2e-5 as "32 µm".
export function length(m) {
  const size = Math.abs(m);
  if (size < 5e-8) return '0';
  const [factor, unit] = size >= 1e-3 ? [1e3, 'mm'] : [1e6, 'µm'];
  const number = factor * size;
  return `${number >= 100 ? number.toFixed(0) : Number(number.toPrecision(2))} ${unit}`;
}

// Lengths of the scale bar: 1, 2, 5 µm … 10 mm.
const BARS = [];
for (let decade = -6; decade <= -3; ++decade) for (const step of STEPS) BARS.push(step * 10 ** decade);
BARS.push(MOST_M);

// Returns the positions in the section, [aside, up] in metres from the contact.
export function sectionOf(touch) {
  const normal = vector(touch, 'normal');
  const things = { tool: vector(touch, 'tool'), steel: vector(touch, 'steel') };
  const asideOf = (v) => v.map((x, i) => x - dot(v, normal) * normal[i]);
  const aside = asideOf(things.tool), far = Math.hypot(...aside);
  const along = far > 1e-12 ? aside.map((x) => x / far) : [0, 0, 0];
  const section = { proxy: [0, Math.max(0, touch.gap_m)], wide: far };
  for (const [name, v] of Object.entries(things)) {
    if (v.every(Number.isFinite)) section[name] = [dot(v, along), dot(v, normal)];
  }
  return section;
}

// Returns a substitute for a contact while nothing is touched: tool and proxy, with the proxy `room_below_m` from the
// nearest object. Returns null if no object is near.
export function nearestTouch(moment) {
  if (!Number.isFinite(moment.room_below_m)) return null;
  const proxy = vector(moment, 'proxy'), steel = vector(moment, 'steel'), known = steel.some((x) => x !== 0);
  const touch = { slips: false, gap_m: moment.room_below_m };
  ['x', 'y', 'z'].forEach((axis, i) => {
    touch[`normal_${axis}`] = moment[`room_${axis}`];
    touch[`tool_${axis}`] = moment[`tool_${axis}`] - proxy[i];
    touch[`steel_${axis}`] = known ? steel[i] - proxy[i] : NaN;
  });
  return touch;
}

// Returns the distance in metres from the touched surface to the opposite side; infinite if there is none.
export const otherSide = (moment) => (Number.isFinite(moment.room_above_m) ? moment.room_above_m + Math.max(0, moment.room_below_m) : Infinity);

export class Microscope {
  constructor(box) {
    this.box = box;
    this.canvas = box.querySelector('canvas');
    this.context = this.canvas.getContext('2d');
    this.wanted = true;
    this.bar_m = 1e-5;
    onTheme(() => this.show(this.moment));
  }

  toggle() {
    this.wanted = !this.wanted;
    this.show(this.moment);
    return this.wanted;
  }

  // Shows a moment. The view is hidden if nothing is within a millimetre.
  show(moment) {
    this.moment = moment;
    const strongest = moment?.contact ? moment.touches.reduce((most, touch) =>
      (!most || Math.hypot(...vector(touch, 'force')) > Math.hypot(...vector(most, 'force')) ? touch : most), null) : null;
    const touch = strongest ?? (moment ? nearestTouch(moment) : null);
    this.box.hidden = !this.wanted || !touch;
    if (this.box.hidden) return;
    this.section = { ...sectionOf(touch), other: otherSide(moment) };
    this.touched = Boolean(strongest);
    this.draw(touch.slips);
  }

  fit() {
    const { clientWidth: width, clientHeight: height } = this.canvas, ratio = Math.min(2, devicePixelRatio || 1);
    if (this.canvas.width !== Math.round(width * ratio)) this.canvas.width = Math.round(width * ratio);
    if (this.canvas.height !== Math.round(height * ratio)) this.canvas.height = Math.round(height * ratio);
    this.context.setTransform(ratio, 0, 0, ratio, 0, 0);
    return [width, height];
  }

  // Returns pixels per metre. Takes the first scale bar of BARS with which everything is in the picture, and keeps the
  // present bar while it fits well enough.
  scale(room) {
    const places = ['proxy', 'tool', 'steel'].filter((name) => this.section[name]).map((name) => this.section[name]);
    const { other } = this.section, up = Math.max(LEAST_M / 20, ...places.map(([, y]) => Math.abs(y)));
    // The opposite side is shown unless everything else would become too small; its distance is written in any case.
    // Things that are too far aside are then drawn at the border.
    const fit = other < MOST_TIMES * up || other < MOST_TIMES * LEAST_M;
    const far = fit ? Math.max(up, other) : Math.max(up, ...places.map(([x]) => Math.abs(x) / 1.3));
    const fits = (bar) => (far / bar) * BAR_PX <= room;
    const keeps = fits(this.bar_m) && (far / this.bar_m) * BAR_PX > 0.2 * room;
    if (!keeps) this.bar_m = BARS.find(fits) ?? MOST_M;
    return BAR_PX / this.bar_m;
  }

  draw(slips) {
    const c = this.context, [width, height] = this.fit();
    if (!width) return;
    c.clearRect(0, 0, width, height);
    const x0 = width / 2, y0 = height * 0.46, scale = this.scale(height * 0.46 - MARGIN);
    this.drawSolid(width, y0, height, 1);
    const above = y0 - scale * this.section.other;
    if (above > 0) this.drawSolid(width, above, 0, -1);
    const at = ([aside, up]) => [Math.min(width - BORDER, Math.max(BORDER, x0 + scale * aside)), y0 - scale * up];
    const { proxy, tool, steel } = this.section;
    this.leash(at(proxy), at(tool));
    this.ring(at(proxy), 5, colour(slips ? '--slip' : '--stick'), true);
    if (steel) this.cross(at(steel), colour('--ink'));
    this.ring(at(tool), 8, colour('--tool'), false);
    this.texts(width, height, scale);
  }

  // Draws the solid side of a surface at `y0`, hatched, up to `end`. `side`: 1 if the solid is below, −1 if it is
  // above.
  drawSolid(width, y0, end, side) {
    const c = this.context;
    c.fillStyle = colour('--solid');
    c.globalAlpha = 0.28;
    c.fillRect(0, Math.min(y0, end), width, Math.abs(end - y0));
    c.globalAlpha = 1;
    c.strokeStyle = colour('--solid-edge');
    c.lineWidth = 1.5;
    c.beginPath();
    c.moveTo(0, y0);
    c.lineTo(width, y0);
    for (let x = 6; x < width; x += 12) {
      c.moveTo(x, y0);
      c.lineTo(x - 6, y0 + 6 * side);
    }
    c.stroke();
  }

  leash(from, to) {
    const c = this.context;
    c.strokeStyle = colour('--line-tool');
    c.setLineDash(dash('proxy'));
    c.lineWidth = 1.2;
    c.beginPath();
    c.moveTo(...from);
    c.lineTo(...to);
    c.stroke();
    c.setLineDash([]);
  }

  ring([x, y], radius, paint, filled) {
    const c = this.context;
    c.beginPath();
    c.arc(x, y, radius, 0, 2 * Math.PI);
    c.fillStyle = c.strokeStyle = paint;
    c.lineWidth = 2.6;
    if (filled) c.fill(); else c.stroke();
  }

  cross([x, y], paint) {
    const c = this.context;
    c.strokeStyle = paint;
    c.lineWidth = 2.2;
    c.beginPath();
    for (const [a, b] of [[-5, -5], [5, -5]]) {
      c.moveTo(x + a, y + b);
      c.lineTo(x - a, y - b);
    }
    c.stroke();
  }

  texts(width, height, scale) {
    const c = this.context, { tool, steel, other } = this.section;
    const narrow = width < 200;
    c.font = narrow ? FONT.replace('11', '10') : FONT;
    c.fillStyle = colour('--ink');
    c.textBaseline = 'alphabetic';
    c.textAlign = 'left';
    const place = ([aside, up]) => `${length(up)} ${up < 0 ? (narrow ? 'in' : 'inside') : 'away'}, ${length(aside)} aside`;
    const lines = [`○ tool ${place(tool)}`];
    if (steel) lines.push(`× steel ${place(steel)}`);
    const fit = other < LEAST_M / 20 ? 'none' : length(other);
    if (Number.isFinite(other)) lines.unshift(narrow ? `room ${fit}` : `room to the other side: ${fit}`);
    // Reduces the font's size in a narrow picture, as on a phone.
    const widest = Math.max(...lines.map((line) => c.measureText(line).width));
    if (widest > width - 12) c.font = c.font.replace(/[\d.]+px/, `${(((narrow ? 10 : 11) * (width - 12)) / widest).toFixed(1)}px`);
    lines.forEach((line, i) => c.fillText(line, 8, height - 8 - 14 * (lines.length - 1 - i)));
    const bar = scale * this.bar_m, right = width - 10;
    c.strokeStyle = colour('--ink');
    c.lineWidth = 2;
    c.beginPath();
    c.moveTo(right - bar, 20);
    c.lineTo(right, 20);
    for (const x of [right - bar, right]) {
      c.moveTo(x, 16);
      c.lineTo(x, 24);
    }
    c.stroke();
    c.textAlign = 'center';
    c.fillText(length(this.bar_m), right - bar / 2, 13);
  }
}
