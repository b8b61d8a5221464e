// What keys do, and the dialog that says so.

export class Keys {
  constructor() {
    this.actions = new Map();
    this.dialog = document.getElementById('help');
    addEventListener('keydown', (event) => {
      if (event.ctrlKey || event.altKey || event.metaKey || /^(INPUT|SELECT|TEXTAREA)$/.test(event.target.tagName)) return;
      const action = this.actions.get(event.key);
      if (!action) return;
      event.preventDefault();
      action(event);
    });
    document.getElementById('help-button').addEventListener('click', () => this.dialog.showModal());
    this.add('?', 'this help', () => this.dialog.showModal());
  }

  add(key, text, action, shown = key) {
    this.actions.set(key, action);
    if (!text) return;
    const term = document.createElement('dt'), what = document.createElement('dd');
    term.textContent = shown;
    what.textContent = text;
    document.getElementById('keys').append(term, what);
  }
}
