// Grooms: import, read, patch, history, guides, exports, pictures.
import test from 'node:test';
import assert from 'node:assert/strict';
import { startDaemon } from '../support/daemon.mjs';
import { call, decode, expect, groom_document, hair, points, refused, strands_json } from '../support/api.mjs';

const json_patch = { 'Content-Type': 'application/json-patch+json' };
const merge_patch = { 'Content-Type': 'application/merge-patch+json' };

async function imported(daemon, options) {
  const { json, headers } = await expect(daemon, 201, 'POST', '/v1/grooms', { body: groom_document(options) });
  return { id: json.groom, at: `/v1/grooms/${json.groom}`, etag: headers.get('etag') };
}

const patch = (daemon, status, groom, etag, body, headers = json_patch) =>
  expect(daemon, status, 'PATCH', groom.at, { headers: { ...headers, 'If-Match': etag }, body });

test('documents go in and come out the same', async (t) => {
  const daemon = await startDaemon(t);
  const document = groom_document();
  const groom = await imported(daemon);
  const { json, headers } = await expect(daemon, 200, 'GET', groom.at);
  assert.equal(headers.get('etag'), '"1"');
  assert.equal(json.id, groom.id);
  assert.equal(json.revision, 1);
  assert.deepEqual(json.guides.points, document.guides.points);
  assert.deepEqual(json.instancing, document.instancing);
  assert.equal(json.operators.length, 3);
  assert.ok(Math.abs(json.operators[1].radius - 0.004) < 1e-8);
  const bare = (await expect(daemon, 200, 'GET', `${groom.at}?arrays=false`)).json;
  assert.equal(bare.guides.points.data, undefined);
  assert.deepEqual(bare.guides.points.shape, [4, 12, 3]);
  await expect(daemon, 304, 'GET', groom.at, { headers: { 'If-None-Match': 'W/"1", "8"' } });
  assert.deepEqual((await expect(daemon, 200, 'GET', '/v1/grooms')).json.grooms.map(({ id, name, revision }) => ({ id, name, revision })),
    [{ id: groom.id, name: 'small', revision: 1 }]);

  await t.test('got from one server and posted to another, the strands are the same bits', async () => {
    const other = await startDaemon(t);
    const copy = (await expect(other, 201, 'POST', '/v1/grooms', { body: json })).json;
    const a = await expect(daemon, 200, 'GET', `${groom.at}/strands?format=hair`);
    const b = await expect(other, 200, 'GET', `/v1/grooms/${copy.groom}/strands?format=hair`);
    assert.equal(a.bytes.length, 128 + 24 * 12 * 12 + (a.bytes.readUInt32LE(12) & 1 ? 48 : 0));
    assert.deepEqual(a.bytes, b.bytes);
  });
});

test('bad documents are refused at the culprit', async (t) => {
  const daemon = await startDaemon(t);
  const post = (status, name, change, problem) => {
    const document = groom_document();
    change(document);
    return refused(daemon, status, name, 'POST', '/v1/grooms', { body: document, problem });
  };
  await post(400, 'invalid-argument', (d) => { d.operators[1].radius = 'wide'; }, { pointer: '/operators/1/radius' });
  await post(400, 'invalid-argument', (d) => { d.operators[1].type = 'spiral'; }, { pointer: '/operators/1/type', detail: /curl/ });
  await post(400, 'invalid-argument', (d) => { d.guides.points.data = d.guides.points.data.slice(0, 40); }, { pointer: '/guides/points' });
  await post(400, 'invalid-argument', (d) => { d.instancing.guide.shape = [24, 1e9]; }, { pointer: '/instancing/guide' });
  await post(400, 'invalid-argument', (d) => { delete d.strands; }, { pointer: /^\/strands/ });
  await post(400, 'invalid-argument', (d) => { d.unit = 'cm'; }, { pointer: '/unit' });
  for (const body of ['{', '[]', '', '{"format":"groom/1"', '['.repeat(1000) + ']'.repeat(1000), '{"format":"groom/2","unit":"m"}']) {
    const { status, json } = await call(daemon, 'POST', '/v1/grooms', { headers: { 'Content-Type': 'application/json' }, body });
    assert.ok(status === 400 || status === 422, `${status} ${body.slice(0, 40)}`);
    assert.ok(json.detail, body);
  }
  assert.deepEqual((await expect(daemon, 200, 'GET', '/v1/grooms')).json.grooms, []);
});

test('patches make revisions, and nothing is overwritten', async (t) => {
  const daemon = await startDaemon(t);
  const groom = await imported(daemon);
  const second = await patch(daemon, 201, groom, '"1"', [{ op: 'replace', path: '/operators/1/radius', value: 0.02 }]);
  assert.equal(second.json.revision, 2);
  assert.equal(second.headers.get('etag'), '"2"');
  await patch(daemon, 201, groom, '"2"', [{ op: 'remove', path: '/operators/0' }, { op: 'add', path: '/operators/-', value: { type: 'bend', angle: 0.3, start: 0.5, seed: 3 } }]);
  await patch(daemon, 201, groom, '"3"', { name: 'renamed' }, merge_patch);
  await patch(daemon, 201, groom, '"4"', [{ op: 'move', from: '/operators/2', path: '/operators/0' }]);
  const latest = (await expect(daemon, 200, 'GET', groom.at)).json;
  assert.deepEqual(latest.operators.map(({ type }) => type), ['bend', 'curl', 'frizz']);
  assert.equal(latest.name, 'renamed');
  assert.equal(latest.parent, 4);
  const first = (await expect(daemon, 200, 'GET', `${groom.at}?revision=1`)).json;
  assert.deepEqual(first.operators.map(({ type }) => type), ['scale', 'curl', 'frizz']);
  assert.ok(Math.abs(first.operators[1].radius - 0.004) < 1e-8);

  await t.test('history and going back', async () => {
    const { revisions } = (await expect(daemon, 200, 'GET', `${groom.at}/revisions`)).json;
    assert.deepEqual(revisions.map(({ revision, parent }) => [revision, parent]), [[5, 4], [4, 3], [3, 2], [2, 1], [1, null]]);
    const page = (await expect(daemon, 200, 'GET', `${groom.at}/revisions?limit=2`)).json;
    assert.deepEqual((await expect(daemon, 200, 'GET', `${groom.at}/revisions?limit=2&before=${page.next}`)).json.revisions.map(({ revision }) => revision), [3, 2]);
    const back = await expect(daemon, 201, 'POST', `${groom.at}/revert`, { headers: { 'If-Match': '"5"' }, body: { revision: 1 } });
    assert.equal(back.json.revision, 6);
    const a = await expect(daemon, 200, 'GET', `${groom.at}/strands?revision=1`), b = await expect(daemon, 200, 'GET', `${groom.at}/strands`);
    assert.deepEqual(a.bytes, b.bytes);
  });
});

test('edits need the revision that they start from', async (t) => {
  const daemon = await startDaemon(t);
  const groom = await imported(daemon);
  const body = [{ op: 'replace', path: '/operators/1/radius', value: 0.02 }];
  await refused(daemon, 428, 'precondition-required', 'PATCH', groom.at, { headers: json_patch, body });
  await refused(daemon, 412, 'precondition-failed', 'PATCH', groom.at, { headers: { ...json_patch, 'If-Match': '"7"' }, body });
  await refused(daemon, 412, 'precondition-failed', 'PATCH', groom.at, { headers: { ...json_patch, 'If-Match': 'one' }, body });
  await refused(daemon, 428, 'precondition-required', 'POST', `${groom.at}/revert`, { body: { revision: 1 } });
  await refused(daemon, 428, 'precondition-required', 'PUT', `${groom.at}/guides`, { body: hair(4, 12) });
  await refused(daemon, 415, 'unsupported-media-type', 'PATCH', groom.at, { headers: { 'Content-Type': 'application/json', 'If-Match': '"1"' }, body });
  await refused(daemon, 404, 'not-found', 'PATCH', '/v1/grooms/grm_nothing', { headers: { ...json_patch, 'If-Match': '"1"' }, body });

  await t.test('of many at once one wins', async () => {
    const all = await Promise.all(Array.from({ length: 8 }, (_, i) =>
      call(daemon, 'PATCH', groom.at, { headers: { ...json_patch, 'If-Match': '"1"' }, body: [{ op: 'replace', path: '/operators/1/radius', value: 0.001 * (i + 1) }] })));
    assert.deepEqual(all.map(({ status }) => status).sort(), [201, 412, 412, 412, 412, 412, 412, 412]);
  });
});

test('bad patches are refused at the culprit and change nothing', async (t) => {
  const daemon = await startDaemon(t);
  const groom = await imported(daemon);
  const bad = async (body, problem, headers = json_patch) =>
    refused(daemon, 400, 'invalid-argument', 'PATCH', groom.at, { headers: { ...headers, 'If-Match': '"1"' }, body, problem });
  await bad([{ op: 'replace', path: '/operators/1/radius', value: -1 }], { pointer: '/operators/1/radius' });
  await bad([{ op: 'replace', path: '/operators/1/radius', value: 'x' }], { pointer: '/operators/1/radius' });
  await bad([{ op: 'replace', path: '/operators/9/radius', value: 1 }], { pointer: '/0/path' });
  await refused(daemon, 409, 'conflict', 'PATCH', groom.at, { headers: { ...json_patch, 'If-Match': '"1"' }, body: [{ op: 'test', path: '/name', value: 'another' }], problem: { pointer: '/0/value' } });
  await bad([{ op: 'spin', path: '/name' }], { pointer: '/0/op' });
  await bad([{ op: 'replace', path: '/id', value: 'grm_mine' }], { pointer: '/id' });
  await bad({ op: 'add' });
  await bad('[1e400]');
  await bad('nonsense');
  await bad('['.repeat(1000) + ']'.repeat(1000));
  await bad([{ op: 'copy', from: '', path: '/fit' }, ...Array.from({ length: 60 }, (_, i) => ({ op: 'copy', from: '/fit', path: `/fit/x${i}` }))], { detail: /copies more than/ });
  assert.equal((await expect(daemon, 200, 'GET', groom.at)).json.revision, 1);
});

test('dense strands and guides come out evaluated', async (t) => {
  const daemon = await startDaemon(t);
  const groom = await imported(daemon, { n: 50 });
  for (const [format, head] of [['hair', /^HAIR/], ['ply', /^ply/], ['obj', /^[#v]/], ['usda', /^#usda 1\.0/], ['json', /^\{/], ['data', /./s]]) {
    const { bytes, headers } = await expect(daemon, 200, 'GET', `${groom.at}/strands?format=${format}`);
    assert.match(bytes.toString('latin1'), head, format);
    assert.match(headers.get('content-disposition'), new RegExp(`filename="${groom.id}-1\\.`));
  }
  const { strands } = (await expect(daemon, 200, 'GET', `${groom.at}/strands?format=json`)).json;
  assert.equal(strands.length, 50);
  assert.equal(strands[0].length, 12);
  const in_cm = (await expect(daemon, 200, 'GET', `${groom.at}/strands?format=json&unit=cm&up=z`)).json.strands;
  for (const i of [0, 17, 49]) {
    assert.ok(Math.abs(in_cm[i][5][0] - strands[i][5][0] * 100) < 1e-3);
    assert.ok(Math.abs(in_cm[i][5][2] - strands[i][5][1] * 100) < 1e-3);
    assert.ok(Math.abs(in_cm[i][5][1] + strands[i][5][2] * 100) < 1e-3);
  }
  const few = (await expect(daemon, 200, 'GET', `${groom.at}/strands?format=json&count=10`)).json.strands;
  assert.equal(few.length, 10);
  for (const strand of few) assert.ok(strands.some((other) => JSON.stringify(other) === JSON.stringify(strand)));
  const file = await expect(daemon, 200, 'GET', `${groom.at}/strands`);
  await expect(daemon, 304, 'GET', `${groom.at}/strands`, { headers: { 'If-None-Match': file.headers.get('etag') } });
  assert.deepEqual((await expect(daemon, 206, 'GET', `${groom.at}/strands`, { headers: { Range: 'bytes=0-3' } })).text, 'HAIR');
  await refused(daemon, 400, 'invalid-argument', 'GET', `${groom.at}/strands?format=npz`, { problem: { parameter: 'format' } });
  await refused(daemon, 400, 'invalid-argument', 'GET', `${groom.at}/strands?count=0`, { problem: { parameter: 'count' } });
  await refused(daemon, 404, 'not-found', 'GET', `${groom.at}/strands?revision=2`);
  await refused(daemon, 404, 'not-found', 'GET', '/v1/grooms/grm_nothing/strands');

  await t.test('guides can be got, changed and put back', async () => {
    const { json } = await expect(daemon, 200, 'GET', `${groom.at}/guides?format=json`);
    assert.deepEqual(json.strands.flat(2).map(Math.fround), [...decode(groom_document().guides.points)]);
    const moved = json.strands.map((strand) => strand.map(([x, y, z]) => [x, y, z + 0.01]));
    const put = await expect(daemon, 201, 'PUT', `${groom.at}/guides`, { headers: { 'If-Match': '"1"' }, body: strands_json(moved) });
    assert.equal(put.json.revision, 2);
    const after = (await expect(daemon, 200, 'GET', `${groom.at}/guides?format=json`)).json.strands;
    assert.ok(Math.abs(after[1][3][2] - moved[1][3][2]) < 1e-5);
    await refused(daemon, 400, 'invalid-argument', 'PUT', `${groom.at}/guides`, { headers: { 'If-Match': '"2"' }, body: strands_json(points(3, 12)) });
    await refused(daemon, 415, 'unknown-format', 'PUT', `${groom.at}/guides`, { headers: { 'If-Match': '"2"' }, body: 'no strands' });
  });
});

test('pictures', async (t) => {
  const daemon = await startDaemon(t);
  const groom = await imported(daemon);
  for (const view of ['front', 'side', 'back', 'top']) {
    const { bytes, headers } = await expect(daemon, 200, 'GET', `${groom.at}/preview.png?view=${view}&size=96`);
    assert.equal(bytes.subarray(1, 4).toString(), 'PNG');
    assert.equal(bytes.readUInt32BE(16), 96);
    await expect(daemon, 304, 'GET', `${groom.at}/preview.png?view=${view}&size=96`, { headers: { 'If-None-Match': headers.get('etag') } });
  }
  await refused(daemon, 400, 'invalid-argument', 'GET', `${groom.at}/preview.png?view=below`, { problem: { parameter: 'view' } });
  await refused(daemon, 400, 'invalid-argument', 'GET', `${groom.at}/preview.png?size=9`, { problem: { parameter: 'size' } });
  await refused(daemon, 404, 'not-found', 'GET', '/v1/grooms/grm_nothing/preview.png');

  await t.test('from a camera of one\'s own', async () => {
    const get = async (query) => (await expect(daemon, 200, 'GET', `${groom.at}/preview.png?${query}`)).bytes;
    const wide = await get('size=160x96&eye=0.8,1.9,1.2&target=0,1.6,0&fov=0.4&light=front');
    assert.deepEqual([wide.readUInt32BE(16), wide.readUInt32BE(20)], [160, 96]);
    assert.notDeepEqual(wide, await get('size=160x96&eye=0.8,1.9,1.2&target=0,1.6,0&fov=0.4'));
    assert.deepEqual(await get('size=96&azimuth=0'), await get('size=96&view=front'));
    assert.notDeepEqual(await get('size=96&azimuth=0.7&elevation=0.3'), await get('size=96&azimuth=0.7&elevation=0.3&distance=3'));
    for (const [query, parameter] of [['view=side&azimuth=1', 'view'], ['eye=1,2,3', 'target'], ['eye=1,2,3&target=1,2,3', 'eye'],
      ['eye=1,2&target=0,0,0', 'eye'], ['elevation=2', 'elevation'], ['fov=3', 'fov'], ['distance=0', 'distance'], ['light=moon', 'light'],
      ['size=96x9', 'size'], ['size=96xx96', 'size'], ['target=nan,0,0', 'target']])
      await refused(daemon, 400, 'invalid-argument', 'GET', `${groom.at}/preview.png?${query}`, { problem: { parameter } });
  });
});

test('a turntable: an animated picture, and its frames as stills', async (t) => {
  const daemon = await startDaemon(t), groom = await imported(daemon), at = `${groom.at}/turntable.png?frames=4&size=80x64&elevation=0.2`;
  const { bytes, headers } = await expect(daemon, 200, 'GET', `${at}&frame_ms=50`), chunks = [];
  assert.equal(headers.get('content-type'), 'image/apng');
  for (let i = 8; i < bytes.length; i += 12 + bytes.readUInt32BE(i)) chunks.push([bytes.toString('latin1', i + 4, i + 8), bytes.subarray(i + 8, i + 8 + bytes.readUInt32BE(i))]);
  assert.deepEqual(chunks.map(([type]) => type), ['IHDR', 'sRGB', 'acTL', 'fcTL', 'IDAT', 'fcTL', 'fdAT', 'fcTL', 'fdAT', 'fcTL', 'fdAT', 'IEND']);
  assert.deepEqual(chunks.filter(([type]) => type === 'fcTL').map(([, data]) => [data.readUInt32BE(4), data.readUInt32BE(8), data.readUInt16BE(20), data.readUInt16BE(22)]),
    Array(4).fill([80, 64, 50, 1000]));
  const stills = await Promise.all([0, 1, 2, 3].map(async (k) => (await expect(daemon, 200, 'GET', `${at}&frame=${k}`)).bytes));
  assert.equal(new Set(stills.map((still) => still.toString('latin1'))).size, 4, 'each frame another picture');
  await expect(daemon, 304, 'GET', `${at}&frame=1`, { headers: { 'If-None-Match': (await expect(daemon, 200, 'GET', `${at}&frame=1`)).headers.get('etag') } });
  for (const [query, parameter] of [['frames=1', 'frames'], ['frames=4&frame=4', 'frame'], ['size=2000', 'size'], ['frames=120&size=1024', 'frames'], ['frame_ms=5', 'frame_ms']])
    await refused(daemon, 400, 'invalid-argument', 'GET', `${groom.at}/turntable.png?${query}`, { problem: { parameter } });
  await refused(daemon, 404, 'not-found', 'GET', '/v1/grooms/grm_nothing/turntable.png');
});
