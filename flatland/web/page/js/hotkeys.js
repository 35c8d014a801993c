import { byId, element, takesKey } from "./dom.js";
import { packColor } from "./renderer/edge_batch.js";

/** Distance by which an arrow key moves the view [CSS pixels]. */
const PAN_STEP = 48;
const ZOOM_STEP = 1.25;
const TURN_STEP = Math.PI / 24;

/**
 * @typedef {object} Hotkey
 * @property {string[]} keys  values of `KeyboardEvent.key`, lower case, after `ctrl+` or `ctrl+shift+`
 * @property {string} shown  the keys for users
 * @property {string} text
 * @property {() => void} run
 * @property {boolean} [writes]  not available if the page is read-only
 * @property {() => boolean} [isAvailable]  whether the program has what the key requires
 *
 * @typedef {object} KeyActions
 * @property {() => void} togglePause
 * @property {() => void} step
 * @property {() => void} openSpawn
 * @property {() => void} deleteSelected
 * @property {() => void} copy
 * @property {() => void} paste
 * @property {() => void} undo
 * @property {() => void} redo
 * @property {() => void} toggleFollow
 * @property {() => void} togglePlots
 * @property {() => void} showAll
 * @property {() => void} openHelp
 */

/** Keys of the page. While a robot is selected, the keys that drive it take precedence. */
export class Hotkeys {
  /**
   * @param {import("./stage.js").Stage} stage
   * @param {import("./session.js").Session} session
   * @param {import("./tools/tool_box.js").ToolBox} tools
   * @param {import("./tools/drive.js").Drive} drive
   * @param {KeyActions} actions
   */
  constructor(stage, session, tools, drive, actions) {
    this.stage = stage;
    this.session = session;
    this.tools = tools;
    this.drive = drive;
    /** Whether the centre of the view acts as the pointer. */
    this.isAiming = false;
    /** @type {(dx: number, dy: number) => () => void} */
    const pan = (dx, dy) => () => {
      stage.follow(null);
      stage.moveView((camera) => camera.pan(dx * PAN_STEP, dy * PAN_STEP));
      this.aim();
    };
    /** @type {(factor: number, turn: number) => () => void} */
    const zoom = (factor, turn) => () =>
      stage.moveView((camera) => camera.zoomAt(factor, camera.width / 2, camera.height / 2, turn));
    this.zoomIn = zoom(ZOOM_STEP, 0);
    this.zoomOut = zoom(1 / ZOOM_STEP, 0);
    /** @type {Hotkey[]} */
    this.hotkeys = [
      { keys: [" "], shown: "Space", text: "Pause or resume", run: actions.togglePause, writes: true },
      { keys: ["."], shown: ".", text: "Single step", run: actions.step, writes: true },
      { keys: ["n"], shown: "N", text: "Spawn a model", run: actions.openSpawn, writes: true },
      {
        keys: ["delete"],
        shown: "Delete",
        text: "Delete the selected model",
        run: actions.deleteSelected,
        writes: true,
      },
      { keys: ["ctrl+z"], shown: "Ctrl+Z", text: "Undo", run: actions.undo, writes: true },
      {
        keys: ["ctrl+shift+z", "ctrl+y"],
        shown: "Ctrl+Shift+Z, Ctrl+Y",
        text: "Redo",
        run: actions.redo,
        writes: true,
      },
      { keys: ["ctrl+c"], shown: "Ctrl+C", text: "Copy the selected model", run: actions.copy, writes: true },
      { keys: ["ctrl+v"], shown: "Ctrl+V", text: "Paste at the pointer", run: actions.paste, writes: true },
      { keys: ["v"], shown: "V", text: "Select and move models", run: () => tools.use("select") },
      { keys: ["h"], shown: "H", text: "Move the view only", run: () => tools.use("pan") },
      { keys: ["m"], shown: "M", text: "Measure distances", run: () => tools.use("measure") },
      {
        keys: ["o"],
        shown: "O",
        text: "Publish a goal",
        run: () => tools.use("goal"),
        writes: true,
        isAvailable: () => session.topics.entries !== null,
      },
      {
        keys: ["i"],
        shown: "I",
        text: "Publish an initial pose",
        run: () => tools.use("initial_pose"),
        writes: true,
        isAvailable: () => session.topics.entries !== null,
      },
      { keys: ["f"], shown: "F", text: "Fit the view", run: () => stage.fit() },
      { keys: ["t"], shown: "T", text: "Follow the selected model", run: actions.toggleFollow },
      { keys: ["g"], shown: "G", text: "Show all worlds", run: actions.showAll },
      { keys: ["p"], shown: "P", text: "Plots", run: actions.togglePlots },
      { keys: ["+", "="], shown: "+", text: "Zoom in", run: this.zoomIn },
      { keys: ["-", "_"], shown: "−", text: "Zoom out", run: this.zoomOut },
      { keys: ["["], shown: "[", text: "Turn the view to the left", run: zoom(1, TURN_STEP) },
      { keys: ["]"], shown: "]", text: "Turn the view to the right", run: zoom(1, -TURN_STEP) },
      { keys: ["arrowleft"], shown: "←", text: "Move the view", run: pan(1, 0) },
      { keys: ["arrowright"], shown: "→", text: "Move the view", run: pan(-1, 0) },
      { keys: ["arrowup"], shown: "↑", text: "Move the view", run: pan(0, 1) },
      { keys: ["arrowdown"], shown: "↓", text: "Move the view", run: pan(0, -1) },
      { keys: ["escape"], shown: "Esc", text: "Cancel, deselect", run: () => tools.cancel() },
      { keys: ["?"], shown: "?", text: "Show this help", run: actions.openHelp },
    ];
    document.addEventListener("keydown", (event) => this.press(event));
    stage.canvas.addEventListener("keydown", (event) => this.clickCenter(event));
    stage.canvas.addEventListener("pointermove", () => this.endAim());
  }

  /** @param {KeyboardEvent} event */
  press(event) {
    if (event.defaultPrevented || event.altKey) return;
    if (takesKey(event.target, event.key) || document.querySelector("dialog[open], :popover-open")) return;
    if (
      event.key === " " &&
      event.target instanceof Element &&
      event.target.closest("button, summary, input")
    )
      return;
    const isShortcut = event.ctrlKey || event.metaKey;
    if (!isShortcut && !event.shiftKey && this.tools.name === "select" && this.drive.press(event.code)) {
      event.preventDefault();
      return;
    }
    const prefix = isShortcut ? `ctrl+${event.shiftKey ? "shift+" : ""}` : "";
    const key = prefix + event.key.toLowerCase();
    const found = this.hotkeys.find((each) => each.keys.includes(key));
    if (!found || (found.writes && this.session.readOnly) || found.isAvailable?.() === false) return;
    // The browser copies the selected text.
    if (key === "ctrl+c" && String(window.getSelection())) return;
    event.preventDefault();
    const repeats = ["+", "−", "[", "]", ".", "←", "→", "↑", "↓"];
    if (!event.repeat || repeats.includes(found.shown)) found.run();
  }

  /**
   * Clicks at the centre of the view: the effect of Enter on the canvas.
   *
   * @param {KeyboardEvent} event
   */
  clickCenter(event) {
    if (event.key !== "Enter" || event.repeat || !this.session.world) return;
    event.preventDefault();
    const { active } = this.tools;
    const spot = this.center();
    this.isAiming = true;
    active.down(spot);
    active.up(spot, false);
    this.tools.updateHint();
    this.stage.invalidate();
  }

  center() {
    const { camera } = this.stage;
    return { px: camera.width / 2, py: camera.height / 2, x: camera.x, y: camera.y, isTouch: false };
  }

  aim() {
    this.isAiming = true;
    if (this.tools.name !== "select") this.tools.active.hover(this.center());
    this.tools.updateHint();
  }

  endAim() {
    if (!this.isAiming) return;
    this.isAiming = false;
    this.stage.invalidate();
  }

  /**
   * Draws a cross at the centre of the view while it acts as the pointer.
   *
   * @param {import("./renderer/edge_batch.js").EdgeBatch} batch
   * @param {import("./renderer/view.js").Viewport} viewport
   * @param {import("./renderer/palette.js").Palette} palette
   */
  drawAim(batch, { camera }, palette) {
    if (!this.isAiming || document.activeElement !== this.stage.canvas) return;
    const size = 10 / camera.zoom;
    const color = packColor(palette.warning);
    batch.add(camera.x - size, camera.y, camera.x + size, camera.y, color, 1.5);
    batch.add(camera.x, camera.y - size, camera.x, camera.y + size, color, 1.5);
  }

  /** Fills the help dialog. */
  createHelp() {
    const keys = element("dl");
    for (const { shown, text, writes, isAvailable } of this.hotkeys) {
      if ((writes && this.session.readOnly) || isAvailable?.() === false) continue;
      if (shown === "→" || shown === "↑" || shown === "↓") continue;
      const names = shown === "←" ? ["←", "→", "↑", "↓"] : shown.split(", ");
      keys.append(
        element("dt", {}, ...names.map((name) => element("kbd", {}, name))),
        element("dd", {}, text),
      );
    }
    const touch = section("Touch", [
      ["Tap", "Select a model"],
      ["Drag the selected model", "Move the model; the world is paused during the drag"],
      ["Drag the ring of a model", "Turn the model"],
      ["Drag elsewhere", "Move the view"],
      ["Two fingers", "Zoom, move and turn the view"],
      ["Stick", "Drive the selected robot"],
      ["Long press on a button", "Name of the button"],
    ]);
    const mouse = section("Mouse, driving", [
      ["Click", "Select a model"],
      ["Drag a model", "Move the model; the world is paused during the drag"],
      ["Drag the ring of a model", "Turn the model"],
      ["Drag elsewhere", "Move the view; also middle button, Shift"],
      ["Right drag", "Turn the view"],
      ["Wheel, pinch", "Zoom"],
      ["Right click", "Menu of a model, or of the world"],
      ["Double click", "Centre the model"],
      ["Arrows, W A S D", "Drive the selected robot; Q and E sideways"],
      ["Shift, arrows", "Move the view while a robot is selected"],
      ["Enter", "Click at the centre of the view"],
    ]);
    const rest = [element("section", {}, element("h3", {}, "Keys"), keys), mouse];
    const isTouch = window.matchMedia("(pointer: coarse)").matches;
    byId("help-content").replaceChildren(...(isTouch ? [touch, ...rest] : [...rest, touch]));
  }
}

/**
 * Returns a section of the help dialog.
 *
 * @param {string} title
 * @param {[string, string][]} entries  actions of the user, and their effects
 */
function section(title, entries) {
  const list = element("dl");
  for (const [action, effect] of entries) list.append(element("dt", {}, action), element("dd", {}, effect));
  return element("section", {}, element("h3", {}, title), list);
}
