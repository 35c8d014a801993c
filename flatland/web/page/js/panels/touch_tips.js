import { byId, setText } from "../dom.js";

/** Duration of a touch that shows the title of an element [ms]. */
const LONG_PRESS = 500;
/** Time for which a title remains after the touch [ms]. */
const REMAINS = 1500;
/** Movement that ends a long press [CSS pixels]. */
const DISTANCE = 10;
const MARGIN = 6;

/** Shows the titles of buttons, which appear below a mouse, on a long press of a finger as well. */
export function createTouchTips() {
  const tip = byId("tip");
  /** @type {{x: number, y: number, timer: number} | null} */
  let press = null;
  let isShown = false;
  /** @type {number | undefined} */
  let hiding;

  /** @param {HTMLElement} target */
  const show = (target) => {
    isShown = true;
    window.clearTimeout(hiding);
    setText(tip, target.title);
    tip.hidden = false;
    const { left, top, width, height } = target.getBoundingClientRect();
    const x = left + width / 2 - tip.offsetWidth / 2;
    const above = top - tip.offsetHeight - MARGIN;
    tip.style.left = `${Math.max(MARGIN, Math.min(x, window.innerWidth - tip.offsetWidth - MARGIN))}px`;
    tip.style.top = `${above < MARGIN ? top + height + MARGIN : above}px`;
  };
  const end = () => {
    if (!press) return;
    window.clearTimeout(press.timer);
    press = null;
    if (isShown) {
      hiding = window.setTimeout(() => {
        tip.hidden = true;
        // Not all browsers click at the end of a long press.
        isShown = false;
      }, REMAINS);
    }
  };

  document.addEventListener("pointerdown", (event) => {
    end();
    isShown = false;
    const target = event.target instanceof Element ? event.target.closest("[title]") : null;
    if (event.pointerType !== "touch" || !(target instanceof HTMLElement)) return;
    const timer = window.setTimeout(() => show(target), LONG_PRESS);
    press = { x: event.clientX, y: event.clientY, timer };
  });
  document.addEventListener("pointermove", (event) => {
    if (press && Math.hypot(event.clientX - press.x, event.clientY - press.y) > DISTANCE) end();
  });
  document.addEventListener("pointerup", end);
  document.addEventListener("pointercancel", end);
  // The end of a long press does not click; no menu of the browser opens meanwhile.
  document.addEventListener(
    "click",
    (event) => {
      if (!isShown) return;
      isShown = false;
      event.preventDefault();
      event.stopPropagation();
    },
    { capture: true },
  );
  document.addEventListener("contextmenu", (event) => {
    if (press) event.preventDefault();
  });
}
