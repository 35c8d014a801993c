import assert from "node:assert/strict";
import { test } from "node:test";
import { packColor } from "../../../flatland/web/page/js/renderer/edge_batch.js";
import { createPalette, css, readable } from "../../../flatland/web/page/js/renderer/palette.js";

function luminance([r, g, b]) {
  return 0.299 * r + 0.587 * g + 0.114 * b;
}

test("colours of the world contrast with the background", () => {
  for (const dark of [true, false]) {
    const palette = createPalette(dark);
    const grays = [0, 0.5, 1].map((gray) => [gray, gray, gray, 1]);
    for (const color of grays.concat([[1, 1, 0, 1]], [[0, 0, 1, 1]], [palette.background])) {
      const found = readable(color, palette);
      assert.ok(Math.abs(luminance(found) - luminance(palette.background)) > 0.35, `${dark}: ${color}`);
      assert.ok(found.every((part) => part >= 0 && part <= 1));
    }
  }
});

test("a colour that is visible is not changed, except that it is not transparent", () => {
  assert.deepEqual(readable([1, 0.5, 0.5, 0.1], createPalette(true)), [1, 0.5, 0.5, 0.35]);
});

test("colours are styles and bytes", () => {
  assert.equal(css([1, 0, 0.5]), "rgb(255 0 128 / 1)");
  assert.equal(css([1, 0, 0.5, 0.25]), "rgb(255 0 128 / 0.25)");
  assert.equal(packColor([1, 0, 0.2, 0.5], 0.5), 0x40_33_00_ff);
  assert.equal(packColor([1, 1, 1]), 0xff_ff_ff_ff);
});
