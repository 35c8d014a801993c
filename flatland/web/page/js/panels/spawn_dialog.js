import { byId, context2d, element, setText } from "../dom.js";
import { transformPoint } from "../geometry.js";
import { css } from "../renderer/palette.js";
import { errorText } from "../session.js";
import { shapePoints } from "../shapes.js";
import { spawnModel } from "../tools/spawn_tool.js";
import { parseNumber } from "./inspector.js";

/** @typedef {import("../protocol.js").PreviewBody} PreviewBody */

/** The dialog that selects a model file and starts the placement of the model. */
export class SpawnDialog {
  /**
   * @param {import("../session.js").Session} session
   * @param {import("../tools/tool_box.js").ToolBox} tools
   * @param {import("../tools/spawn_tool.js").SpawnTool} tool
   */
  constructor(session, tools, tool) {
    this.session = session;
    this.tools = tools;
    this.tool = tool;
    this.dialog = byId("spawn-dialog", HTMLDialogElement);
    this.file = byId("spawn-file", HTMLSelectElement);
    this.path = byId("spawn-path", HTMLInputElement);
    this.name = byId("spawn-name", HTMLInputElement);
    this.number = byId("spawn-number", HTMLInputElement);
    this.namespace = byId("spawn-namespace", HTMLInputElement);
    this.byNumbers = byId("spawn-by-numbers", HTMLInputElement);
    /** @type {PreviewBody[] | null} */
    this.bodies = null;
    /** @type {Promise<void>} */
    this.preview = Promise.resolve();
    byId("spawn").addEventListener("click", () => this.open());
    byId("spawn-cancel").addEventListener("click", () => this.dialog.close());
    this.file.addEventListener("change", () => this.selectFile());
    this.path.addEventListener("change", () => this.selectFile());
    this.path.addEventListener("keydown", (event) => {
      if (event.key !== "Enter") return;
      event.preventDefault(); // The model is placed first, with its outline.
      this.selectFile();
    });
    for (const id of ["spawn-by-pointer", "spawn-by-numbers"]) {
      byId(id).addEventListener("change", () => this.updatePlace());
    }
    this.dialog.querySelector("form")?.addEventListener("submit", (event) => {
      event.preventDefault();
      this.submit();
    });
    tool.onDone = () => tools.use("select");
  }

  async open() {
    if (this.session.readOnly || !this.session.world || this.dialog.open) return;
    const reply = await this.session.attempt("files", {});
    if (!reply) return;
    const before = this.file.selectedOptions[0]?.value;
    this.file.replaceChildren(
      ...reply.result.map(({ label, path }) => element("option", { value: path }, label)),
      element("option", { value: "" }, "Other file…"),
    );
    if ([...this.file.options].some((option) => option.value === before)) this.file.value = before;
    this.setError("");
    this.updatePlace();
    this.dialog.showModal();
    this.selectFile();
  }

  updatePlace() {
    byId("spawn-pose").hidden = !this.byNumbers.checked;
    setText(byId("spawn-ok"), this.byNumbers.checked ? "Spawn" : "Place");
  }

  /** Returns the selected or typed path of the model file. */
  selectedPath() {
    return this.file.value || this.path.value.trim();
  }

  /** Proposes a name and shows the outline of the selected file. */
  selectFile() {
    const path = this.selectedPath();
    byId("spawn-path-field").hidden = this.file.value !== "";
    const base = path.split("/").at(-1) ?? "";
    const stem = base.replace(/(\.model)?\.(ya?ml|lua)$/i, "");
    this.name.value = stem.replace(/[^A-Za-z0-9_]/g, "_").replace(/^(?![A-Za-z])/, "model_");
    this.bodies = null;
    this.setError("");
    this.drawPreview([]);
    this.preview = path ? this.showOutline(path) : Promise.resolve();
  }

  /** @param {string} path */
  async showOutline(path) {
    try {
      const { bodies } = await this.session.request("preview", { file: path });
      if (this.selectedPath() !== path) return;
      this.bodies = bodies;
      this.drawPreview(bodies);
    } catch (error) {
      if (this.selectedPath() === path) this.setError(errorText(error));
    }
  }

  /** Returns the name of the next model, with a number if the name is in use. */
  nextName() {
    const name = this.name.value.trim();
    const { world } = this.session;
    if (!this.number.checked || !world?.modelByName(name)) return name;
    for (let i = 1; ; i++) if (!world.modelByName(`${name}${i}`)) return `${name}${i}`;
  }

  async submit() {
    const file = this.selectedPath();
    if (!file) {
      this.path.focus();
      this.setError("The path of a model file is missing");
      return;
    }
    await this.preview;
    if (!this.dialog.open || !this.bodies) return; // The dialog shows an error.
    const namespace = this.namespace.value.trim();
    if (this.byNumbers.checked) {
      const pose = ["spawn-x", "spawn-y", "spawn-theta"].map((id) =>
        parseNumber(byId(id, HTMLInputElement).value),
      );
      if (pose.some(Number.isNaN)) {
        this.setError("The coordinates must be numbers");
        return;
      }
      this.dialog.close();
      spawnModel(this.session, file, this.nextName(), namespace, [pose[0], pose[1], pose[2]]);
      return;
    }
    this.dialog.close();
    this.tools.use("spawn");
    this.tool.begin({ file, namespace, nextName: () => this.nextName(), bodies: this.bodies });
    this.tools.updateHint();
    byId("canvas").focus();
  }

  /** @param {string} text */
  setError(text) {
    setText(byId("spawn-error"), text);
  }

  /** @param {PreviewBody[]} bodies */
  drawPreview(bodies) {
    const canvas = byId("spawn-preview", HTMLCanvasElement);
    const context = context2d(canvas);
    // Also clears the canvas.
    const ratio = window.devicePixelRatio;
    canvas.width = Math.round(canvas.clientWidth * ratio);
    canvas.height = Math.round(canvas.clientHeight * ratio);
    canvas.setAttribute("aria-label", "Outline of the model");
    const polygons = bodies.flatMap(({ pose, color, shapes }) =>
      shapes.map((shape) => ({
        color,
        isOpen: shape.kind === "edges",
        points: shapePoints(shape).map(([x, y]) => transformPoint(pose, x, y)),
      })),
    );
    const all = polygons.flatMap(({ points }) => points);
    if (all.length === 0) return;
    const [xs, ys] = [all.map(([x]) => x), all.map(([, y]) => y)];
    const [x0, x1, y0, y1] = [Math.min(...xs), Math.max(...xs), Math.min(...ys), Math.max(...ys)];
    const zoom = Math.min(canvas.width / (x1 - x0 || 1), canvas.height / (y1 - y0 || 1)) * 0.8;
    context.lineWidth = 1.8 * ratio;
    for (const { points, color, isOpen } of polygons) {
      context.beginPath();
      for (const [x, y] of points) {
        context.lineTo(
          canvas.width / 2 + (x - (x0 + x1) / 2) * zoom,
          canvas.height / 2 - (y - (y0 + y1) / 2) * zoom,
        );
      }
      if (!isOpen) context.closePath();
      context.fillStyle = css([color[0], color[1], color[2], 0.3]);
      if (!isOpen) context.fill();
      context.strokeStyle = getComputedStyle(canvas).color;
      context.stroke();
    }
    canvas.setAttribute(
      "aria-label",
      `Outline of the model, ${(x1 - x0).toFixed(2)} by ${(y1 - y0).toFixed(2)} m`,
    );
  }
}
