// What keys do, and the dialog that says so.

// Where somebody writes or chooses, all keys go there; a button with the focus keeps those that press it and that move.
function isOwnKey({ key, target }) {
  return /^(INPUT|SELECT|TEXTAREA)$/.test(target.tagName) ||
    (target.tagName === 'BUTTON' && /^( |Enter|Arrow.*|Home|End)$/.test(key));
}

export class Keys {
  constructor() {
    this.actions = new Map();
    this.actionsOf = new Map();  // elements, while they have the focus
    this.dialog = document.getElementById('help');
    addEventListener('keydown', (event) => {
      if (event.ctrlKey || event.altKey || event.metaKey || this.dialog.open || isOwnKey(event)) return;
      const action = this.actionsOf.get(event.target)?.get(event.key) ?? this.actions.get(event.key);
      if (!action) return;
      event.preventDefault();
      action(event);
    });
    // A button that was clicked has done its work, and the keys are the page's again.
    addEventListener('click', (event) => { if (event.detail > 0) event.target.closest?.('button')?.blur(); });
    document.getElementById('help-button').addEventListener('click', () => this.dialog.showModal());
    this.add('?', 'this help', () => this.dialog.showModal());
  }

  add(key, text, action, shown = key) {
    this.actions.set(key, action);
    this.explain(text, shown);
  }

  // Only while this element has the focus, and before all others.
  addFor(element, key, action) {
    if (!this.actionsOf.has(element)) this.actionsOf.set(element, new Map());
    this.actionsOf.get(element).set(key, action);
  }

  explain(text, shown) {
    if (!text) return;
    const term = document.createElement('dt'), what = document.createElement('dd');
    term.textContent = shown;
    what.textContent = text;
    document.getElementById('keys').append(term, what);
  }
}
