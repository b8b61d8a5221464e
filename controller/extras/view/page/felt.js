// Two diagrams of what the hand felt and what was meant, over the time that the plots show. First, in free motion: the
// hand's force over the tool's acceleration, and the line of the wanted mass. Second, in contact: the contact force
// over the tool's depth, and the line that the scene means. The shaded ground is the range that hands can't tell from
// the line (docs/how_to/view.md has the sources).
import { PHASE_RENDERING, vector } from './connection.js';
import { colour, dash, onTheme } from './theme.js';

export const NOTICEABLE = 0.1;  // smallest share of a force that a hand notices
const RIGID_N_PER_MM = 42;  // a stiffer object feels rigid
// BLOW_S: beginning of a touch, which doesn't count. GAP_S: longest time between two rows that follow each other.
const BLOW_S = 0.05, GAP_S = 0.1;
const LEAST_M_PER_S2 = 0.05;  // smaller accelerations are noise of the encoders
const CYCLE_BAND = 0.15;  // share of a cycle's depth by which the cycle must pass its middle on both sides
const LEAST_CYCLE_MM = 1e-3;  // smaller cycles are noise of the encoders
const BETWEEN_MS = 250;
const LEFT = 30, BOTTOM = 16, TOP = 18, RIGHT = 6;
const FONT = '10px system-ui, "DejaVu Sans", sans-serif';

const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
const following = (a, b) => b.time_s > a.time_s && b.time_s - a.time_s < GAP_S;

// Returns the hand's force over nine rows, with triangular weights. The second difference of positions four rows apart
// averages the acceleration with the same weights. So force and acceleration are smoothed equally, and their ratio is
// the mass at any frequency.
const TRIANGLE = [0, 1, 2, 3, 4, 3, 2, 1, 0].map((weight) => weight / 16);
export function evenForce(rows) {
  return ['force_x', 'force_y', 'force_z'].map((part) => rows.reduce((sum, row, i) => sum + TRIANGLE[i] * row[part], 0));
}

// Returns points [size of the acceleration, force along the acceleration], each over nine rows in free motion.
export function freePoints(rows) {
  const points = [];
  for (let i = 8; i < rows.length; ++i) {
    const [a, b, c] = [rows[i - 8], rows[i - 4], rows[i]];
    if (!rows.slice(i - 8, i + 1).every((row) => row.contact === 0 && row.phase === PHASE_RENDERING)) continue;
    const h1 = b.time_s - a.time_s, h2 = c.time_s - b.time_s;
    if (!(h1 > 0 && h2 > 0 && h1 + h2 < 8 * GAP_S)) continue;
    const [p, q, r] = [a, b, c].map((row) => vector(row, 'tool'));
    const acceleration = p.map((_, k) => (2 * ((r[k] - q[k]) / h2 - (q[k] - p[k]) / h1)) / (h1 + h2));
    const size = Math.hypot(...acceleration);
    if (!(size > LEAST_M_PER_S2)) continue;
    const handle_N = rows[i].handle_kg * size;  // the force that moves the handle, which the sensor behind the handle doesn't see
    const force = evenForce(rows.slice(i - 8, i + 1));
    points.push([size, dot(force, acceleration) / size + handle_N]);
  }
  return points;
}

// Returns for rows in contact: `points` [depth in mm, force in N]; `last`, the points of the last touch; `work`, the
// energy in mJ that the last touch took from the hand along the normal. `work` is 0 for a wall or a spring, above 0 if
// the touch damps, and below 0 if the touch gives energy. `surface_m`: where depth begins, a layer's thickness above
// the rigid surface.
export function touchPoints(rows, surface_m = 0) {
  const points = [];
  let work = NaN, before = null, begun = 0, last = [];
  for (const row of rows) {
    const touches = row.contact !== 0 && row.phase === PHASE_RENDERING;
    if (touches && (!before || !following(before, row))) {
      begun = row.time_s;
      work = 0;
      last = [];
    }
    if (touches && row.time_s - begun > BLOW_S) {
      const depth = 1e3 * (surface_m - row.tool_clearance_m);
      if (before?.depth !== undefined) work += 0.5 * (row.contact_N + before.contact_N) * (depth - before.depth);
      points.push([depth, row.contact_N]);
      last.push(points[points.length - 1]);
      before = { ...row, depth };
    } else {
      before = touches ? row : null;
    }
  }
  return { points, work, last };
}

// Returns the last in-and-out cycle of a touch: from the time when the tool is half-way in to the next such time, so
// that the loop of force over depth is closed. `energy_mJ`, ∮ F dx, is the energy that the cycle takes from the hand;
// below 0, the cycle gives energy. Returns null if there was no whole cycle.
export function cycleOf(points) {
  const depths = points.map(([depth]) => depth), low = Math.min(...depths), high = Math.max(...depths);
  const half = 0.5 * (low + high), band = CYCLE_BAND * (high - low);
  if (!(high - low > LEAST_CYCLE_MM)) return null;
  const passes = [];  // {at, force}: the pass is between the points `at` and `at` + 1
  let out = false, pass = null;
  for (let i = 0; i + 1 < points.length; ++i) {
    const [d0, f0] = points[i], [d1, f1] = points[i + 1];
    if (d0 < half - band) out = true;
    if (d0 < half && d1 >= half) pass = { at: i, force: f0 + ((half - d0) / (d1 - d0)) * (f1 - f0) };
    if (out && pass && d1 > half + band) {
      passes.push(pass);
      out = false;
      pass = null;
    }
  }
  if (passes.length < 2) return null;
  const [from, to] = passes.slice(-2);
  const loop = [[half, from.force], ...points.slice(from.at + 1, to.at + 1), [half, to.force]];
  let energy_mJ = 0;
  for (let i = 0; i + 1 < loop.length; ++i) energy_mJ += 0.5 * (loop[i][1] + loop[i + 1][1]) * (loop[i + 1][0] - loop[i][0]);
  return { energy_mJ, loop };
}

class Scatter {
  constructor(canvas) {
    this.canvas = canvas;
    this.context = canvas.getContext('2d');
  }

  // Draws one diagram. `line`: the force that is meant. `ground`: the polygon that hands can't tell from the line.
  // `from`, `wide`: x at the left and at the right. `most`: y at the top. `loop`: a closed loop.
  draw(title, unit, points, { wide, most, line, ground, from = 0, loop = [] }) {
    const c = this.context, { clientWidth: width, clientHeight: height } = this.canvas;
    const ratio = Math.min(2, devicePixelRatio || 1);
    this.canvas.width = Math.round(width * ratio);
    this.canvas.height = Math.round(height * ratio);
    c.setTransform(ratio, 0, 0, ratio, 0, 0);
    const x = (v) => LEFT + ((v - from) / (wide - from)) * (width - LEFT - RIGHT);
    const y = (v) => height - BOTTOM - (v / most) * (height - TOP - BOTTOM);
    c.save();
    c.beginPath();
    c.rect(LEFT, TOP, width - LEFT - RIGHT, height - TOP - BOTTOM);
    c.clip();
    c.fillStyle = colour('--band');
    c.beginPath();
    ground.forEach(([u, v], i) => (i ? c.lineTo(x(u), y(v)) : c.moveTo(x(u), y(v))));
    c.fill();
    c.fillStyle = colour('--line-felt');
    for (const [u, v] of points) c.fillRect(x(u) - 1, y(v) - 1, 2, 2);
    c.strokeStyle = colour('--line-contact');
    c.setLineDash([]);
    c.lineWidth = 1.4;
    c.beginPath();
    loop.forEach(([u, v], i) => (i ? c.lineTo(x(u), y(v)) : c.moveTo(x(u), y(v))));
    c.stroke();
    c.strokeStyle = colour('--line-wanted');
    c.setLineDash(dash('wanted'));
    c.lineWidth = 1.6;
    c.beginPath();
    line.forEach(([u, v], i) => (i ? c.lineTo(x(u), y(v)) : c.moveTo(x(u), y(v))));
    c.stroke();
    c.restore();
    c.setLineDash([]);
    c.strokeStyle = colour('--line');
    c.strokeRect(LEFT, TOP, width - LEFT - RIGHT, height - TOP - BOTTOM);
    c.font = FONT;
    c.fillStyle = colour('--soft');
    c.textBaseline = 'middle';
    c.textAlign = 'left';
    c.fillText(title, 2, 8);
    c.textAlign = 'right';
    c.fillText(`${Number(most.toPrecision(2))}`, LEFT - 3, TOP + 5);
    const widest = `${Number(wide.toPrecision(2))} ${unit}`, least = `${Number(from.toPrecision(2))}`.replace('-', '−');
    c.fillText(widest, width - RIGHT, height - 7);
    c.textAlign = 'left';
    // If there isn't room for both numbers, the left one is left out.
    if (c.measureText(widest).width + c.measureText(least).width + 4 < width - RIGHT - LEFT) c.fillText(least, LEFT, height - 7);
  }
}

const highest = (points, at, least) => Math.max(least, ...points.map((point) => Math.abs(point[at]))) * 1.1;

export class Felt {
  constructor(section, stage) {
    this.section = section;
    this.objects = stage.scene.objects;
    section.hidden = stage.mode === 'arm';
    [this.free, this.touch] = [...section.querySelectorAll('canvas')].map((canvas) => new Scatter(canvas));
    this.words = section.querySelector('p');
    this.drawn = 0;
    onTheme(() => { this.drawn = 0; });
  }

  draw(now, rows) {
    if (this.section.hidden || now - this.drawn < BETWEEN_MS || !rows.length) return;
    this.drawn = now;
    const last = rows[rows.length - 1];
    this.points = freePoints(rows);
    this.drawFree(last.mass_kg);
    const touched = rows.filter((row) => row.contact !== 0).pop(), layer = this.objects[touched?.object]?.layer;
    const { points, work, last: lastTouch } = touchPoints(rows, layer?.thickness);
    this.touched = points;
    this.cycle = cycleOf(lastTouch);
    this.drawTouch(points, layer?.stiffness);
    this.words.textContent = this.sentence(last.mass_kg, work);
  }

  // Returns the felt mass: least squares of force over acceleration.
  get felt_kg() {
    const [fa, aa] = this.points.reduce(([s, t], [a, f]) => [s + f * a, t + a * a], [0, 0]);
    return this.points.length > 20 ? fa / aa : NaN;
  }

  sentence(mass_kg, work) {
    const felt = this.felt_kg, off = felt / mass_kg - 1, parts = [];
    if (mass_kg > 0 && Number.isFinite(felt)) {
      parts.push(`feels like ${felt.toFixed(2)} kg, ${Math.abs(off) > NOTICEABLE ? 'which a hand notices' : 'which no hand tells from what is meant'}`);
    }
    if (Number.isFinite(work) && Math.abs(work) > 1e-3) {
      parts.push(`the last touch ${work > 0 ? 'took' : 'gave'} ${Math.abs(work).toPrecision(2)} mJ along its normal`);
    }
    if (this.cycle) {
      const energy = this.cycle.energy_mJ;
      parts.push(`a cycle of it ${energy >= 0 ? 'takes' : 'gives'} ${Number(Math.abs(energy).toPrecision(2))} mJ`);
    }
    return parts.join('; ');
  }

  drawFree(mass_kg) {
    const wide = highest(this.points, 0, 0.2), most = Math.max(highest(this.points, 1, 0.2), mass_kg * wide * 1.1);
    const meant = mass_kg > 0 ? mass_kg * wide : 0;
    this.free.draw('N, by acceleration', 'm/s²', this.points, {
      wide, most, line: [[0, 0], [wide, meant]],
      ground: [[0, 0], [wide, (1 + NOTICEABLE) * meant], [wide, (1 - NOTICEABLE) * meant]] });
  }

  // A rigid object stops the tool at its surface, and any steep enough line feels rigid. A layer is a spring.
  drawTouch(points, layer_N_per_m) {
    const most = highest(points, 1, 1), rigid = !(layer_N_per_m > 0), k = rigid ? RIGID_N_PER_MM : 1e-3 * layer_N_per_m;
    const wide = Math.max(highest(points, 0, 0.01), (rigid ? 1.2 : 1) * (most / k)), from = -0.15 * wide;
    const loop = this.cycle?.loop ?? [];
    this.touch.draw('N, by depth', 'mm', points, rigid
      ? { loop, wide, most, from, line: [[0, 0], [0, most]], ground: [[from, 0], [from, most], [most / k, most], [0, 0]] }
      : { loop, wide, most, from, line: [[0, 0], [wide, k * wide]],
          ground: [[0, 0], [wide, (1 + NOTICEABLE) * k * wide], [wide, (1 - NOTICEABLE) * k * wide]] });
  }
}
