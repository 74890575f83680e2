// The page's engine (WebAssembly) and the daemon give a groom's strands the same bits.
import test from 'node:test';
import assert from 'node:assert/strict';
import { spawnSync } from 'node:child_process';
import { readFileSync } from 'node:fs';
import { join, resolve } from 'node:path';
import { Engine, Groom } from '../../client/web/engine/engine.mjs';
import { build, startDaemon, temporaryFolder } from '../support/daemon.mjs';
import { expect } from '../support/api.mjs';

const engine = await Engine.load(readFileSync(resolve('build/web/engine.wasm')));

function sample(t, style) {
  const folder = temporaryFolder(t);
  const made = spawnSync(join(build, 'groomctl'), ['sample', '-o', folder, '--style', style, '--strands', '600', '--guides', '40', '--clean']);
  assert.equal(made.status, 0, String(made.stderr));
  return JSON.parse(readFileSync(join(folder, 'truth.groom.json')));
}

const exported = async (daemon, id) =>
  (await expect(daemon, 200, 'GET', `/v1/grooms/${id}/strands?format=data`)).bytes;

/** As .data has them: a count, and for each strand its own count and points. */
function data_of(groom) {
  const points = groom.evaluate(), bytes = Buffer.alloc(4 + groom.count * (4 + 12 * groom.vertices));
  bytes.writeInt32LE(groom.count);
  for (let s = 0, at = 4; s < groom.count; s++) {
    at = bytes.writeInt32LE(groom.vertices, at);
    for (let i = 0; i < 3 * groom.vertices; i++) at = bytes.writeFloatLE(points[3 * groom.vertices * s + i], at);
  }
  return bytes;
}

test('page and daemon evaluate every style alike, to the bit', async (t) => {
  const daemon = await startDaemon(t);
  for (const style of ['straight', 'wavy', 'curly', 'coily', 'short', 'spiky', 'bent'])
    await t.test(style, async (inner) => {
      const document = sample(inner, style);
      const { json } = await expect(daemon, 201, 'POST', '/v1/grooms', { body: document });
      const groom = Groom.fromDocument(engine, document);
      assert.deepEqual(data_of(groom), await exported(daemon, json.groom));
      groom.destroy();
    });
});

/* As a fit writes it for hair that lies askew. */
const slanted = [[0.36, 0.48, -0.8], [-0.8, 0.6, 0], [0.48, 0.64, 0.6]];

test('page and daemon lean on the axes of a groom alike, to the bit', async (t) => {
  const daemon = await startDaemon(t);
  const upright = sample(t, 'curly'), document = { ...upright, axes: slanted };
  const { json } = await expect(daemon, 201, 'POST', '/v1/grooms', { body: document });
  const groom = Groom.fromDocument(engine, document), other = Groom.fromDocument(engine, upright);
  assert.deepEqual(data_of(groom), await exported(daemon, json.groom));
  assert.notDeepEqual(data_of(groom), data_of(other));
  groom.destroy();
  const kept = (await expect(daemon, 200, 'GET', `/v1/grooms/${json.groom}?arrays=false`)).json;
  assert.deepEqual(kept.axes.map((row) => row.map(Math.fround)), slanted.map((row) => row.map(Math.fround)));
  await expect(daemon, 201, 'PATCH', `/v1/grooms/${json.groom}`,
    { headers: { 'Content-Type': 'application/json-patch+json', 'If-Match': '"1"' }, body: [{ op: 'remove', path: '/axes' }] });
  assert.deepEqual(data_of(other), await exported(daemon, json.groom));
  other.destroy();
});

test('an edit moves the page and the daemon alike', async (t) => {
  const daemon = await startDaemon(t);
  const document = sample(t, 'curly');
  const { json } = await expect(daemon, 201, 'POST', '/v1/grooms', { body: document });
  const groom = Groom.fromDocument(engine, document);
  const curl = document.operators.findIndex((o) => o.type === 'curl');
  let revision = json.revision;
  const both = async (operations, edit) => {
    const answer = await expect(daemon, 201, 'PATCH', `/v1/grooms/${json.groom}`,
      { headers: { 'Content-Type': 'application/json-patch+json', 'If-Match': `"${revision}"` }, body: operations });
    revision = answer.json.revision;
    edit();
    assert.deepEqual(data_of(groom), await exported(daemon, json.groom), JSON.stringify(operations));
  };
  await both([{ op: 'replace', path: `/operators/${curl}/radius`, value: 0.011 }],
    () => groom.set(curl, engine.typeOf('curl'), 'radius', 0.011));
  await both([{ op: 'add', path: '/operators/0', value: { type: 'bend', id: 77, seed: 999999999999999, angle: 0.6 } }],
    () => groom.insert(0, { type: 'bend', id: 77, seed: 999999999999999, angle: 0.6 }));
  await both([{ op: 'move', from: '/operators/0', path: '/operators/2' }], () => groom.move(0, 2));
  await both([{ op: 'remove', path: '/operators/1' }], () => groom.remove(1));
  groom.destroy();
});

test('operators carry what a slider needs', () => {
  assert.deepEqual(engine.types.map((t) => t.name).slice(0, 5), ['scale', 'bend', 'curl', 'clump', 'frizz']);
  const { unit, minimum, slider_maximum, help } = engine.typeOf('curl').parameters.find((p) => p.name === 'radius');
  assert.equal(unit, 'm');
  assert.ok(minimum === 0 && slider_maximum > 0 && help.length > 10);
});

test('a document that cannot be is refused with the culprit', (t) => {
  const document = sample(t, 'straight');
  document.operators[0].random_scale = 1e9;
  assert.throws(() => Groom.fromDocument(engine, document), (error) => error.pointer.startsWith('/operators/0/') && error.message.length > 10);
});
