import { element } from "../dom.js";
import { bestMatches } from "../search.js";

/** Largest number of names in the list; the user finds the others by typing more. */
const MAX_SHOWN = 12;

/** A text field that completes names: a combobox with a list of the best matches. */
export class Completion {
  /**
   * @param {HTMLInputElement} field
   * @param {HTMLElement} list  element of the matches
   * @param {(name: string) => void} onPick  called with the name that the user picks
   */
  constructor(field, list, onPick) {
    this.field = field;
    this.list = list;
    this.onPick = onPick;
    /** All names that can be picked.
     * @type {string[]} */
    this.names = [];
    /** @type {string[]} */
    this.matches = [];
    this.active = -1;
    field.addEventListener("focus", () => this.open());
    field.addEventListener("input", () => this.open());
    field.addEventListener("blur", () => this.close());
    field.addEventListener("keydown", (event) => this.press(event));
    // The field keeps the focus, without which the list would close before the click.
    list.addEventListener("pointerdown", (event) => event.preventDefault());
    this.close();
  }

  /** @param {string[]} names */
  setNames(names) {
    this.names = names;
    if (document.activeElement === this.field) this.open();
  }

  open() {
    const { field, list, names } = this;
    this.matches = bestMatches(names, field.value, MAX_SHOWN);
    this.active = field.value.trim() && this.matches.length > 0 ? 0 : -1;
    const rows = this.matches.map((name, i) => {
      const row = element("li", { id: `${list.id}-${i}`, role: "option", "data-name": name }, name);
      row.addEventListener("click", () => this.pick(name));
      return row;
    });
    list.replaceChildren(...rows);
    list.hidden = rows.length === 0;
    field.setAttribute("aria-expanded", String(!list.hidden));
    this.mark();
  }

  close() {
    this.matches = [];
    this.active = -1;
    this.list.hidden = true;
    this.field.setAttribute("aria-expanded", "false");
    this.field.removeAttribute("aria-activedescendant");
  }

  /** Marks the active row, which Enter picks. */
  mark() {
    const { active, field, list } = this;
    [...list.children].forEach((row, i) => {
      row.setAttribute("aria-selected", String(i === active));
    });
    const row = list.children[active];
    if (row) {
      field.setAttribute("aria-activedescendant", row.id);
      row.scrollIntoView({ block: "nearest" });
    } else field.removeAttribute("aria-activedescendant");
  }

  /** @param {string} name */
  pick(name) {
    this.field.value = "";
    this.close();
    this.onPick(name);
  }

  /** @param {KeyboardEvent} event */
  press(event) {
    const count = this.matches.length;
    if (event.key === "Enter") {
      const name = this.matches[this.active];
      if (name !== undefined) this.pick(name);
    } else if (event.key === "Escape" && !this.list.hidden) this.close();
    else if (event.key === "ArrowDown" || event.key === "ArrowUp") {
      if (this.list.hidden) this.open();
      else if (count > 0) {
        const step = event.key === "ArrowDown" ? 1 : -1;
        this.active = this.active < 0 && step < 0 ? count - 1 : (this.active + step + count) % count;
        this.mark();
      }
    } else return;
    event.preventDefault();
  }
}
