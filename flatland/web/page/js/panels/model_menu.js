import { byId, element, icon } from "../dom.js";

/**
 * The menu of a model, opened by a right click.
 *
 * @typedef {{text: string, icon: string, run: () => void}} Item
 */
export class ModelMenu {
  constructor() {
    this.root = byId("menu");
    /** @type {HTMLElement | null} */
    this.opener = null;
    /** @type {HTMLButtonElement[]} */
    this.buttons = [];
    document.addEventListener("pointerdown", (event) => {
      if (!(event.target instanceof Node && this.root.contains(event.target))) this.close();
    });
    this.root.addEventListener("keydown", (event) => this.key(event));
    window.addEventListener("blur", () => this.close());
  }

  /**
   * @param {number} x  of the page [CSS pixels]
   * @param {number} y
   * @param {Item[]} items
   * @param {HTMLElement} opener  receives the focus when the menu closes
   */
  open(x, y, items, opener) {
    this.opener = opener;
    this.buttons = items.map((item) => {
      const attributes = { type: "button", role: "menuitem", class: "button", tabindex: -1 };
      const button = element("button", attributes, icon(item.icon), item.text);
      button.addEventListener("click", () => {
        this.close();
        item.run();
      });
      return button;
    });
    this.root.replaceChildren(...this.buttons);
    this.root.hidden = false;
    const { offsetWidth, offsetHeight } = this.root;
    this.root.style.left = `${Math.max(0, Math.min(x, window.innerWidth - offsetWidth - 4))}px`;
    this.root.style.top = `${Math.max(0, Math.min(y, window.innerHeight - offsetHeight - 4))}px`;
    this.buttons[0].focus();
  }

  close() {
    if (this.root.hidden) return;
    const hadFocus = this.root.contains(document.activeElement);
    this.root.hidden = true;
    if (hadFocus) this.opener?.focus();
  }

  /** @param {KeyboardEvent} event */
  key(event) {
    const { buttons } = this;
    const index = buttons.findIndex((button) => button.matches(":focus"));
    if (event.key === "ArrowDown") buttons[(index + 1) % buttons.length].focus();
    else if (event.key === "ArrowUp") buttons.at(index - 1)?.focus();
    else if (event.key === "Escape" || event.key === "Tab") this.close();
    else return;
    event.preventDefault();
    event.stopPropagation();
  }
}
