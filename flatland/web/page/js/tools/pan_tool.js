/**
 * A tool that only moves the view, so that no model is moved by mistake.
 *
 * @implements {Tool}
 * @typedef {import("./tool_box.js").Tool} Tool
 */
export class PanTool {
  hint = "";

  down() {
    return false;
  }

  drag() {}

  up() {}

  hover() {
    return "grab";
  }

  cancel() {
    return false;
  }

  leave() {}

  draw() {}
}
