// Analysis in curvature space and clusters with their armatures, of grooms and of uploads.
import test from 'node:test';
import assert from 'node:assert/strict';
import { groomctl, startDaemon } from '../support/daemon.mjs';
import { decode, expect, groom_document, refused, strands_json } from '../support/api.mjs';

/** A coil of some radius that rises 8 mm a turn about +y; with `switchback` it goes on half-way, smoothly, about an
    axis beside the first and with the other hand. */
function coil(x, { radius = 0.006, turns = 8, vertices = 161, switchback = false } = {}) {
  return Array.from({ length: vertices }, (_, k) => {
    const along = k / (vertices - 1), angle = 2 * Math.PI * turns * along, over = switchback && along > 0.5;
    return [x + (over ? 2 * radius - radius * Math.cos(angle) : radius * Math.cos(angle)), 0.008 * turns * along, radius * Math.sin(angle)];
  });
}
const straight = (x, vertices = 40) => Array.from({ length: vertices }, (_, k) => [x, 0.3 * k / (vertices - 1), 0]);

const upload = async (daemon, strands) => (await expect(daemon, 201, 'POST', '/v1/strands', { body: strands_json(strands) })).json.id;
const near = (a, b, within) => assert.ok(Math.abs(a - b) <= within, `${a} is not ${b} within ${within}`);
const sum = (numbers) => numbers.reduce((a, b) => a + b, 0);

test('an analysis tells coils from straight hair', async (t) => {
  const daemon = await startDaemon(t);
  const id = await upload(daemon, [coil(0), coil(0.1, { switchback: true }), straight(0.2)]);
  const at = `/v1/strands/${id}/analysis`;
  const { json, headers } = await expect(daemon, 200, 'GET', at);

  assert.equal(json.strands_id, id);
  assert.deepEqual([json.analysed.strands, json.analysed.of, json.analysed.vertices], [3, 3, 2 * 161 + 40]);
  const coiled = 2 * 8 * Math.hypot(2 * Math.PI * 0.006, 0.008);
  near(json.analysed.length, coiled + 0.3, 1e-3);
  near(json.share.coiled, coiled / (coiled + 0.3), 0.05);
  near(json.share.straight, 0.3 / (coiled + 0.3), 0.02);
  near(json.radius.mean, 0.006, 1e-4);
  near(json.frequency.mean, 1 / Math.hypot(2 * Math.PI * 0.006, 0.008), 1);
  near(json.turns.mean, 16 / 3, 0.2);
  near(sum(json.turns.histogram.weight), 3, 1e-9);
  near(sum(json.radius.histogram.weight), coiled, 0.02);
  near(Math.abs(json.hand.left - json.hand.right), 0.5, 0.05); // one strand and a half of one hand
  assert.ok(json.conversion.error.share_max < 0.05);
  assert.deepEqual([json.switchbacks.count, json.switchbacks.strands, json.switchbacks.list[0].strand], [1, 1, 1]);
  near(json.switchbacks.list[0].at, 0.5, 0.05);
  assert.equal(json.elements, undefined);
  await expect(daemon, 304, 'GET', at, { headers: { 'If-None-Match': headers.get('etag') } });

  await t.test('arrays come when asked for', async () => {
    const { json: full } = await expect(daemon, 200, 'GET', `${at}?arrays=elements,vertices,centre,switchbacks,strands`);
    const n = full.analysed.elements, first = decode(full.elements.first);
    assert.equal(first[3], n);
    for (const name of ['length', 'radius', 'step', 'frequency', 'omega', 'beta', 'hand', 'kind'])
      assert.deepEqual(full.elements[name].shape, [n], name);
    near(sum([...decode(full.elements.length)]), full.analysed.length, 1e-3);
    const radius = decode(full.vertices.radius), hand = decode(full.vertices.hand);
    assert.equal(radius.length, full.analysed.vertices);
    near(radius[80], 0.006, 2e-4);
    assert.notEqual(hand[161 + 40], hand[161 + 120]);
    assert.deepEqual(full.centre.shape, [3, 65, 3]);
    assert.deepEqual([...decode(full.switchbacks.strand)], [1]);
    assert.deepEqual([...decode(full.per_strand.index)], [0, 1, 2]);
    near(decode(full.per_strand.turns)[0], 8, 0.2);
    const { bytes, headers: told } = await expect(daemon, 200, 'GET', `${at}?format=binary`);
    assert.equal(told.get('content-type'), 'application/octet-stream');
    assert.equal(bytes.length, full.analysed.vertices * 16);
    for (const k of [0, 80, 300]) assert.equal(bytes.readFloatLE(16 * k), radius[k]);
    assert.equal(bytes.readFloatLE(16 * 200 + 8), hand[200]);
  });

  await t.test('elements, tolerance and thresholds are the caller\'s', async () => {
    const { json: given } = await expect(daemon, 200, 'GET', `${at}?elements=50`);
    assert.deepEqual([given.conversion.elements.min, given.conversion.elements.max], [50, 50]);
    const { json: coarse } = await expect(daemon, 200, 'GET', `${at}?tolerance=0.002`);
    assert.ok(coarse.analysed.elements < json.analysed.elements);
    const { json: lax } = await expect(daemon, 200, 'GET', `${at}?straight_below=1000`);
    assert.equal(lax.share.straight, 1);
    const { json: flat } = await expect(daemon, 200, 'GET', `${at}?wavy_below=1`);
    near(flat.share.wavy, json.share.coiled + json.share.wavy, 1e-6);
  });

  await t.test('a sample names strands as the whole does', async () => {
    const { json: two } = await expect(daemon, 200, 'GET', `${at}?count=2&arrays=strands`);
    assert.deepEqual([two.analysed.strands, two.analysed.of], [2, 3]);
    const index = [...decode(two.per_strand.index)];
    assert.equal(index.length, 2);
    assert.ok(index[0] < index[1] && index[1] < 3);
  });

  await t.test('bad questions are refused by their parameter', async () => {
    const bad = (query, parameter) => refused(daemon, 400, 'invalid-argument', 'GET', `${at}?${query}`, parameter && { problem: { parameter } });
    await bad('elements=0', 'elements');
    await bad('elements=many', 'elements');
    await bad('tolerance=-1', 'tolerance');
    await bad('tolerance=nan', 'tolerance');
    await bad('wavy_below=2', 'wavy_below');
    await bad('arrays=elements,colours', 'arrays');
    await bad('format=xml', 'format');
    await bad('count=4');
    await bad('colour=red');
    await refused(daemon, 404, 'not-found', 'GET', '/v1/strands/str_none/analysis');
    await refused(daemon, 404, 'not-found', 'GET', '/v1/grooms/grm_none/analysis');
  });
});

test('a groom is analysed revision by revision', async (t) => {
  const daemon = await startDaemon(t);
  const groom = (await expect(daemon, 201, 'POST', '/v1/grooms', { body: groom_document() })).json.groom;
  const at = `/v1/grooms/${groom}`;
  await expect(daemon, 201, 'PATCH', at, { headers: { 'Content-Type': 'application/json-patch+json', 'If-Match': '"1"' },
    body: [{ op: 'replace', path: '/operators/1/radius', value: 0.02 }] });
  const first = (await expect(daemon, 200, 'GET', `${at}/analysis?revision=1`)).json;
  const { json: latest } = await expect(daemon, 200, 'GET', `${at}/analysis`);
  assert.deepEqual([first.revision, latest.revision, latest.groom], [1, 2, groom]);
  assert.notDeepEqual(first.radius, latest.radius);
  await refused(daemon, 404, 'not-found', 'GET', `${at}/analysis?revision=9`);
});

test('a groom made of uploaded strands is analysed and clustered as well', async (t) => {
  const daemon = await startDaemon(t);
  const id = await upload(daemon, [coil(0), coil(0.1), coil(0.2), straight(0.3)]);
  const groom = (await expect(daemon, 201, 'POST', `/v1/strands/${id}/ruffle`, { body: { rho: 0.2, match_elements: 4, seed: 3 } })).json.groom;
  const analysis = (await expect(daemon, 200, 'GET', `/v1/grooms/${groom}/analysis?arrays=vertices`)).json;
  assert.deepEqual([...decode(analysis.vertices.first)], [0, 161, 322, 483, 523]);
  assert.ok(analysis.share.coiled > 0.5);
  const clusters = (await expect(daemon, 200, 'GET', `/v1/grooms/${groom}/clusters?count=4`)).json;
  assert.deepEqual(clusters.clusters.map(({ strands }) => strands), [1, 1, 1, 1]);
});

test('clusters come with frames to draw and to move', async (t) => {
  const daemon = await startDaemon(t);
  const places = [0, 0.2, 0.4];
  const strands = Array.from({ length: 30 }, (_, i) => straight(places[i % 3] + 0.001 * i, 30));
  const id = await upload(daemon, strands);
  const { json } = await expect(daemon, 200, 'GET', `/v1/strands/${id}/clusters?count=3&seed=5&frames=6`);
  assert.deepEqual([json.count, json.seed, json.strands, json.clusters.length], [3, 5, 30, 3]);
  const of_strand = [...decode(json.of_strand)];
  for (let i = 3; i < 30; i++) assert.equal(of_strand[i], of_strand[i % 3]);
  for (const { cluster, strands: n, root, frames } of json.clusters) {
    assert.equal(n, 10);
    const x = sum(strands.filter((_, i) => of_strand[i] === cluster).map((strand) => strand[0][0])) / n;
    near(root[0], x, 1e-6);
    assert.equal(frames.length, 6);
    frames.forEach(({ at, position, axes, extent }, k) => {
      near(at, (k + 1) / 6, 1e-9);
      [x, 0.3 * at, 0].forEach((value, c) => near(position[c], value, 1e-6));
      near(axes[0][1], 1, 1e-6);
      near(Math.abs(axes[1][0]), 1, 1e-6); // the locks are wide along x
      near(extent[1], 0.001 * 3 * Math.sqrt(99 / 12), 1e-6);
    });
  }
  const again = await expect(daemon, 200, 'GET', `/v1/strands/${id}/clusters?count=3&seed=5&frames=6`);
  assert.deepEqual(again.json, json);
  await expect(daemon, 304, 'GET', `/v1/strands/${id}/clusters?count=3&seed=5&frames=6`, { headers: { 'If-None-Match': again.headers.get('etag') } });

  const groom = (await expect(daemon, 201, 'POST', '/v1/grooms', { body: groom_document() })).json.groom;
  const of_groom = (await expect(daemon, 200, 'GET', `/v1/grooms/${groom}/clusters`)).json;
  assert.deepEqual([of_groom.groom, of_groom.revision, of_groom.count, of_groom.clusters[0].frames.length], [groom, 1, 8, 4]);

  await refused(daemon, 400, 'invalid-argument', 'GET', `/v1/strands/${id}/clusters?count=31`, { problem: { pointer: '/count' } });
  await refused(daemon, 400, 'invalid-argument', 'GET', `/v1/strands/${id}/clusters?count=0`, { problem: { parameter: 'count' } });
  await refused(daemon, 400, 'invalid-argument', 'GET', `/v1/strands/${id}/clusters?frames=65`, { problem: { parameter: 'frames' } });
  await refused(daemon, 400, 'invalid-argument', 'GET', `/v1/strands/${id}/clusters?count=1024&frames=64`, { problem: { parameter: 'frames' } });
  await refused(daemon, 404, 'not-found', 'GET', '/v1/grooms/grm_none/clusters');
});

test('groomctl analyze prints a table, and JSON', async (t) => {
  const daemon = await startDaemon(t);
  const id = await upload(daemon, [coil(0), coil(0.1, { switchback: true }), straight(0.2)]);
  const table = await groomctl(daemon, ['analyze', id]);
  assert.equal(table.status, 0, table.stderr);
  assert.match(table.stdout, /3 strands, .* m of hair/);
  assert.match(table.stdout, /coiled +\d\d\.\d % +#+\n/);
  assert.match(table.stdout, /curl radius, (6(\.0\d)?|5\.9\d) mm in the mean\n( +[\d.]+ [-+] [\d.]* +mm +[\d.]+ % .*\n){8}/);
  assert.match(table.stdout, /1 switchback on 1 strand: strand 1 at 5\d %/);
  const json = await groomctl(daemon, ['--json', 'analyze', id, '--elements', '40', '--arrays', 'elements']);
  assert.equal(json.lines()[0].elements.kind.shape[0], 120);
  const refused_one = await groomctl(daemon, ['analyze', id, '--elements', '0']);
  assert.equal(refused_one.status, 1);
  assert.match(refused_one.stderr, /1 to 4096/);
});
