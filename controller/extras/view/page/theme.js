// Dark and light: as the system is set, until the user chooses.

const listeners = [];
let chosen = localStorage.getItem('proxarm-theme');
const system = matchMedia('(prefers-color-scheme: dark)');

export function isDark() {
  return chosen ? chosen === 'dark' : system.matches;
}

export function toggleTheme() {
  chosen = isDark() ? 'light' : 'dark';
  localStorage.setItem('proxarm-theme', chosen);
  apply();
}

export function onTheme(listener) {
  listeners.push(listener);
  listener();
}

// Returns a colour of the style sheet: colour('--proxy'). Colours are cached, since asking for one makes the browser
// lay out the page.
const colours = new Map();
export function colour(name) {
  if (!colours.has(name)) {
    colours.set(name, getComputedStyle(document.documentElement).getPropertyValue(name).trim());
  }
  return colours.get(name);
}

// Returns the dash of a line style, in pixels: dash('proxy').
export function dash(line) {
  const lengths = colour(`--dash-${line}`).split(' ').map(Number);
  return lengths[0] > 0 ? lengths : [];
}

function apply() {
  document.documentElement.dataset.theme = isDark() ? 'dark' : 'light';
  colours.clear();
  document.getElementById('theme').textContent = isDark() ? 'light' : 'dark';
  for (const listener of listeners) listener();
}

system.addEventListener('change', apply);
apply();
