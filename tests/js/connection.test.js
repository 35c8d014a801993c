import assert from "node:assert/strict";
import { test } from "node:test";
import { Connection, RequestError } from "../../flatland/web/page/js/connection.js";
import { WRONG_TOKEN } from "../../flatland/web/page/js/protocol.js";
import { openPage, settle } from "./fake_page.js";

let sockets = [];

class FakeSocket {
  static OPEN = 1;

  constructor(url, protocols) {
    Object.assign(this, { url, protocols, readyState: 0, sent: [] });
    sockets.push(this);
  }

  send(text) {
    this.sent.push(JSON.parse(text));
  }

  close() {
    this.readyState = 3;
  }

  /** The handshake succeeds. */
  accept() {
    this.readyState = 1;
    this.onopen();
  }

  /** The browser reports the end of the connection. */
  end(code = 1006, reason = "") {
    this.readyState = 3;
    this.onclose?.({ code, reason });
  }

  reply(fields) {
    this.onmessage({ data: JSON.stringify({ type: "reply", id: this.sent.at(-1).id, ...fields }) });
  }
}

function createConnection() {
  sockets = [];
  openPage();
  globalThis.WebSocket = FakeSocket;
  return new Connection("ws://localhost/ws");
}

function connect() {
  const connection = createConnection();
  const states = [];
  connection.on("state", (state) => states.push(state));
  connection.open();
  sockets[0].accept();
  return { connection, states, socket: sockets[0] };
}

test("the connection is open after the handshake", () => {
  const { connection, states, socket } = connect();
  assert.deepEqual(states, ["connected"]);
  assert.deepEqual([socket.url, socket.protocols], ["ws://localhost/ws", ["flatland.1"]]);
  connection.open();
  assert.equal(sockets.length, 1, "an open connection is kept");
});

test("replies belong to their requests", async () => {
  const { connection, socket } = connect();
  const first = connection.request("step", { n: 3, world: 1 });
  const second = connection.request("files", {});
  assert.deepEqual(socket.sent, [
    { id: 1, type: "step", n: 3, world: 1 },
    { id: 2, type: "files" },
  ]);
  socket.reply({ ok: true, result: ["file"] });
  socket.reply({ id: 1, ok: false, error: "not possible" });
  socket.reply({ id: 77, ok: true, result: null });
  assert.deepEqual(await second, ["file"]);
  await assert.rejects(first, new RequestError("not possible"));
});

test("a request without a connection or a reply fails", async (t) => {
  t.mock.timers.enable({ apis: ["setTimeout"] });
  const closed = createConnection();
  await assert.rejects(closed.request("files", {}), /not connected/);
  const { connection } = connect();
  const request = connection.request("files", {});
  t.mock.timers.tick(20_000);
  await assert.rejects(request, /no reply to "files"/);
});

test("messages and binary data are events", () => {
  const { connection, socket } = connect();
  const received = [];
  connection.on("message", (message) => received.push(message));
  connection.on("data", (data) => received.push(data.kind));
  socket.onmessage({ data: '{"type":"gone","world":0}' });
  const poses = new DataView(new ArrayBuffer(20));
  poses.setUint8(0, 4);
  poses.setUint8(1, 1);
  socket.onmessage({ data: poses.buffer });
  assert.deepEqual(received, [{ type: "gone", world: 0 }, "poses"]);
});

test("a lost connection is opened again, with growing delays", async (t) => {
  t.mock.timers.enable({ apis: ["setTimeout"] });
  const { connection, states, socket } = connect();
  const request = connection.request("files", {});
  socket.end();
  await assert.rejects(request, /the connection was lost/);
  assert.deepEqual(states, ["connected", "reconnecting"]);
  for (const delay of [250, 500, 1000, 2000, 3000, 3000]) {
    const count = sockets.length;
    t.mock.timers.tick(delay - 1);
    assert.equal(sockets.length, count);
    t.mock.timers.tick(1);
    assert.equal(sockets.length, count + 1);
    sockets.at(-1).end();
  }
  t.mock.timers.tick(3000);
  sockets.at(-1).accept();
  assert.equal(connection.state, "connected");
  sockets.at(-1).end();
  t.mock.timers.tick(250);
  assert.equal(sockets.length, 9, "the delays start again");
});

test("the reason of the server is an event", () => {
  const { connection, socket } = connect();
  const reasons = [];
  connection.on("reason", (reason) => reasons.push(reason));
  socket.end(1008, "not JSON");
  assert.deepEqual(reasons, ["not JSON"]);
  connection.close();
});

test("a wrong token ends all attempts", (t) => {
  t.mock.timers.enable({ apis: ["setTimeout"] });
  const { connection, socket } = connect();
  socket.end(WRONG_TOKEN);
  assert.equal(connection.state, "refused");
  t.mock.timers.tick(60_000);
  connection.open();
  assert.equal(sockets.length, 1);
});

test("a page that the user has left does not reconnect until it is shown", (t) => {
  t.mock.timers.enable({ apis: ["setTimeout"] });
  const { connection } = connect();
  connection.close();
  t.mock.timers.tick(60_000);
  assert.equal(sockets.length, 1);
  connection.open();
  assert.equal(sockets.length, 2);
});

test("a connection whose end the browser has not reported yet is lost when another one is opened", async (t) => {
  t.mock.timers.enable({ apis: ["setTimeout"] });
  const { connection, states, socket } = connect();
  const request = connection.request("files", {});
  socket.readyState = 2;
  connection.open();
  await assert.rejects(request, /the connection was lost/);
  sockets[1].accept();
  assert.deepEqual(states, ["connected", "reconnecting", "connected"]);
  t.mock.timers.tick(60_000);
  assert.equal(sockets.length, 2);
});

test("a probe reconnects if there is neither a reply nor a message", async (t) => {
  t.mock.timers.enable({ apis: ["setTimeout"] });
  for (const state of ["connected", "reconnecting"]) {
    const { connection, socket } = connect();
    connection.probe("look", {});
    assert.equal(socket.sent[0].type, "look");
    if (state === "connected") socket.onmessage({ data: '{"type":"gone","world":0}' });
    t.mock.timers.tick(4000);
    await settle();
    assert.equal(connection.state, state);
  }
});

test("a probe opens a closed connection", () => {
  const connection = createConnection();
  connection.probe("look", {});
  assert.equal(sockets.length, 1);
});
