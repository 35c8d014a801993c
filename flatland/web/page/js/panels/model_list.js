import { byId, element, icon, setText } from "../dom.js";
import { modelColor } from "../renderer/model_colors.js";
import { createPalette, css } from "../renderer/palette.js";
import { hasShapes, isDrivable } from "../robots.js";
import { loadSetting, saveSetting } from "../settings.js";

/** Largest number of models in the list; the others are found by the filter. */
const MAX_SHOWN = 200;

/**
 * Shows the names of the models; a click selects a model.
 *
 * @param {import("../session.js").Session} session
 * @param {import("../stage.js").Stage} stage
 */
export function createModelList(session, stage) {
  const list = byId("model-list");
  const filter = byId("model-filter", HTMLInputElement);
  const shapeless = byId("toggle-shapeless", HTMLInputElement);
  shapeless.checked = loadSetting("shapeless") === "shown";
  let scheduled = false;

  /** @param {import("../world_state.js").Model} model */
  const createRow = (model) => {
    const swatch = element("span", { class: "swatch", "aria-hidden": "true" });
    swatch.style.background = css(modelColor(model, createPalette(stage.dark)));
    const isSelected = model.name === session.selectedName;
    const button = element(
      "button",
      { type: "button", "aria-pressed": String(isSelected), "data-model": model.name },
      swatch,
      element("span", { class: "name" }, model.name),
    );
    if (isDrivable(model) && !session.readOnly) {
      button.title = "Can be driven: select it, then W A S D or the stick";
      button.append(icon("drive"), element("span", { class: "visually-hidden" }, "can be driven"));
    }
    button.addEventListener("click", () => {
      session.select(model.name);
      const pose = session.world?.modelPose(model);
      if (!pose || stage.followed !== null) return;
      const [px, py] = stage.camera.toScreen(pose[0], pose[1]);
      const isVisible = px > 0 && py > 0 && px < stage.camera.width && py < stage.camera.height;
      if (!isVisible) stage.centerOn(pose[0], pose[1]);
    });
    return element("li", {}, button);
  };

  const rebuild = () => {
    scheduled = false;
    const models = [...(session.world?.models.values() ?? [])];
    const wanted = filter.value.trim().toLowerCase();
    const isListed = (/** @type {import("../world_state.js").Model} */ model) =>
      shapeless.checked || hasShapes(model) || model.name === session.selectedName;
    const found = models.filter((model) => isListed(model) && model.name.toLowerCase().includes(wanted));
    const hidden = models.filter((model) => !hasShapes(model)).length;
    byId("shapeless").hidden = hidden === 0;
    setText(byId("shapeless-text"), `Models without shapes (${hidden})`);
    const focused = document.activeElement?.getAttribute("data-model");
    list.replaceChildren(...found.slice(0, MAX_SHOWN).map(createRow));
    if (found.length > MAX_SHOWN) {
      list.append(element("li", { class: "muted" }, `and ${found.length - MAX_SHOWN} more`));
    }
    if (focused) {
      const again = [...list.querySelectorAll("button")].find((row) => row.dataset.model === focused);
      again?.focus({ preventScroll: true });
    }
    filter.hidden = models.length < 8 && wanted === "";
    setText(byId("model-count"), String(models.length));
  };
  const schedule = () => {
    if (scheduled) return;
    scheduled = true;
    window.requestAnimationFrame(rebuild);
  };

  filter.addEventListener("input", schedule);
  session.on("models", schedule);
  session.on("current", schedule);
  session.on("hello", schedule);
  shapeless.addEventListener("change", () => {
    saveSetting("shapeless", shapeless.checked ? "shown" : "hidden");
    schedule();
  });
  stage.on("theme", schedule);
  session.on("selection", () => {
    // A selected model without shapes is listed as long as it is selected.
    schedule();
    for (const row of list.querySelectorAll("button")) {
      const isSelected = row.dataset.model === session.selectedName;
      row.setAttribute("aria-pressed", String(isSelected));
      if (isSelected) row.scrollIntoView({ block: "nearest" });
    }
  });
}
