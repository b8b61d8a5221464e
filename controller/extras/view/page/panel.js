// Shows what the session is doing, in words and figures.
import { vector } from './connection.js';
import { addMargin, marginAt, overSmallest, setMargins } from './margins.js';

const MOMENTARY_MS = 700;  // for how long a flag stays visible in a running session, so that it can be read
const JUMP_S = 0.3;  // a longer time between two moments means a jump in a record

const BETWEEN_FIGURES_MS = 100;

const element = (id) => document.getElementById(id);

// Returns a force as text, for the panel and for the labels in the picture.
export const newtons = (force_N) => `${force_N.toFixed(2)} N`;

function length(m) {
  if (!Number.isFinite(m)) return '—';
  if (Math.abs(m) < 5e-8) return '0';
  const size = Math.abs(m);
  if (size >= 0.1) return `${m.toFixed(3)} m`;
  if (size >= 1e-3) return `${(1e3 * m).toFixed(1)} mm`;
  return `${(1e6 * m).toFixed(1)} µm`.replace('-', '−');
}

const newtonMetres = (moment, name) => `${Math.hypot(...vector(moment, name)).toFixed(3)} Nm`;
const turns = (moment) => moment.inertia_kg_m2 > 0;
const feelsTorque = (moment, stage) => turns(moment) || stage.tool.parts.length > 0;

// Figures: label, text, and for some figures whether they are shown.
const SESSION_FIGURES = [
  ['hand’s force', (m) => newtons(m.hand_N)],
  ['hand’s torque', (m) => newtonMetres(m, 'torque'), feelsTorque],
  ['force of contact', (m) => (m.contact ? newtons(m.contact_N) : '—')],
  ['torque of contact', (m) => (m.contact ? newtonMetres(m, 'contact_torque') : '—'), feelsTorque],
  ['last impact', (m) => (m.blow_Ns > 0 ? `${m.blow_Ns.toPrecision(3)} Ns` : '—'), (m) => Number.isFinite(m.blow_Ns)],
  ['touches', (m, stage) => (m.contact ? name(stage, m) : 'nothing')],
  ['friction μ', (m) => (m.contact ? m.friction.toFixed(3) : '—')],
  ['proxy to surface', (m) => length(m.proxy_clearance_m)],
  ['tool to surface', (m) => length(m.tool_clearance_m)],
  ['tool to proxy', (m) => length(Math.hypot(m.tool_x - m.proxy_x, m.tool_y - m.proxy_y, m.tool_z - m.proxy_z))],
  ['mass felt, wanted', (m) => (m.mass_kg > 0 ? `${m.mass_kg.toFixed(2)} kg` : '—')],
  ['inertia felt', (m) => `${m.inertia_kg_m2.toPrecision(3)} kg m²`, turns],
  ['smallest stable', (m) => overSmallest(marginAt(m.time_s)), (m) => Boolean(marginAt(m.time_s)) && m.mass_kg > 0],
  ['damping', (m) => `${m.damping_Ns_per_m.toFixed(1)} Ns/m`],
  ['timestep', (m) => `${(1e3 * m.period_s).toFixed(2)} ms`],
];

// Figures for the simulated arm alone.
const ARM_FIGURES = [
  ['hand’s force', (m) => newtons(m.hand_N)],
  ['load on the sensor', (m) => newtons(m.sensor_N)],
  ['tool, x', (m) => `${m.tool_x.toFixed(4)} m`],
  ['tool, y', (m) => `${m.tool_y.toFixed(4)} m`],
  ['tool, z', (m) => `${m.tool_z.toFixed(4)} m`],
];

// Returns the names of all touched objects, each once. The guide's index follows the scene's objects.
function name(stage, moment) {
  const { objects, guide } = stage.scene;
  const names = moment.touches.map(({ object: index }) =>
    objects[index]?.name ?? (guide && index === objects.length ? 'guide' : 'an object'));
  return [...new Set(names)].join(', ');
}

// Returns notes on what can't be drawn because it is everywhere in the scene.
function everywhere(scene) {
  const notes = scene.media.filter((medium) => !medium.within).map((medium) => {
    const parts = [medium.damping ? `damping of ${medium.damping} Ns/m` : '',
      medium.force ? `dry friction of ${medium.force} N` : ''].filter(Boolean);
    return `everywhere: ${parts.join(' and ')}`;
  });
  if (scene.coulomb_force !== null) notes.push(`everywhere: dry friction of ${scene.coulomb_force} N`);
  return notes;
}

export class Panel {
  constructor() {
    this.heldSince = new Map();
    this.written = 0;
  }

  introduce(stage) {
    this.stage = stage;
    setMargins(stage.record?.margins ?? []);
    this.figures = stage.mode === 'arm' ? ARM_FIGURES : SESSION_FIGURES;
    element('figures').replaceChildren();
    this.cells = this.figures.map(([label]) => {
      const term = document.createElement('dt'), value = document.createElement('dd');
      term.textContent = label;
      element('figures').append(term, value);
      return { term, value };
    });
    element('scene-name').textContent = stage.scene.name;
    element('cell-name').textContent = `· ${stage.cell}`;
    document.title = `proxarm: ${stage.scene.name}`;
    element('notes').replaceChildren(...[...everywhere(stage.scene), ...stage.notes].map((note) => {
      const item = document.createElement('li');
      item.textContent = note;
      return item;
    }));
  }

  status(status) {
    if (status.margin) addMargin(status.margin);
    element('fault').hidden = !status.fault;
    element('fault').textContent = status.fault;
    element('phase-chip').dataset.fault = String(Boolean(status.fault));
    const how = status.exit_status === undefined ? '' : ` (exit status ${status.exit_status})`;
    element('ended').hidden = !status.ended;
    element('ended').textContent = status.ended + how;
    if (status.ended) this.end();
  }

  // Marks the session as over. The shown figures stay those of the last cycle.
  end() {
    this.over = true;
    element('mode-chip').textContent = '○ over';
  }

  lost() {
    element('ended').hidden = false;
    element('ended').textContent = 'The connection is gone: the session’s program has ended.';
    this.end();
  }

  show(moment) {
    const { words } = this.stage;
    const since_s = this.moment ? moment.time_s - this.moment.time_s : 0;
    if (since_s < 0 || since_s > JUMP_S) this.heldSince.clear();
    this.moment = moment;
    this.newFlags = this.newFigures = true;
    const phase = words.phases[moment.phase], contact = words.contacts[moment.contact];
    element('phase-chip').textContent = phase.name;
    element('phase-chip').dataset.phase = phase.name;
    element('phase-words').textContent = phase.words;
    element('contact-chip').textContent = { free: 'free', stick: '■ sticks', slip: '▶ slips' }[contact];
    element('contact-chip').dataset.contact = contact;
    element('clock').textContent = `${moment.time_s.toFixed(2)} s`;
  }

  // Returns the moment from which the shown figures come.
  get told() {
    return this.toldMoment;
  }

  // Called once per frame of the browser. `ofRecord`: the moment is one cycle of a paused record. Such a moment, and
  // the last moment of a session, is shown as it was, for as long as it is visible.
  tick(now, ofRecord) {
    if (!this.moment) return;
    const still = ofRecord || this.over;
    this.showFlags(now, still);
    // Figures that change faster than this can't be read.
    if (!this.newFigures || (!still && now - this.written < BETWEEN_FIGURES_MS)) return;
    this.newFigures = false;
    this.written = now;
    this.toldMoment = this.moment;
    this.figures.forEach(([, text, there], i) => {
      const { term, value } = this.cells[i];
      term.hidden = value.hidden = Boolean(there) && !there(this.moment, this.stage);
      value.textContent = value.hidden ? '' : text(this.moment, this.stage);
      value.classList.toggle('bad', value.textContent.startsWith('!'));
    });
  }

  showFlags(now, still) {
    const { flags } = this.stage.words, set = still ? this.moment.flags : this.moment.flags_since;
    const acts = (flag) => Math.floor(set / flag.bit) % 2 === 1;
    if (still) this.heldSince.clear();
    if (!still && this.newFlags) for (const flag of flags.filter(acts)) this.heldSince.set(flag.bit, now);
    this.newFlags = false;
    const told = flags.filter((flag) => acts(flag) || now - (this.heldSince.get(flag.bit) ?? -1e9) < MOMENTARY_MS);
    const key = told.map((flag) => flag.bit).join();
    if (key === this.toldKey) return;
    this.toldKey = key;
    element('held-back').replaceChildren(...told.map((flag) => {
      const item = document.createElement('li');
      item.textContent = flag.words;
      item.className = flag.holds_back ? '' : 'note';
      return item;
    }));
  }
}
