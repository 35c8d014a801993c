import assert from "node:assert/strict";
import { test } from "node:test";
import { WorldState } from "../../flatland/web/page/js/world_state.js";
import { describeModel, models, poses, worldMessage } from "./fake_server.js";

const LASER = { id: 5, topic: "/scan", body: 10, origin: [0, 0, 0], angle_min: 0, angle_increment: 1 };
const SCANNER = describeModel(1, "robot", { lasers: [{ ...LASER, count: 2, range_max: 9 }] });

/** Returns a world with models. */
function open(...list) {
  const world = new WorldState(0, "room");
  world.applyModels(models(list));
  return world;
}

function edges(layer, ...values) {
  return { kind: "edges", world: 0, time: 0, layer, edges: new Float32Array(values) };
}

test("a layer keeps its edges and its visibility when the world is described again", () => {
  const world = new WorldState(0, "room");
  world.applyWorld(worldMessage(0));
  world.applyEdges(edges(0, 1, 2, 3, 4));
  world.layers[0].visible = false;
  const version = world.layersVersion;
  world.applyWorld(worldMessage(0));
  assert.deepEqual([...world.layers[0].edges], [1, 2, 3, 4]);
  assert.equal(world.layers[0].visible, false);
  assert.ok(world.layersVersion > version);
  world.applyEdges(edges(7, 1, 2, 3, 4));
  assert.equal(world.layers.length, 1, "edges of an unknown layer are ignored");
});

test("poses are those of the bodies, and a body without a pose has none", () => {
  const world = open(describeModel(1, "a"), describeModel(2, "b"));
  world.applyPoses(poses({ 20: [1, 2, 3] }));
  assert.deepEqual(world.modelPose(world.modelByName("b")), [1, 2, 3]);
  assert.equal(world.modelPose(world.modelByName("a")), null);
  assert.equal(world.bodyPose(undefined), null);
});

test("poses without ids are those of the bodies of the message before", () => {
  const world = open(describeModel(1, "a"), describeModel(2, "b"));
  world.applyPoses({ ...poses({}), ids: new Uint32Array([20, 10]), poses: new Float32Array(6) });
  world.applyPoses({ ...poses({}), ids: null, poses: new Float32Array([7, 8, 9, 1, 1, 1]) });
  assert.deepEqual(world.modelPose(world.modelByName("b")), [7, 8, 9]);
  assert.deepEqual(world.modelPose(world.modelByName("a")), [1, 1, 1]);
});

test("a new body does not have the pose of the body whose slot it takes", () => {
  const world = open(describeModel(1, "a"));
  world.applyPoses(poses({ 10: [1, 2, 3] }));
  world.applyModels(models([describeModel(2, "b")], { complete: false, removed: [1] }));
  assert.deepEqual([...world.models.keys()], [2]);
  assert.equal(world.bodies.get(20).slot, 0);
  assert.equal(world.modelPose(world.modelByName("b")), null);
});

test("there are slots for any number of bodies", () => {
  const world = new WorldState(0, "room");
  const list = Array.from({ length: 600 }, (_, i) => describeModel(i + 1, `m${i}`));
  world.applyModels(models(list.slice(0, 300)));
  world.applyPoses(poses({ 10: [1, 2, 3] }));
  world.applyModels(models(list));
  world.applyPoses(poses({ 6000: [4, 5, 6] }));
  assert.deepEqual(world.modelPose(world.modelByName("m0")), [1, 2, 3]);
  assert.deepEqual(world.modelPose(world.modelByName("m599")), [4, 5, 6]);
  assert.equal((world.poses.length / 4) % 256, 0, "the texture has complete rows");
});

test("a complete list removes all other models, a partial list does not", () => {
  const world = open(describeModel(1, "a"), describeModel(2, "b"));
  world.applyModels(models([describeModel(3, "c")], { complete: false }));
  assert.deepEqual([...world.models.keys()], [1, 2, 3]);
  world.applyModels(models([describeModel(2, "b")]));
  assert.deepEqual([...world.models.keys()], [2]);
  assert.deepEqual([...world.bodies.keys()], [20]);
});

test("a changed model keeps its colour of trails and the poses of its bodies", () => {
  const world = open(describeModel(1, "a"), describeModel(2, "b"));
  world.applyPoses(poses({ 20: [1, 2, 3] }));
  const { index } = world.models.get(2);
  world.applyModels(models([describeModel(2, "b", { body: { shapes: [] } })], { complete: false }));
  assert.equal(world.models.get(2).index, index);
  assert.deepEqual(world.modelPose(world.models.get(2)), [1, 2, 3]);
});

test("scans belong to lasers, and remain when the appearance of the model changes", () => {
  const world = open(SCANNER);
  const scan = { id: 5, pose: [1, 2, 3], ranges: new Float32Array([4, 5]) };
  world.applyScans({ kind: "scans", world: 0, time: 0, scans: [scan, { ...scan, id: 99 }] });
  world.applyModels(models([{ ...SCANNER }], { complete: false }));
  assert.equal(world.lasers.size, 1);
  assert.deepEqual(world.lasers.get(5).pose, [1, 2, 3]);
  assert.deepEqual([...world.lasers.get(5).ranges], [4, 5]);
  world.applyModels(models([], { complete: false, removed: [1, 77] }));
  assert.equal(world.lasers.size, 0);
});

test("the first body of a model leaves a trail", () => {
  const world = new WorldState(0, "room");
  const bodies = SCANNER.bodies.concat({ ...SCANNER.bodies[0], id: 11 });
  world.applyModels(models([{ ...SCANNER, bodies }]));
  world.applyPoses(poses({ 10: [0, 0, 0], 11: [0, 1, 0] }));
  world.applyPoses(poses({ 10: [1, 0, 0], 11: [1, 1, 0] }));
  assert.equal(world.trails.added, 1);
});

test("the view is fitted to the layers, or to the models of a world without layers", () => {
  const world = new WorldState(0, "room");
  assert.equal(world.fitBounds(), null);
  world.applyModels(models([describeModel(1, "a", { body: { shapes: [] } }), describeModel(2, "b")]));
  assert.equal(world.fitBounds(), null, "poses are missing");
  world.applyPoses(poses({ 10: [1, 2, 0], 20: [4, 6, 0] }));
  const close = world.fitBounds().map((value) => Number(value.toFixed(6)));
  assert.deepEqual(close, [1, 2, 4.4, 6.4]);
  world.applyWorld(worldMessage(0, { bounds: [0, 0, 8, 8] }));
  world.applyEdges(edges(0, 1, 2, 3, 4));
  assert.deepEqual(world.fitBounds(), [0, 0, 8, 8]);
});
