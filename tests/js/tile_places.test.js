import assert from "node:assert/strict";
import { test } from "node:test";
import { tilePlaces } from "../../flatland/web/page/js/tile_places.js";

test("tiles have the same size, do not overlap and are in the area", () => {
  for (let count = 1; count <= 30; count++) {
    const places = tilePlaces(count, 1000, 600);
    assert.equal(places.length, count);
    for (const [i, a] of places.entries()) {
      assert.deepEqual([a.width, a.height], [places[0].width, places[0].height]);
      assert.ok(a.left >= 0 && a.top >= 0 && a.left + a.width <= 1000 && a.top + a.height <= 600);
      for (const b of places.slice(i + 1)) {
        assert.ok(a.left + a.width < b.left + 1e-9 || a.top + a.height < b.top + 1e-9, `${count}: ${i}`);
      }
    }
  }
});

test("the number of columns depends on the area", () => {
  const columns = (width, height) => new Set(tilePlaces(4, width, height).map(({ left }) => left)).size;
  assert.deepEqual([columns(1000, 600), columns(1000, 150), columns(150, 1000)], [2, 4, 1]);
});

test("a small area has tiles of at least one pixel", () => {
  assert.ok(tilePlaces(9, 4, 4).every(({ width, height }) => width >= 1 && height >= 1));
  assert.deepEqual(tilePlaces(0, 100, 100), []);
});
