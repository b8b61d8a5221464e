// Puts the page together: what comes from the session goes to the picture, the plots and the panel.
import { Connection } from './connection.js';
import { Control } from './control.js';
import { Keys } from './keys.js';
import { Panel } from './panel.js';
import { Player } from './player.js';
import { Plots } from './plots.js';
import { toggleTheme } from './theme.js';
import { World } from './world.js';

const element = (id) => document.getElementById(id);

const world = new World(element('picture'), element('labels'));
const plots = new Plots(element('plots'));
const panel = new Panel();
const keys = new Keys();
let stage = null, built = false, newest = null, control = null, player = null;

const connection = new Connection({
  stage: (value) => {
    stage = value;
    built = false;
    panel.introduce(stage);
    plots.introduce(stage);
    document.body.dataset.mode = stage.mode;
    const chip = element('mode-chip');
    chip.hidden = false;
    chip.textContent = { live: '● live', arm: '● simulated arm', record: '▮ record' }[stage.mode];
    if (stage.control) control = new Control(stage, connection);
    if (stage.record) {
      chip.textContent = `▮ record ${stage.record.name}`;
      player = new Player(stage, connection, plots, keys);
    }
  },
  status: (status) => panel.status(status),
  settings: (settings) => control?.follow(settings),
  history: (rows) => (player ? player.takeHistory(rows) : rows.forEach((row) => plots.add(row))),
  frames: (frames) => player?.showFrames(frames),
  moment: (moment) => {
    newest = moment;
    if (player) player.show(moment); else plots.add(moment);
  },
  lost: () => panel.lost(),
});

// The newest moment is drawn once per frame of the browser, however many have come.
function frame(now) {
  requestAnimationFrame(frame);
  if (newest && stage) {
    if (!built) {
      built = true;
      world.build(stage, newest);
    }
    world.show(newest);
    panel.show(newest);
    newest = null;
    performance.mark('first-moment');
  }
  player?.tick(now);
  world.draw();
  plots.draw(now);
}
requestAnimationFrame(frame);

function setFollow(on) {
  world.follow = on;
  element('follow').setAttribute('aria-pressed', String(on));
}

for (const button of document.querySelectorAll('[data-view]')) {
  button.addEventListener('click', () => world.look(button.dataset.view));
}
element('follow').addEventListener('click', () => setFollow(!world.follow));
element('theme').addEventListener('click', toggleTheme);
for (const [key, view] of [['0', 'overview'], ['1', 'top'], ['2', 'front'], ['3', 'side'], ['4', 'tool']]) {
  keys.add(key, `look: ${view}`, () => world.look(view));
}
keys.add('f', 'follow the tool', () => setFollow(!world.follow));
keys.add('d', 'dark or light', toggleTheme);
keys.add('h', '', () => control?.ask('hold'));

// For tests and for the curious.
globalThis.proxarm = { world, plots, panel, connection, get stage() { return stage; }, get player() { return player; } };
