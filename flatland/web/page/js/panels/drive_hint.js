import { byId, setText } from "../dom.js";
import { isDrivable } from "../robots.js";
import { loadSetting, saveSetting } from "../settings.js";

const SETTING = "drive-hint";

/**
 * Shows how to drive a robot, until the user has driven one or dismisses the hint: once per browser.
 *
 * @param {import("../session.js").Session} session
 * @param {import("../tools/drive.js").Drive} drive
 */
export function createDriveHint(session, drive) {
  const root = byId("drive-hint");
  const isTouch = window.matchMedia("(pointer: coarse)").matches;
  let isDone = loadSetting(SETTING) !== null;

  const update = () => {
    const models = [...(session.world?.models.values() ?? [])];
    root.hidden = isDone || session.readOnly || !models.some(isDrivable);
    const [select, act] = isTouch
      ? ["Tap a robot, then drag the stick", "Drag the stick to drive"]
      : ["Click a robot, then W A S D", "Hold W A S D to drive"];
    setText(byId("drive-hint-text"), drive.isPossible ? `${act} ${session.selectedName}` : select);
  };
  const finish = () => {
    if (isDone) return;
    isDone = true;
    saveSetting(SETTING, "done");
    update();
  };

  byId("drive-hint-close").addEventListener("click", finish);
  drive.on("active", (active) => {
    if (active) finish();
  });
  for (const event of /** @type {const} */ (["models", "current", "hello", "selection"])) {
    session.on(event, update);
  }
  update();
}
