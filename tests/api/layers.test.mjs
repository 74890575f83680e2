// Layers: ruffle, sculpt, interpolate and curl-scale, on grooms and on uploaded strands.
import test from 'node:test';
import assert from 'node:assert/strict';
import { groomctl, startDaemon } from '../support/daemon.mjs';
import { array, decode, expect, groom_document, hair, head_obj, refused, startIdleDaemon } from '../support/api.mjs';

const M = 40;
/** Coils that hang from a disc: 3 turns of 8 mm. */
const coils = (n) => Array.from({ length: n }, (_, i) => Array.from({ length: M }, (_unused, j) => {
  const s = j / (M - 1), turn = 2 * Math.PI * (3 * s + i * 0.17), wide = 0.008 * Math.min(1, 4 * s);
  return [0.004 * (i % 40) + wide * Math.cos(turn), 1.7 - 0.15 * s, 0.004 * Math.floor(i / 40) + wide * Math.sin(turn)].map(Math.fround);
}));
const upload = async (daemon, n) => (await expect(daemon, 201, 'POST', '/v1/strands', { body: hair(n, M, coils(n)) })).json.id;
/** The points of a HAIR file, whether or not it lists its segments. */
const points_of = (bytes) => bytes.subarray(128 + (bytes.readUInt32LE(12) & 1 ? 2 * bytes.readUInt32LE(4) : 0));
const strands_of = async (daemon, id, query = '') =>
  points_of((await expect(daemon, 200, 'GET', `/v1/grooms/${id}/strands?format=hair${query}`)).bytes);
const T = (x) => [[1, 0, 0, x], [0, 1, 0, 0], [0, 0, 1, 0]];
const edit = (daemon, status, id, kind, body, headers = {}) =>
  expect(daemon, status, 'POST', `/v1/${id.startsWith('str_') ? 'strands' : 'grooms'}/${id}/${kind}`, { body, headers });

/** Strands (indices) that differ between two HAIR bodies. */
function different(a, b, n) {
  const found = [];
  const floats = (bytes) => new Float32Array(bytes.buffer.slice(bytes.byteOffset, bytes.byteOffset + n * M * 12));
  const x = floats(a), y = floats(b);
  for (let i = 0; i < n; i++)
    if (x.subarray(i * M * 3, (i + 1) * M * 3).some((v, k) => v !== y[i * M * 3 + k])) found.push(i);
  return found;
}

test('uploaded strands become a groom with a base, and a layer that stays editable', async (t) => {
  const daemon = await startDaemon(t);
  const n = 120, str = await upload(daemon, n);
  const uploaded = points_of((await expect(daemon, 200, 'GET', `/v1/strands/${str}/data?format=hair`)).bytes);
  const made = await edit(daemon, 201, str, 'ruffle', { rho: 0.5, match_elements: 2, seed: 3 });
  const id = made.json.groom;
  assert.equal(made.json.revision, 1);
  assert.equal(made.headers.get('etag'), '"1"');
  assert.ok(made.json.strands.changed > n / 2);
  const document = (await expect(daemon, 200, 'GET', `/v1/grooms/${id}`)).json;
  assert.equal(document.base.strands, str);
  assert.equal(document.guides, undefined);
  assert.equal(document.source.strands, str);
  assert.deepEqual(decode(document.base.vertices), new Uint32Array(n).fill(M));
  const ruffled = await strands_of(daemon, id);
  assert.ok(different(uploaded, ruffled, n).length > n / 2);

  const patch = (etag, body) => expect(daemon, 201, 'PATCH', `/v1/grooms/${id}`,
    { headers: { 'Content-Type': 'application/json-patch+json', 'If-Match': etag }, body });
  await t.test('another seed gives a different head, the same seed the same one', async () => {
    await patch('"1"', [{ op: 'replace', path: '/operators/0/seed', value: 4 }]);
    const other = await strands_of(daemon, id);
    assert.ok(different(ruffled, other, n).length > n / 2);
    await patch('"2"', [{ op: 'replace', path: '/operators/0/seed', value: 3 }]);
    assert.deepEqual(await strands_of(daemon, id), ruffled);
  });
  await t.test('switched off and taken away, the upload is there bit for bit', async () => {
    await patch('"3"', [{ op: 'replace', path: '/operators/0/enabled', value: false }]);
    assert.deepEqual(different(await strands_of(daemon, id), uploaded, n), []);
    await patch('"4"', [{ op: 'remove', path: '/operators/0' }]);
    assert.deepEqual(different(await strands_of(daemon, id), uploaded, n), []);
  });
  await t.test('operators without guides, and a fair sample behind a layer', async () => {
    await patch('"5"', [{ op: 'add', path: '/operators/-', value: { type: 'ruffle', rho: 0.4 } },
      { op: 'add', path: '/operators/-', value: { type: 'frizz', frequency: 200, amplitude: 0.002 } }]);
    const whole = await strands_of(daemon, id), few = await strands_of(daemon, id, '&count=17');
    assert.equal(few.length >= 17 * M * 12, true);
    const floats = (b, k) => b.subarray(k * M * 12, (k + 1) * M * 12).toString('latin1');
    const all = new Set(Array.from({ length: n }, (_, k) => floats(whole, k)));
    for (let k = 0; k < 17; k++) assert.ok(all.has(floats(few, k)), `strand ${k} of the sample`);
    for (const type of ['bend', 'curl', 'clump'])
      await refused(daemon, 400, 'invalid-argument', 'PATCH', `/v1/grooms/${id}`,
        { headers: { 'Content-Type': 'application/json-patch+json', 'If-Match': '"6"' },
          body: [{ op: 'add', path: '/operators/-', value: { type } }], problem: { pointer: '/operators/2/type', detail: /operator guides/ } });
    await refused(daemon, 404, 'not-found', 'GET', `/v1/grooms/${id}/guides`);
    assert.ok((await expect(daemon, 200, 'GET', `/v1/grooms/${id}/preview.png?size=64`)).bytes.length > 100);
  });
  await t.test('got from one server and posted to another, the strands are the same bits', async () => {
    const other = await startDaemon(t);
    const whole = (await expect(daemon, 200, 'GET', `/v1/grooms/${id}`)).json;
    const copy = (await expect(other, 201, 'POST', '/v1/grooms', { body: whole })).json.groom;
    assert.deepEqual(await strands_of(other, copy), await strands_of(daemon, id));
  });
});

test('sculpt moves what is anchored and nothing else', async (t) => {
  const daemon = await startDaemon(t);
  const n = 60, str = await upload(daemon, n), shapes = coils(n);
  const made = (await edit(daemon, 201, str, 'curl-scale', { radius: 1 })).json;
  const before = await strands_of(daemon, made.groom);
  const tip = (i, dx) => ({ strand: i, at: 1, position: [shapes[i][M - 1][0] + dx, shapes[i][M - 1][1], shapes[i][M - 1][2]] });
  const one = await edit(daemon, 201, made.groom, 'sculpt', { anchors: [tip(3, 0.02), tip(7, 0.02)], stiffness: 0.1 });
  assert.equal(one.json.revision, 2);
  assert.equal(one.json.operator, 1);
  assert.ok(one.json.energy.after < one.json.energy.before);
  assert.ok(one.json.anchor_error.max < 0.004 && one.json.anchor_error.mean <= one.json.anchor_error.max);
  assert.ok(one.json.iterations.median <= one.json.iterations.max);
  assert.equal(one.json.contact, null);
  assert.deepEqual(different(before, await strands_of(daemon, made.groom), n), [3, 7]);

  await t.test('a drag changes one layer, and tries before it writes', async () => {
    const { json } = await edit(daemon, 200, made.groom, 'sculpt', { layer: one.json.layer, commit: false, anchors: [tip(3, 0.03)] });
    assert.equal(json.revision, 2);
    assert.deepEqual([...decode(json.points.strand)], [3]);
    assert.deepEqual([...decode(json.points.vertices)], [M]);
    const there = decode(json.points.points);
    assert.ok(Math.abs(there[3 * (M - 1)] - shapes[3][M - 1][0] - 0.03) < 0.006, `${there[3 * (M - 1)]}`);
    assert.equal((await expect(daemon, 200, 'GET', `/v1/grooms/${made.groom}?arrays=false`)).json.revision, 2);
    const done = (await edit(daemon, 201, made.groom, 'sculpt', { layer: one.json.layer, anchors: [tip(3, 0.03)], points: true }, { 'If-Match': '"2"' })).json;
    assert.equal(done.revision, 3);
    assert.deepEqual(decode(done.points.points), there);
    const after = await strands_of(daemon, made.groom);
    assert.deepEqual(different(before, after, n), [3]);
    assert.deepEqual(new Float32Array(after.buffer.slice(after.byteOffset + 3 * M * 12, after.byteOffset + 4 * M * 12)), there);
    const document = (await expect(daemon, 200, 'GET', `/v1/grooms/${made.groom}?arrays=false`)).json;
    assert.deepEqual(document.operators.map(({ type }) => type), ['curl_scale', 'sculpt']);
    assert.ok(Math.abs(document.operators[1].stiffness - 0.1) < 1e-7);
    await refused(daemon, 412, 'precondition-failed', 'POST', `/v1/grooms/${made.groom}/sculpt`, { headers: { 'If-Match': '"2"' }, body: {} });
  });
  await t.test('anchors as arrays do the same', async () => {
    const list = [tip(3, 0.03), tip(9, -0.01)];
    const anchors = { strand: array('u32', [2], list.map((a) => a.strand)), at: array('f32', [2], [1, 1]), position: array('f32', [2, 3], list.flatMap((a) => a.position)) };
    const a = (await edit(daemon, 200, made.groom, 'sculpt', { commit: false, anchors: list })).json;
    const b = (await edit(daemon, 200, made.groom, 'sculpt', { commit: false, anchors })).json;
    assert.deepEqual(a.points, b.points);
  });
  await t.test('frames move clusters', async () => {
    const { json } = await edit(daemon, 200, made.groom, 'sculpt',
      { commit: false, clusters: { count: 4, seed: 2 }, frames: [{ cluster: 1, at: 0.9, transform: T(0.01) }], stiffness: 0.1 });
    assert.ok(json.anchors > 0 && json.anchors < n);
    assert.equal(json.strands.changed, json.anchors);
  });
});

test('a head is kept clear, and what did it travels with the groom', async (t) => {
  const daemon = await startDaemon(t);
  const n = 4;
  // straight strands that stand out from the side of a head of 0.1 m about (0, 1.6, 0)
  const shapes = Array.from({ length: n }, (_, i) => Array.from({ length: M }, (_unused, j) => [0.1 + 0.006 * j, 1.6, 0.006 * i].map(Math.fround)));
  const str = (await expect(daemon, 201, 'POST', '/v1/strands', { body: hair(n, M, shapes) })).json.id;
  const head = (await expect(daemon, 201, 'POST', '/v1/heads', { body: head_obj() })).json.id;
  const anchors = shapes.map((_, i) => ({ strand: i, at: 1, position: [-0.12, 1.61, 0.006 * i] }));
  const through = (await edit(daemon, 201, str, 'sculpt', { anchors, head, avoid_head: false, stiffness: 1 })).json;
  assert.equal(through.contact, null);
  const { json } = await edit(daemon, 201, str, 'sculpt', { anchors, head, stiffness: 1 });
  assert.equal(json.contact.checked, n);
  assert.ok(json.contact.entered > 0 && json.contact.depth_after < json.contact.depth_before);
  const document = (await expect(daemon, 200, 'GET', `/v1/grooms/${json.groom}`)).json;
  assert.equal(document.source.head, head);
  assert.ok(document.operators[0].contact.strand.shape[0] > 0);
  const other = await startDaemon(t); // where this head is not
  const copy = (await expect(other, 201, 'POST', '/v1/grooms', { body: document })).json.groom;
  assert.deepEqual(await strands_of(other, copy), await strands_of(daemon, json.groom));
});

test('interpolate and curl-scale, on grooms of guides too', async (t) => {
  const daemon = await startDaemon(t);
  const made = (await expect(daemon, 201, 'POST', '/v1/grooms', { body: groom_document({ n: 24, m: M }) })).json.groom;
  const first = await strands_of(daemon, made);
  const scaled = (await edit(daemon, 201, made, 'curl-scale', { radius: 2, groups: 'operator_guides', group: 1, ramp_root: 0 })).json;
  assert.equal(scaled.strands.edited, 12);
  const second = await strands_of(daemon, made);
  const apart = different(first, second, 24);
  assert.ok(apart.length > 0 && apart.every((i) => i % 2 === 1));
  const blend = (await edit(daemon, 201, made, 'interpolate', { revision: 1, t: 1 })).json;
  assert.equal(blend.revision, 3);
  const floats = (b) => new Float32Array(b.buffer.slice(b.byteOffset, b.byteOffset + 24 * M * 12));
  const back = floats(await strands_of(daemon, made));
  floats(first).forEach((v, k) => assert.ok(Math.abs(v - back[k]) < 2e-3, `${k}: ${v} ${back[k]}`));
  await edit(daemon, 201, made, 'interpolate', { layer: blend.layer, t: 0 });
  assert.deepEqual(await strands_of(daemon, made), second);
  const document = (await expect(daemon, 200, 'GET', `/v1/grooms/${made}?arrays=false`)).json;
  assert.equal(document.operators.at(-1).target.groom, made);
  const str = await upload(daemon, 30);
  assert.equal((await edit(daemon, 200, made, 'interpolate', { strands: str, commit: false })).json.strands.edited, 24);
  assert.equal((await edit(daemon, 200, str, 'interpolate', { groom: made, commit: false, t: 0.2 })).json.groom, null);
  assert.equal((await edit(daemon, 200, made, 'ruffle', { commit: false, groups: { count: 3 } })).json.strands.edited, 24);
  assert.equal((await edit(daemon, 200, str, 'sculpt', { commit: false, anchors: [] })).json.strands.edited, 0);
  assert.equal((await edit(daemon, 200, str, 'ruffle', { commit: false })).json.strands.edited, 30);
  assert.equal((await edit(daemon, 200, str, 'curl-scale', { commit: false, radius: 1.2 })).json.strands.edited, 30);
});

test('bad edits are refused at the culprit, and the groom stays', async (t) => {
  const daemon = await startDaemon(t);
  const str = await upload(daemon, 20);
  const id = (await edit(daemon, 201, str, 'ruffle', { rho: 0.1 })).json.groom;
  const anchor = { strand: 0, at: 1, position: [0, 1.6, 0] };
  const frame = { cluster: 0, at: 0.5, transform: T(0) };
  const bad = [
    ['ruffle', { rho: 1.0001 }, '/rho'], ['ruffle', { rho: 'much' }, '/rho'], ['ruffle', { blend: -1 }, '/blend'],
    ['ruffle', { match_elements: 2.5 }, '/match_elements'], ['ruffle', { rhoo: 0.5 }, '/rhoo'],
    ['ruffle', { groups: 'curls' }, '/groups'], ['ruffle', { groups: 'operator_guides' }, '/groups'],
    ['ruffle', { groups: [0, 1] }, '/groups'], ['ruffle', { groups: { count: 21 } }, '/groups/count'],
    ['ruffle', { elements: 0 }, '/elements'], ['ruffle', { seed: -1 }, '/seed'], ['ruffle', { commit: 'no' }, '/commit'],
    ['ruffle', { layer: 99 }, '/layer'], ['sculpt', { layer: 1 }, '/layer'],
    ['sculpt', { anchors: [anchor, { ...anchor, at: 1.5 }] }, '/anchors/1/at'],
    ['sculpt', { anchors: [{ ...anchor, strand: 20 }] }, '/anchors/0/strand'],
    ['sculpt', { anchors: [{ ...anchor, position: [0, 0] }] }, '/anchors/0/position'],
    ['sculpt', { anchors: [{ ...anchor, position: [0, null, 0] }] }, '/anchors/0/position'],
    ['sculpt', { anchors: [{ ...anchor, weight: 1 }] }, '/anchors/0/weight'],
    ['sculpt', { frames: [frame] }, '/clusters'],
    ['sculpt', { clusters: { count: 3 }, frames: [{ ...frame, cluster: 3 }] }, '/frames/0/cluster'],
    ['sculpt', { clusters: { count: 3 }, frames: [{ ...frame, transform: [[1, 0, 0, null], [0, 1, 0, 0], [0, 0, 1, 0]] }] }, '/frames/0/transform'],
    ['sculpt', { clusters: { count: 3 }, frames: [{ ...frame, at: -0.1 }] }, '/frames/0/at'],
    ['sculpt', { clusters: { count: 0 }, frames: [] }, '/clusters/count'],
    ['sculpt', { stiffness: -1 }, '/stiffness'],
    ['interpolate', {}, '/groom'], ['interpolate', { groom: 'grm_nowhere' }, '/groom'], ['interpolate', { revision: 9 }, '/revision'],
    ['interpolate', { strands: 'str_nowhere' }, '/strands'], ['interpolate', { groom: id, t: 2 }, '/t'],
    ['curl-scale', { radius: 0 }, '/radius'], ['curl-scale', { keep: 'both' }, '/keep'], ['curl-scale', { group: 1 }, '/group'],
    ['curl-scale', { ramp_tip: 2 }, '/ramp_tip'],
  ];
  for (const [kind, body, pointer] of bad)
    await refused(daemon, 400, 'invalid-argument', 'POST', `/v1/grooms/${id}/${kind}`, { body, problem: { pointer } });
  for (const body of ['{"frames":[{"cluster":0,"at":0,"transform":[[NaN,0,0,0],[0,1,0,0],[0,0,1,0]]}]}', '{"stiffness":1e999}', '[]', '{', '']) {
    const { json } = await expect(daemon, 400, 'POST', `/v1/grooms/${id}/sculpt`, { headers: { 'Content-Type': 'application/json' }, body });
    assert.ok(json.detail, body);
  }
  // all strands in one place: clusters beyond the first are empty
  const heap = Array.from({ length: 6 }, () => coils(1)[0]);
  const same = (await expect(daemon, 201, 'POST', '/v1/strands', { body: hair(6, M, heap) })).json.id;
  let empty = 0;
  for (let cluster = 0; cluster < 3; cluster++) {
    const answer = await fetch(new URL(`/v1/strands/${same}/sculpt`, daemon.url),
      { method: 'POST', body: JSON.stringify({ commit: false, clusters: { count: 3 }, frames: [{ ...frame, cluster }] }) });
    if (answer.status === 400 && (await answer.json()).pointer === '/frames/0/cluster') empty++;
  }
  assert.equal(empty, 2);
  await refused(daemon, 404, 'not-found', 'POST', '/v1/grooms/grm_nowhere/sculpt', { body: {} });
  await refused(daemon, 404, 'not-found', 'POST', '/v1/strands/str_nowhere/ruffle', { body: {} });
  await refused(daemon, 400, 'invalid-argument', 'POST', `/v1/strands/${str}/sculpt`, { body: { head: 'head_nowhere' }, problem: { pointer: '/head' } });
  const { json } = await expect(daemon, 200, 'GET', `/v1/grooms/${id}?arrays=false`);
  assert.equal(json.revision, 1);
  assert.equal(json.operators.length, 1);
  assert.deepEqual((await expect(daemon, 200, 'GET', '/v1/grooms')).json.grooms.length, 1);
});

test('more than 5 000 strands are a job', async (t) => {
  const daemon = await startDaemon(t);
  const n = 5200, str = await upload(daemon, n), shapes = coils(n);
  const anchors = { strand: array('u32', [n], shapes.map((_, i) => i)), at: array('f32', [n], new Array(n).fill(1)),
    position: array('f32', [n, 3], shapes.flatMap((s) => [s[M - 1][0] + 0.01, s[M - 1][1], s[M - 1][2]])) };
  const wait = async (job) => (await expect(daemon, 200, 'GET', `/v1/jobs/${job}`, { headers: { Prefer: 'wait=60' } })).json;
  const asked = await edit(daemon, 202, str, 'sculpt', { anchors, elements: 12, stiffness: 0.1 });
  assert.equal(asked.json.kind, 'sculpt');
  assert.equal(asked.json.strands, str);
  assert.equal(asked.json.options.anchors.position.data, undefined);
  assert.equal(asked.headers.get('location'), `/v1/jobs/${asked.json.id}`);
  const done = await wait(asked.json.id);
  assert.equal(done.state, 'succeeded', JSON.stringify(done.error));
  const { groom, revision, energy, anchor_error, strands } = done.result;
  assert.deepEqual([revision, strands.changed], [1, n]);
  assert.ok(energy.after < energy.before && anchor_error.max < 0.01);

  await t.test('its result is what the chain evaluates to', async () => {
    const other = await startDaemon(t);
    const document = (await expect(daemon, 200, 'GET', `/v1/grooms/${groom}`)).json;
    const copy = (await expect(other, 201, 'POST', '/v1/grooms', { body: document })).json.groom;
    assert.deepEqual(await strands_of(other, copy), await strands_of(daemon, groom));
  });
  await t.test('of a groom, at the revision that it was asked for', async () => {
    const ruffle = (await edit(daemon, 202, groom, 'ruffle', { rho: 0.3 })).json;
    assert.deepEqual([ruffle.groom, ruffle.revision], [groom, 1]);
    const after = await wait(ruffle.id);
    assert.equal(after.state, 'succeeded', JSON.stringify(after.error));
    assert.deepEqual([after.result.groom, after.result.revision], [groom, 2]);
    assert.deepEqual((await expect(daemon, 200, 'GET', `/v1/grooms/${groom}?arrays=false`)).json.operators.map(({ type }) => type), ['sculpt', 'ruffle']);
  });
  await refused(daemon, 400, 'invalid-argument', 'POST', `/v1/grooms/${groom}/ruffle`, { body: { commit: false }, problem: { pointer: '/commit' } });
  await refused(daemon, 400, 'invalid-argument', 'POST', `/v1/grooms/${groom}/ruffle`, { body: { rho: 2 }, problem: { pointer: '/rho' } });
});

test('an edit whose groom is changed while it waits fails, and says so', async (t) => {
  const daemon = await startIdleDaemon(t);
  const n = 5001, str = await upload(daemon, n);
  const one = [{ strand: 0, at: 1, position: [0, 1.55, 0] }];
  const { json } = await edit(daemon, 201, str, 'sculpt', { anchors: one });
  const job = (await edit(daemon, 202, json.groom, 'ruffle', {})).json;
  const token = await daemon.attempt();
  const layer = (await expect(daemon, 200, 'GET', '/v1/work/layer', { token })).json;
  assert.equal(layer.type, 'ruffle');
  assert.equal((await expect(daemon, 200, 'GET', '/v1/work/strands', { token })).bytes.toString('latin1', 0, 8), 'GSTRAND1');
  await edit(daemon, 201, json.groom, 'sculpt', { layer: json.layer, anchors: one });
  const { detail } = (await expect(daemon, 400, 'GET', '/v1/work/layer', { token })).json;
  assert.match(detail, /changed/);
  await expect(daemon, 400, 'POST', '/v1/work/result', { token, body: '{"report":{}}\nGSTRAND1' });
  await expect(daemon, 400, 'POST', '/v1/work/result', { token, body: 'nothing' });
  await expect(daemon, 204, 'POST', '/v1/work/failed', { token, body: { type: '/problems/invalid-argument', title: 'x', status: 400, detail } });
  assert.equal((await expect(daemon, 200, 'GET', `/v1/jobs/${job.id}`)).json.state, 'failed');
});

test('groomctl edits in curvature space', async (t) => {
  const daemon = await startDaemon(t);
  const str = await upload(daemon, 60);
  const run = async (...words) => {
    const done = await groomctl(daemon, ['--json', ...words]);
    assert.equal(done.status, 0, done.stderr);
    return JSON.parse(done.stdout);
  };
  const made = await run('ruffle', str, '--rho', '0.4', '--groups', '3', '--seed', '9');
  assert.deepEqual([made.type, made.revision], ['ruffle', 1]);
  const sculpt = await run('sculpt', made.groom, '--anchor', '3,1,0.02,1.6,0', '--anchor', '4,0.5,0.02,1.65,0', '--stiffness', '2', '--elements', '20');
  assert.equal(sculpt.anchors, 2);
  assert.equal((await run('sculpt', made.groom, '--layer', String(sculpt.layer), '--anchor', '3,1,0.03,1.6,0', '--try')).committed, false);
  await run('curl-scale', made.groom, '--radius', '1.3', '--ramp', '0,1', '--keep', 'turns', '--if-match', '2');
  assert.equal((await run('interpolate', made.groom, '--revision', '1', '--t', '0.25')).revision, 4);
  const words = await groomctl(daemon, ['sculpt', made.groom, '--clusters', '4', '--try']);
  assert.match(words.stdout, /0 of 0 strands changed/);
  for (const [bad, status, what] of [[['ruffle', made.groom, '--rho', '2'], 1, /rho/], [['sculpt', made.groom, '--anchor', '3,1'], 2, /STRAND,AT/],
    [['curl-scale', made.groom, '--ramp', '1'], 2, /ROOT,TIP/], [['ruffle', made.groom, '--if-match', '1'], 1, /revision/], [['ruffle'], 2, /./]]) {
    const refusal = await groomctl(daemon, bad);
    assert.equal(refusal.status, status, refusal.stderr);
    assert.match(refusal.stderr, what);
  }
});
