// Puts the page together: passes the session's messages to the picture, the plots and the panel.
import { Connection } from './connection.js';
import { Control } from './control.js';
import { Felt } from './felt.js';
import { Keys } from './keys.js';
import { Microscope } from './microscope.js';
import { Panel } from './panel.js';
import { Player } from './player.js';
import { Plots } from './plots.js';
import { Spectrum } from './spectrum.js';
import { toggleTheme } from './theme.js';
import { World } from './world.js';

const element = (id) => document.getElementById(id);

const world = new World(element('picture'), element('labels'));
const plots = new Plots(element('plots'));
const panel = new Panel();
const microscope = new Microscope(element('microscope'));
const keys = new Keys();
let stage = null, built = false, newest = null, control = null, player = null, felt = null, spectrum = null;

const connection = new Connection({
  stage: (value) => {
    stage = value;
    built = false;
    panel.introduce(stage);
    plots.introduce(stage);
    felt = new Felt(element('felt'), stage);
    spectrum = new Spectrum(element('vibration'), stage);
    document.body.dataset.mode = stage.mode;
    const chip = element('mode-chip');
    chip.hidden = false;
    chip.textContent = { live: '● live', arm: '● simulated arm', record: '▮ record' }[stage.mode];
    if (stage.control) {
      control = new Control(stage, connection);
      keys.add('h', 'hold: stop the arm, its drives enabled', () => control.ask('hold'));
    }
    if (stage.record) {
      chip.textContent = `▮ record ${stage.record.name}`;
      player = new Player(stage, connection, plots, keys);
    }
  },
  status: (status) => {
    panel.status(status);
    if (status.ended) control?.end();
  },
  settings: (settings) => control?.follow(settings),
  history: (rows) => (player ? player.takeHistory(rows) : rows.forEach((row) => plots.add(row))),
  frames: (frames) => player?.showFrames(frames),
  spectrum: (bands) => spectrum?.show(bands),
  moment: (moment) => {
    // If a moment is replaced before it was drawn, its flags go to the next moment.
    if (newest && !player) moment.flags_since = (moment.flags_since | newest.flags_since) >>> 0;
    newest = moment;
    if (player) player.show(moment); else plots.add(moment);
  },
  lost: () => {
    panel.lost();
    control?.end();
  },
});

// Draws the newest moment once per frame of the browser, however many moments have arrived.
function frame(now) {
  requestAnimationFrame(frame);
  if (newest && stage) {
    if (!built) {
      built = true;
      world.build(stage, newest);
      if (player) world.margins.setWay(player.overview); else for (const row of plots.rows) world.margins.show(row);
    }
    world.show(newest);
    panel.show(newest);
    microscope.show(newest);
    control?.show(newest);
    newest = null;
    performance.mark('first-moment');
  }
  player?.tick(now);
  panel.tick(now, Boolean(player) && !player.playing);
  world.tell(panel.told);
  world.draw();
  plots.draw(now);
  felt?.draw(now, plots.rows);
}
requestAnimationFrame(frame);

function setFollow(on) {
  world.follow = on;
  element('follow').setAttribute('aria-pressed', String(on));
}

function toggleMicroscope() {
  element('microscope-button').setAttribute('aria-pressed', String(microscope.toggle()));
}

for (const button of document.querySelectorAll('[data-view]')) {
  button.addEventListener('click', () => world.look(button.dataset.view));
}
element('follow').addEventListener('click', () => setFollow(!world.follow));
element('microscope-button').addEventListener('click', toggleMicroscope);
element('theme').addEventListener('click', toggleTheme);
for (const [key, view] of [['0', 'overview'], ['1', 'top'], ['2', 'front'], ['3', 'side'], ['4', 'tool']]) {
  keys.add(key, `look: ${view}`, () => world.look(view));
}
keys.add('f', 'follow the tool', () => setFollow(!world.follow));
keys.add('m', 'the touch, enlarged', toggleMicroscope);
keys.add('d', 'dark or light', toggleTheme);
const TURN = Math.PI / 36, SHIFT = 0.04, CLOSER = 0.9;  // steps for each press of a key
for (const [key, aside, up] of [['ArrowLeft', -1, 0], ['ArrowRight', 1, 0], ['ArrowUp', 0, 1], ['ArrowDown', 0, -1]]) {
  const move = (event) => (event.shiftKey ? world.shift(SHIFT * aside, SHIFT * up) : world.turn(TURN * aside, TURN * up));
  keys.add(key, '', move);
  keys.addFor(element('picture'), key, move);  // for records, whose player uses the keys ← and → otherwise
}
keys.explain('orbit; with Shift: move (in a record: once the picture was clicked)', '← → ↑ ↓');
keys.add('+', 'closer', () => world.zoom(CLOSER));
keys.add('=', '', () => world.zoom(CLOSER));
keys.add('-', 'further away', () => world.zoom(1 / CLOSER), '−');

// For tests, and for users who open the browser's console.
globalThis.proxarm = { world, plots, panel, microscope, get felt() { return felt; }, get spectrum() { return spectrum; }, connection, get control() { return control; }, get stage() { return stage; }, get player() { return player; } };
