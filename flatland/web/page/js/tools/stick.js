import { byId, firstChild } from "../dom.js";
import { fixed } from "../format.js";
import { loadSetting, saveSetting } from "../settings.js";

/**
 * Connects the stick on the screen with the drive, and shows the stick while a robot is selected.
 *
 * @param {import("../session.js").Session} session
 * @param {import("./drive.js").Drive} drive
 */
export function createStick(session, drive) {
  const box = byId("drive");
  const stick = byId("stick");
  const knob = firstChild(stick);
  /** @type {number | null} */
  let pointer = null;

  const update = () => {
    box.hidden = !drive.isPossible;
  };
  /**
   * @param {number} x  to the right, in [-1, 1]
   * @param {number} y  down, in [-1, 1]
   */
  const place = (x, y) => {
    knob.style.transform = `translate(${x * 34}px, ${y * 34}px)`;
  };
  /** @param {PointerEvent} event */
  const deflect = (event) => {
    const { left, top, width, height } = stick.getBoundingClientRect();
    let x = (2 * (event.clientX - left)) / width - 1;
    let y = (2 * (event.clientY - top)) / height - 1;
    const length = Math.max(1, Math.hypot(x, y) * 1.25);
    x = (x * 1.25) / length;
    y = (y * 1.25) / length;
    place(x, y);
    drive.deflect(-y || 0, -x || 0);
  };
  /** @param {PointerEvent} event */
  const release = (event) => {
    if (event.pointerId !== pointer) return;
    pointer = null;
    drive.deflect(0, 0);
  };

  stick.addEventListener("pointerdown", (event) => {
    if (pointer !== null) return;
    event.preventDefault();
    pointer = event.pointerId;
    stick.setPointerCapture(event.pointerId);
    deflect(event);
  });
  stick.addEventListener("pointermove", (event) => {
    if (event.pointerId === pointer) deflect(event);
  });
  for (const name of /** @type {const} */ (["pointerup", "pointercancel", "lostpointercapture"])) {
    stick.addEventListener(name, release);
  }
  // A finger that rests on the stick opens no menu, which would end the drive.
  stick.addEventListener("contextmenu", (event) => event.preventDefault());
  drive.on("active", (active) => {
    if (active) return;
    pointer = null;
    place(0, 0);
  });

  for (const [id, key, unit] of /** @type {const} */ ([
    ["drive-speed", "speed", "m/s"],
    ["drive-turn", "turn", "rad/s"],
  ])) {
    const slider = byId(id, HTMLInputElement);
    const show = () => {
      drive.limits[key] = Number(slider.value);
      byId(`${id}-text`).textContent = `${fixed(drive.limits[key], 1)} ${unit}`;
    };
    slider.addEventListener("input", show);
    show();
  }
  const toggle = byId("drive-toggle");
  /** @param {boolean} open */
  const setOpen = (open) => {
    box.dataset.open = String(open);
    toggle.setAttribute("aria-expanded", String(open));
    toggle.title = open ? "Hide the drive pad" : "Show the drive pad";
  };
  toggle.addEventListener("click", () => {
    const open = box.dataset.open !== "true";
    setOpen(open);
    saveSetting("drive-pad", open ? "open" : "closed");
  });
  setOpen(loadSetting("drive-pad") !== "closed");
  session.on("selection", update);
  session.on("models", update);
  session.on("hello", update);
  update();
}
