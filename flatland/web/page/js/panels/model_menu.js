import { byId, element, icon } from "../dom.js";

/**
 * The menu of a model, opened by the right button of the mouse.
 *
 * @typedef {{text: string, icon: string, run: () => void}} Item
 */
export class ModelMenu {
  constructor() {
    this.root = byId("menu");
    /** @type {HTMLElement | null} */
    this.opener = null;
    document.addEventListener("pointerdown", (event) => {
      if (!this.root.hidden && !this.root.contains(/** @type {Node} */ (event.target))) this.close();
    });
    this.root.addEventListener("keydown", (event) => this.key(event));
    window.addEventListener("blur", () => this.close());
  }

  /**
   * @param {number} x  of the page [CSS pixels]
   * @param {number} y
   * @param {Item[]} items
   * @param {HTMLElement} opener  gets the focus back
   */
  open(x, y, items, opener) {
    this.opener = opener;
    this.root.replaceChildren(
      ...items.map((item) => {
        const attributes = { type: "button", role: "menuitem", class: "button", tabindex: -1 };
        const button = element("button", attributes, icon(item.icon), item.text);
        button.addEventListener("click", () => {
          this.close();
          item.run();
        });
        return button;
      }),
    );
    this.root.hidden = false;
    const { offsetWidth, offsetHeight } = this.root;
    this.root.style.left = `${Math.max(0, Math.min(x, window.innerWidth - offsetWidth - 4))}px`;
    this.root.style.top = `${Math.max(0, Math.min(y, window.innerHeight - offsetHeight - 4))}px`;
    /** @type {HTMLElement} */ (this.root.firstElementChild).focus();
  }

  close() {
    if (this.root.hidden) return;
    const hadFocus = this.root.contains(document.activeElement);
    this.root.hidden = true;
    if (hadFocus) this.opener?.focus();
  }

  /** @param {KeyboardEvent} event */
  key(event) {
    const items = /** @type {HTMLElement[]} */ ([...this.root.children]);
    const index = items.indexOf(/** @type {HTMLElement} */ (document.activeElement));
    if (event.key === "ArrowDown") items[(index + 1) % items.length].focus();
    else if (event.key === "ArrowUp") items[(index + items.length - 1) % items.length].focus();
    else if (event.key === "Escape" || event.key === "Tab") this.close();
    else return;
    event.preventDefault();
    event.stopPropagation();
  }
}
